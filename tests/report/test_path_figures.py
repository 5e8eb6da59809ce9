"""The pictures of paths: the iterates x of each run over |F|, and the solutions of a path through its breakpoints."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import lcpcli
from lcpcli import Problem
from lcpcli.errors import OptionError
from lcpcli.parametric.path import Path as Solutions
from lcpcli.report import pictures
from lcpcli.report.figures import paths_figure, run_figures, style
from lcpcli.report.figures.data import Trajectories
from lcpcli.report.figures.data import Trajectory as Run
from lcpcli.report.pictures import response
from lcpcli.solving.driver import run
from lcpcli.solving.trace import Trace

from .path_samples import cornered, entering, frontier, portfolio, small

SKEW = Problem([[1, 3], [-3, 1]], [-4, 3], name="skew", x0=[-2, -1])
TWO = Problem([[2, 1], [1, 2]], [-5, -6], name="two")
METHODS = ("fixed-point", "shi")


def data(problem: Problem, methods: tuple[str, ...] = METHODS, **trace: Any) -> Trajectories:
    (made,) = pictures.trajectories([[run(problem, method, curve=Trace(keeps_x=True, **trace)) for method in methods]])
    return made


def test_paths_are_the_iterates_of_the_methods_where_z_is_zero_too() -> None:
    made = data(SKEW)
    M, q = np.array(made.M), np.array(made.q)
    fixed_point, shi = made.paths
    assert (fixed_point.k[0], fixed_point.x[0], shi.x[0]) == (0, (-2.0, -1.0), (-2.0, -1.0))
    for before, after in zip(fixed_point.x[:20], fixed_point.x[1:21], strict=True):
        image = np.linalg.solve(np.eye(2) + M, (np.eye(2) - M) @ np.abs(before) - q)
        assert after == pytest.approx(image, rel=1e-12)
    falling = [float(paths_figure.merit(M, q, np.array(x))) for x in shi.x]
    assert all(after <= before * (1 + 1e-12) for before, after in pairwise(falling))
    assert min(x[1] for x in shi.x) < 0


def test_rows_and_iterates_stay_together_where_few_are_kept() -> None:
    whole, few = data(SKEW), data(SKEW, most=10, components=np.empty(0, dtype=np.intp))
    for path, thinned in zip(whole.paths, few.paths, strict=True):
        assert len(thinned.k) <= 10
        assert [path.x[path.k.index(k)] for k in thinned.k] == list(thinned.x)


def test_solutions_are_the_zeros_of_the_merit_function() -> None:
    made = data(TWO)
    assert len(made.solutions) == 2
    for solution in made.solutions:
        assert solution == pytest.approx((2 / 3, 7 / 6))
        assert paths_figure.merit(made.M, made.q, np.array(solution)) < 1e-8
    murty = Problem([[1, 2], [2, 1]], [-1, -1], solutions=[[1, 0], [0, 1]])
    assert data(murty, ("shi",)).solutions[:2] == [(0.5, -0.5), (-0.5, 0.5)]


def test_the_merit_function_is_that_of_the_equation_of_the_methods() -> None:
    M, q, x = np.array([[1.0, 3], [-3, 1]]), np.array([-4.0, 3]), np.array([[-2.0, 0.5], [3, -1]])
    z, w = np.abs(x) + x, np.abs(x) - x
    F = M @ z - w + q[:, None]
    assert paths_figure.merit(M, q, x) == pytest.approx(np.sqrt((F**2).sum(axis=0)))


def test_the_range_holds_the_origin_the_start_and_the_solution_but_not_a_divergence() -> None:
    divergent = Run("shi", "shi", [0, 1, 2, 3], [(1.0, 1.0), (2.0, 2.0), (1e9, -1e9), (np.inf, np.nan)])
    made = Trajectories("p", [[1, 0], [0, 1]], [-1, -1], [(0.5, 4.0)], [divergent])
    for (low, high), largest in zip(paths_figure.ranges(made), (0.5, 4.0), strict=True):
        assert low < 0 < largest < high < 20
    with style.context():
        paths_figure.draw([made])


def test_quadrants_have_the_names_of_their_cones_and_the_legend_those_of_the_runs() -> None:
    with style.context():
        figure = paths_figure.draw([data(TWO)])
    corners = {text.get_text(): text.get_position() for text in figure.axes[-1].texts[:4]}
    (left, bottom), (right, top) = corners["$w_1$, $w_2$"], corners["$z_1$, $z_2$"]
    assert left < right
    assert bottom < top
    assert corners["$z_1$, $w_2$"] == (right, bottom)
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend == ["fixed-point", "shi", "start", "solution"]
    numbers = {text.get_text() for text in figure.axes[-1].texts[4:]}
    assert {"1", "2"} <= numbers


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("two.json").write_text('{"M": [[2, 1], [1, 2]], "q": [-5, -6]}')
    Path("bound.json").write_text('{"M": [[2, 1], [1, 2]], "q": [-5, -6], "upper": [1, null]}')
    return tmp_path


@pytest.mark.slow("several pictures")
def test_both_commands_write_the_picture(lcp: Callable[..., Any], folder: Path) -> None:
    assert lcp("solve", "two.json", "--paths", "one.png", "--quiet").code == 0
    outcome = lcp("compare", "two.json", "--paths", "both.pdf", "--plot", "errors.svg")
    assert (outcome.code, outcome.err) == (0, "")
    for name, magic in (("one.png", b"\x89PNG"), ("both.pdf", b"%PDF-1."), ("errors.svg", b"<?xml")):
        assert (folder / name).read_bytes().startswith(magic)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("solve paper-example-1 --paths a.svg", ["two unknowns", "n = 4"]),
        ("solve bound.json --paths a.svg", ["two unknowns", "n = 2"]),
        ("solve two.json --paths a.txt", ["--paths", "a.txt", ".svg"]),
        ("solve two.json two.json --paths a.svg", ["--paths", "one problem only", "lcp compare"]),
        ("solve two.json --all --paths a.svg", ["--paths", "no effect with --all"]),
        ("compare" + 7 * " two.json" + " --paths a.svg", ["7 problems", "room for 6"]),
        ("solve two.json --paths a.svg --plot a.svg", ["--paths", "same file as --plot"]),
    ],
)
def test_what_has_no_paths_is_refused_in_a_line(
    arguments: str, words: list[str], lcp: Callable[..., Any], folder: Path
) -> None:
    outcome = lcp(*arguments.split())
    assert (outcome.code, outcome.out, outcome.err.count("\n")) == (2, "", 1), outcome.err
    assert all(word in outcome.err for word in words), outcome.err
    assert not (folder / "a.svg").exists()


def test_a_run_without_iterates_is_named_as_such() -> None:
    runs = [Run("newton", "newton", [0, 1], [(0, 0), (0.5, 0.5)]), Run("milp", "milp", [0], [(0, 0)])]
    figure = paths_figure.draw([Trajectories("p", [[2, 1], [1, 2]], [-5, -6], [(0.5, 0.5)], runs)])
    (legend,) = figure.legends
    texts = [text.get_text() for text in legend.get_texts()]
    assert "newton" in texts
    assert "milp: no iterates" in texts
    assert "milp" not in texts


def drawn(path: Solutions) -> Figure:
    with style.context():
        return run_figures.draw(response(path))


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
    rings = [line for line in axes.lines if line.get_markersize() == run_figures.TURN["markersize"]]
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
    assert {line.get_linewidth() for line in axes.lines} == {run_figures.THIN["linewidth"], 0.5}


def test_other_suffix_is_refused() -> None:
    with pytest.raises(OptionError, match=r"'path\.txt' has no known suffix"):
        small().plot("path.txt")
