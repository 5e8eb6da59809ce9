"""The axes of figures: no value is lost."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from lcpcli.report.figures import data
from lcpcli.report.figures.data import Range

from .figure_samples import odd

VALUES = st.one_of(st.floats(min_value=0), st.sampled_from([0.0, math.nan, 1.0, 1e-12]), st.none())


@given(st.lists(st.lists(VALUES, max_size=8), max_size=4))
def test_no_measured_value_is_lost(series: list[list[float | None]]) -> None:
    panel = [odd("shi", errors) for errors in series]
    up = data.errors(panel)
    assert 0 < up.low < up.high < math.inf
    for curve in panel:
        across = data.times(curve.seconds)
        points = data.inside(curve.seconds, curve.errors, across, up)
        measured = [(x, y) for x, y in zip(curve.seconds, curve.errors, strict=True) if y is not None]
        assert len(points) == len(measured)
        for point, (x, y) in zip(points, measured, strict=True):
            assert up.low <= point.y <= up.high
            assert point.x == x or (x == 0 and point.x == across.low)
            assert point.y == y or (point.is_beyond and point.y in up)


def test_zero_lies_below_all_other_values_and_infinity_above_them() -> None:
    up = data.errors([odd("shi", [1.0, 1e-30, 1e-5, 0.0, math.inf, 1e30, math.nan])])
    across = Range(0.1, 10)
    points = data.inside([1.0] * 7, [1.0, 1e-30, 1e-5, 0.0, math.inf, 1e30, math.nan], across, up)
    assert [point.is_beyond for point in points] == [False, True, False, True, True, True, True]
    low, high = {points[1].y, points[3].y}, {point.y for point in points[4:]}
    assert (low, high) == ({up.low}, {up.high})
    assert up.low < 1e-5 < 1 < up.high
