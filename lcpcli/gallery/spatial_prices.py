"""Spatial price equilibrium with capacities: T. Takayama, G. G. Judge, Spatial and Temporal Price and Allocation
Models, North-Holland (1971); P. T. Harker, Alternative models of spatial competition, Operations Research 34 (1986)
410-425. The numbers are random.
"""

from __future__ import annotations

import math

import numpy as np

from lcpcli.gallery.ranges import require
from lcpcli.model.problem import Problem

CLASS = "positive semidefinite"
SOURCE = "Takayama and Judge 1971, random linear functions"


def spatial_prices(n: int, seed: int, *, capacity: float = 3.0) -> Problem:
    """Prices of one good in m regions that supply and m that demand it, and the flows, 2 m + m^2 unknowns, about n.

    z = (supply prices, demand prices, flows by region of supply); prices are free. Region i supplies s_i = b_i (p_i -
    a_i), region j demands e_j (d_j - r_j); both equal the sums of flows. A flow has w = p_i + c_ij - r_j, what it
    loses a unit; at its capacity it may gain. They are named supply1, demand1, flow1-1 and so on.

    capacity : of each flow, 0 < capacity <= 1e6.
    """
    require("capacity", capacity, 0 < capacity <= 1e6, "0 < capacity <= 1e6")
    from scipy.sparse import block_array, csr_array, diags_array, eye_array, kron, vstack

    m = max(1, round(math.sqrt(n + 1) - 1))
    random = np.random.default_rng([seed, m])
    a, b, d, e = (random.integers(low, high, m).astype(float) for low, high in ((1, 6), (1, 4), (10, 21), (1, 4)))
    costs = random.integers(1, 10, m * m).astype(float)
    one, ones = eye_array(m), np.ones((1, m))
    sums = vstack((-kron(one, ones), kron(ones, one)))  # minus what leaves a region, plus what arrives
    slopes = diags_array(np.concatenate((b, e)))
    M = csr_array(block_array([[slopes, sums], [-sums.T, None]]))
    prices, regions = np.full(2 * m, np.inf), range(1, m + 1)
    flows = [f"flow{i}-{j}" for i in regions for j in regions]
    return Problem(
        M,
        np.concatenate((-a * b, -d * e, costs)),
        name=f"spatial-prices-{2 * m + m * m}",
        source=SOURCE,
        note=f"{m} regions of supply, {m} of demand, capacity {capacity:g}.",
        lower=np.concatenate((-prices, np.zeros(m * m))),
        upper=np.concatenate((prices, np.full(m * m, capacity))),
        names=[*(f"supply{i}" for i in regions), *(f"demand{j}" for j in regions), *flows],
    )
