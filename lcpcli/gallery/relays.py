"""One implicit Euler step of a system with relays: V. Acary, B. Brogliato, Numerical Methods for Nonsmooth Dynamical
Systems, Springer (2008). The systems are original to lcp.
"""

from __future__ import annotations

import numpy as np

from lcpcli.gallery.ranges import require
from lcpcli.model.problem import Problem

CLASS = "positive semidefinite"
SOURCE = "Acary and Brogliato 2008, random systems"
UNITS = 16  # coefficients are multiples of 1/16


def relays(n: int, seed: int, *, step: float = 0.125) -> Problem:
    """The outputs -1 <= z_i <= 1 of n relays, z_i = 1 where w_i < 0 and -1 where w_i > 0, that drive x' = A x + C'z.

    w = C x at the end of a step h: M = h C (I - h A)^-1 C' and q = C (I - h A)^-1 x_0, with A = S - I for a random
    skew-symmetric S.

    step : h, 0 < h <= 1e3.
    """
    require("step", step, 0 < step <= 1e3, "0 < step <= 1e3")
    random = np.random.default_rng([seed, n])
    S, C = np.rint(UNITS * random.standard_normal((2, n, n))) / UNITS
    A = S - S.T - np.eye(n)
    state = np.rint(UNITS * random.standard_normal(n)) / UNITS
    inverse = np.linalg.inv(np.eye(n) - step * A)
    return Problem(
        step * (C @ inverse @ C.T),
        C @ (inverse @ state),
        name=f"relays-{n}",
        source=SOURCE,
        note=f"Step {step:g}. Relays with -1 < z < 1 slide.",
        lower=-np.ones(n),
        upper=np.ones(n),
    )
