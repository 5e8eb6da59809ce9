"""The solution for a complementary set in rational arithmetic, with the floats M and q as exact numbers."""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.rational import linear, sums
from lcpcli.typing import Mask, Matrix, Vector


class Basis(NamedTuple):
    """A solution of M_PP z_P = -q_P, with z_N = 0.

    z : of length n. unique : whether it is the only one. solves : whether z >= 0 and w >= 0, so that it solves the LCP.
    """

    z: list[Fraction]
    unique: bool
    solves: bool


def exact_basis(M: Matrix, q: Vector, P: Mask) -> Basis | None:
    """The basis of a set P, a mask of shape (n,), for finite M, q of shape (n, n) and (n,); None if there is none.

    The cost is k^3 operations for k indices in P, on numbers whose length grows with k.
    """
    active = np.flatnonzero(P)
    columns = matrices.dense_columns(M, active)
    constant = [Fraction(value) for value in q.tolist()]
    system = sums.row_integers(np.column_stack((columns[active], -q[active])))
    z_P, null_space = linear.solve([row[:-1] for row in system], [row[-1] for row in system])
    if z_P is None:
        return None
    w = (sums.product(row, z_P) + value for row, value in zip(columns, constant, strict=True))
    solves = min(z_P, default=0) >= 0 and all(value >= 0 for value in w)
    z = [Fraction(0)] * q.size
    for i, value in zip(active.tolist(), z_P, strict=True):
        z[i] = value
    return Basis(z, not null_space, solves)
