"""Transport at least cost: F. L. Hitchcock, The distribution of a product from several sources to numerous localities,
J. Math. Phys. 20 (1941) 224-230. The numbers are random.
"""

from __future__ import annotations

import math

import numpy as np

from lcpcli.model.problem import Problem
from lcpcli.model.reductions import from_qp

CLASS = "positive semidefinite"
SOURCE = "Hitchcock 1941, random integers"


def transport(n: int, seed: int) -> Problem:
    """The linear program of m plants and m markets, m^2 flows and 2 m multipliers, about n unknowns.

    The supplies, whole numbers from 10 to 20, are enough for the demands from 5 to 10, at costs from 1 to 100 a unit.
    """
    from scipy.sparse import eye_array, kron, vstack

    m = max(1, round(math.sqrt(n + 1) - 1))
    random = np.random.default_rng([seed, m])
    supply, demand = random.integers(10, 21, m).astype(float), random.integers(5, 11, m).astype(float)
    costs = random.integers(1, 101, m * m).astype(float)
    one, ones, none = eye_array(m), np.ones((1, m)), np.full(m, np.inf)
    return from_qp(
        None,
        costs,
        vstack((kron(one, ones), kron(ones, one))),
        row_lower=np.concatenate((-none, demand)),
        row_upper=np.concatenate((supply, none)),
        name=f"transport-{m * m + 2 * m}",
        source=SOURCE,
        note=f"{m} plants, {m} markets.",
    )
