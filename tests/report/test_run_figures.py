"""What the figures of runs, benchmarks and paths draw: the number of curves, where
their points lie, and what axes and legends say."""

import math

import numpy as np
import pytest

pytest.importorskip("matplotlib")


import lcpcli
from lcpcli import Problem
from lcpcli.report.figures import run_figures
from lcpcli.report.figures.style import BEYOND, UNSOLVED
from lcpcli.report.plotting import Curve, Panel, Profile, panels

from .figure_samples import (
    METHODS,
    PEERS,
    bench,
    convergence,
    crowd,
    curves,
    decaying,
    drawn,
    grid_panel,
    marks,
    named,
    odd,
    profiles,
)
from .path_samples import cornered, entering, frontier, portfolio, small

ERROR = r"error $\|z - z^*\|_\infty$"
SHORT = Panel(
    "short", "error", [decaying("shi", 0.5, 12), decaying("fixed-point", 0.4, 20)]
)
LONG = Panel(
    "long", "error", [decaying("shi", 0.5, 6), decaying("fixed-point", 0.99, 2000)]
)
BARE = Panel("bare", "error", [*SHORT.curves, odd("lemke", [None, None])])


def labels(axes):
    return axes.get_xlabel(), axes.get_ylabel()


def scales(axes):
    return axes.get_xscale(), axes.get_yscale()


def assert_follows(points, xs, ys):
    """The points of a curve, but for those that are moved to the edge of the axes."""
    assert points == pytest.approx(np.column_stack((xs, ys)))


def test_a_panel_has_the_steps_times_and_errors_of_the_traces():
    problem = lcpcli.read("paper-example-1")
    runs = [
        lcpcli.run(problem, "shi", trace=True, max_iterations=most)
        for most in (3, 1000)
    ]
    (panel,) = panels([runs])
    for curve, result in zip(panel.curves, runs, strict=True):
        rows = result.trace.rows
        assert curve.k == [row.k for row in rows]
        assert curve.seconds == [row.seconds for row in rows]
        assert curve.errors == [row.error for row in rows]
        assert curve.solved == result.solved


def test_a_row_has_the_error_of_each_run_over_time_and_over_iterations():
    figure = convergence(crowd(11), crowd(2))
    titles = [axes.get_title("left") for axes in figure.axes]
    assert titles == ["11 solvers, n = 100", "", "2 solvers, n = 100", ""]
    both = [("run time (s)", ERROR), ("iteration", "")] * 2
    assert [labels(axes) for axes in figure.axes] == both
    assert named(figure) == [*METHODS, *PEERS, BEYOND, UNSOLVED]
    for (over_time, over_k), panel in zip(
        (figure.axes[:2], figure.axes[2:]), (crowd(11), crowd(2)), strict=True
    ):
        # A peer is a point, and has no iterations.
        runs = [run for run in panel.curves if len(run.k) > 1]
        assert len(curves(over_time)) == len(curves(over_k)) == len(runs)
        for run, by_time, by_k in zip(
            runs, curves(over_time), curves(over_k), strict=True
        ):
            assert_follows(by_time[1:], run.seconds[1:], run.errors[1:])
            assert_follows(by_k, run.k, run.errors)
        lone = [(r.seconds[0], r.errors[0]) for r in panel.curves if len(r.k) == 1]
        assert {*lone[1:]} <= {*marks(over_time)}


def test_what_lies_beyond_the_axes_stands_at_their_edge_in_a_ring():
    """As time 0 and error 0 do on logarithmic axes."""
    run = Curve("lemke", "lemke", [0, 1, 2], [0.0, 1.0, 2.0], [1.0, 0.1, 0.0], True)
    figure = convergence(Panel("p", "error", [run]))
    over_time, over_k = figure.axes
    (by_time,), (by_k,) = curves(over_time), curves(over_k)
    (left, _), (low, _) = over_time.get_xlim(), over_time.get_ylim()
    assert by_time[1].tolist() == [1.0, 0.1]
    assert by_time[0, 1] == 1.0
    assert by_time[2, 0] == 2.0
    assert left < by_time[0, 0] < 1
    assert low < by_time[2, 1] == by_k[2, 1] < 0.1
    assert by_k[:2].tolist() == [[0, 1], [1, 0.1]]
    assert marks(over_time, BEYOND) == [tuple(by_time[0]), tuple(by_time[2])]
    assert marks(over_k, BEYOND) == [tuple(by_k[2])]
    assert named(figure) == ["lemke", BEYOND]


def test_errors_that_are_no_numbers_stand_at_the_edges():
    odd_one = odd("newton", [math.nan, math.inf])
    figure = convergence(BARE, Panel("p", "error", [odd_one]))
    for axes in figure.axes[:2]:
        assert len(curves(axes)) == 2  # nothing is measured of the third run
    for axes in figure.axes[2:]:
        (points,) = curves(axes)
        assert (points[:, 1] == points[0, 1]).all()
        assert marks(axes, BEYOND)[0][1] == points[0, 1]
        assert marks(axes, UNSOLVED) == [tuple(points[1])]
    assert named(figure) == ["shi", "fixed-point", "newton", BEYOND, UNSOLVED]


def test_iterations_are_logarithmic_where_runs_are_of_very_different_lengths():
    alike = [decaying("shi", 0.99, 1500), decaying("fixed-point", 0.99, 2000)]
    for panel in (SHORT, Panel("alike", "error", alike)):
        assert scales(convergence(panel).axes[1]) == ("linear", "log")
    figure = convergence(SHORT, LONG)
    assert [scales(axes)[0] for axes in figure.axes] == ["log", "symlog"] * 2
    _, slow = curves(figure.axes[3])
    assert_follows(slow, range(2000), LONG.curves[1].errors)


def test_curves_have_few_markers_on_their_points():
    (over_time, over_k) = convergence(SHORT, LONG).axes[2:]
    for axes in (over_time, over_k):
        _, slow = curves(axes)
        ends = {tuple(slow[0]), tuple(slow[-1])}
        placed = {*marks(axes)} & {tuple(point) for point in slow.tolist()}
        assert ends <= placed
        assert len(placed) <= run_figures.MAX_MARKERS + 1


def test_runs_of_a_grid_of_options_have_an_entry_and_a_curve_each():
    figure = convergence(grid_panel())
    grid = [f"shi:p={p},k-star={k}" for p in ("1", "100", "1e4") for k in (1, 5, 100)]
    assert named(figure) == ["fixed-point", *grid, BEYOND, UNSOLVED]
    for axes in figure.axes:
        assert len(curves(axes)) == 10
    last = grid_panel().curves[-1]
    (cross,) = marks(figure.axes[1], UNSOLVED)
    assert cross[0] == last.k[-1]


RATIOS = [1.0, 2.0, 2.0, math.inf]


def test_a_profile_steps_up_at_each_ratio_to_the_share_that_is_solved():
    (axes,) = bench([Profile("shi", "shi", RATIOS)]).axes
    assert axes.get_title("left") == "Performance profile, 4 problems"
    assert axes.get_xlabel() == "time / time of the fastest solver"
    assert scales(axes) == ("log", "linear")
    (steps,) = curves(axes)
    assert steps[:2].tolist() == [[1, 0.25], [2, 0.75]]
    assert steps[2:, 1].tolist() == [0.75]
    assert axes.lines[0].get_drawstyle() == "steps-post"


def test_a_profile_over_time_begins_at_nothing():
    times = [ratio / 4 for ratio in RATIOS]
    (axes,) = bench([Profile("shi", "shi", times, in_seconds=True)]).axes
    assert axes.get_title("left") == "Solved over time, 4 problems"
    assert axes.get_xlabel() == "run time (s)"
    (steps,) = curves(axes)
    assert steps[1:3].tolist() == [[0.25, 0.25], [0.5, 0.75]]
    assert steps[0, 1] == 0


def test_a_bench_has_a_profile_and_the_runs_with_one_legend():
    figure = bench(profiles(3), [BARE])
    assert [axes.get_title("left") for axes in figure.axes] == [
        "Performance profile, 10 problems",
        "bare",
    ]
    assert [len(curves(axes)) for axes in figure.axes] == [3, 2]
    assert named(figure) == [*METHODS[:3], BEYOND]
    for profile, steps in zip(profiles(3), curves(figure.axes[0]), strict=True):
        for x, share in steps:
            solved = sum(ratio <= x for ratio in profile.ratios)
            assert share == pytest.approx(solved / len(profile.ratios))


def of_path(path, *chosen):
    return drawn(run_figures.draw, path, chosen)


def rules(axes):
    """Where the vertical rules stand."""
    return [
        float(line.get_xdata()[0])
        for line in axes.lines
        if line.get_transform() != axes.transData
    ]


def test_a_path_has_a_curve_a_component_through_its_breakpoints():
    figure = of_path(small())
    (axes,) = figure.axes
    assert axes.get_title("left") == "small, n = 2"
    assert labels(axes) == ("$t$", "z")
    t = [0, 1 / 7, 1 / 5, 1]
    first, second = curves(axes)
    assert_follows(first, t, [0, 0, 0, 4 / 3])
    assert_follows(second, t, [0, 0, 1 / 5, 7 / 3])
    assert rules(axes) == pytest.approx(t)
    assert named(figure) == ["z1", "z2"]


def test_components_that_are_always_zero_are_left_out_and_what_moves_is_named():
    ends = (Problem(np.eye(3), q) for q in ([1, 1, -1], [1, -1, -1]))
    figure = of_path(lcpcli.path(*ends))
    (axes,) = figure.axes
    assert axes.get_title("left") == "n = 3"
    assert labels(axes) == ("q2", "z")
    entering_one, constant = curves(axes)
    assert_follows(entering_one, [1, 0, -1], [0, 0, 1])
    assert_follows(constant, [1, 0, -1], [1, 1, 1])
    assert named(figure) == ["z2", "z3"]


def test_a_path_has_the_chosen_unknowns_alone_and_multipliers_too():
    programs = (
        lcpcli.from_qp(
            [[2, 0], [0, 2]], [-2, -5], [[1, 2]], row_upper=[b], rows=["steel"]
        )
        for b in (1, 4)
    )
    figure = of_path(lcpcli.path(*programs), "y steel")
    ((first, *_),) = curves(figure.axes[0])
    assert named(figure) == ["y steel"]
    assert first.tolist() == [1, -2]


def test_a_jump_and_a_turn_are_drawn_as_the_path_takes_them():
    figure = of_path(cornered())
    (axes,) = figure.axes
    assert axes.get_title("left") == "cornered, n = 1 (1 boxed)"
    assert labels(axes) == ("q1", "z")
    (points,) = curves(axes)
    assert points.tolist() == [[-1, 3], [0, 3], [0, 0], [-1, 0]]
    assert rules(axes) == [-1, 0]
    assert named(figure) == ["z1"]


def test_many_components_are_thin_lines_without_a_legend():
    figure = of_path(entering(40))
    (axes,) = figure.axes
    assert axes.get_ylabel() == "z, 40 components"
    for k, points in enumerate(curves(axes), 1):
        assert points[-1] == pytest.approx([1, k])
    assert len(curves(axes)) == 40
    assert named(figure) == []
    assert marks(axes) == []


def test_a_program_has_its_x_and_its_objective_over_t():
    figure = of_path(
        lcpcli.path(*(portfolio(0.05, c=c) for c in ([0, 0, 0], [0, 0.01, 0.02])))
    )
    shares, objective = figure.axes
    assert labels(shares) == ("$t$", "x")
    assert labels(objective) == ("$t$", "objective")
    assert len(curves(shares)) == 3
    assert named(figure) == ["shares", "bonds", "cash"]
    for points in zip(*curves(shares), strict=True):
        assert sum(y for _, y in points) == pytest.approx(1)
    (parabolas,) = curves(objective)
    assert parabolas[0] == pytest.approx([0, 0.0103125])
    assert len(parabolas) > len(curves(shares)[0])
    assert [x for x, _ in marks(objective)] == pytest.approx(
        [x for x, _ in curves(shares)[0]]
    )


def test_a_frontier_has_the_risk_across_and_the_return_up():
    figure = of_path(frontier())
    shares, risk = figure.axes
    assert labels(shares) == ("return", "x")
    assert labels(risk) == ("objective", "return")
    returns = [x for x, _ in curves(shares)[0]]
    assert (returns[0], returns[-1]) == pytest.approx((0.05, 0.1))
    assert [y for _, y in marks(risk)] == pytest.approx(returns)
    (line,) = curves(risk)
    assert line[0].tolist() == pytest.approx([0.0103125, 0.05])
    assert line[-1].tolist() == pytest.approx([0.025, 0.1])
    assert (np.diff(line, axis=0) >= -1e-12).all()


def test_objective_of_a_linear_program_stands_over_the_side_that_moves():
    """Only a quadratic program has a frontier, with the objective, a risk, on the other
    axis."""
    first, last = (
        lcpcli.from_qp(
            None, [-3, -2], [[1, 1], [1, 3]], row_upper=[side, 6], rows=("a", "b")
        )
        for side in (4, 9)
    )
    assert labels(of_path(lcpcli.path(first, last)).axes[1]) == ("a", "objective")
