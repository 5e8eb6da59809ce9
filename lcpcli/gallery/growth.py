"""An M-matrix whose solution grows as the pivots of J. H. Wilkinson's matrix do (Error analysis of direct methods of
matrix inversion, J. ACM 8 (1961) 281-330).
"""

from __future__ import annotations

import numpy as np

from lcpcli.model.problem import Problem

CLASS = "M"
SOURCE = "after Wilkinson 1961"
MOST_UNKNOWNS = 1024  # 2^1023 is the largest power of two in double precision


def growth(n: int, _seed: int) -> Problem:
    """M with 1 on the diagonal and -1 below it, q = -e; the solution is z_i = 2^(i-1). n is at most 1024."""
    n = min(n, MOST_UNKNOWNS)
    M = 2 * np.eye(n) - np.tril(np.ones((n, n)))
    note = "The components of the solution grow by the factor 2 from one to the next."
    z = np.exp2(np.arange(n))
    return Problem(M, -np.ones(n), name=f"growth-{n}", solutions=[z], source=SOURCE, note=note)
