"""A mixed problem in bounded variables, for bounds that change."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from lcpcli.methods.free_variables import Reduction
from lcpcli.model.box import Box

KINDS = {"free": (-np.inf, np.inf), "lower": (1, np.inf), "upper": (-np.inf, 1), "boxed": (0, 1), "fixed": (1, 1)}


def box_of(kinds: list[str], shift: float, width: float) -> Box:
    low, high = np.array([KINDS[kind] for kind in kinds]).T
    return Box(shift + low * width, shift + high * width)


@given(st.lists(st.sampled_from(list(KINDS)), min_size=1, max_size=6), st.integers(0, 20), st.booleans())
def test_a_reduction_holds_for_all_bounds_of_the_same_kinds(kinds: list[str], seed: int, is_singular: bool) -> None:
    random = np.random.default_rng(seed)
    M = random.integers(-3, 4, (len(kinds), len(kinds))) * 10.0 ** random.integers(-2, 3, len(kinds))
    if is_singular:
        M[:, 0] = M[0] = 0.0
    q, (box, other) = random.normal(size=len(kinds)), (box_of(kinds, 0.0, 1.0), box_of(kinds, -3.0, 2.5))
    anew, again = Reduction(M, other), Reduction(M, box).within(other)
    assert again is not None
    np.testing.assert_array_equal(again.d, anew.d)
    np.testing.assert_array_equal(again.constants(q), anew.constants(q))
    y, inside = random.uniform(size=anew.d.size), random.random(anew.d.size) < 0.5
    (z, basis), (expected, own) = (each.given(y, inside, ~inside) for each in (again, anew))
    np.testing.assert_array_equal(z, expected)
    assert np.array_equal(basis, own)


@given(st.lists(st.sampled_from(list(KINDS)), min_size=2, max_size=2, unique=True))
def test_a_reduction_does_not_hold_for_bounds_of_other_kinds(kinds: list[str]) -> None:
    one, other = (box_of([kind, "boxed"], 0.0, 1.0) for kind in kinds)
    assert Reduction(np.eye(2), one).within(other) is None
