"""Small sets of linear conditions that contradict each other, each with the multipliers
that prove it, in fractions.

Where A z >= b, 0 = (A'y)'z >= b'y for any y >= 0 with A'y = 0, which b'y > 0
contradicts. The supports of the vertices of {y >= 0 : A'y = 0, b'y = 1} are the
irreducible contradictions (J. Gleeson and J. Ryan, Identifying minimally infeasible
subsystems of inequalities, ORSA Journal on Computing 2 (1990) 61-63): the rows of such
a support have no other y with A'y = 0, and those of a part of it none at all, so that
all but one of them can be equations.

Linear programs in doubles find small supports: they minimize the sum of y, whose
weights are then changed to favour what is large (E. J. Candes, M. B. Wakin and S. P.
Boyd, Enhancing sparsity by reweighted l1 minimization, Journal of Fourier Analysis and
Applications 14 (2008) 877-905). On each support, A'y = 0 is solved in integers.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction

import numpy as np

from lcpcli.explanation.conditions import Condition, System, Values
from lcpcli.explanation.programs import matrix_of
from lcpcli.linalg.matrices import stack
from lcpcli.linalg.programs import minimized
from lcpcli.rational import elimination
from lcpcli.typing import Matrix, Vector

ROUNDS = 5  # of linear programs for small supports
LP_EFFORT = 2.0  # of each, by the seconds that so many iterations usually take
# For b'y, as the tolerances for A'y = 0 are absolute: the first is the safest one, the
# others are for y that are far larger than b.
TOTALS = (1.0, 1e-3, 1e-6)
# Relative to the largest multiplier: what counts as 0, one after another, as residues
# of the simplex method are as large as small multipliers of badly scaled rows.
TOLERANCES = (0.0, 1e-12, 1e-9)
# Relative to the largest multiplier: what is added to all of them in their weights.
SMALL = 1e-2
WEIGHT_OF_NEVER_BLAMED = 1e-3
# Relative to the sums of their terms in sizes: A'y is 0 up to rounding, and b'y is not.
ROUNDING, NOT_ROUNDING = 1e-12, 1e-9

Multipliers = Mapping[Condition, Fraction]


def contradictions(
    system: System, conditions: Sequence[Condition], never_blamed: Sequence[Condition]
) -> Iterator[tuple[Sequence[Condition], Multipliers | None]]:
    """Yield contradictions of linear conditions with their multipliers, irreducible
    ones, in which few are not `never_blamed`: those that linear programs in doubles
    show; and with None conditions that contradict each other only up to rounding."""
    forms = [system.entries(system.forms(each)[0]) for each in conditions]
    rows = [{j: Fraction(a, scale) for j, a in row.items()} for row, scale, _ in forms]
    A, b = matrix_of(rows, system.n), np.array([-float(end) for *_, end in forms])
    sizes = abs(A).max(axis=1).toarray().ravel()
    sizes = np.where(sizes > 0, sizes, 1.0)
    A, b = (A / sizes[:, np.newaxis]).tocsr(), b / sizes
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


def _in_doubles(A: Matrix, b: Vector, two: list[int], unit: Vector) -> Iterator[Vector]:
    """Yield multipliers y >= 0, or of `two` signs, with A'y = 0 and b'y > 0, of the
    least sum with changing weights, first these."""
    m, n = A.shape
    equations = stack([[A.T, -A.T[:, two]], [b[np.newaxis], -b[np.newaxis, two]]])
    bounds = np.zeros(m + len(two)), np.full(m + len(two), np.inf)
    cost = unit
    totals: Sequence[float] = TOTALS
    for _ in range(ROUNDS):
        for total in totals:
            right_side, costs = (
                np.append(np.zeros(n), total),
                np.append(cost, cost[two]),
            )
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
    """Return the multipliers, with b'y = 1, of the only contradiction of some linear
    conditions, which is irreducible then; None if there is none, or several."""
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
    return sum((a * b for a, b in zip(y, of, strict=True)), Fraction(0))


def point_without(
    system: System, members: Sequence[Condition], one: Condition
) -> Values:
    """Return a point at which all members of an irreducible contradiction hold but one:
    the others are equations there."""
    rows = [system.entries(system.forms(each)[0]) for each in members if each != one]
    columns = sorted({j for row, *_ in rows for j in row})
    A, right_side = list[list[int]](), list[int]()
    for row, scale, constant in rows:
        d = constant.denominator
        A.append([d * row.get(j, 0) for j in columns])
        right_side.append(int(-scale * constant * d))
    solution = elimination.solve(A, right_side)[0] if A else []
    assert solution is not None
    z = [Fraction(0)] * system.n
    for j, value in zip(columns, solution, strict=True):
        z[j] = value
    return system.filled(z)
