"""The last resort: it solves every problem with a solution, proves the rest to have none, and is never wrong."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from itertools import count

import numpy as np
import pytest
from scipy.sparse import csr_array

from lcpcli import Problem, Result, Status, read
from lcpcli.files import contents
from lcpcli.interrupts import TimeIsUp
from lcpcli.methods import milp as module
from lcpcli.methods.milp import ComplementarySystem
from lcpcli.methods.stages import OutOfTime, Stalled, advance
from lcpcli.model.box import of_masks
from lcpcli.model.changes import standard_form
from lcpcli.options import Limits
from lcpcli.solving.driver import run
from lcpcli.verify.certificate import proves_infeasible
from lcpcli.verify.exact_solution import exact_basis
from lcpcli.verify.measure import FEW_UNKNOWNS

from .. import exact
from ..verify.test_certificate import nearly_infeasible
from .stages import through

SWAP = np.array([[0.0, 1.0], [1.0, 0.0]])
NONE = (Status.INFEASIBLE, Status.UNSOLVABLE)


def system(M: object, q: object) -> ComplementarySystem:
    """Return the system in which the complementary sets of an LCP are sought."""
    return ComplementarySystem(standard_form(Problem(M, q)))


def is_right(problem: Problem, result: Result) -> bool:
    """Whether the result agrees with exact arithmetic; "stalled" does not."""
    if exact.solution(problem) is None:
        return result.status in NONE
    return result.solved


@pytest.mark.parametrize(
    ("M", "q", "status"),
    [
        pytest.param(SWAP, [-1, 1], Status.UNSOLVABLE, id="feasible-without-solution"),
        pytest.param([[0, -1], [1, 0]], [-1, -1], Status.INFEASIBLE, id="infeasible"),
        pytest.param([[0, 1], [0, 0]], [-1, 0], Status.SOLVED, id="ray-of-lemke"),
        pytest.param([[-1]], [-1], Status.INFEASIBLE, id="one-unknown-infeasible"),
        pytest.param([[0]], [-1], Status.INFEASIBLE, id="zero-infeasible"),
        pytest.param([[1, -1], [-1, 1 + 2.0**-52]], [-1, 0], Status.SOLVED, id="solution-of-size-1/eps"),
        pytest.param(np.kron(np.eye(6), SWAP), np.tile([-1.0, 1.0], 6), Status.UNSOLVABLE, id="12-without-solution"),
    ],
)
def test_known_problem_ends_as_it_must(M: object, q: np.ndarray, status: Status) -> None:
    problem = Problem(M, q)
    result = run(problem, "milp")
    assert result.status is status
    if status is Status.INFEASIBLE:
        assert proves_infeasible(problem, result.certificate.vector)


LONG = pytest.param("tridiagonal-100", marks=pytest.mark.slow("15 seconds"))


@pytest.mark.parametrize("file", ["bimatrix", "paper-example-1", "paper-example-2", LONG])
def test_shipped_problem_is_solved_to_rounding(file: str) -> None:
    result = run(read(contents.shipped_path(f"{file}.json")), "milp")
    assert result.solved
    assert result.relative_residual <= 1e-15
    assert result.error <= 1e-14


@pytest.mark.slow("many problems, each against exact arithmetic")
@pytest.mark.parametrize("start", range(0, 300, 50))
def test_agrees_with_exact_arithmetic_on_every_kind_of_problem_in_any_units_and_sparse(start: int) -> None:
    random = np.random.default_rng(start)
    for seed in range(start, start + 50):
        problem = exact.random_problem(seed)
        sparse, scaled = Problem(csr_array(problem.M), problem.q), exact.rescaled(problem, random)
        result = run(problem, "milp")
        assert is_right(problem, result), problem.name
        assert run(sparse, "milp").solved == result.solved, problem.name
        assert is_right(scaled, run(scaled, "milp")), problem.name


@pytest.mark.slow("many problems, each against exact arithmetic")
def test_nearly_infeasible_problems_are_decided_or_ill_posed_where_the_solution_is_beyond_rounding() -> None:
    for seed in range(100):
        problem, _ = nearly_infeasible(seed)
        result = run(problem, "milp")
        if result.status is Status.ILL_POSED:
            solution = exact.solution(problem)
            assert solution is not None, seed
            assert max(solution) > 1e12, seed
        else:
            assert is_right(problem, result), seed
        assert result.status is not Status.INFEASIBLE or not exact.feasible(problem), seed


def test_problem_without_solution_is_not_solved_by_what_is_one_to_the_tolerance_only() -> None:
    """Rows of R q from 5e-4 to 5e5: what violates z >= 0 by 1e-11 of the largest has a residual below tol."""
    M = [[0, 0, 0.75, -0.03125], [0, 0, 2, 0.75], [1, 0, 0, 0], [0.001953125, 0.5, 0, 0]]
    problem = Problem(M, [-185688.13643428445, -524288.0, -0.25, -0.00046563688320586636])
    assert exact.solution(problem) is None
    assert run(problem, "milp").status is Status.UNSOLVABLE


def test_start_of_the_problem_has_no_influence_but_is_checked_first() -> None:
    problem = read(contents.shipped_path("paper-example-1.json"))
    for x0, iterations in ((np.array([0.5, -0.5, 0.5, -0.5]), 0), (np.full(4, 7.0), 1)):
        assert run(replace(problem, x0=x0), "milp").iterations == iterations


def test_solution_is_found_by_the_tree_alone() -> None:
    assert np.array_equal(next(module.candidates(system(SWAP, [-1.0, 0.0]))), [False, True])


def test_tree_that_is_too_large_is_no_proof() -> None:
    M, q = np.kron(np.eye(3), SWAP) + 1e-3 * np.ones((6, 6)), np.tile([-1.0, 1.0], 3)
    tree = module.candidates(system(M, q), nodes=1)
    while not isinstance(ending := advance(tree), Stalled):
        assert isinstance(ending, np.ndarray), "no proof"
    assert "1 systems" in ending.reason


def test_time_limit_is_kept_and_called_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a clock that goes on by one second each time it is read, and it is read while one waits."""
    random, seconds = np.random.default_rng(0), count(0.0)
    A = random.normal(size=(60, 60))
    problem = Problem(A @ A.T + 0.1 * np.eye(60), random.normal(size=60) - 0.3)
    run(Problem([[2.0]], [-1.0]), "milp")  # loads what it needs
    monkeypatch.setattr("time.perf_counter", lambda: next(seconds))
    result = run(problem, "milp", limits=Limits(time_limit=30.0))
    assert next(seconds) < 60
    assert result.status is Status.TIME_LIMIT
    assert "time limit" in result.message


@pytest.mark.parametrize(
    ("M", "q"),
    [
        ([[0, 1e-308], [1e308, 0]], [-1e308, 1e-308]),
        ([[0, 0], [0, 0]], [5e-324, -5e-324]),
        ([[5e-324]], [-1e308]),
        ([[1e-320, 5e-324], [0, 1e300]], [-1, -1]),
        ([[1e308, 1e308], [1e308, 1e308]], [-1e308, -1]),
        ([[1e300, 1], [1e-300, 1e300]], [-1e300, -1e-300]),
    ],
)
def test_data_at_the_ends_of_the_range_end_in_some_status_and_no_false_one(M: object, q: object) -> None:
    problem = Problem(M, q)
    result = run(problem, "milp")
    assert result.status in (Status.STALLED, Status.DIVERGED) or is_right(problem, result)


def test_what_was_found_counts_when_the_time_is_up_in_the_middle_of_a_linear_program(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The only candidate solves the problem to the tolerance of linear programs alone, so that it would come last."""

    def interrupted(*_: object) -> Iterator[np.ndarray]:
        yield np.array([True])
        raise TimeIsUp

    monkeypatch.setattr(module, "_program", lambda *_: [])
    monkeypatch.setattr(module, "_basic_solution", lambda M, q, _: (-q / M[0], False))
    monkeypatch.setattr(module, "candidates", interrupted)
    iterates, ending = through(module.milp(Problem([[2]], [-1]), np.zeros(1)))
    assert [iterate.x[0] for iterate in iterates] == [0.25]
    assert isinstance(ending, OutOfTime)


def test_set_that_is_neither_solved_nor_excluded_leaves_open_whether_there_is_a_solution() -> None:
    """But for last digits 3 w_1 + w_2 = 4 z_4 - 4 z_1 - 5, where z_4 = 0 as w_4 >= 1: so z has size 1e31. The unknowns
    from z_5 on are there as exact arithmetic would decide a problem of FEW_UNKNOWNS by itself."""
    rows = np.array([[-2, 1, -1], [2, -3, 3], [6, -3, 3]]) + 2.0**-52 * np.array([[2, 1, 1], [-4, 6, -4], [-8, -4, 6]])
    M, q = np.eye(FEW_UNKNOWNS + 1), np.ones(FEW_UNKNOWNS + 1)
    M[:3, :3], M[:3, 3], q[:3] = rows, 1, [-2, 1, 5]
    problem, z = Problem(M, q), exact.solution(Problem(rows, q[:3]))
    assert z is not None
    assert exact.solves(problem, [*z, *[Fraction(0)] * (q.size - 3)])
    assert run(problem, "milp").status not in NONE


def test_several_basic_solutions_are_not_taken_for_the_only_one() -> None:
    """z_2 = z_1 + 1: the one with z_1 = -1 is no solution, but (0, 1) is."""
    M, q = np.array([[-1.0, 1.0], [1.0, -1.0]]), np.array([-1.0, 1.0])
    found = exact_basis(M, q, of_masks(np.ones(2, dtype=bool)))
    assert (found.z, found.unique, found.solves) == ([-1, 0], False, False)
    assert exact.solves(Problem(M, q), [Fraction(0), Fraction(1)])
    assert not system(M, q).excluded(np.ones(2, dtype=bool))


def test_singular_block_of_a_hundred_thousand_rows_is_not_made_dense() -> None:
    n = 100_000
    assert not list(module._solutions(csr_array((n, n)), -np.ones(n), np.arange(n), np.arange(0)))
