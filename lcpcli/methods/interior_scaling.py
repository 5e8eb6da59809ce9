"""The problem that the interior point method works on, without fixed variables, in units of about 1; and proofs that it
has no solution, from iterates that diverge: Farkas' y is the direction in which they do."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.units import units
from lcpcli.model.changes import Change
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.typing import Indices, Matrix, Vector
from lcpcli.verify.alternative import simplest
from lcpcli.verify.certificate import Certificate, first_proof
from lcpcli.verify.farkas import Multiplied

RUIZ_ROUNDS, RUIZ_CLOSE = 12, 0.1  # at most; it ends when the largest entries are so close to 1
RUIZ_FARTHEST = 1e8  # the factor by which Ruiz's scaling may change the start: half of the digits
ENTRIES_FAR_APART = 60.0  # binary digits between entries of M: more than a double has
DIVERGED_SIZE = 1e2  # in scaled units, in which solutions are about 1: what diverges is at least that large
COARSE_ENTRY = 1e-3  # relative to the largest entry of y: smaller ones are left out first
CLEAR_MARGIN = 1e-10  # relative to the sum of |y|: by how much a proof has to be negative, far above rounding
ROUGHLY_ZERO, NEARLY_ZERO = 1e-2, 1e-5  # relative to the sum of |y|: what counts as 0 before and after rounding y


@dataclass(eq=False, repr=False)
class SlackForm(Change):
    """The variables `kept` of a problem, for z = units z'; the others are fixed.

    S : signs with S M symmetric; None if there are none, or M is dense.
    low, high : the indices with finite lower and finite upper bounds.
    """

    kept: Indices
    units: Vector
    S: Vector | None
    low: Indices
    high: Indices

    @property
    def pairs(self) -> int:
        """Return the number of finite bounds."""
        return self.low.size + self.high.size

    def back(self, x: Vector) -> Vector:
        """Return the x of the admissible z of the original problem, and of its w there."""
        z = np.full(self.original.n, self.original.lower, dtype=float)
        z[self.kept] = self.problem.box.z_of(x) * self.units
        z = self.original.box.project(z)
        return self.original.box.x_of(z, self.original.w(z))

    def multipliers(self, y: Vector) -> Vector:
        whole = np.zeros(self.original.n)
        whole[self.kept] = y * self.units
        return whole


@np.errstate(over="ignore", under="ignore", invalid="ignore")
def slack_form(problem: Problem, by_units: bool = False) -> SlackForm:
    """Scale symmetrically: D M D has largest entries of about 1 in rows and columns (D. Ruiz, A scaling algorithm to
    equilibrate both rows and columns norms in matrices, RAL-TR-2001-034); q and the bounds are divided by the largest.

    by_units : whether D are the units by which solutions are verified, where S M is symmetric: there D is the same for
        rows and columns, and the logarithms of the entries of D M D have the least sum of squares.
    """
    given = conditions_of(problem)
    kept = np.flatnonzero(given.lower < given.upper)
    M, q, lower, upper = given.M, given.q, given.lower, given.upper
    if kept.size < problem.n:
        fixed = np.where(lower == upper, lower, 0.0)
        q, M = (problem.q + M @ fixed)[kept], matrices.principal(M, kept)
        lower, upper = lower[kept], upper[kept]
    if by_units and problem.signs is not None:
        d = problem.units.diagonals()[0][kept]
    else:
        d = _ruiz(M, _balanced(M), problem.signs is not None)
    M = matrices.scaled(M, d, d)
    q, lower, upper = q * d, lower / d, upper / d
    finite = [v[np.isfinite(v)] for v in (lower, upper)]
    largest = max(float(np.abs(v).max(initial=0.0)) for v in (q, *finite)) or 1.0
    largest = float(np.exp2(np.rint(np.log2(largest))))
    S = None if problem.signs is None else problem.signs[kept]
    ends = np.flatnonzero(np.isfinite(lower)), np.flatnonzero(np.isfinite(upper))
    (M.data if is_sparse(M) else M).setflags(write=False)  # so that it is not copied again
    inner = Problem(M, q / largest, lower=lower / largest, upper=upper / largest)
    return SlackForm(inner, problem, kept, d * largest, S, *ends)


def _balanced(M: Matrix) -> Vector:
    """Return a diagonal D for which the entries of D M D are about 1, if they are far apart, as Ruiz's scaling is not
    unique for bipartite parts of M; else a common factor, if they are all far from 1."""
    numbers = M.data if is_sparse(M) else M
    sizes = np.log2(np.abs(numbers[numbers != 0]))
    if sizes.size and np.ptp(sizes) > ENTRIES_FAR_APART:
        found = units(M)
        return np.asarray(np.exp2(np.rint((found.rows + found.columns) / 2)))
    middle = -0.5 * float(sizes.max(initial=0.0))
    return np.full(M.shape[0], np.exp2(np.rint(middle)) if abs(middle) > ENTRIES_FAR_APART / 2 else 1.0)


def _ruiz(M: Matrix, start: Vector, symmetric: bool) -> Vector:
    """Return Ruiz's scaling from a start, within a factor of RUIZ_FARTHEST of the start; symmetric : whether |M| is."""
    d = start
    for _ in range(RUIZ_ROUNDS):
        sizes = np.maximum(*matrices.row_and_column_maxima(M, d, d, symmetric))
        sizes[sizes == 0] = 1.0
        d = np.clip(d / np.sqrt(sizes), start / RUIZ_FARTHEST, start * RUIZ_FARTHEST)
        if (np.abs(sizes - 1) < RUIZ_CLOSE).all():
            break
    return np.exp2(np.rint(np.log2(d)))  # so that nothing is rounded, and symmetry is kept


def proof_of(problem: Problem, within: SlackForm, directions: Sequence[Vector]) -> Certificate | None:
    """Return the certificate from one of the directions, or from its part with one of the signs S; None if none of
    these is a proof."""
    given, S = conditions_of(problem), within.S
    least, most = np.where(np.isfinite(given.lower), 0.0, -np.inf), np.where(np.isfinite(given.upper), 0.0, np.inf)
    for direction in (each for each in directions if np.abs(each).max() > DIVERGED_SIZE):
        parts = [] if S is None else [np.where(s == S, direction, 0.0) for s in (1, -1)]
        for part in (*parts, direction):
            y = np.clip(within.multipliers(part), least, most)
            if not _is_clear(within, y, ROUGHLY_ZERO):
                continue
            candidates = [each for each in _simplest_first(y) if _is_clear(within, each, NEARLY_ZERO)]
            found = first_proof(problem, candidates)
            if found is not None:
                return found
    return None


def _simplest_first(y: Vector) -> Iterator[Vector]:
    """Yield vectors that y may approximate: integers, fractions, and y itself, without and with small entries."""
    for least in (COARSE_ENTRY * float(np.abs(y).max()), 0.0):
        yield from reversed(list(simplest(np.where(np.abs(y) < least, 0.0, y))))


def _is_clear(within: SlackForm, y: Vector, nearly: float) -> bool:
    """Return whether y is nearly a proof that does not depend on the last digits of the data, which may have been
    rounded from data that have a solution: in scaled units and floats, which are quicker than exact arithmetic."""
    y, inner = y[within.kept] / within.units, within.problem
    of, size = Multiplied(inner.M, inner.q, y, inner.box), float(np.abs(y).sum())
    return bool(of.excess.max(initial=0.0) <= nearly * size and of.total < -CLEAR_MARGIN * size)
