"""The pictures of all solutions: complementary cones of two unknowns."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Wedge
from scipy.optimize import nnls

from lcpcli.report.figures import cones_figure, style
from lcpcli.report.figures.cones_figure import LINE, POINT, RAY, SECTOR, SETS
from lcpcli.report.figures.data import Cones

MURTY = [[1, 2], [2, 1]]
# M and the kinds of its four cones, in the order of SETS
DEGENERATE = {
    "opposite columns": ([[0, 1], [1, 0]], [SECTOR, LINE, LINE, SECTOR]),
    "skew": ([[0, -1], [1, 0]], [SECTOR, LINE, RAY, SECTOR]),
    "parallel columns": ([[1, 1], [1, 1]], [SECTOR, SECTOR, SECTOR, RAY]),
    "parallel up to rounding": ([[0.1, 0.3], [0.2, 0.6]], [SECTOR, SECTOR, SECTOR, RAY]),
    "opposite, of M alone": ([[1, -1], [1, -1]], [SECTOR, SECTOR, SECTOR, LINE]),
    "zero": ([[0, 0], [0, 0]], [SECTOR, RAY, RAY, POINT]),
    "zero column": ([[0, 1], [0, 1]], [SECTOR, RAY, SECTOR, RAY]),
    "three of one direction": ([[-1, -1], [0, 0]], [SECTOR, SECTOR, RAY, RAY]),
    "huge and tiny": ([[1e308, 5e-324], [-1e308, 0]], [SECTOR, SECTOR, LINE, SECTOR]),
}


def picture(M: list[list[float]], q: tuple[float, float], **given_too: object) -> Cones:
    """With the cones that really hold q."""
    holding = []
    for chosen in SETS:
        basis = generators(M, chosen)
        lengths = np.abs(basis).max(axis=0)
        holding.append(bool(nnls(basis / np.where(lengths, lengths, 1), q)[1] < 1e-9))
    return Cones("problem", M, q, holding, f"{sum(holding)} solutions", **given_too)  # type: ignore[arg-type]


def generators(M: list[list[float]], chosen: tuple[int, ...]) -> np.ndarray:
    """Those of a cone, as columns."""
    return np.column_stack([-np.array(M, float)[:, j] if j + 1 in chosen else np.eye(2)[:, j] for j in (0, 1)])


def drawn(M: list[list[float]], q: tuple[float, float]) -> Figure:
    with style.context():
        return cones_figure.draw(picture(M, q))


def sectors(axes: Axes) -> list[Wedge]:
    return [patch for patch in axes.patches if isinstance(patch, Wedge) and patch.get_fill()]


def test_sectors_of_a_P_matrix_are_its_cones_and_meet_at_one_radius() -> None:
    found = sectors(drawn([[2, 1], [1, 2]], (-5, -6)).axes[0])
    first, second = math.degrees(math.atan2(-1, -2)) + 360, math.degrees(math.atan2(-2, -1)) + 360
    angles = [(wedge.theta1, wedge.theta2) for wedge in found]
    assert angles == [pytest.approx(pair) for pair in [(0, 90), (90, first), (second, 360), (first, second)]]
    assert len({wedge.r for wedge in found}) == 1


def test_each_cone_that_holds_q_has_a_mark_where_the_ray_through_q_crosses_its_arc() -> None:
    axes = drawn(MURTY, (-1, -1)).axes[0]
    marks = [line.get_xydata()[0] for line in axes.lines if line.get_markerfacecolor() == "white"]
    radii = [wedge.r for wedge in sectors(axes)]
    assert [math.hypot(*mark) for mark in marks] == pytest.approx(radii[1:])
    assert {round(math.degrees(math.atan2(y, x))) for x, y in marks} == {-135}
    assert len(set(radii[1:])) == 3


@given(M=st.tuples(*[st.tuples(*[st.integers(-3, 3)] * 2)] * 2), q=st.tuples(*[st.integers(-5, 5)] * 2))
def test_q_is_in_the_sectors_whose_generators_have_it_as_a_sum(M: list[list[float]], q: tuple[float, float]) -> None:
    direction = cones_figure.angle(q)
    for cone, chosen in zip(cones_figure.cones(M), SETS, strict=True):
        basis = generators(M, chosen)
        independent = bool(round(np.linalg.det(basis)))
        assert independent == (cone.kind == SECTOR)
        if independent and direction is not None:
            coefficients = np.linalg.solve(basis, q)
            if np.abs(coefficients).min() > 1e-9:
                ((start, width),) = cone.parts
                assert ((direction - start) % math.tau < width) == (coefficients.min() > 0)


@pytest.mark.parametrize("name", DEGENERATE)
def test_degenerate_cones_are_drawn_as_rays_lines_and_points(name: str) -> None:
    M, kinds = DEGENERATE[name]
    assert [cone.kind for cone in cones_figure.cones(M)] == kinds
    figure = drawn(M, (1, -2))
    assert len(sectors(figure.axes[0])) == kinds.count(SECTOR)
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    words = {SECTOR: "", RAY: ": a ray", LINE: ": a line", POINT: ": the origin"}
    assert [label.split("$")[-1].rstrip(f" {cones_figure.CHECK}") for label in legend] == [
        words[kind] for kind in kinds
    ]


def test_legend_checks_the_cones_that_hold_q() -> None:
    legend = drawn(MURTY, (-1, -1)).legends[0]
    labels = [text.get_text() for text in legend.get_texts()]
    assert labels == ["$w_1$, $w_2$", "$z_1$, $w_2$  ✓", "$w_1$, $z_2$  ✓", "$z_1$, $z_2$  ✓"]
