"""Lemke's method in integers, for small problems: ratios, ties and signs are all decided without rounding.

The lexicographic minimum ratio test is described by R. W. Cottle, J.-S. Pang and R. E. Stone, The Linear
Complementarity Problem, SIAM (2009), section 4.9.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction

from lcpcli.interrupts import TimeIsUp
from lcpcli.rational.dictionary import Dictionary
from lcpcli.rational.effort import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import primitive, rounded, rounded_direction
from lcpcli.typing import Vector

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

    def path(self) -> Iterator[None]:
        """Pivot down the path from the z_0 for which all w are nonnegative to z_0 = 0 or a ray, one pivot at a time."""
        n, here, entering = self.n, self._here, 2 * self.n
        leaving: int | None = min(range(n), key=lambda i: (here.value(i), -i))
        while leaving is not None:
            here.pivot(leaving, self._column(entering))
            yield
            if leaving == 2 * n:
                return
            entering = leaving - n if leaving >= n else leaving + n
            k = self._column(entering)
            tied = here.nearest(k)
            leaving = 2 * n if 2 * n in tied else here.lexicographic(tied, k, range(n))
        self.ray = entering

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
