"""The pictures of paths of iterates over |F|, and of the complementary cones of two
unknowns."""

import math

import numpy as np
import pytest
from scipy.optimize import nnls

pytest.importorskip("matplotlib")

from matplotlib.patches import Wedge

from lcpcli import Problem
from lcpcli.report.figures import plane_figures, style
from lcpcli.report.figures.plane_figures import SETS
from lcpcli.report.plotting import Curve

from .figure_samples import (
    DEGENERATE,
    MURTY,
    SKEW,
    TWO,
    cones,
    curves,
    data,
    drawn,
    marks,
    named,
    picture,
    plane,
)


def test_paths_are_the_iterates_of_the_methods_where_z_is_zero_too():
    made = data(SKEW)
    M, q = made.problem.M, made.problem.q
    fixed_point, shi = made.curves
    assert fixed_point.x[0] == shi.x[0] == [-2.0, -1.0]
    for before, after in zip(fixed_point.x[:20], fixed_point.x[1:21], strict=True):
        image = np.linalg.solve(np.eye(2) + M, (np.eye(2) - M) @ np.abs(before) - q)
        assert after == pytest.approx(image, rel=1e-12)
    assert min(x[1] for x in shi.x) < 0


def test_rows_and_iterates_stay_together_where_few_are_kept():
    whole, few = data(SKEW), data(SKEW, most=10, components=np.empty(0, dtype=np.intp))
    for path, thinned in zip(whole.curves, few.curves, strict=True):
        assert len(thinned.k) <= 10
        assert [path.x[path.k.index(k)] for k in thinned.k] == list(thinned.x)


def test_solutions_are_the_zeros_of_the_merit_function():
    made = data(TWO)
    assert len(made.solutions) == 2
    for solution in made.solutions:
        assert solution == pytest.approx([2 / 3, 7 / 6])
        assert plane_figures.merit(TWO.M, TWO.q, np.array(solution)) < 1e-8
    murty = Problem([[1, 2], [2, 1]], [-1, -1], solutions=[[1, 0], [0, 1]])
    assert data(murty, ("shi",)).solutions[:2] == [[0.5, -0.5], [-0.5, 0.5]]


def test_range_holds_origin_start_and_solution_but_not_a_divergence():
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


def test_quadrants_have_the_names_of_their_cones():
    with style.context():
        figure = plane_figures.draw_paths([data(TWO)])
    corners = {text.get_text(): text.xy for text in figure.axes[0].texts[:4]}
    (left, bottom), (right, top) = corners["$w_1$, $w_2$"], corners["$z_1$, $z_2$"]
    assert left < right
    assert bottom < top
    assert corners["$z_1$, $w_2$"] == (right, bottom)


@pytest.mark.parametrize("M", [MURTY, *DEGENERATE.values()])
@pytest.mark.parametrize("q", [(-1, -1), (1, -2), (0, 1), (0, 0)])
def test_cones_with_q_are_those_whose_generators_have_it_as_a_sum(M, q):
    holding = []
    for chosen in SETS:
        basis = generators(M, chosen)
        lengths = np.abs(basis).max(axis=0)
        holding.append(bool(nnls(basis / np.where(lengths, lengths, 1), q)[1] < 1e-9))
    assert plane_figures.holding(picture(M, q)) == holding


def generators(M, chosen):
    """Those of a cone, as columns."""
    return np.column_stack(
        [
            -np.array(M, float)[:, j] if j + 1 in chosen else np.eye(2)[:, j]
            for j in (0, 1)
        ]
    )


def wedges(figure):
    """The sectors that are filled, in degrees, and how opaque each is."""
    return [
        (patch.theta1 % 360, patch.theta2 % 360, patch.get_facecolor()[3])
        for patch in figure.axes[0].patches
        if isinstance(patch, Wedge) and patch.get_fill()
    ]


NAMES = [f"${'wz'[i]}_1$, ${'wz'[j]}_2$" for j in (0, 1) for i in (0, 1)]


@pytest.mark.parametrize("M", [MURTY, [[2, 1], [1, 2]], *DEGENERATE.values()])
@pytest.mark.parametrize("q", [(1, -2), (-1, -1)])
def test_a_picture_of_cones_has_a_sector_for_each_with_two_directions(M, q):
    """From one of its generators to the other; and the legend says what the others are,
    and which cones hold q."""
    figure, found = cones(M, q), picture(M, q)
    title = figure.axes[0].get_title("left")
    assert title.startswith(f"{found.count}: problem\nM = [")
    sectors = []
    for chosen, entry, name, holds in zip(
        SETS,
        filter(None, named(figure)),
        NAMES,
        plane_figures.holding(found),
        strict=True,
    ):
        one, other = generators(M, chosen).T
        is_flat = not (one.any() and other.any()) or abs(sine(one, other)) < 1e-12
        if not is_flat:
            turns = [degrees(one), degrees(other)]
            turns = turns if sine(one, other) > 0 else turns[::-1]
            sectors.append((*turns, plane_figures.FILLS[holds]))
        told, _, kind = entry.removesuffix("  \N{CHECK MARK}").partition(": ")
        assert told == name
        assert kind in (("a line", "a ray", "the origin") if is_flat else ("",))
        assert entry.endswith("\N{CHECK MARK}") == holds
    assert np.array(sorted(wedges(figure))) == pytest.approx(np.array(sorted(sectors)))


def sine(one, other):
    """Of the angle from one direction to another."""
    (a, b), (c, d) = (v / np.abs(v).max() for v in (one, other))
    return float((a * d - b * c) / math.hypot(a, b) / math.hypot(c, d))


def degrees(direction):
    x, y = direction / np.abs(direction).max()
    return math.degrees(math.atan2(y, x)) % 360


def test_iterates_are_drawn_from_the_start_to_the_solution():
    panel = data(TWO)
    figure = drawn(plane_figures.draw_paths, [panel])
    plane_of_x, scale = figure.axes
    assert plane_of_x.get_xlabel() == "$x_1$"
    assert plane_of_x.get_ylabel() == "$x_2$"
    assert plane_of_x.get_title("left") == "two"
    assert scale.get_ylabel() == r"$\|F(x)\|_2$"
    assert scale.get_yscale() == "log"
    for curve, points in zip(panel.curves, curves(plane_of_x), strict=True):
        assert points == pytest.approx(np.array(curve.x))
    *_, start, one, other = marks(plane_of_x)
    assert (start, one, other) == (
        (0, 0),
        *(pytest.approx(solution) for solution in panel.solutions),
    )
    assert named(figure) == ["fixed-point", "shi", "start", "solution"]


def test_a_method_without_iterates_is_named_as_one():
    runs = [
        Curve("newton", "newton", [0, 1], (), (), True, [(0, 0), (0.5, 0.5)]),
        Curve("milp", "milp", [0], (), (), True, [(0, 0)]),
    ]
    figure = drawn(plane_figures.draw_paths, [plane(TWO, [(0.5, 0.5)], *runs)])
    assert named(figure) == ["newton", "start", "solution", "milp: no iterates"]
