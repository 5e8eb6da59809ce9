"""Small sets of linear conditions that are inconsistent, each with multipliers that
prove it, in fractions.

If A z >= b, then 0 = (A'y)'z >= b'y for any y >= 0 with A'y = 0, which b'y > 0
contradicts. The supports of the vertices of {y >= 0 : A'y = 0, b'y = 1} are the
irreducible inconsistent sets (J. Gleeson and J. Ryan, Identifying minimally infeasible
subsystems of inequalities, ORSA Journal on Computing 2 (1990) 61-63): up to a factor,
the rows of such a support have no other y with A'y = 0, and a proper subset of them has
none, so that any proper subset can hold with equality.

Linear programs in floating-point arithmetic find small supports: they minimize the
weighted sum of y, and the weights are then changed to favour large components (E. J.
Candes, M. B. Wakin and S. P. Boyd, Enhancing sparsity by reweighted l1 minimization,
Journal of Fourier Analysis and Applications 14 (2008) 877-905). On each support, A'y =
0 is solved in integers.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction

import numpy as np

from lcpcli.explanation.conditions import Condition, System
from lcpcli.explanation.programs import matrix_of
from lcpcli.linalg.matrices import stack
from lcpcli.linalg.programs import minimized
from lcpcli.rational import elimination
from lcpcli.typing import Matrix, Vector

ROUNDS = 5  # the number of linear programs with changing weights
LP_EFFORT = 2.0  # limit on each, in seconds that its iterations usually take
# Values of b'y that are attempted, as the solver's tolerances for A'y = 0 are absolute:
# the first is the most reliable, the others are for y much larger than b.
TOTALS = (1.0, 1e-3, 1e-6)
# Multipliers below this, relative to the largest one, are considered 0. Several values
# are tested, as residues of the simplex method are as large as small multipliers of
# badly scaled rows.
TOLERANCES = (0.0, 1e-12, 1e-9)
# Added to the multipliers, relative to the largest one, before weights are inverse to
# them, which would otherwise be infinite.
SMALL = 1e-2
WEIGHT_OF_NEVER_BLAMED = 1e-3
SMALLEST_NORMAL = sys.float_info.min  # whose reciprocal is finite
# A'y is 0 up to rounding if it is below ROUNDING, relative to the sum of its |terms|;
# b'y is not 0 if it is above NOT_ROUNDING.
ROUNDING, NOT_ROUNDING = 1e-12, 1e-9

Multipliers = Mapping[Condition, Fraction]


def contradictions(
    system: System, conditions: Sequence[Condition], never_blamed: Sequence[Condition]
) -> Iterator[tuple[Sequence[Condition], Multipliers | None]]:
    """Yield irreducible inconsistent sets of linear conditions with their multipliers,
    with few conditions that are not `never_blamed`, as linear programs in
    floating-point arithmetic find them; and conditions with None that are inconsistent
    only up to rounding.
    """
    forms = [system.entries(system.forms(each)[0]) for each in conditions]
    rows = [{j: Fraction(a, scale) for j, a in row.items()} for row, scale, _ in forms]
    A, b = matrix_of(rows, system.n), np.array([-float(end) for *_, end in forms])
    sizes = abs(A).max(axis=1).toarray().ravel()
    sizes = np.where(sizes > 0, np.maximum(sizes, SMALLEST_NORMAL), 1.0)
    A, b = (A / sizes[:, np.newaxis]).tocsr(), _quotients(b, sizes)
    cost = np.array(
        [WEIGHT_OF_NEVER_BLAMED if each in never_blamed else 1.0 for each in conditions]
    )
    # An equation has multipliers of both signs.
    two = [i for i, each in enumerate(conditions) if len(system.forms(each)) == 2]
    seen = list[list[int]]()
    b /= np.abs(b).max(initial=0.0) or 1.0
    for y in _in_doubles(A, b, two, cost):
        for tol in TOLERANCES:
            support = np.flatnonzero(np.abs(y) > tol * np.abs(y).max()).tolist()
            if support in seen:
                continue
            seen.append(support)
            subset = [conditions[i] for i in support]
            if (multipliers := contradiction(system, subset)) is not None:
                yield subset, multipliers
                break
            if _contradicts_up_to_rounding(A[support], b[support], y[support]):
                yield subset, None


def _contradicts_up_to_rounding(A: Matrix, b: Vector, y: Vector) -> bool:
    """Return whether A'y = 0 up to rounding, and b'y > 0."""
    sizes = abs(A).T @ np.abs(y)
    is_zero = np.abs(A.T @ y) <= ROUNDING * sizes
    return bool(is_zero.all() and b @ y > NOT_ROUNDING * (np.abs(b) @ np.abs(y)))


def _quotients(b: Vector, sizes: Vector) -> Vector:
    """Return b / sizes times a power of 2 by which none of them overflows."""
    (mantissas, exponents), (divisors, others) = np.frexp(b), np.frexp(sizes)
    exponents = exponents - others
    largest = exponents.max(where=b != 0, initial=exponents.min(initial=0))
    quotients: Vector = np.ldexp(mantissas / divisors, exponents - largest)
    return quotients


def _in_doubles(A: Matrix, b: Vector, two: list[int], unit: Vector) -> Iterator[Vector]:
    """Yield multipliers with A'y = 0 and b'y > 0, y >= 0 except for the rows in `two`,
    which are equations, that minimize a weighted sum of |y|, at first with the weights
    `unit`.
    """
    m, n = A.shape
    equations = stack([[A.T, -A.T[:, two]], [b[np.newaxis], -b[np.newaxis, two]]])
    bounds = np.zeros(m + len(two)), np.full(m + len(two), np.inf)
    cost = unit
    totals: Sequence[float] = TOTALS
    for _ in range(ROUNDS):
        for total in totals:
            right_side = np.append(np.zeros(n), total)
            costs = np.append(cost, cost[two])
            lp_solution = minimized(
                costs, equations, (right_side, right_side), bounds, LP_EFFORT
            )
            if lp_solution is not None:
                break
        else:
            return
        totals, y = (total,), lp_solution.x[:m].copy()
        y[two] -= lp_solution.x[m:]
        yield y
        cost = unit / (np.abs(y) / np.abs(y).max() + SMALL)


def contradiction(system: System, of: Sequence[Condition]) -> Multipliers | None:
    """Return the multipliers, with b'y = 1, of linear conditions that have exactly one
    contradiction, which is then irreducible; None if they have none, or several.
    """
    rows = [system.entries(system.forms(each)[0]) for each in of]
    columns = {j for row, *_ in rows for j in row}
    A = [[row.get(j, 0) for row, *_ in rows] for j in sorted(columns)] or [
        [0] * len(of)
    ]
    vectors = elimination.solve(A, [0] * len(A))[1]
    totals = [-scale * constant for _, scale, constant in rows]
    if len(vectors) != 1 or not (total := _total(vectors[0], totals)):
        return None
    multipliers = {
        each: value * scale / total
        for each, value, (_, scale, _) in zip(of, vectors[0], rows, strict=True)
        if value
    }
    signs = (
        value > 0 or len(system.forms(each)) == 2 for each, value in multipliers.items()
    )
    return multipliers if all(signs) else None


def _total(y: Sequence[Fraction], of: Sequence[Fraction]) -> Fraction:
    """Return the inner product of two vectors."""
    return sum((a * b for a, b in zip(y, of, strict=True)), Fraction(0))
