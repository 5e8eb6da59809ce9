"""Programs with rows that follow from others, rows between two sides, rows without
sides, and rows of zeros; in fractions, so that what follows does so exactly."""

from fractions import Fraction
from typing import NamedTuple

import numpy as np

from lcpcli import from_qp

from .exact import Row, dot, leading, reduced

Rows = list[Row]
KINDS = "equation", "lower", "upper", "range", "free"


class Dependent(NamedTuple):
    """min x'Qx / 2 + c'x with low <= A x <= high and lower <= x <= upper, where None
    stands for no side. combined : for each row what it combines: row -> factor, empty
    for a row of its own."""

    Q: Rows
    c: Row
    A: Rows
    low: list[Fraction | None]
    high: list[Fraction | None]
    lower: list[Fraction | None]
    upper: list[Fraction | None]
    combined: list[dict[int, Fraction]]

    def problem(self):
        """The problem in doubles."""
        return from_qp(
            floats(self.Q) if any(map(any, self.Q)) else None,
            floats(self.c),
            floats(self.A),
            row_lower=ends(self.low, -np.inf),
            row_upper=ends(self.high, np.inf),
            lower=ends(self.lower, -np.inf),
            upper=ends(self.upper, np.inf),
        )

    def moved(self, random):
        """The program with each number but 0 moved to a neighbour, or left as it is;
        rows that follow from others still do."""

        def near(value):
            own = float(value)
            step = int(random.integers(-1, 2)) if own else 0
            return Fraction(float(np.nextafter(own, own + step)))

        def near_end(value):
            return value if value is None else near(value)

        n = len(self.c)
        Q = [[near(value) for value in row] for row in self.Q]
        Q = [[Q[min(i, j)][max(i, j)] for j in range(n)] for i in range(n)]
        A = []
        low, high = [], []
        for i, combined in enumerate(self.combined):
            if not combined:
                A.append([near(value) for value in self.A[i]])
                low.append(near_end(self.low[i]))
                is_equation = self.low[i] == self.high[i]
                high.append(low[i] if is_equation else near_end(self.high[i]))
                continue
            A.append(combination(A, combined))
            sides = sides_of(low, high, combined)
            low.append(sides[0])
            high.append(sides[1])
        c, lower, upper = list(map(near, self.c)), self.lower, self.upper
        return Dependent(Q, c, A, low, high, lower, upper, self.combined)

    def conditions(self):
        """M and q of the conditions, as the problem has them."""
        k, zero = len(self.c), Fraction(0)
        ranges = [
            i
            for i, (a, b) in enumerate(zip(self.low, self.high, strict=True))
            if a is not None and b is not None and a != b
        ]
        n = k + len(self.A) + len(ranges)
        M, q = [[zero] * n for _ in range(n)], [*self.c, *[zero] * (n - k)]
        for i in range(k):
            M[i][:k] = self.Q[i]
        for i, row in enumerate(self.A):
            for j, value in enumerate(row):
                M[k + i][j], M[j][k + i] = value, -value
            side = self.low[i] if self.low[i] is not None else self.high[i]
            if i not in ranges and side is not None:
                q[k + i] = -side
        for place, i in enumerate(ranges, k + len(self.A)):
            M[k + i][place], M[place][k + i] = Fraction(-1), Fraction(1)
        return M, q


def floats(values):
    return np.array(values, dtype=float)


def ends(values, none):
    return np.array([none if value is None else float(value) for value in values])


def combination(rows, factors):
    return [
        sum((factor * rows[i][j] for i, factor in factors.items()), Fraction(0))
        for j in range(len(rows[0]))
    ]


def sides_of(low, high, factors):
    """The sides of a combination that follow from those of its rows."""
    total = [Fraction(0), Fraction(0)]
    for i, factor in factors.items():
        own = (low[i], high[i]) if factor > 0 else (high[i], low[i])
        for k in (0, 1):
            value, end = total[k], own[k]
            total[k] = None if value is None or end is None else value + factor * end
    return total[0], total[1]


def dependent_program(seed, most=7, linear=None):
    """A program with a feasible point and a minimum: x is unique if it is quadratic.
    The numbers are whole or decimals."""
    random = np.random.default_rng(seed)
    n = int(random.integers(2, most + 1))
    unit = 10 ** int(random.integers(0, 3))

    def numbers(*shape):
        return random.integers(-5 * unit, 5 * unit + 1, shape)

    def exact(values):
        if values.ndim > 1:
            return [exact(row) for row in values]
        return [Fraction(int(value), unit) for value in values]

    is_linear = random.random() < 0.3 if linear is None else linear
    B = numbers(n, n)
    Q = exact(B.T @ B * 0 if is_linear else B.T @ B + unit * np.eye(n, dtype=int))
    x = exact(numbers(n))
    A = exact(numbers(int(random.integers(1, n)), n))
    low, high = [], []
    for row in A:
        value, kind = dot(row, x), random.choice(KINDS)
        gap = Fraction(int(random.integers(0, 2)))
        low.append(value - gap * (kind != "equation") if kind != "upper" else None)
        high.append(value + gap * (kind != "equation") if kind != "lower" else None)
        if kind == "range":
            low[-1], high[-1] = value - 2, value + 3
        if kind == "free":
            low[-1] = high[-1] = None
    combined = [{} for _ in A]
    for _ in range(int(random.integers(1, 4))):
        chosen = random.choice(len(A), min(len(A), int(random.integers(0, 3))), False)
        factors = {
            int(i): Fraction(int(random.choice([-2, -1, 1, 2, 3]))) for i in chosen
        }
        own = [Fraction(0)] * n if not factors else combination(A[: len(low)], factors)
        sides = sides_of(low, high, factors)
        A.append(own)
        low.append(sides[0])
        high.append(sides[1])
        combined.append(factors)
    bound = Fraction(int(random.integers(1, 4)))
    lower = [v - bound * int(random.integers(0, 2)) if is_linear else None for v in x]
    upper = [v + bound if is_linear else None for v in x]
    if not is_linear:
        lower = [v - bound if random.random() < 0.3 else None for v in x]
    return Dependent(Q, exact(numbers(n)), A, low, high, lower, upper, combined)


def of_equations(M, q, basic, others):
    """The z_i in B that the equations w_B = 0 determine, given all others; None for
    those that they do not, and in all if the equations contradict each other."""
    rows = [
        [
            *(M[i][j] for j in basic),
            -q[i] - sum((M[i][j] * v for j, v in others.items()), Fraction(0)),
        ]
        for i in basic
    ]
    found = reduced(rows, len(basic))
    if not all(any(row[:-1]) for row in found):
        return None
    pivots = {leading(row): row for row in found}
    free = [j for j in range(len(basic)) if j not in pivots]
    solution = {basic[j]: None for j in free}
    for j, row in pivots.items():
        solution[basic[j]] = None if any(row[f] for f in free) else row[-1]
    return solution


def strict_states(result):
    """The basic variables and the states of the others, if none is near to another."""
    box, z, w = result.problem.box, result.z, result.w
    basic = (z > box.lower) & (z < box.upper)
    fixed = box.lower == box.upper
    room = np.where(basic, np.minimum(z - box.lower, box.upper - z), np.abs(w))
    if (room[~fixed] < 1e-9).any():
        return None
    others = {
        int(i): "lower" if z[i] == box.lower[i] else "upper"
        for i in np.flatnonzero(~basic)
    }
    return np.flatnonzero(basic).tolist(), others


def of_states(program, basic, others):
    """What the equations of these states determine, in fractions."""
    m = len(program.A)
    both = zip(program.low, program.high, strict=True)
    ranges = [(a, b) for a, b in both if a is not None and b is not None and a != b]
    zeros = [Fraction(0)] * m
    ends = {
        "lower": [*program.lower, *zeros, *(a for a, _ in ranges)],
        "upper": [*program.upper, *zeros, *(b for _, b in ranges)],
    }
    M, q = program.conditions()
    at_bounds = {i: ends[state][i] or Fraction(0) for i, state in others.items()}
    return of_equations(M, q, basic, at_bounds)
