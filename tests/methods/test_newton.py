"""The method `newton` is block principal pivoting with the safeguard that makes it finite on P-matrices."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_array

from lcpcli import Problem, Status, Trace, read
from lcpcli.files import contents
from lcpcli.gallery import families
from lcpcli.linalg import factors
from lcpcli.options import Limits
from lcpcli.solving.driver import run


def test_rows_of_the_papers_first_table_are_its_own() -> None:
    """From any start with all components negative: 0; 4, 0, 4, 0; 1, 0, 1, 0, the vector-division rows."""
    trace = Trace()
    run(read(contents.shipped_path("paper-example-1.json")), "newton", [-1.0, -1.0, -1.0, -1.0], trace=trace)
    assert [row.z.tolist() for row in trace.rows[1:]] == [[4.0, 0.0, 4.0, 0.0], [1.0, 0.0, 1.0, 0.0]]


@pytest.mark.parametrize("n", [3, 5, 21])
def test_cycle_of_plain_newton_is_broken(n: int) -> None:
    """M = I + 2 C with the cyclic shift C, n odd, q = e, from x = -e_1: plain steps never end."""
    M = np.eye(n) + 2 * np.roll(np.eye(n), 1, axis=0)
    trace = Trace()
    result = run(Problem(M, np.ones(n)), "newton", 1.0 - 2 * np.eye(n)[0], trace=trace)
    assert result.solved
    assert {"block", "least index"} <= {row.step for row in trace.rows}


@pytest.mark.parametrize("n", [1, 10, 201])
@pytest.mark.parametrize("symmetric", [True, False])
def test_positive_definite_problems_take_a_handful_of_steps(n: int, symmetric: bool) -> None:
    generator = np.random.default_rng(n)
    A, B = generator.uniform(-5, 5, (2, n, n))
    M = A.T @ A + np.eye(n) + (0 if symmetric else B - B.T)
    q = generator.uniform(-500, 500, n)
    dense, sparse = run(Problem(M, q), "newton"), run(Problem(csr_array(M), q), "newton")
    assert dense.solved
    assert dense.iterations <= 12
    assert np.allclose(dense.z, sparse.z, rtol=0, atol=1e-9 * max(1.0, float(np.abs(dense.z).max())))


def test_singular_principal_submatrix_is_a_breakdown() -> None:
    result = run(Problem([[0.0, 1.0], [1.0, 0.0]], [-1.0, 1.0]), "newton")
    assert result.status is Status.BREAKDOWN
    assert "singular" in result.message


def test_matrix_that_is_no_p_matrix_may_keep_it_going() -> None:
    result = run(Problem([[-1.0]], [-1.0]), "newton", limits=Limits(max_iterations=50))
    assert not result.solved


@pytest.fixture
def sizes(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The sizes of the dense blocks that are factorized from now on."""
    found: list[int] = []

    def counting(real: Callable[..., Any]) -> Callable[..., Any]:
        return lambda self, A, *how: found.append(A.shape[0]) or real(self, A, *how)

    for name in ("cholesky", "lu"):
        monkeypatch.setattr(factors._DenseFactors, name, counting(getattr(factors._DenseFactors, name)))
    return found


@pytest.mark.parametrize("symmetric", [True, False])
def test_factors_are_updated_while_few_indices_change(symmetric: bool, sizes: list[int]) -> None:
    generator = np.random.default_rng(1)
    A, n = generator.standard_normal((2, 300, 300)), 300
    M = A[0] @ A[0].T + np.eye(n) + (0 if symmetric else A[1] - A[1].T)
    solver, b = factors.PrincipalSolver(M), generator.standard_normal(n)
    P = np.arange(n) % 2 == 0
    for exchanged in ([], [0, 1], [2, 4, 7, 9], [11, 298], list(range(9))):
        P[exchanged] = ~P[exchanged]
        indices = np.flatnonzero(P)
        exact = np.linalg.solve(M[np.ix_(P, P)], b[P])
        assert np.allclose(solver.at(indices)(b[P]), exact, rtol=0, atol=1e-9 * np.abs(exact).max())
    assert len(sizes) == 1
    indices = np.arange(100)
    assert np.allclose(M[:100, :100] @ solver.solve(indices, b[:100]), b[:100])
    assert len(sizes) == 2


def test_set_that_makes_the_update_singular_is_factorized_anew(sizes: list[int]) -> None:
    """M_KK is regular for the set K that was factorized, M_PP is not: that is said, not a solution made up."""
    M = np.diag(np.r_[np.ones(299), 0.0])
    solver = factors.PrincipalSolver(M)
    solver.at(np.arange(298))
    with pytest.raises(factors.SingularMatrix):
        solver.solve(np.r_[np.arange(298), 299], np.ones(299))
    assert len(sizes) >= 2


@pytest.mark.parametrize("symmetric", [True, False])
def test_auto_factorizes_once_from_an_active_set_that_is_nearly_right(symmetric: bool, sizes: list[int]) -> None:
    problem = families.make("harker-pang", 250, 3, symmetric=symmetric)
    result = run(problem, "auto")
    assert result.solved
    assert result.route == ("gradient", "newton")
    assert len(sizes) == 1
    plain = run(problem, "newton")
    assert np.allclose(result.z, plain.z, rtol=0, atol=1e-12 * np.abs(plain.z).max())


def test_auto_solves_where_projected_gradients_lead_astray() -> None:
    """M = I + 2 C: its symmetric part is not definite."""
    n = 301
    M = np.eye(n) + 2 * np.roll(np.eye(n), 1, axis=0)
    q = np.random.default_rng(0).standard_normal(n)
    assert run(Problem(M, q), "auto").solved
