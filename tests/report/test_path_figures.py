"""The pictures of paths of iterates over |F|, and of the complementary cones of two
unknowns."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from scipy.optimize import nnls

import lcpcli
from lcpcli import Problem
from lcpcli.enumeration.search import SolutionSet
from lcpcli.report import plotting
from lcpcli.report.figures import plane_figures, style
from lcpcli.report.figures.plane_figures import SECTOR, SETS
from lcpcli.report.plotting import Curve, Panel
from lcpcli.solving.driver import run
from lcpcli.solving.trace import Trace

from ..cli.conftest import Lcp

SKEW = Problem([[1, 3], [-3, 1]], [-4, 3], name="skew", x0=[-2, -1])
TWO = Problem([[2, 1], [1, 2]], [-5, -6], name="two")
METHODS = ("fixed-point", "shi")


def data(problem: Problem, methods: tuple[str, ...] = METHODS, **trace: Any) -> Panel:
    (made,) = plotting.panels(
        [
            [
                run(problem, method, curve=Trace(keeps_x=True, **trace))
                for method in methods
            ]
        ]
    )
    return made


def plane(
    problem: Problem, solutions: list[tuple[float, float]], *curves: Curve
) -> Panel:
    return Panel("", "", curves, "", problem, solutions)


def test_paths_are_the_iterates_of_the_methods_where_z_is_zero_too() -> None:
    made = data(SKEW)
    M, q = made.problem.M, made.problem.q
    fixed_point, shi = made.curves
    assert (fixed_point.k[0], fixed_point.x[0], shi.x[0]) == (
        0,
        [-2.0, -1.0],
        [-2.0, -1.0],
    )
    for before, after in zip(fixed_point.x[:20], fixed_point.x[1:21], strict=True):
        image = np.linalg.solve(np.eye(2) + M, (np.eye(2) - M) @ np.abs(before) - q)
        assert after == pytest.approx(image, rel=1e-12)
    falling = [float(plane_figures.merit(M, q, np.array(x))) for x in shi.x]
    assert all(after <= before * (1 + 1e-12) for before, after in pairwise(falling))
    assert min(x[1] for x in shi.x) < 0


def test_rows_and_iterates_stay_together_where_few_are_kept() -> None:
    whole, few = data(SKEW), data(SKEW, most=10, components=np.empty(0, dtype=np.intp))
    for path, thinned in zip(whole.curves, few.curves, strict=True):
        assert len(thinned.k) <= 10
        assert [path.x[path.k.index(k)] for k in thinned.k] == list(thinned.x)


def test_solutions_are_the_zeros_of_the_merit_function() -> None:
    made = data(TWO)
    assert len(made.solutions) == 2
    for solution in made.solutions:
        assert solution == pytest.approx([2 / 3, 7 / 6])
        assert plane_figures.merit(TWO.M, TWO.q, np.array(solution)) < 1e-8
    murty = Problem([[1, 2], [2, 1]], [-1, -1], solutions=[[1, 0], [0, 1]])
    assert data(murty, ("shi",)).solutions[:2] == [[0.5, -0.5], [-0.5, 0.5]]


def test_the_merit_function_is_that_of_the_equation_of_the_methods() -> None:
    M, q, x = (
        np.array([[1.0, 3], [-3, 1]]),
        np.array([-4.0, 3]),
        np.array([[-2.0, 0.5], [3, -1]]),
    )
    z, w = np.abs(x) + x, np.abs(x) - x
    F = M @ z - w + q[:, None]
    assert plane_figures.merit(M, q, x) == pytest.approx(np.sqrt((F**2).sum(axis=0)))


def test_range_holds_origin_start_and_solution_but_not_a_divergence() -> None:
    x = [(1.0, 1.0), (2.0, 2.0), (1e9, -1e9), (np.inf, np.nan)]
    made = plane(
        Problem(np.eye(2), [-1, -1]),
        [(0.5, 4.0)],
        Curve("shi", "shi", [0, 1, 2, 3], (), (), False, x),
    )
    for (low, high), largest in zip(
        plane_figures.ranges(made), (0.5, 4.0), strict=True
    ):
        assert low < 0 < largest < high < 20
    with style.context():
        plane_figures.draw_paths([made])


def test_quadrants_have_the_names_of_their_cones() -> None:
    with style.context():
        figure = plane_figures.draw_paths([data(TWO)])
    corners = {
        text.get_text(): text.xy  # type: ignore[attr-defined]
        for text in figure.axes[0].texts[:4]
    }
    (left, bottom), (right, top) = corners["$w_1$, $w_2$"], corners["$z_1$, $z_2$"]
    assert (left < right, bottom < top, corners["$z_1$, $w_2$"]) == (
        True,
        True,
        (right, bottom),
    )


@pytest.fixture
def folder(in_folder: Path) -> Path:
    Path("two.json").write_text('{"M": [[2, 1], [1, 2]], "q": [-5, -6]}')
    Path("bound.json").write_text(
        '{"M": [[2, 1], [1, 2]], "q": [-5, -6], "upper": [1, null]}'
    )
    return in_folder


@pytest.mark.slow("several pictures")
def test_both_commands_write_the_picture(lcp: Lcp, folder: Path) -> None:
    assert lcp("solve", "two.json", "--paths", "one.png", "--quiet").code == 0
    outcome = lcp("compare", "two.json", "--paths", "both.pdf", "--plot", "errors.svg")
    assert (outcome.code, sorted(outcome.err.splitlines())) == (
        0,
        ["lcp: wrote both.pdf", "lcp: wrote errors.svg"],
    )
    for name, magic in (
        ("one.png", b"\x89PNG"),
        ("both.pdf", b"%PDF-1."),
        ("errors.svg", b"<?xml"),
    ):
        assert (folder / name).read_bytes().startswith(magic)


MURTY = [[1, 2], [2, 1]]
DEGENERATE = {
    "opposite columns": [[0, 1], [1, 0]],
    "skew": [[0, -1], [1, 0]],
    "parallel columns": [[1, 1], [1, 1]],
    "parallel up to rounding": [[0.1, 0.3], [0.2, 0.6]],
    "opposite, of M alone": [[1, -1], [1, -1]],
    "zero": [[0, 0], [0, 0]],
    "zero column": [[0, 1], [0, 1]],
    "three of one direction": [[-1, -1], [0, 0]],
    "huge and tiny": [[1e308, 5e-324], [-1e308, 0]],
}


def picture(M: list[list[float]], q: tuple[float, float], **more: Any) -> SolutionSet:
    search = lcpcli.solutions(Problem(M, q, **{"name": "problem", **more}))
    assert len(list(search)) == len(search.pieces)
    return SolutionSet(search, "", 0.0)


@pytest.mark.parametrize("M", [MURTY, *DEGENERATE.values()])
@pytest.mark.parametrize("q", [(-1, -1), (1, -2), (0, 1), (0, 0)])
def test_cones_with_q_are_those_whose_generators_have_it_as_a_sum(
    M: list[list[float]], q: tuple[float, float]
) -> None:
    holding = []
    for chosen in SETS:
        basis = generators(M, chosen)
        lengths = np.abs(basis).max(axis=0)
        holding.append(bool(nnls(basis / np.where(lengths, lengths, 1), q)[1] < 1e-9))
    assert plane_figures.holding(picture(M, q)) == holding


def generators(M: list[list[float]], chosen: tuple[int, ...]) -> np.ndarray:
    """Those of a cone, as columns."""
    return np.column_stack(
        [
            -np.array(M, float)[:, j] if j + 1 in chosen else np.eye(2)[:, j]
            for j in (0, 1)
        ]
    )


def drawn(M: list[list[float]], q: tuple[float, float]) -> Figure:
    with style.context():
        return plane_figures.draw(picture(M, q))


@given(
    M=st.tuples(*[st.tuples(*[st.integers(-3, 3)] * 2)] * 2),
    q=st.tuples(*[st.integers(-5, 5)] * 2),
)
def test_q_is_in_the_sectors_whose_generators_have_it_as_a_sum(
    M: list[list[float]], q: tuple[float, float]
) -> None:
    direction = plane_figures.angle(q)
    for cone, chosen in zip(plane_figures.cones(M), SETS, strict=True):
        basis = generators(M, chosen)
        independent = bool(round(np.linalg.det(basis)))
        assert independent == (cone.kind == SECTOR)
        if independent and direction is not None:
            coefficients = np.linalg.solve(basis, q)
            if np.abs(coefficients).min() > 1e-9:
                ((start, width),) = cone.parts
                assert ((direction - start) % math.tau < width) == (
                    coefficients.min() > 0
                )
