"""Breakpoints of paths beside exact ones."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from lcpcli import Problem
from lcpcli.gallery import families as gallery
from lcpcli.parametric.following import path

from ..benchmarks.exact_breakpoints import ExactBreakpoints, exact_shares


def test_exact_breakpoints_of_the_line_of_murty_are_its_whole_numbers() -> None:
    first, last = (gallery.make("all-cones", 6, t=t) for t in (-1.0, 63.0))
    found = exact_shares(path(first, last), 1000)
    assert found == [(k, Fraction(k, 64)) for k in range(1, 64)]
    assert len(exact_shares(path(first, last), 10)) == 10


def test_exact_breakpoints_with_bounds_are_those_of_a_hand_calculation() -> None:
    """z_1 = (6 s - 1/2) / 3 between 0 and 1; z_2 is positive from the start."""
    M = [[3.0, 0.0], [0.0, 3.0]]
    first, last = (Problem(M, q, upper=[1, np.inf]) for q in ([0.5, -1], [-5.5, -7]))
    followed = path(first, last)
    assert exact_shares(followed, 10) == [(1, Fraction(1, 12)), (2, Fraction(7, 12))]
    assert followed.t.tolist() == pytest.approx([0, 1 / 12, 7 / 12, 1])


def test_moving_bounds_count_in_exact_breakpoints() -> None:
    """z_1 = 1 + s meets the bound 3 - 2 s at s = 2/3."""
    first, last = Problem([[1.0]], [-1], upper=3), Problem([[1.0]], [-2], upper=1)
    exact = exact_shares(path(first, last), 10)
    assert [share.limit_denominator(10**9) for _, share in exact] == [Fraction(2, 3)]
    assert abs(exact[0][1] - Fraction(2, 3)) < Fraction(1, 10**100)


def test_a_singular_basis_has_no_exact_breakpoint() -> None:
    first, last = Problem(np.ones((2, 2)), [-1, -1]), Problem(np.ones((2, 2)), [-1, 1])
    family = path(first, last).family
    assert ExactBreakpoints(family).share(np.zeros(2, dtype=int), 0, -1) is None


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
    exact = exact_shares(found, 10)
    assert (found.end, found.verified, len(exact) > 3) == ("reached", True, True)
    assert max(abs(Fraction(found.t[k]) - share) for k, share in exact) < 1e-12
