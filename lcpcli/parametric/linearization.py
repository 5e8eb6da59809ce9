"""Which components of a solution stay at their bounds when the data change a little, and the systems of the others.

The solution is computed anew for its states, with a correction by w_B, so that its errors are those of rounding. A
component is at a kink if it is at a bound and w is 0, both up to rounding: up to the largest of the changes that it
undergoes when each row of M z + q changes by ROW_ROUNDING of its terms |M| |z| + |q|, with SAMPLES random choices of
the signs. Like these terms, this does not depend on units, and it grows with the condition of M_BB.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import cached_property
from typing import Any

import numpy as np

from lcpcli.errors import DerivativeError
from lcpcli.linalg import factors
from lcpcli.linalg.doubles import EPS, ROW_ROUNDING, distinct
from lcpcli.linalg.factors import Latest, SingularMatrix
from lcpcli.linalg.matrices import absolute_product, column_maxima, dense, product
from lcpcli.linalg.units import LEAST_DIGITS, PseudoInverse
from lcpcli.model.problem import Problem
from lcpcli.solving.result import Result
from lcpcli.typing import Indices, Mask, Matrix, Vector
from lcpcli.verify.digits import room, signs

MOST_EXCHANGES = 10  # of states that the corrected z shows to be wrong: a verified z has few of them
CORRECTIONS, SMALL_CHANGE = 2, 1e-8  # of z, and the relative size of one whose own error is rounding
MOST_DENSE = 2000  # variables of a singular block up to which its singular values are computed
CLEAR = 1e3  # times a crude bound on rounding: what is further from a kink needs no closer look


def linearization(result: Result, or_singular: bool) -> Linearization:
    """Return the linearization at a solution, which the result keeps; raise DerivativeError if there is none."""
    known: Linearization
    for known in result.linearizations:
        if or_singular or known.block is None:
            return known
    if not result.solved:
        raise DerivativeError("", f"no derivative, as the problem is not solved: {result.message}", result.advice)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        found = Linearization(result.problem, result.z, or_singular)
    result.linearizations.append(found)
    return found


class Linearization:
    """The solution and its states.

    z : the solution, shape (n,), corrected.
    basic : the indices B of the components between their bounds, where w = 0 and stays 0.
    kinks : the indices of those at a bound with w = 0, up to rounding, which may leave the bound or not.
    upper : where z is at its upper bound, shape (n,); a fixed one if w < 0.
    block : the generalized inverse of M_BB if this is singular, and may be; else None.
    """

    block: PseudoInverse | None = None

    def __init__(self, problem: Problem, z: Vector, or_singular: bool) -> None:
        self.problem, self.z, self._or_singular = problem, z, or_singular
        self._low, self._high = problem.box.lower, problem.box.upper
        basic, kinks = (z > self._low) & (z < self._high), np.zeros(problem.n, dtype=bool)
        for _ in range(MOST_EXCHANGES):
            near, wrong = self._corrected(basic)
            kinks |= near
            wrong &= ~kinks
            if not (wrong.any() or (kinks & basic).any()):
                break
            basic = (basic ^ wrong) & ~kinks
        else:
            raise DerivativeError("", "no derivative, as rounding leaves open which variables are at a bound")
        self.kinks = kinks.nonzero()[0]
        self.upper = ~basic & np.where(problem.box.fixed, self._w < 0, self.z == self._high)

    def _corrected(self, basic: Mask) -> Vector:
        """Compute z for these states; return which components satisfy the conditions of their states with no more
        than rounding to spare, and which violate them, shape (2, n)."""
        upper = self._high - self.z < self.z - self._low
        start = np.where(basic, self.z, np.where(upper, self._high, self._low))
        self.z, self.block = start.copy(), None
        B = self.basic = basic.nonzero()[0]
        try:
            self._factors = _two_way(self.problem.M, B, self.problem.latest) if B.size else lambda b, _=False: b
            return self._near_and_wrong(basic)
        except SingularMatrix:
            block = self._generalized(B) if self._or_singular else None
            if block is None or not block.is_singular:
                fault = f"the principal submatrix of the {B.size} variables between their bounds is singular"
                several = "so that z is one of several solutions, or may jump"
                raise DerivativeError("", f"no derivative: {fault}, {several}") from None
        self.z, self._factors, self.block = start, block, block
        return self._near_and_wrong(basic)

    def _near_and_wrong(self, basic: Mask) -> Vector:
        """Return what `_corrected` returns, after corrections of z; raise SingularMatrix."""
        problem, z, B = self.problem, self.z, self.basic
        w = self._w = problem.w(z)
        change = self._factors(w[B])
        z[B] -= change
        if self.block is None:
            moves = self._factors(signs(B.size, 1)[:, 0])
            full = np.zeros((2, z.size))
            full[:, B] = np.abs((change, moves))
            spare = room(problem.box, z, w, basic)
            if are_clear(spare, z, basic, full[0], full[1], problem.largest, problem.sizes_of_q[1]):
                return np.zeros((2, problem.n), dtype=bool)
        for _ in range(CORRECTIONS):
            self._w = problem.w(z)
            change = self._factors(self._w[B])
            z[B] -= change
        noise, spare = self._noise(), room(problem.box, z, self._w, basic)
        return np.array((np.abs(spare) <= noise, spare < -noise))

    def _noise(self) -> Vector:
        """Return what rounding does to basic z_i and other w_i, shape (n,); raise SingularMatrix where M_BB is."""
        M, q, z, B = self.problem.M, self.problem.q, self.z, self.basic
        changes = ROW_ROUNDING * (absolute_product(M, np.abs(z)) + np.abs(q))[:, np.newaxis] * signs(z.size)
        if B.size and self.block is None:
            block = M[B][:, B]
            known = 1 / column_maxima(block)
            natural = ROW_ROUNDING * absolute_product(block, known)[:, np.newaxis] * signs(B.size)
            if not np.abs(self._factors(natural) / known[:, np.newaxis]).max() < LEAST_DIGITS:
                raise SingularMatrix
        if B.size:
            moved = self._factors(changes[B])
            changes -= self.image(moved)
            changes[B] = np.abs(moved) + EPS * np.abs(z[B, np.newaxis])
        return np.asarray(np.abs(changes).max(axis=1))

    def solve(self, b: Vector, transposed: bool = False) -> Vector:
        """Return M_BB^-1 b, or M_BB'^-1 b, with one step of refinement, for b of shape (k,) or (k, m)."""
        x = self._factors(b, transposed)
        return np.asarray(x + self._factors(b - self.image(x, transposed)[self.basic], transposed))

    def image(self, x: Vector, transposed: bool = False) -> Vector:
        """Return M v, or M'v, shape (n,) or (n, m), for v_B = x and 0 elsewhere."""
        v = np.zeros((self.problem.n, *x.shape[1:]))
        v[self.basic] = x
        return product(self.problem.M.T if transposed else self.problem.M, v)

    @cached_property
    def _active(self) -> tuple[Indices, PseudoInverse | None]:
        """Return the variables with w = 0 and, if their block of M is singular, its generalized inverse."""
        if not self.kinks.size:
            return self.basic, self.block
        S = distinct(np.concatenate((self.basic, self.kinks)))
        found = self._generalized(S)
        return S, found if found is not None and found.is_singular else None

    def _generalized(self, P: Indices) -> PseudoInverse | None:
        """Return the generalized inverse of M_PP; None if that is large, or its numbers overflow."""
        with suppress(SingularMatrix):
            return PseudoInverse(np.asarray(dense(self.problem.M[P][:, P]))) if P.size <= MOST_DENSE else None
        return None

    def determines(self, J: Any) -> Mask:
        """Return for which rows of J, shape (k, n), J z is the same for all solutions with w = 0 where it is 0 at z."""
        S, block = self._active
        return np.ones(J.shape[0], dtype=bool) if block is None else block.determines(dense(J[:, S]))

    def refuse_contradiction(self, change: Vector, terms: Vector) -> None:
        """Raise DerivativeError unless w = 0 can be solved for these changes, which are sums of these terms."""
        for P, block in ((self.basic, self.block), self._active):
            if block is not None and not block.is_consistent(change[P], terms[P]):
                fault = "M, q and the bounds change so that equations w = 0 contradict each other"
                raise DerivativeError("", f"no derivative in this direction: {fault}, and one of them has to give way")


def are_clear(
    spare: Vector, z: Vector, basic: Mask, change: Vector, moves: Vector, largest: Any, largest_q: Any
) -> Mask:
    """Return whether all conditions are satisfied with far more to spare than a crude bound on rounding; shape () for
    one problem or (m,) for many, whose arrays are of shape (n, m).

    change : how far z has been changed since w, and what is to spare, were computed. moves : |M_BB^-1 v| for some v of
    signs. Both 0 where not basic. largest, largest_q : the largest |M_ij| and |q_i|.
    """
    z, crude = np.abs(z), CLEAR * ROW_ROUNDING
    largest_z, total = z.max(axis=0, initial=0.0), largest * moves.sum(axis=0)
    row = crude * (largest * z.sum(axis=0) + largest_q)
    of_others = row * (1 + total) + largest * change.sum(axis=0)
    needed = np.where(basic, row * moves.max(axis=0, initial=0.0) + crude * largest_z, of_others)
    settled = change.max(axis=0, initial=0.0) <= SMALL_CHANGE * largest_z
    return np.asarray(settled & (spare > needed).all(axis=0) & (crude * total < LEAST_DIGITS))


def _two_way(M: Matrix, indices: Indices, latest: Latest) -> Callable[..., Vector]:
    """Return a solver solve(b, transposed=False) of systems with M_PP or its transpose, from one factorization, perhaps
    the last one, and without refinement; this function or the solver raises SingularMatrix if M_PP is singular."""
    kept = latest.kept
    if kept is not None and np.array_equal(kept[0], indices):
        return kept[1]
    return factors.solver(M[indices][:, indices])
