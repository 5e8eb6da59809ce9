"""Systems with many principal submatrices of M at once: each submatrix is factorized once."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lcpcli.linalg import factors, principal_many


def test_each_submatrix_is_factorized_once(monkeypatch: pytest.MonkeyPatch) -> None:
    generator = np.random.default_rng(0)
    n, m = 70, 90
    M = generator.standard_normal((n, n)) + 3 * np.sqrt(n) * np.eye(n)
    sets = generator.random((5, n))[generator.integers(5, size=m)] < 0.5
    sets[7] = False
    B = generator.standard_normal((m, n))
    factorized: list[int] = []
    real = np.linalg.solve

    def counted(A: Any, b: Any) -> Any:
        factorized.append(A.shape[0])
        return real(A, b)

    monkeypatch.setattr(np.linalg, "solve", counted)
    X = principal_many.solve_principal(M, sets, B)
    assert sum(factorized) == 5
    for x, P, b in zip(X, sets, B, strict=True):
        assert np.allclose(M[np.ix_(P, P)] @ x[P], b[P], rtol=0, atol=1e-12)
        assert not x[~P].any()


def test_sets_of_most_indices_are_solved_for_by_their_complements() -> None:
    generator = np.random.default_rng(0)
    n, m = 30, 40
    M = generator.standard_normal((n, n)) + 3 * np.sqrt(n) * np.eye(n)
    sets = generator.random((m, n)) < np.linspace(0, 1.1, m)[:, np.newaxis]
    assert sets[-1].all()
    B = generator.standard_normal((m, n))
    inverse = factors.well_conditioned_inverse(M)
    assert inverse is not None
    ours, plain = principal_many.solve_principal(M, sets, B, inverse), principal_many.solve_principal(M, sets, B)
    assert np.allclose(ours, plain, rtol=0, atol=1e-12)
    assert np.array_equal(ours != 0, sets)
    assert factors.well_conditioned_inverse(M * np.geomspace(1, 1e9, n)) is None
    assert factors.well_conditioned_inverse(np.zeros((2, 2))) is None


def test_singular_submatrices_spoil_no_others() -> None:
    M = np.diag([1.0, 0.0, 2.0, 4.0])
    sets = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1], [1, 1, 0, 0]], dtype=bool)
    X = principal_many.solve_principal(M, sets, np.full((5, 4), 4.0))
    assert np.isnan(X).any(axis=1).tolist() == [False, True, False, False, True]
    assert X[[0, 2, 3]].tolist() == [[4, 0, 0, 0], [0, 0, 2, 0], [0, 0, 2, 1]]
