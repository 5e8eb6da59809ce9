"""What `auto` decides at once: degenerate solutions with w = 0, few unknowns with any bounds, and Z-matrices; and
proofs that no rounding of bounds costs, whatever the way in."""

from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from scipy.sparse import csr_array

from lcpcli import Problem, Result, Solver, exact, run, solve, solve_many
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.tree import first_solution
from lcpcli.verify.certificate import proof

SWAP = np.array([[0.0, 1.0], [1.0, 0.0]])
NONE = {"INFEASIBLE", "UNSOLVABLE"}


def without_solution(kind: str) -> Problem:
    """Return a feasible problem without a solution, of 23 unknowns, whose bounds make q round in other variables."""
    random, n, m = np.random.default_rng(5), 23, 8
    A = random.integers(-2, 3, (n - m, n - m))
    coupling = random.integers(-1, 2, (n - m, m))
    M = np.block([[np.kron(np.eye(m // 2), SWAP), np.zeros((m, n - m))], [coupling, A @ A.T + np.eye(n - m)]])
    q = np.append(np.tile([-1.0, 1.0], m // 2), random.integers(-9, 10, n - m)) - M @ np.full(n, 0.1)
    lower, upper = np.full(n, 0.1), np.full(n, np.inf)
    if kind != "lower":
        lower[m : m + 3], upper[m + 3 : m + 6] = -np.inf, 0.7
    if kind == "all":
        lower[m + 4], upper[m + 1], lower[m + 6], upper[m + 6] = -np.inf, 3.3, 0.3, 0.3
    return Problem(M, q, lower=lower, upper=upper)


@pytest.mark.parametrize("n", [50, 100])
def test_a_solution_with_w_0_is_found_by_one_look_however_many_z_are_rounding_of_0(n: int) -> None:
    random = np.random.default_rng(n)
    A = random.standard_normal((n, n))
    for M in (A, A + A.T):
        z = np.where(random.random(n) < 0.5, 0.0, random.random(n))
        result = run(Problem(M, -M @ z))
        assert result.solved
        assert result.route == ("newton",)


@pytest.mark.parametrize("shift", [0.0, 0.1])
def test_bounds_that_are_no_integers_do_not_cost_the_proof(shift: float) -> None:
    random = np.random.default_rng(3)
    for n in (11, 12, 13, 14):
        problem = Problem(random.integers(-5, 6, (n, n)), random.integers(-10, 11, n), lower=shift, upper=np.inf)
        assert run(problem).status.name in {"SOLVED", *NONE}


@pytest.mark.parametrize("kind", ["lower", "free and boxes", "all"])
@pytest.mark.parametrize("method", ["auto", "milp"])
def test_the_tree_of_milp_proves_that_the_problem_as_given_has_no_solution(kind: str, method: str) -> None:
    result = run(without_solution(kind), method)
    assert result.status.name == "UNSOLVABLE"
    assert result.certificate is not None
    assert result.certificate.kind == "exhaustion"


WAYS: dict[str, Callable[..., Result]] = {
    "solve": lambda M, q, **bounds: solve(M, q, **bounds),
    "sparse": lambda M, q, **bounds: solve(csr_array(M), q, **bounds),
    "Solver": lambda M, q, **bounds: Solver(M, **bounds).solve(q),
    "solve_many": lambda M, q, **bounds: list(solve_many(M, np.column_stack((q, q)), **bounds))[1],
    "pairs": lambda M, q, **bounds: list(solve_many([M, M], [q, q], **bounds))[1],
    "exact": lambda M, q, **bounds: exact(Problem(M, q, **bounds)),
}


@pytest.mark.parametrize("way", WAYS)
def test_no_way_in_loses_the_proof(way: str) -> None:
    problem = without_solution("all")
    result = WAYS[way](problem.M, problem.q, lower=problem.lower, upper=problem.upper)
    assert result.status.name == "UNSOLVABLE"


def test_the_tree_of_milp_agrees_with_that_in_rational_arithmetic_for_any_bounds() -> None:
    random = np.random.default_rng(11)
    for _ in range(40):
        n = int(random.integers(2, 8))
        M, kind = random.integers(-3, 4, (n, n)) * (random.random((n, n)) < 0.7), random.integers(0, 5, n)
        lower = np.where(np.isin(kind, (0, 3)), -0.3, np.where(kind == 4, 0.7, -np.inf))
        upper = np.where(kind == 1, 1.1, np.where(kind == 3, 2.3, np.where(kind == 4, 0.7, np.inf)))
        problem = Problem(M, random.integers(-4, 5, n), lower=lower, upper=upper)
        status, z = run(problem, "milp").status, first_solution(ExactProblem.of_floats(problem), lambda: None)
        assert status.name in ({"SOLVED"} if z else {"SOLVED", *NONE})
        assert z or status.name in NONE or run(problem).solved, "a solution but for rounding"


def test_the_form_that_pyomo_writes_keeps_the_proof() -> None:
    problem = without_solution("lower")
    n, one = problem.n, np.eye(problem.n)
    M = np.block([[0 * one, one], [-problem.M, one]])
    bounds = np.append(problem.lower, np.full(n, -np.inf)), np.full(2 * n, np.inf)
    assert run(Problem(M, np.append(np.zeros(n), -problem.q), lower=bounds[0], upper=bounds[1])).status.name in NONE


def test_a_z_matrix_without_a_solution_is_proved_infeasible() -> None:
    M = np.diag(np.full(30, 1.0)) - np.diag(np.full(29, 2.0), 1) - np.diag(np.full(29, 2.0), -1)
    result = run(Problem(M, np.where(np.arange(30) == 3, -1.0, 1.0)))
    assert result.status.name == "INFEASIBLE"


@pytest.mark.parametrize("decimals", [0, 1, 16])
def test_proofs_are_small_integers_where_there_is_room_to_round(decimals: int) -> None:
    random = np.random.default_rng(decimals)
    for n in (5, 15, 30):
        M, q = np.round(random.uniform(-5, 3, (n, n)), decimals), np.round(random.uniform(-9, 5, n), decimals)
        result = run(Problem(M, q))
        assert result.status.name == "INFEASIBLE"
        y = result.certificate.vector
        assert (y == np.rint(y)).all()
        assert y.max() <= 64


def test_a_simple_proof_replaces_a_long_one_but_nothing_replaces_a_vector_that_proves_nothing() -> None:
    problem = Problem([[1, -2], [-2, 1]], [1, -1])
    assert proof(problem, np.array([51.0, 58.0])).max() < 10
    assert proof(problem, np.array([1.0, 0.0])) is None
    found = exact(problem)
    assert max(map(abs, found.exact.y)) <= Fraction(2)
