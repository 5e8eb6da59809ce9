"""Bounds on the rounding errors in M z + q, underflow of products included."""

from __future__ import annotations

import numpy as np

from lcpcli.linalg.doubles import ROW_ROUNDING, SMALLEST_NORMAL, sizes
from lcpcli.linalg.matrices import is_sparse
from lcpcli.typing import Mask, Matrix, Vector

TINY_TERMS = 2.0**-900  # of a row: up to here its products may underflow by more than ROW_ROUNDING of its terms


def row_errors(M: Matrix, z: Vector, terms: Vector) -> Vector:
    """Return bounds on the rounding errors in w = M z + q for z of shape (n,), or for m of them in rows.

    terms : |q| + |M| |z| as computed, of the shape of w.

    A product that underflows is off by up to SMALLEST_NORMAL, and is missing in the terms as in w.
    """
    errors: Vector = ROW_ROUNDING * terms
    tiny = terms <= TINY_TERMS
    if np.count_nonzero(tiny) and may_underflow(M, z):
        errors += np.where(tiny, SMALLEST_NORMAL * products(M, z), 0.0)
    return errors


def may_underflow(M: Matrix, z: Vector) -> bool:
    """Return whether a product of an entry of M and one of z may underflow."""
    least, factor = sizes(M.data if is_sparse(M) else M)[0], sizes(z)[0]
    with np.errstate(over="ignore", under="ignore"):
        return bool(least * factor < SMALLEST_NORMAL)


def products(M: Matrix, z: Vector) -> Vector:
    """Return how many products M_ij z_j of numbers other than 0 each row of M z adds up."""
    used: Mask = M != 0
    counts: Vector = (used.astype(np.float64) @ (z != 0).T.astype(np.float64)).T
    return counts
