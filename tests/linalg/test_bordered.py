"""Dense rows and columns are split off where they would slow every factorization."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from lcpcli import Problem, from_qp, run
from lcpcli.linalg import shifted_systems
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.shifted_systems import MOST_SPLIT_OFF, Bordered, SuperLU, dense_places


def arrow(n: int, places: list[int], random: np.random.Generator) -> sparse.csr_array:
    """Tridiagonal and dominant but for dense rows and columns."""
    M = sparse.diags_array([np.full(n - 1, -1.0), np.full(n, 4.0), np.full(n - 1, -0.5)], offsets=[-1, 0, 1]).tolil()
    for place in places:
        M[place, :], M[:, place] = random.normal(size=n), random.normal(size=(n, 1))
        M[place, place] = 50.0
    return sparse.csr_array(M)


def budgeted(n: int) -> Problem:
    """min |x - t|^2 / 2 over x >= 0 with a few sums of all x, and differences of neighbours, bounded."""
    random = np.random.default_rng(n)
    differences = sparse.diags_array([np.full(n, 1.0), np.full(n, -1.0)], offsets=[0, 1], shape=(n - 1, n))
    A = sparse.vstack([sparse.csr_array(random.random((3, n))), differences]).tocsr()
    total = A[:3] @ np.ones(n)
    low, high = np.concatenate((total, np.full(n - 1, -0.5))), np.concatenate((total, np.full(n - 1, 0.5)))
    return from_qp(Q=sparse.eye_array(n).tocsr(), c=random.normal(size=n), A=A, row_lower=low, row_upper=high)


@pytest.mark.parametrize("places", [[0], [7, 300, 499]])
def test_bordered_systems_are_those_of_the_whole_matrix(places: list[int]) -> None:
    random = np.random.default_rng(1)
    M = arrow(500, places, random)
    assert dense_places(M).tolist() == places
    systems = Bordered(M, dense_places(M), SuperLU)
    for _ in range(3):
        d, b = random.uniform(0, 9, 500), random.normal(size=500)
        systems.factorize(d)
        expected = np.linalg.solve(M.toarray() + np.diag(d), b)
        assert np.abs(systems.solve(b) - expected).max() <= 1e-12 * np.abs(expected).max()
    assert systems._inner._lu.nnz < M.shape[0] * 20


def test_a_singular_border_is_told() -> None:
    M = sparse.csr_array(np.block([[np.eye(3), np.ones((3, 1))], [np.ones((1, 3)), np.full((1, 1), 3.0)]]))
    with pytest.raises(SingularMatrix):
        Bordered(M, np.array([3]), SuperLU).factorize(np.zeros(4))


def test_many_dense_rows_are_no_border() -> None:
    assert not dense_places(arrow(900, list(range(MOST_SPLIT_OFF + 1)), np.random.default_rng(0))).size
    assert not dense_places(sparse.csr_array(np.ones((50, 50)))).size


def test_programs_with_dense_rows_are_solved_by_scipy_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("qdldl")
    problem = budgeted(2000)
    by_qdldl = run(problem, "interior")
    monkeypatch.setattr(shifted_systems, "_has_qdldl", lambda: False)
    assert isinstance(shifted_systems.systems(problem.M, problem.signs), Bordered)
    by_scipy = run(problem, "interior")
    assert by_scipy.solved
    assert np.abs(by_scipy.z[:2000] - by_qdldl.z[:2000]).max() < 1e-9
