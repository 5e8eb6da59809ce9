"""Equilibration: scaling of rows and columns that makes results independent of their units.

For positive diagonals R and C the solutions of LCP(R M C, R q) are z / C with w scaled by R. With R and C computed
from the matrix itself, what is measured in scaled units hardly depends on the units in which the data were given.
"""

from __future__ import annotations

import math

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import FAR
from lcpcli.linalg.units import units
from lcpcli.typing import Matrix, Vector

SWEEPS = 30
FAR_APART = 40.0  # exponent of the ratio of units above which logarithms are balanced first, then the largest entries
NEAR = 4.0  # exponent of the ratio of units up to which the exponents of the first sweep limit those of the others
MARGIN = 4.0  # binary digits by which exponents may leave the range of the first sweep's
FEW = 2.0 ** (2 * NEAR - 2)  # the ratio of units up to which that is certain
LARGEST_POWER = 1000.0  # exponents are limited to this, so that R, C and what they divide stay finite


def equilibrate(M: Matrix, q: Vector, rows: Vector | None = None) -> tuple[Vector, Vector]:
    """Diagonals R, C of shape (n,) for which the rows and columns of R |M| C have largest entries near 1.

    Rows and columns are divided simultaneously by the square roots of their largest entries (D. Ruiz, A scaling
    algorithm to equilibrate both rows and columns norms in matrices, RAL-TR-2001-034), repeatedly until every largest
    entry lies between 1/2 and 2, at most SWEEPS times. The divisors are powers of two, so that scaling is exact, and
    stay finite. A symmetric M stays symmetric: R = C. A zero row is scaled until its entry of q is as large as the
    largest other one; a zero column, which has no scale, is left unscaled. Uncoupled blocks of M keep the units that
    they have in common. No exponent ends more than MARGIN outside the range of those that the first sweep asks for.

    rows : the largest |entry| of each row of M, if they are known: M need then not be read if its diagonal is nearly as
        large.
    """
    rows, diagonal = matrices.row_maxima(M) if rows is None else rows, np.abs(M.diagonal())
    low, high = range_of_units(float(diagonal.min()), float(rows.max()))
    if low == high:
        common = np.full(q.size, low)
        return common, common
    columns = matrices.column_maxima(M)
    logarithms = np.log2(diagonal, where=diagonal > 0, out=np.full(q.size, -np.inf))
    low, high = -LARGEST_POWER, LARGEST_POWER
    row_power, column_power = np.zeros(q.size), np.zeros(q.size)
    if _are_far_apart(rows) or _are_far_apart(columns):
        powers = units(M)
        row_power, column_power = np.clip(np.rint([powers.rows, powers.columns]), low, high)
        rows, columns = matrices.row_and_column_maxima(M, np.exp2(row_power), np.exp2(column_power))
    else:
        changes = np.concatenate([_half_power(rows), _half_power(columns)])
        if changes.max() - changes.min() <= NEAR:
            low, high = -changes.max() - MARGIN, -changes.min() + MARGIN
    for _ in range(SWEEPS):
        row_change, column_change = _half_power(rows), _half_power(columns)
        if not row_change.any() and not column_change.any():
            break
        row_power = np.clip(row_power - row_change, low, high)
        column_power = np.clip(column_power - column_change, low, high)
        if (row_power + column_power + logarithms >= -1).all():
            break  # as no entry is now above 2, all largest ones lie between 1/2 and 2
        rows, columns = matrices.row_and_column_maxima(M, np.exp2(row_power), np.exp2(column_power))
    empty = (rows == 0) & (q != 0)
    if empty.any():
        sizes = row_power[~empty] + 2 * _half_power(np.abs(q[~empty]))
        size = sizes[q[~empty] != 0].max(initial=-LARGEST_POWER)
        own = 2 * _half_power(np.abs(q[empty]))
        row_power[empty] = np.clip((size if size > -LARGEST_POWER else 0.0) - own, -LARGEST_POWER, LARGEST_POWER)
    return np.exp2(row_power), np.exp2(column_power)


def range_of_units(least: float, largest: float) -> tuple[float, float]:
    """Bounds on the entries of R and C, from the least |M_ii| and the largest |M_ij|; 0 and infinity if they are far
    from each other or from 1.

    The largest entry of each row and column lies between the two. If both ask for the same power of two, that is it.
    """
    if not (least > 0 and largest <= least * FEW and least > 1 / FAR and largest < FAR):
        return 0.0, math.inf
    first, last = -round(math.log2(largest) / 2), -round(math.log2(least) / 2)
    if first == last:
        return 2.0**first, 2.0**first
    return 2.0 ** (first - MARGIN), 2.0 ** (last + MARGIN)


def _are_far_apart(sizes: Vector) -> bool:
    """Whether sizes differ by more than units in common use do."""
    used = sizes[sizes > 0]
    return bool(used.size and math.log2(used.max()) - math.log2(used.min()) > FAR_APART)


def _half_power(sizes: Vector) -> Vector:
    """Half the binary logarithm of each size, rounded to an integer; 0 where the size is 0."""
    half: Vector = np.rint(0.5 * np.log2(sizes, where=sizes > 0, out=np.zeros_like(sizes)))
    return half
