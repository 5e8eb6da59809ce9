"""Statements about programs are true, by the conditions of Karush, Kuhn and Tucker,
computed from the program alone.

Each statement about small random ones is proved in fractions, from integers: a
minimizer with its multipliers satisfies the conditions, multipliers of rows exclude
each x within the bounds, a ray improves the objective of a feasible point for ever.
LCP_ORACLE sets the number of them. Programs of the literature have the optimal values
that it gives.
"""

import os
from collections import Counter
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.optimize import linprog

from lcpcli import from_qp, run

COUNT = int(os.environ.get("LCP_ORACLE", "300"))
Row = list[Fraction]
Ends = list[Any]


class Small(NamedTuple):
    """min x'Qx / 2 + c'x, or with the sign -1 max -x'Qx / 2 - c'x, with low <= Gx <=
    high, whose last rows are bounds: integers, None for no bound."""

    Q: Any
    c: Any
    G: Any
    low: Ends
    high: Ends
    sign: int


def interval(random, kinds):
    """Bounds of a random kind: lower, upper, range, equation, none."""
    a, b = sorted(random.integers(-3, 4, 2).tolist())
    kind = random.choice(list(kinds))
    return {
        "l": (a, None),
        "u": (None, b),
        "r": (a, b),
        "e": (a, a),
        "n": (None, None),
        "0": (0, None),
    }[kind]


def program(seed):
    random = np.random.default_rng(seed)
    k, m = int(random.integers(1, 5)), int(random.integers(0, 5))
    F = random.integers(-2, 3, (k, int(random.integers(0, k + 1))))
    Q = F @ F.T + (np.eye(k, dtype=int) if random.random() < 0.3 else 0)
    A = random.integers(-2, 3, (m, k))
    if m > 1 and random.random() < 0.2:
        A[-1] = A[0]
    if m and random.random() < 0.1:
        A[0] = 0
    pairs = [interval(random, "llueern") for _ in range(m)] + [
        interval(random, "00lurnne") for _ in range(k)
    ]
    low, high = ([pair[side] for pair in pairs] for side in (0, 1))
    sign = -1 if random.random() < 0.3 else 1
    return Small(
        Q,
        sign * random.integers(-3, 4, k),
        np.vstack((A, np.eye(k, dtype=int))),
        low,
        high,
        sign,
    )


def fractions(values):
    return [Fraction(float(value)).limit_denominator(20_000) for value in values]


def whole(values):
    assert all(value == int(value) for value in values.tolist()), (
        "a proof holds as it is written"
    )
    return fractions(values)


def product(A, x):
    return [
        sum((int(a) * v for a, v in zip(row, x, strict=True)), Fraction(0)) for row in A
    ]


def is_within(values, low, high):
    triples = zip(values, low, high, strict=True)
    return all((a is None or a <= v) and (b is None or v <= b) for v, a, b in triples)


def is_minimum(p, x, u):
    """Whether x and the multipliers u satisfy the first-order conditions: u is positive
    at lower bounds only."""
    rows = product(p.G, x)
    slope = [g + int(c) for g, c in zip(product(p.Q, x), p.c, strict=True)]
    of_signs = all(
        (m <= 0 or v == a) and (m >= 0 or v == b)
        for m, v, a, b in zip(u, rows, p.low, p.high, strict=True)
    )
    return slope == product(p.G.T, u) and is_within(rows, p.low, p.high) and of_signs


def excludes(p, y):
    """Whether no x within its bounds has y'Ax as large as the bounds of the rows ask
    for."""
    u = [*y, *(-value for value in product(p.G[: len(y)].T, y))]
    ends = [
        low if m > 0 else high for m, low, high in zip(u, p.low, p.high, strict=True)
    ]
    used = [(m, end) for m, end in zip(u, ends, strict=True) if m]
    return (
        all(end is not None for _, end in used) and sum(m * end for m, end in used) > 0
    )


def improves_for_ever(p, d):
    """Whether d keeps rows and bounds, leaves x'Qx as it is, and improves c'x."""
    rows = product(p.G, d)
    low, high = (
        [end if end is None else 0 for end in ends] for ends in (p.low, p.high)
    )
    return (
        is_within(rows, low, high)
        and not any(product(p.Q, d))
        and product([p.c], d)[0] < 0
    )


def feasible_point(p, objective=None):
    """A vertex by HiGHS, in fractions, if it satisfies rows and bounds exactly; None if
    there is none."""
    below = [
        (-row, -end) for row, end in zip(p.G, p.low, strict=True) if end is not None
    ]
    ends = below + [
        (row, end) for row, end in zip(p.G, p.high, strict=True) if end is not None
    ]
    given = (
        {
            "A_ub": np.array([a for a, _ in ends]),
            "b_ub": np.array([float(b) for _, b in ends]),
        }
        if ends
        else {}
    )
    found = linprog(
        np.zeros(len(p.c)) if objective is None else objective,
        **given,
        bounds=(None, None),
    )
    if found.status != 0:
        return None
    x = fractions(found.x)
    assert is_within(product(p.G, x), p.low, p.high)
    return x


def has_other(p, x, u):
    """Whether another point has the same multipliers: the farthest ones in a few
    directions, from the conditions."""
    rows, slopes = product(p.G, x), product(p.Q, x)
    low, high = (
        [v if m else end for v, m, end in zip(rows, u, ends, strict=True)]
        for ends in (p.low, p.high)
    )
    rest = p._replace(
        G=np.vstack((p.G, p.Q, p.G[-len(x) :])),
        low=[*low, *slopes, *(v - 10 for v in x)],
        high=[*high, *slopes, *(v + 10 for v in x)],
    )
    others = (
        feasible_point(rest, direction)
        for direction in (*np.eye(len(x)), *-np.eye(len(x)))
    )
    return any(
        other is not None and other != x and is_minimum(p, other, u) for other in others
    )


def proved(p):
    """What the answer says, after it has been proved."""
    m, sign = len(p.low) - len(p.c), p.sign
    rows = {"A": p.G[:m], "row_lower": p.low[:m], "row_upper": p.high[:m]} if m else {}
    sense = "min" if sign > 0 else "max"
    result = run(
        from_qp(
            sign * p.Q,
            sign * p.c,
            **rows,
            lower=p.low[m:],
            upper=p.high[m:],
            sense=sense,
        )
    )
    answer = result.answer
    if result.solved:
        x, y, own = (
            fractions(values)
            for values in (answer.x, answer.y, answer.bound_multipliers)
        )
        u = [sign * value for value in (*y, *own)]
        assert is_minimum(p, x, u)
        squares = sum(a * b for a, b in zip(x, product(p.Q, x), strict=True))
        value = squares / 2 + product([p.c], x)[0]
        assert answer.objective == pytest.approx(
            sign * float(value), rel=1e-9, abs=1e-9
        )
        assert ("one of several" in answer.statement) == has_other(p, x, u)
        return "several" if "one of several" in answer.statement else "solved"
    assert answer.x is None
    assert answer.y is None
    assert answer.objective is None
    if "infeasible:" in answer.statement:
        assert excludes(p, whole(answer.certificate))
        return "infeasible"
    if "unbounded" in answer.statement and "infeasible" not in answer.statement:
        assert improves_for_ever(p, whole(answer.ray))
        assert feasible_point(p) is not None
        assert "tolerance" not in answer.statement
        return "unbounded"
    return "undecided"


@pytest.mark.parametrize(
    "count",
    [24, pytest.param(COUNT, marks=pytest.mark.slow("each against exact arithmetic"))],
)
def test_every_statement_about_a_program_is_proved_in_fractions(count):
    found = Counter(proved(program(seed)) for seed in range(count))
    assert found["undecided"] == 0
    assert all(
        found[kind] >= max(1, count // 100)
        for kind in ("solved", "several", "infeasible", "unbounded")
    ), found


# E. M. L. Beale, Cycling in the dual simplex algorithm (1955); V. Klee, G. J. Minty,
# How good is the simplex algorithm? (1972), in V. Chvatal's form, Linear Programming
# (1983), chapter 4.
BEALE = (
    None,
    [-0.75, 150, -0.02, 6],
    [[0.25, -60, -0.04, 9], [0.5, -90, -0.02, 3], [0, 0, 1, 0]],
)
KLEE_MINTY = None, [100, 10, 1], [[1, 0, 0], [20, 1, 0], [200, 20, 1]]
LITERATURE = {
    "Beale's cycling example": (from_qp(*BEALE, row_upper=[0, 0, 1]), -0.05),
    "Klee-Minty": (from_qp(*KLEE_MINTY, row_upper=[1, 100, 10000], sense="max"), 10000),
}


@pytest.mark.parametrize("name", LITERATURE)
def test_optimal_values_are_those_of_the_literature(name):
    problem, value = LITERATURE[name]
    assert run(problem).answer.objective == pytest.approx(value, rel=1e-9)
