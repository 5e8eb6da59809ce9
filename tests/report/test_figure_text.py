"""Figures in text: they fit, hold every curve, and have colours only if asked for."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lcpcli.report import plotting as figures
from lcpcli.report.figures import terminal_figure

from .figure_samples import crowd, paper_panel


@pytest.mark.parametrize(("width", "height"), [(30, 10), (80, 24), (120, 40)])
def test_a_figure_in_text_fits_and_has_no_escape_codes(width: int, height: int) -> None:
    text = figures.terminal([crowd(11), paper_panel()], width, height, False)
    assert "\x1b" not in text
    assert max(map(len, text.splitlines())) <= width
    for word in ("11 solvers", "paper-example-1", "error ||z - z*||_inf", "1e-5"):
        assert word in text


def test_a_figure_in_text_is_as_high_as_asked() -> None:
    assert len(figures.terminal([paper_panel()], 80, 24, False).splitlines()) == 24


def test_color_marks_curves_and_changes_no_character() -> None:
    colored, plain = (figures.terminal([crowd(6)], 80, 24, color) for color in (True, False))
    assert colored != plain
    assert re.sub(r"\x1b\[[0-9;]*m", "", colored) == plain


def test_every_curve_in_text_has_a_character_of_its_own_that_is_seen() -> None:
    text = figures.terminal([paper_panel()], 80, 24, False)
    drawing = text[text.index("┌") : text.index("└")]
    assert drawing.count("s") > 10
    assert drawing.count("f") > 10
    assert "s shi" in text
    assert "f fixed-point" in text


@given(st.lists(st.text(max_size=6), max_size=40))
def test_letters_are_distinct_and_none_stands_for_failure(labels: list[str]) -> None:
    found = terminal_figure.letters(labels)
    assert len(set(found)) == len(labels)
    assert not set(found) & {"x", "X"}
