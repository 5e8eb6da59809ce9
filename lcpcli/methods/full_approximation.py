"""Nested iteration for the active set of a sparse problem: coarse versions of the problem, solved roughly.

A. Brandt and C. W. Cryer, Multigrid algorithms for the solution of linear complementarity problems arising from free
boundary problems, SIAM Journal on Scientific and Statistical Computing 4 (1983) 655-684. Here the coarse versions come
from the matrix alone, and each coarse correction has the length that minimizes the energy, as they are too stiff
(D. Braess, Towards algebraic multigrid for elliptic problems of second order, Computing 55 (1995) 379-393). What comes
out is not exact, but its active set is wrong only close to its edge.
"""

from __future__ import annotations

import numpy as np

from lcpcli.interrupts import check
from lcpcli.linalg.krylov import dot
from lcpcli.methods.multilevel import Hierarchy
from lcpcli.model.box import BASIC, Box
from lcpcli.typing import Mask, States, Vector

CYCLES = 2  # on each level, with as many on all coarser levels inside each
LARGE = 30_000  # unknowns from which steps of pivoting cost much more than
MORE_CYCLES, FEWER = 8, 0.7  # cycles on the finest level, while each changes fewer states than that share of the last
SWEEPS = 2  # of projected Jacobi relaxation before, and after, each coarse correction
LONGEST_STEP = 3.0  # times the coarse correction
COARSEST_PIVOTS = 30  # at most; the coarsest problem rarely takes more than a handful


class FullApproximation:
    """Approximate solutions of the problem of a matrix, given by q and bounds, on each level of a hierarchy."""

    def __init__(self, hierarchy: Hierarchy, q: Vector, box: Box) -> None:
        self._levels, self._q, self._boxes = hierarchy, [q], [box]
        for R, T in zip(hierarchy.restrictions, hierarchy.tentative, strict=True):
            self._q.append(R @ self._q[-1])
            self._boxes.append(self._boxes[-1].mapped(T.T.__matmul__))

    def solution(self) -> Vector:
        """Return an approximate solution, which is 0 or the nearest bounds where cycles diverge."""
        z = self._boxes[-1].project(np.zeros(self._q[-1].size))
        z = self._coarsest(z, self._q[-1])
        for level in reversed(range(len(self._levels.restrictions))):
            q, box = self._q[level], self._boxes[level]
            z = box.project(self._levels.prolongations[level] @ z)
            for _ in range(CYCLES):
                z = self._cycle(level, z, q)
            other = box.project(np.zeros(q.size))
            if not self._energy(level, z) <= self._energy(level, other):
                z = other
        return self._settled(z) if z.size >= LARGE else z

    def _settled(self, z: Vector) -> Vector:
        """Return z on the finest level after more cycles, while each changes far fewer states than the one before."""
        states, changed = self._states(z), z.size
        for _ in range(MORE_CYCLES):
            z = self._cycle(0, z, self._q[0])
            before, states, most = states, self._states(z), FEWER * changed
            changed = int(np.count_nonzero(states != before))
            if changed > most:
                break
        return z

    def _states(self, z: Vector) -> States:
        w = self._levels.operators[0](z)
        w += self._q[0]
        w *= self._levels.weights[0]
        return self._boxes[0].basis_at(z, w)

    def _energy(self, level: int, z: Vector) -> float:
        w = self._levels.operators[level](z)
        w *= 0.5
        w += self._q[level]
        return dot(z, w)

    def _cycle(self, level: int, z: Vector, q: Vector) -> Vector:
        """Return a better z for A z + q, with A the matrix of the level."""
        check()
        levels, box = self._levels, self._boxes[level]
        if level == len(levels.restrictions):
            return self._coarsest(z, q)
        A, P, T = levels.operators[level], levels.prolongations[level], levels.tentative[level]
        z = self._relaxed(level, z, q)
        w = A(z)
        w += q
        free = _free(box, z, w)
        partly = np.bincount(T.indices, weights=free, minlength=T.shape[1]) > 0
        coarse, given = T.T @ z, np.where(free | ~partly[T.indices], w, 0.0)
        own = levels.restrictions[level] @ given - levels.matrices[level + 1] @ coarse
        better = coarse
        for _ in range(CYCLES if level else 1):
            better = self._cycle(level + 1, better, own)
        released = (~partly & (better != coarse))[T.indices]
        change = np.where(free | released, P @ (better - coarse), 0.0)
        curvature = dot(change, A(change))
        if curvature > 0:
            change *= min(max(-dot(w, change) / curvature, 0.0), LONGEST_STEP)
        return self._relaxed(level, box.project(z + change), q)

    def _relaxed(self, level: int, z: Vector, q: Vector) -> Vector:
        A, weights, load = self._levels.operators[level], self._levels.weights[level], -q
        for _ in range(SWEEPS):
            z = self._boxes[level].project(A.relaxed(z, load, weights))
        return z

    def _coarsest(self, z: Vector, q: Vector) -> Vector:
        """Return the solution on the coarsest level by block pivoting from z, or where that cycles."""
        A, box = self._levels.coarsest, self._boxes[-1]
        basis = box.basis_at(z, A @ z + q)
        for _ in range(COARSEST_PIVOTS):
            z = box.nonbasic(basis)
            own = (basis == BASIC).nonzero()[0]
            z[own] = np.linalg.solve(A[np.ix_(own, own)], -(A @ z + q)[own])
            w = A @ z + q
            w[own] = 0.0
            wrong = box.wrong(z, w, basis)
            if not np.count_nonzero(wrong):
                break
            basis = box.exchanged(basis, wrong, z)
        return box.project(z)


def _free(box: Box, z: Vector, w: Vector) -> Mask:
    """Return where z is not held at a bound by w."""
    return np.asarray(((box.lower < z) & (z < box.upper)) | (box.project(z - w) != z))
