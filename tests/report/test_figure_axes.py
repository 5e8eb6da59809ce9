"""Figures of runs: one kind of axis in a figure, and no entry of a legend without a curve."""

from __future__ import annotations

import math

import pytest

from lcpcli.report.figures import run_figures, style
from lcpcli.report.figures.data import Curve, Panel, Profile

from .figure_samples import decaying, growth, odd, profiles

SHORT = Panel("short", "error", [decaying("shi", 0.5, 12), decaying("fixed-point", 0.4, 20)])
LONG = Panel("long", "error", [decaying("shi", 0.5, 6), decaying("fixed-point", 0.99, 2000)])
BARE = odd("lemke", [None, None])
BARE_PANEL = Panel("bare", "error", [*SHORT.curves, BARE])


@pytest.mark.parametrize(("panels", "kind"), [([SHORT], "linear"), ([SHORT, LONG], "symlog"), ([LONG], "symlog")])
def test_all_axes_of_one_quantity_are_of_one_kind(panels: list[Panel], kind: str) -> None:
    with style.context():
        figure = run_figures.draw_convergence(panels)
    times, iterations = figure.axes[::2], figure.axes[1::2]
    assert {axes.get_xscale() for axes in iterations} == {kind}
    assert {axes.get_xscale() for axes in times} == {"log"}


def test_a_run_that_was_not_measured_is_in_no_legend() -> None:
    with style.context():
        pictures = [run_figures.draw_convergence([BARE_PANEL, SHORT])]
        pictures.append(run_figures.draw_bench([], [BARE_PANEL], []))
    for figure in pictures:
        assert [text.get_text() for text in figure.legends[0].get_texts()][:2] == ["shi", "fixed-point"]
        assert "lemke" not in [text.get_text() for text in figure.legends[0].get_texts()]


def test_a_legend_without_entries_is_left_out() -> None:
    with style.context():
        figure = run_figures.draw_convergence([Panel("p", "error", [BARE])])
    assert not figure.legends


def test_a_run_without_a_finite_error_is_drawn_at_the_edge_and_named() -> None:
    curve = Curve("shi", "shi", [0, 1], [0.0, 1.0], [math.nan, math.inf], False)
    with style.context():
        figure = run_figures.draw_convergence([Panel("p", "error", [curve])])
    assert figure.axes[1].lines
    assert figure.legends[0].get_texts()[0].get_text() == "shi"


def test_profiles_and_growths_are_named_where_they_are_drawn() -> None:
    with style.context():
        profile = run_figures.draw_bench(profiles(3), [], [])
        scaling = run_figures.draw_bench([], [], [growth(2)])
    assert len(profile.legends[0].get_texts()) == 3
    assert len(scaling.legends[0].get_texts()) == 2


def test_what_is_solved_over_time_is_drawn_in_seconds() -> None:
    with style.context():
        figure = run_figures.draw_bench([Profile("shi", "shi", [0.25, 0.5, 0.5, math.inf], in_seconds=True)], [], [])
    axes = figure.axes[0]
    assert list(zip(*axes.lines[0].get_data(), strict=True))[1:3] == [(0.25, 0.25), (0.5, 0.75)]
    assert (axes.get_xlabel(), axes.get_title("left")) == ("run time (s)", "Solved over time, 4 problems")
