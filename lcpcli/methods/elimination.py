"""Elimination for tridiagonal LCPs with an M-matrix, as for American options and optimal stopping.

Where the basic variables lie at one end:
M. J. Brennan and E. S. Schwartz, The valuation of American put options, Journal of Finance 32 (1977) 449-462: Gaussian
elimination from the end of the basic variables, and in the substitution back from the other end max(0, .) in each step.
For M-matrices that is the solution if the basic variables do lie at that end (P. Jaillet, D. Lamberton and B. Lapeyre,
Variational inequalities and the pricing of American options, Acta Applicandae Mathematicae 21 (1990) 263-289).

Wherever they lie: one unknown after another is added to the problem, and as none that is basic ever ceases to be so (R.
Chandrasekaran, A special case of the complementary pivot problem, Opsearch 7 (1970) 263-268), O(n) operations suffice
(R. W. Cottle and R. S. Sacher, On the solution of large, structured linear complementarity problems: the
tridiagonal case, Applied Mathematics and Optimization 3 (1977) 321-340). What is found has to be verified.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.matrices import is_sparse, width
from lcpcli.methods.newton import from_states
from lcpcli.methods.stages import Finished, Iterate, Stage, Stalled
from lcpcli.model.box import of_masks
from lcpcli.model.problem import Problem
from lcpcli.typing import Mask, Matrix, States, Vector
from lcpcli.verify.point import Criterion, Point

Run: TypeAlias = tuple[int, float, float, float, float, float, float]
"""Consecutive basic variables from s to e: s, z_s, z_e, and G_ss, G_se, G_es, G_ee of the inverse G of their block."""


class Elimination:
    """The factors of a tridiagonal M-matrix by elimination from its first row on, or from its last row on."""

    def __init__(self, M: Matrix, from_last: bool) -> None:
        with imports:
            from scipy.linalg.lapack import dtbtrs
        self._solve, self.turn = dtbtrs, -1 if from_last else 1
        below, diagonal, above = (M.diagonal(side)[:: self.turn] for side in (-1, 0, 1))
        if from_last:
            below, above = above, below
        pivots, factors = [float(diagonal[0])], list[float]()
        for beneath, pivot, over in zip(below.tolist(), diagonal[1:].tolist(), above.tolist(), strict=True):
            factors.append(beneath / pivots[-1] if pivots[-1] else np.inf)
            pivots.append(pivot - factors[-1] * over)
        self.L, self.U = np.ones((2, diagonal.size), order="F"), np.zeros((2, diagonal.size), order="F")
        self.L[1, :-1], self.U[0, 1:], self.U[1] = factors, above, pivots

    @property
    def is_of_m_matrix(self) -> bool:
        """Return whether M is an M-matrix: no entry off the diagonal is positive, and all pivots are."""
        are_pivots = np.isfinite(self.U).all() and (self.U[1] > 0.0).all()
        return bool(are_pivots and (self.U[0] <= 0.0).all() and (self.L[1, :-1] <= 0.0).all())

    def solution(self, q: Vector) -> tuple[Vector, States]:
        """Return z of shape (n,) for a q, and the states with the variables basic up to the last one, in the order of
        elimination, that is positive."""
        n = q.size
        y = self._solve(self.L, -q[:: self.turn], uplo="L", diag="U")[0]
        count = n - int((y[::-1] > 0.0).argmax()) if (y > 0.0).any() else 0
        z, basic = np.zeros(n), np.zeros(n, np.bool_)
        if count:
            z[:count] = self._solve(self.U[:, :count], y[:count], uplo="U")[0]
        basic[:count] = True
        return np.maximum(z, 0.0)[:: self.turn].copy(), of_masks(basic[:: self.turn])


def is_tridiagonal(M: Matrix) -> bool:
    """Return whether M is sparse and tridiagonal."""
    return bool(is_sparse(M) and M.shape[0] > 1 and M.nnz <= 3 * M.shape[0] and width(M) <= 1)


def eliminated(problem: Problem) -> Stage:
    """Yield the solutions by elimination from both ends, then the one of basic variables anywhere; M is tridiagonal.

    Stalled : M is no M-matrix, or rounding has led to wrong states."""
    criterion, count = Criterion(problem), 0
    for count, elimination in enumerate(eliminations(problem.M), 1):
        z, basis = elimination.solution(problem.q)
        if Point(criterion, z).solves():
            yield Iterate(problem.box.x_within(z, problem.w(z), basis), None, "", count)
            return Finished()
    basic = _basic(problem) if count else None
    if basic is None:
        return Stalled("M is no tridiagonal M-matrix")
    return (yield from from_states(problem, of_masks(basic)))


def _basic(problem: Problem) -> Mask | None:
    """Return which variables are basic at the solution; None if M turns out to be no M-matrix."""
    q = problem.q.tolist()
    below, diagonal, above = (problem.M.diagonal(side).tolist() for side in (-1, 0, 1))
    basic, runs, ends = np.zeros(problem.n, np.bool_), list[Run](), list[int]()
    for k in range(len(q)):
        i, right, end = k, None, k  # the run to the right of i, and where it ends
        while True:
            before = ends[-1] if ends else -1
            w = q[i] + (below[i - 1] * runs[-1][2] if before == i - 1 >= 0 else 0.0)
            if w + (above[i] * right[1] if right is not None else 0.0) >= 0.0:
                break
            inverse = 1.0 / diagonal[i]
            run: Run | None = (i, -q[i] * inverse, -q[i] * inverse, inverse, inverse, inverse, inverse)
            if right is not None and run is not None:
                run = _joined(run, right, below[i], above[i])
            if before == i - 1 >= 0 and run is not None:
                ends.pop()
                run = _joined(runs.pop(), run, below[i - 1], above[i - 1])
            if run is None:
                return None
            right, i = run, run[0] - 1
            if i < 0:
                break
        if right is not None:
            runs.append(right)
            ends.append(end)
    for run, end in zip(runs, ends, strict=True):
        basic[run[0] : end + 1] = True
    return basic


def _joined(left: Run, right: Run, below: float, above: float) -> Run | None:
    """Return two neighbouring runs as one, coupled by the entries of M below and above the diagonal between them; None
    if the block is singular, or has a negative determinant."""
    s, zs, ze, ss, se, es, ee = left
    _, ys, ye, tt, tf, ft, ff = right
    up, down = -above, -below
    D = 1.0 - ee * up * tt * down
    if not D > 0.0:
        return None
    z_left, z_right = (ze + ee * up * ys) / D, (ys + tt * down * ze) / D
    return (
        s,
        zs + se * up * z_right,
        ye + ft * down * z_left,
        ss + se * up * tt * down * es / D,
        se * up * tf / D,
        ft * down * es / D,
        ff + ft * down * ee * up * tf / D,
    )


def eliminations(M: Matrix) -> Iterator[Elimination]:
    """Yield the eliminations from both ends, if M is a sparse tridiagonal M-matrix."""
    if not is_tridiagonal(M):
        return
    for from_last in (True, False):
        own = Elimination(M, from_last)
        if not own.is_of_m_matrix:
            return
        yield own
