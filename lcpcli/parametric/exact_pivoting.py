"""The path of `pivoting` in integers: ties, signs and turns are all decided without rounding, and each piece is proved.

Each condition is a form that is nonnegative: z_i - l_i and u_i - z_i, w_i where z_i is at its lower bound, -w_i where
it is at its upper bound, s and 1 - s. A vertex is a dictionary in which those forms are cobasic that are 0 there.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from lcpcli.interrupts import check
from lcpcli.model.box import BASIC, UPPER
from lcpcli.parametric.pivoting import Edge
from lcpcli.rational.dictionary import Dictionary
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import whole_multiple
from lcpcli.rational.pivoting import Pivoting
from lcpcli.typing import States

Values = list[Fraction]
NOTHING = Fraction(0), Fraction(0)  # a bound that does not move, at 0


class ExactFamily:
    """The problems between two with the same M, in fractions: M_ij = rows[i][j] / scales[i] in integers, and q, l and u
    at s = 0 with their changes; bounds that do not exist are None."""

    def __init__(self, first: ExactProblem, last: ExactProblem) -> None:
        self._first, self.n, self.rows, self.scales = first, first.n, first.rows, first.scales
        ends = [[Fraction(c, s) for c, s in zip(each.constants, each.scales, strict=True)] for each in (first, last)]
        self.q = [(a, b - a) for a, b in zip(*ends, strict=True)]
        self.lower, self.upper = (
            [None if a is None or b is None else (a, b - a) for a, b in zip(*bounds, strict=True)]
            for bounds in ((first.lower, last.lower), (first.upper, last.upper))
        )

    def w(self, s: Fraction, z: Values) -> Values:
        """Return w = M z + q at s."""
        return [w + s * change for w, (_, change) in zip(self._first.w(z), self.q, strict=True)]

    def satisfies(self, states: States, s: Fraction, z: Values, w: Values) -> bool:
        """Return whether a point satisfies the conditions of these states, as all of a piece does if its ends do."""
        for i, state in enumerate(states.tolist()):
            low, high = (own and own[0] + s * own[1] for own in (self.lower[i], self.upper[i]))
            within = (low is None or z[i] >= low) and (high is None or z[i] <= high)
            if not within or (w[i] if state == BASIC else z[i] != (high if state == UPPER else low)):
                return False
            if state * w[i] > 0 and low != high:
                return False
        return True


class ExactPivoting(Pivoting):
    """The path from the basis with these states at s = 0, with s as its parameter; 1 - s is form 3 n + 1."""

    def __init__(self, family: ExactFamily, states: States) -> None:
        n, self.family = family.n, family
        bounds = list(zip(family.lower, family.upper, strict=True))
        self._bases = [low or high or NOTHING for low, high in bounds]
        self._signs = [-1 if low is None and high else 1 for low, high in bounds]
        own = self._own = [i if sign > 0 else 2 * n + i for i, sign in enumerate(self._signs)]  # which stand for z_i
        signed = [3 * n, 3 * n + 1, *(i for i, (low, _) in enumerate(bounds) if low is not None)]
        signed += [2 * n + i for i, (_, high) in enumerate(bounds) if high is not None]
        signed += [n + i for i, (low, high) in enumerate(bounds) if low is None or low != high]
        super().__init__(n, Dictionary(self._rows(), [*own, 3 * n], signed, check), states.tolist())
        self._begin()

    def _rows(self) -> dict[int, list[int]]:
        """Return the other forms in terms of those that stand for z_i and of s, each times a positive integer."""
        n, family, ends, signs = self.family.n, self.family, self._bases, self._signs
        rows = {3 * n + 1: [1, *[0] * n, -1]}
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

    def _begin(self) -> None:
        """Pivot to the basis of the states."""
        n, here = self.n, self.here
        waiting = [form for form, state in zip(self._own, self.states, strict=True) if state == BASIC]
        for i, state in enumerate(self.states):
            if state == BASIC:
                columns = [k for k, form in enumerate(here.cobasic, 1) if form in waiting and here.rows[n + i][k]]
                waiting.remove(here.cobasic[columns[0] - 1])
                here.pivot(n + i, columns[0])
            elif state == UPPER:
                here.negate(n + i)
                if self._signs[i] > 0:
                    here.pivot(2 * n + i, self._column(i))

    @property
    def is_feasible(self) -> bool:
        """Return whether the dictionary is a solution."""
        return all(row[0] >= 0 for form, row in self.here.rows.items() if form in self.here.signed)

    def vertex(self) -> tuple[Fraction, Values]:
        """Return s and z of the dictionary."""
        s, each = self.value_of(self.parameter), zip(self._bases, self._signs, self._own, strict=True)
        return s, [base + s * change + sign * self.value_of(form) for (base, change), sign, form in each]

    def edges(self) -> Iterator[Edge]:
        """Yield one edge of the path after another."""
        last = {self.parameter, self.parameter + 1}
        for pivot in self.follow(self.parameter, last):
            states = np.array(pivot.states, np.int8)
            yield Edge(states, pivot.rise, pivot.is_point, *self.vertex(), is_last=pivot.leaving in last)
        if self.ray is not None:
            s, *rates = self.here.direction(self._column(self.ray), [self.parameter, *self._own])
            each = zip(self._bases, self._signs, rates, strict=True)
            z = [s * change + sign * rate for (_, change), sign, rate in each]
            yield Edge(np.array(self.states, np.int8), 0, False, self.vertex()[0], z, is_ray=True, is_last=True)
