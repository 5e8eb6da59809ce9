"""Linear systems with band matrices, perhaps after a permutation, by LAPACK's band
factorizations.

Cholesky's method for symmetric positive definite matrices (pbtrf) works within the
band, by blocks: a beam with 500 unknowns takes 30 microseconds, and a plate with 100 x
100 unknowns 25 ms, where SuperLU with its small fill-in takes 50 ms; from 150 x 150
unknowns on SuperLU takes less time, and a fifth of the memory. Other matrices have LU
factors with partial pivoting (gbtrf). The order of the unknowns is theirs in M, or the
reverse Cuthill-McKee order if the band is narrower in that.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.double_double import DoubleDouble
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.fixed_point import FixedPointFactors
from lcpcli.linalg.matrices import is_symmetric
from lcpcli.linalg.patterns import narrow_order
from lcpcli.typing import Mask, Matrix, Vector

# Operations of a band factorization up to which it takes no longer than SuperLU, and up
# to which it takes milliseconds, whatever the fill-in of SuperLU.
MAX_OPERATIONS, FEW_OPERATIONS = 6e8, 1e7
# The largest ratio of the numbers of the band to the entries of M, unless the
# factorization takes FEW_OPERATIONS.
MAX_OF_ENTRIES = 64
# Operations of a fixed-point factorization, of 0.1 microseconds each: one second.
MAX_FIXED_POINT = 1e7


class Banded:
    """The band of a sparse M, and factors of M + diag(d), or of a principal submatrix.

    order : the unknowns in the order of the band; None if that is their order in M.
    width : the largest distance of an entry from the diagonal in that order.
    """

    def __init__(self, M: Matrix, symmetric: bool | None = None) -> None:
        """symmetric : whether M is symmetric; None if that is not known."""
        n = M.shape[0]
        self.n, self.order, self.width = n, *narrow_order(M)
        self.is_symmetric = is_symmetric(M) if symmetric is None else symmetric
        self._M = M

    @property
    def operations(self) -> float:
        """Return the number of operations of a factorization within the band."""
        return float(self.n) * (self.width + 1) ** 2

    @property
    def is_affordable(self) -> bool:
        """Return whether factors in the band take little more time than those of
        SuperLU.
        """
        if self.n * (self.width + 1) > MAX_OF_ENTRIES * self._M.nnz:
            return self.operations <= FEW_OPERATIONS
        return self.operations <= MAX_OPERATIONS

    @property
    def has_fixed_point(self) -> bool:
        """Return whether factors in fixed-point arithmetic take at most a second."""
        return self.operations <= MAX_FIXED_POINT

    @cached_property
    def _band(self) -> Vector:
        """The band of M in LAPACK's format: row k = 0, ..., width has M[j + k, j] in
        column j. For a nonsymmetric M these rows are preceded by those of k = -width,
        ..., -1.
        """
        M = self._M
        n = self.n
        above = 0 if self.is_symmetric else self.width
        band = np.zeros((above + self.width + 1, n), order="F")
        rows, columns = np.repeat(np.arange(n), np.diff(M.indptr)), M.indices
        if self.order is not None:
            positions = np.empty(n, dtype=np.intp)
            positions[self.order] = np.arange(n)
            rows, columns = positions[rows], positions[columns]
        is_stored = rows - columns >= -above
        band[(rows - columns + above)[is_stored], columns[is_stored]] = M.data[
            is_stored
        ]
        return band

    @cached_property
    def _lapack(self) -> Any:
        with imports:
            from scipy.linalg import get_lapack_funcs
        names = ("pbtrf", "pbtrs") if self.is_symmetric else ("gbtrf", "gbtrs")
        return get_lapack_funcs(names)

    def _ordered(self, v: Vector) -> Vector:
        return v if self.order is None else np.asarray(v[self.order])

    def _in_place(self, x: Vector) -> Vector:
        if self.order is None:
            return x
        placed: Vector = np.empty_like(x)
        placed[self.order] = x
        return placed

    def _changed(self, d: Vector | None, basic: Mask | None) -> Vector:
        """Return the band of M + diag(d), in which the rows and columns of nonbasic
        variables are those of the identity.
        """
        band: Vector = self._band.copy("F")
        middle = band.shape[0] - self.width - 1
        if d is not None:
            band[middle] += self._ordered(d)
        if basic is None:
            return band
        is_basic = basic if self.order is None else basic[self.order]
        for k in range(-middle, self.width + 1):
            # M[j + k, j] for the j that have a row j + k
            first, last = max(0, -k), self.n - max(0, k)
            both = is_basic[first:last] & is_basic[first + k : last + k]
            band[middle + k, first:last] *= both
        band[middle, ~is_basic] = 1.0
        return band

    def factorize(self, d: Vector | None, basic: Mask | None = None) -> None:
        """Factorize M + diag(d), or M_BB for basic variables B; raise SingularMatrix if
        LAPACK finds it singular, or a symmetric one not positive definite.
        """
        band = self._changed(d, basic)
        w = self.width
        factorize, solve = self._lapack
        call: Callable[[], Any]
        if self.is_symmetric:
            call = partial(factorize, band, lower=True, overwrite_ab=True)
        else:
            # gbtrf needs w more rows for the fill-in of row interchanges.
            padded_band = np.zeros((3 * w + 1, self.n), order="F")
            padded_band[w:] = band
            call = partial(factorize, padded_band, w, w, overwrite_ab=True)
        factor, *pivots, info = call()
        if info:
            raise SingularMatrix
        self._solve: Callable[[Vector], Any] = (
            partial(solve, factor, lower=True)
            if self.is_symmetric
            else lambda b: solve(factor, w, w, b, *pivots)
        )

    def solve(self, b: Vector) -> Vector:
        """Return the solution of the last factorized system for b of shape (n,); for
        M_BB, b must be 0 outside B.
        """
        return self._in_place(self._solve(self._ordered(b))[0])

    def fixed_point_factors(
        self, d: Vector | None, basic: Mask | None
    ) -> FixedPointFactors:
        """Return the factors that `factorize` computes in fixed-point arithmetic, where
        d is added without rounding; raise SingularMatrix if a pivot is 0.
        """
        band, w = self._changed(None, basic), self.width
        added = None if d is None else self._ordered(d)
        if self.is_symmetric:
            return FixedPointFactors(band, None, added)
        upper = np.zeros((w + 1, self.n))
        for k in range(w + 1):
            upper[k, : self.n - k] = band[w - k, k:]
        return FixedPointFactors(band[w:], upper, added)

    def fixed_point(
        self, d: Vector | None, basic: Mask | None = None
    ) -> tuple[Callable[[Vector], DoubleDouble], bool]:
        """Return a solver as `solve` is, in double-double numbers by factors in
        fixed-point arithmetic, and whether all pivots are positive; raise
        SingularMatrix if a pivot is 0.
        """
        factors = self.fixed_point_factors(d, basic)

        def solve(b: Vector) -> DoubleDouble:
            x = factors.solve(self._ordered(b))
            return DoubleDouble(self._in_place(x.high), self._in_place(x.low))

        return solve, factors.is_definite
