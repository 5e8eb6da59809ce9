"""A problem takes matrices and vectors of any kind, whatever numpy calls array-like,
leaves them alone, keeps the numbers that it was given whatever happens to the arrays
afterwards, and refuses what is none by name."""

from array import array
from copy import deepcopy
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy import sparse

import lcpcli
from lcpcli import Problem, check, run, solve, solve_many
from lcpcli.errors import ProblemError
from lcpcli.linalg.matrices import is_sparse
from lcpcli.methods.direct import as_dense
from lcpcli.model.box import BASIC, LOWER, ORTHANT, UPPER, Box
from lcpcli.model.changes import scale
from lcpcli.model.right_hand_sides import like_with

from ..conftest import M, Q, numbers


class Arrayish:
    """An object with __array__, as tensors have."""

    def __init__(self, values):
        self.values = np.asarray(values)

    def __array__(self, dtype=None, copy=None):
        return self.values if dtype is None else self.values.astype(dtype)


ARRAYS = {
    "lists": M,
    "object with __array__": Arrayish(M),
    "memoryview": memoryview(np.array(M)),
    "tuple of array.array": tuple(array("d", row) for row in M),
    "array of objects": np.array(M, dtype=object),
    "lists-of-numpy-numbers": [
        [np.float64(2), np.int64(-1)],
        [np.float32(-0.5), np.uint8(2)],
    ],
    "float64": np.array(M),
    "float32": np.array(M, dtype=np.float32),
    "longdouble": np.array(M, dtype=np.longdouble),
    "big-endian": np.array(M, dtype=">f8"),
    "columns-first": np.array(M, order="F"),
    "slice": np.kron(M, np.ones((2, 3)))[::2, ::3],
    "matrix-of-numpy": np.array(M).view(np.matrix),
    "csr-matrix": sparse.csr_matrix(M),
    **{
        kind: sparse.coo_array(M).asformat(kind)
        for kind in ("csr", "csc", "coo", "lil", "dok", "dia", "bsr")
    },
    "csr-with-duplicates": sparse.csr_array(
        ([1.0, -1.0, 1.0, 2.0, -0.5], [0, 1, 0, 1, 0], [0, 3, 5]), shape=(2, 2)
    ),
    "csc-with-duplicates": sparse.csc_array(
        ([-0.5, 1.0, 1.0, 2.0, -1.0], [1, 0, 0, 1, 0], [0, 3, 5]), shape=(2, 2)
    ),
    "csr-not-in-order": sparse.csr_array(
        ([-1.0, 2.0, 2.0, -0.5], [1, 0, 1, 0], [0, 2, 4]), shape=(2, 2)
    ),
}


def parts(matrix):
    """The memory of a matrix, copied, and what kind of matrix it is."""
    if not is_sparse(matrix):
        rows = matrix if isinstance(matrix, (list, tuple)) else np.array(matrix)
        return [type(matrix), [np.array(row).tolist() for row in rows]]
    arrays = [
        getattr(matrix, name, None)
        for name in ("data", "row", "col", "indices", "indptr", "rows", "offsets")
    ]
    held = deepcopy(
        [array.tolist() for array in arrays if isinstance(array, np.ndarray)]
    )
    return [type(matrix), matrix.nnz, matrix.toarray().tolist(), *held]


@pytest.mark.parametrize("matrix", ARRAYS.values(), ids=ARRAYS)
def test_a_matrix_of_any_kind_is_taken_with_the_right_values_and_left_alone(matrix):
    before = parts(matrix)
    problem = Problem(matrix, Q)
    assert numbers(problem) == (M, Q)
    assert problem.M.dtype == np.float64
    assert is_sparse(problem.M) == is_sparse(matrix)
    assert not is_sparse(matrix) or problem.M.has_canonical_format
    for method in ("shi", "fixed-point"):
        assert run(problem, method).solved
    assert run(lcpcli.from_qp(None, [1, 1], matrix, row_upper=9, lower=0)).solved
    if not is_sparse(matrix):
        assert all(result.solved for result in lcpcli.solve_many(M, matrix))
        assert run(lcpcli.from_game(matrix, matrix)).solved
    assert parts(matrix) == before


A, B = np.array([[2.0, 1], [1, 2]]), np.array([-5.0, -6])
SOLUTION = [4 / 3, 7 / 3]


VECTORS = {
    "object with __array__": Arrayish,
    "array.array": lambda values: array("d", values),
    "column": lambda values: np.reshape(values, (-1, 1)),
    "row": lambda values: np.reshape(values, (1, -1)),
    "list of arrays without dimensions": lambda values: [
        np.array(value) for value in values
    ],
    "array of objects": lambda values: np.asarray(values, dtype=object),
    "single precision": lambda values: np.asarray(values, dtype=np.float32),
}


@pytest.mark.parametrize("wrap", VECTORS.values(), ids=VECTORS)
def test_vectors_are_taken_in_any_form(wrap):
    x0, z = -B / 2, np.array(SOLUTION)
    upper = np.array([1.0, 9.0])
    assert lcpcli.solve(A, wrap(B), z0=wrap(-B)).solved
    assert lcpcli.solve(A, wrap(B), "shi", x0=wrap(x0), x1=wrap(x0 + 1)).solved
    bounded = lcpcli.solve(A, B, lower=wrap(0 * B), upper=wrap(upper))
    assert bounded.z.tolist() == [1, 2.5]
    # One number for each column of a problem of one unknown.
    if np.shape(wrap(upper)) != (1, 2):
        results = lcpcli.solve_many(A, np.tile(B, (5, 1)).T, upper=wrap(upper))
        assert all(result.solved for result in results)
    problem = lcpcli.Problem(
        A, wrap(B), solutions=[wrap(z)], x0=wrap(x0), x1=wrap(x0 + 1)
    )
    assert lcpcli.run(problem, "shi").solved
    assert check(problem, wrap(z), tol=1e-6).accepted
    assert lcpcli.run(
        lcpcli.from_qp(A, wrap(B), A, row_lower=wrap(B), row_upper=wrap(-B))
    ).solved


def test_sequences_of_other_types_are_lists():
    assert lcpcli.solve([range(2, 0, -1), range(1, 3)], range(-2, 0)).solved
    assert lcpcli.solve(A, B, upper=Arrayish(3)).solved


def test_fractions_are_numbers_and_a_solution_of_them_is_verified_exactly():
    third = Fraction(1, 3)
    problem = lcpcli.Problem(
        [[third, 1], np.array([0, third])],
        [-third, 0.5],
        lower=third,
        upper=[None, Fraction(9)],
    )
    assert problem.M.tolist() == [[1 / 3, 1], [0, 1 / 3]]
    assert problem.q.tolist() == [-1 / 3, 0.5]
    assert problem.box.lower.tolist() == [1 / 3, 1 / 3]
    assert problem.box.upper.tolist() == [np.inf, 9]
    given = lcpcli.Problem(A, B)
    exact = [Fraction(4, 3), Fraction(7, 3)]
    found = check(given, exact)
    assert found.accepted
    assert found.exact
    assert not check(given, [Fraction(4, 3) + Fraction(1, 10**30), exact[1]])
    assert not check(given, exact, tol=1e-10).exact
    assert check(given, np.array(exact)).exact
    assert check(lcpcli.Problem([[-1]], [-2]), y=[third]).accepted


def test_one_row_of_constraints_may_be_a_list_of_numbers():
    for name, side in (("G", "h"), ("A", "b")):
        found = lcpcli.solve_qp(np.eye(2), [0, 0], **{name: [-1.0, -1.0], side: [-1.0]})
        assert found.tolist() == pytest.approx([0.5, 0.5])


FORMS = {
    "dense": np.array,
    "columns first": np.asfortranarray,
    "csr": sparse.csr_array,
    "csr matrix": sparse.csr_matrix,
    "csc": sparse.csc_array,
}


@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)
def test_no_array_that_changes_later_changes_a_problem_or_a_result(form):
    matrix, q, lower, x0 = form(A), B.copy(), np.array([0.0, -1.0]), np.ones(2)
    known = np.array(SOLUTION)
    problem = Problem(matrix, q, x0=x0, solutions=[known], lower=lower)
    result = lcpcli.solve(matrix, q, lower=lower, x0=x0)
    for held in (matrix.data if is_sparse(matrix) else matrix, q, lower, x0, known):
        held[...] = np.nan
    for kept in (problem, result.problem):
        assert (kept.M @ np.eye(2)).tolist() == A.tolist()
        assert kept.q.tolist() == B.tolist()
        assert np.asarray(kept.lower).tolist() == [0.0, -1.0]
    assert problem.x0.tolist() == [1.0, 1.0]
    assert problem.solutions[0].tolist() == SOLUTION
    assert check(result.problem, result.z).residual == result.residual < 1e-14


def test_arrays_that_are_kept_are_read_only_and_copied_once():
    view = A.view()
    view.setflags(write=False)
    problem = Problem(view, B)
    assert not np.shares_memory(problem.M, A), "it may be changed by its other name"
    for held in (problem.M, problem.q):
        with pytest.raises(ValueError, match="read-only"):
            held[0] = 1.0
    other = replace(problem, name="other")
    assert other.M is problem.M
    assert other.q is problem.q


def test_an_array_that_nobody_can_change_is_not_copied():
    matrix = A.copy()
    matrix.setflags(write=False)
    assert np.shares_memory(Problem(matrix, B).M, matrix)


@pytest.mark.parametrize(
    ("form", "order"), [(np.array, "C"), (np.array, "F"), (sparse.csr_array, "C")]
)
def test_results_of_many_columns_hold_for_what_was_solved(form, order):
    n, k = 250, 100  # sparse ones of that size are solved one after another
    matrix, columns = form(2 * np.eye(n)), np.full((n, k), -4.0, order=order)
    results = lcpcli.solve_many(matrix, columns)
    first = next(results)
    columns[:, 90:] = -8.0
    if not is_sparse(matrix):
        matrix[...] = 0.0
    rest = list(results)
    columns[...] = np.nan
    for result in (first, *rest[::9]):
        assert result.solved
        assert 2 * result.z == pytest.approx(-result.problem.q)
        assert result.residual < 1e-12
    assert rest[-1].z == pytest.approx(4.0)


def test_numbers_and_bounds_that_have_changed_since_the_call_are_checked_again():
    for name, value, told in (
        (
            "Q",
            np.nan,
            r"Q\[1\]\[80\]: has ceased to be a finite number since the call.*copy",
        ),
        ("upper", -1.0, r"column 80: lower\[1\]: is 0, above upper\[1\] = -1"),
    ):
        given = {"Q": np.full((2, 100), -4.0), "upper": np.full((2, 100), 1.0)}
        results = lcpcli.solve_many(A, **given)
        next(results)
        given[name][1, 80] = value
        with pytest.raises(ProblemError, match=told):
            list(results)


@pytest.mark.parametrize("n", [40, 160])
def test_a_dense_form_of_a_sparse_problem_has_what_is_computed_of_either(n):
    M = sparse.diags_array(
        [np.full(n - 1, -1.0), np.arange(1.0, n + 1)], offsets=[1, 0]
    )
    problem = Problem(M.tocsr(), -np.ones(n), lower=1.0, upper=2.0)
    dense = as_dense(problem)
    assert dense.q_ref is problem.q_ref
    assert dense.reference_z is problem.reference_z
    assert dense.units is problem.units
    assert dense.units.rows.tolist() == problem.anew().units.rows.tolist()


@pytest.mark.parametrize("side", ["lower", "upper"])
def test_scaling_in_which_a_bound_underflows_is_not_exact(side):
    least = 3 * 5e-324
    bounds = {"lower": -1.0, "upper": 1.0, side: np.array([least, 1.0])}
    bounds = bounds | ({"lower": 0.0} if side == "upper" else {"upper": 2.0})
    small = Problem([[1e-100, 0.0], [0.0, 1.0]], [-1.0, -1.0], **bounds)
    assert not scale(small).is_exact
    large = Problem([[1e100, 0.0], [0.0, 1.0]], [-1.0, -1.0], **bounds)
    assert scale(large).is_exact


@pytest.mark.parametrize("size", [1e-300, 1e-100, 0.0, 1.0, 1e100, 1e300])
def test_a_problem_with_the_matrix_of_another_one_says_what_a_new_one_does(size):
    q = np.array([-size, 1.0])
    known = Problem(np.eye(2), [1, 1], solutions=[[0, 0]])
    like, new = like_with(known, q, ORTHANT), Problem(np.eye(2), q)
    assert like.facts is known.facts
    assert like.solutions == ()
    for name in ("is_moderate", "sizes_of_q", "reference_z", "q_error"):
        assert getattr(like, name) == getattr(new, name)


def test_a_fixed_variable_is_at_its_lower_bound_whatever_the_sign_of_its_w():
    for q in (-1.0, 1.0):
        problem = Problem(np.eye(2), [q, -1], lower=[3, 0], upper=[3, 5])
        result = run(problem)
        assert result.basis == ["lower", "basic"]
        assert problem.box.basis_at(result.z, result.w).tolist() == [LOWER, BASIC]


def test_signs_and_statuses_at_bounds():
    box = Box(np.zeros(4), np.ones(4))
    at = np.array([LOWER, UPPER, UPPER, BASIC], np.int8)
    x = box.x_within(np.array([0.0, 1, 1, 2]), np.array([2.0, -2, 2, 0]), at)
    assert x.tolist() == [-1, 1.5, 0.5, 0.5]  # z beyond its bound, w of the wrong sign
    basis = np.array([BASIC, BASIC, BASIC, UPPER], np.int8)
    violated = np.array([True, True, False, False])
    found = box.exchanged(basis, violated, np.array([-1.0, 2, 0.5, 1]))
    assert found.tolist() == [LOWER, UPPER, BASIC, UPPER]
    below = Box(np.full(2, -np.inf), np.zeros(2))
    assert below.as_multipliers(np.array([-1.0, 1])).tolist() == [-1, 0]


def test_lower_bounds_of_which_some_are_0_are_kept_for_many_vectors():
    Qs = np.array([[-4.0, 3, -1], [1, 4, 2]])
    lower = [1, 0]
    together = solve_many(M, Qs, method="newton", lower=lower)
    for q, result in zip(Qs.T, together, strict=True):
        assert result.z == pytest.approx(solve(M, q, lower=lower).z)


def test_fractions_beyond_the_range_of_doubles_are_checked():
    problem = lcpcli.Problem([[2.0**-1000]], [-(2.0**1000)])
    assert check(problem, [Fraction(2**2000)]).accepted
    assert not check(problem, [Fraction(2**2000 - 1)]).accepted
    separate = lcpcli.Problem([[1, 0], [0, 1]], [1, -1])
    assert not check(separate, [Fraction(1, 10**400), 1]).accepted
    without_solution = lcpcli.Problem([[-1]], [-2])
    assert check(without_solution, y=[Fraction(10**400)]).accepted
    with pytest.raises(ProblemError):
        check(separate, [Fraction(1)])
