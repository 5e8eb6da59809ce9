"""The method `shi` is the printed algorithm: every step of it is reached, and does what the paper says; its endings."""

from __future__ import annotations

import math
from itertools import islice, pairwise

import numpy as np
import pytest

from lcpcli import Problem, Status, read, run
from lcpcli.files import contents
from lcpcli.methods.shi import AVERAGE, PLANE, SELECTED, STEEPEST, STEEPEST_AT_MULTIPLE, direction, shi
from lcpcli.methods.smoothing import Smoothed
from lcpcli.methods.stages import Iterate
from lcpcli.typing import Vector

EXAMPLE_1, EXAMPLE_2 = (read(contents.shipped_path(f"paper-example-{number}.json")) for number in (1, 2))
LINE_SEARCHES = [(1e-4, 0.9), (0.1, 0.5), (0.49, 0.5)]


def iterates(problem: Problem, x0: Vector, count: int, **options: float) -> list[Iterate]:
    """The first iterates, fewer if the method ends."""
    return list(islice(shi(problem, x0, **options), count))  # type: ignore[arg-type]


def vectors_of_step_3(F: Vector, v: Vector, y: Vector) -> tuple[Vector, Vector]:
    """u and v of step 2.3, as printed."""
    xi_1, xi_2 = -(v @ v) / (v @ y), -(y @ F) / (y @ y)
    return xi_1 * F, xi_2 * v


def cosine(a: Vector, b: Vector) -> float:
    return float(a @ b / np.linalg.norm(a) / np.linalg.norm(b))


def chosen(F: Vector, v: Vector, y: Vector, d: Vector) -> tuple[str, Vector]:
    return direction(F, v.copy(), y.copy(), -d)


@pytest.mark.parametrize("k_star", [1, 10, 1000])
@pytest.mark.parametrize("p", [1e2, 1e8, 1e300])
def test_both_examples_are_solved_from_the_files_starts(paper_example: Problem, p: float, k_star: int) -> None:
    for rho, sigma in LINE_SEARCHES:
        result = run(paper_example, "shi", p=p, k_star=k_star, rho=rho, sigma=sigma)
        assert result.status is Status.SOLVED
        assert result.error <= 1e-9


@pytest.mark.parametrize(("rho", "sigma"), LINE_SEARCHES)
@pytest.mark.parametrize("p", [1.0, 1e12])
def test_every_step_meets_both_wolfe_conditions(paper_example: Problem, p: float, rho: float, sigma: float) -> None:
    smoothed = Smoothed(paper_example, p)
    steps = [it.x for it in iterates(paper_example, paper_example.x0, 40, p=p, k_star=7, rho=rho, sigma=sigma)]
    pairs = [(smoothed.at(before), smoothed.at(after)) for before, after in pairwise(steps)]
    above_rounding = [(here, there) for here, there in pairs if there.f > 1e-24]
    assert len(above_rounding) > 10
    for here, there in above_rounding:
        advance = there.x - here.x  # gamma s
        slope, slope_there = smoothed.gradient(here) @ advance, smoothed.gradient(there) @ advance
        assert slope < 0
        assert there.f <= here.f + rho * slope + 1e-13 * here.f
        assert slope_there >= sigma * slope * (1 + 1e-9) - 1e-13 * here.f


def test_steps_are_labelled_with_their_numbers() -> None:
    found = iterates(EXAMPLE_1, EXAMPLE_1.x0, 20, k_star=4)
    assert found[0].step == SELECTED
    assert [k for k, it in enumerate(found, 1) if it.step == STEEPEST_AT_MULTIPLE] == [5, 9, 13, 17]
    assert {it.step for it in found[1:4]} == {PLANE}


def test_steepest_descent_at_a_multiple_of_k_star_follows_the_gradient() -> None:
    smoothed = Smoothed(EXAMPLE_2, 1e12)
    found = iterates(EXAMPLE_2, EXAMPLE_2.x0, 20, p=1e12, k_star=1)
    for before, after in pairwise(found):
        descent = -smoothed.gradient(smoothed.at(before.x))
        assert cosine(after.x - before.x, descent) == pytest.approx(1, abs=1e-12)


def test_one_unknown_makes_average_steps_which_are_secant_steps() -> None:
    problem = Problem([[3.0]], [-2.0])
    found = iterates(problem, np.array([2.0]), 4, k_star=1000, p=1e12)
    assert found[1].step == AVERAGE
    assert 2 * found[-1].x[0] == pytest.approx(2 / 3, rel=1e-12)


def test_alpha_maximises_the_cosine_among_all_alphas_that_descend() -> None:
    """The printed bound on alpha is the descent condition only for <u - v, d> > 0; for < 0 it turns round."""
    generator, sides = np.random.default_rng(0), set()
    steps = np.concatenate([np.logspace(-8, 8, 200), [1e12]])
    for n in np.repeat([2, 3, 5], 40).tolist():
        F, v, y, d = generator.standard_normal((4, n))
        u, w = vectors_of_step_3(F, v, y)
        step, s = chosen(F, v, y, d)
        assert step == PLANE
        assert s @ d > 0
        bound, side = -(w @ d) / ((u - w) @ d), math.copysign(1, (u - w) @ d)
        candidates = (bound + side * t * max(1.0, abs(bound)) for t in steps)
        best = max(cosine(alpha * u + (1 - alpha) * w, d) for alpha in candidates)
        assert cosine(s, d) >= best - 1e-7
        a, b = np.linalg.lstsq(np.column_stack((u, w)), s, rcond=None)[0]
        assert np.allclose(a * u + b * w, s)
        alpha = a / (a + b) if abs(a + b) > 1e-9 * (abs(a) + abs(b)) else math.inf
        assert alpha == math.inf or a + b > 0  # otherwise s would be a negative multiple of a candidate
        sides.add(side)
    assert sides == {-1, 1}


@pytest.mark.parametrize(
    ("d", "step", "toward"),
    [
        ([-1.0, -1.0], PLANE, [-1.0, 0.5]),  # both ascend, no finite alpha is best: sign <u - v, d> (u - v)
        ([1.0, 2.0], AVERAGE, [0.5, 0.25]),  # both descend equally
        ([-1.0, -2.0], STEEPEST, [-1.0, -2.0]),  # both ascend equally
    ],
)
def test_directions_where_no_alpha_is_best(d: list[float], step: str, toward: list[float]) -> None:
    """u = (1, 0) and v = (0, 1/2)."""
    F, v, y = np.array([1.0, 0.0]), np.array([0.0, 1.0]), np.array([-1.0, -1.0])
    found, s = chosen(F, v, y, np.array(d))
    assert found == step
    assert cosine(s, np.array(toward)) == pytest.approx(1)
    assert step != STEEPEST or np.array_equal(s, d)


def test_steepest_descent_is_taken_without_a_last_step_to_learn_from() -> None:
    for v, y in ((np.zeros(3), np.ones(3)), (np.ones(3), np.zeros(3))):
        step, s = direction(np.ones(3), v, y, np.array([1.0, 2.0, 3.0]))
        assert (step, s.tolist()) == (STEEPEST, [-1.0, -2.0, -3.0])


def test_what_cannot_be_divided_by_leaves_a_direction_of_descent() -> None:
    for given in (
        ([1.0, 1.0, 0.0], [0.0, 0.0, 2.0], [1.0, 0.0, 0.0], [1.0, 2.0, 3.0]),  # xi_1 infinite
        ([1.0, 1.0, 0.0], [0.0, 0.0, 2.0], [0.0, 0.0, 1.0], [1.0, 2.0, 3.0]),  # xi_2 zero
        ([1.0, 2.0], [-3.0, -6.0], [1.0, 0.5], [-1.0, 0.1]),  # u and v parallel
    ):
        F, v, y, d = map(np.array, given)
        _, s = chosen(F, v, y, d)
        assert (s @ d > 0, np.isfinite(s).all()) == (True, True)


def test_given_second_point_is_the_second_iterate() -> None:
    x1 = np.array([1.0, -1.0, 1.0, -1.0])
    second = next(shi(EXAMPLE_1, EXAMPLE_1.x0, x1=x1))
    assert np.array_equal(second.x, x1)
    assert second.step == SELECTED
    assert run(EXAMPLE_1, "shi", x1=x1).solved


def test_small_p_ends_at_the_smoothing_error_and_says_so() -> None:
    result = run(EXAMPLE_1, "shi", p=3.0, max_iterations=2000)
    assert result.status is Status.STALLED
    bound = math.log(3) / 3 * np.abs(EXAMPLE_1.M - np.eye(4)).sum(axis=1).max()
    assert 1e-3 < result.residual <= bound
    told = f"smoothing error, in F at most (ln 3 / p) |M - I| = {bound:.2g} for p = 3 "
    assert f"what is left is the {told}" in result.message


@pytest.mark.parametrize(("k_star", "status"), [(10, Status.ITERATION_LIMIT), (100, Status.SOLVED)])
def test_direction_that_cannot_descend_gives_way_to_steepest_descent(k_star: int, status: Status) -> None:
    """A positive definite problem on which the plane of F~ and the last step becomes orthogonal to d."""
    generator = np.random.default_rng([12, 3])
    factor = generator.standard_normal((12, 12))
    problem = Problem(factor @ factor.T + 12 * np.eye(12), generator.standard_normal(12))
    assert run(problem, "shi", k_star=k_star, max_iterations=4000).status is status


def test_evaluations_of_a_search_in_vain_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    done, real = [], Smoothed.at
    monkeypatch.setattr(Smoothed, "at", lambda self, x: done.append(x) or real(self, x))
    result = run(Problem([[2.0, -5.0], [5.0, 2.0]], [-1.0, 1.0]), "shi", max_iterations=200)
    assert result.evaluations == len(done)


@pytest.mark.parametrize(
    ("problem", "word"),
    [
        (Problem([[2.0]], [-1e-200]), "underflows"),
        (Problem(EXAMPLE_1.M, EXAMPLE_1.q * 1e200, x0=np.zeros(4)), "overflow"),
        (Problem([[-1.0]], [-1.0], x0=[0.0]), "stationary"),  # where phi' = 0 makes J = M + 1 = 0: no zero of F~
    ],
)
def test_what_it_cannot_go_on_from_is_a_breakdown_that_says_so(problem: Problem, word: str) -> None:
    result = run(problem, "shi")
    assert result.status is Status.BREAKDOWN
    assert word in result.message
