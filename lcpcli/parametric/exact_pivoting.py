"""The path of `pivoting` in integers: ties, signs and turns are all decided without rounding, and each piece is proved.

Each condition is a form that is nonnegative: z_i - l_i and u_i - z_i, w_i where z_i is at its lower bound, -w_i where
it is at its upper bound, s and 1 - s. A vertex is a dictionary in which those forms are cobasic that are 0 there.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from lcpcli.interrupts import check
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.rational.dictionary import Dictionary
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import over_one_denominator, whole_multiple
from lcpcli.typing import States

LARGEST_PERTURBATION = 2**40  # of the random integers that break ties

Values = list[Fraction]


class ExactEdge(NamedTuple):
    """An edge of the path, as `pivoting.Edge`, with s and z in fractions; on a ray z is its direction."""

    states: States
    rise: int
    is_point: bool
    s: Fraction
    z: Values
    is_ray: bool = False
    is_last: bool = False


class ExactFamily:
    """The problems between two with the same M, in fractions: M_ij = rows[i][j] / scales[i] in integers, and q, l and u
    at s = 0 with their changes; bounds that do not exist are None."""

    def __init__(self, first: ExactProblem, last: ExactProblem) -> None:
        self.n, self.rows, self.scales = first.n, first.rows, first.scales
        ends = [[Fraction(c, s) for c, s in zip(each.constants, each.scales, strict=True)] for each in (first, last)]
        self.q = [(a, b - a) for a, b in zip(*ends, strict=True)]
        self.lower, self.upper = (
            [None if a is None or b is None else (a, b - a) for a, b in zip(*bounds, strict=True)]
            for bounds in ((first.lower, last.lower), (first.upper, last.upper))
        )

    def bound(self, i: int, is_upper: bool, s: Fraction) -> Fraction | None:
        """Return a bound of z_i at s, None if there is none."""
        own = (self.upper if is_upper else self.lower)[i]
        return None if own is None else own[0] + s * own[1]

    def w(self, s: Fraction, z: Values) -> Values:
        """Return w = M z + q at s."""
        Z, d = over_one_denominator(z)
        w = []
        for row, scale, (q, change) in zip(self.rows, self.scales, self.q, strict=True):
            check()
            w.append(Fraction(sum(a * Z[j] for j, a in row.items()), scale * d) + q + s * change)
        return w

    def satisfies(self, states: States, s: Fraction, z: Values, w: Values) -> bool:
        """Return whether a point satisfies the conditions of these states, which are linear: so if both ends of a piece
        do, each of its points does."""
        for i, state in enumerate(states.tolist()):
            low, high = self.bound(i, False, s), self.bound(i, True, s)
            within = (low is None or z[i] >= low) and (high is None or z[i] <= high)
            if not within or (w[i] if state == BASIC else z[i] != (high if state == UPPER else low)):
                return False
            if state * w[i] > 0 and low != high:
                return False
        return True


class ExactPivoting:
    """The path from the basis with these states at s = 0. z_i - l_i is form i, w_i is n + i, u_i - z_i is 2 n + i."""

    def __init__(self, family: ExactFamily, states: States) -> None:
        n = self.n = family.n
        self.family, self.states = family, states.copy()
        self.s, self.rest = 3 * n, 3 * n + 1  # the forms s and 1 - s
        self.own = [i if family.lower[i] or not family.upper[i] else 2 * n + i for i in range(n)]  # that stand for z_i
        self._here = Dictionary(self._rows(), [*self.own, self.s], self._signed(), check)
        self._begin()
        source = random.Random(0)
        self._limits = {form: -source.randint(1, LARGEST_PERTURBATION) for form in sorted(self._here.rows)}
        self._signs = np.where(states == UPPER, -1, 1).tolist()  # of w_i in its form
        self._first_signs = list(self._signs)

    def _rows(self) -> dict[int, list[int]]:
        """Return the other forms in terms of those that stand for z_i and of s, each times a positive integer."""
        n, family, nothing = self.n, self.family, (Fraction(0), Fraction(0))
        ends = [family.lower[i] or family.upper[i] or nothing for i in range(n)]
        signs = [1 if form < n else -1 for form in self.own]
        rows = {self.rest: [1, *[0] * n, -1]}
        for i, (row, scale, (q, change)) in enumerate(zip(family.rows, family.scales, family.q, strict=True)):
            check()
            constant = scale * q + sum(a * ends[j][0] for j, a in row.items())
            slope = scale * change + sum(a * ends[j][1] for j, a in row.items())
            rows[n + i] = whole_multiple([constant, *(Fraction(signs[j] * row.get(j, 0)) for j in range(n)), slope])
            low, high = family.lower[i], family.upper[i]
            if low and high:
                unit = [Fraction(-(j == i)) for j in range(n)]
                rows[2 * n + i] = whole_multiple([high[0] - low[0], *unit, high[1] - low[1]])
        return rows

    def _signed(self) -> Iterator[int]:
        """Yield the forms that are nonnegative on the path."""
        yield from (self.s, self.rest)
        for i, (low, high) in enumerate(zip(self.family.lower, self.family.upper, strict=True)):
            forms = ((i, low is not None), (2 * self.n + i, high is not None), (self.n + i, low is None or low != high))
            yield from (form for form, is_signed in forms if is_signed)

    def _begin(self) -> None:
        """Pivot to the basis of the states."""
        n, here = self.n, self._here
        waiting = [self.own[i] for i in range(n) if self.states[i] == BASIC]
        for i, state in enumerate(self.states.tolist()):
            if state == BASIC:
                columns = [k for k, form in enumerate(here.cobasic, 1) if form in waiting and here.rows[n + i][k]]
                waiting.remove(here.cobasic[columns[0] - 1])
                here.pivot(n + i, columns[0])
            elif state == UPPER:
                here.negate(n + i)
                if self.own[i] == i:
                    here.pivot(2 * n + i, here.cobasic.index(i) + 1)

    @property
    def is_feasible(self) -> bool:
        """Return whether the dictionary is a solution."""
        return all(row[0] >= 0 for form, row in self._here.rows.items() if form in self._here.signed)

    def vertex(self) -> tuple[Fraction, Values]:
        """Return s and z of the dictionary."""
        return self._point({form: int(row[0]) for form, row in self._here.rows.items()}, 1)

    def _point(self, values: dict[int, int], constant: int) -> tuple[Fraction, Values]:
        """Return s and z from the values of the forms times the divisor; with constant = 0, those of a direction."""
        divisor, nothing = int(self._here.divisor), (Fraction(0), Fraction(0))
        s, z = Fraction(values.get(self.s, 0), divisor), []
        for i, form in enumerate(self.own):
            sign = 1 if form == i else -1
            bound = (self.family.lower if form == i else self.family.upper)[i] or nothing
            z.append(constant * bound[0] + s * bound[1] + sign * Fraction(values.get(form, 0), divisor))
        return s, z

    def edges(self) -> Iterator[ExactEdge]:
        """Yield one edge of the path after another."""
        n, here, entering = self.n, self._here, self.s
        while True:
            k = here.cobasic.index(entering) + 1
            leaving = self._leaving(k)
            states = self.states.copy()
            if entering < n or 2 * n <= entering < self.s:
                states[entering % n] = BASIC
            row = here.rows.get(self.s)
            slope = 1 if row is None else row[k]
            rise = (slope > 0) - (slope < 0)
            if leaving is None:
                column = {form: int(row[k]) for form, row in here.rows.items()} | {entering: int(here.divisor)}
                yield ExactEdge(states, rise, False, self.vertex()[0], self._point(column, 0)[1], True, True)
                return
            is_point = not here.value(leaving)
            here.pivot(leaving, k)
            self.states = states.copy()
            entering = self._complement(leaving)
            yield ExactEdge(states, rise, is_point, *self.vertex(), is_last=leaving >= self.s)
            if leaving >= self.s:
                return

    def _leaving(self, k: int) -> int | None:
        """Return the form that reaches 0 first as column k grows: s or 1 - s if it is among them, else by the perturbed
        data; None if there is none."""
        here = self._here
        tied = here.nearest(k)
        if len(tied) < 2 or tied.count(self.s) or tied.count(self.rest):
            return max(tied, default=None)
        limits = [self._limit(form) for form in here.cobasic]

        def ratio(form: int) -> Fraction:
            row = here.rows[form]
            value = sum(int(a) * limit for a, limit in zip(row[1:], limits, strict=True))
            return Fraction(value - self._limit(form) * int(here.divisor), -int(row[k]))

        return min(tied, key=ratio)

    def _limit(self, form: int) -> int:
        """Return the value at which a form is at its end in the perturbed data."""
        limit, i = self._limits.get(form, 0), form - self.n
        return limit * self._signs[i] * self._first_signs[i] if 0 <= i < self.n else limit

    def _complement(self, leaving: int) -> int:
        """Return the form that becomes positive next, and settle the state of its component."""
        if leaving >= self.s:
            return leaving
        n, i = self.n, leaving % self.n
        if n <= leaving < 2 * n:
            return i if self.states[i] == LOWER else 2 * n + i
        self.states[i], sign = (LOWER, 1) if leaving < n else (UPPER, -1)
        if self._signs[i] != sign:
            self._here.negate(n + i)
            self._signs[i] = sign
        return n + i
