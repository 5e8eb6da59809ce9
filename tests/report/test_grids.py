"""Runs that differ by two options: two encodings, each in the legend once."""

from __future__ import annotations

import pytest

from lcpcli.report.figures import run_figures, style
from lcpcli.report.figures.grids import grid_of

from .figure_samples import crowd, grid_panel


def test_a_grid_is_read_from_the_labels_of_its_runs() -> None:
    grid = grid_of(["shi:p=1,k-star=5", "shi:p=1,k-star=9", "shi:p=1e4,k-star=5"])
    assert grid is not None
    assert grid.options == ("p", "k-star")
    assert grid.values == (["1", "1e4"], ["5", "9"])
    assert grid.places == {"shi:p=1,k-star=5": (0, 0), "shi:p=1,k-star=9": (0, 1), "shi:p=1e4,k-star=5": (1, 0)}
    with_addition = grid_of(
        ["fixed-point:omega=1,scale", "fixed-point:omega=2,scale", "fixed-point:omega=1,scale=false"]
    )
    assert with_addition is not None
    assert with_addition.values == (["1", "2"], ["true", "false"])


@pytest.mark.parametrize(
    "labels",
    [
        ["shi"],
        ["shi:p=1", "shi:p=2", "shi:p=3"],
        ["shi:p=1,k-star=5", "shi:p=2,k-star=9"],
        ["shi:p=1,k-star=5", "shi:p=1,k-star=9", "shi:p=1,k-star=7"],
        ["shi:p=1,k-star=5", "shi:p=1,rho=9", "shi:p=2,rho=9"],
        ["shi:p=1,k-star=5", "shi:p=1,k-star=9", "shi:p=2,k-star=5", "shi"],
        ["shi:p=1,k-star=5", "shi:p=1,k-star=9", "shi:p=2,k-star=5", "shi:p=2,k-star=5, warm"],
        ["shi:a=1,b=5,c=0", "shi:a=1,b=5,c=1", "shi:a=2,b=5,c=1"],
    ],
)
def test_other_runs_make_no_grid(labels: list[str]) -> None:
    assert grid_of(labels) is None


def test_one_option_is_told_by_the_colour_and_the_other_by_the_marker() -> None:
    curves = grid_panel().curves
    found = style.looks((curve.name, curve.label) for curve in curves)
    looks = [[found["shi", f"shi:p={p},k-star={k}"] for k in ("1", "5", "100")] for p in ("1", "100", "1e4")]
    assert [len({look.color for look in row}) for row in looks] == [1, 1, 1]
    assert len({row[0].color for row in looks}) == 3
    assert [len({row[column].marker for row in looks}) for column in range(3)] == [1, 1, 1]
    assert len({look.marker for look in looks[0]} | {found["fixed-point", "fixed-point"].marker}) == 4


def test_the_legend_has_each_value_once_in_a_block_for_each_option() -> None:
    with style.context():
        figure = run_figures.draw_convergence([grid_panel()])
    (legend,) = figure.legends
    names = [text.get_text() for text in legend.get_texts() if text.get_text()]
    assert names[:8] == ["shi: p", "1", "100", "1e4", "shi: k-star", "1", "5", "100"]
    assert sorted(names[8:]) == ["0 or beyond the axis", "fixed-point", "not solved"]


def test_a_legend_of_a_grid_and_many_other_runs_fits() -> None:
    with style.context():
        panel = crowd(11)
        more = grid_panel(ks=[str(k) for k in range(1, 9)]).curves[1:]
        curves = [curve for curve in panel.curves if curve.name != "shi"]
        figure = run_figures.draw_convergence([type(panel)(panel.title, panel.measure, [*curves, *more])])
        assert figure.legends[0].get_window_extent().width <= figure.bbox.width
