"""The method `shi` is the printed algorithm: every step of it is reached, and does what the paper says."""

from __future__ import annotations

import math
from itertools import islice, pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from lcpcli import Problem, Status, Trace, read, run
from lcpcli.files import contents
from lcpcli.methods.shi import AVERAGE, PLANE, SELECTED, STEEPEST, STEEPEST_AT_MULTIPLE, direction, shi
from lcpcli.methods.smoothing import Smoothed
from lcpcli.methods.stages import Iterate

Vector = NDArray[np.float64]
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


@pytest.mark.parametrize("rho_sigma", LINE_SEARCHES, ids=str)
@pytest.mark.parametrize("k_star", [1, 2, 5, 10, 1000])
@pytest.mark.parametrize("p", [1e2, 1e4, 1e6, 1e8, 1e10, 1e12, 1e300])
def test_both_examples_are_solved_from_the_files_starts(
    paper_example: Problem, p: float, k_star: int, rho_sigma: tuple[float, float]
) -> None:
    rho, sigma = rho_sigma
    result = run(paper_example, "shi", p=p, k_star=k_star, rho=rho, sigma=sigma)
    assert result.status is Status.SOLVED
    assert result.error is not None
    assert result.error <= 1e-9


@pytest.mark.parametrize("rho_sigma", LINE_SEARCHES, ids=str)
@pytest.mark.parametrize("p", [1.0, 1e2, 1e12, 1e300])
def test_every_step_meets_both_wolfe_conditions(
    paper_example: Problem, p: float, rho_sigma: tuple[float, float]
) -> None:
    rho, sigma = rho_sigma
    smoothed = Smoothed(paper_example, p)
    assert paper_example.x0 is not None
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
    assert EXAMPLE_1.x0 is not None
    found = iterates(EXAMPLE_1, EXAMPLE_1.x0, 20, k_star=4)
    assert found[0].step == SELECTED
    assert [k for k, it in enumerate(found, 1) if it.step == STEEPEST_AT_MULTIPLE] == [5, 9, 13, 17]
    assert {it.step for it in found[1:4]} == {PLANE}


def test_steepest_descent_at_a_multiple_of_k_star_follows_the_gradient() -> None:
    assert EXAMPLE_2.x0 is not None
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


@pytest.mark.slow("many random vectors, each against a fine grid")
@given(data=st.data())
def test_alpha_maximises_the_cosine_among_all_alphas_that_descend(data: st.DataObject) -> None:
    n = data.draw(st.integers(2, 5))
    F, v, y, d = (
        np.array(data.draw(st.lists(st.floats(-10, 10).map(lambda t: round(t, 3)), min_size=n, max_size=n)))
        for _ in range(4)
    )
    assume(min(np.linalg.norm(t) for t in (F, v, y, d)) > 0.1)
    assume(abs(v @ y) > 1e-3)
    assume(abs(y @ F) > 1e-3)
    u, w = vectors_of_step_3(F, v, y)
    assume(abs((u - w) @ d) > 1e-6 * np.linalg.norm(d) * (np.linalg.norm(u) + np.linalg.norm(w)))
    assume(abs(cosine(F, v)) < 1 - 1e-6)
    step, s = chosen(F, v, y, d)
    assume(step == PLANE)
    bound = -(w @ d) / ((u - w) @ d)
    side = math.copysign(1, (u - w) @ d)
    steps = np.concatenate([np.logspace(-8, 8, 2000), [1e12]])
    candidates = (bound + side * t * max(1.0, abs(bound)) for t in steps)
    best = max(cosine(alpha * u + (1 - alpha) * w, d) for alpha in candidates)
    assert cosine(s, d) >= best - 1e-7
    assert s @ d > 0


def test_direction_lies_in_the_plane_of_u_and_v_with_weights_that_sum_to_one() -> None:
    generator = np.random.default_rng(0)
    for _ in range(200):
        F, v, y, d = generator.standard_normal((4, 5))
        u, w = vectors_of_step_3(F, v, y)
        step, s = chosen(F, v, y, d)
        if step != PLANE:
            continue
        a, b = np.linalg.lstsq(np.column_stack((u, w)), s, rcond=None)[0]
        assert np.allclose(a * u + b * w, s)
        alpha = a / (a + b) if abs(a + b) > 1e-9 * (abs(a) + abs(b)) else math.inf
        assert alpha == math.inf or a + b > 0  # otherwise s would be a negative multiple of a candidate


@pytest.mark.parametrize("side", [1, -1])
def test_plane_step_descends_whichever_sign_u_minus_v_has(side: int) -> None:
    """The printed bound on alpha is the descent condition only for <u - v, d> > 0; for < 0 it turns round."""
    generator = np.random.default_rng(1)
    seen = 0
    while seen < 20:
        F, v, y, d = generator.standard_normal((4, 4))
        u, w = vectors_of_step_3(F, v, y)
        if side * ((u - w) @ d) > 1e-3:
            step, s = chosen(F, v, y, d)
            assert step == PLANE
            assert s @ d > 0
            seen += 1


def test_supremum_at_infinity_is_approached_along_u_minus_v() -> None:
    """Both u and v ascend: no finite alpha is best, s is sign <u - v, d> (u - v)."""
    F, v, d = np.array([1.0, 0.0]), np.array([0.0, 1.0]), np.array([-1.0, -1.0])
    y = np.array([-1.0, -1.0])  # xi_1 = 1, xi_2 = 1/2
    u, w = vectors_of_step_3(F, v, y)
    assert u @ d < 0
    assert w @ d < 0
    step, s = chosen(F, v, y, d)
    assert step == PLANE
    assert cosine(s, math.copysign(1, (u - w) @ d) * (u - w)) == pytest.approx(1)


def test_average_is_taken_if_u_and_v_descend_equally() -> None:
    F, v, d = np.array([1.0, 0.0]), np.array([0.0, 1.0]), np.array([1.0, 2.0])
    y = np.array([-1.0, -1.0])  # u = (1, 0), v = (0, 1/2), <u, d> = <v, d> = 1
    step, s = chosen(F, v, y, d)
    assert step == AVERAGE
    assert cosine(s, np.array([0.5, 0.25])) == pytest.approx(1)


def test_steepest_descent_is_taken_if_u_and_v_ascend_equally() -> None:
    F, v, d = np.array([1.0, 0.0]), np.array([0.0, 1.0]), np.array([-1.0, -2.0])
    step, s = chosen(F, v, np.array([-1.0, -1.0]), d)
    assert step == STEEPEST
    assert np.array_equal(s, d)


@pytest.mark.parametrize("without", ["v", "y"])
def test_steepest_descent_is_taken_without_a_last_step_to_learn_from(without: str) -> None:
    given = {"F": np.ones(3), "v": np.ones(3), "y": np.ones(3), "g": np.array([1.0, 2.0, 3.0])}
    given[without] = np.zeros(3)
    step, s = direction(**given)
    assert step == STEEPEST
    assert np.array_equal(s, [-1.0, -2.0, -3.0])


@pytest.mark.parametrize("y", [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], ids=["xi_1 infinite", "xi_2 zero"])
def test_zero_denominators_of_xi_leave_a_direction_of_descent(y: list[float]) -> None:
    F, v, d = np.array([1.0, 1.0, 0.0]), np.array([0.0, 0.0, 2.0]), np.array([1.0, 2.0, 3.0])
    _, s = chosen(F, v, np.array(y), d)
    assert s @ d > 0
    assert np.isfinite(s).all()


def test_parallel_u_and_v_leave_a_direction_of_descent() -> None:
    F, y, d = np.array([1.0, 2.0]), np.array([1.0, 0.5]), np.array([-1.0, 0.1])
    step, s = chosen(F, -3 * F, y, d)
    assert step == PLANE
    assert s @ d > 0


def test_given_second_point_is_the_second_iterate() -> None:
    x1 = np.array([1.0, -1.0, 1.0, -1.0])
    assert EXAMPLE_1.x0 is not None
    second = next(shi(EXAMPLE_1, EXAMPLE_1.x0, x1=x1))
    assert np.array_equal(second.x, x1)
    assert second.step == SELECTED
    assert run(EXAMPLE_1, "shi", x1=x1).solved


def test_iterates_are_never_changed_afterwards() -> None:
    assert EXAMPLE_2.x0 is not None
    copies = []
    kept = []
    for iterate in shi(EXAMPLE_2, EXAMPLE_2.x0):
        kept.append(iterate.x)
        copies.append(iterate.x.copy())
        if len(kept) == 30:
            break
    assert all(np.array_equal(a, b) for a, b in zip(kept, copies, strict=True))


def test_an_evaluation_costs_at_most_one_product_with_M_and_one_with_its_transpose() -> None:
    class Counting(np.ndarray):  # type: ignore[type-arg]
        products = 0

        def __matmul__(self, other: object) -> object:
            Counting.products += 1
            return self.view(np.ndarray) @ other

    problem = Problem(EXAMPLE_2.M, EXAMPLE_2.q)
    object.__setattr__(problem, "M", problem.M.view(Counting))
    found = iterates(problem, np.zeros(4), 40)
    assert found[-1].evaluations <= Counting.products <= 2 * found[-1].evaluations


def test_trace_of_a_plain_run_shows_plane_and_steepest_steps() -> None:
    trace = Trace()
    run(EXAMPLE_2, "shi", trace=trace, k_star=10)
    assert {row.step for row in trace.rows} >= {SELECTED, STEEPEST_AT_MULTIPLE, PLANE}
