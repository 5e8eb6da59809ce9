"""The systems (M + D) x = b of the steps, solved more accurately than their regularized factors are.

The factors are of M + D + rho; refinement removes rho, and where it converges slowly, GMRES with the factors as its
preconditioner (Y. Saad, M. H. Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856-869). rho grows where the factors
themselves are poor, and shrinks where it is what slows refinement.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.shifted_systems import Systems
from lcpcli.typing import Matrix, Vector

REFINEMENTS = 8
SLOW = 0.3  # the factor per refinement above which GMRES takes over
ACCURACY = 1e-13  # of a solution, relative to the right-hand side
DOUBTFUL, POOR = 1e-9, 1e-7  # residuals: of refinement, and of the factors
KRYLOV = 12  # steps of GMRES


@dataclass
class Regularization:
    """rho, and its range."""

    rho: float = 1e-8
    least: float = 1e-13
    most: float = 1e-7


class AccurateSystems:
    """Systems of one M and regularization; `solve` also returns the residual that is left."""

    def __init__(self, M: Matrix, systems: Systems, regularization: Regularization) -> None:
        self._M, self._systems, self.regularization = M, systems, regularization
        self._of_factors = self._left = 0.0
        self._used_gmres = False

    def factorize(self, D: Vector) -> None:
        """Factorize M + D + rho, after rho has been adapted to the last systems."""
        own = self.regularization
        if self._of_factors > POOR:
            own.rho = min(own.rho * 10, own.most)
        elif self._used_gmres or self._left > DOUBTFUL:
            own.rho = max(own.rho / 10, own.least)
        self._of_factors, self._left, self._used_gmres = 0.0, 0.0, False
        self._D, self._weights = D, 1.0 / (1.0 + D)
        self._systems.factorize(D + own.rho)

    def solve(self, b: Vector, target: float = 0.0) -> tuple[Vector, Vector]:
        """x and b - (M + D) x, whose weighted norm is at most the target or ACCURACY of that of b, if possible."""
        x = self._systems.solve(b)
        if not np.isfinite(x).all():
            raise SingularMatrix
        size = self._norm(b) + 1e-300
        goal = max(ACCURACY * size, target)
        r = b - self._product(x)
        self._of_factors = max(self._of_factors, self._norm(r - self.regularization.rho * x) / size)
        x, r, left = self._refined(x, r, b, goal)
        if left > max(10 * goal, DOUBTFUL * size):
            x, r, left = self._by_gmres(x, r, b, goal)
        self._left = max(self._left, left / size)
        return x, r

    def _refined(self, x: Vector, r: Vector, b: Vector, goal: float) -> tuple[Vector, Vector, float]:
        left = self._norm(r)
        for _ in range(REFINEMENTS):
            if left <= goal:
                break
            better = x + self._systems.solve(r)
            residual = b - self._product(better)
            size = self._norm(residual)
            if not size < left:
                break
            rate, x, r, left = size / left, better, residual, size
            if rate > SLOW:
                break
        return x, r, left

    def _by_gmres(self, x: Vector, r: Vector, b: Vector, goal: float) -> tuple[Vector, Vector, float]:
        with imports:
            from scipy.sparse.linalg import LinearOperator, gmres

        self._used_gmres, n, weights = True, b.size, self._weights
        operator = LinearOperator((n, n), lambda y: weights * self._product(self._systems.solve(y / weights)))
        y, _ = gmres(operator, weights * r, rtol=0.0, atol=0.1 * goal, restart=KRYLOV, maxiter=1)
        better = x + self._systems.solve(y / weights)
        residual = b - self._product(better)
        size, left = self._norm(residual), self._norm(r)
        return (better, residual, size) if size < left else (x, r, left)

    def _product(self, x: Vector) -> Vector:
        product: Vector = self._M @ x
        product += self._D * x
        return product

    def _norm(self, v: Vector) -> float:
        return float(np.abs(self._weights * v).max(initial=0.0))
