"""How accurate a z is, always measured on the original M and q."""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg import products
from lcpcli.linalg.accurate import accurate_residual
from lcpcli.linalg.doubles import ROW_ROUNDING, are_moderate, largest, least
from lcpcli.linalg.equilibration import equilibrate
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.problem import CANCELLATION, Problem
from lcpcli.typing import Indices, Vector

SCALE_FLOOR = 1e-5  # relative to the problem's scale: the least scale of a row
SMALLEST = -1074  # the power of two of the smallest number: the loss by an underflow
LARGEST_POWER = 1000  # of two, in one factor
PRECISION = 1e-13  # the smallest relative residual that is distinguishable from rounding
NEGLIGIBLE = 0.1  # the fraction of the tolerance, or of the certain residual, up to which rounding is ignored


class Accuracy:
    """The measures of one problem. All are maxima over components; NaN and overflow count as infinity.

    natural residual : |min(z, w)|_inf with w = M z + q, in the problem's own units; zero exactly at the solutions. With
        bounds, min(z, w) is z - mid(l, u, z - w) = max(z - u, min(z - l, w)) here and below.
    relative residual : the largest |min(z / C, R w)|_i / s_i with the diagonals R, C of `equilibrate`. s_i is the scale
        of row i, max(|R q|_i, (R |M| z)_i), but at most s and at least SCALE_FLOOR s, where s is the scaled residual of
        z = 0 (largest |R q|_i if z = 0 solves the problem). So neither a large entry of q in another row nor a z that
        tends to infinity hides the residual of a row. Scaled numbers are in units of the power of two next above s, so
        that no overflow or underflow matters. With bounds, the reference point of the problem takes the place of 0, its
        w that of q and the distance from it that of |z|, so that no scale depends on where the bounds lie.
    error : |z - z*|_inf to the nearest of the problem's solutions.
    size : `size_of_solutions`.

    tol is the largest relative residual of a solution; `w` is accurate enough to decide it. R, C and s are computed
    when they are first needed.
    """

    def __init__(self, problem: Problem, tol: float = 1e-10, greatest: float | None = None) -> None:
        self.problem, self.tol = problem, tol
        # s before scaling; if it is not positive, the reference point is a solution
        self.greatest = _greatest(problem) if greatest is None else greatest
        self.diagonal: Vector = problem.M.diagonal()

    @cached_property
    def size(self) -> float:
        return size_of_solutions(self.problem)

    @cached_property
    def units(self) -> Units:
        return Units(self.problem)

    @np.errstate(over="ignore", invalid="ignore")
    def w(self, z: Vector) -> Vector:
        """w = M z + q for finite z of shape (n,), rounded only once in rows where rounding errors could matter."""
        return self.recomputed(z, self.problem.w(z))

    def recomputed(self, z: Vector, w: Vector) -> Vector:
        """w with its doubtful rows recomputed and rounded only once."""
        doubtful = self._doubtful(z, w)
        if doubtful.size:
            w[doubtful] = _rounded_once(self.problem, z, doubtful)
        return w

    def _doubtful(self, z: Vector, w: Vector) -> Indices:
        """Rows of w whose rounding errors could matter: near the tolerance, and not dominated by a certain residual.

        These are rows with |M| z far above s, as for ill-conditioned M, and with numbers out of range.
        """
        moved = self.problem.from_reference(z)
        if not moved.any():
            return np.empty(0, dtype=np.intp)
        s, units = self.units.scale, self.units
        if not s:
            return np.flatnonzero(~np.isfinite(w) | (not self.problem.box.gaps(z, w).any()))
        distances, outer = self._distances(z), times(w, units.to_rows)
        residual = np.abs(distances.gaps(outer))
        size = _largest(residual)
        columns = float(np.abs(times(moved, units.to_columns)).sum())
        bound = 3 * ROW_ROUNDING * max(1.0, 2 * columns / s)  # as no entry of R |M| C is above 2
        bound += units.underflow / (SCALE_FLOOR * s) + ROW_ROUNDING * CANCELLATION * self.problem.is_mixed
        if bound <= NEGLIGIBLE * max(self.tol, PRECISION, size / s) < math.inf:
            return np.empty(0, dtype=np.intp)
        terms = times(products.absolute_product(self.problem.M, np.abs(moved)), units.to_rows)
        lost, scales = self.rounding(terms), self.row_scales(terms)
        certain = float(np.nan_to_num((residual - lost) / scales, nan=0.0, posinf=0.0).max())
        negligible = lost <= NEGLIGIBLE * max(self.tol, PRECISION, certain) * scales
        negligible |= distances.gaps(outer - lost) == distances.gaps(outer + lost)
        return np.flatnonzero(~negligible)

    def _distances(self, z: Vector) -> Distances:
        """z - l and z - u in scaled units."""
        low, high = self.problem.box.distances(z)
        units = self.units.to_columns
        return Distances(times(low, units), None if high is None else times(high, units))

    def rounding(self, terms: Vector) -> Vector:
        """A bound on the rounding errors in the scaled w, for its scaled terms."""
        lost: Vector = ROW_ROUNDING * (terms + self.units.Rq) + (self.units.underflow + self.units.q_error)
        return lost

    def row_scales(self, terms: Vector) -> Vector:
        """s_i for R |M| z."""
        s = self.units.scale
        scales: Vector = np.minimum(np.maximum(np.maximum(self.units.Rq, terms), SCALE_FLOOR * s), s)
        return scales

    def natural_residual(self, z: Vector, w: Vector) -> float:
        return _largest(self.problem.box.gaps(z, w))

    def scaled_residual(self, z: Vector, w: Vector) -> float:
        """The largest |min(z / C, R w)|_i / s: like the relative residual, but with the same scale s for all rows.

        At most the relative residual; what solvers with a single tolerance can be asked for.
        """
        return _largest(self._scaled(z, w)) / (self.units.scale or math.inf)

    def _scaled(self, z: Vector, w: Vector) -> Vector:
        return np.abs(self._distances(z).gaps(times(w, self.units.to_rows)))

    def relative_residual(self, z: Vector, w: Vector, sizes: Vector | None = None) -> float:
        """sizes : |M| z, if it is known."""
        return _largest(self.relative_residuals(z, w, sizes))

    def sizes(self, z: Vector) -> Vector:
        """|M| z, or with bounds |M| times the distance from the reference point: the sizes of the terms of w."""
        moved = self.problem.from_reference(z)
        return products.absolute_product(self.problem.M, np.abs(moved) if self.problem.is_mixed else moved)

    def surely_solves(self, z: Vector, w: Vector, sizes: Vector) -> bool:
        """Whether the relative residual of an admissible z is at most tol whatever the rounding errors in w are."""
        terms = times(sizes, self.units.to_rows)
        lost, distances, outer = self.rounding(terms), self._distances(z), times(w, self.units.to_rows)
        excess = distances.largest_gaps(outer - lost, outer + lost)
        return bool((excess <= self.tol * self.row_scales(terms)).all())

    def relative_residuals(self, z: Vector, w: Vector, sizes: Vector | None = None) -> Vector:
        """The relative residual of each component; the largest is that of z."""
        residual = self._scaled(z, w) if self.units.scale else self.problem.box.gaps(z, w)
        if not residual.any():
            return residual
        if not self.units.scale or not np.isfinite(residual).all():
            return np.where(residual == 0, 0.0, math.inf)
        sizes = self.sizes(z) if sizes is None else sizes
        ratios: Vector = residual / self.row_scales(times(sizes, self.units.to_rows))
        return ratios

    def is_rounding(self, z: Vector, w: Vector) -> bool:
        """Whether the relative residual is at rounding level, so that its digits depend on the machine."""
        return self.scaled_residual(z, w) <= ROW_ROUNDING and self.relative_residual(z, w) <= ROW_ROUNDING

    @np.errstate(over="ignore", invalid="ignore")
    def bound(self, F: Vector) -> float:
        """The size of F(x) = M z - w' + q, with the z and w' of x, relative to the problem's scale.

        min(z, M z + q) = min(z, w' + F) and min(z, w') = 0, so |min(z, M z + q)| <= |F| componentwise, scaled or not:
        if this is small, the relative residual is at most 1 / SCALE_FLOOR times as large. So too with bounds, as
        t -> mid(l, u, t) is nonexpansive.
        """
        if not np.count_nonzero(F):
            return 0.0
        units = self.units
        return _largest(times(F, units.to_rows)) / units.scale if units.scale else math.inf

    def error(self, z: Vector) -> float | None:
        return min((_largest(z - solution) for solution in self.problem.solutions), default=None)


class Distances(NamedTuple):
    """z - l and z - u, the latter None without upper bounds: z and None for an LCP."""

    low: Vector
    high: Vector | None

    def gaps(self, w: Vector) -> Vector:
        """max(z - u, min(z - l, w))."""
        gaps = np.minimum(self.low, w)
        return gaps if self.high is None else np.maximum(gaps, self.high)

    def largest_gaps(self, least_w: Vector, largest_w: Vector) -> Vector:
        """The largest |gaps| for any w between the two, as they increase with w."""
        return np.maximum(np.abs(self.gaps(least_w)), np.abs(self.gaps(largest_w)))


class Units:
    """What it takes to scale residuals.

    to_rows, to_columns : multiply by R and divide by C, in units of the power of two next above s.
    underflow : bounds what underflow loses in a row. Rq : |R q|, with bounds at the reference point. scale : s.
    q_error : R times `Problem.q_error`.
    """

    def __init__(self, problem: Problem) -> None:
        q = problem.q_ref
        R, C = equilibrate(problem.M, q, problem.row_maxima)
        row_power, column_power = (np.frexp(diagonal)[1] - 1 for diagonal in (R, C))
        gaps, reach = _at_reference(problem)
        decisive = gaps != 0 if gaps.any() else q != 0
        powers = np.frexp(q)[1] + row_power
        if reach is not None:  # the distance to the violated bound may be shorter
            powers = np.minimum(powers, np.where(np.isfinite(reach), np.frexp(reach)[1] - column_power, 10**6))
        unit = int(powers.max(where=decisive, initial=-(10**6))) if decisive.any() else 0
        self.to_rows, self.to_columns = _factors(row_power - unit), _factors(-column_power - unit)
        self.underflow = math.ldexp(problem.n, min(SMALLEST + int(row_power.max()) - unit, 0))
        with np.errstate(over="ignore"):
            self.Rq = np.abs(times(q, self.to_rows))
            self.q_error = times(problem.q_error, self.to_rows) if isinstance(problem.q_error, np.ndarray) else 0.0
            sizes = self.Rq if reach is None else np.minimum(self.Rq, times(reach, self.to_columns))
        self.scale = float(sizes.max(where=decisive, initial=0.0))


def _greatest(problem: Problem) -> float:
    """The largest |min(z, w)|_i at the reference point; for an LCP, the largest -q_i."""
    if not problem.is_mixed:
        return -least(problem.q)
    return largest(_at_reference(problem)[0])


def _at_reference(problem: Problem) -> tuple[Vector, Vector | None]:
    """min(z, w) at the reference point; and the distance to the bound that w points to, None for an LCP."""
    q = problem.q_ref
    if not problem.is_mixed:
        return np.minimum(q, 0.0), None
    z = problem.reference_point
    gaps = problem.box.gaps(z, q)
    reach = np.where(q > 0, z - problem.lower, problem.upper - z)
    return gaps, np.where(gaps == 0, np.inf, reach)


def size_of_solutions(problem: Problem) -> float:
    """The largest component of the problem's solutions, 1 if all are 0: the unit of errors."""
    return max((_largest(solution) for solution in problem.solutions), default=0.0) or 1.0


def _largest(v: Vector) -> float:
    size = largest(v)
    return size if size < math.inf else math.inf


def _factors(powers: Indices) -> tuple[Vector, ...]:
    """Each power of two as a product of factors in range, all at least 1 or all at most 1."""
    if max(int(powers.max()), -int(powers.min())) <= LARGEST_POWER:
        return (np.ldexp(1.0, powers),)
    within = np.clip(powers, -LARGEST_POWER, LARGEST_POWER)
    return np.ldexp(1.0, within), *_factors(powers - within)


def times(v: Vector, factors: tuple[Vector, ...]) -> Vector:
    for factor in factors:
        v = v * factor
    return v


def _rounded_once(problem: Problem, z: Vector, rows: Indices) -> Vector | list[float]:
    """(M z + q)_i for some rows, computed exactly and then rounded; infinite beyond the largest double."""
    M, q = problem.M[rows], problem.q[rows]
    if are_moderate(M.data if is_sparse(M) else M) and are_moderate(z) and are_moderate(q):
        w: Vector = 0.0 - accurate_residual(M, z, -q)
        return w
    with imports:
        from lcpcli.rational import sums

    used = [slice(*M.indptr[i : i + 2]) for i in range(rows.size)] if is_sparse(M) else []
    parts = [(M.data[part], z[M.indices[part]]) for part in used] if used else [(row, z) for row in M]
    return [sums.rounded_sum(*part, value) for value, part in zip(q.tolist(), parts, strict=True)]
