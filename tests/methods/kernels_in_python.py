"""The orders of elimination and the LDL' factors of the kernels, not compiled: run with NUMBA_DISABLE_JIT=1."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.sparse import csr_array, eye_array, kron, random_array, triu
from scipy.sparse.linalg import splu

from lcpcli.kernels import ldl_kernels as ldl
from lcpcli.kernels.ordering_kernels import exact_minimum_degree
from lcpcli.kernels.quotient_graph_kernels import approximate_minimum_degree
from lcpcli.typing import Indices, Matrix, Vector

MOST_FILL = 1.1  # entries of L, for each of those that SuperLU's minimum degree leads to


def patterns() -> Iterator[Matrix]:
    """Random graphs, a grid, an arrow, no edges at all, and all edges."""
    for n, degree in ((1, 1), (2, 1), (40, 1), (80, 2), (120, 3), (60, 30)):
        yield random_array((n, n), density=degree / n, rng=n)
    chain = csr_array(np.eye(12, k=1))
    yield kron(chain, np.eye(12)) + kron(np.eye(12), chain)
    arrow = np.eye(70, k=1)
    arrow[-1] = 1
    yield csr_array(arrow)
    yield csr_array((50, 50))
    yield csr_array(np.ones((30, 30)))


def quasidefinite(pattern: Matrix) -> tuple[Matrix, Vector]:
    """A symmetric matrix with this pattern whose diagonal blocks are definite, and the signs of its pivots."""
    n = pattern.shape[0]
    A, signs = (pattern + pattern.T).toarray(), np.where(np.arange(n) % 3 == 0, -1.0, 1.0)
    same = signs[:, np.newaxis] == signs
    K = csr_array(A + np.diag(signs * (1 + np.where(same, np.abs(A), 0).sum(axis=1))))
    K.sort_indices()
    return K, signs


def check(K: Matrix, signs: Vector, order: Indices, most_entries: float) -> None:
    n, P = signs.size, csr_array(K[order][:, order])
    above = csr_array(triu(P, 1).T)
    above.sort_indices()
    found, operations = ldl.pattern_of(n, above.indptr, above.indices, np.inf)
    assert found.rows.size + n <= most_entries
    values, work = np.empty(found.rows.size), (np.empty(n), np.zeros(n))
    factors = ldl.Factors(above.indptr, above.indices, above.data, signs[order], P.diagonal(), found, values, *work)
    assert ldl.factorize(factors) == 0
    L = np.eye(n)
    for j in range(n):
        part = slice(found.begin[j], found.begin[j + 1])
        L[found.rows[part], j] = values[part]
    assert np.allclose(L / factors.inverse @ L.T, P.toarray(), rtol=0, atol=1e-13 * abs(P).max())
    x = np.cos(np.arange(n))
    b = P @ x
    ldl.solve(factors, b)
    assert np.allclose(b, x, rtol=0, atol=1e-12)
    assert not ldl.pattern_of(n, above.indptr, above.indices, operations - 1)[0].rows.size


if __name__ == "__main__":
    for pattern in patterns():
        K, signs = quasidefinite(csr_array(pattern))
        n = signs.size
        definite = (abs(K) + 100 * n * eye_array(n)).tocsc()
        entries = splu(definite, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}).L.nnz
        for method in (exact_minimum_degree, approximate_minimum_degree):
            for longest, most in ((n, MOST_FILL * entries + 5), (4, np.inf)):  # of rows that do not come last
                order = method(n, K.indptr, K.indices, longest)
                assert np.array_equal(np.sort(order), np.arange(n))
                check(K, signs, order, most)
