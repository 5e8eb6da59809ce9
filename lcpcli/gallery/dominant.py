"""Sparse, strictly diagonally dominant and not symmetric, at random, of this program: a factorization would fill in."""

from __future__ import annotations

import numpy as np

from lcpcli.model.problem import Problem

CLASS = "H+"
SOURCE = "random, of this program"
OFF_DIAGONAL = 9


def dominant(n: int, seed: int) -> Problem:
    """About ten entries a row at random places, normally distributed; the diagonal is 1.1 of their sum, plus 0.1."""
    from scipy.sparse import csr_array, diags_array

    random = np.random.default_rng([seed, n])
    rows, columns = np.repeat(np.arange(n), OFF_DIAGONAL), random.integers(0, n, OFF_DIAGONAL * n)
    values = np.where(rows == columns, 0.0, random.standard_normal(OFF_DIAGONAL * n))
    off = csr_array((values, (rows, columns)), shape=(n, n))
    off.eliminate_zeros()
    M = csr_array(off + diags_array(1.1 * abs(off).sum(axis=1) + 0.1))
    return Problem(
        M, random.standard_normal(n), name=f"dominant-{n}", source=SOURCE, note="A sparse factorization of M fills in."
    )
