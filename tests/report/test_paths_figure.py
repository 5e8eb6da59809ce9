"""The picture of paths: the iterates x of each run, as they are, over |F|, for LCPs with two unknowns alone."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import Problem
from lcpcli.report import paths
from lcpcli.report.figures import paths_figure, style
from lcpcli.report.figures.data import Trajectories
from lcpcli.report.figures.data import Trajectory as Run
from lcpcli.solving.driver import run
from lcpcli.solving.trace import Trace

SKEW = Problem([[1, 3], [-3, 1]], [-4, 3], name="skew", x0=[-2, -1])
TWO = Problem([[2, 1], [1, 2]], [-5, -6], name="two")
METHODS = ("fixed-point", "shi")


def data(problem: Problem, methods: tuple[str, ...] = METHODS, **trace: Any) -> Trajectories:
    (made,) = paths.of_runs([[run(problem, method, curve=Trace(keeps_x=True, **trace)) for method in methods]])
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
        ("solve two.json --paths -", ["--paths", ".svg"]),
        ("solve two.json two.json --paths a.svg", ["--paths", "one problem only", "lcp compare"]),
        ("solve two.json --all --paths a.svg", ["--paths", "no effect with --all"]),
        ("compare two.json paper-example-1 --paths a.svg", ["two unknowns", "n = 4"]),
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
