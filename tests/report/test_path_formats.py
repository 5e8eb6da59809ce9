"""A path as a table, JSON and CSV: what happens at its breakpoints, in the names of its problem."""

from __future__ import annotations

import csv
import json
import math
from fractions import Fraction
from io import StringIO
from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem
from lcpcli.parametric.path import Path
from lcpcli.report import document, path_formats
from lcpcli.report.path_terms import Terms

from .path_samples import SMALL, cornered, frontier, portfolio, small, small_in_fractions, written


def text_of(path: Path, form: str = "table", at: Any = (), width: int | None = None) -> str:
    return document.typeset(path_formats.build(path, form, at, width), form, width)


def table(path: Path, *at: Any, width: int | None = None) -> list[list[str]]:
    """The lines of the table as words."""
    return [line.split() for line in text_of(path, "table", at, width).splitlines()]


def of_csv(path: Path, *at: Any) -> list[dict[str, str]]:
    text = written("csv", path, *at)
    return list(csv.DictReader(line for line in StringIO(text) if not line.startswith("#")))


def test_line_says_how_far_the_path_goes_and_whether_it_is_verified() -> None:
    line = "<Path: 4 breakpoints, t from 0 to 1: the path reaches the second problem, verified>"
    assert repr(small()) == line
    assert repr(small(verified=False)) == line.replace("verified", "not verified")
    assert repr(small_in_fractions()) == line.replace("verified", "verified in fractions")


def test_table_has_a_row_for_each_breakpoint_with_what_enters_there() -> None:
    lines = table(small())
    assert lines[1] == ["the", "path", "reaches", "the", "second", "problem;", "4", "breakpoints,", "verified"]
    start = lines.index(["t", "change", "z1", "z2", "w1", "w2"])
    assert lines[start + 2 : start + 6] == [
        ["0", "0", "0", "1", "1"],
        ["0.1428571", "z2", "enters", "0", "0", "0.1428571", "0"],
        ["0.2", "z1", "enters", "0", "0.2", "0", "0"],
        ["1", "reached", "1.333333", "2.333333", "0", "0"],
    ]


def test_fractions_are_shown_where_the_path_has_them() -> None:
    lines = table(small_in_fractions(), Fraction(3, 5))
    assert ["1/7", "z2", "enters", "0", "0", "1/7", "0"] in lines
    assert ["3/5", "(--at)", "2/3", "19/15", "0", "0"] in lines
    assert [row["t"] for row in of_csv(small_in_fractions())] == ["0", "1/7", "1/5", "1"]
    assert path_formats.data(small_in_fractions())["exact"]["z"][3] == ["4/3", "7/3"]


def test_json_is_what_the_path_has() -> None:
    path = small()
    record = json.loads(json.dumps(path.to_dict(), allow_nan=False))
    assert list(record) == [*path_formats.KEYS.split()]
    for key in ("t", "z", "w"):
        assert np.array_equal(record[key], getattr(path, key))
    assert record["basis"] == path.basis
    entering = [[{"index": i, "before": "lower", "after": "basic"}] for i in (1, 0)]
    assert record["changes"] == [[], *entering, []]
    assert (record["end"], record["reached"], record["verified"], record["answer"]) == ("reached", True, True, None)
    assert record["at"] == {"t": [], "z": [], "w": [], "answer": None}


def test_csv_has_every_digit() -> None:
    path, rows = small(), of_csv(small(), 0.6)
    assert list(rows[0]) == ["breakpoint", "t", "change", "z1", "z2", "w1", "w2"]
    assert [float(row["t"]) for row in rows] == [*path.t.tolist(), 0.6]
    assert [[float(row["z1"]), float(row["z2"])] for row in rows[:-1]] == path.z.tolist()
    assert [row["breakpoint"] for row in rows] == ["1", "2", "3", "4", ""]


def test_jump_and_turn_are_told_and_points_at_a_t_are_all_listed() -> None:
    path = cornered()
    notes = [row["change"] for row in of_csv(path)]
    assert notes == ["", "z1 enters", "jump, z1 to lower, turn", "turn"]
    assert [row["z1"] for row in of_csv(path, 1.0, 0.5)[4:]] == ["3.0", "0.0", "3.0", "0.0"]
    text = text_of(path)
    assert "at a jump all points between the two rows solve the problem" in text
    assert "--turns" in text
    assert "--turns" not in text_of(path, "latex")


def test_t_that_the_path_does_not_reach_is_told() -> None:
    assert "does not come to t = 0.9" in text_of(frontier(), "table", [0.5, 0.9], None)
    assert path_formats.data(frontier(), Terms(frontier()).at_all([0.9]))["at"]["t"] == []


def test_program_is_reported_in_its_own_names_with_the_side_that_moves() -> None:
    lines = table(frontier(), 0.5)
    assert ["return:", "at", "least", "0.05", "to", "0.12"] in lines
    heads = ["t", "return", "change", "shares", "bonds", "cash", "y", "budget", "y", "return", "objective"]
    assert heads in lines
    row = next(line for line in lines if line[3:5] == ["to", "upper"])
    assert row[:7] == ["0.6530612", "0.09571429", "shares", "to", "upper", "0.5", "0.3928571"]
    assert any(line[:2] == ["0.5", "0.085"] for line in lines)
    by_return = table(lcpcli.path(portfolio(0.05), portfolio(0.12), start=0.05, stop=0.12))
    assert any(line[:3] == ["return", "change", "shares"] for line in by_return), "without t"
    proof = [" ".join(line) for line in lines if line[:1] == ["proof"]]
    assert proof == ["proof that the second problem has no solution: y = (y budget -1, y return 9)"]


def test_objective_at_breakpoints_is_that_of_the_programs_there() -> None:
    path = frontier()
    answer = path.to_dict()["answer"]
    for t, x, value in zip(path.t, answer["x"], answer["objective"], strict=True):
        minimum = lcpcli.run(portfolio(0.05 + 0.07 * t)).answer
        assert minimum is not None
        assert np.allclose(minimum.x, x, atol=1e-9)
        assert minimum.objective == pytest.approx(value)


def test_objective_and_multipliers_are_in_their_own_sense_with_constants_that_may_move_too() -> None:
    least, most = frontier().to_dict(), frontier(sense="max", constant=1.0).to_dict()
    assert most["answer"]["objective"] == pytest.approx([1 - value for value in least["answer"]["objective"]])
    assert np.allclose(np.array(most["answer"]["y"]), -np.array(least["answer"]["y"]))
    moving = lcpcli.path(portfolio(0.05), portfolio(0.05, constant=1.0)).to_dict()
    assert moving["answer"]["objective"] == pytest.approx([0.0103125, 1.0103125])


@pytest.mark.parametrize(
    ("changes", "remark"),
    [
        ({"c": [0, 1, 0]}, "bonds: objective coefficient 0 to 1"),
        ({"upper": [0.5, 0.5, 0.75]}, "cash: at most 0.5 to 0.75"),
        ({"lower": [0, 0.25, 0]}, "bonds: at least 0 to 0.25"),
        ({"row_lower": [1.25, 0.05], "row_upper": [1.25, math.inf]}, "budget: equal to 1 to 1.25"),
        ({"c": [0, 1, 1]}, None),
    ],
)
def test_only_number_that_differs_is_named(changes: dict[str, Any], remark: str | None) -> None:
    first, last = (portfolio(0.05, **own) for own in ({"lower": [0, 0, 0], "upper": [0.5] * 3}, {}))
    last = portfolio(0.05, **{"lower": [0, 0, 0], "upper": [0.5] * 3, **changes})
    moving = Terms(lcpcli.path(first, last)).moving
    assert (moving and str(moving)) == remark


def test_number_of_a_problem_without_origin_is_named_by_its_unknown() -> None:
    first, last = (Problem([[2, 1], [1, 2]], q, names=["", "steel"]) for q in ([1, 1], [1, -2]))
    assert str(Terms(lcpcli.path(first, last)).moving) == "q steel: 1 to -2"
    first, last = (Problem([[2, 1], [1, 2]], q) for q in ([1, 1], [-4, 1]))
    assert str(Terms(lcpcli.path(first, last)).moving) == "q1: 1 to -4"


def test_wide_table_shows_the_first_and_the_last_components_in_its_width() -> None:
    n = 30
    path = lcpcli.path(*(Problem(np.eye(n) * 2, np.full(n, q)) for q in (1.0, -1.0)))
    text = text_of(path, "table", (), 80)
    assert max(map(len, text.splitlines())) <= 80
    assert "z1, z2" not in text
    assert "z30" in text
    assert "all 30 components" in text
    assert "z1 enters, z2 enters, 28 more" in text_of(path)
    assert len(of_csv(path)[0]) == 3 + 2 * n


def test_range_of_a_row_has_the_name_of_the_row() -> None:
    first, last = (portfolio(0.07, row_upper=[1, most]) for most in (0.09, 0.08))
    terms = Terms(lcpcli.path(first, last))
    assert terms.names() == ["shares", "bonds", "cash", "y budget", "y return", "s return"]
    assert str(terms.moving) == "return: at most 0.09 to 0.08"


def test_path_that_cannot_begin_says_why() -> None:
    path = lcpcli.path(*(Problem([[-1]], [q]) for q in (-2, 2)))
    text = text_of(path)
    assert "the first problem has no solution" in text
    assert "proof that the first problem has no solution: y = (1)" in text
    assert "verified" not in text
    assert of_csv(path) == []
    assert path.to_dict()["t"] == []


def test_tables_for_documents_have_all_rows() -> None:
    for form in ("markdown", "latex", "html"):
        text = text_of(frontier(), form, [0.5], None)
        assert (text.count("0.09571429"), text.count("y return enters")) == (1, 1), form
    text = text_of(frontier(), "latex", [0.5], None)
    assert text.count(r"\begin{tabular}") == text.count(r"\end{tabular}") == 1
    assert [line.count("&") for line in text.splitlines() if line.endswith(r"\\")] == [8] * (1 + 5 + 1)


def test_problems_are_named_once_if_they_have_one_name() -> None:
    assert table(small())[0] == ["small:", "n", "=", "2"]
    path = lcpcli.path(SMALL[0], SMALL[1].named("large"))
    assert table(path)[0] == ["small", "to", "large:", "n", "=", "2"]


AT = (0.1, 0.15, 0.25, 0.35, 0.45, 0.55, 0.7)  # some on the pieces that two parts share


def jumping() -> tuple[Problem, Problem]:
    """Two problems between which z_i >= 0 is left at t = k_i, and the solution of a linear program jumps at 1/2."""
    k = np.arange(16) / 20 + 0.02
    M = np.eye(18)
    M[16:, 16:] = [[0, 1], [-1, 0]]
    return Problem(M, [*k, 1, 1]), Problem(M, [*k - 1, -1, 1])
