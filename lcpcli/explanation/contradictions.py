"""Small sets of linear conditions that are inconsistent, each with multipliers that
prove it, in fractions.

If A z >= b, then 0 = (A'y)'z >= b'y for any y >= 0 with A'y = 0, which b'y > 0
contradicts. The supports of the vertices of {y >= 0 : A'y = 0, b'y = 1} are the
irreducible inconsistent sets (J. Gleeson and J. Ryan, Identifying minimally infeasible
subsystems of inequalities, ORSA Journal on Computing 2 (1990) 61-63): up to a factor,
the rows of such a support have no other y with A'y = 0, and a proper subset of them has
none, so that any proper subset can hold with equality.

A deletion filter (J. W. Chinneck and E. W. Dravnieks, ORSA Journal on Computing 3
(1991) 157-168) finds a small support: rows before bounds, many at a time and then
fewer, it removes what the others contradict each other without, and all that the
multipliers of these others do not need. Its linear programs are solved in
floating-point arithmetic. Which conflict it finds depends on the order of the rows, so
that several are tried; the first begins with multipliers of few nonzeros (E. J. Candes,
M. B. Wakin and S. P. Boyd, Enhancing sparsity by reweighted l1 minimization, Journal of
Fourier Analysis and Applications 14 (2008) 877-905). On the smallest support, A'y = 0
is solved in integers.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from lcpcli.explanation.conditions import Condition, System
from lcpcli.explanation.programs import matrix_of
from lcpcli.interrupts import raise_if_timed_out
from lcpcli.linalg.matrices import stack
from lcpcli.linalg.programs import minimized
from lcpcli.rational import elimination
from lcpcli.typing import Mask, Vector

ROUNDS = 4  # the number of linear programs with changing weights
# Multiples of these numbers, without their integer parts, order the rows.
ORDERS = (2**0.5, 3**0.5, 5**0.5)
MAX_PROGRAMS = 300  # after which no other order is tried
LP_EFFORT = 2.0  # limit on each, in seconds that its iterations usually take
# Values of b'y that are attempted, as the solver's tolerances for A'y = 0 are absolute:
# the first is the most reliable, the others are for y much larger than b.
TOTALS = (1.0, 1e-3, 1e-6)
# Multipliers below this, relative to the largest one, are considered 0. Several values
# are tested, as residues of the simplex method are as large as small multipliers of
# badly scaled rows.
TOLERANCES = (1e-9, 1e-12, 0.0)
# Added to the multipliers, relative to the largest one, before weights are inverse to
# them, which would otherwise be infinite.
SMALL = 1e-2
WEIGHT_OF_NEVER_BLAMED = 1e-3
SMALLEST_NORMAL = sys.float_info.min  # whose reciprocal is finite
# A'y is 0 up to rounding if it is below ROUNDING, relative to the sum of its |terms|;
# b'y is not 0 if it is above NOT_ROUNDING.
ROUNDING, NOT_ROUNDING = 1e-12, 1e-9

Multipliers = Mapping[Condition, Fraction]


class Contradiction(NamedTuple):
    """Linear conditions that contradict each other, and their multipliers; None if they
    contradict each other only up to rounding.
    """

    conditions: Sequence[Condition]
    multipliers: Multipliers | None


def smallest(
    system: System, conditions: Sequence[Condition], never_blamed: Sequence[Condition]
) -> Contradiction | None:
    """Return an irreducible contradiction of linear conditions, with few rows, and then
    few bounds, that are not `never_blamed`; if none is proved, one that holds up to
    rounding; None if the linear programs find none.
    """
    if not conditions:
        return None
    blamed = np.array([each not in never_blamed for each in conditions])
    is_row = np.array([not system.is_bound(each) for each in conditions])
    program = _Program(system, conditions, blamed)
    supports = [
        (int((used & is_row & blamed).sum()), int((used & blamed).sum()), y)
        for y in program.supports(blamed & is_row, blamed & ~is_row)
        if (used := y != 0).any()
    ]
    near: Contradiction | None = None
    for *_, y in sorted(supports, key=lambda each: each[:2]):
        for tol in TOLERANCES:
            support = _support(y, tol)
            subset = [
                each for each, is_in in zip(conditions, support, strict=True) if is_in
            ]
            if (multipliers := contradiction(system, subset)) is not None:
                return Contradiction(subset, multipliers)
            if near is None and program.contradicts_up_to_rounding(y, support):
                near = Contradiction(subset, None)
    return near


class _Program:
    """The program for multipliers of linear conditions, with A'y = 0 and a positive
    b'y, y >= 0 except for equations, that minimize the sum of |y|.

    solved : the number of programs that have been solved.
    """

    def __init__(
        self, system: System, conditions: Sequence[Condition], blamed: Mask
    ) -> None:
        forms = [system.entries(system.forms(each)[0]) for each in conditions]
        rows = [
            {j: Fraction(a, scale) for j, a in row.items()} for row, scale, _ in forms
        ]
        A, b = matrix_of(rows, system.n), np.array([-float(end) for *_, end in forms])
        sizes = abs(A).max(axis=1).toarray().ravel()
        sizes = np.where(sizes > 0, np.maximum(sizes, SMALLEST_NORMAL), 1.0)
        self._A, b = (A / sizes[:, np.newaxis]).tocsr(), _quotients(b, sizes)
        self._b = b = b / (np.abs(b).max(initial=0.0) or 1.0)
        # An equation has multipliers of both signs.
        self._two = [
            i for i, each in enumerate(conditions) if len(system.forms(each)) == 2
        ]
        columns, others = self._A.T, self._A.T[:, self._two]
        self._equations = stack(
            [[columns, -others], [b[np.newaxis], -b[np.newaxis, self._two]]]
        )
        self.weights = np.where(blamed, 1.0, WEIGHT_OF_NEVER_BLAMED)
        self._total, self.solved = TOTALS[0], 0

    def minimizer(self, allowed: Mask, weights: Vector | None = None) -> Vector | None:
        """Return multipliers that are 0 unless they are allowed; None if there are
        none.
        """
        raise_if_timed_out()
        self.solved += 1
        m, two = allowed.size, self._two
        weights = self.weights if weights is None else weights
        upper = np.where(allowed, np.inf, 0.0)
        upper = np.append(upper, upper[two])
        right_side = np.append(np.zeros(self._A.shape[1]), self._total)
        optimum = minimized(
            np.append(weights, weights[two]),
            self._equations,
            (right_side, right_side),
            (np.zeros(upper.size), upper),
            LP_EFFORT,
        )
        if optimum is None:
            return None
        y: Vector = optimum.x[:m].copy()
        y[two] -= optimum.x[m:]
        return y

    def supports(self, rows: Mask, bounds: Mask) -> Iterator[Vector]:
        """Yield multipliers whose support is not reducible in floating-point
        arithmetic, from several orders of the rows that may be blamed.
        """
        everything = np.ones(rows.size, bool)
        sparse = self._sparse(everything)
        if sparse is None:
            return
        yield sparse
        allowed = _support(sparse, TOLERANCES[0]) | ~rows
        for factor in (0.0, *ORDERS):
            fraction = factor * np.arange(rows.size) % 1.0
            order = np.argsort(fraction, kind="stable")
            for part in (rows, bounds):
                self._reduce([i for i in order if part[i] and allowed[i]], allowed)
            if (y := self.minimizer(allowed)) is not None:
                yield y
            if self.solved > MAX_PROGRAMS:
                return
            allowed = everything.copy()

    def _sparse(self, allowed: Mask) -> Vector | None:
        """Return multipliers with few nonzeros; None if there are none."""
        for self._total in TOTALS:
            if (sparsest := self.minimizer(allowed)) is not None:
                break
        else:
            return None
        y: Vector | None = sparsest
        for _ in range(ROUNDS):
            if y is None:
                break
            if np.count_nonzero(y) < np.count_nonzero(sparsest):
                sparsest = y
            weights = self.weights / (np.abs(y) / np.abs(y).max() + SMALL)
            y = self.minimizer(allowed, weights)
        return sparsest

    def _reduce(self, part: list[int], allowed: Mask) -> None:
        """Forbid each index of a part without which there are multipliers, halves
        first.
        """
        size = len(part)
        while part and size:
            size = (size + 1) // 2
            start = 0
            while start < len(part):
                fewer = allowed.copy()
                fewer[part[start : start + size]] = False
                y = self.minimizer(fewer)
                used = fewer & _support(y, TOLERANCES[0])
                if y is None:
                    start += size
                    continue
                allowed[part] = used[part]
                start = int(used[part[:start]].sum())
                part = [i for i in part if used[i]]
            if size == 1:
                return

    def contradicts_up_to_rounding(self, y: Vector, support: Mask) -> bool:
        """Return whether A'y = 0 up to rounding, and b'y > 0, for a part of y."""
        A, b, y = self._A[support], self._b[support], y[support]
        is_zero = np.abs(A.T @ y) <= ROUNDING * (abs(A).T @ np.abs(y))
        return bool(is_zero.all() and b @ y > NOT_ROUNDING * (np.abs(b) @ np.abs(y)))


def _support(y: Vector | None, tol: float) -> Any:
    """Return where multipliers are larger than `tol` times the largest one."""
    return y is not None and np.abs(y) > tol * np.abs(y).max()


def _quotients(b: Vector, sizes: Vector) -> Vector:
    """Return b / sizes times a power of 2 by which none of them overflows."""
    (mantissas, exponents), (divisors, others) = np.frexp(b), np.frexp(sizes)
    exponents = exponents - others
    largest = exponents.max(where=b != 0, initial=exponents.min(initial=0))
    quotients: Vector = np.ldexp(mantissas / divisors, exponents - largest)
    return quotients


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
