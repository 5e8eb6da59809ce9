"""Lemke's tableau in integers: ratios, ties and signs are all decided without rounding.

The rows of [I, -M, -e, q] are pivoted as in J. Edmonds, Systems of distinct representatives and linear algebra, Journal
of Research of the National Bureau of Standards 71B (1967) 241-245: divisions have no remainder, and all numbers are
minors of that matrix. The lexicographic minimum ratio test is that of R. W. Cottle, J.-S. Pang and R. E. Stone, The
Linear Complementarity Problem, SIAM (2009), section 4.9.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction

import numpy as np

from lcpcli.rational.numbers import rounded_direction
from lcpcli.rational.sums import primitive
from lcpcli.typing import Vector

Rows = Sequence[dict[int, int]]  # of a matrix: each nonzero entry, by its column


class IntegerTableau:
    """A basis of w - M z - e z_0 = q for integers M and q, with its basic solution.

    Variables are numbered: w_i is i, z_i is n + i, z_0 is 2 n. Columns are in that order, with q last.

    rows : the tableau times `divisor`, which is positive.
    basic : the variable of each row.
    ray : the variable that increases without bound, if the path has ended on a ray; else None.
    """

    def __init__(self, M: Rows, q: Sequence[int]) -> None:
        n = self.n = len(q)
        self.rows = [
            [*(int(i == j) for j in range(n)), *(-M[i].get(j, 0) for j in range(n)), -1, q[i]] for i in range(n)
        ]
        self.basic, self.divisor = list(range(n)), 1
        self.ray: int | None = None

    def path(self) -> Iterator[None]:
        """Pivot down the path from the z_0 for which all w are nonnegative to z_0 = 0 or a ray, one pivot at a time."""
        n, entering, row = self.n, 2 * self.n, self._first_row()
        while row >= 0:
            leaving = self._pivot(row, entering)
            yield
            if leaving == 2 * n:
                return
            entering = leaving - n if leaving >= n else leaving + n
            row = self._leaving_row(entering)
        self.ray = entering

    def _first_row(self) -> int:
        """The row of the variable that leaves when z_0 enters, just large enough for all w to be nonnegative."""
        return min(range(self.n), key=lambda i: (self.rows[i][-1], *self.rows[i][: self.n]))

    def _leaving_row(self, entering: int) -> int:
        """The row of the variable that leaves when another enters, z_0 if it ties; -1 if there is none."""
        best = -1
        for i in range(self.n):
            if self.rows[i][entering] > 0 and (best < 0 or self._precedes(i, best, entering)):
                best = i
        return best

    def _pivot(self, row: int, entering: int) -> int:
        """Exchange the basic variable of the row for the entering one; returns the one that leaves."""
        pivot = self.rows[row]
        if pivot[entering] < 0:
            pivot[:] = [-value for value in pivot]
        by, divisor = pivot[entering], self.divisor
        for other in self.rows:
            factor = other[entering]
            if other is not pivot:
                other[:] = [(by * a - factor * b) // divisor for a, b in zip(other, pivot, strict=True)]
        leaving, self.basic[row], self.divisor = self.basic[row], entering, by
        return leaving

    def value_of(self, variable: int) -> Fraction:
        """The value of a variable in the basic solution."""
        if variable not in self.basic:
            return Fraction(0)
        return Fraction(self.rows[self.basic.index(variable)][-1], self.divisor)

    def z(self) -> list[Fraction]:
        """z of the basic solution."""
        return [self.value_of(self.n + i) for i in range(self.n)]

    def x(self) -> Vector:
        """(z - w) / 2 of the basic solution, rounded; 0 for a pair of which neither is basic."""
        return np.array([float((self.value_of(self.n + i) - self.value_of(i)) / 2) for i in range(self.n)])

    def direction(self) -> Vector:
        """How z changes along the ray, of shape (n,), in integers as far as doubles hold them."""
        assert self.ray is not None
        rates = {self.ray: self.divisor}
        for variable, row in zip(self.basic, self.rows, strict=True):
            rates[variable] = -row[self.ray]
        return _in_doubles([rates.get(self.n + i, 0) for i in range(self.n)])

    def multipliers(self) -> Vector:
        """The multipliers of the row of z_0, which is basic: that row of the inverse of the basis, the same way."""
        return _in_doubles([-value for value in self.rows[self.basic.index(2 * self.n)][: self.n]])

    def _precedes(self, i: int, j: int, entering: int) -> bool:
        """Whether row i comes before row j in the lexicographic minimum ratio test."""
        one, other = self.rows[i], self.rows[j]
        a, b = one[entering], other[entering]
        order = one[-1] * b - other[-1] * a
        if order == 0 and 2 * self.n in (self.basic[i], self.basic[j]):
            return self.basic[i] == 2 * self.n
        for k in range(self.n):
            if order:
                break
            order = one[k] * b - other[k] * a
        return order < 0


def _in_doubles(values: Sequence[int]) -> Vector:
    return rounded_direction([Fraction(value) for value in primitive(values)])
