"""The change of variables: x with z = |x| + x and w = |x| - x, so that z, w >= 0 and z'w = 0 for every x."""

from __future__ import annotations

import numpy as np

from lcpcli.linalg.doubles import LARGEST, largest
from lcpcli.typing import Vector

LARGEST_X = LARGEST / 2  # |x| up to which z and w are finite


def in_range(x: Vector) -> bool:
    """Whether z and w of x are finite."""
    return largest(x) <= LARGEST_X


def z_of(x: Vector) -> Vector:
    """z = |x| + x = 2 max(x, 0)."""
    z: Vector = np.maximum(x, 0.0)
    z += z
    return z


def x_of(z: Vector, w: Vector) -> Vector:
    """The x = (z - w) / 2 with z = |x| + x and w = |x| - x, where z, w >= 0 and z'w = 0.

    If rounding leaves both of a pair nonzero, the smaller one is set to 0: z and w of a solution are then recovered
    unchanged, not each with the other's error.
    """
    return np.where(z > w, z, -w) / 2
