"""A path as a table, JSON and CSV: what happens at its breakpoints, in the names of its
problem."""

import csv
import math
from io import StringIO

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem
from lcpcli.report import document, path_formats
from lcpcli.report.path_formats import Terms

from .path_samples import frontier, portfolio, small, written


def text_of(path, form="table", at=(), width=None):
    return document.typeset(path_formats.build(path, form, at, width), form, width)


def table(path, *at, width=None):
    return [line.split() for line in text_of(path, "table", at, width).splitlines()]


def of_csv(path, *at):
    text = written("csv", path, *at)
    return list(
        csv.DictReader(line for line in StringIO(text) if not line.startswith("#"))
    )


def test_line_says_how_far_the_path_goes_and_whether_it_is_verified():
    line = (
        "<Path for t from 0 to 1: the path reaches the second problem; 4 "
        "breakpoints, verified>"
    )
    assert repr(small()) == line
    assert repr(small(verified=False)) == line.replace("verified", "not verified")


def test_objective_and_multipliers_have_their_sense_and_moving_constants():
    least, most = frontier().to_dict(), frontier(sense="max", constant=1.0).to_dict()
    assert most["answer"]["objective"] == pytest.approx(
        [1 - value for value in least["answer"]["objective"]]
    )
    assert np.allclose(np.array(most["answer"]["y"]), -np.array(least["answer"]["y"]))
    moving = lcpcli.path(portfolio(0.05), portfolio(0.05, constant=1.0)).to_dict()
    assert moving["answer"]["objective"] == pytest.approx([0.0103125, 1.0103125])


@pytest.mark.parametrize(
    ("changes", "remark"),
    [
        ({"c": [0, 1, 0]}, "c bonds: 0 to 1"),
        ({"upper": [0.5, 0.5, 0.75]}, "upper cash: 0.5 to 0.75"),
        ({"lower": [0, 0.25, 0]}, "lower bonds: 0 to 0.25"),
        (
            {"row_lower": [1.25, 0.05], "row_upper": [1.25, math.inf]},
            "budget: 1 to 1.25",
        ),
        ({"c": [0, 1, 1]}, None),
    ],
)
def test_only_number_that_differs_is_named(changes, remark):
    first, last = (
        portfolio(0.05, **own) for own in ({"lower": [0, 0, 0], "upper": [0.5] * 3}, {})
    )
    last = portfolio(0.05, **{"lower": [0, 0, 0], "upper": [0.5] * 3, **changes})
    moving = Terms(lcpcli.path(first, last)).moving
    assert (moving and str(moving)) == remark


def test_costs_of_a_maximum_are_named_as_they_are_stated():
    first, last = (
        lcpcli.from_qp([[-2]], [c], sense="max", columns=["steel"]) for c in (1, 3)
    )
    assert str(Terms(lcpcli.path(first, last)).moving) == "c steel: 1 to 3"


def test_number_of_a_problem_without_origin_is_named_by_its_unknown():
    first, last = (
        Problem([[2, 1], [1, 2]], q, names=["", "steel"]) for q in ([1, 1], [1, -2])
    )
    assert str(Terms(lcpcli.path(first, last)).moving) == "q steel: 1 to -2"


def test_wide_table_shows_the_first_and_the_last_components_in_its_width():
    n = 30
    path = lcpcli.path(*(Problem(np.eye(n) * 2, np.full(n, q)) for q in (1.0, -1.0)))
    text = text_of(path, "table", (), 80)
    assert max(map(len, text.splitlines())) <= 80
    assert "z1, z2" not in text
    assert "z30" in text
    assert "all 30 components" in text
    assert "z1 enters, z2 enters, 28 more" in text_of(path)
    assert len(of_csv(path)[0]) == 3 + 2 * n


@pytest.mark.parametrize("width", [None, 40, 80])
def test_a_path_of_no_points_has_its_reason_alone(width):
    path = lcpcli.path(Problem([[-1]], [-2], name="none"), Problem([[-1]], [2]))
    title, verdict = text_of(path, "table", (), width).splitlines()[:2]
    assert title == "none to problem: n = 1"
    assert path.message.startswith(verdict[:30])
    assert "z1" not in text_of(path, "table", (), width)


def test_a_jump_is_noted_where_it_arrives():
    bounds = {"lower": [0], "upper": [1], "columns": ["x"]}
    falling = lcpcli.path(*(lcpcli.from_qp(None, [c], **bounds) for c in (1, -1)))
    assert list(falling.jumps) == [1]
    notes = path_formats.notes_on(falling, ["x"], math.inf)
    assert [note.startswith("jump") for note in notes] == [False, False, True, False]


def test_a_path_of_one_point_has_it_once():
    first = lcpcli.Problem(np.zeros((1, 1)), [0])
    last = lcpcli.Problem(np.zeros((1, 1)), [-1])
    path = lcpcli.path(first, last)
    assert path.t.size == 1
    assert Terms(path).at_all([0.0]).t == [0.0]
