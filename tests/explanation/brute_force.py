"""What `why` is compared with: small problems, of which combinations of states are
tried, with a linear program of HiGHS for each."""

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp

import lcpcli
from lcpcli.explanation.conditions import COMPLEMENTARITY, LOWER, SIGN, UPPER

INF = np.inf


class Small:
    """A problem of integers. lower, upper : bounds, infinite for none."""

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
        lower, upper = np.zeros(n), np.full(n, INF)
        for i in range(n if is_mixed else 0):
            low, kind = int(random.integers(-2, 3)), int(random.integers(5))
            lower[i] = -INF if kind in (0, 1) else low
            upper[i] = {1: low, 2: low + int(random.integers(3))}.get(kind, INF)
        return cls(M, random.integers(-4, 4, n), lower, upper)

    def problem(self):
        return lcpcli.Problem(self.M, self.q, lower=self.lower, upper=self.upper)

    def keys(self):
        """All conditions, by the definition of a mixed problem."""
        found = []
        for i, (low, high) in enumerate(zip(self.lower, self.upper, strict=True)):
            has_lower, has_upper = low > -INF, high < INF
            conditions = {
                LOWER: has_lower,
                UPPER: has_upper,
                SIGN: not (has_lower and has_upper),
                COMPLEMENTARITY: (has_lower or has_upper) and low < high,
            }
            found += [(kind, i) for kind, has_it in conditions.items() if has_it]
        return found

    def ways(self, key):
        """The ways in which a condition holds: in each, (index, low, high) of numbers
        among (z, w)."""
        kind, i = key
        low, high, w = self.lower[i], self.upper[i], self.n + i
        if kind == LOWER:
            return [[(i, low, INF)]]
        if kind == UPPER:
            return [[(i, -INF, high)]]
        if kind == SIGN:
            return [[(w, 0 if high == INF else -INF, 0 if low == -INF else INF)]]
        if high == INF:
            return [[(i, -INF, low)], [(w, 0, 0)]]
        if low == -INF:
            return [[(i, high, INF)], [(w, 0, 0)]]
        return [
            [(i, -INF, low), (w, 0, INF)],
            [(i, low, high), (w, 0, 0)],
            [(i, high, INF), (w, -INF, 0)],
        ]

    def is_possible(self, keys):
        """Whether some conditions hold together at some point."""
        return self.least_change(keys, 0) < INF

    def least_change(self, keys, largest=INF):
        """The least sum of the sizes of changes of q with which conditions hold
        together; infinite if none does. largest : of each change."""
        n = self.n
        low = np.repeat([-INF, 0], 2 * n)
        high = np.repeat([INF, largest], 2 * n)
        choices = []
        for ways in map(self.ways, keys):
            if len(ways) == 1:
                low, high = narrowed(low, high, ways[0])
            else:
                choices.append(ways)
        return self._least(choices, low, high, INF)

    def _least(self, choices, low, high, best):
        """The least sum for one way of each choice, or what was the best before."""
        one = np.eye(self.n)
        rows = np.hstack((self.M, -one, one, -one))
        costs = np.repeat([0, 1], 2 * self.n)
        equations = LinearConstraint(rows, -self.q, -self.q)
        found = milp(costs, constraints=equations, bounds=Bounds(low, high)).fun
        value = INF if found is None else found
        if value >= best or not choices:
            return min(value, best)
        first, *rest = choices
        for way in first:
            best = self._least(rest, *narrowed(low, high, way), best)
        return best


def narrowed(low, high, way):
    """The bounds with those of a way."""
    low, high = low.copy(), high.copy()
    for i, least, most in way:
        low[i], high[i] = max(low[i], least), min(high[i], most)
    return low, high


def unsolvable(count, most, is_mixed):
    """So many problems without a solution, with their seeds."""
    seed = 0
    while count:
        small = Small.random(seed, most, is_mixed)
        if not small.is_possible(small.keys()):
            count -= 1
            yield seed, small
        seed += 1


def keys_of(conditions):
    return [(each.kind, each.at) for each in conditions]
