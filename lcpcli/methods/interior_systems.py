"""The linear systems of the interior point method's steps.

The systems (M + D) x = b are solved more accurately than by their regularized factors, of M + D + rho, alone:
refinement removes rho, and where it converges slowly, GMRES takes over with the factors as its preconditioner (Y. Saad,
M. H. Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856-869). rho grows where the factors themselves are poor, and
shrinks where rho itself slows refinement.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import multiplier
from lcpcli.linalg.shifted_systems import Systems
from lcpcli.typing import Matrix, Vector

SYSTEM_REFINEMENTS = 8  # each costs a solve; GMRES takes over if they are not enough
SLOW_REFINEMENT = 0.3  # the factor per refinement above which GMRES takes over
LEAST_ACCURACY = 1e-13  # of a solution, relative to the right-hand side: more is out of reach in doubles
DOUBTFUL_RESIDUAL = 1e-5  # relative to the right-hand side: refinement that leaves more calls for a smaller rho
POOR_FACTORS, USELESS_FACTORS = 1e-7, 1e-2  # the same of the factors: a larger rho next time, or at once
GMRES_STEPS, GMRES_LOOK = 8, 4  # at most, and between looks at what is left


@dataclass
class Regularization:
    """The regularization rho, with its range."""

    rho: float = 1e-8
    least: float = 1e-13
    most: float = 1e-7


class AccurateSystems:
    """Systems with one M and its regularization; `solve` also returns the residual that is left."""

    def __init__(self, M: Matrix, systems: Systems, regularization: Regularization) -> None:
        self._times, self._systems, self.regularization = multiplier(M), systems, regularization
        self._of_factors = self._left = 0.0
        self._used_gmres = False

    def factorize(self, D: Vector) -> None:
        """Adapt rho to the last systems, and factorize M + D + rho."""
        own = self.regularization
        if self._of_factors > POOR_FACTORS:
            own.rho = min(own.rho * 10, own.most)
        elif self._used_gmres or self._left > DOUBTFUL_RESIDUAL:
            own.rho = max(own.rho / 10, own.least)
        self._of_factors, self._left, self._used_gmres = 0.0, 0.0, False
        self._D, self._weights = D, 1.0 / (1.0 + D)
        self._systems.factorize(D + own.rho)

    def solve(self, b: Vector, target: float = 0.0) -> tuple[Vector, Vector]:
        """Return x and b - (M + D) x, whose weighted norm is at most the target, or LEAST_ACCURACY times the norm of
        b, if that can be attained."""
        size, own = self._norm(b) + 1e-300, self.regularization
        goal = max(LEAST_ACCURACY * size, target)
        x, r, of_factors = self._first(b)
        while not of_factors <= USELESS_FACTORS * size and own.rho < own.most:
            own.rho = own.least = min(own.rho * 10, own.most)  # from now on the least one
            self._systems.factorize(self._D + own.rho)
            x, r, of_factors = self._first(b)
        if not np.isfinite(of_factors):
            raise SingularMatrix
        self._of_factors = max(self._of_factors, of_factors / size)
        x, r, left = self._refined(x, r, b, goal)
        if left > max(10 * goal, DOUBTFUL_RESIDUAL * size):
            x, r, left = self._by_gmres(x, r, b, goal)
        if left > 10 * goal:
            self._left = max(self._left, left / size)
        return x, r

    def _first(self, b: Vector) -> tuple[Vector, Vector, float]:
        """Return the x of the factors, its residual, and the norm of its residual in the factors' own system."""
        x = self._systems.solve(b)
        r = b - self._product(x)
        return x, r, self._norm(r - self.regularization.rho * x)

    def _refined(self, x: Vector, r: Vector, b: Vector, goal: float) -> tuple[Vector, Vector, float]:
        left = self._norm(r)
        for _ in range(SYSTEM_REFINEMENTS):
            if left <= goal:
                break
            better = x + self._systems.solve(r)
            residual = b - self._product(better)
            size = self._norm(residual)
            if not size < left:
                break
            rate, x, r, left = size / left, better, residual, size
            if rate > SLOW_REFINEMENT:
                break
        return x, r, left

    def _by_gmres(self, x: Vector, r: Vector, b: Vector, goal: float) -> tuple[Vector, Vector, float]:
        """Return x, its residual and the norm of the residual after at most GMRES_STEPS, which minimize that norm."""
        self._used_gmres, weights = True, self._weights
        V, Z = np.empty((GMRES_STEPS + 1, b.size)), np.empty((GMRES_STEPS, b.size))
        H, target = np.zeros((GMRES_STEPS + 1, GMRES_STEPS)), np.zeros(GMRES_STEPS + 1)
        V[0] = weights * r
        target[0] = np.linalg.norm(V[0])
        V[0] /= target[0]
        for k in range(GMRES_STEPS):
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
            if (k + 1) % GMRES_LOOK == 0:
                y = np.linalg.lstsq(H[: k + 2, : k + 1], target[: k + 2], rcond=None)[0]
                if np.linalg.norm(H[: k + 2, : k + 1] @ y - target[: k + 2]) <= 0.1 * goal:
                    break
        better = x + y @ Z[: y.size]
        residual = b - self._product(better)
        size, left = self._norm(residual), self._norm(r)
        return (better, residual, size) if size < left else (x, r, left)

    def _product(self, x: Vector) -> Vector:
        product = self._times(x)
        product += self._D * x
        return product

    def _norm(self, v: Vector) -> float:
        return float(np.abs(self._weights * v).max(initial=0.0))
