"""The tridiagonal matrix of Example 1 of Y. El foutayeni, M. Khaladi, Using vector divisions in solving the linear
complementarity problem, J. Comput. Appl. Math. 236 (2012) 1919-1925, of any size and with a random q.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lcpcli.model.problem import Problem

CLASS = "symmetric positive definite, M"
SOURCE = "after El foutayeni and Khaladi 2012, Example 1, random q"


def tridiagonal(n: int, seed: int) -> Problem:
    """M = tridiag(-1, 4, -1), sparse, and q normally distributed."""
    q = np.random.default_rng([seed, n]).standard_normal(n)
    return Problem(
        second_difference(n, 4.0), q, name=f"tridiagonal-{n}", source=SOURCE, note="Well conditioned for every n."
    )


def second_difference(n: int, diagonal: float) -> Any:
    """tridiag(-1, diagonal, -1) of shape (n, n), sparse."""
    from scipy.sparse import csr_array, diags_array

    off = -np.ones(n - 1)
    return csr_array(diags_array([off, np.full(n, diagonal), off], offsets=[-1, 0, 1], shape=(n, n)))
