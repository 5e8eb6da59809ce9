"""The steps of `projected_gradient` in single precision, compiled by numba. As its cache knows of changes in this file
alone, it uses no kernels of others."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types

NUMBER, COUNT = types.float32, types.int64
FIXED, VECTOR = (types.Array(NUMBER, 1, "C", readonly=readonly) for readonly in (True, False))
MATRIX, STATES = types.Array(NUMBER, 2, "C", readonly=True), types.Array(types.int8, 1, "C")
SIGNATURE = types.Tuple((COUNT, NUMBER))(MATRIX, *(FIXED,) * 4, *(VECTOR,) * 2, STATES, NUMBER, COUNT)


@njit(SIGNATURE, cache=True, nogil=True, error_model="numpy")
def gradient_block(
    M: Any, units: Any, q: Any, lower: Any, upper: Any, z: Any, w: Any, basis: Any, t: Any, steps: int
) -> Any:
    """Make an even number of steps, beginning with a long one; return how many states they change, and the next step
    size.

    M : shape (n, n). units : by which M and q / units are multiplied. z, w, basis : shape (n,), overwritten.
    """
    n = z.size
    former, before, scaled = np.empty_like(z), np.empty_like(w), np.empty_like(z)
    for step in range(steps):
        for i in range(n):
            former[i], before[i] = z[i], w[i]
            z[i] = min(max(z[i] - t * w[i], lower[i]), upper[i])
            scaled[i] = units[i] * z[i]
        product = np.dot(M, scaled)
        along, square, other = np.float32(0.0), np.float32(0.0), np.float32(0.0)
        for i in range(n):
            w[i] = product[i] * units[i] + q[i]
            change, difference = z[i] - former[i], w[i] - before[i]
            along += change * difference
            square += change * change
            other += difference * difference
        if along > 0.0:
            t = square / along if step % 2 == 0 else along / other
    changes = 0
    for i in range(n):
        place = z[i] - w[i]
        state = -1 if place <= lower[i] else 0 if place < upper[i] else 1 if lower[i] < upper[i] else -1
        changes += state != basis[i]
        basis[i] = state
    return changes, t
