"""M. M. Kostreva, Cycling in linear complementarity problems, Math. Programming 16 (1979) 127-130, for n = 3; here for
every odd n.
"""

from __future__ import annotations

import numpy as np

from lcpcli.model.problem import Problem

CLASS = "P, not positive definite"
SOURCE = "Kostreva 1979"


def kostreva(n: int, _seed: int) -> Problem:
    """M = I + 2 C with the cyclic up-shift C, q = -e; the solution is e/3. n is rounded up to an odd number >= 3."""
    n = max(3, n + 1 - n % 2)
    unit = np.eye(n)
    return Problem(
        unit + 2 * np.roll(unit, -1, axis=0),
        -np.ones(n),
        name=f"kostreva-{n}",
        solutions=[np.full(n, 1 / 3)],
        source=SOURCE,
        note="For n = 3 Lemke's method cycles if ties are broken by the smallest index.",
    )
