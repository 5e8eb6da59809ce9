"""Random convex programs with every kind of rows and bounds: each statement about them is proved in fractions.

A minimizer with its multipliers satisfies the first-order conditions, multipliers of rows exclude each x within the
bounds, a ray improves the objective of a feasible point for ever: all without rounding, from the data as integers.
LCP_ORACLE sets the number of programs.
"""

from __future__ import annotations

import os
from collections import Counter
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.optimize import linprog

from lcpcli import from_qp, run
from lcpcli.solving.answer import Minimum

COUNT = int(os.environ.get("LCP_ORACLE", "300"))
NONE = None
Row = list[Fraction]


class Program(NamedTuple):
    """Integers, None for no bound."""

    Q: Any
    c: Any
    A: Any
    row_lower: list[int | None]
    row_upper: list[int | None]
    lower: list[int | None]
    upper: list[int | None]
    sense: str


def interval(random: np.random.Generator, kinds: str) -> tuple[int | None, int | None]:
    """Bounds of a random kind: lower, upper, range, equation, none."""
    a, b = sorted(random.integers(-3, 4, 2).tolist())
    kind = random.choice(list(kinds))
    return {"l": (a, NONE), "u": (NONE, b), "r": (a, b), "e": (a, a), "n": (NONE, NONE), "0": (0, NONE)}[kind]


def program(seed: int) -> Program:
    random = np.random.default_rng(seed)
    k, m = int(random.integers(1, 5)), int(random.integers(0, 5))
    F = random.integers(-2, 3, (k, int(random.integers(0, k + 1))))
    Q = F @ F.T + (np.eye(k, dtype=int) if random.random() < 0.3 else 0)
    A = random.integers(-2, 3, (m, k))
    if m > 1 and random.random() < 0.2:
        A[-1] = A[0]
    if m and random.random() < 0.1:
        A[0] = 0
    rows, bounds = [interval(random, "llueern") for _ in range(m)], [interval(random, "00lurnne") for _ in range(k)]
    sense = "max" if random.random() < 0.3 else "min"
    sign = -1 if sense == "max" else 1
    ends = [[pair[i] for pair in pairs] for pairs in (rows, bounds) for i in (0, 1)]
    return Program(sign * Q, random.integers(-3, 4, k), A, *ends, sense)


def fractions(values: Any) -> Row:
    return [Fraction(float(value)).limit_denominator(20_000) for value in values]


def product(A: Any, x: Row) -> Row:
    return [sum((int(a) * v for a, v in zip(row, x, strict=True)), Fraction(0)) for row in A]


def is_within(values: Row, lower: list[int | None], upper: list[int | None]) -> bool:
    return all(
        (low is None or low <= v) and (high is None or v <= high)
        for v, low, high in zip(values, lower, upper, strict=True)
    )


def are_multipliers(y: Row, values: Row, lower: list[int | None], upper: list[int | None]) -> bool:
    """Whether they are positive at lower bounds only, negative at upper ones only: for a minimum."""
    return all(
        (u <= 0 or v == low) and (u >= 0 or v == high) for u, v, low, high in zip(y, values, lower, upper, strict=True)
    )


def is_minimum(p: Program, x: Row, y: Row, own: Row) -> bool:
    """Whether x and the multipliers, for the program as a minimum, satisfy the first-order conditions."""
    sign = -1 if p.sense == "max" else 1
    slope = [sign * (g + int(c)) for g, c in zip(product(p.Q, x), p.c, strict=True)]
    stationary = all(
        g - a == u for g, a, u in zip(slope, product(p.A.T, y) if y else [Fraction(0)] * len(x), own, strict=True)
    )
    rows = product(p.A, x)
    admissible = is_within(x, p.lower, p.upper) and is_within(rows, p.row_lower, p.row_upper)
    signs = are_multipliers(y, rows, p.row_lower, p.row_upper) and are_multipliers(own, x, p.lower, p.upper)
    return stationary and admissible and signs


def excludes(p: Program, y: Row) -> bool:
    """Whether no x within its bounds has y'Ax as large as the bounds of the rows ask for."""
    asked = Fraction(0)
    for u, low, high in zip(y, p.row_lower, p.row_upper, strict=True):
        bound = low if u > 0 else high
        if u and bound is None:
            return False
        asked += u * bound if u else 0
    most = Fraction(0)
    for g, low, high in zip(product(p.A.T, y), p.lower, p.upper, strict=True):
        bound = high if g > 0 else low
        if g and bound is None:
            return False
        most += g * bound if g else 0
    return most < asked


def improves_for_ever(p: Program, d: Row) -> bool:
    """Whether d keeps rows and bounds, leaves x'Qx as it is, and improves c'x."""
    sign = -1 if p.sense == "max" else 1
    ends = (product(p.A, d), p.row_lower, p.row_upper), (d, p.lower, p.upper)
    kept = all(
        (low is None or v >= 0) and (high is None or v <= 0)
        for values, lower, upper in ends
        for v, low, high in zip(values, lower, upper, strict=True)
    )
    return kept and not any(product(p.Q, d)) and sign * sum(int(c) * v for c, v in zip(p.c, d, strict=True)) < 0


def feasible_point(p: Program, objective: Any = None) -> Row | None:
    """A vertex by HiGHS, in fractions, if it satisfies rows and bounds exactly; None if there is none."""
    A, low, high = np.array(p.A, dtype=float).reshape(-1, len(p.c)), p.row_lower, p.row_upper
    below = [-A[i] for i, v in enumerate(low) if v is not None]
    rows = below + [A[i] for i, v in enumerate(high) if v is not None]
    ends = [-v for v in low if v is not None] + [v for v in high if v is not None]
    c = np.zeros(len(p.c)) if objective is None else objective
    given = {"A_ub": np.array(rows), "b_ub": np.array(ends, dtype=float)} if rows else {}
    found = linprog(c, **given, bounds=list(zip(p.lower, p.upper, strict=True)))
    if found.status != 0:
        return None
    x = fractions(found.x)
    assert is_within(x, p.lower, p.upper)
    assert is_within(product(p.A, x), p.row_lower, p.row_upper)
    return x


def proved(p: Program) -> str:
    """What the answer says, after it has been proved."""
    m = len(p.row_lower)
    rows = {"A": p.A, "row_lower": p.row_lower, "row_upper": p.row_upper} if m else {}
    result = run(from_qp(p.Q, p.c, **rows, lower=p.lower, upper=p.upper, sense=p.sense))
    answer = result.answer
    assert isinstance(answer, Minimum)
    if result.solved:
        assert answer.bound_multipliers is not None
        sign = -1 if p.sense == "max" else 1
        x, y, own = (fractions(values) for values in (answer.x, answer.y, answer.bound_multipliers))
        assert is_minimum(p, x, [sign * u for u in y], [sign * u for u in own])
        squares = sum(u * v for u, v in zip(x, product(p.Q, x), strict=True))
        value = squares / 2 + sum(int(c) * v for c, v in zip(p.c, x, strict=True))
        assert answer.objective == pytest.approx(float(value), rel=1e-9, abs=1e-9)
        other = has_other(p, x, [sign * u for u in y], [sign * u for u in own])
        assert ("one of several" in answer.statement) == other
        return "several" if "one of several" in answer.statement else "solved"
    if "infeasible:" in answer.statement:
        assert answer.certificate is not None
        assert excludes(p, fractions(answer.certificate))
        return "infeasible"
    if "unbounded" in answer.statement and "infeasible" not in answer.statement:
        assert answer.ray is not None
        assert improves_for_ever(p, fractions(answer.ray))
        assert feasible_point(p) is not None
        assert "tolerance" not in answer.statement
        return "unbounded"
    return "undecided"


def has_other(p: Program, x: Row, y: Row, own: Row) -> bool:
    """Whether another point has the same multipliers: the farthest ones in a few directions, from the conditions."""
    fixed_rows = [v if u else None for u, v in zip(y, product(p.A, x), strict=True)]
    fixed = [v if u else None for u, v in zip(own, x, strict=True)]
    slopes = product(p.Q, x)
    A = np.vstack((np.array(p.A).reshape(-1, len(x)), p.Q))
    low = [*(f if f is not None else v for f, v in zip(fixed_rows, p.row_lower, strict=True)), *slopes]
    high = [*(f if f is not None else v for f, v in zip(fixed_rows, p.row_upper, strict=True)), *slopes]
    reach = [(v - 10, v + 10) for v in x]
    lower = [
        f if f is not None else max(v if v is not None else a, a)
        for f, v, (a, _) in zip(fixed, p.lower, reach, strict=True)
    ]
    upper = [
        f if f is not None else min(v if v is not None else b, b)
        for f, v, (_, b) in zip(fixed, p.upper, reach, strict=True)
    ]
    rest = p._replace(A=A, row_lower=low, row_upper=high, lower=lower, upper=upper)
    for direction in (*np.eye(len(x)), *-np.eye(len(x))):
        other = feasible_point(rest, direction)
        if other is not None and other != x and is_minimum(p, other, y, own):
            return True
    return False


@pytest.mark.slow("many random programs, each against exact arithmetic")
def test_every_statement_about_a_program_is_proved_in_fractions() -> None:
    found = Counter(proved(program(seed)) for seed in range(COUNT))
    assert found["undecided"] == 0
    assert all(found[kind] >= COUNT // 100 for kind in ("solved", "several", "infeasible", "unbounded")), found
