"""Multipliers of the rows of M that make it positive definite, proposed in double precision.

If D M is positive definite for a diagonal D > 0, all principal minors of M are positive (G. W. Cross, Three types of
matrix stability, Linear Algebra and its Applications 20 (1978) 253-263). D is sought by cutting planes (J. E. Kelley,
The cutting-plane method for solving convex programs, Journal of the SIAM 8 (1960) 703-712): v'D M v > 0 for the
eigenvectors v that have been found wanting, at the middle between the last D and the best one for these.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lcpcli.linalg.linear_program import linprog
from lcpcli.typing import Vector

MOST_STEPS = 200
LEAST = 1e-9  # eigenvalue of D M + M'D, with ones on its diagonal, from which it is worth a proof
WANTING = 0.02  # eigenvalue below which an eigenvector gives a cut
SMALLEST = 1e-4  # of the multipliers, the largest being 1


@np.errstate(over="ignore", invalid="ignore")
def multipliers(M: Vector, check: Callable[[], None]) -> Vector | None:
    """d > 0, shape (n,), for which diag(d) M may be positive definite; None if none is found.

    M : shape (n, n), with a positive diagonal. `check` is called before each step and may raise.
    """
    n, diagonal = len(M), M.diagonal()
    unit = M / diagonal[:, None]
    if not np.isfinite(unit).all():
        return None
    d, cuts = np.ones(n), np.empty((0, n))
    for _ in range(MOST_STEPS):
        check()
        S = d[:, None] * unit
        scale = 1 / np.sqrt(2 * d)
        scaled = scale[:, None] * (S + S.T) * scale
        if not np.isfinite(scaled).all():
            return None
        values, vectors = np.linalg.eigh(scaled)
        if values[0] > LEAST:
            return np.asarray(d / diagonal)
        V = scale[:, None] * vectors[:, values < WANTING]
        new = (V * (unit @ V)).T
        largest = np.abs(new).max(axis=1, keepdims=True)
        if not (np.isfinite(largest).all() and new.max(axis=1).min() > 0):  # v'D M v <= 0 for all D, if M is singular
            return None
        cuts = np.vstack((cuts, new / largest))
        found = linprog(  # the largest t with cuts d >= t
            np.append(np.zeros(n), -1.0),
            np.column_stack((-cuts, np.ones(len(cuts)))),
            np.zeros(len(cuts)),
            lower=np.append(np.full(n, SMALLEST), -np.inf),
            upper=np.append(np.ones(n), np.inf),
        )
        if found is None or found.x[-1] <= 0:
            return None
        d = (d / d.max() + found.x[:n]) / 2
    return None
