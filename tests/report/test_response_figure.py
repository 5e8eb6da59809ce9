"""The picture of a path: each component through its breakpoints, jumps and turns, and the objective or the frontier."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

import lcpcli
from lcpcli import Problem
from lcpcli.errors import OptionError
from lcpcli.parametric.path import Path as Solutions
from lcpcli.report.figures import response_figure, style
from lcpcli.report.path_figure import response

from .path_samples import cornered, entering, frontier, portfolio, small


def drawn(path: Solutions) -> Figure:
    with style.context():
        return response_figure.draw(response(path))


def test_lines_go_through_all_breakpoints_and_have_their_names() -> None:
    path = small()
    picture, figure = response(path), drawn(path)
    assert (picture.names, picture.abscissa) == (["z1", "z2"], "t")
    assert np.array_equal(np.array(picture.lines).T, path.z)
    (axes,), (legend,) = figure.axes, figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["z1", "z2"]
    markers = [line for line in axes.lines if line.get_linestyle() == "None" and len(line.get_xdata()) == path.t.size]
    assert [line.get_ydata().tolist() for line in markers] == path.z.T.tolist()


def test_components_that_are_always_zero_are_left_out() -> None:
    path = lcpcli.path(Problem(np.eye(3), [1, 1, -1]), Problem(np.eye(3), [1, -1, -1]))
    assert response(path).names == ["z2", "z3"]


def test_jump_is_dashed_and_a_ring_marks_a_turn() -> None:
    figure = drawn(cornered())
    (axes,), (legend,) = figure.axes, figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["z1", "jump", "turn"]
    dashed = [line for line in axes.lines if line.get_linestyle() == "--"]
    assert [(line.get_xdata().tolist(), line.get_ydata().tolist()) for line in dashed] == [([0, 0], [3, 0])]
    rings = [line for line in axes.lines if line.get_markersize() == response_figure.TURN["markersize"]]
    assert [line.get_xydata().tolist() for line in rings] == [[[0, 0]]]


def test_frontier_is_the_side_that_moves_over_the_objective() -> None:
    path = frontier()
    left, right = drawn(path).axes
    assert (left.get_xlabel(), left.get_ylabel()) == ("return (at least)", "x")
    assert (right.get_xlabel(), right.get_ylabel()) == ("objective", "return (at least)")
    curve, marks = right.lines
    objective = path.to_dict()["answer"]["objective"]
    assert marks.get_xdata() == pytest.approx(objective)
    assert marks.get_ydata() == pytest.approx(0.05 + 0.07 * path.t)
    assert (curve.get_xdata()[0], curve.get_xdata()[-1]) == pytest.approx((objective[0], objective[-1]))
    assert len(curve.get_xdata()) > 50


def test_objective_is_drawn_over_what_moves_elsewhere() -> None:
    path = lcpcli.path(portfolio(0.05, c=[0, 0, 0]), portfolio(0.05, c=[0, 0.01, 0.02]))
    _, right = drawn(path).axes
    assert (right.get_xlabel(), right.get_ylabel()) == ("$t$", "objective")


def test_many_lines_are_thin_and_have_no_legend() -> None:
    figure = drawn(entering(40))
    (axes,) = figure.axes
    assert figure.legends == []
    assert axes.get_ylabel() == "z, 40 components"
    assert {line.get_linewidth() for line in axes.lines} == {response_figure.THIN["linewidth"], 0.5}


def test_other_suffix_is_refused() -> None:
    with pytest.raises(OptionError, match=r"'path\.txt' has no known suffix"):
        small().plot("path.txt")
