"""Paths in fractions: each piece is proved, turns and rays are those that the set of all solutions has; and breakpoints
beside exact ones."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from lcpcli import Path, Problem, path, solutions
from lcpcli.gallery import families as gallery
from lcpcli.parametric.exact_pivoting import ExactFamily
from lcpcli.rational.exact_problem import ExactProblem, fractions_of

from .. import exact
from ..benchmarks.exact_breakpoints import exact_shares
from .families import Pair, boxed, general, integers, positive

NEAR = 1e-6  # how far from a turn the number of solutions is counted


def at(found: Path, s: Fraction) -> list[Fraction]:
    """Return z at s, between two breakpoints in fractions."""
    whole = found.exact
    k = next(k for k in range(len(whole.t) - 1) if whole.t[k] <= s <= whole.t[k + 1])
    share = (s - whole.t[k]) / (whole.t[k + 1] - whole.t[k])
    return [a + share * (b - a) for a, b in zip(whole.z[k], whole.z[k + 1], strict=True)]


@pytest.mark.parametrize("seed", range(0, 30, 5))
def test_paths_in_fractions_are_solutions_in_fractions(seed: int) -> None:
    """All complementary sets of small P-matrices are tried; at sixteenths, doubles represent the data of all t."""
    pair = positive(3 * seed, 2, 6)
    first, last = (Problem(pair[0].M, np.rint(2.0**44 * each.q) / 2.0**44) for each in pair)
    found = path(first, last, exact=True)
    assert (found.reached, found.verified) == (True, True)
    for k in range(1, 16, 3):
        assert at(found, Fraction(k, 16)) == exact.solution(found.family.at(k / 16))


@pytest.mark.parametrize("seed", range(6))
def test_both_arithmetics_find_the_same_path(seed: int) -> None:
    first, last = positive(seed, 5, 12)
    rounded, proved = path(first, last), path(first, last, exact=True)
    assert proved.verified
    assert np.array_equal(rounded.states, proved.states)
    assert rounded.t == pytest.approx(proved.t, abs=1e-12)
    assert rounded.z == pytest.approx(proved.z, abs=1e-12 * np.abs(proved.z).max())


@pytest.mark.parametrize("make", [integers, boxed])
def test_ties_in_fractions_leave_no_gap(make: Callable[[int], Pair]) -> None:
    for seed in range(24):
        found = path(*make(seed), exact=True)
        assert found.verified
        assert found.end in ("reached", "ray")
        assert sorted(found.exact.t) == found.exact.t
        assert found.exact.t[-1] == 1 or found.certificate is not None


def near(problem: Problem, z: np.ndarray, reach: float) -> int:
    """Return how many isolated solutions lie within a distance of z, by a search through all bases."""
    vertices = {tuple(vertex) for piece in solutions(problem) for vertex in piece.vertices}
    return sum(np.abs(np.array([float(value) for value in vertex]) - z).max() <= reach for vertex in vertices)


def test_at_a_turn_two_solutions_meet_and_beyond_it_there_is_none_near() -> None:
    met = 0
    for seed in range(100):
        found = path(*general(seed))
        assert found.verified, seed
        if found.end != "turn" or np.diff(found.t[-2:]) == 0 or found.t[-1] > 1 - NEAR:
            continue
        t, z = float(found.t[-1]), found.z[-1]
        slope = max(np.abs(found.z[-1] - found.z[-2]).max() / (found.t[-1] - found.t[-2]), 1)
        whole = path(*general(seed), turns=True)
        if whole.t.size == found.t.size or whole.t[found.t.size] >= t:  # no way back
            continue
        away = np.abs(whole.z[found.t.size] - z).max() / (t - whole.t[found.t.size])
        reach = 2 * NEAR * max(slope, away)
        assert near(found.family.at(t + NEAR), z, reach) == 0, seed
        assert near(found.family.at(t - NEAR), z, reach) >= 2, seed
        met += 1
    assert met >= 6


def test_a_ray_consists_of_solutions() -> None:
    met = 0
    for seed in range(100):
        found = path(*general(seed), turns=True, exact=True)
        assert found.verified, seed
        assert found.end in ("reached", "returned", "ray"), (seed, found.message)
        if found.end == "ray":
            direction, t, start = found.direction, found.exact.t[-1], found.exact.z[-1]
            whole = fractions_of(np.rint(direction / direction[direction > 0].min() * 2520))
            family = ExactFamily(*map(ExactProblem.of_floats, (found.problem, found.to)))
            for length in (Fraction(1, 7), 3):
                z = [a + length * b for a, b in zip(start, whole, strict=True)]
                w = family.w(t, z)
                assert min(*z, *w) >= 0, seed
                assert not any(a and b for a, b in zip(z, w, strict=True)), seed
            met += 1
    assert met >= 3


def test_a_proof_at_a_ray_is_right() -> None:
    for seed in range(1, 100, 4):
        first, last = integers(seed)
        found = path(first, last)
        if found.end == "ray":
            y = found.certificate
            assert exact.refutes(last, fractions_of(y))
            assert not list(solutions(last))


def test_exact_breakpoints_of_the_line_of_murty_are_its_whole_numbers_one_for_each_basis() -> None:
    """K. G. Murty, Computational complexity of parametric linear programming, Mathematical Programming 19 (1980)
    213-219, and for LCPs Linear Complementarity, Linear and Nonlinear Programming (1988), chapter 6."""
    found = path(*(gallery.make("all-cones", 6, t=t) for t in (-1.0, 63.0)))
    assert found.verified
    assert exact_shares(found, 1000) == [(k, Fraction(k, 64)) for k in range(1, 64)]
    assert len(exact_shares(found, 10)) == 10
    assert len({tuple(states) for states in found.states.tolist()}) == 64


@pytest.mark.parametrize(
    ("family", "n", "given", "ends"),
    [
        ("frontier", 12, {}, {"weight": (256.0, 0.0)}),
        ("lasso", 20, {"samples": 20}, {"penalty": (1.0, 0.0)}),
        ("spatial-prices", 24, {}, {"tax": (0.0, 18.0)}),
    ],
)
def test_breakpoints_of_models_are_exact_but_for_rounding(
    family: str, n: int, given: dict[str, Any], ends: dict[str, tuple[float, float]]
) -> None:
    first, last = (gallery.make(family, n, **given, **{name: end[k] for name, end in ends.items()}) for k in (0, 1))
    found = path(first, last)
    shares = exact_shares(found, 10)
    assert (found.end, found.verified, len(shares) > 3) == ("reached", True, True)
    assert max(abs(Fraction(found.t[k]) - share) for k, share in shares) < 1e-12
