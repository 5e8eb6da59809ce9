"""What the library takes as a matrix or a vector: whatever numpy calls array-like; the rest is refused by name."""

from __future__ import annotations

from array import array
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import aslinearoperator

import lcpcli
from lcpcli.errors import LCPError

M, Q = np.array([[2.0, 1], [1, 2]]), np.array([-5.0, -6])
SOLUTION = [4 / 3, 7 / 3]


class Arrayish:
    """An object with __array__, as tensors have."""

    def __init__(self, values: Any) -> None:
        self.values = np.asarray(values)

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        return self.values if dtype is None else self.values.astype(dtype)


class Broken:
    """A tensor that is not in memory, for instance."""

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        raise RuntimeError("in words of its own")


MATRICES = {
    "object with __array__": Arrayish,
    "memoryview": memoryview,
    "list of arrays": list,
    "tuple of array.array": lambda values: tuple(array("d", row) for row in values),
    "list of objects with __array__": lambda values: [Arrayish(row) for row in values],
    "array of objects": lambda values: np.asarray(values, dtype=object),
    "sparse": sparse.coo_array,
}
VECTORS: dict[str, Callable[[Any], Any]] = {
    "object with __array__": Arrayish,
    "memoryview": memoryview,
    "array.array": lambda values: array("d", values),
    "column": lambda values: np.reshape(values, (-1, 1)),
    "row": lambda values: np.reshape(values, (1, -1)),
    "list of arrays without dimensions": lambda values: [np.array(value) for value in values],
    "array of objects": lambda values: np.asarray(values, dtype=object),
    "single precision": lambda values: np.asarray(values, dtype=np.float32),
}


@pytest.mark.parametrize("wrap", MATRICES.values(), ids=MATRICES)
def test_matrices_are_taken_in_any_form(wrap: Callable[[Any], Any]) -> None:
    assert lcpcli.solve(wrap(M), Q).z.round(9).tolist() == np.round(SOLUTION, 9).tolist()
    if wrap is not sparse.coo_array:
        columns = wrap(np.column_stack([Q, 2 * Q]))
        assert [result.solved for result in lcpcli.solve_many(M, columns)] == [True, True]
        assert lcpcli.run(lcpcli.from_game(wrap(M), wrap(M))).solved
    assert lcpcli.run(lcpcli.from_qp(wrap(M), Q, wrap(M), row_upper=9)).solved


@pytest.mark.parametrize("wrap", VECTORS.values(), ids=VECTORS)
def test_vectors_are_taken_in_any_form(wrap: Callable[[Any], Any]) -> None:
    x0, z = -Q / 2, np.array(SOLUTION)
    upper = np.array([1.0, 9.0])
    assert lcpcli.solve(M, wrap(Q), z0=wrap(-Q)).solved
    assert lcpcli.solve(M, wrap(Q), "shi", x0=wrap(x0), x1=wrap(x0 + 1)).solved
    assert lcpcli.solve(M, Q, lower=wrap(0 * Q), upper=wrap(upper)).z.tolist() == [1, 2.5]
    if np.shape(wrap(upper)) != (1, 2):  # one number for each column of a problem of one unknown
        assert [result.solved for result in lcpcli.solve_many(M, np.tile(Q, (5, 1)).T, upper=wrap(upper))] == 5 * [True]
    problem = lcpcli.Problem(M, wrap(Q), solutions=[wrap(z)], x0=wrap(x0), x1=wrap(x0 + 1))
    assert lcpcli.run(problem, "shi").solved
    assert lcpcli.check(problem, wrap(z), tol=1e-6).accepted
    assert lcpcli.run(lcpcli.from_qp(M, wrap(Q), M, row_lower=wrap(Q), row_upper=wrap(-Q))).solved


def test_known_solutions_may_be_the_rows_of_an_array() -> None:
    for solutions in (np.array([SOLUTION]), Arrayish([SOLUTION]), [np.array(SOLUTION)]):
        assert len(lcpcli.Problem(M, Q, solutions=solutions).solutions) == 1
    with pytest.raises(LCPError, match="is a number; give a list of solutions"):
        lcpcli.Problem(M, Q, solutions=7)  # type: ignore[arg-type]


def test_sequences_of_other_types_are_lists() -> None:
    assert lcpcli.solve([range(2, 0, -1), range(1, 3)], range(-2, 0)).solved
    assert lcpcli.solve(M, Q, upper=Arrayish(3)).solved


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: lcpcli.solve(aslinearoperator(M), Q), "M: is of type MatrixLinearOperator, a linear operator; give"),
        (lambda: lcpcli.solve(M, sparse.csr_array([Q])), "q: is sparse; give a dense array, as by toarray()"),
        (lambda: lcpcli.solve(Broken(), Q), "M: is of type Broken, and gives no array; give a list of rows of numbers"),
        (lambda: lcpcli.solve(M, Broken()), "q: is of type Broken, and gives no array; give a list of numbers"),
        (lambda: lcpcli.solve([M[0], M[1][:1]], Q), "M[1]: has 1 entry where M[0] has 2"),
        (lambda: lcpcli.solve([M[:, :1], M[:, 1:]], Q), "M[0]: has 2 dimensions; give a row"),
        (lambda: lcpcli.solve([1, 2], Q), "M[0]: is a number; give a row"),
        (lambda: lcpcli.solve(M, {1.0, 2.0}), "q: is of type set; give a list of numbers"),
        (lambda: lcpcli.solve(M, b"12"), "q: is of type bytes; give a list of numbers"),
        (lambda: lcpcli.solve(M, np.array([None, 1])), "q[0]: is null; give real numbers"),
        (lambda: lcpcli.solve(M, [Decimal("0.1"), 1]), "q[0]: is of type Decimal; give real numbers"),
        (lambda: lcpcli.solve(M, Q, upper=Broken()), "upper: is of type Broken, and gives no array"),
        (lambda: lcpcli.solve_many(M, ["a", "b"]), "Q[0]: is the text 'a'; give real numbers"),
        (lambda: lcpcli.solve_many(M, Arrayish(Q)), "Q: has 1 dimension; give one vector in each column"),
        (lambda: lcpcli.solve_many(M, aslinearoperator(M)), "Q: is of type MatrixLinearOperator, a linear operator"),
        (lambda: lcpcli.solve_many(M, M, upper=[[1], [1, 2]]), "upper[1]: has 2 entries where upper[0] has 1"),
    ],
)
def test_what_is_no_array_is_refused_by_its_field(call: Callable[[], Any], said: str) -> None:
    with pytest.raises(LCPError) as refusal:
        call()
    assert str(refusal.value).startswith(said)


def test_fractions_are_numbers_and_a_solution_of_them_is_verified_exactly() -> None:
    third = Fraction(1, 3)
    problem = lcpcli.Problem([[third, 1], np.array([0, third])], [-third, 0.5], lower=third, upper=[None, Fraction(9)])
    assert problem.M.tolist() == [[1 / 3, 1], [0, 1 / 3]]
    assert problem.q.tolist() == [-1 / 3, 0.5]
    assert problem.box.lower.tolist() == [1 / 3, 1 / 3]
    assert problem.box.upper.tolist() == [np.inf, 9]
    assert lcpcli.Problem(np.array([[third]]), np.array([-third])).q.tolist() == [-1 / 3]
    given = lcpcli.Problem(M, Q)
    exact = [Fraction(4, 3), Fraction(7, 3)]
    found = lcpcli.check(given, exact)
    assert (found.accepted, found.exact) == (True, True)
    assert not lcpcli.check(given, [Fraction(4, 3) + Fraction(1, 10**30), exact[1]])
    assert not lcpcli.check(given, exact, tol=1e-10).exact
    assert lcpcli.check(given, np.array(exact)).exact
    with pytest.raises(LCPError, match="z: has 3 entries for 2 unknowns"):
        lcpcli.check(given, [*exact, third])
    assert lcpcli.check(lcpcli.Problem([[-1]], [-2]), y=[third]).accepted


def test_the_exact_solution_of_an_lcp_and_of_a_program_is_verified_exactly() -> None:
    program = lcpcli.from_qp([[2, 0], [0, 2]], [-3, 1], [[1, 1]], row_lower=1, row_upper=1)
    for problem in (lcpcli.Problem(M, Q), program):
        result = lcpcli.exact(problem)
        found = lcpcli.check(problem, result.exact.z)
        assert (found.accepted, found.exact) == (True, True)
