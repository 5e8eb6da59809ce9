"""A Solver: one M for a sequence of problems, with the results of solve."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from scipy.sparse import diags_array

from lcpcli import Problem, Solver, run, solve, solve_many
from lcpcli.errors import OptionError, ProblemError
from lcpcli.gallery import families

FAMILIES = {
    "harker-pang": 30,
    "contact": 48,
    "obstacle": 400,
    "boxes": 40,
    "circuit": 60,
    "american-put": 500,
    "qp": 50,
    "spatial-prices": 44,
}


def walk(problem: Problem, steps: int, size: float = 0.02) -> Iterator[np.ndarray]:
    """Yield q after q, each near the last one; entries that are 0 remain 0."""
    random, q = np.random.default_rng(0), np.array(problem.q)
    for _ in range(steps):
        yield q.copy()
        q += size * np.abs(problem.q) * random.normal(size=q.size)


@pytest.mark.parametrize("name", FAMILIES)
def test_a_sequence_has_the_results_of_separate_calls(name: str) -> None:
    problem = families.make(name, FAMILIES[name])
    solver = Solver(problem.M, lower=problem.lower, upper=problem.upper)
    for q in walk(problem, 6):
        result, alone = solver.solve(q), solve(problem.M, q, lower=problem.lower, upper=problem.upper)
        assert (result.status, result.problem.q.tolist()) == (alone.status, q.tolist())
        assert not result.solved or result.relative_residual <= 1e-10
        if name in ("harker-pang", "obstacle", "american-put"):  # whose solutions are unique
            assert np.abs(result.z - alone.z).max() <= 1e-9 * np.abs(alone.z).max()


def test_a_step_that_changes_no_state_takes_one_system_where_contacts_are_redundant() -> None:
    problem = families.make("contact", 60, 1)
    solver = Solver(problem.M)
    first, second = solver.solve(problem.q), solver.solve(1.01 * np.array(problem.q))
    assert (first.route, second.route, second.iterations) == (("lemke",), ("newton",), 1)
    assert second.solved


def test_bounds_and_m_may_change_from_step_to_step() -> None:
    solver = Solver([[2, 1], [1, 2]])
    assert solver.solve([-5, -6]).z == pytest.approx([4 / 3, 7 / 3])
    assert solver.solve([-5, -6], upper=2).z == pytest.approx([1.5, 2.0])
    assert solver.solve([-5, -6], lower=[None, 0], upper=[1, 5]).z == pytest.approx([1, 2.5])
    assert solver.solve([-5, -6]).z == pytest.approx([4 / 3, 7 / 3])
    solver.update([[4, 0], [0, 4]])
    assert solver.solve([-5, -6]).z == pytest.approx([1.25, 1.5])
    solver.update([[4]])
    assert solver.solve([-2]).z == pytest.approx([0.5]), "without states of another shape"


def test_mistakes_are_named_and_limits_hold() -> None:
    bounded = Solver([[2, 1], [1, 2]], upper=[1, 1])
    for wrong in (lambda: Solver([[1, 2, 3], [4, 5, 6]]), lambda: Solver(None), lambda: bounded.update([[4]])):
        with pytest.raises(ProblemError, match=r"^M: "):
            wrong()
    with pytest.raises(ProblemError, match=r"^q: "):
        bounded.solve([1, 2, 3])
    with pytest.raises(OptionError, match="tol"):
        Solver([[1]], tol=2)
    problem = families.make("murty", 12)
    assert Solver(problem.M, max_iterations=3).solve(problem.q).status is run(problem, max_iterations=3).status


def test_solve_many_takes_q_from_a_generator_that_needs_the_last_z() -> None:
    M, last = np.array([[3.0, -1.0], [-1.0, 3.0]]), [np.zeros(2)]
    for result in solve_many(M, (np.array([-1.0, -2.0]) - last[-1] for _ in range(5))):
        assert result.solved
        last.append(result.z)
    assert M @ last[-1] - last[-1] == pytest.approx([1, 2], rel=0.2)
    with pytest.raises(OptionError, match="iterator"):
        solve_many(M, iter(last), "lemke")


def tridiagonal(below: float, diagonal: float, above: float, n: int) -> Any:
    return diags_array([below, diagonal, above], offsets=[-1, 0, 1], shape=(n, n)).tocsr()


@pytest.mark.parametrize("turn", [1, -1], ids=["basic variables last", "basic variables first"])
def test_tridiagonal_m_matrices_are_solved_by_elimination_from_the_end_of_the_basic_variables(turn: int) -> None:
    n = 400
    M, q = tridiagonal(-1.2, 2.5, -1, n), np.linspace(1, -2, n)[::turn]
    if turn < 0:
        M = M.T.tocsr()
    eliminated, alone = Solver(M).solve(q), run(Problem(M, q))
    assert (eliminated.solved, eliminated.route) == (True, ("elimination",))
    assert eliminated.z == pytest.approx(alone.z, rel=1e-12)
    assert eliminated.basis == alone.basis
    scattered = np.cos(np.linspace(0, 20, n))  # basic variables at neither end; then matrices that are no M-matrices
    for below, above in ((-1, -1), (1, 1), (-1, 1), (1, -1)):
        other = Solver(tridiagonal(below, 2.1, above, n)).solve(scattered)
        assert (other.solved, other.route == ("elimination",)) == (True, False)
