"""Linear-quadratic control with bounds on the inputs: F. Borrelli, A. Bemporad, M. Morari, Predictive Control
for Linear and Hybrid Systems (2017), chapter 11. The system is a chain of masses and springs.
"""

from __future__ import annotations

import numpy as np

from lcpcli.gallery.ranges import require
from lcpcli.model.problem import Problem
from lcpcli.model.reductions import from_qp

CLASS = "positive semidefinite"
SOURCE = "chain of masses and springs, Borrelli, Bemporad and Morari 2017, chapter 11"
STEP = 0.25  # seconds between inputs


def control(n: int, seed: int, *, masses: int = 4, strength: float = 0.5) -> Problem:
    """Inputs that bring a chain to rest, over as many steps as give about n unknowns with the multipliers.

    x holds the states and inputs of one step after another. A state is the positions and velocities of the masses,
    each next one an equation (by the symplectic Euler method); minimize half the sum of their squares and of 0.1 times
    those of the inputs, forces on the masses of at most `strength`. The start is random.

    masses : from 1 to 100. strength : positive, up to 1e6.
    """
    require("masses", masses, 1 <= masses <= 100, "1 <= masses <= 100")
    require("strength", strength, 0 < strength <= 1e6, "0 < strength <= 1e6")
    from scipy.sparse import block_array, csr_array, diags_array, eye_array, hstack, kron

    steps = max(1, round(n / (5 * masses)))
    size = 2 * masses
    random = np.random.default_rng([seed, steps, masses])
    start = np.concatenate((random.uniform(-2.0, 2.0, masses), np.zeros(masses)))
    springs = diags_array([np.ones(masses - 1), np.full(masses, -2.0), np.ones(masses - 1)], offsets=[-1, 0, 1])
    one = eye_array(masses)
    drift = block_array([[one + STEP**2 * springs, STEP * one], [STEP * springs, one]])  # of a state over one step
    push = block_array([[STEP**2 * one], [STEP * one]])
    now, before = eye_array(steps), diags_array([np.ones(steps - 1)], offsets=[-1], shape=(steps, steps))
    state = kron(now, hstack([eye_array(size), -push])) - kron(before, hstack([drift, csr_array((size, masses))]))
    first = np.zeros(steps * size)
    first[:size] = drift @ start
    bound = np.concatenate((np.full(size, np.inf), np.full(masses, strength)))
    weights = np.concatenate((np.ones(size), np.full(masses, 0.1)))
    return from_qp(
        diags_array(np.tile(weights, steps)),
        np.zeros(weights.size * steps),
        state,
        row_lower=first,
        row_upper=first,
        lower=np.tile(-bound, steps),
        upper=np.tile(bound, steps),
        name=f"control-{(weights.size + size) * steps}",
        source=SOURCE,
        note=f"{masses} masses, {steps} steps of {STEP} s, forces up to {strength:g}.",
    )
