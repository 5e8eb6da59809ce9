"""An LCP with rational data, and the exact verification of a z or a y for it.

Each row of [M | q] is kept multiplied by the least common denominator of its entries, as integers: the solutions z stay
the same, and sums of products need no gcd.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.problem import Problem
from lcpcli.rational.sums import over_one_denominator
from lcpcli.typing import Matrix, Vector

Rows = list[dict[int, Fraction]]  # of a matrix: each nonzero entry, by its column
LARGEST_INTEGER = 2**53  # up to here every integer is exactly representable in double precision


class ExactProblem:
    """An LCP with exact data.

    problem : the same, rounded to doubles.
    rows, constants, scales : integers with rows[i][j] / scales[i] = M_ij, constants[i] / scales[i] = q_i; scales > 0.
    """

    def __init__(self, problem: Problem, M: Rows, q: Sequence[Fraction]) -> None:
        self.problem = problem
        self.scales = [
            math.lcm(value.denominator, *(entry.denominator for entry in row.values()))
            for row, value in zip(M, q, strict=True)
        ]
        self.rows = [
            {j: entry.numerator * (scale // entry.denominator) for j, entry in row.items()}
            for row, scale in zip(M, self.scales, strict=True)
        ]
        self.constants = [
            value.numerator * (scale // value.denominator) for value, scale in zip(q, self.scales, strict=True)
        ]

    @classmethod
    def of_floats(cls, problem: Problem) -> ExactProblem:
        """The problem with its doubles as exact rational numbers."""
        return cls(problem, rows_of(problem.M), fractions_of(problem.q))

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return len(self.constants)

    def w(self, z: Sequence[Fraction]) -> list[Fraction]:
        """w = M z + q."""
        Z, d = over_one_denominator(z)
        return [
            Fraction(sum(a * Z[j] for j, a in row.items()) + constant * d, scale * d)
            for row, constant, scale in zip(self.rows, self.constants, self.scales, strict=True)
        ]

    def sizes(self, z: Sequence[Fraction]) -> list[Fraction]:
        """|M| |z| + |q|."""
        Z, d = over_one_denominator(z)
        return [
            Fraction(sum(abs(a * Z[j]) for j, a in row.items()) + abs(constant) * d, scale * d)
            for row, constant, scale in zip(self.rows, self.constants, self.scales, strict=True)
        ]

    def is_solution(self, z: Sequence[Fraction]) -> bool:
        """Whether z >= 0, w = M z + q >= 0 and z'w = 0."""
        w = self.w(z)
        return min(z) >= 0 and min(w) >= 0 and not any(a and b for a, b in zip(z, w, strict=True))

    def with_transpose(self, y: Sequence[Fraction]) -> tuple[list[Fraction], Fraction]:
        """M'y and q'y."""
        V, d = over_one_denominator([value / scale for value, scale in zip(y, self.scales, strict=True)])
        sums = [0] * self.n
        for row, factor in zip(self.rows, V, strict=True):
            if factor:
                for j, a in row.items():
                    sums[j] += a * factor
        return [Fraction(value, d) for value in sums], Fraction(_dot(self.constants, V), d)

    def refuted_by(self, y: Sequence[Fraction]) -> bool:
        """Whether y proves that no z >= 0 has M z + q >= 0: y >= 0, M'y <= 0, q'y < 0 (Farkas)."""
        columns, constant = self.with_transpose(y)
        return min(y) >= 0 and constant < 0 and max(columns) <= 0

    def are_floats(self) -> bool:
        """Whether `problem` holds the data without rounding."""
        own = ExactProblem.of_floats(self.problem)
        return (own.rows, own.constants, own.scales) == (self.rows, self.constants, self.scales)

    def in_integers(self) -> Problem | None:
        """The problem with its rows times `scales`, with the same solutions z; None if doubles cannot represent it."""
        if any(abs(value) > LARGEST_INTEGER for row in self.rows for value in row.values()):
            return None
        if any(abs(value) > LARGEST_INTEGER for value in self.constants):
            return None
        M = _like(self.problem.M, self.rows)
        return Problem(M, np.array(self.constants, dtype=float), name=self.problem.name)


def rows_of(M: Matrix) -> Rows:
    """The rows of a dense or sparse matrix of doubles, as exact rational numbers."""
    if not is_sparse(M):
        return [{j: Fraction(a) for j, a in enumerate(row) if a} for row in M.tolist()]
    rows: Rows = [{} for _ in range(M.shape[0])]
    coo = M.tocoo()
    for i, j, a in zip(coo.row.tolist(), coo.col.tolist(), coo.data.tolist(), strict=True):
        if a:
            rows[i][j] = Fraction(a)
    return rows


def parts_of(held: Problem | Matrix) -> tuple[Rows, list[Fraction] | None]:
    """M and, of a problem, q, with their doubles as exact rationals."""
    return (rows_of(held.M), fractions_of(held.q)) if isinstance(held, Problem) else (rows_of(held), None)


def fractions_of(values: Vector) -> list[Fraction]:
    """Doubles as exact rational numbers."""
    return [Fraction(value) for value in values.tolist()]


def _dot(a: Sequence[int], b: Sequence[int]) -> int:
    return sum(x * y for x, y in zip(a, b, strict=True))


def _like(M: Matrix, rows: list[dict[int, int]]) -> Matrix:
    """The matrix of these rows, sparse if M is."""
    entries = [(i, j, float(a)) for i, row in enumerate(rows) for j, a in row.items()]
    i, j, values = (list(part) for part in zip(*entries, strict=True)) if entries else ([], [], [])
    if is_sparse(M):
        from scipy.sparse import csr_array

        return csr_array((values, (i, j)), shape=M.shape)
    dense = np.zeros(M.shape)
    dense[i, j] = values
    return dense
