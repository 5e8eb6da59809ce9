"""P. T. Harker and J.-S. Pang, A damped-Newton method for the linear complementarity problem, in: Computational
Solution of Nonlinear Systems of Equations, Lectures in Applied Mathematics 26, AMS (1990) 265-284.
"""

from __future__ import annotations

import numpy as np

from lcpcli.model.problem import Problem

CLASS = "positive definite"
SOURCE = "Harker and Pang 1990"


def harker_pang(n: int, seed: int, *, symmetric: bool = False) -> Problem:
    """M = A'A + B + D with A and the skew B in (-5, 5), the diagonal D in (0, 0.3), and q in (-500, 500).

    symmetric : leave B out.
    """
    random = np.random.default_rng([seed, n])
    A, B = random.uniform(-5, 5, (2, n, n))
    M = A.T @ A + np.diag(random.uniform(0, 0.3, n))
    if not symmetric:
        upper = np.triu(B, 1)
        M += upper - upper.T
    return Problem(M, random.uniform(-500, 500, n), name=f"harker-pang-{n}", source=SOURCE)
