"""A problem takes matrices and vectors of any kind, leaves them alone, and refuses what is none by name."""

from __future__ import annotations

import sys
from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from scipy import sparse

from lcpcli import Problem, run
from lcpcli.errors import ProblemError
from lcpcli.linalg.matrices import is_sparse

from ..small_problem import M, Q, numbers

LARGEST = sys.float_info.max


ARRAYS = {
    "lists": M,
    "tuples": tuple(tuple(row) for row in M),
    "lists-of-numpy-numbers": [[np.float64(2), np.int64(-1)], [np.float32(-0.5), np.uint8(2)]],
    "float64": np.array(M),
    "float32": np.array(M, dtype=np.float32),
    "float16": np.array(M, dtype=np.float16),
    "longdouble": np.array(M, dtype=np.longdouble),
    "big-endian": np.array(M, dtype=">f8"),
    "columns-first": np.array(M, order="F"),
    "slice": np.kron(M, np.ones((2, 3)))[::2, ::3],
    "matrix-of-numpy": np.asmatrix(M),
    "csr-matrix": sparse.csr_matrix(M),
    **{kind: sparse.coo_array(M).asformat(kind) for kind in ("csr", "csc", "coo", "lil", "dok", "dia", "bsr")},
    "coo-with-duplicates": sparse.coo_array(
        ([1.0, 1.0, -1.0, -0.5, 5.0, -3.0], ([0, 0, 0, 1, 1, 1], [0, 0, 1, 0, 1, 1])), shape=(2, 2)
    ),
    "csr-with-duplicates": sparse.csr_array(([1.0, -1.0, 1.0, 2.0, -0.5], [0, 1, 0, 1, 0], [0, 3, 5]), shape=(2, 2)),
    "csc-with-duplicates": sparse.csc_array(([-0.5, 1.0, 1.0, 2.0, -1.0], [1, 0, 0, 1, 0], [0, 3, 5]), shape=(2, 2)),
    "csr-not-in-order": sparse.csr_array(([-1.0, 2.0, 2.0, -0.5], [1, 0, 1, 0], [0, 2, 4]), shape=(2, 2)),
}


def parts(matrix: Any) -> list[Any]:
    """The memory of a matrix, copied, and what kind of matrix it is."""
    if not is_sparse(matrix):
        return [type(matrix), np.array(matrix).tolist()]
    arrays = [getattr(matrix, name, None) for name in ("data", "row", "col", "indices", "indptr", "rows", "offsets")]
    held = deepcopy([array.tolist() for array in arrays if isinstance(array, np.ndarray)])
    return [type(matrix), matrix.nnz, matrix.toarray().tolist(), *held]


@pytest.mark.parametrize("matrix", ARRAYS.values(), ids=ARRAYS)
def test_a_matrix_of_any_kind_is_taken_with_the_right_values_and_left_alone(matrix: Any) -> None:
    before = parts(matrix)
    problem = Problem(matrix, Q)
    assert numbers(problem) == (M, Q)
    assert problem.M.dtype == np.float64
    assert is_sparse(problem.M) == is_sparse(matrix)
    assert not is_sparse(matrix) or problem.M.has_canonical_format
    for method in ("shi", "fixed-point"):
        assert run(problem, method).solved
    assert parts(matrix) == before


def test_integers_become_floats_and_single_precision_is_taken_as_it_is() -> None:
    problem = Problem(np.array([[2, 1], [-3, 2]]), np.array([-1, 1], dtype=np.int8), x0=np.array([7, 8], np.uint8))
    assert numbers(problem) == ([[2, 1], [-3, 2]], [-1, 1])
    assert {v.dtype for v in (problem.M, problem.q, problem.x0) if v is not None} == {np.dtype(float)}
    tenth = np.float32(0.1)
    assert numbers(Problem(np.array([[tenth]]), np.array([tenth]))) == ([[float(tenth)]], [float(tenth)])


OTHER_THAN_REAL = {
    "complex": np.array([[2, 0], [0, 2]], dtype=complex),
    "bool": np.array([[True, False], [False, True]]),
    "str": np.array([["2", "0"], ["0", "2"]]),
    "bytes": np.array([[b"2", b"0"], [b"0", b"2"]]),
    "datetime64": np.array([["2004-07-01", "2012-02-01"]] * 2, dtype="datetime64[D]"),
}


@pytest.mark.parametrize("kind", OTHER_THAN_REAL)
def test_other_than_real_numbers_are_refused_by_name(kind: str) -> None:
    matrix = OTHER_THAN_REAL[kind]
    given = {"M": {"M": matrix}, "solution": {"solutions": [matrix[0]]}}
    given |= {name: {name: matrix[0]} for name in ("q", "x0", "x1")}
    sparse_one = [("M", {"M": sparse.csr_array(matrix)})] if kind in ("complex", "bool") else []
    for field, own in [*given.items(), *sparse_one]:
        with pytest.raises(ProblemError, match=rf"^{field}: .*{kind}.*; give real numbers"):
            Problem(**{"M": M, "q": Q} | own)


@pytest.mark.parametrize(
    ("matrix", "place"),
    [
        (np.array([[2, 0], [0, np.nan]]), "M[1][1]: "),
        (sparse.csr_array([[2, 0], [0, np.nan]]), "M[1][1]: "),
        (sparse.coo_array(([LARGEST, LARGEST], ([1, 1], [0, 0])), shape=(2, 2)), "M[1][0]: "),
        (np.ones((2, 3)), "M: is 2 x 3"),
        (sparse.csc_array(np.ones((3, 3))), "M: is 3 x 3"),
        (np.ones(2), "M: has 1 dimension; "),
        (np.ones((2, 2, 2)), "M: has 3 dimensions; "),
        ([[10**400, 0], [0, 1]], "M: contains a number beyond"),
        ([[True, 0], [0, 1]], "M[0][0]: is true"),
        ([[1, 0], [np.False_, 1]], "M[1][0]: is false"),
        ({"a": 1}, "M: is an object"),
    ],
)
def test_a_matrix_that_does_not_fit_is_refused_at_its_place(matrix: Any, place: str) -> None:
    with pytest.raises(ProblemError) as refusal:
        Problem(matrix, Q)
    assert str(refusal.value).startswith(place)


def test_q_that_is_no_flat_list_is_refused_by_name() -> None:
    for q in (np.ones((2, 2)), np.float64(1), iter(Q), "12", None):
        with pytest.raises(ProblemError, match=r"^q: .*; give a .*list of numbers"):
            Problem(M, q)


@pytest.mark.parametrize(("entry", "order"), [(np.nan, "C"), (np.inf, "F"), (-np.inf, "C")])
def test_a_number_that_is_not_finite_is_found_in_a_large_matrix(entry: float, order: Any) -> None:
    M = np.eye(150, order=order)
    M[7, 33] = entry
    with pytest.raises(ProblemError, match=r"M\[7\]\[33\]"):
        Problem(M, np.ones(150))


@pytest.mark.parametrize("diagonal", [1.0, 0.0, 1e-70])
def test_the_sizes_of_a_large_matrix_are_those_of_its_rows(diagonal: float) -> None:
    M = np.random.default_rng(0).standard_normal((150, 150))
    np.fill_diagonal(M, diagonal)
    M[3, 5] = -77.0
    problem = Problem(M, np.ones(150))
    assert problem.largest == 77.0
    assert problem.is_moderate
    assert np.array_equal(problem.row_maxima, np.abs(M).max(axis=1))
    assert not Problem(1e-70 * M, np.ones(150)).is_moderate
    assert not Problem(1e70 * M, np.ones(150)).is_moderate
