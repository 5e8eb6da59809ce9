"""How methods and their runs are told apart in figures: by colour, marker and lightness, in grey too."""

from __future__ import annotations

from itertools import pairwise

import pytest

from lcpcli.report.figures import style


def all_looks() -> dict[str, style.Look]:
    return style.METHODS | style.PEERS | {f"spare {i}": look for i, look in enumerate(style.SPARE)}


@pytest.mark.parametrize("part", ["color", "marker"])
def test_no_two_solvers_share_colour_or_marker(part: str) -> None:
    found = [getattr(look, part) for look in all_looks().values()]
    assert len(set(found)) == len(found)


def lightness(color: str) -> float:
    """L* of a colour (CIE 1976) from its relative luminance."""
    parts = [int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    red, green, blue = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue
    return 116 * luminance ** (1 / 3) - 16 if luminance > 0.008856 else 903.3 * luminance


def test_methods_are_told_apart_in_grey_and_visible_on_white() -> None:
    grey = sorted(lightness(look.color) for look in style.METHODS.values())
    assert min(b - a for a, b in pairwise(grey)) > 6
    assert max(lightness(look.color) for look in all_looks().values()) < 75


def test_looks_are_of_methods_and_peers_and_the_others_take_spare_ones() -> None:
    from lcpcli.methods.registry import METHODS as methods
    from lcpcli.peers.registry import PEERS as peers

    assert style.METHODS.keys() <= methods.keys()
    assert style.PEERS.keys() <= peers.keys()
    found = style.looks([(name, name) for name in (*methods, *peers)])
    assert len({look.marker for look in found.values()}) == len(found)


def test_runs_of_one_method_share_its_colour_and_differ_in_their_markers() -> None:
    found = list(style.looks([("shi", "cold"), ("shi", "warm"), ("shi", "cold"), ("other", "other")]).values())
    assert len(found) == 3
    assert found[0] == style.METHODS["shi"]
    assert found[1].color == found[0].color
    assert found[1].fill != found[0].fill
    assert found[2] in style.SPARE


@pytest.mark.parametrize("name", [*style.METHODS, "siconos-lemke"])
def test_runs_of_a_sweep_go_from_light_to_dark_with_markers_of_their_own(name: str) -> None:
    other = "fixed-point" if name != "fixed-point" else "shi"
    found = style.looks([(other, other), *((name, f"{name}:p={i}") for i in range(8))])
    runs = [look for (own, _), look in found.items() if own == name]
    grey = [lightness(look.color) for look in runs]
    assert min(a - b for a, b in pairwise(grey)) > 6
    assert max(grey) < 75.5
    markers = [look.marker for look in found.values()]
    assert len(set(markers)) == len(markers)
