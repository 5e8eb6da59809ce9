"""A point with its measures, and bounds that show it to be a solution before they are computed."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from lcpcli.linalg import products
from lcpcli.linalg.doubles import FAR, ROW_ROUNDING, least
from lcpcli.linalg.equilibration import range_of_units
from lcpcli.linalg.matrices import FEW
from lcpcli.typing import Indices, Vector
from lcpcli.verify.accuracy import SCALE_FLOOR, Accuracy, times

FEW_ROWS = 0.25  # of all: a product with so many is worth a chance to save one with all
SLACK = 100 * ROW_ROUNDING  # for the rounding of the bounds themselves, and of w in terms of w


class _Known(NamedTuple):
    """What is known of the units.

    columns, s : 1 / (R C), at most, and s / R, at least, each of shape (n,) or one number for all rows.
    tol : the tolerance times the factor by which R is uncertain.
    """

    columns: Vector | float
    s: Vector | float
    tol: float

    def part(self, rows: Indices) -> _Known:
        """The same for some rows."""
        columns, s = (v[rows] if isinstance(v, np.ndarray) else v for v in (self.columns, self.s))
        return _Known(columns, s, self.tol)


class Point:
    """A z >= 0 of shape (n,) with its measures, each computed when it is first read."""

    def __init__(self, accuracy: Accuracy, z: Vector) -> None:
        self.accuracy, self.z = accuracy, z
        self._plain_w: Vector | None = None
        self._sizes: Vector | None = None
        self._solves: bool | None = None

    @cached_property
    @np.errstate(over="ignore", invalid="ignore")
    def w(self) -> Vector:
        """M z + q, rounded once in rows where rounding errors decide whether z is a solution."""
        if self._plain_w is None:
            return self.accuracy.w(self.z)
        return self._plain_w if self._solves else self.accuracy.recomputed(self.z, self._plain_w.copy())

    def solves(self) -> bool:
        """Whether the relative residual is at most the tolerance, by bounds on it as far as they decide.

        If rounding errors in w hide that it is, this is False.
        """
        if self._solves is None:
            self._solves = self._passes() if np.count_nonzero(self.z) else self.accuracy.greatest <= 0
        return self._solves

    @np.errstate(over="ignore", invalid="ignore")
    def _passes(self) -> bool:
        accuracy, z = self.accuracy, self.z
        w, M = accuracy.problem.w(z), accuracy.problem.M
        self._plain_w = w
        if M.size <= FEW:
            self._sizes = products.absolute_product(M, z)
        if self._clearly_solves(z, w, self._sizes):
            return True
        if accuracy.scaled_residual(z, w) > accuracy.tol:
            return False
        if self._sizes is None:
            self._sizes = products.absolute_product(M, z)
        return self._surely_solves(z, w, self._sizes) or self.relative_residual <= accuracy.tol

    @cached_property
    def residual(self) -> float:
        return self.accuracy.natural_residual(self.z, self.w)

    @cached_property
    def relative_residual(self) -> float:
        if not np.count_nonzero(self.z):  # the residual of z = 0 is its own scale
            return float(self.accuracy.greatest > 0)
        with np.errstate(over="ignore", invalid="ignore"):
            return self.accuracy.relative_residual(self.z, self.w, self._sizes)

    @cached_property
    def error(self) -> float | None:
        return self.accuracy.error(self.z)

    def _clearly_solves(self, z: Vector, w: Vector, sizes: Vector | None) -> bool:
        """Whether bounds show that the relative residual of z >= 0 is at most tol.

        sizes : |M| z, if it is known; else it is computed only in rows that its bounds leave open. At first R and C are
        only bounded, by `range_of_units`.
        """
        low, high = range_of_units(least(self.accuracy.diagonal), self.accuracy.problem.largest)
        if low > 0 and 1 / FAR < self.accuracy.greatest < FAR:
            known = _Known(1 / (low * high), self.accuracy.greatest, self.accuracy.tol * low / high)
            if low == high:
                return self._are_closed(z, w, sizes, known)
            if not self._open_rows(z, w, sizes, known).size:
                return True
        (R, *more), (inverse, *others) = self.accuracy.units.to_rows, self.accuracy.units.to_columns
        known = _Known(inverse / R, self.accuracy.units.scale / R, self.accuracy.tol)
        return not (more or others) and self._are_closed(z, w, sizes, known)

    def _are_closed(self, z: Vector, w: Vector, sizes: Vector | None, known: _Known) -> bool:
        """Whether no row is open or, if few are, |M| z closes them."""
        rows = self._open_rows(z, w, sizes, known)
        if not rows.size or sizes is not None or rows.size > FEW_ROWS * z.size:
            return not rows.size
        sizes = products.absolute_product(self.accuracy.problem.M[rows], z)
        return not self._open_rows(z, w, sizes, known.part(rows), rows).size

    def _open_rows(
        self, z: Vector, w: Vector, sizes: Vector | None, known: _Known, rows: Indices | slice = slice(None)
    ) -> Indices:
        """Where, of some rows, the relative residual may exceed tol.

        (|M| z)_i is at least M_ii z_i, and at most the largest |M_ij| times the sum of z. The rounding error in w_i is
        at most ROW_ROUNDING (|M| z + |q|)_i, where |q_i| is at most |w_i| + (|M| z)_i.
        """
        most = self.accuracy.problem.largest * float(z.sum()) if sizes is None else sizes
        error, z = 2 * ROW_ROUNDING * most, z[rows]
        scaled = z * known.columns
        excess = np.abs(np.minimum(scaled, w[rows] - error))
        excess += np.minimum(scaled, 2 * error)
        scales = np.maximum(
            np.abs(self.accuracy.problem.q[rows]), self.accuracy.diagonal[rows] * z if sizes is None else sizes
        )
        scales = np.minimum(np.maximum(scales, SCALE_FLOOR * known.s), known.s)
        return (~(excess <= known.tol * (1 - SLACK) * scales)).nonzero()[0]

    def _surely_solves(self, z: Vector, w: Vector, sizes: Vector) -> bool:
        """Whether the relative residual of z >= 0 is at most tol whatever the rounding errors in w are.

        sizes : |M| z.
        """
        terms = times(sizes, self.accuracy.units.to_rows)
        lost = ROW_ROUNDING * (terms + self.accuracy.units.Rq) + self.accuracy.units.underflow
        inner, outer = times(z, self.accuracy.units.to_columns), times(w, self.accuracy.units.to_rows)
        excess = np.abs(np.minimum(inner, outer - lost)) + np.minimum(inner, 2 * lost)
        return bool((excess <= self.accuracy.tol * self.accuracy.row_scales(terms)).all())
