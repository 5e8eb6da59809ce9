"""The matrices of Harker and Pang (1990; see `harker_pang`), badly scaled (original to lcp)."""

from __future__ import annotations

import math

import numpy as np

from lcpcli.gallery.harker_pang import harker_pang
from lcpcli.gallery.ranges import require
from lcpcli.model.problem import Problem

CLASS = "P"
SOURCE = "after Harker and Pang 1990, rows and columns rescaled"


def ill_scaled(n: int, seed: int, *, decades: int = 6) -> Problem:
    """R M C and R q for the nonsymmetric M and the q of Harker and Pang, with diagonal R and C of random powers of two.

    decades : R and C lie between 10^-decades and 10^decades, 0 <= decades <= 50.
    """
    require("decades", decades, 0 <= decades <= 50, "0 <= decades <= 50")
    base = harker_pang(n, seed)
    powers = int(decades * math.log2(10))
    R, C = np.exp2(np.random.default_rng([seed, n, powers]).integers(-powers, powers + 1, (2, n)))
    note = "Rescaled exactly, by powers of two: the original problem has the solution C z."
    return Problem(R[:, None] * base.M * C, R * base.q, name=f"ill-scaled-{n}", source=SOURCE, note=note)
