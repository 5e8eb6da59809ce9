"""Enclosures of basic solutions of a positive definite band matrix in fixed-point
arithmetic, for condition numbers beyond double precision.

If elimination without row interchanges of S - c I, with S = (M + M') / 2 and some c >
0, has positive pivots, then S - c I + E is positive definite for the matrix E of the
rounding errors, so that the eigenvalues of S are at least c - |E|, and |M^-1| <= 1 / (c
- |E|) in the 2-norm (S. M. Rump, Verification of positive definiteness, BIT Numerical
Mathematics 46 (2006) 433-452). With integers of 192 binary digits, |E| is about 1e-57,
so that c = 1e-24 suffices for condition numbers up to 1e23, while double precision
reaches 1e13. A solution x of M_BB x = b whose residual r is computed without rounding
then has an error of at most |r| / (c - |E|) in the 2-norm.

Each step of elimination, a_ij - l_ik u_kj, is rounded once, by less than 2^-192, and so
is l_ik: each of the steps that change an entry adds at most (2 + 2 |u_kj|) 2^-192 to
E_ij, and there are no more of them than the width of the band.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from lcpcli.linalg.banded import Banded
from lcpcli.linalg.definite_systems import DefiniteSystems, diagonal_units
from lcpcli.linalg.double_double import DoubleDouble
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.fixed_point import BITS, doubled, fixed
from lcpcli.linalg.matrices import is_sparse, scaled
from lcpcli.model.box import BASIC
from lcpcli.model.problem import Problem
from lcpcli.typing import BasisStatus, Mask, Matrix, Vector

# The shift c, for the matrix scaled to a diagonal of about 1: about 1e-24.
SHIFT = 2.0**-80
UNIT = 2.0**-BITS


class Enclosed(NamedTuple):
    """The basic solution of a basis: z and its w, which is 0 for basic variables, and
    bounds on their errors, each of shape (n,).
    """

    z: DoubleDouble
    z_error: Vector
    w: Vector
    w_error: Vector


def units_of(problem: Problem) -> Vector | None:
    """Return D, powers of two, for which the diagonal of D M D is about 1; None if M is
    not sparse, or its diagonal not positive.
    """
    M = problem.M
    if not is_sparse(M) or not M.diagonal().min(initial=1.0) > 0:
        return None
    return diagonal_units(M)


def is_definite(problem: Problem, rounding: float = 0.0) -> bool:
    """Return whether M + M' is proved to be positive definite, for all matrices whose
    entries differ from those of M by at most `rounding`, relatively; False if that is
    not proved.
    """
    D = units_of(problem)
    if D is None:
        return False
    M = scaled(problem.M, D, D)
    # The 2-norm of the changes of M is at most the larger of their maximal row and
    # column sums.
    sums = float(abs(M).sum(axis=1).max()), float(abs(M).sum(axis=0).max())
    return least_eigenvalue(M, None, SHIFT + rounding * max(sums)) > 0


def least_eigenvalue(M: Matrix, basic: Mask | None, shift: float = SHIFT) -> float:
    """Return a positive lower bound on the eigenvalues of (M_BB + M_BB') / 2 - (shift -
    SHIFT) I, for a shift of at least SHIFT; 0 if none is proved.
    """
    S = (M + M.T) * 0.5
    band = Banded(S)
    if not band.has_fixed_point:
        return 0.0
    if (S != M).nnz:  # the sums are rounded
        shift += 2.0**-52 * float(abs(S).sum(axis=1).max())
    try:
        factors = band.fixed_point_factors(np.full(band.n, -shift), basic)
    except SingularMatrix:
        return 0.0
    if not factors.is_definite:
        return 0.0
    width = band.width + 1
    error = 2 * width * (2 * width) * (2 + 2 * factors.largest) * UNIT
    return max(SHIFT - error, 0.0)


@np.errstate(all="ignore")
def enclosed(problem: Problem, basis: BasisStatus) -> Enclosed | None:
    """Return the basic solution of a basis with error bounds; None if M_BB + M_BB' is
    not proved to be positive definite, M is no narrow band, or z overflows.
    """
    D = units_of(problem)
    if D is None or not (basis == BASIC).any():
        return None
    basic, M = basis == BASIC, scaled(problem.M, D, D)
    band = Banded(M)
    if not band.has_fixed_point or not (min_eigenvalue := least_eigenvalue(M, basic)):
        return None
    try:
        return _enclosed(problem, basis, band, min_eigenvalue)
    except (SingularMatrix, OverflowError):
        return None


def _enclosed(
    problem: Problem, basis: BasisStatus, band: Banded, min_eigenvalue: float
) -> Enclosed | None:
    """Return the basic solution with error bounds, as `enclosed` does.

    band : the band of D M D. min_eigenvalue : a lower bound on the eigenvalues of the
        symmetric part of (D M D)_BB.
    """
    D = units_of(problem)
    assert D is not None
    basic = basis == BASIC
    M = scaled(problem.M, D, D)
    q = problem.q * D
    start = np.where(basic, 0.0, problem.box.nonbasic(basis) / D)
    # Scaling by a power of two makes q and z at most about 1, as fixed-point numbers
    # need.
    exponent = int(np.frexp(max(np.abs(q).max(), np.abs(start).max()))[1])
    rows = _Rows(M)
    z = fixed(np.ldexp(start, -exponent))
    constant = fixed(np.ldexp(q, -exponent))
    w = rows.product(z, constant)
    order = range(band.n) if band.order is None else band.order.tolist()
    is_basic = basic.tolist()
    right = [-w[i] >> BITS if is_basic[i] else 0 for i in order]
    x = band.fixed_point_factors(None, basic).solve_fixed(right)
    for i, value in zip(order, x, strict=True):
        z[i] += value
    w = rows.product(z, constant)
    # The residual, and the effect of truncating the entries of M and q to fixed point.
    largest = float(max(map(abs, z))) * UNIT
    cut = (rows.longest * (largest + 1) + 2) * UNIT
    residual = max(
        abs(value)
        for value, is_basic_row in zip(w, is_basic, strict=True)
        if is_basic_row
    )
    error = math.sqrt(basic.sum()) * (residual * UNIT * UNIT + cut) / min_eigenvalue
    of_z, of_w = doubled(z, exponent - BITS), doubled([v >> BITS for v in w], -BITS)
    errors = np.where(basic, math.ldexp(error, exponent), 0.0)
    size = np.asarray(abs(M) @ errors) + math.ldexp(cut, exponent)
    nonbasic_w = np.where(basic, 0.0, np.ldexp(of_w.high, exponent) / D)
    # Twice the bounds, as these operations are rounded themselves.
    return Enclosed(
        DoubleDouble(of_z.high * D, of_z.low * D),
        2 * errors * D,
        nonbasic_w,
        (2 * size + np.ldexp(UNIT, exponent)) / D + np.abs(nonbasic_w) * 2.0**-52,
    )


def basic_solution(problem: Problem, basis: BasisStatus) -> Vector | None:
    """Return z of the basic solution of a basis, correct to its last digits; None if
    M_BB is not positive definite, or refinement does not converge.
    """
    D = units_of(problem)
    if D is None:
        return None
    systems = DefiniteSystems(scaled(problem.M, D, D), None)
    start = problem.box.nonbasic(basis) / D
    try:
        with np.errstate(all="ignore"):
            z, _ = systems.basic(problem.q * D, start, basis == BASIC)
    except SingularMatrix:
        return None
    projected = problem.box.project(z.high * D)
    return projected if np.isfinite(projected).all() else None


class _Rows:
    """The rows of a sparse M in fixed-point numbers. longest : the largest number of
    entries in a row.
    """

    def __init__(self, M: Matrix) -> None:
        self._entries, self._columns = fixed(M.data), M.indices.tolist()
        self._row_ends = M.indptr.tolist()
        self.longest = int(np.diff(M.indptr).max(initial=0))

    def product(self, z: list[int], q: list[int]) -> list[int]:
        """Return M z + q without rounding, as multiples of 2^(-2 BITS)."""
        entries = self._entries
        columns = self._columns
        products = []
        first = 0
        for constant, last in zip(q, self._row_ends[1:], strict=True):
            total = constant << BITS
            for k in range(first, last):
                total += entries[k] * z[columns[k]]
            products.append(total)
            first = last
        return products
