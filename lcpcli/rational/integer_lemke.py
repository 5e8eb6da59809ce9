"""Lemke's method, and that of Lemke and Howson, in integers: ratios, ties and signs are decided without rounding.

The lexicographic minimum ratio test is described by R. W. Cottle, J.-S. Pang and R. E. Stone, The Linear
Complementarity Problem, SIAM (2009), section 4.9.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import TypeAlias

from lcpcli.interrupts import TimeIsUp
from lcpcli.rational.dictionary import Dictionary
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import primitive, rounded, rounded_direction
from lcpcli.typing import Vector

Pivot: TypeAlias = tuple[int, int]  # the forms that enter and leave the basis

MOST_LEMKE_UNKNOWNS = 60  # up to which `solve` tries: seconds at worst


class IntegerTableau:
    """A basic solution of w = M z + e z_0 + q for integers M, q, numbered as forms: w_i is i, z_i is n + i, z_0 is 2 n.

    ray : the form that grows without bound, if the path has ended on a ray; else None.
    """

    def __init__(self, M: Sequence[dict[int, int]], q: Sequence[int]) -> None:
        n = self.n = len(q)
        rows = {i: [q[i], *(M[i].get(j, 0) for j in range(n)), 1] for i in range(n)}
        self._here = Dictionary(rows, list(range(n, 2 * n + 1)), range(2 * n + 1), lambda: None)
        self.ray: int | None = None

    def path(self) -> Iterator[Pivot]:
        """Pivot down the path from the z_0 for which all w are nonnegative to z_0 = 0 or a ray, one pivot at a time."""
        return self._followed(2 * self.n, min(range(self.n), key=lambda i: (self._here.value(i), -i)), {2 * self.n})

    def path_from(self, label: int) -> Iterator[Pivot]:
        """Pivot from z = 0, where all w are positive, down the path on which this label alone may be missing, until it
        is there again, one pivot at a time."""
        last = {label, self.n + label}
        return self._followed(self.n + label, self._leaving(self.n + label, last), last)

    def _followed(self, entering: int, leaving: int | None, last: set[int]) -> Iterator[Pivot]:
        """Pivot until one of the last forms leaves, or no form does."""
        n = self.n
        while leaving is not None:
            self._here.pivot(leaving, self._column(entering))
            yield entering, leaving
            if leaving in last:
                return
            entering = leaving - n if leaving >= n else leaving + n
            leaving = self._leaving(entering, last)
        self.ray = entering

    def _leaving(self, entering: int, last: set[int]) -> int | None:
        k = self._column(entering)
        tied = self._here.nearest(k)
        ends = last.intersection(tied)
        return min(ends) if ends else self._here.lexicographic(tied, k, range(self.n))

    def _column(self, form: int) -> int:
        return self._here.cobasic.index(form) + 1

    def value_of(self, form: int) -> Fraction:
        """Return the value of a form."""
        return Fraction(self._here.value(form), int(self._here.divisor))

    def x(self) -> Vector:
        """Return (z - w) / 2, rounded; 0 where neither z_i nor w_i is basic."""
        return rounded((self.value_of(self.n + i) - self.value_of(i)) / 2 for i in range(self.n))

    def direction(self) -> Vector:
        """Return the direction in z of the ray, shape (n,), in integers if doubles represent them."""
        assert self.ray is not None
        return rounded_direction(self._here.direction(self._column(self.ray), range(self.n, 2 * self.n)))

    def multipliers(self) -> Vector:
        """Return the coefficients of w in the row of z_0, which is basic, in integers if doubles represent them."""
        entries = dict(zip(self._here.cobasic, self._here.rows[2 * self.n][1:], strict=True))
        return rounded_direction(primitive([entries.get(i, 0) for i in range(self.n)]))


def solve(data: ExactProblem, effort: Effort) -> list[Fraction] | None:
    """Return the solution at the end of the path; None on a ray, for large n, with bounds, or if it takes too much
    effort."""
    if data.n > MOST_LEMKE_UNKNOWNS or not data.problem.box.is_orthant:
        return None
    tableau = IntegerTableau(data.rows, data.constants)
    count = effort.steps(data)
    if min(data.constants, default=0) < 0:
        try:
            for _ in tableau.path():
                count()
        except TimeIsUp:
            return None
    return [tableau.value_of(data.n + i) for i in range(data.n)] if tableau.ray is None else None


def equilibrium(data: ExactProblem, m: int, effort: Effort) -> list[Fraction] | None:
    """Return the probabilities of both players in an equilibrium of the game with the costs of these data: in pure
    strategies if there is one, else at the end of a path of Lemke and Howson; None if that takes too much effort. m :
    the number of strategies of the row player.

    The path is that of the game whose payoffs are the costs subtracted from a larger number.
    """
    n, most = data.n, 1 + max(max(row.values()) // scale for row, scale in zip(data.rows, data.scales, strict=True))
    M = [{j: a - most * scale for j, a in row.items()} for row, scale in zip(data.rows, data.scales, strict=True)]
    rows = [range(m, n)] * m + [range(m)] * (n - m)  # of the other player
    least = [min(Fraction(M[i][j], data.scales[i]) for i in rows[j]) for j in range(n)]
    for i in range(m):
        for j in range(m, n):
            if M[i][j] == least[j] * data.scales[i] and M[j][i] == least[i] * data.scales[j]:
                return [Fraction(k in (i, j)) for k in range(n)]
    tableau, count = IntegerTableau(M, data.scales), effort.steps(data)
    try:
        for _ in tableau.path_from(0):
            count()
    except TimeIsUp:
        return None
    z = [tableau.value_of(n + i) for i in range(n)]
    return [value / total for part in (z[:m], z[m:]) for total in [sum(part)] for value in part]
