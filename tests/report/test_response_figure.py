"""The picture of a path: each component through its breakpoints, jumps and turns, and the objective or the frontier."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import lcpcli
from lcpcli import Problem
from lcpcli.errors import OptionError
from lcpcli.parametric.path import Path as Solutions
from lcpcli.report import plotting
from lcpcli.report.figures import response_figure, style
from lcpcli.report.path_figure import response

from .path_samples import cornered, frontier, portfolio, small
from .test_figures import boxes, overlaps


def many(n: int) -> Solutions:
    """As many components, each of which enters at a t of its own."""
    return lcpcli.path(Problem(np.eye(n), np.ones(n)), Problem(np.eye(n), -np.arange(1.0, n + 1)))


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
    figure = drawn(many(40))
    (axes,) = figure.axes
    assert figure.legends == []
    assert axes.get_ylabel() == "z, 40 components"
    assert {line.get_linewidth() for line in axes.lines} == {response_figure.THIN["linewidth"], 0.5}


SAMPLES: dict[str, Callable[[], Solutions]] = {
    "small": small,
    "cornered": cornered,
    "frontier": frontier,
    "12 lines": lambda: many(12),
    "many": lambda: many(80),
    "point": lambda: lcpcli.path(Problem([[-1]], [0]), Problem([[-1]], [-1])),
    "nothing": lambda: lcpcli.path(Problem([[-1]], [-2]), Problem([[-1]], [2])),
    "strange names": lambda: lcpcli.path(
        *(Problem(np.eye(2), q, names=["$x_{", "long " * 60], name="$a$ " * 50) for q in ([1, 1], [1, -1]))
    ),
}


@pytest.mark.parametrize("name", SAMPLES)
def test_no_text_lies_on_another_or_leaves_the_figure(name: str) -> None:
    with style.context():
        figure = response_figure.draw(response(SAMPLES[name]()))
        placed, page = boxes(figure), figure.bbox
        for text, box in placed:
            assert min(box.x0, box.y0, page.x1 - box.x1, page.y1 - box.y1) >= 0, text
        for (text, box), (other_text, other) in combinations(placed, 2):
            assert not overlaps(box, other), (text, other_text)


@pytest.mark.parametrize("form", plotting.FORMS)
def test_file_is_whole_and_always_the_same(form: str, tmp_path: Path) -> None:
    picture = frontier().plot(tmp_path / f"path.{form}")
    assert repr(picture) == "<Picture: path of 5 breakpoints>"
    written = (tmp_path / f"path.{form}").read_bytes()
    assert [file.name for file in tmp_path.iterdir()] == [f"path.{form}"]
    picture.save(tmp_path / f"again.{form}")
    assert (tmp_path / f"again.{form}").read_bytes() == written
    assert "<svg" in picture._repr_svg_()


def test_other_suffix_is_refused() -> None:
    with pytest.raises(OptionError, match=r"'path\.txt' has no known suffix"):
        small().plot("path.txt")
