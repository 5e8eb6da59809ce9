"""How good a z is, always measured on the original M and q."""

from __future__ import annotations

import math

import numpy as np

from lcpcli import linalg
from lcpcli.problem import Problem
from lcpcli.scaling import equilibrate
from lcpcli.typing import Vector

FLOOR = 1e-5  # of the problem's scale: what is smaller than that in a row is still measured against it


class Accuracy:
    """The measures of one problem. All are maxima over components; NaN and overflow come out as infinity.

    natural residual : |min(z, w)|_inf with w = M z + q, in the problem's own units; zero exactly at the solutions.
    relative residual : the largest |min(z / C, R w)|_i / s_i with the diagonals R, C of `scaling.equilibrate`. s_i is
        the scale of row i, max(|R q|_i, (R |M| z)_i), but at most s and at least FLOOR s, where s is the scaled
        residual of z = 0 (largest |R q|_i if z = 0 solves the problem). So neither a large entry of q in another row
        nor a z that runs off to infinity makes a wrong row look right.
    error : |z - z*|_inf to the nearest of the problem's solutions.
    size : `size_of_solutions`.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.size = size_of_solutions(problem)
        self._R, self._C = equilibrate(problem.M, problem.q)
        Rq = self._R * problem.q
        self._Rq = np.abs(Rq)
        self._scale = -float(Rq.min()) if (Rq < 0).any() else float(self._Rq.max())

    def natural_residual(self, z: Vector, w: Vector) -> float:
        return _largest(np.minimum(z, w))

    def scaled_residual(self, z: Vector, w: Vector) -> float:
        """The largest |min(z / C, R w)|_i / s: as the relative residual, but all rows measured against one scale s.

        At most the relative residual; what solvers with one tolerance for all rows can be asked for.
        """
        return _largest(self._scaled(z, w)) / (self._scale or math.inf)

    def _scaled(self, z: Vector, w: Vector) -> Vector:
        return np.abs(np.minimum(z / self._C, self._R * w))

    def relative_residual(self, z: Vector, w: Vector) -> float:
        return _largest(self.relative_residuals(z, w))

    def relative_residuals(self, z: Vector, w: Vector) -> Vector:
        """The relative residual of each component, of which the largest one is that of z."""
        residual = self._scaled(z, w)
        if not residual.any():
            return residual
        if not 0 < self._scale < math.inf or not np.isfinite(residual).all():
            return np.where(residual == 0, 0.0, math.inf)
        terms = self._R * linalg.absolute_product(self.problem.M, z)
        own = np.clip(np.maximum(self._Rq, terms), FLOOR * self._scale, self._scale)
        ratios: Vector = residual / own
        return ratios

    def passes(self, z: Vector, w: Vector, tol: float) -> bool:
        """Whether the relative residual is at most tol; without the products with |M| where it clearly is not."""
        return self.scaled_residual(z, w) <= tol and self.relative_residual(z, w) <= tol

    def bound(self, F: Vector) -> float:
        """A measure of F(x) = M z - w' + q with z = |x| + x and complementary w' >= 0, relative to the problem's scale.

        min(z, M z + q) = min(z, w' + F) and min(z, w') = 0, so |min(z, M z + q)| <= |F| componentwise, scaled or not:
        where it is small, the relative residual is at most 1 / FLOOR times as large.
        """
        largest = _largest(self._R * F)
        if largest == 0:
            return 0.0
        return largest / self._scale if 0 < self._scale < math.inf else math.inf

    def error(self, z: Vector) -> float | None:
        return min((_largest(z - solution) for solution in self.problem.solutions), default=None)


def size_of_solutions(problem: Problem) -> float:
    """The largest component of the problem's solutions, 1 where all are 0: what errors are compared with."""
    return max((_largest(solution) for solution in problem.solutions), default=0.0) or 1.0


def _largest(v: Vector) -> float:
    largest = max(float(v.max()), -float(v.min()))
    return largest if largest < math.inf else math.inf
