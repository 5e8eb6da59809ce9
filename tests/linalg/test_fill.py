"""The entries of triangular factors that are counted before any is computed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from lcpcli.interrupts import TimeIsUp, within
from lcpcli.linalg.patterns import fill


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
