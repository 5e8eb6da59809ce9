"""No method is believed that says it has solved a problem: points that solve nothing, made-up residuals and endings."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from scipy.sparse import diags_array

from lcpcli import Problem, Status, from_game, from_qp, run
from lcpcli.linalg.matrices import product
from lcpcli.methods.stages import Breakdown, Finished, OutOfTime, Stalled
from lcpcli.model.box import in_words
from lcpcli.solving.result import Result
from lcpcli.typing import Vector

from .. import exact, exact_measure, mixed_problems
from .liars import Liar, assert_refused, at

M, Q = mixed_problems.definite(5, np.random.default_rng(0))
LOWER, UPPER = mixed_problems.with_all_bounds(5, np.random.default_rng(0))
TRIDIAGONAL = diags_array([-np.ones(29), 3 * np.ones(30), -np.ones(29)], offsets=[-1, 0, 1])
PROBLEMS = {
    "lcp": Problem([[2, 1], [1, 2]], [-5, -6]),
    "many unknowns": Problem(TRIDIAGONAL, np.sin(np.arange(30)) - 0.5),
    "large numbers": Problem([[2e250, 1e250], [1, 2]], [-5e250, -6]),
    "mixed": Problem(M, Q, lower=LOWER, upper=UPPER),
    "far bounds": Problem(M, Q, lower=1e6 + np.arange(5), upper=np.inf),
    "program": from_qp([[2, 0], [0, 2]], [-3, 1], [[1, 1]], row_lower=1, row_upper=1),
    "game": from_game([[3, 0], [0, 2]], [[2, 0], [0, 3]]),
}
ENDINGS = [Finished(), Stalled("it knows better"), Breakdown("it knows better"), OutOfTime("it knows better")]


def off_by(problem: Problem, z: Vector, size: float) -> Vector:
    """A z near a solution with that relative residual, by rational arithmetic: one component is moved."""
    box = problem.box
    inside = np.minimum(z - box.lower, box.upper - z)
    inside[inside == np.inf] = 1.0
    j, step = int(np.argmax(inside)), 1e-6
    other = z.copy()
    for _ in range(3):
        other[j] = z[j] + step
        step *= size / exact_measure.relative_residual(problem, other)
    other[j] = z[j] + step
    assert exact_measure.relative_residual(problem, other) == pytest.approx(size, rel=0.05)
    return other


@pytest.mark.parametrize("name", PROBLEMS)
def test_point_that_solves_nothing_is_not_called_a_solution(name: str, liar: Liar) -> None:
    problem = PROBLEMS[name]
    z = problem.box.project(2 * run(problem).z + 1)
    for F in (None, -0.0):
        for ending in ENDINGS:
            status = "breakdown" if isinstance(ending, Breakdown) else "stalled"
            assert_refused(liar.run(problem, [at(z, F)], ending), status)
        result = liar.run(problem, [at(z, F)] * 3, declaration={"iterates": True}, scale=True)
        assert_refused(result)
        assert "does not solve the problem" in result.message


def assert_refused_or_corrected(result: Result) -> None:
    """The point is refused, or where it satisfies each row by its own terms, it is replaced by the solution with its
    states, of which a solution is proved to be within the last digits."""
    if not result.solved:
        assert_refused(result)
        return
    assert "an exact solution is proved to have the states of z" in result.message
    solution = exact.solution(result.problem)
    assert all(abs(Fraction(a) - b) <= 2**-50 * abs(b) for a, b in zip(result.z.tolist(), solution, strict=True))


@pytest.mark.parametrize("name", PROBLEMS)
def test_point_ten_times_as_far_off_as_the_tolerance_is_refused(name: str, liar: Liar) -> None:
    problem, tol = PROBLEMS[name], 1e-10
    z = run(problem).z
    far, near = (off_by(problem, z, size * tol) for size in (10, 0.1))
    for F in (None, 0.0):
        assert_refused_or_corrected(liar.run(problem, [at(far, F)]))
        assert liar.run(problem, [at(near, F)]).solved, "a tenth of it is near enough"


def plain_zero(seed: int) -> tuple[Problem, list[float]]:
    """A problem and a z whose w = 0 as floating point sums it, with errors of 1e-3 of q."""
    matrix = np.array([[0.1, -0.1], [-0.1, 0.1 * (1 + 1e-13)]])
    large = 1e14 * (1 + np.random.default_rng(seed).random())
    z = np.array([large + 10, large])
    q = -product(matrix, z)
    assert not (product(matrix, z) + q).any()
    return Problem(matrix, q), z.tolist()


def along(slope: float, distance: float, gap: float) -> tuple[Problem, list[float]]:
    """z_1 - z_2 >= 1 and (1 + slope) z_2 >= z_1, with large z; a z at that distance from the solution, and off row 1 by
    the gap."""
    problem = Problem([[1, -1], [-1, 1 + slope]], [-1, 0])
    solution = exact.solution(problem)
    z2 = float(solution[1]) + distance
    return problem, [z2 + 1 + gap, z2]


NEAR: dict[str, tuple[Problem, list[float]]] = {
    **{f"zero by rounding errors {seed}": plain_zero(seed) for seed in range(5)},
    "wrong in the 14th digit": along(1e-6, 0.0, 1e-8),
    "wrong in the 14th digit of very large numbers": along(1e-10, 1e-4, 2e-6),
    "near a bound far from zero": (
        Problem([[1, 0], [1e-3, 1]], [-1000.1, -1e6], lower=[1000, 0]),
        [1000.1 + 1e-8, 1e6 - 1.0001],
    ),
    "on the bounds as wrong as before": (Problem(np.eye(2), [-1, 5e-9]), [1 + 1e-9, 1e-12]),
}


@pytest.mark.parametrize("name", NEAR)
def test_point_that_nearly_looks_like_a_solution_is_refused(name: str, liar: Liar) -> None:
    problem, z = NEAR[name]
    for F in (None, 0.0):
        assert_refused_or_corrected(liar.run(problem, [at(z, F)]))


NOWHERE: dict[str, tuple[Problem, Any, Any]] = {  # without solution; from a point in a direction
    "column of zeros": (Problem([[0, 1], [0, -1]], [-2, 1]), [0, 1.5], [1, 0]),
    "difference": (Problem([[1, -1], [-1, 1]], [-1, 0.5]), [0.75, 0], [1, 1]),
    "free variables": (Problem([[0, 1], [-1, 0]], [1, 1], lower=None, upper=[np.inf, -2]), [1, -2], [0, -1]),
    "rows that exclude each other": (
        from_qp(None, [1, 1], [[1, -1], [1, -1]], row_lower=[2, -np.inf], row_upper=[np.inf, 1]),
        [1.5, 0, 0, 0],
        [1, 1, 0, 0],
    ),
    "unbounded": (from_qp(None, [-2, 1], [[1, -1]], row_upper=1), [1, 0, 0], [1, 1, -1]),
}


@pytest.mark.parametrize(("F", "iterates"), [(None, False), (0.0, True)])
@pytest.mark.parametrize("name", NOWHERE)
def test_z_that_runs_off_to_infinity_solves_nothing(name: str, F: float | None, iterates: bool, liar: Liar) -> None:
    problem, start, direction = NOWHERE[name]
    steps = [at(start + 10.0**k * np.array(direction), F) for k in range(0, 308, 4)]
    results = [liar.run(problem, [step]) for step in steps[::5]]
    for result in (liar.run(problem, steps, declaration={"iterates": iterates}), *results):
        if result.status is Status.INFEASIBLE:  # proved while the doubt about a large z is settled
            assert exact.refutes(problem, [Fraction(value) for value in result.certificate.vector.tolist()])
        else:
            assert_refused(result, "stalled", "diverged")


@pytest.mark.parametrize("name", PROBLEMS)
def test_point_that_is_not_finite_is_not_even_reported(name: str, liar: Liar) -> None:
    problem = PROBLEMS[name]
    solution = run(problem)
    x = problem.box.x_of(solution.z, solution.w)
    for value, F in (math.nan, None), (math.inf, 0.0), (-math.inf, 0.0), (1.7e308, None), (1.7e308, 0.0):
        step = at(2 * x, F)
        for place in (0, slice(None)):
            wrong = x.copy()
            wrong[place] = value
            result = liar.run(problem, [step._replace(x=wrong)])
            if value > -math.inf or not problem.is_mixed:  # else it stands for a bound
                assert_refused(result, "breakdown" if math.isnan(value) else "stalled")
            assert np.isfinite(result.z).all()
        assert liar.run(problem, [step, step._replace(x=wrong)]).solved, "by the iterate before"


def test_claimed_residuals_decide_nothing(liar: Liar) -> None:
    """Neither about the best iterate and its measures nor about divergence, and a solution is one whatever F is."""
    problem = PROBLEMS["lcp"]
    for claims in ([0.0, 1.0, 1.0], [1e-300, 1.0, 1e300], [1.0, 1e300, math.inf], [math.nan, math.nan, 0.0]):
        steps = [at([k, 1.0], F) for k, F in enumerate(claims)]
        for iterates in (False, True):
            assert_refused(liar.run(problem, steps, declaration={"iterates": iterates}))
        assert liar.run(problem, [*steps, at([4 / 3, 7 / 3], 1e300)], declaration={"iterates": True}).solved


def test_time_that_there_is_no_limit_on_is_not_up(liar: Liar) -> None:
    problem = PROBLEMS["lcp"]
    assert liar.run(problem, ending=OutOfTime()).status is Status.STALLED
    assert liar.run(problem, ending=OutOfTime(), time_limit=60).status is Status.TIME_LIMIT


@pytest.mark.parametrize("name", ["lcp", "mixed", "program"])
def test_basis_is_that_of_z_and_w_and_not_what_a_method_had_in_mind(name: str, liar: Liar) -> None:
    """An iterate x stands for states: here for those of another point, with every variable between its bounds."""
    problem = PROBLEMS[name]
    result = liar.run(problem, [at(problem.box.project(np.linspace(1, 2, problem.n)))])
    assert_refused(result)
    assert result.basis == in_words(problem.box.basis_at(result.z, problem.w(result.z)))
    solution = run(problem)
    claimed = liar.run(problem, [at(off_by(problem, solution.z, 1e-11))])
    assert claimed.solved
    assert claimed.basis == solution.basis
    # z = (1, 1) as if both were basic; but w_2 = 6, so that the second is rather at its bound
    assert liar.run(Problem(np.eye(2), [-1, 5]), [at([1, 1])]).basis == ["basic", "lower"]
