"""The entries of triangular factors that are counted before any is computed, and orders that are found quickly."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from lcpcli.interrupts import TimeIsUp, within
from lcpcli.linalg.patterns import LONG_ROW, Band, fill, order_of


@pytest.mark.parametrize("seed", range(5))
def test_entries_of_factors_are_counted_as_elimination_makes_them(seed: int) -> None:
    random = np.random.default_rng(seed)
    M = sparse.csr_array(np.eye(30) + (random.random((30, 30)) < 0.05))
    pattern = (M + M.T).toarray() != 0
    order = np.argsort(pattern.sum(axis=0), kind="stable")
    pattern = pattern[np.ix_(order, order)]
    for j in range(30):
        below = np.flatnonzero(pattern[j + 1 :, j]) + j + 1
        pattern[np.ix_(below, below)] = True
    entries = int(np.tril(pattern, -1).sum())
    assert fill(M, entries) == entries
    assert entries > (np.count_nonzero((M + M.T).toarray()) - 30) / 2
    assert fill(M, entries - 1) > entries - 1
    with within(0.0), pytest.raises(TimeIsUp):
        fill(M, entries)


def arrow(n: int) -> sparse.csr_array:
    """Return a sparse matrix with a full row, a full column, and rows of several lengths between."""
    hub = np.zeros(n - 1, dtype=int), np.arange(1, n)
    rows, columns = (np.concatenate(pair) for pair in ((hub[0], hub[1]), (hub[1], hub[0])))
    return sparse.csr_array(
        sparse.diags_array(np.ones(n)) + sparse.csr_array((np.ones(rows.size), (rows, columns)), shape=(n, n))
    )


def test_unknowns_that_a_long_row_couples_are_in_order_of_their_entries_before_they_are_sorted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """scipy inserts each into a sorted list of them, which takes seconds for 100,000 in any other order."""
    n, seen = 2 * LONG_ROW, []
    M = arrow(n) + sparse.diags_array(np.ones(n // 2), offsets=n // 2)
    mckee = sparse.csgraph.reverse_cuthill_mckee

    def recorded(A: sparse.csr_array, **options: bool) -> np.ndarray:
        seen.append(np.diff(A.indptr))
        return mckee(A, **options)

    monkeypatch.setattr(sparse.csgraph, "reverse_cuthill_mckee", recorded)
    width = Band(M.tocsr()).width
    assert (np.diff(seen[0]) >= 0).all()
    assert n // 2 <= width < n


def test_long_rows_are_left_to_an_order_that_does_not_go_through_them_again_and_again() -> None:
    assert order_of(arrow(40_000)) == "COLAMD"
    assert order_of(arrow(9000)) == "MMD_AT_PLUS_A"
