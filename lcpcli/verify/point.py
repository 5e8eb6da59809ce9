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
from lcpcli.verify.accuracy import SCALE_FLOOR, Accuracy, Distances

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
    """An admissible z of shape (n,) with its measures, each computed when it is first read."""

    def __init__(self, accuracy: Accuracy, z: Vector) -> None:
        self.accuracy, self.z = accuracy, z
        self._plain_w: Vector | None = None
        self._sizes: Vector | None = None
        self._solves: bool | None = None
        moved = accuracy.problem.from_reference(z) if accuracy.problem.is_mixed else z
        self._is_reference = not np.count_nonzero(moved)  # whose residual is the problem's scale

    @classmethod
    def of_solution(cls, accuracy: Accuracy, z: Vector, w: Vector, is_reference: bool) -> Point:
        """One that is known to solve the problem, with its w."""
        point = cls.__new__(cls)
        point.accuracy, point.z, point._plain_w, point._is_reference = accuracy, z, w, is_reference
        point._sizes, point._solves = None, True
        return point

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
            self._solves = self.accuracy.greatest <= 0 if self._is_reference else self._passes()
        return self._solves

    @np.errstate(over="ignore", invalid="ignore")
    def _passes(self) -> bool:
        accuracy, z = self.accuracy, self.z
        w, M = accuracy.problem.w(z), accuracy.problem.M
        self._plain_w = w
        if M.size <= FEW:
            self._sizes = accuracy.sizes(z)
        if self._clearly_solves(z, w, self._sizes):
            return True
        if accuracy.scaled_residual(z, w) > accuracy.tol:
            return False
        if self._sizes is None:
            self._sizes = accuracy.sizes(z)
        return accuracy.surely_solves(z, w, self._sizes) or self.relative_residual <= accuracy.tol

    @cached_property
    def residual(self) -> float:
        return self.accuracy.natural_residual(self.z, self.w)

    @cached_property
    def relative_residual(self) -> float:
        if self._is_reference:  # its residual is its own scale
            return float(self.accuracy.greatest > 0)
        with np.errstate(over="ignore", invalid="ignore"):
            return self.accuracy.relative_residual(self.z, self.w, self._sizes)

    @cached_property
    def error(self) -> float | None:
        return self.accuracy.error(self.z)

    def _clearly_solves(self, z: Vector, w: Vector, sizes: Vector | None) -> bool:
        """Whether bounds show that the relative residual of an admissible z is at most tol.

        sizes : |M| z, if it is known; else it is computed only in rows that its bounds leave open. At first R and C are
        only bounded, by `range_of_units`.
        """
        problem = self.accuracy.problem
        low, high = range_of_units(least(self.accuracy.diagonal), problem.largest)
        if low > 0 and not problem.is_mixed and 1 / FAR < self.accuracy.greatest < FAR:
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
        moved = self.accuracy.problem.from_reference(z)
        sizes = products.absolute_product(self.accuracy.problem.M[rows], np.abs(moved))
        return not self._open_rows(z, w, sizes, known.part(rows), rows).size

    def _open_rows(
        self, z: Vector, w: Vector, sizes: Vector | None, known: _Known, rows: Indices | slice = slice(None)
    ) -> Indices:
        """Where, of some rows, the relative residual may exceed tol.

        (|M| z)_i is at least M_ii z_i, and at most the largest |M_ij| times the sum of z. The rounding error in w_i is
        at most ROW_ROUNDING (|M| z + |q|)_i, where |q_i| is at most |w_i| + (|M| z)_i.
        """
        problem = self.accuracy.problem
        moved = np.abs(problem.from_reference(z)) if problem.is_mixed else z
        most = problem.largest * float(moved.sum()) if sizes is None else sizes
        error, moved = 2 * ROW_ROUNDING * most, moved[rows]
        if problem.is_mixed:
            low, high = (
                distance[rows] * known.columns for distance in problem.box.distances(z) if distance is not None
            )
            error += problem.q_error[rows] if isinstance(problem.q_error, np.ndarray) else 0.0
            excess = Distances(low, high).largest_gaps(w[rows] - error, w[rows] + error)
        else:
            scaled = moved * known.columns
            excess = np.abs(np.minimum(scaled, w[rows] - error))
            excess += np.minimum(scaled, 2 * error)
        scales = np.maximum(
            np.abs(problem.q_ref[rows]), self.accuracy.diagonal[rows] * moved if sizes is None else sizes
        )
        scales = np.minimum(np.maximum(scales, SCALE_FLOOR * known.s), known.s)
        return (~(excess <= known.tol * (1 - SLACK) * scales)).nonzero()[0]
