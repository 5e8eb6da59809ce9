"""The fixed point iteration converges linearly, at the rate that theory gives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import sparse

from lcpcli import Problem, Trace
from lcpcli.model.box import ORTHANT
from lcpcli.options import Limits
from lcpcli.solving.driver import run
from lcpcli.solving.reference import with_reference

from ..benchmarks.accuracy import contraction, empirical_rate


def random_problem(n: int, kind: str) -> Problem:
    random = np.random.default_rng(n)
    A, S = random.standard_normal((2, n, n)) / np.sqrt(n)
    M, q = A @ A.T + 0.1 * np.eye(n), random.standard_normal(n)
    if kind == "bounded":
        lower, upper = np.where(np.arange(n) % 3, -0.3, -np.inf), np.where(np.arange(n) % 4, 0.4, np.inf)
        return with_reference(Problem(M, q, lower=lower, upper=upper))
    return with_reference(Problem(M if kind == "symmetric" else M + S - S.T, q))


@pytest.mark.parametrize(
    ("n", "kind"), [(5, "symmetric"), (100, "symmetric"), (5, "other"), (100, "other"), (20, "bounded")]
)
def test_measured_rate_is_the_local_one_and_below_the_bound(n: int, kind: str) -> None:
    problem = random_problem(n, kind)
    z, box = problem.solutions[0], problem.box if problem.is_mixed else ORTHANT
    x = box.x_of(z, problem.w(z))
    theory = contraction(problem, x)
    curve = Trace(components=np.empty(0, dtype=np.intp), residuals=False)
    run(problem, "fixed-point", limits=Limits(tol=1e-14), curve=curve)
    rate = empirical_rate([row.k for row in curve.rows], [row.error or 0.0 for row in curve.rows], 1e-2, 1e-11)
    assert rate == pytest.approx(theory.local, rel=0.1)
    assert max(rate, theory.local) <= theory.bound
    x[1] = box.x_of(np.full(n, 0.4), np.zeros(n))[1] if kind == "bounded" else 0.0
    kink = contraction(problem, x)
    assert kink.local is None, "at a degenerate solution"


def test_bound_of_a_symmetric_matrix_is_that_of_its_eigenvalues() -> None:
    eigenvalues = np.array([0.2, 1.0, 9.0])
    Q = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    M = Q @ np.diag(eigenvalues) @ Q.T
    for omega in (1.0, 1.5):
        theory = contraction(Problem(sparse.csr_array(M), np.ones(3)), np.ones(3), omega)
        assert theory.bound == pytest.approx(np.abs((omega - eigenvalues) / (omega + eigenvalues)).max())


@given(st.floats(0.1, 0.95), st.floats(1e-3, 1e3))
def test_rate_of_a_geometric_sequence_is_its_ratio(ratio: float, first: float) -> None:
    k = list(range(200))
    rate = empirical_rate(k, [first * ratio**i for i in k], 1e-2 * first, 1e-12 * first)
    assert rate == pytest.approx(ratio)


def test_there_is_no_rate_of_a_singular_iteration_or_a_few_iterates() -> None:
    assert contraction(Problem([[-1.0]], [1.0]), np.ones(1)) is None
    assert empirical_rate([0, 1, 2], [1.0, 0.1, 0.01], 1.0, 0.0) is None
