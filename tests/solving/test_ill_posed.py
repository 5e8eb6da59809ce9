"""Problems that rounding of M makes solvable, or infeasible: one verdict for one thing, at every size.

M = J W J' of boxes in a column, crushed between a floor and a ceiling: its rows sum to rounding, and q'e < 0. It is
tridiagonal without a positive entry off the diagonal. So if its exact pivots are positive, it is a P-matrix, and there
is a solution, a huge one; if the last one is not, there is a y > 0 with M'y <= 0, near e, and no solution.
"""

from __future__ import annotations

from fractions import Fraction
from functools import partial

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem, Result, Status
from lcpcli.gallery.families import make
from lcpcli.rational import elimination
from lcpcli.verify.certificate import proves_infeasible, rounded_proof
from lcpcli.verify.ill_posed import is_run_off
from lcpcli.verify.point import Criterion, Point

SIZES = (5, 20, 21, 34)
NEAR = (8, 22)  # that are solved in different ways


def crushed(n: int, seed: int, decades: int = 0) -> Problem:
    """Boxes in a column, n contacts; in units of rows and columns that spread by so many decades."""
    random = np.random.default_rng([n, seed])
    weights, units = random.uniform(0.3, 2.0, n - 1), 10.0 ** random.uniform(-decades / 2, decades / 2, n)
    diagonal = np.append(0.0, weights) + np.append(weights, 0.0)
    M = np.diag(diagonal) - np.diag(weights, 1) - np.diag(weights, -1)
    q = np.zeros(n)
    q[0], q[-1] = -0.0981, -0.9019
    return Problem(units[:, np.newaxis] * M * units, units * q)


def lifted(problem: Problem) -> Problem:
    """The problem with forces that can be balanced."""
    q = problem.q.copy()
    q[len(q) // 2] += 3 * np.abs(q).max() + 3 * abs(problem.M[len(q) // 2, len(q) // 2])
    return Problem(problem.M, q)


def is_solvable(problem: Problem) -> bool:
    """Whether all exact pivots are positive."""
    M = [[Fraction(value) for value in row] for row in problem.M.tolist()]
    pivot = M[0][0]
    for i in range(1, problem.n):
        assert pivot > 0
        pivot = M[i][i] - M[i][i - 1] * M[i - 1][i] / pivot
    return pivot > 0


@pytest.mark.parametrize("n", SIZES)
def test_crushed_boxes_are_ill_posed_or_infeasible_as_exact_arithmetic_says(n: int) -> None:
    for decades in (0, 6):
        assert_ill_posed(lcpcli.run(ill_posed(n, decades)))
        problem = next(each for each in map(partial(crushed, n, decades=decades), range(100)) if not is_solvable(each))
        result = lcpcli.run(problem)
        assert result.status is Status.INFEASIBLE
        assert not result.certificate.is_rounded
        assert proves_infeasible(problem, result.certificate.vector)


def ill_posed(n: int, decades: int = 0) -> Problem:
    return next(problem for problem in map(partial(crushed, n, decades=decades), range(100)) if is_solvable(problem))


def assert_ill_posed(result: Result) -> None:
    """Both facts are told, and nothing else is claimed."""
    assert (result.status.word, result.status.has_no_solution, result.solved) == ("ill_posed", False, False)
    assert result.certificate.is_rounded
    assert rounded_proof(result.problem, result.certificate.vector, few=True) is not None
    assert not Point(Criterion(result.problem), result.z).solves()
    assert is_run_off(result.problem, result.z, result.tol)
    assert result.message.startswith("ill-posed: z ")
    assert "times their sum cancel" in result.message


@pytest.mark.parametrize("n", SIZES)
def test_boxes_that_are_not_crushed_are_solved(n: int) -> None:
    result = lcpcli.run(lifted(crushed(n, 0)))
    assert result.solved
    assert result.point.solves()
    assert lcpcli.run(make("hilbert", n)).solved, "as there is no such proof"


@pytest.mark.parametrize("n", NEAR)
def test_mixed_forms_and_columns_have_the_same_verdict(n: int) -> None:
    plain = ill_posed(n)
    M, q, free = plain.M, plain.q, np.full(n, -np.inf)
    beside = np.zeros((n + 1, n + 1))  # with a free variable, half of the first one
    beside[:n, :n], beside[n, n], beside[n, 0] = M, 2.0, -1.0
    assert_ill_posed(lcpcli.run(Problem(M, q - M @ np.ones(n), lower=1.0)))
    assert_ill_posed(lcpcli.run(Problem(M, -q, lower=free, upper=0.0)))
    assert_ill_posed(lcpcli.run(Problem(beside, np.append(q, 1.0), lower=np.append(np.zeros(n), -np.inf))))
    columns = np.column_stack([q, lifted(plain).q, q])
    words = [result.status.word for result in lcpcli.solve_many(M, columns)]
    assert words == ["ill_posed", "solved", "ill_posed"]
    pytest.importorskip("flint")
    exact = lcpcli.exact(plain)  # of the doubles as they are
    assert (exact.solved, exact.certificate) == (True, None)


def test_program_is_neither_solved_nor_infeasible() -> None:
    problem = ill_posed(8)
    result = lcpcli.run(lcpcli.from_qp(problem.M, problem.q, lower=0))
    assert_ill_posed(result)
    assert (result.word, result.answer.proved) == ("ill_posed", None)
    assert "depends on the rounding of its data" in result.answer.statement


def test_without_exact_arithmetic_a_run_off_takes_the_place_of_the_solution(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(elimination, "library", lambda: None)
    result = lcpcli.run(crushed(60, 0))
    assert_ill_posed(result)
    assert "violates no row by more than 1e-10 of its terms" in result.message


def test_forces_that_nearly_balance_crush_no_boxes() -> None:
    """Their proof but for rounding leaves more than six digits of the sums of its terms."""
    problem = ill_posed(5)
    assert lcpcli.run(Problem(problem.M, [-1.0001, 0.0, 0.0, 0.0, 1.0])).solved
    assert_ill_posed(lcpcli.run(Problem(problem.M, [-1.01, 0.0, 0.0, 0.0, 1.0])))
