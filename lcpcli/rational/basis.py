"""The basic solution of given states in rational arithmetic, with the floats of a problem as exact numbers."""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.model.box import ORTHANT, Box
from lcpcli.rational import linear, sums
from lcpcli.typing import Mask, Matrix, Vector


class ExactBasis(NamedTuple):
    """A solution of M_BB z_B = -(q + M z_N)_B, with z_N at its bounds, 0 for an LCP.

    z : of length n. unique : whether it is the only one. solves : whether z is within its bounds and w has the signs
    that they ask for, so that it solves the problem.
    """

    z: list[Fraction]
    unique: bool
    solves: bool


def exact_basis(
    M: Matrix, q: Vector, basic: Mask, nonbasic: Vector | None = None, box: Box = ORTHANT
) -> ExactBasis | None:
    """The basic solution for finite M, q of shape (n, n) and (n,); None if there is none.

    basic : a mask of shape (n,). nonbasic : z_N, shape (n,), 0 where basic; by default 0.

    The cost is k^3 operations for k basic variables, on numbers whose length grows with k.
    """
    active = np.flatnonzero(basic)
    at_bounds = np.flatnonzero(nonbasic) if nonbasic is not None else np.empty(0, dtype=np.intp)
    used = np.concatenate((active, at_bounds))
    columns = matrices.dense_columns(M, used)
    constant = [Fraction(value) for value in q.tolist()]
    values = [Fraction(value) for value in (nonbasic[at_bounds].tolist() if nonbasic is not None else ())]
    if values:
        known = columns[:, active.size :]
        rows = [
            [*map(Fraction, columns[i, : active.size].tolist()), -sums.product(known[i], values) - constant[i]]
            for i in active.tolist()
        ]
        system = [sums.over_one_denominator(row)[0] for row in rows]
    else:
        system = sums.row_integers(np.column_stack((columns[active], -q[active])))
    z_B, null_space = linear.solve([row[:-1] for row in system], [row[-1] for row in system])
    if z_B is None:
        return None
    z = [Fraction(0)] * q.size
    for i, value in zip(used.tolist(), [*z_B, *values], strict=True):
        z[i] = value
    w = (sums.product(row, [*z_B, *values]) + value for row, value in zip(columns, constant, strict=True))
    lower, upper = (bound.tolist() for bound in box.vectors(q.size))
    return ExactBasis(z, not null_space, all(map(_is_complementary, z, w, lower, upper)))


def _is_complementary(z: Fraction, w: Fraction, lower: float, upper: float) -> bool:
    return lower <= z <= upper and (w >= 0 or z == upper) and (w <= 0 or z == lower)
