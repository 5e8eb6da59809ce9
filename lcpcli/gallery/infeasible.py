"""No z >= 0 has Mz + q >= 0 (original to lcp): built from y >= 0 with M'y <= 0 and q'y < 0 (J. Farkas, Theorie
der einfachen Ungleichungen, J. reine angew. Math. 124 (1902) 1-27).
"""

from __future__ import annotations

import numpy as np

from lcpcli.model.problem import Problem

CLASS = "none"
SOURCE = "random, original to lcp"


def infeasible(n: int, seed: int) -> Problem:
    """Random integer M and q, whose first (n + 1) // 2 rows are chosen to add up to M'y <= 0 and q'y = -1."""
    random = np.random.default_rng([seed, n])
    k = (n + 1) // 2
    M = random.integers(-5, 6, (n, n)).astype(np.float64)
    q = random.integers(-5, 6, n).astype(np.float64)
    M[0] = -M[1:k].sum(axis=0) - random.integers(0, 3, n)
    q[0] = -q[1:k].sum() - 1
    note = f"A Farkas vector is y with ones in the first {k} entries and zeros in the others."
    return Problem(M, q, name=f"infeasible-{n}", verdict="infeasible", source=SOURCE, note=note)
