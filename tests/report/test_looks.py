"""How methods and their runs are told apart in figures: by colour, marker and lightness, in grey too, and in grids."""

from __future__ import annotations

from itertools import pairwise

import pytest

from lcpcli.report.figures import style
from lcpcli.report.figures.style import grid_of

from .figure_samples import convergence, crowd, grid_panel

ALL = [*style.METHODS.values(), *style.PEERS.values(), *style.SPARE]


def lightness(color: str) -> float:
    """L* of a colour (CIE 1976) from its relative luminance."""
    parts = [int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    red, green, blue = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue
    return 116 * luminance ** (1 / 3) - 16 if luminance > 0.008856 else 903.3 * luminance


def test_methods_are_told_apart_by_colour_and_marker_and_in_grey_and_visible_on_white() -> None:
    assert len({look.color for look in ALL}) == len({look.marker for look in ALL}) == len(ALL)
    grey = sorted(lightness(look.color) for look in style.METHODS.values())
    assert min(b - a for a, b in pairwise(grey)) > 6
    assert max(lightness(look.color) for look in ALL) < 75


def test_looks_are_of_methods_and_peers_and_the_others_take_spare_ones() -> None:
    from lcpcli.methods.registry import METHODS as methods
    from lcpcli.peers.registry import PEERS as peers

    assert style.METHODS.keys() <= methods.keys()
    assert style.PEERS.keys() <= peers.keys()
    found = style.looks([(name, name) for name in (*methods, *peers)])
    assert len({look.marker for look in found.values()}) == len(found)


def test_runs_of_one_method_share_its_colour_and_differ_in_their_markers() -> None:
    cold, warm, other = style.looks([("shi", "cold"), ("shi", "warm"), ("shi", "cold"), ("other", "other")]).values()
    assert cold == style.METHODS["shi"]
    assert warm.color == cold.color
    assert warm.fill != cold.fill
    assert other in style.SPARE


@pytest.mark.parametrize("name", [*style.METHODS, "path-start"])
def test_runs_of_a_sweep_go_from_light_to_dark_with_markers_of_their_own(name: str) -> None:
    other = "fixed-point" if name != "fixed-point" else "shi"
    found = style.looks([(other, other), *((name, f"{name}:p={i}") for i in range(8))])
    grey = [lightness(look.color) for (own, _), look in found.items() if own == name]
    assert min(a - b for a, b in pairwise(grey)) > 6
    assert max(grey) < 75.5
    assert len({look.marker for look in found.values()}) == len(found)


def test_a_grid_of_two_options_is_read_from_the_labels_of_its_runs() -> None:
    grid = grid_of(["shi:p=1,k-star=5", "shi:p=1,k-star=9", "shi:p=1e4,k-star=5"])
    assert grid is not None
    assert grid.options == ("p", "k-star")
    assert grid.values == (["1", "1e4"], ["5", "9"])
    assert grid.places == {"shi:p=1,k-star=5": (0, 0), "shi:p=1,k-star=9": (0, 1), "shi:p=1e4,k-star=5": (1, 0)}
    grid = grid_of(["fixed-point:omega=1,scale", "fixed-point:omega=2,scale", "fixed-point:omega=1,scale=false"])
    assert grid is not None
    assert grid.values == (["1", "2"], ["true", "false"])


@pytest.mark.parametrize(
    "labels",
    [
        "shi",
        "shi:p=1 shi:p=2 shi:p=3",
        "shi:p=1,k-star=5 shi:p=2,k-star=9",
        "shi:p=1,k-star=5 shi:p=1,k-star=9 shi:p=1,k-star=7",
        "shi:p=1,k-star=5 shi:p=1,rho=9 shi:p=2,rho=9",
        "shi:p=1,k-star=5 shi:p=1,k-star=9 shi:p=2,k-star=5 shi",
        "shi:a=1,b=5,c=0 shi:a=1,b=5,c=1 shi:a=2,b=5,c=1",
    ],
)
def test_other_runs_make_no_grid(labels: str) -> None:
    assert grid_of([label.replace("_", " ") for label in labels.split()]) is None


def test_one_option_is_told_by_the_colour_and_the_other_by_the_marker() -> None:
    found = style.looks((curve.name, curve.label) for curve in grid_panel().curves)
    looks = [[found["shi", f"shi:p={p},k-star={k}"] for k in ("1", "5", "100")] for p in ("1", "100", "1e4")]
    assert [len({look.color for look in row}) for row in looks] == [1, 1, 1]
    assert len({row[0].color for row in looks}) == 3
    assert [len({row[column].marker for row in looks}) for column in range(3)] == [1, 1, 1]
    assert len({look.marker for look in looks[0]} | {found["fixed-point", "fixed-point"].marker}) == 4


def test_the_legend_has_each_value_once_in_a_block_for_each_option() -> None:
    (legend,) = convergence(grid_panel()).legends
    names = [text.get_text() for text in legend.get_texts() if text.get_text()]
    assert names[:8] == ["shi: p", "1", "100", "1e4", "shi: k-star", "1", "5", "100"]
    assert sorted(names[8:]) == ["0 or beyond the axis", "fixed-point", "not solved"]


def test_a_legend_of_a_grid_and_many_other_runs_fits() -> None:
    panel = crowd(11)
    more = grid_panel(ks=[str(k) for k in range(1, 9)]).curves[1:]
    curves = [curve for curve in panel.curves if curve.name != "shi"]
    figure = convergence(type(panel)(panel.title, panel.measure, [*curves, *more]))
    with style.context():
        assert figure.legends[0].get_window_extent().width <= figure.bbox.width
