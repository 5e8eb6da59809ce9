"""I. Ben Gharbia, J. C. Gilbert, Nonconvergence of the plain Newton-min algorithm for linear complementarity problems
with a P-matrix, Math. Programming 134 (2012) 349-364.
"""

from __future__ import annotations

import numpy as np

from lcpcli.gallery.ranges import require
from lcpcli.model.problem import Problem

CLASS = "P"
SOURCE = "Ben Gharbia and Gilbert 2012"


def ben_gharbia_gilbert(n: int, _seed: int, *, alpha: float = 2.0) -> Problem:
    """M = I + alpha C with the cyclic down-shift C, q = e; the solution is 0; the iteration cycles from x0 = 2 e_1 - e.

    n is rounded up to an odd number >= 3; for an even one M would not be a P-matrix.

    alpha : 1 < alpha <= 1e6.
    """
    require("alpha", alpha, 1 < alpha <= 1e6, "1 < alpha <= 1e6")
    n = max(3, n + 1 - n % 2)
    unit = np.eye(n)
    return Problem(
        unit + alpha * np.roll(unit, 1, axis=0),
        np.ones(n),
        name=f"ben-gharbia-gilbert-{n}",
        x0=2 * unit[0] - 1,
        solutions=[np.zeros(n)],
        source=SOURCE,
        note=f"The Newton iteration without safeguards returns to the active set of x0 after {n} steps.",
    )
