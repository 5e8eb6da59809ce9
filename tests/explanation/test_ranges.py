"""Ranges: the optimal partition is the same just inside of their ends and another one
just outside, by the list of all solutions; and those of linear programs are the ranges
of HiGHS where no basis is degenerate."""

from fractions import Fraction

import numpy as np
import pytest
from numpy.random import default_rng

import lcpcli
from lcpcli import Problem, why
from lcpcli.rational.exact_problem import ExactProblem

from ..seeds import few_of, parts

FIELDS = ("q", "lower", "upper")
NEAR = Fraction(1, 10**6)
WORDS = ABOVE, BELOW, *SIGNS = "above", "below", "positive", "negative"


def held(i, *signs):
    return {(word, i) for word, sign in zip(WORDS, signs, strict=True) if sign}


def partition_of(data):
    """The optimal partition, by all solutions of a problem, which form a polyhedron:
    which z_i can be above their lower bounds, and below their upper ones, and which w_i
    can be positive, and negative; None if there is none."""
    if data is None:
        return None
    found = set()
    pieces = lcpcli.solutions(data)
    for piece in pieces:
        for z in piece.vertices:
            rows = zip(z, data.w(z), data.lower, data.upper, strict=True)
            for i, (a, w, low, high) in enumerate(rows):
                found |= held(
                    i, low is None or a > low, high is None or a < high, w > 0, w < 0
                )
        moves = [*piece.rays, *piece.lines, *([-a for a in d] for d in piece.lines)]
        for d in moves:
            changes = zip(d, data.w(d), data.w([0] * data.n), strict=True)
            for i, (a, w, before) in enumerate(changes):
                found |= held(i, a > 0, a < 0, w > before, w < before)
    assert pieces.complete
    if not pieces.pieces:
        return None
    fixed = {i for i in range(data.n) if data.lower[i] == data.upper[i] is not None}
    return {(word, i) for word, i in found if word not in SIGNS or i not in fixed}


def inside(partition):
    return {i for word, i in partition if word == ABOVE and (BELOW, i) in partition}


def moved(data, field, i, value):
    """The problem with another number; None if its bounds cross then."""
    q = [Fraction(*each) for each in zip(data.constants, data.scales, strict=True)]
    numbers = {"q": q, "lower": list(data.lower), "upper": list(data.upper)}
    numbers[field][i] = value
    low, high = numbers["lower"][i], numbers["upper"][i]
    if low is not None and high is not None and low > high:
        return None
    return ExactProblem(data.problem, data.M, *numbers.values())


def convex_problem(seed):
    """A problem with a positive semidefinite M, often singular and degenerate, every
    other one with bounds of all kinds."""
    random = default_rng(seed)
    n = int(random.integers(1, 6))
    B = random.integers(-2, 3, (int(random.integers(0, n + 1)), n))
    S = np.triu(random.integers(-2, 3, (n, n)), 1)
    q = random.integers(-4, 4, n)
    lower, upper = np.zeros(n), np.full(n, np.inf)
    for i in range(n if seed % 2 else 0):
        kind = random.integers(5)
        lower[i] = -np.inf if kind < 2 else random.integers(-2, 3)
        if kind == 1:
            upper[i] = random.integers(-2, 3)
        elif kind == 2:
            upper[i] = lower[i] + random.integers(0, 3)
    return Problem(B.T @ B + S - S.T, q, lower=lower, upper=upper)


@pytest.mark.parametrize("seed", few_of(range(60), 25))
def test_the_partition_is_the_same_inside_and_another_one_outside(seed):
    check_ranges(convex_problem(seed))


def check_ranges(problem):
    data = ExactProblem.of_floats(problem)
    base, found = partition_of(data), why(problem)
    if base is None:
        assert found.status == "unsolvable"
        return found
    assert found.status == "solved"
    assert found.complete
    for field in FIELDS:
        for i, own in enumerate(found.ranges[field]):
            if own is not None:
                _check_inside(data, base, field, i, own)
                _check_ends(data, base, field, i, own)
    return found


def _check_inside(data, base, field, i, own):
    low = own.value - 7 if own.below is None else own.below.value
    high = own.value + 7 if own.above is None else own.above.value
    assert low <= own.value <= high
    for share in (NEAR, Fraction(1, 3), 1 - NEAR) if low < high else ():
        value = low + (high - low) * share
        assert partition_of(moved(data, field, i, value)) == base


def _check_ends(data, base, field, i, own):
    for end, side in ((own.below, -1), (own.above, 1)):
        if end is None:
            continue
        there = moved(data, field, i, end.value)
        assert there.is_solution(end.z)
        beyond = partition_of(moved(data, field, i, end.value + side * NEAR))
        assert beyond != base
        if beyond is None:
            assert end.enters is None
        elif end.enters is not None:
            assert {*end.enters} == inside(beyond) - inside(base)
            assert {*(end.leaves or ())} == inside(base) - inside(beyond)


def test_ranges_hold_where_equations_depend_on_others_and_solutions_on_a_line():
    """The multipliers of two equations of one variable, which is at its bound, are
    only determined together."""
    M = [[0, -3, 3, 0, 3], [3, 0, 0, 0, 0], [-3, 0, 0, 0, 0], [0] * 5, [-3, 0, 0, 0, 0]]
    lower, upper = [0, *[-np.inf] * 4], [np.inf, np.inf, np.inf, 0, np.inf]
    problem = Problem(M, [0, 0, 0, -2, 0], lower=lower, upper=upper)
    found = check_ranges(problem)
    (own, *_) = found.ranges["lower"]
    assert own.below.value == own.above.value == 0


def random_program(seed):
    random = default_rng(seed)
    m, k = random.integers(1, 7), random.integers(2, 8)
    A = np.round(random.normal(size=(m, k)) * (random.random((m, k)) < 0.6), 2)
    v = A @ random.uniform(0, 4, k)
    low = np.where(random.random(m) < 0.6, np.round(v - random.random(m), 2), -np.inf)
    high = np.where(np.isfinite(low), np.inf, np.round(v + random.random(m), 2))
    c = np.round(random.uniform(-1, 5, k), 2)
    upper = np.where(random.random(k) < 0.6, np.inf, 9.0)
    bounds = {"row_lower": low, "row_upper": high, "upper": upper}
    return {"c": c, "A": A, **bounds, "lower": np.zeros(k)}


def _is_degenerate(highs, basic, program):
    """Whether a basic variable is at a bound, or the reduced cost of another one is
    0."""
    solution, basis = highs.getSolution(), highs.getBasis()
    statuses = [*basis.col_status, *basis.row_status]
    duals = np.array([*solution.col_dual, *solution.row_dual])
    values = np.array([*solution.col_value, *solution.row_value])
    distances = [
        np.abs(values - np.concatenate((program[end], program[f"row_{end}"])))
        for end in ("lower", "upper")
    ]
    is_basic = np.array([status == basic for status in statuses])
    return np.where(is_basic, np.min(distances, axis=0), np.abs(duals)).min() < 1e-6


@pytest.mark.parametrize("seeds", parts(12, 60))
def test_ranges_of_programs_are_those_of_highs_where_no_basis_is_degenerate(seeds):
    highspy = pytest.importorskip("highspy")
    from lcpcli.linalg.programs import highs_of_program

    compared = 0
    for seed in seeds:
        program = random_program(seed)
        c, A = program["c"], program["A"]
        ends = program["row_lower"], program["row_upper"]
        highs = highs_of_program(c, A, ends, (program["lower"], program["upper"]), {})
        highs.run()
        if highs.getModelStatus() != highspy.HighsModelStatus.kOptimal:
            continue
        basic = highspy.HighsBasisStatus.kBasic
        if _is_degenerate(highs, basic, program):
            continue
        found = why(lcpcli.from_qp(None, **program))
        _, theirs = highs.getRanging()
        ranges = theirs.col_cost_dn, theirs.col_cost_up
        ends = theirs.row_bound_dn, theirs.row_bound_up
        lows, highs_ends = (
            [*costs.value_[: c.size], *sides.value_[: len(A)]]
            for costs, sides in zip(ranges, ends, strict=True)
        )
        # Of a basic row the range is that of its value.
        is_told = [*[True] * c.size, *(s != basic for s in highs.getBasis().row_status)]
        for i in np.flatnonzero(is_told):
            _assert_near(found.ranges["q"][i], lows[i], highs_ends[i])
            compared += 1
    assert compared > 25


def _assert_near(own, low, high):
    for end, other in ((own.below, low), (own.above, high)):
        assert (end is None) == (abs(other) > 1e29)
        if end is not None:
            assert float(end.value) == pytest.approx(other, rel=1e-9, abs=1e-9)


def test_ends_of_ranges_have_the_objective_and_the_basis_a_smaller_range():
    """Two ways at the same cost: the cost of each is at the end of its range, and a
    basis uses one of them alone."""
    problem = lcpcli.from_qp(None, [1, 1, 3], [[1, 1, 1]], row_lower=[4])
    found = why(problem)
    first, _, third, side = found.ranges["q"]
    assert first.below.value == first.above.value == first.value == 1
    assert third.below.value == 1
    assert third.below.objective == 4
    assert (side.below and side.below.value) == 0
    assert side.above is None
    assert first.basis in {(None, 1), (0, 1), (1, None)}
