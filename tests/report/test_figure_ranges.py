"""The axes of figures: no value is lost, and ticks are few."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from lcpcli.report.figures import data, run_figures, style
from lcpcli.report.figures.data import Curve, Panel, Range

from .figure_samples import odd

VALUES = st.one_of(st.floats(min_value=0), st.sampled_from([0.0, math.nan, 1.0, 1e-12]), st.none())


@given(st.lists(st.lists(VALUES, max_size=8), max_size=4))
def test_no_measured_value_is_lost(series: list[list[float | None]]) -> None:
    panel = [odd("shi", errors) for errors in series]
    up = data.errors(panel)
    assert 0 < up.low <= up.scale_low < up.scale_high <= up.high < math.inf
    for curve in panel:
        across = data.times(curve.seconds)
        points = data.inside(curve.seconds, curve.errors, across, up)
        measured = [(x, y) for x, y in zip(curve.seconds, curve.errors, strict=True) if y is not None]
        assert len(points) == len(measured)
        for point, (x, y) in zip(points, measured, strict=True):
            assert up.low <= point.y <= up.high
            assert point.x == x or (x == 0 and across.low < point.x < across.scale_low)
            assert point.y == y or point.beyond in ("below", "above")


def test_zero_lies_below_the_scale_and_infinity_above_it() -> None:
    up = data.errors([odd("shi", [1.0, 1e-30, 1e-5, 0.0, math.inf, 1e30, math.nan])])
    across = Range(0.1, 10, 0.1, 10)
    points = data.inside([1.0] * 7, [1.0, 1e-30, 1e-5, 0.0, math.inf, 1e30, math.nan], across, up)
    assert [point.beyond for point in points] == ["", "below", "", "below", "above", "above", "above"]
    assert points[1].y < up.scale_low < 1e-5 < 1 < up.scale_high < points[4].y


def test_what_is_beyond_the_axes_is_ringed_and_explained() -> None:
    solved = Curve("lemke", "lemke", [0, 1, 2], [0.0, 1.0, 2.0], [1.0, 0.1, 0.0], True)
    with style.context():
        figure = run_figures.draw_convergence([Panel("p", "error", [solved])])
    rings = [line for line in figure.axes[1].lines if line.get_markerfacecolor() == "none" and len(line.get_xdata())]
    assert [list(ring.get_xdata()) for ring in rings] == [[2]]
    assert "0 or beyond the axis" in [text.get_text() for text in figure.legends[0].get_texts()]


@given(st.floats(-250, 250), st.floats(0.5, 40), st.integers(1, 8))
def test_ticks_are_few_powers_of_ten(start: float, length: float, most: int) -> None:
    span = Range(10**start, 10 ** (start + length), 10**start, 10 ** (start + length))
    majors, minors = data.decades(span, most)
    assert len(majors) <= most
    assert all(span.low * (1 - 1e-9) <= tick <= span.high * (1 + 1e-9) for tick in (*majors, *minors))
    assert not set(majors) & set(minors)
