"""What auto does with M that has no property which helps: search, then a tree whose proofs are exact."""

from __future__ import annotations

from collections.abc import Generator
from functools import partial

import numpy as np
import pytest
from scipy.sparse import block_array, block_diag, csr_array, diags_array, identity

from lcpcli import Problem, Status, run
from lcpcli.gallery import families
from lcpcli.methods import policy
from lcpcli.methods.direct import MOST_PIVOTED
from lcpcli.methods.milp import milp
from lcpcli.methods.policy import _search
from lcpcli.methods.stages import Iterate, NoSolution, Stalled, Turns
from lcpcli.verify.point import Point

from .. import exact
from .planted import solvable
from .stages import through
from .test_reflections import planted


def gaussian(n: int, seed: int) -> Problem:
    random = np.random.default_rng(seed)
    return Problem(random.normal(size=(n, n)), random.normal(size=n))


@pytest.mark.parametrize("symmetric", [True, False])
def test_a_solution_with_w_0_and_many_z_0_is_found_at_once(symmetric: bool) -> None:
    for seed in range(2):
        random = np.random.default_rng(seed)
        M = random.normal(size=(100, 100)) * (random.random((100, 100)) < 0.3)
        M = M + M.T if symmetric else M
        result = run(Problem(csr_array(M), -M @ np.maximum(random.random(100) - 0.5, 0.0)))
        assert (result.solved, result.route) == (True, ("newton",))


@pytest.mark.parametrize("family", ["contact", "lp", "qp", "transport"])
def test_zeros_on_the_diagonal_call_for_lemke_and_for_interior_before_it_where_pivots_cost_more(family: str) -> None:
    small, large = (run(families.make(family, n), trace=True) for n in (MOST_PIVOTED // 2, MOST_PIVOTED + 50))
    assert (small.solved, small.route) == (True, ("lemke",))
    assert (large.solved, "interior" in large.route, "lemke" in large.route) == (True, True, False)


def test_games_with_zeros_only_on_the_diagonal_call_for_lemke() -> None:
    assert "interior" not in run(families.make("bimatrix", 50), trace=True).route


def test_planted_solutions_are_found() -> None:
    result = run(Problem(*planted(80, 0)))
    assert (result.solved, result.route[-1]) == (True, "reflections")
    assert run(solvable("any", 48, np.random.default_rng(2))).solved


@pytest.mark.parametrize("seed", range(100, 112))
def test_problems_without_a_known_solution_are_decided(seed: int) -> None:
    assert run(gaussian(20, seed), time_limit=60).status in (Status.SOLVED, Status.INFEASIBLE, Status.UNSOLVABLE)


@pytest.mark.slow("60 problems in exact arithmetic")
def test_the_tree_decides_as_exact_arithmetic_does() -> None:
    for problem in (gaussian(8, seed) for seed in range(60)):
        excluded = isinstance(through(milp(problem, np.zeros(8)))[1], NoSolution)
        assert excluded == (exact.solution(problem) is None)


def test_a_solution_that_rounding_hides_from_a_linear_program_is_found() -> None:
    """x_1 = 2^25, where the terms of a row are 3e7 times their sum: the LP finds a proof up to rounding first."""
    eps, small, k = 2.0**-52, 2.0**-27, 150
    A = block_diag([[[1 + eps, -1], [-1, 1]], identity(k)])
    b, c = np.ones(k + 2), np.ones(k + 2)
    b[1], c[:2] = small - 1, 0
    result = run(Problem(csr_array(block_array([[None, -A.T], [A, None]])), np.append(c, -b)))
    assert result.solved


def test_the_tree_waits_where_milp_is_to_wait() -> None:
    """As for problems without their far bounds, which come before the problem as it is."""
    problem = gaussian(32, 105)
    search = partial(_search, presolve=True, states=False)
    assert isinstance(through(search(problem, Turns(np.zeros(32))))[1], NoSolution)
    assert isinstance(through(search(problem, Turns(np.zeros(32)), milp=False))[1], Stalled)


def test_search_ends_soon_after_a_point_whose_violations_may_be_rounding(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Point, "solves", lambda _: False)
    monkeypatch.setattr(policy, "_improved", no_improvement)
    result = run(families.make("contact", 48), time_limit=60.0)
    assert (result.status, result.residual < 1e-10) == (Status.STALLED, True)
    assert policy.NEARLY in result.message
    assert "milp" not in result.route


def no_improvement(*_: object) -> Generator[Iterate, None, bool]:
    yield from ()
    return False


@pytest.mark.parametrize(("n", "is_dense"), [(100, True), (401, True), (300, False), (1000, False)])
def test_a_first_time_step_of_an_american_put_is_solved_although_far_prices_are_tiny(n: int, is_dense: bool) -> None:
    """Far out of the money they fall to 1e-38, and q is 0 there: from q < 0, each step of pivoting finds one more."""
    strike, rate, volatility, step = 100.0, 0.05, 0.2, 0.01
    x, h = np.linspace(-1.2, 1.2, n + 2, retstep=True)
    payoff = np.maximum(strike - strike * np.exp(x), 0.0)
    a, b = volatility**2 / (2 * h**2), (rate - volatility**2 / 2) / (2 * h)
    M = diags_array([-(a - b) * step, 1 + (2 * a + rate) * step, -(a + b) * step], offsets=[-1, 0, 1], shape=(n, n))
    q = M @ payoff[1:-1] - payoff[1:-1]
    q[0] -= (a - b) * step * payoff[0]
    result = run(Problem(M.toarray() if is_dense else csr_array(M), q))
    assert result.solved
    assert (result.z > 0)[np.argmax(result.z > 0) :].all()
