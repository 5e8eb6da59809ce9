"""Many systems with principal submatrices of one dense M, of which each distinct one is factorized once, or of many."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lcpcli.typing import Indices, Mask, Matrix, Vector

BATCH = 1 << 16  # numbers in the submatrices and right-hand sides that are solved in one call: they stay in the cache
WORD = 64  # bits of a machine word
LARGE_SHARE = 0.55  # of all indices: from there on the systems of the complements are solved, which cost less


def solve_principal(M: Matrix, sets: Mask, B: Vector, inverse: Matrix | None = None) -> Vector:
    """Return x with M_PP x_P = b_P and zeros elsewhere for each row of B; NaN where M_PP is singular or numbers
    overflow.

    M, sets, B : shapes (n, n), (m, n), (m, n); row i of sets is the mask of the index set P for row i of B.
    inverse : G, the inverse of M, if M is well-conditioned. If most indices are in P and few in N, M_PP^-1 = G_PP -
        G_PN G_NN^-1 G_NP then needs only the smaller system.
    """
    if not sets.size:
        return np.zeros(B.shape)
    if inverse is not None:
        large = np.count_nonzero(sets, axis=1) > LARGE_SHARE * sets.shape[1]
        if large.any():
            X = np.empty(B.shape)
            X[~large] = solve_principal(M, sets[~large], B[~large])
            all_of_it = np.where(sets[large], B[large], 0.0) @ inverse.T
            outside = solve_principal(inverse, ~sets[large], all_of_it)
            X[large] = np.where(sets[large], all_of_it - outside @ inverse.T, 0.0)
            return X
    X = np.zeros(B.shape)
    for indices, rows in _batches(sets):
        columns = M.T.take(indices, axis=0).transpose(0, 2, 1)  # first, which takes half the time of all at once
        blocks = columns[np.arange(indices.shape[0])[:, np.newaxis], indices]
        places = rows[:, :, np.newaxis], indices[:, np.newaxis, :]
        X[places] = _solved(blocks, B[places].transpose(0, 2, 1)).transpose(0, 2, 1)
    return X


def principal_inverses(M: Vector, sets: Mask) -> Vector:
    """Return G with G_PP = M_PP^-1 and zeros elsewhere for each of m matrices M; NaN in G_PP where M_PP is singular or
    numbers overflow. M, sets : shapes (m, n, n), (m, n); row i of sets is the mask of the index set P for M[i]."""
    G, sizes, n = np.zeros(M.size), np.count_nonzero(sets, axis=1), M.shape[-1]
    entries = M.reshape(-1)
    for size in range(1, n + 1):
        rows = (sizes == size).nonzero()[0]
        if rows.size:
            P = sets[rows].nonzero()[1].reshape(rows.size, size)
            places = n * (n * rows[:, np.newaxis] + P)[:, :, np.newaxis] + P[:, np.newaxis, :]
            G[places] = _solved(entries[places])
    return G.reshape(M.shape)


def each_product(M: Vector, v: Vector) -> Vector:
    """Return M v for each of m matrices and vectors, shape (m, n)."""
    return np.asarray((M @ v[:, :, np.newaxis])[:, :, 0])


def _batches(sets: Mask) -> Iterator[tuple[Indices, Indices]]:
    """Yield distinct nonempty sets in batches of equal size s, shape (g, s), and the rows with these sets, (g, r).

    The numbers of rows of the sets of a batch are within a factor of two; the last row of a set is repeated up to r.
    """
    m, n = sets.shape
    packed = np.zeros((m, -(-n // WORD) * 8), dtype=np.uint8)  # as one key for each set
    packed[:, : -(-n // 8)] = np.packbits(sets, axis=1)
    words = packed.view(np.uint64)
    keys = words[:, 0] if words.shape[1] == 1 else packed.view(f"V{packed.shape[1]}")[:, 0]
    _, first, numbers = np.unique(keys, return_index=True, return_inverse=True)
    inverse = numbers.reshape(-1)
    counts = np.bincount(inverse)
    order, begin = np.argsort(inverse, kind="stable"), np.cumsum(counts) - counts
    sizes = np.count_nonzero(sets[first], axis=1)
    kinds = sizes * WORD + np.frexp(counts - 0.5)[1]
    by_kind = np.argsort(kinds, kind="stable")
    for group in np.split(by_kind, np.flatnonzero(np.diff(kinds[by_kind])) + 1):
        size, most = int(sizes[group[0]]), int(counts[group].max())
        if not size:
            continue
        together = max(1, BATCH // (size * (size + most)))
        for part in np.split(group, range(together, group.size, together)):
            indices = sets[first[part]].nonzero()[1].reshape(part.size, size)
            yield indices, order[begin[part, np.newaxis] + np.minimum(np.arange(most), counts[part, np.newaxis] - 1)]


def _solved(A: Vector, B: Vector | None = None) -> Vector:
    """Return X with A X = B for A and B of shapes (g, s, s) and (g, s, r), or the inverse of A; NaN where A is
    singular."""
    try:
        return (np.linalg.inv(A) if B is None else np.linalg.solve(A, B)).astype(np.float64, copy=False)
    except np.linalg.LinAlgError:
        if A.shape[0] == 1:
            return np.full((A if B is None else B).shape, np.nan)
        half = A.shape[0] // 2
        parts = (slice(half), slice(half, None))
        return np.concatenate([_solved(A[part], None if B is None else B[part]) for part in parts])
