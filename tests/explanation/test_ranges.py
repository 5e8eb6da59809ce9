"""Ranges: those of linear programs are the ranges of HiGHS where no basis is
degenerate, and they name what changes; other problems have none."""

import numpy as np
import pytest
from numpy.random import default_rng

import lcpcli
from lcpcli import why

from ..seeds import parts


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
            _assert_near(found.ranges[i], lows[i], highs_ends[i])
            compared += 1
    assert compared > 25


def _assert_near(own, low, high):
    for end, other in ((own.below, low), (own.above, high)):
        assert (end is None) == (abs(other) > 1e29)
        if end is not None:
            assert float(end.value) == pytest.approx(other, rel=1e-9, abs=1e-9)


def test_ranges_name_what_changes_beyond_them():
    """min 2 x + 3 y with 1 <= x + y <= 8 and x <= 5: x is 1."""
    problem = lcpcli.from_qp(
        None, [2, 3], [[1, 1]], row_lower=[1], row_upper=[8], upper=[5, np.inf]
    )
    found = why(problem).ranges
    told = [(each.number.what, each.below, each.above) for each in found]
    assert told == [
        ("cost", (0, "row r1 stops binding"), (3, "x2 leaves its bound")),
        ("cost", (2, "x2 leaves its bound"), None),
        ("lower side", (0, "x1 reaches a bound"), (5, "x1 reaches a bound")),
        ("upper side", (1, "row r1 binds"), None),
    ]


def test_a_quadratic_program_has_ranges_of_its_basis():
    """min x^2 - 2 x with x <= 5 is at x = 1 = (2 - t) / 2 for the cost -2 + t."""
    problem = lcpcli.from_qp([[2]], [-2], upper=[5])
    (cost,) = why(problem).ranges
    assert cost.below.value == pytest.approx(-10)
    assert cost.above.value == pytest.approx(0)
    assert cost.above.change == "x1 reaches a bound"


def test_problems_that_are_no_programs_have_no_ranges():
    found = why(lcpcli.Problem([[2, 1], [1, 2]], [-5, -6]))
    assert found.complete
    assert found.ranges is None
    assert found.message == "the problem has a solution"
