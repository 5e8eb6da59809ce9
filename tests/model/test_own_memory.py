"""A problem keeps the numbers that it was given, whatever happens to the arrays afterwards; so do its results."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import sparse

import lcpcli
from lcpcli import Problem
from lcpcli.errors import ProblemError
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.box import ORTHANT
from lcpcli.model.right_hand_sides import Columns, like_with

M, Q = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-5.0, -6.0])
Z = [4 / 3, 7 / 3]
FORMS: dict[str, Callable[[Any], Any]] = {
    "dense": np.array,
    "columns first": np.asfortranarray,
    "csr": sparse.csr_array,
    "csr matrix": sparse.csr_matrix,
    "csc": sparse.csc_array,
}


@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)
def test_no_array_that_changes_later_changes_a_problem_or_a_result(form: Callable[[Any], Any]) -> None:
    matrix, q, lower, x0 = form(M), Q.copy(), np.array([0.0, -1.0]), np.ones(2)
    known = np.array(Z)
    problem = Problem(matrix, q, x0=x0, solutions=[known], lower=lower)
    result = lcpcli.solve(matrix, q, lower=lower, x0=x0)
    for array in (matrix.data if is_sparse(matrix) else matrix, q, lower, x0, known):
        array[...] = np.nan
    for kept in (problem, result.problem):
        assert (kept.M @ np.eye(2)).tolist() == M.tolist()
        assert (kept.q.tolist(), np.asarray(kept.lower).tolist()) == (Q.tolist(), [0.0, -1.0])
    assert (problem.x0.tolist(), problem.solutions[0].tolist()) == ([1.0, 1.0], Z)
    assert lcpcli.check(result.problem, result.z).residual == result.residual < 1e-14


def test_arrays_that_are_kept_are_read_only_and_copied_once() -> None:
    view = M.view()
    view.setflags(write=False)
    problem = Problem(view, Q)
    assert not np.shares_memory(problem.M, M), "it may be changed by its other name"
    for array in (problem.M, problem.q):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    other = replace(problem, name="other")
    assert other.M is problem.M
    assert other.q is problem.q


def test_an_array_that_nobody_can_change_is_not_copied() -> None:
    matrix = M.copy()
    matrix.setflags(write=False)
    assert np.shares_memory(Problem(matrix, Q).M, matrix)


def test_arrays_of_results_are_the_users_to_change() -> None:
    for q in (Q, -Q):
        result = lcpcli.solve(M, q)
        result.z[0] = result.w[0] = 1.0


@pytest.mark.parametrize(("form", "order"), [(np.array, "C"), (np.array, "F"), (sparse.csr_array, "C")])
def test_results_of_many_columns_hold_for_what_was_solved(form: Callable[[Any], Any], order: Any) -> None:
    n, k = 250, 100  # sparse ones of that size are solved one after another
    matrix, columns = form(2 * np.eye(n)), np.full((n, k), -4.0, order=order)
    results = lcpcli.solve_many(matrix, columns)
    first = next(results)
    columns[:, 90:] = -8.0
    if not is_sparse(matrix):
        matrix[...] = 0.0
    rest = list(results)
    columns[...] = np.nan
    for result in (first, *rest):
        assert result.solved
        assert 2 * result.z == pytest.approx(-result.problem.q)
        assert result.residual < 1e-12
    assert rest[-1].z == pytest.approx(4.0)


def test_numbers_and_bounds_that_have_changed_since_the_call_are_checked_again() -> None:
    for name, value, told in (
        ("Q", np.nan, r"Q\[1\]\[80\]: has ceased to be a finite number since the call.*copy"),
        ("upper", -1.0, r"column 80: lower\[1\]: is 0, above upper\[1\] = -1"),
    ):
        given = {"Q": np.full((2, 100), -4.0), "upper": np.full((2, 100), 1.0)}
        results = lcpcli.solve_many(M, **given)
        next(results)
        given[name][1, 80] = value
        with pytest.raises(ProblemError, match=told):
            list(results)


def _known() -> Problem:
    problem = Problem([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0], names=("a", "b"), solutions=[[4 / 3, 7 / 3]])
    assert problem.row_maxima.tolist() == [2.0, 2.0]
    return problem.knowing(units=problem.units, a_new_property_of_q=problem.q.sum())


def test_what_is_not_known_to_depend_on_M_alone_is_dropped() -> None:
    other = like_with(_known(), np.array([1.0, -1.0]), ORTHANT)
    assert "a_new_property_of_q" not in vars(other)
    assert other.solutions == ()
    assert other.verdict == ""
    assert other.q_ref.tolist() == [1.0, -1.0]


def test_the_problems_of_a_block_know_of_M_and_not_of_q() -> None:
    columns = Columns([[2.0, 1.0], [1.0, 2.0]], [[-5.0, 1.0], [-6.0, -1.0]], 0.0, np.inf)
    columns.like.knowing(units=columns.like.units, a_new_property_of_q=0.0)
    first, second = columns.problems()
    assert first.units is second.units is columns.like.units
    assert "a_new_property_of_q" not in vars(first)
    assert (first.q.tolist(), second.q.tolist()) == ([-5.0, -6.0], [1.0, -1.0])
