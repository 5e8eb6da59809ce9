"""An LCP or a mixed problem with rational data, and the exact verification of a
solution z or of a Farkas vector y.

Each row of [M | q] is stored in integers, multiplied by the least common denominator of
its entries: the solutions z are the same, and sums of products need no greatest common
divisors.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import cached_property
from itertools import chain, repeat
from operator import mul
from typing import Any, TypeAlias

import numpy as np

from lcpcli.clock import imports
from lcpcli.interrupts import in_time
from lcpcli.linalg.matrices import is_sparse, scaled
from lcpcli.linalg.patterns import connected
from lcpcli.model.box import BASIC
from lcpcli.model.problem import Problem
from lcpcli.rational.numbers import (
    LARGEST_INTEGER,
    Doubles,
    dot,
    over_one_denominator,
    shortest_decimal,
    written,
    zeros,
)
from lcpcli.typing import BasisStatus, Indices, Matrix, Vector

Rows = list[dict[int, Fraction]]  # the nonzero entries of each row, by their columns
Bounds = list[Fraction | None]  # None for an infinite bound
# M, q (which may be None), and bounds.
ExactParts: TypeAlias = tuple[Rows, list[Fraction] | None, Bounds | None, Bounds | None]


class ExactProblem:
    """A problem with exact data.

    problem : the problem rounded to double precision.
    lower, upper : the bounds of z; None for those of an LCP.
    rows, constants, scales : integers with rows[i][j] / scales[i] = M_ij, constants[i]
        / scales[i] = q_i; scales > 0.
    """

    def __init__(
        self,
        problem: Problem,
        M: Any,
        q: Any,
        lower: Bounds | None = None,
        upper: Bounds | None = None,
    ):
        """M, q : as Fractions, or as floats, which are taken as exact; M by its
        rows."""
        self.problem, self.n = problem, problem.n
        self.lower: Bounds = [*zeros(self.n)] if lower is None else lower
        self.upper: Bounds = [*repeat(None, self.n)] if upper is None else upper
        integer_rows = [
            _in_integers(row, value) for row, value in zip(in_time(M), q, strict=True)
        ]
        self.rows = [row for row, _, _ in integer_rows]
        self.constants = [constant for _, constant, _ in integer_rows]
        self.scales = [scale for _, _, scale in integer_rows]

    @cached_property
    def bits(self) -> int:
        """Return the number of bits of the longest integer."""
        numbers = (
            value
            for row, c in zip(self.rows, self.constants, strict=True)
            for value in (c, *row.values())
        )
        return max((value.bit_length() for value in numbers), default=0)

    @cached_property
    def blocks(self) -> list[list[int]]:
        """Return the connected components of M, in order of increasing size: i and j
        are connected if M_ij is not 0. Each is an independent problem.
        """
        edges = ((i, j) for i, row in enumerate(self.rows) for j in row)
        return sorted(connected(self.n, edges), key=len)

    def part(self, indices: Sequence[int]) -> ExactProblem:
        """Return the problem of some unknowns and their rows, such as a connected
        component of M.
        """
        position = {i: k for k, i in enumerate(indices)}
        rows = [
            {position[j]: Fraction(a, self.scales[i]) for j, a in self.rows[i].items()}
            for i in indices
        ]
        q = [Fraction(self.constants[i], self.scales[i]) for i in indices]
        whole = self.problem
        lower, upper = (
            np.broadcast_to(bound, whole.n)[indices]
            for bound in (whole.lower, whole.upper)
        )
        M = whole.M[indices][:, indices]
        problem = Problem(M, whole.q[indices], lower=lower, upper=upper)
        bounds = (
            [all_bounds[i] for i in indices] for all_bounds in (self.lower, self.upper)
        )
        return ExactProblem(problem, rows, q, *bounds)

    @classmethod
    def of_floats(cls, problem: Problem) -> ExactProblem:
        """Return the problem with its floats as exact rational numbers."""
        return cls(
            problem,
            rows_of(problem.M, float),
            problem.q.tolist(),
            *_bounds_of(problem, number_of),
        )

    @classmethod
    def of_problem(cls, problem: Problem) -> ExactProblem:
        """Return the problem with the numbers of the text that it was read from, or of
        what it was made from, such as the payoffs of a game, whose differences doubles
        round, or else with its floats, as exact rational numbers."""
        if problem.written is not None:
            data: ExactProblem = problem.exact_numbers
            return data
        parts = problem.formulation.exact_conditions()
        return cls.of_floats(problem) if parts is None else cls(problem, *parts)

    @classmethod
    def of_basis(cls, problem: Problem, basis: BasisStatus) -> ExactProblem:
        """Return the problem with its floats as exact numbers, but zeros in the columns
        of M that do not affect the basic solution of a basis.
        """
        used = (basis == BASIC) | (problem.box.nonbasic(basis) != 0)
        M = scaled(problem.M, np.ones(problem.n), used.astype(float))
        return cls(
            problem,
            rows_of(M, float),
            problem.q.tolist(),
            *_bounds_of(problem, number_of),
        )

    @classmethod
    def of_rows(
        cls, problem: Problem, kept_rows: Indices, number: Callable[[Any], Fraction]
    ) -> ExactProblem:
        """Return the problem with some rows of M and q as exact numbers, and zeros in
        the other rows.
        """
        exact_rows = dict(
            zip(kept_rows.tolist(), rows_of(problem.M[kept_rows], number), strict=True)
        )
        q = [
            number(value) if i in exact_rows else Fraction(0)
            for i, value in enumerate(problem.q.tolist())
        ]
        return cls(
            problem,
            [exact_rows.get(i, {}) for i in range(problem.n)],
            q,
            *_bounds_of(problem, number),
        )

    @classmethod
    def of_decimals(cls, problem: Problem) -> ExactProblem:
        """Return the problem with the shortest decimal of each float, which is the
        number as written if that has at most 15 digits.
        """
        return cls(problem, *decimal_parts_of(problem))

    @property
    def M(self) -> Rows:
        """Return M in fractions."""
        rows = zip(self.rows, self.scales, strict=True)
        return [{j: Fraction(a, scale) for j, a in row.items()} for row, scale in rows]

    def w(self, z: Sequence[Fraction]) -> list[Fraction]:
        """Return w = M z + q."""
        Z, d = over_one_denominator(z)
        return [
            Fraction(
                sum(map(mul, row.values(), map(Z.__getitem__, row))) + constant * d,
                scale * d,
            )
            for row, constant, scale in zip(
                in_time(self.rows), self.constants, self.scales, strict=True
            )
        ]

    def is_solution(self, z: Sequence[Fraction]) -> bool:
        """Return whether z solves the problem exactly."""
        return not any(self.gaps(z, self.w(z)))

    def gaps(self, z: Sequence[Fraction], w: Sequence[Fraction]) -> list[Fraction]:
        """Return min(z, w); with bounds, z - mid(l, u, z - w)."""
        return [
            gap(*each)
            for each in zip(in_time(z), w, self.lower, self.upper, strict=True)
        ]

    def with_transpose(self, y: Sequence[Fraction]) -> tuple[list[Fraction], Fraction]:
        """Return M'y and q'y."""
        V, d = over_one_denominator(
            [value / scale for value, scale in zip(y, self.scales, strict=True)]
        )
        sums = [0] * self.n
        for row, factor in zip(in_time(self.rows), V, strict=True):
            if factor:
                for j, a in row.items():
                    sums[j] += a * factor
        return [Fraction(value, d) for value in sums], Fraction(
            dot(self.constants, V), d
        )

    def refuted_by(self, y: Sequence[Fraction]) -> bool:
        """Return whether y proves that no z within its bounds has w of the required
        signs, as in `verify.farkas`; for an LCP: y >= 0, M'y <= 0, q'y < 0.
        """
        columns, total = self.with_transpose(y)
        for value, column, low, high in zip(
            y, columns, self.lower, self.upper, strict=True
        ):
            if (value < 0 and low is not None) or (value > 0 and high is not None):
                return False
            if column:
                bound = high if column > 0 else low
                if bound is None:
                    return False
                total += column * bound
        return total < 0

    def are_floats(self) -> bool:
        """Return whether the floats of `problem` are exactly the data."""
        # The denominators of floats are powers of two.
        if any(scale & (scale - 1) for scale in self.scales):
            return False
        return self._equal(self.of_floats(self.problem))

    def are_doubles(self) -> bool:
        """Return whether the data are the floats of `problem`, or their shortest
        decimals.
        """
        return self.are_floats() or self._equal(self.of_decimals(self.problem))

    def _equal(self, other: ExactProblem) -> bool:
        attributes, others = vars(self), vars(other)
        return all(
            attributes[name] == others[name]
            for name in ("rows", "constants", "scales", "lower", "upper")
        )

    def in_integers(self) -> Problem | None:
        """Return the problem with its rows multiplied by `scales`, which has the same
        z; None if these integers are not representable in double precision.
        """
        numbers = chain((self.constants,), (row.values() for row in self.rows))
        if any(
            abs(value) > LARGEST_INTEGER
            for group in in_time(numbers)
            for value in group
        ):
            return None
        if _bounds_of(self.problem, number_of) != (self.lower, self.upper):
            return None
        M, q = _like(self.problem.M, self.rows), np.array(self.constants, dtype=float)
        return Problem(
            M,
            q,
            name=self.problem.name,
            lower=self.problem.lower,
            upper=self.problem.upper,
        )


def _in_integers(row: dict[int, Any], constant: Any) -> tuple[dict[int, int], int, int]:
    """Return the row and the constant multiplied by the smallest positive integer that
    makes them integers, and that integer.
    """
    numerator, denominator = constant.as_integer_ratio()
    ratios = [entry.as_integer_ratio() for entry in row.values()]
    scale = math.lcm(
        denominator, *(entry_denominator for _, entry_denominator in ratios)
    )
    whole = {
        j: value * (scale // entry_denominator)
        for j, (value, entry_denominator) in zip(row, ratios, strict=True)
    }
    return whole, numerator * (scale // denominator), scale


def number_of(value: Any) -> Fraction:
    """Return a finite number of any type as a fraction."""
    return Fraction(*value.as_integer_ratio())


def rows_of(
    M: Matrix, number: Callable[[Any], Any] = number_of
) -> list[dict[int, Any]]:
    """Return the nonzero entries of each row of a dense or sparse matrix, by default as
    exact rational numbers.
    """
    if not is_sparse(M):
        return [
            {j: number(a) for j, a in enumerate(row) if a}
            for row in in_time(M.tolist())
        ]
    rows: list[dict[int, Any]] = [{} for _ in range(M.shape[0])]
    coo = M.tocoo()
    for i, j, a in in_time(
        zip(coo.row.tolist(), coo.col.tolist(), coo.data.tolist(), strict=True)
    ):
        if a:
            rows[i][j] = rows[i].get(j, 0) + number(a)
    return rows


def parts_of(
    data: Problem, number: Callable[[Any], Fraction] = number_of
) -> ExactParts:
    """Return M, q and the bounds as rational numbers, by default exactly their
    floats.
    """
    return (
        rows_of(data.M, number),
        [number(value) for value in data.q.tolist()],
        *_bounds_of(data, number),
    )


def _bounds_of(
    problem: Problem, number: Callable[[float], Fraction]
) -> tuple[Bounds, Bounds]:
    low, high = problem.box.vectors(problem.n)
    return bounds_of(low, number), bounds_of(high, number)


def bounds_of(bound: Vector, number: Callable[[Any], Fraction] = number_of) -> Bounds:
    """Return bounds as rational numbers, None for infinite ones."""
    return [number(value) if math.isfinite(value) else None for value in bound.tolist()]


def decimal_parts_of(problem: Problem) -> ExactParts:
    """Return M, q and the bounds with the shortest decimal of each float; for a game,
    computed from the shortest decimals of its payoffs.
    """
    parts = problem.formulation.exact_conditions()
    if parts is not None:
        M, q, lower, upper = (*parts, None, None)[:4]
        return M, q, lower, upper
    return parts_of(problem, shortest_decimal)


def gap(
    z: Fraction, w: Fraction, low: Fraction | None, high: Fraction | None
) -> Fraction:
    """Return z - mid(low, high, z - w) = max(z - high, min(z - low, w))."""
    above = w if low is None else min(z - low, w)
    return above if high is None else max(z - high, above)


def fractions_of(values: Vector) -> list[Fraction]:
    """Return floats as exact fractions."""
    return [number_of(value) for value in values.tolist()]


def _like(M: Matrix, rows: list[dict[int, int]]) -> Matrix:
    """Return the matrix with these rows, dense or sparse as M is."""
    if not is_sparse(M):
        return np.array(
            [[float(row.get(j, 0)) for j in range(len(rows))] for row in in_time(rows)]
        )
    with imports:
        from scipy.sparse import csr_array
    values = [float(a) for row in rows for a in row.values()]
    positions = (
        [i for i, row in enumerate(rows) for _ in row],
        [j for row in rows for j in row],
    )
    return csr_array((values, positions), shape=M.shape)


def exact_parts(parse: Callable[[Doubles], Problem]) -> ExactParts:
    """Return the parts of a problem with its numbers as written in a text."""
    content = written(parse)
    # A program with a row whose lower and upper sides differ but round to the same
    # float has a different number of unknowns in the two readings.
    if content.distinct.n != content.rounded.n:
        return decimal_parts_of(content.rounded)
    return parts_of(content.distinct, content.number)
