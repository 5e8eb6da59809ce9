"""A membrane between two obstacles: J. F. Rodrigues, Obstacle Problems in Mathematical Physics, North-Holland (1987).
The discretization and the load are those of `obstacle`.
"""

from __future__ import annotations

import numpy as np

from lcpcli.gallery.obstacle import membrane
from lcpcli.gallery.ranges import require
from lcpcli.model.problem import Problem

CLASS = "symmetric positive definite, M"
SOURCE = "Rodrigues 1987, five-point differences"


def two_obstacles(n: int, _seed: int, *, gap: float = 0.3) -> Problem:
    """-Laplace z = f where -gap / 2 < z < gap / 2, on the unit square, z = 0 on its boundary, times h^2.

    gap : between the obstacles, which are flat, 0 < gap <= 1e6.
    """
    require("gap", gap, 0 < gap <= 1e6, "0 < gap <= 1e6")
    M, q = membrane(n)
    return Problem(
        M,
        q,
        name=f"two-obstacles-{q.size}",
        source=SOURCE,
        note=f"The membrane touches an obstacle where |z| = {gap / 2:g}.",
        lower=np.full(q.size, -gap / 2),
        upper=np.full(q.size, gap / 2),
    )
