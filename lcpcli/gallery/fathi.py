"""Y. Fathi, Computational complexity of LCPs associated with positive definite symmetric matrices, Math. Programming 17
(1979) 335-344.
"""

from __future__ import annotations

import numpy as np

from lcpcli.gallery.murty import triangle
from lcpcli.model.problem import Problem

CLASS = "symmetric positive definite"
SOURCE = "Fathi 1979"


def fathi(n: int, _seed: int) -> Problem:
    """M = U'U with 1 on the diagonal of U and 2 above it, q = -e; the solution is e_1."""
    U = triangle(n)
    z = np.zeros(n)
    z[0] = 1
    note = f"Lemke's method needs 2^{n} pivots; the condition of M grows like n^4."
    return Problem(U.T @ U, -np.ones(n), name=f"fathi-{n}", solutions=[z], source=SOURCE, note=note)
