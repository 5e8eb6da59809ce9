"""Rows without entries, whose sides are rounding of 0."""

import numpy as np
import pytest
import scipy.sparse as sp

import lcpcli
from lcpcli import Status, from_qp

INF = float("inf")
Q, C = 2 * np.eye(2), [-2.0, -4.0]
METHODS = ("auto", "lemke", "interior", "milp")


def program(side, kind="upper", sparse=False):
    """min x1^2 + x2^2 - 2 x1 - 4 x2 with x1 + x2 <= 2, and a row without entries."""
    A = np.array([[1.0, 1.0], [0.0, 0.0]])
    sides = {
        "upper": ([-INF, -INF], [2.0, -side]),
        "lower": ([-INF, side], [2.0, INF]),
        "equation": ([2.0, side], [2.0, side]),
        "range": ([-1.0, side], [2.0, 1.0]),
    }
    low, high = sides[kind]
    A, P = (sp.csr_array(A), sp.csr_array(Q)) if sparse else (A, Q)
    return from_qp(P, C, A, row_lower=low, row_upper=high)


@pytest.mark.parametrize("kind", ["upper", "lower", "equation", "range"])
@pytest.mark.parametrize("sparse", [False, True])
def test_a_side_of_rounding_is_solved_and_named(kind, sparse):
    problem = program(7e-18, kind, sparse)
    for method in METHODS:
        result = lcpcli.run(problem, method)
        assert result.solved, method
        assert np.allclose(result.z[:2], [0.5, 1.5], atol=1e-9)
        assert "with the numbers as stored, row 2 (empty, side" in result.message
        assert "has no solution" in result.message
    found = lcpcli.check(problem, result.z)
    assert found.accepted
    assert "with the numbers as stored, row 2" in found.message


@pytest.mark.parametrize("kind", ["upper", "lower", "equation", "range"])
def test_a_larger_side_is_infeasible(kind):
    problem = program(1e-6, kind)
    assert problem.rounded_rows is None
    for method in ("auto", "interior", "milp"):
        assert not lcpcli.run(problem, method).solved
    result = lcpcli.run(problem)
    assert result.status is Status.INFEASIBLE
    z = lcpcli.run(program(7e-18, kind)).z
    assert not lcpcli.check(problem, z).accepted


def test_exact_arithmetic_takes_the_numbers_as_they_stand():
    problem = program(7e-18)
    assert lcpcli.exact(problem).status is Status.INFEASIBLE


def test_rows_that_have_no_other_answer_have_a_proof_of_that():
    """x1 + x2 <= 2 and >= 3 beside a row of rounding: those two prove it."""
    A, low = [[1.0, 1.0], [1.0, 1.0], [0.0, 0.0]], [-INF, 3.0, 1e-17]
    problem = from_qp(Q, C, A, row_lower=low, row_upper=[2.0, INF, INF])
    result = lcpcli.run(problem)
    assert result.status is Status.INFEASIBLE
    y = result.certificate.vector
    assert lcpcli.check(problem, y=y).accepted
    assert y[2:4].all()
    assert not y[4]


def test_sizes_are_those_of_other_rows_of_the_kind():
    def rows(sides, others):
        A = np.zeros((len(sides), 2))
        A[:others] = 1.0
        return from_qp(Q, C, A, row_lower=sides)

    assert rows([1.0, 1.0, 1.0, 9e-16], 3).rounded_rows is not None
    assert rows([1.0, 1.0, 1.0, 1.1e-15], 3).rounded_rows is None
    # The median of those that are not 0, if there are three; else all have to have one.
    assert rows([1.0, 0.0, 1.0, 1.0, 9e-16], 4).rounded_rows is not None
    assert rows([1.0, 0.0, 9e-16], 2).rounded_rows is None
    assert rows([1.0, 9e-16], 1).rounded_rows is not None
    assert rows([1e-17], 0).rounded_rows is None
    # Sums of numbers of size 1 leave no 1e-33.
    assert rows([1.0, 1.0, 1.0, 1e-31], 3).rounded_rows is not None
    assert rows([1.0, 1.0, 1.0, 1e-33], 3).rounded_rows is None
    # A few large ones make no rounding of others.
    assert rows([1e9, 1e-9, 1e-9, 1e9, 1e-9, 1e-17], 5).rounded_rows is None
    # Equations are of another kind.
    A = [[1.0, 1.0], [0.0, 0.0]]
    sides = {"row_lower": [1.0, 9e-16], "row_upper": [1.0, INF]}
    assert from_qp(Q, C, A, **sides).rounded_rows is None
    # A row that has a solution all the same.
    assert rows([1.0, -1e-17], 1).rounded_rows is None


def test_rows_of_any_problem_may_be_rounding():
    M = np.array([[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 0.0]])
    result = lcpcli.solve(M, [-5.0, -6.0, -1e-17])
    assert result.solved
    assert np.allclose(result.z[:2], [4 / 3, 7 / 3])
    assert result.negligible_q == [2]
    assert "row 3 (empty, side 1e-17)" in result.message
    assert lcpcli.solve(M, [-5.0, -6.0, -1e-6]).status is Status.INFEASIBLE
