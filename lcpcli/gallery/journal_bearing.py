"""C. W. Cryer, The method of Christopherson for solving free boundary problems for infinite journal bearings by means
of finite differences, Math. Comp. 25 (1971) 435-443.
"""

from __future__ import annotations

import numpy as np

from lcpcli.gallery.ranges import require
from lcpcli.model.problem import Problem

CLASS = "symmetric positive definite, M"
SOURCE = "Cryer 1971"


def journal_bearing(n: int, _seed: int, *, eccentricity: float = 0.8) -> Problem:
    """The pressure z >= 0 in the oil film of an infinitely long bearing, zero where the film ruptures.

    Reynolds' equation (h^3 z')' = h' for the film h = 1 + eccentricity cos t, 0 < t < 2 pi, with z = 0 at both ends, by
    central differences at n interior points, times the square of the step; M is tridiagonal and sparse.

    eccentricity : offset of the shaft from the centre, as a fraction of the clearance, 0 < eccentricity < 1.
    """
    require("eccentricity", eccentricity, 0 < eccentricity < 1, "0 < eccentricity < 1")
    from scipy.sparse import csr_array, diags_array

    step = 2 * np.pi / (n + 1)
    film = 1 + eccentricity * np.cos(step * (np.arange(n + 1) + 0.5))
    cubes, inner = film**3, -(film[1:-1] ** 3)
    M = csr_array(diags_array([inner, cubes[:-1] + cubes[1:], inner], offsets=[-1, 0, 1], shape=(n, n)))
    return Problem(
        M,
        step * np.diff(film),
        name=f"journal-bearing-{n}",
        source=SOURCE,
        note="The oil film is intact where z > 0 and ruptured where z = 0.",
    )
