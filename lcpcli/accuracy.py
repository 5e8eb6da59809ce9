"""How good a z is, always measured on the original M and q."""

from __future__ import annotations

import math

import numpy as np

from lcpcli.problem import Problem
from lcpcli.scaling import equilibrate
from lcpcli.typing import Vector


class Accuracy:
    """The measures of one problem. All are maxima over components; NaN and overflow come out as infinity.

    natural residual : |min(z, w)|_inf with w = M z + q, in the problem's own units; zero exactly at the solutions.
    relative residual : |min(z / C, R w)|_inf / |R q|_inf with the diagonals R, C of `scaling.equilibrate`: the natural
        residual in units in which rescaling rows, columns or q changes nothing.
    error : |z - z*|_inf to the nearest of the known solutions.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._R, self._C = equilibrate(problem.M, problem.q)
        self._scale = float(np.max(np.abs(self._R * problem.q)))

    def natural_residual(self, z: Vector, w: Vector) -> float:
        return _largest(np.minimum(z, w))

    def relative_residual(self, z: Vector, w: Vector) -> float:
        return self._relative(_largest(np.minimum(z / self._C, self._R * w)))

    def bound(self, F: Vector) -> float:
        """A bound of the relative residual from F(x) = M z - w' + q with z = |x| + x and complementary w' >= 0.

        min(z, M z + q) = min(z, w' + F) and min(z, w') = 0, so |min(z, M z + q)| <= |F| componentwise, scaled or not.
        """
        return self._relative(_largest(self._R * F))

    def error(self, z: Vector) -> float | None:
        return min((_largest(z - solution) for solution in self._problem.solutions), default=None)

    def _relative(self, residual: float) -> float:
        if residual == 0:
            return 0.0
        return residual / self._scale if 0 < self._scale < math.inf else math.inf


def _largest(v: Vector) -> float:
    largest = max(float(v.max()), -float(v.min()))
    return largest if largest < math.inf else math.inf
