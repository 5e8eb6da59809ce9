"""Sparse random strictly diagonally dominant nonsymmetric matrices (original to lcp) whose factors fill in."""

from __future__ import annotations

import numpy as np

from lcpcli.model.problem import Problem

CLASS = "H+"
SOURCE = "random, original to lcp"
OFF_DIAGONAL = 9


def dominant(n: int, seed: int) -> Problem:
    """About ten random normal entries per row; the diagonal is 1.1 times the sum of their moduli, plus 0.1."""
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
