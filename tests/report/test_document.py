"""What every renderer owes to a document, whatever it is about."""

from __future__ import annotations

import pytest

from lcpcli.report.document import Document, Section, Table
from lcpcli.report.formats import TABLES, typeset
from lcpcli.report.terminal import _folds


def text_of(form: str, *tables: Table, verdict: str = "") -> str:
    return typeset(Document("t", [Section("t", verdict, True, tables=tables)]), form)


@pytest.mark.parametrize("form", TABLES)
def test_no_control_character_of_any_part_comes_through(form: str) -> None:
    section = Section("t", "solved", True, provenance="lcp solve \x1b[2J\u202e.json")
    text = typeset(Document("t", [section]), form)
    assert "\x1b" not in text
    assert "\u202e" not in text


def test_columns_of_numbers_stay_aligned_beside_a_star() -> None:
    table = Table(("method", "time", "k"), [[["lemke", "1.0", "3"], ["shi", "2.0", "5"]]], best=[(0, 1)], why="fastest")
    best, other = text_of("table", table).splitlines()[3:5]
    assert best.index("1.0") == other.index("2.0")
    assert best.index("3") == other.index("5")


def test_a_table_that_just_fits_is_not_folded() -> None:
    assert _folds([3, 3, 3], 1, 2, 13) == [[0, 1, 2]]  # 3 + 2 + 3 + 2 + 3
    assert _folds([3, 3, 3], 1, 2, 12) == [[0, 1], [0, 2]]


def test_digits_under_the_pointer_cannot_break_out_of_a_page() -> None:
    table = Table(("k",), [[["1"]]], digits=[['"><script>alert(1)</script>']])
    assert "<script>alert" not in text_of("html", table)


def test_tables_that_a_page_folds_come_last() -> None:
    text = text_of("html", Table(("a",), [[["long"]]], name="Iterates"), Table(("a",), [[["short"]]]))
    assert text.index("short") < text.index("long")


def test_a_cell_in_brackets_is_no_argument_of_the_end_of_a_row_in_LaTeX() -> None:
    text = text_of("latex", Table(("name", "k"), [[["one", "1"], ["[2]", "2"]]]))
    assert "\\\\\n[" not in text
    assert "{[}2]" in text


def test_a_long_table_and_its_notes_have_one_caption_and_one_label() -> None:
    table = Table(("k", "z1"), [[[str(k), "0.5"] for k in range(60)]])
    text = text_of("latex", table, verdict="solved")
    assert text.count(r"\label{") == text.count(r"\caption{") == 1


def test_the_best_cells_are_those_of_the_last_group() -> None:
    table = Table(("k", "time"), [[["1", "4"]], [["2", "5"], ["3", "6"]]], best=[(1, 1)])
    text = text_of("markdown", table)
    assert "| 3 | **6** |" in text
    assert "| 1 | 4 |" in text
