"""What `why` is compared with: small problems, of which every combination of states is
tried, with the simplex method in integers on each."""

from fractions import Fraction
from itertools import chain, product

import numpy as np

import lcpcli
from lcpcli.explanation.conditions import COMPLEMENTARITY, LOWER, SIGN, UPPER
from lcpcli.rational.dictionary import Dictionary


class Small:
    """A problem of integers. lower, upper : bounds, None for none."""

    def __init__(self, M, q, lower, upper):
        self.M, self.q, self.lower, self.upper = M, q, lower, upper
        self.n = len(q)

    @classmethod
    def random(cls, seed, most, is_mixed):
        """A problem of at most so many unknowns, with bounds of all kinds or as an
        LCP."""
        random = np.random.default_rng(seed)
        n = int(random.integers(1, most + 1))
        M = random.integers(-3, 4, (n, n)) * (random.random((n, n)) < 0.7)
        lower = [0] * n
        upper = [None] * n
        for i in range(n if is_mixed else 0):
            low, kind = int(random.integers(-2, 3)), int(random.integers(5))
            lower[i] = None if kind in (0, 1) else low
            upper[i] = {1: low, 2: low + int(random.integers(3))}.get(kind)
        return cls(M.tolist(), random.integers(-4, 4, n).tolist(), lower, upper)

    def problem(self):
        lower = [-np.inf if end is None else end for end in self.lower]
        upper = [np.inf if end is None else end for end in self.upper]
        return lcpcli.Problem(self.M, self.q, lower=lower, upper=upper)

    def keys(self):
        """All conditions, by the definition of a mixed problem."""
        found = []
        for i, (low, high) in enumerate(zip(self.lower, self.upper, strict=True)):
            found += [(LOWER, i)] * (low is not None) + [(UPPER, i)] * (
                high is not None
            )
            found += [(SIGN, i)] * (low is None or high is None)
            is_fixed = low == high
            found += [(COMPLEMENTARITY, i)] * (not is_fixed)
        return found

    def polyhedra(self, key, has_changes=False):
        """The polyhedra whose union a condition is, in terms of z, or of z and the
        rises and falls of q."""
        kind, i = key
        low, high = self.lower[i], self.upper[i]
        unit = [int(j == i) for j in range(self.n)]
        others = [0] * len(unit) * 2 * has_changes
        z = [0, *unit, *others]
        w = [self.q[i], *self.M[i], *others]
        if has_changes:
            w[1 + self.n :] = [*unit, *(-a for a in unit)]
        above = None if low is None else [-low, *z[1:]]
        below = None if high is None else [high, *(-a for a in z[1:])]
        minus = [-a for a in w]
        if kind == LOWER:
            return [[(above or [], False)]]
        if kind == UPPER:
            return [[(below or [], False)]]
        if kind == SIGN:
            is_free = low is None and high is None
            return [[(w if high is None else minus, is_free)]]
        if above is None or below is None:
            end = [-a for a in above or below or []]
            return [[(end, False)], [(w, True)]]
        return [
            [([-a for a in above], False), (w, False)],
            [(above, False), (below, False), (w, True)],
            [([-a for a in below], False), (minus, False)],
        ]

    def is_possible(self, keys):
        """Whether some conditions hold together at some point."""
        choices = product(*map(self.polyhedra, keys))
        return any(_has_point([*chain(*each)], self.n) for each in choices)

    def is_solvable(self):
        return self.is_possible(self.keys())

    def least_change(self):
        """The least sum of the sizes of changes of q that make it solvable; None if
        none does."""
        choices = product(*(self.polyhedra(key, True) for key in self.keys()))
        values = (_least([*chain(*each)], self.n) for each in choices)
        return min((value for value in values if value is not None), default=None)


def unsolvable(count, most, is_mixed):
    """So many problems without a solution, with their seeds."""
    seed = 0
    while count:
        small = Small.random(seed, most, is_mixed)
        if not small.is_solvable():
            count -= 1
            yield seed, small
        seed += 1


def keys_of(conditions):
    return [(each.kind, each.at) for each in conditions]


FIRST_UNKNOWN, SUM = 1000, 2000  # beyond the numbers of the parts


def _dictionary(parts, columns):
    """The parts, from 0 on, in terms of the unknowns."""
    rows = {k: list(form) for k, (form, _) in enumerate(parts)}
    unknowns = [FIRST_UNKNOWN + j for j in range(columns)]
    return Dictionary(rows, unknowns, (), lambda: None)


def _holds(here, parts):
    """Whether all parts hold somewhere; moves to such a point."""
    return all(
        here.vanish(k) if is_zero else here.require(k)
        for k, (_, is_zero) in enumerate(parts)
    )


def _has_point(parts, n):
    return _holds(_dictionary(parts, n), parts)


def _least(parts, n):
    """The least sum of rises and falls with which all parts hold."""
    here = _dictionary(parts, 3 * n)
    here.signed |= {FIRST_UNKNOWN + j for j in range(n, 3 * n)}
    here.rows[SUM] = [0] * (1 + n) + [1] * (2 * n)
    if not _holds(here, parts):
        return None
    assert here.minimize(SUM)
    return Fraction(here.value(SUM), int(here.divisor))
