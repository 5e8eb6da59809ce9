"""The solution that errors are measured against: right to its last digits, and only where there is one to be had."""

from __future__ import annotations

import sys
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import sparse

from lcpcli import Problem, read, run
from lcpcli.files import contents
from lcpcli.linalg.accurate import accurate_residual
from lcpcli.solving import reference
from lcpcli.solving.reference import with_reference
from lcpcli.verify.exact_solution import refined

from .. import exact

EPS = np.finfo(np.float64).eps


def hilbert(n: int) -> np.ndarray:
    return 1 / (np.arange(n)[:, None] + np.arange(n) + 1.0)


@settings(max_examples=50)
@given(arrays(float, (3, 5), elements=st.floats(-1e100, 1e100).map(lambda v: v if abs(v) > 1e-100 else 0.0)))
def test_residual_is_rounded_but_once(numbers: np.ndarray) -> None:
    A, x, b = numbers[:, :3], numbers[:, 3], numbers[:, 4]
    for matrix in (A, sparse.csr_array(A)):
        for computed, row, value in zip(accurate_residual(matrix, x, b), A.tolist(), b.tolist(), strict=True):
            true = Fraction(value) - sum(Fraction(a) * Fraction(v) for a, v in zip(row, x.tolist(), strict=True))
            assert computed == float(true)


def test_residuals_of_many_rows_are_those_of_single_rows() -> None:
    """Sums that cancel, to 0 or to a last digit; rows of equal lengths, and one that is much longer."""
    random = np.random.default_rng(0)
    for most in (6, 300):
        A = sparse.random_array((500, 300), density=0.02, rng=random, format="csr")
        A.data *= 2.0 ** random.integers(-60, 60, A.nnz)
        A = sparse.csr_array(
            A + sparse.csr_array((random.standard_normal(most), (np.full(most, 7), np.arange(most))), shape=A.shape)
        )
        x = random.standard_normal(300)
        b = np.where(random.random(500) < 0.5, A @ x, random.integers(-1, 2, 500))
        single = [accurate_residual(A[[i]], x, b[[i]])[0] for i in range(500)]
        assert np.array_equal(accurate_residual(A, x, b), single)


@pytest.mark.slow("against fractions of many digits")
@pytest.mark.parametrize("n", [4, 8, 11])
def test_ill_conditioned_basis_is_solved_to_the_last_digits(n: int) -> None:
    problem = Problem(hilbert(n), -hilbert(n) @ np.ones(n))
    true = exact.solution(problem)
    z = np.array([float(value) for value in true])
    assert np.abs(refined(problem, run(problem, "auto").z) - z).max() <= 4 * EPS * np.abs(z).max()


def test_reference_is_exact_where_rational_arithmetic_can_be_had(monkeypatch: pytest.MonkeyPatch) -> None:
    known = read(contents.shipped_path("paper-example-2.json"))
    assert (with_reference(known), known.reference) == (known, "known")
    problem = Problem([[3.0, 1.0], [1.0, 3.0]], [-1.0, 2.0])
    exactly = with_reference(problem)
    assert (exactly.reference, exactly.solutions[0].tolist()) == ("exact", [1 / 3, 0.0])
    monkeypatch.setitem(sys.modules, "flint", None)
    assert with_reference(problem).reference == "exact"
    monkeypatch.setattr(reference, "MOST_EXACT_UNKNOWNS", 1)
    assert with_reference(problem).reference == "computed"
    assert with_reference(problem).solutions[0].tolist() == [1 / 3, 0.0]


def test_reference_of_random_problems_solves_them() -> None:
    for seed in range(0, 60, 3):
        problem = exact.random_problem(seed, 5)
        referred = with_reference(problem)
        assert bool(referred.solutions) is (exact.solution(problem) is not None)
        for z in referred.solutions:
            size = np.abs(problem.M) @ z + np.abs(problem.q)
            assert (np.abs(np.minimum(z, problem.w(z))) <= 1e-12 * np.maximum(size, np.abs(z))).all()


def test_sparse_problem_has_the_reference_of_the_dense_one() -> None:
    n = 300
    M = sparse.diags_array([-np.ones(n - 1), 2.001 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
    q = np.random.default_rng(0).standard_normal(n)
    one, other = (with_reference(Problem(matrix, q)).solutions[0] for matrix in (sparse.csr_array(M), M.toarray()))
    assert np.abs(one - other).max() <= 4 * EPS * np.abs(one).max()
