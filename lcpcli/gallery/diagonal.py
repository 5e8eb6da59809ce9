"""A diagonal matrix over many decades (original to lcp): trivial, unless a method depends on scaling."""

from __future__ import annotations

import numpy as np

from lcpcli.gallery.ranges import require
from lcpcli.model.problem import Problem

CLASS = "symmetric positive definite, M"
SOURCE = "original to lcp"


def diagonal(n: int, _seed: int, *, decades: int = 6) -> Problem:
    """M = diag(10^-decades, ..., 10^decades), sparse, with z = (1, 0, 1, 0, ...) and w = M (e - z).

    decades : 0 <= decades <= 150.
    """
    require("decades", decades, 0 <= decades <= 150, "0 <= decades <= 150")
    from scipy.sparse import csr_array, diags_array

    entries = 10.0 ** np.linspace(-decades, decades, n)
    z = (np.arange(n) % 2 == 0).astype(float)
    M = csr_array(diags_array(entries))
    return Problem(
        M,
        np.where(z > 0, -entries, entries),
        name=f"diagonal-{n}",
        solutions=[z],
        source=SOURCE,
        note="The unknowns are decoupled; only their scaling differs.",
    )
