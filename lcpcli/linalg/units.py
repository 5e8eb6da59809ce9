"""The units of rows and columns that a matrix itself suggests, the groups of them that are coupled, and equilibration.

A. R. Curtis and J. K. Reid, On the automatic scaling of matrices for Gaussian elimination, IMA Journal of Applied
Mathematics 10 (1972) 118-124: R and C with the least sum of squares of log2 |R_i M_ij C_j| over the nonzero entries.
They are unique up to a constant for each connected component of rows and columns, with an edge where M_ij is not 0, so
that what is measured in them does not depend on the units in which M is given. `logarithms` computes them.

Equilibration: for positive diagonals R and C the solutions of LCP(R M C, R q) are z / C with w scaled by R. With R and
C computed from the matrix itself, what is measured in scaled units hardly depends on the units of the data.

Systems with a singular matrix: a solution, what all solutions share, and whether there is one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import FAR_FROM_ONE, ROW_ROUNDING
from lcpcli.linalg.factors import finite
from lcpcli.typing import Indices, Mask, Matrix, Vector

MOST_SWEEPS = 30  # each of which halves the exponents that are left, so that all settle unless M ties them together
# Exponent of the ratio of units above which logarithms are balanced first, then the largest entries.
UNITS_FAR_APART = 40.0
# Exponent of the ratio of units up to which the exponents of the first sweep limit those of the others.
NEAR_UNITS = 4.0
EXPONENT_MARGIN = 4.0  # binary digits by which exponents may leave the range of those of the first sweep
LARGEST_POWER = 1000.0  # of two: exponents are limited to it, so that R, C and what they divide stay finite


@dataclass(frozen=True, eq=False)
class Units:
    """Units R and C. rows, columns : log2 of R and of C, shape (n,). row_part, column_part : the numbers of the
    connected components of rows and columns, 0 to parts - 1, shape (n,)."""

    rows: Vector
    columns: Vector
    row_part: Indices
    column_part: Indices
    parts: int

    def diagonals(self) -> tuple[Vector, Vector]:
        """Return R and C, rounded to powers of two, so that scaling by them is exact."""
        return np.exp2(np.rint(self.rows)), np.exp2(np.rint(self.columns))

    def largest(self, values: Vector, part: Indices) -> Vector:
        """Return the largest value in each component, for values of rows or columns with these components, of shape
        (..., n); minus infinity in an empty component."""
        if self.parts == 1:
            return np.asarray(values.max(axis=-1, keepdims=True, initial=-np.inf))
        found = np.full((*values.shape[:-1], self.parts), -np.inf)
        place: Any = part if values.ndim == 1 else (..., part)  # the first takes a fraction of the time
        np.maximum.at(found, place, values)
        return found


def units(M: Matrix, S: Vector | None = None) -> Units:
    """Return the units of M, dense or in compressed sparse rows, with finite entries; S as in `least_squares`."""
    with imports:
        from lcpcli.linalg.logarithms import least_squares
    return Units(*least_squares(M, S))


def equilibrate(M: Matrix, q: Vector, rows: Vector | None = None) -> tuple[Vector, Vector]:
    """Return diagonals R, C of shape (n,) for which the rows and columns of R |M| C have largest entries near 1.

    Rows and columns are divided simultaneously by the square roots of their largest entries (D. Ruiz, A scaling
    algorithm to equilibrate both rows and columns norms in matrices, RAL-TR-2001-034), repeatedly until every largest
    entry lies between 1/2 and 2, at most MOST_SWEEPS times. The divisors are powers of two, so that scaling is exact,
    and stay finite. A symmetric M stays symmetric: R = C. A zero row is scaled until its entry of q is as large as the
    largest other one; a zero column, which has no scale, is left unscaled. Uncoupled blocks of M keep their common
    units. No exponent ends more than EXPONENT_MARGIN outside the range of the exponents of the first sweep.

    rows : the largest |entry| of each row of M, if they are known: M need then not be read if its diagonal is nearly as
        large.
    """
    rows, diagonal = matrices.row_maxima(M) if rows is None else rows, np.abs(M.diagonal())
    power = common_power(float(diagonal.min()), float(rows.max())) if q.size else 0.0
    if not math.isnan(power):
        common = np.full(q.size, 2.0**power)
        return common, common
    sizes = np.concatenate((rows, matrices.column_maxima(M)))
    powers = moderate_powers(M, sizes, diagonal)
    if not powers.size:
        far = units(M)
        powers = np.clip(np.rint(np.concatenate((far.rows, far.columns))), -LARGEST_POWER, LARGEST_POWER)
        powers = swept(M, sizes_in_units(M, powers), diagonal, powers, False)
    row_power, column_power = powers[: q.size], powers[q.size :]
    empty = (rows == 0) & (q != 0)
    if empty.any():
        sizes = row_power[~empty] + 2 * half_power(np.abs(q[~empty]))
        size = sizes[q[~empty] != 0].max(initial=-LARGEST_POWER)
        own = 2 * half_power(np.abs(q[empty]))
        row_power[empty] = np.clip((size if size > -LARGEST_POWER else 0.0) - own, -LARGEST_POWER, LARGEST_POWER)
    return np.exp2(row_power), np.exp2(column_power)


def moderate_powers(M: Matrix, sizes: Vector, diagonal: Vector) -> Vector:
    """Return the exponents of the factors of rows, and then of columns, by which `equilibrate` makes these largest
    entries about 1, shape (2 n,); none where it would balance logarithms first. It is compiled as well, for a dense M,
    as are the functions that it calls."""
    n = diagonal.size
    power = common_power(diagonal.min(), sizes[:n].max())
    if not np.isnan(power):
        return np.full(2 * n, power)
    if are_far_apart(sizes[:n]) or are_far_apart(sizes[n:]):
        return np.empty(0)
    return swept(M, sizes, diagonal, np.zeros(2 * n), True)


def swept(M: Matrix, sizes: Vector, diagonal: Vector, powers: Vector, is_limited: bool) -> Vector:
    """Return the exponents after at most MOST_SWEEPS from some with which the largest entries have these sizes; limited
    ones leave the range of those of the first sweep by EXPONENT_MARGIN at most, if these are near each other."""
    n, changes = diagonal.size, half_power(sizes)
    low, high = -LARGEST_POWER, LARGEST_POWER
    if is_limited and changes.max() - changes.min() <= NEAR_UNITS:
        low, high = -changes.max() - EXPONENT_MARGIN, -changes.min() + EXPONENT_MARGIN
    none = diagonal == 0.0
    logarithms = np.log2(diagonal + none) - 4.0 * LARGEST_POWER * none
    for _ in range(MOST_SWEEPS):
        if not changes.any():
            break
        powers = np.minimum(np.maximum(powers - changes, low), high)
        if (powers[:n] + powers[n:] + logarithms >= -1.0).all():
            break  # as no entry is now above 2, all largest ones lie between 1/2 and 2
        changes = half_power(sizes_in_units(M, powers))
    return powers


def sizes_in_units(M: Matrix, powers: Vector) -> Vector:
    """Return the largest entries of rows, and then of columns, in units with these exponents, shape (2 n,)."""
    factors, n = np.exp2(powers), M.shape[0]
    rows, columns = matrices.row_and_column_maxima(M, factors[:n], factors[n:])
    return np.concatenate((rows, columns))


def common_power(least: float, largest: float) -> float:
    """Return the power of two that scales all rows and columns, as their largest entries lie between the least |M_ii|
    and the largest |M_ij|; NaN if these two need different powers, or are far from 1."""
    if not (least > 1.0 / FAR_FROM_ONE and largest < FAR_FROM_ONE):
        return np.nan
    first, last = -np.rint(0.5 * np.log2(largest)), -np.rint(0.5 * np.log2(least))
    return float(first) if first == last else np.nan


def are_far_apart(sizes: Vector) -> bool:
    """Return whether sizes differ by more than units in common use do."""
    used = sizes[sizes > 0.0]
    return bool(used.size > 0 and np.log2(used.max()) - np.log2(used.min()) > UNITS_FAR_APART)


def half_power(sizes: Vector) -> Vector:
    """Return half the binary logarithm of each size, rounded to an integer; 0 where the size is 0."""
    found: Vector = np.rint(0.5 * np.log2(sizes + (sizes == 0.0)))
    return found


LEAST_DIGITS = 1e-3  # the relative change by rounding from which a matrix counts as singular
LEAST_SINGULAR_VALUE = ROW_ROUNDING / LEAST_DIGITS  # relative to the largest: smaller ones count as 0


class PseudoInverse:
    """A generalized inverse of a dense matrix A of shape (k, k), and bases of the null spaces of A and of A':
    G = C (R A C)^+ R in the units R, C that A suggests, so that A G A = A and G A G = G.
    """

    def __init__(self, A: Vector) -> None:
        R, C = units(A).diagonals()
        left, sizes, right = np.linalg.svd(finite(R[:, np.newaxis] * A * C))
        rank = int(np.count_nonzero(sizes > LEAST_SINGULAR_VALUE * sizes[0]))
        self._inverse = (C[:, np.newaxis] * right[:rank].T / sizes[:rank]) @ (left[:, :rank].T * R)
        self._null, self._left_null = C[:, np.newaxis] * right[rank:].T, left[:, rank:].T * R
        self.is_singular = rank < len(A)
        self._rounding = len(A) * ROW_ROUNDING * (sizes[0] / sizes[rank - 1] if rank else 1.0)  # of the null spaces

    def __call__(self, b: Vector, transposed: bool = False) -> Vector:
        """Return G b or G'b."""
        return np.asarray((self._inverse.T if transposed else self._inverse) @ b)

    def determines(self, J: Vector) -> Mask:
        """Return for which rows of J, shape (m, k), J x is the same for all solutions x, up to rounding."""
        sizes = np.abs(J) @ np.abs(self._null)
        return np.asarray((np.abs(J @ self._null) <= self._rounding * sizes).all(axis=1))

    def is_consistent(self, b: Vector, terms: Vector) -> bool:
        """Return whether A x = b has a solution, up to rounding of the terms that b is the sum of."""
        return bool((np.abs(self._left_null @ b) <= self._rounding * (np.abs(self._left_null) @ terms)).all())
