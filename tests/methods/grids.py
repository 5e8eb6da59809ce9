"""Sparse matrices of difference formulas on grids, and loads that change sign."""

import numpy as np
from scipy.sparse import csr_array, diags_array, eye_array, kron


def line(m, middle=2.0):
    return csr_array(
        diags_array(
            [-np.ones(m - 1), np.full(m, middle), -np.ones(m - 1)], offsets=[-1, 0, 1]
        )
    )


def plane(m, across=1.0):
    return csr_array(kron(line(m), eye_array(m)) + across * kron(eye_array(m), line(m)))


def space(m):
    return csr_array(kron(plane(m), eye_array(m)) + kron(eye_array(m * m), line(m)))


def stream(m, speed):
    """Convection and diffusion with upwind differences, which is not symmetric."""
    upwind = diags_array([-np.ones(m - 1), np.ones(m)], offsets=[-1, 0])
    return csr_array(
        plane(m)
        + speed / m * (kron(upwind, eye_array(m)) + 0.5 * kron(eye_array(m), upwind))
    )


def smooth(n, seed=0):
    """A load that changes sign a few times along the unknowns."""
    phases = np.random.default_rng(seed).uniform(1, 9, 2)
    t = np.linspace(0, 1, n)
    return 0.01 * (np.sin(6 * phases[0] * t) * np.cos(4 * phases[1] * t) - 0.2)
