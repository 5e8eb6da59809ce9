"""Complementary pivoting in integers: ratios, ties and signs are decided without
rounding.

A path leads through dictionaries in which one of z_i and w_i is 0 for all i but one:
the path of Lemke's method, whose parameter is the multiple z_0 of a covering vector;
that of Lemke and Howson, without a parameter; and those of parametric problems. Ties
are broken lexicographically, as if the forms that are basic at the start were relaxed
by small amounts.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from fractions import Fraction
from typing import NamedTuple

from lcpcli.interrupts import TimeIsUp
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.rational.dictionary import Dictionary
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import primitive, rounded, rounded_direction
from lcpcli.typing import Vector

MAX_LEMKE_UNKNOWNS = 60  # the largest problem that `solve` attempts: seconds at worst


class Pivot(NamedTuple):
    """A pivot, by the forms that enter and leave the basis."""

    entering: int
    leaving: int
    # The basis status of all unknowns before the pivot, except that of the entering
    # one.
    statuses: tuple[int, ...]
    rise: int  # the sign of the change of the parameter
    is_point: bool  # whether the pivot is degenerate: the point does not move


class RationalPivoting:
    """A path of complementary pivots from a dictionary. Form i is z_i - l_i, form n + i
    is w_i, or -w_i at an upper bound, form 2 n + i is u_i - z_i, and form 3 n is the
    parameter.

    ray : the form that increases without bound if the path has ended on a ray,
        otherwise None.
    """

    def __init__(self, n: int, dictionary: Dictionary, statuses: Sequence[int]) -> None:
        self.n = n
        self.dictionary = dictionary
        self.statuses = list(statuses)
        self.parameter = 3 * n
        self.ray: int | None = None
        self._order = sorted(dictionary.rows)
        self._signed_at = [UPPER if state == UPPER else LOWER for state in statuses]
        # The w_i whose signs are not those at the start.
        self._sign_changed = set[int]()

    def follow(
        self, entering: int, last: set[int], leaving: int | None = None
    ) -> Iterator[Pivot]:
        """Pivot until one of the forms in `last` leaves, or none can leave. leaving :
        the first form to leave; by default the first to reach 0.
        """
        while True:
            k = self._column(entering)
            if leaving is None:
                tied = self.dictionary.nearest(k)
                last_tied = last.intersection(tied)
                leaving = (
                    max(last_tied)
                    if last_tied
                    else self.dictionary.lexicographic(
                        tied, k, self._order, self._sign_changed
                    )
                )
            if entering < self.n or 2 * self.n <= entering < self.parameter:
                self.statuses[entering % self.n] = BASIC
            if leaving is None:
                self.ray = entering
                return
            row = self.dictionary.rows.get(self.parameter)
            slope = 1 if row is None else row[k]
            rise = (slope > 0) - (slope < 0)
            is_point = not self.dictionary.value(leaving)
            self.dictionary.pivot(leaving, k)
            done = Pivot(entering, leaving, tuple(self.statuses), rise, is_point)
            if leaving < self.parameter:
                entering = self._complement(leaving)
            yield done
            if leaving in last:
                return
            leaving = None

    def _complement(self, leaving: int) -> int:
        """Return the form that enters next, the complement of the form that left, and
        record the basis status of its component.
        """
        n, i = self.n, leaving % self.n
        if n <= leaving < 2 * n:
            return i if self.statuses[i] == LOWER else 2 * n + i
        self.statuses[i] = LOWER if leaving < n else UPPER
        if self._signed_at[i] != self.statuses[i]:
            self._signed_at[i] = self.statuses[i]
            self.dictionary.negate(n + i)
            self._sign_changed ^= {n + i}
        return n + i

    def _column(self, form: int) -> int:
        """Return the column of a cobasic form, counted from 1."""
        return self.dictionary.cobasic.index(form) + 1

    def value_of(self, form: int) -> Fraction:
        """Return the value of a form at the point."""
        return Fraction(self.dictionary.value(form), int(self.dictionary.divisor))


class IntegerTableau(RationalPivoting):
    """The path of Lemke's method: basic solutions of w = M z + e z_0 + q for integers
    M, q, where z_0 is the parameter.
    """

    def __init__(self, M: Sequence[dict[int, int]], q: Sequence[int]) -> None:
        n = len(q)
        rows = {n + i: [q[i], *(M[i].get(j, 0) for j in range(n)), 1] for i in range(n)}
        forms = [*range(n), 3 * n]
        super().__init__(
            n, Dictionary(rows, forms, [*forms, *rows], lambda: None), [LOWER] * n
        )

    def path(self) -> Iterator[Pivot]:
        """Follow the path from the smallest z_0 for which all w are nonnegative to z_0
        = 0 or a ray, one pivot at a time.
        """
        first = min(
            range(self.n, 2 * self.n),
            key=lambda form: (self.dictionary.value(form), -form),
        )
        return self.follow(self.parameter, {self.parameter}, first)

    def z(self) -> list[Fraction]:
        """Return z of the current basic solution."""
        return [self.value_of(i) for i in range(self.n)]

    def x(self) -> Vector:
        """Return (z - w) / 2, rounded; 0 where neither z_i nor w_i is basic."""
        return rounded(
            (value - self.value_of(self.n + i)) / 2 for i, value in enumerate(self.z())
        )

    def direction(self) -> Vector:
        """Return the direction in z of the ray, shape (n,), in integers if double
        precision represents them.
        """
        assert self.ray is not None
        return rounded_direction(
            self.dictionary.direction(self._column(self.ray), range(self.n))
        )

    def multipliers(self) -> Vector:
        """Return the coefficients of w in the row of z_0, which is basic, in integers
        if double precision represents them.
        """
        entries = dict(
            zip(
                self.dictionary.cobasic,
                self.dictionary.rows[self.parameter][1:],
                strict=True,
            )
        )
        return rounded_direction(
            primitive([entries.get(self.n + i, 0) for i in range(self.n)])
        )


def solve(data: ExactProblem, effort: Effort) -> list[Fraction] | None:
    """Return the exact solution at the last vertex of Lemke's path; None if it
    terminates on a ray, n is large, there are bounds, or it takes more than `effort`.
    """
    if data.n > MAX_LEMKE_UNKNOWNS or not data.problem.box.is_orthant:
        return None
    tableau, count_step = IntegerTableau(data.rows, data.constants), effort.steps(data)
    with suppress(TimeIsUp):
        for _ in tableau.path() if min(data.constants, default=0) < 0 else ():
            count_step()
        return tableau.z() if tableau.ray is None else None
    return None


def equilibrium(data: ExactProblem, m: int, effort: Effort) -> list[Fraction] | None:
    """Return the probabilities of both players in an equilibrium of the game with the
    costs of these data: in pure strategies if there is one, otherwise at the last
    vertex of a path of Lemke and Howson; None if that takes more than `effort`. m : the
    number of strategies of the row player.

    The path is that of the game whose payoffs are a constant minus the costs, the
    constant being larger than all costs.
    """
    n = data.n
    cost_limit = 1 + max(
        max(row.values()) // scale
        for row, scale in zip(data.rows, data.scales, strict=True)
    )
    M = [
        {j: a - cost_limit * scale for j, a in row.items()}
        for row, scale in zip(data.rows, data.scales, strict=True)
    ]
    # The rows of the other player, for each strategy.
    rows = [range(m, n) if i < m else range(m) for i in range(n)]
    min_costs = [
        min(Fraction(M[i][j], data.scales[i]) for i in rows[j]) for j in range(n)
    ]
    for i in range(m):
        for j in range(m, n):
            if (
                M[i][j] == min_costs[j] * data.scales[i]
                and M[j][i] == min_costs[i] * data.scales[j]
            ):
                return [Fraction(k in (i, j)) for k in range(n)]
    tableau, count_step = IntegerTableau(M, data.scales), effort.steps(data)
    with suppress(TimeIsUp):
        # On the path of Lemke and Howson only the first label may be missing.
        for _ in tableau.follow(0, {0, n}):
            count_step()
        z = tableau.z()
        return [
            value / total
            for part in (z[:m], z[m:])
            for total in [sum(part)]
            for value in part
        ]
    return None
