"""Figures of runs and of benchmarks: every curve, marker, legend and exponent, small files, and few settings."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from lcpcli.errors import OptionError
from lcpcli.files import contents
from lcpcli.report import plotting as figures
from lcpcli.report.figures import data, run_figures, style
from lcpcli.report.figures.data import Curve, Growth, GrowthPanel, Panel, Power, Profile, Range

from .drawn_texts import texts
from .figure_samples import METHODS, PEERS, bench, convergence, crowd, decaying, growth, odd, paper_panel, profiles

EXAMPLE = contents.shipped_path("paper-example-1.json")


def legend_of(figure: Figure) -> list[str]:
    (legend,) = figure.legends
    return [text.get_text() for text in legend.get_texts()]


@pytest.mark.slow("draws large figures")
@pytest.mark.parametrize("count", [1, 2, 6, 11])
def test_one_legend_below_the_axes_names_every_curve_and_explains_the_signs(count: int) -> None:
    figure = convergence(crowd(count), crowd(count))
    with style.context():
        (legend,) = figure.legends
        named = [text.get_text() for text in texts(figure) if text in legend.get_texts()]
        below = min(axes.xaxis.label.get_window_extent().y0 for axes in figure.axes)
        assert max(text.get_window_extent().y1 for text in legend.get_texts()) < below
    signs = ["0 or beyond the axis"] + ["not solved"] * (count > 1)
    assert named == [*(METHODS + PEERS)[:count], *signs]


def test_a_figure_is_no_higher_than_its_rows_and_its_legend() -> None:
    assert convergence(paper_panel()).get_figheight() < 1.12 * style.ROW


def test_long_runs_make_small_files() -> None:
    k = list(range(10_000))
    errors = (np.exp(-np.arange(10_000) / 700) * np.random.default_rng(0).uniform(0.1, 1, 10_000)).tolist()
    assert (
        len(figures.convergence([Panel("long", "error", [Curve("shi", "shi", k, k, errors, True)])], "svg")) < 200_000
    )


def test_a_curve_has_few_markers_and_its_ends_among_them() -> None:
    for axes in convergence(Panel("p", "error", [decaying("shi", 0.99, 1000)])).axes:
        markers = [line for line in axes.lines if line.get_marker() == style.METHODS["shi"].marker]
        xs = np.concatenate([line.get_xdata() for line in markers[:1]])
        assert 5 <= xs.size <= run_figures.MOST_MARKERS + 2
        line = next(line for line in axes.lines if line.get_linestyle() != "None")
        assert {xs[0], xs[-1]} == {line.get_xdata()[0], line.get_xdata()[-1]}
        assert {line.get_linestyle() for line in axes.lines} <= {"-", "None"}


@pytest.mark.slow("draws many large figures")
def test_the_figure_of_the_most_problems_fits_on_a_page(lcp: Callable[..., Any], tmp_path: Path) -> None:
    figure = convergence(*[crowd(15)] * figures.MOST_PANELS)
    assert figure.get_figwidth() <= 8.27
    assert figure.get_figheight() <= 11.69
    one_more = [EXAMPLE] * (figures.MOST_PANELS + 1)
    outcome = lcp("compare", *one_more, "--plot", str(tmp_path / "figure.svg"))
    assert (outcome.code, outcome.out, outcome.err.count("\n")) == (2, "", 1)
    assert "8 problems" in outcome.err


def test_a_profile_is_the_share_of_problems_within_each_ratio_or_over_time() -> None:
    (axes,) = bench([Profile("shi", "shi", [1.0, 2.0, 2.0, math.inf])]).axes
    assert axes.lines[0].get_xydata()[:2].tolist() == [[1.0, 0.25], [2.0, 0.75]]
    assert axes.lines[0].get_ydata()[-1] == 0.75
    (axes,) = bench([Profile("shi", "shi", [0.25, 0.5, 0.5, math.inf], in_seconds=True)]).axes
    assert axes.lines[0].get_xydata()[1:3].tolist() == [[0.25, 0.25], [0.5, 0.75]]
    assert (axes.get_xlabel(), axes.get_title("left")) == ("run time (s)", "Solved over time, 4 problems")


def test_growth_has_its_quartiles_and_a_fit_with_the_interval_of_its_exponent_or_joined_times() -> None:
    def drawn(fit: Power | None) -> Any:
        grown = Growth("shi", "shi", [10, 1000], [1.0, 3.0], [1.0, 2.0], [1.0, 4.0], fit)
        return bench([], [], [GrowthPanel("p", [grown])]).axes[0]

    fitted, joined = drawn(Power(2.0, 0.25, 1e-3, 1.0)), drawn(None)
    assert fitted.lines[0].get_ydata() == pytest.approx([0.1, 1000.0])
    assert [text.get_text() for text in fitted.get_legend().get_texts()] == [r"$n^{2.00 \pm 0.25}$"]
    assert [part[:, 1].tolist() for part in fitted.collections[0].get_segments()] == [[1.0, 1.0], [2.0, 4.0]]
    assert joined.lines[0].get_ydata() == pytest.approx([1.0, 3.0])
    assert joined.get_legend() is None


@pytest.mark.slow("draws large figures")
@pytest.mark.parametrize("count", [1, 6, 11])
def test_exponents_stand_in_the_order_of_the_lines_and_clear_of_them(count: int) -> None:
    figure = bench([], [crowd(1)], [growth(count)])
    with style.context():
        FigureCanvasAgg(figure).draw()
        axes = figure.axes[1]
        legend = axes.get_legend()
        right = max(axes.transData.transform(line.get_xydata())[:, 0].max() for line in axes.lines)
        box = legend.get_window_extent()
        assert box.x0 > right
        assert axes.bbox.y0 < box.y0 < box.y1 < axes.bbox.y1
    exponents = sorted((one.fit.exponent for one in growth(count).growths if one.fit), reverse=True)
    assert [text.get_text() for text in legend.get_texts()] == [rf"$n^{{{e:.2f} \pm 0.10}}$" for e in exponents]


SHORT = Panel("short", "error", [decaying("shi", 0.5, 12), decaying("fixed-point", 0.4, 20)])
LONG = Panel("long", "error", [decaying("shi", 0.5, 6), decaying("fixed-point", 0.99, 2000)])
BARE = odd("lemke", [None, None])


@pytest.mark.parametrize(("panels", "kind"), [([SHORT], "linear"), ([SHORT, LONG], "symlog"), ([LONG], "symlog")])
def test_all_axes_of_one_quantity_are_of_one_kind(panels: list[Panel], kind: str) -> None:
    axes = convergence(*panels).axes
    assert {each.get_xscale() for each in axes[1::2]} == {kind}
    assert {each.get_xscale() for each in axes[::2]} == {"log"}


def test_a_legend_names_what_is_drawn_alone_and_is_left_out_without_entries() -> None:
    with_bare = Panel("bare", "error", [*SHORT.curves, BARE])
    for figure in (convergence(with_bare, SHORT), bench([], [with_bare])):
        assert legend_of(figure)[:2] == ["shi", "fixed-point"]
        assert "lemke" not in legend_of(figure)
    assert not convergence(Panel("p", "error", [BARE])).legends
    assert len(legend_of(bench(profiles(3)))) == 3
    assert len(legend_of(bench([], [], [growth(2)]))) == 2


def test_a_run_without_a_finite_error_is_drawn_at_the_edge_and_named() -> None:
    figure = convergence(Panel("p", "error", [odd("shi", [math.nan, math.inf])]))
    assert figure.axes[1].lines
    assert legend_of(figure)[0] == "shi"


def test_what_is_beyond_the_axes_is_ringed_and_explained() -> None:
    solved = Curve("lemke", "lemke", [0, 1, 2], [0.0, 1.0, 2.0], [1.0, 0.1, 0.0], True)
    figure = convergence(Panel("p", "error", [solved]))
    rings = [line for line in figure.axes[1].lines if line.get_markerfacecolor() == "none" and len(line.get_xdata())]
    assert [list(ring.get_xdata()) for ring in rings] == [[2]]
    assert "0 or beyond the axis" in legend_of(figure)


def test_long_text_is_cut_on_one_line_and_nothing_in_it_is_parsed() -> None:
    cut = style.fitted("$\\alpha_1$ \n\u4e2d " + "long " * 60, style.FONT, 2.0)
    assert cut.startswith(r"\$\alpha_1\$ \n? long")
    assert cut.endswith("...")
    with style.context():
        figure = Figure()
        box = figure.text(0, 0, cut, fontsize=style.FONT).get_window_extent()
    assert 1.9 < box.width / figure.dpi < 2.05


def test_the_suffix_determines_the_form_and_another_is_refused() -> None:
    assert [figures.form_of(path) for path in ("a.png", "b/c.SVG", "d.e.pdf")] == ["png", "svg", "pdf"]
    for path in ("a", "a.jpg", "png", ".png", "a.png/b"):
        with pytest.raises(OptionError, match=r"^plot: .*\.png, \.svg, \.pdf"):
            figures.form_of(path)


def test_a_missing_package_is_reported_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(figures, "find_spec", lambda _: None)
    for call in (lambda: figures.convergence([], "png"), lambda: figures.bench([], [], [], "png"), figures.require):
        with pytest.raises(OptionError) as caught:
            call()
        assert str(caught.value) == "plot: needs matplotlib; pip install 'linear-complementarity[plot]'"


def test_neither_reports_nor_the_data_of_figures_load_a_drawing_package() -> None:
    code = (
        "import sys, lcpcli.report.plotting as f; f.require(); f.form_of('a.png');"
        "print([m for m in ('matplotlib', 'numpy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_users_settings_neither_change_a_figure_nor_are_changed() -> None:
    import matplotlib

    usual = figures.bench(profiles(1), [], [], "png")
    with matplotlib.rc_context({"font.size": 20, "axes.grid": True, "text.usetex": True}):
        assert figures.bench(profiles(1), [], [], "png") == usual
        assert matplotlib.rcParams["font.size"] == 20


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


def test_a_run_without_any_error_stands_far_down() -> None:
    up = data.errors([odd("newton", [0.0])])
    assert up.high <= 1e-15


def test_zero_lies_below_all_other_values_and_infinity_above_them() -> None:
    values = [1.0, 1e-30, 1e-5, 0.0, math.inf, 1e30, math.nan]
    up = data.errors([odd("shi", values)])
    points = data.inside([1.0] * 7, values, Range(0.1, 10), up)
    assert [point.is_beyond for point in points] == [False, True, False, True, True, True, True]
    low, high = {points[1].y, points[3].y}, {point.y for point in points[4:]}
    assert (low, high) == ({up.low}, {up.high})
    assert up.low < 1e-5 < 1 < up.high
