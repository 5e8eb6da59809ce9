"""The fixed point iteration converges linearly, at the rate that theory gives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import sparse

from lcpcli import Problem, Trace
from lcpcli.inspection.theory import contraction, empirical_rate
from lcpcli.model.box import ORTHANT
from lcpcli.options import Limits
from lcpcli.solving.driver import run
from lcpcli.solving.reference import with_reference


def random_problem(seed: int, n: int, symmetric: bool) -> Problem:
    random = np.random.default_rng(seed)
    A, S = random.standard_normal((2, n, n)) / np.sqrt(n)
    M = A @ A.T + 0.1 * np.eye(n)
    return with_reference(Problem(M if symmetric else M + S - S.T, random.standard_normal(n)))


@pytest.mark.parametrize("n", [5, 20, 100])
@pytest.mark.parametrize("symmetric", [True, False])
def test_measured_rate_is_the_local_one_and_below_the_bound(n: int, symmetric: bool) -> None:
    problem = random_problem(n, n, symmetric)
    z = problem.solutions[0]
    theory = contraction(problem, ORTHANT.x_of(z, problem.w(z)))
    assert theory is not None
    assert theory.local is not None
    curve = Trace(components=np.empty(0, dtype=np.intp), residuals=False)
    run(problem, "fixed-point", limits=Limits(tol=1e-14), curve=curve)
    errors = [row.error or 0.0 for row in curve.rows]
    rate = empirical_rate([row.k for row in curve.rows], errors, 1e-2, 1e-12)
    assert rate is not None
    assert rate == pytest.approx(theory.local, rel=0.1)
    assert rate <= theory.bound
    assert theory.local <= theory.bound


def test_bound_of_a_symmetric_matrix_is_that_of_its_eigenvalues() -> None:
    eigenvalues = np.array([0.2, 1.0, 9.0])
    Q = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    M = Q @ np.diag(eigenvalues) @ Q.T
    for omega in (1.0, 1.5):
        theory = contraction(Problem(sparse.csr_array(M), np.ones(3)), np.ones(3), omega)
        assert theory is not None
        assert theory.bound == pytest.approx(np.abs((omega - eigenvalues) / (omega + eigenvalues)).max())


def test_degenerate_solution_has_no_local_rate() -> None:
    theory = contraction(Problem(np.eye(2), [-1.0, 0.0]), np.array([0.5, 0.0]))
    assert theory is not None
    assert theory.local is None


def test_singular_iteration_has_no_rate() -> None:
    assert contraction(Problem([[-1.0]], [1.0]), np.ones(1)) is None


@given(st.floats(0.1, 0.95), st.floats(1e-3, 1e3))
def test_rate_of_a_geometric_sequence_is_its_ratio(ratio: float, first: float) -> None:
    k = list(range(200))
    rate = empirical_rate(k, [first * ratio**i for i in k], 1e-2 * first, 1e-12 * first)
    assert rate == pytest.approx(ratio)


def test_rate_is_not_taken_from_a_few_iterates() -> None:
    assert empirical_rate([0, 1, 2], [1.0, 0.1, 0.01], 1.0, 0.0) is None
