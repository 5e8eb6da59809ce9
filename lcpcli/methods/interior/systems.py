"""The systems (M + D) x = b of the steps, solved more accurately than their regularized factors are.

The factors are of M + D + rho; refinement removes rho, and where it converges slowly, GMRES with the factors as its
preconditioner (Y. Saad, M. H. Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856-869). rho grows where the factors
themselves are poor, and shrinks where it is what slows refinement.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.shifted_systems import Systems
from lcpcli.typing import Matrix, Vector

REFINEMENTS = 8
SLOW = 0.3  # the factor per refinement above which GMRES takes over
ACCURACY = 1e-13  # of a solution, relative to the right-hand side
DOUBTFUL, POOR, USELESS = 1e-6, 1e-7, 1e-2  # residuals: of refinement, and of the factors
KRYLOV, LOOK = 8, 4  # steps of GMRES: at most, and between looks at what is left


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
        size = self._norm(b) + 1e-300
        goal = max(ACCURACY * size, target)
        x, r, of_factors = self._first(b)
        while not of_factors <= USELESS * size and self._strengthened():
            x, r, of_factors = self._first(b)
        if not np.isfinite(of_factors):
            raise SingularMatrix
        self._of_factors = max(self._of_factors, of_factors / size)
        x, r, left = self._refined(x, r, b, goal)
        if left > max(10 * goal, DOUBTFUL * size):
            x, r, left = self._by_gmres(x, r, b, goal)
        self._left = max(self._left, left / size)
        return x, r

    def _first(self, b: Vector) -> tuple[Vector, Vector, float]:
        """The x of the factors, its residual, and the norm of what it leaves of their own system."""
        x = self._systems.solve(b)
        r = b - self._product(x)
        return x, r, self._norm(r - self.regularization.rho * x)

    def _strengthened(self) -> bool:
        """Factorize with a larger rho, from now on the least one; False if it is as large as it may be."""
        own = self.regularization
        if own.rho >= own.most:
            return False
        own.rho = own.least = min(own.rho * 10, own.most)
        self._systems.factorize(self._D + own.rho)
        return True

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
        """x, its residual and the size of that after at most KRYLOV steps, which minimize the weighted residual."""
        self._used_gmres, weights = True, self._weights
        V, Z = np.empty((KRYLOV + 1, b.size)), np.empty((KRYLOV, b.size))
        H, target = np.zeros((KRYLOV + 1, KRYLOV)), np.zeros(KRYLOV + 1)
        V[0] = weights * r
        target[0] = np.linalg.norm(V[0])
        V[0] /= target[0]
        for k in range(KRYLOV):
            Z[k] = self._systems.solve(V[k] / weights)
            V[k + 1] = weights * self._product(Z[k])
            for _ in range(2):  # once more against rounding
                along = V[: k + 1] @ V[k + 1]
                V[k + 1] -= along @ V[: k + 1]
                H[: k + 1, k] += along
            H[k + 1, k] = size = float(np.linalg.norm(V[k + 1]))
            if not 0 < size < np.inf:
                return x, r, self._norm(r)
            V[k + 1] /= size
            if (k + 1) % LOOK == 0:
                y = np.linalg.lstsq(H[: k + 2, : k + 1], target[: k + 2], rcond=None)[0]
                if np.linalg.norm(H[: k + 2, : k + 1] @ y - target[: k + 2]) <= 0.1 * goal:
                    break
        better = x + y @ Z[: y.size]
        residual = b - self._product(better)
        size, left = self._norm(residual), self._norm(r)
        return (better, residual, size) if size < left else (x, r, left)

    def _product(self, x: Vector) -> Vector:
        product: Vector = self._M @ x
        product += self._D * x
        return product

    def _norm(self, v: Vector) -> float:
        return float(np.abs(self._weights * v).max(initial=0.0))
