"""Systems of a sparse M with M + M' positive definite, solved to more digits than
doubles have.

A solution starts from factors in doubles and is refined by residuals in twice the
precision (J. H. Wilkinson, Rounding Errors in Algebraic Processes (1963), chapter 3),
which converges while the condition number in scaled units is below about 1e15. Where it
does not, a narrow band has factors in fixed-point numbers instead.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from lcpcli.linalg.banded import Banded
from lcpcli.linalg.double_double import AccurateProduct, DoubleDouble
from lcpcli.linalg.doubles import EPS, ROUNDING
from lcpcli.linalg.factors import SingularMatrix, Solve
from lcpcli.linalg.matrices import absolute_product, principal
from lcpcli.linalg.shifted_systems import systems
from lcpcli.typing import Mask, Matrix, Vector

# Relative to the right-hand side: more accuracy of a direction gains nothing.
LEAST_ACCURACY = 1e-12
# Of the residual, by a step of refinement: a larger factor ends it.
SLOW_REFINEMENT = 0.5
MOST_REFINEMENTS = 12
# Relative to the right-hand side: what a solution may leave that refinement does not
# improve.
USELESS = 1e-2
# Of a basic solution: a change that is not refined, relative to the largest component,
# and of every component, relative to itself.
SETTLED, LAST_DIGIT = EPS**1.6, EPS / 8
# In scaled units: rounding of the entries of a definite M takes its eigenvalues no
# further below 0.
SHIFT = 4 * EPS
Accurate: TypeAlias = Callable[[Vector], DoubleDouble]


class DefiniteSystems:
    """Systems of one M, with one diagonal or one basis after another.

    product : M z + q for z in double-double. extended : how many factorizations were in
    fixed-point numbers.
    """

    def __init__(self, M: Matrix, S: Vector | None) -> None:
        self._M, self._S, self.product = M, S, AccurateProduct(M)
        self._row_sum = float(absolute_product(M, np.ones(M.shape[0])).max())
        band = Banded(M, None if S is None else bool((S > 0).all()))
        self._band = band if band.is_affordable else None
        self._sparse: Any = None if self._band else systems(M, S)
        self.extended, self.is_definite = 0, True
        self._in_doubles: Solve | None = None
        self._exact: Accurate | None = None

    def factorize(self, D: Vector) -> None:
        """Factorize M + diag(D), or with SHIFT added where rounding of the entries of M
        has made that indefinite; raise SingularMatrix if that is indefinite too."""
        try:
            self._factorize(D)
        except SingularMatrix:
            self._factorize(D + SHIFT)

    def _factorize(self, D: Vector) -> None:
        self._D, self._weights, self._exact = D, 1.0 / (1.0 + D), None
        try:
            own = self._band or self._sparse
            own.factorize(D)
            self._in_doubles = own.solve
        except SingularMatrix:
            self._in_doubles = None
            self._exact = self._in_fixed_point(D, None)

    def solve(self, b: Vector, target: float = 0.0) -> tuple[DoubleDouble, Vector]:
        """Return x and b - (M + D) x, of a weighted norm up to the target or
        LEAST_ACCURACY |b|; raise SingularMatrix if that is out of reach."""
        size = self._norm(b)
        goal = max(LEAST_ACCURACY * size, target)
        if self._in_doubles is not None and self._exact is None:
            x = DoubleDouble.of(self._in_doubles(b))
            # The backward error of Cholesky's method is a small multiple of this.
            if ROUNDING * self._row_sum * float(np.abs(x.high).max()) <= goal:
                return x, np.zeros(b.size)
            r, last = self._residual(x, b), np.inf
            for _ in range(MOST_REFINEMENTS):
                left = self._norm(r)
                if left <= goal:
                    return x, r
                if not left <= SLOW_REFINEMENT * last:
                    break
                last = left
                x = x + self._in_doubles(r)
                r = self._residual(x, b)
            if not self._can_extend and left <= USELESS * size:
                return x, r
            self._exact = self._in_fixed_point(self._D, None)
        assert self._exact is not None
        return self._exact(b), np.zeros(b.size)

    def basic(self, q: Vector, z: Vector, basic: Mask) -> tuple[DoubleDouble, Vector]:
        """Return z with z_B such that w_B = (M z + q)_B = 0, for z elsewhere as it is
        given, and its w; raise SingularMatrix if M_BB is not definite, or refinement
        does not converge."""
        start = DoubleDouble.of(np.where(basic, 0.0, z))
        w = self.product(start, q)
        if not basic.any():
            return start, w
        try:
            refined = self._refined_basis(start, w, q, basic)
            if refined is not None:
                return refined
        except SingularMatrix:
            if not self._can_extend:
                raise
        exact = self._in_fixed_point(None, basic)
        change = exact(np.where(basic, -w, 0.0))
        found = start + change
        # Which removes what the rounding of w has left
        w = self.product(found, q)
        found = found + exact(np.where(basic, -w, 0.0))
        return found, np.where(basic, 0.0, self.product(found, q))

    def _refined_basis(
        self, z: DoubleDouble, w: Vector, q: Vector, basic: Mask
    ) -> tuple[DoubleDouble, Vector] | None:
        """Return what `basic` does, by factors in doubles; None if refinement does not
        converge."""
        solve, last = self._basis_solver(basic), np.inf
        for _ in range(MOST_REFINEMENTS):
            change = solve(np.where(basic, -w, 0.0))
            size = float(np.abs(change).max())
            if not size <= SLOW_REFINEMENT * last:
                return None
            z, last = z + change, size
            w = self.product(z, q)
            sizes = np.abs(z.high)
            if (
                size <= SETTLED * float(sizes.max())
                or (np.abs(change) <= LAST_DIGIT * sizes).all()
            ):
                return z, np.where(basic, 0.0, w)
        return None

    def _basis_solver(self, basic: Mask) -> Solve:
        if self._band:
            self._band.factorize(None, basic)
            return self._band.solve
        B = basic.nonzero()[0]
        own = systems(
            principal(self._M, B), None if self._S is None else self._S[B], once=True
        )
        own.factorize(np.zeros(B.size))

        def solve(b: Vector) -> Vector:
            x = np.zeros(b.size)
            x[B] = own.solve(b[B])
            return x

        return solve

    @property
    def _can_extend(self) -> bool:
        return self._band is not None and self._band.has_fixed_point

    def _in_fixed_point(self, D: Vector | None, basic: Mask | None) -> Accurate:
        if self._band is None or not self._can_extend:
            raise SingularMatrix
        self.extended += 1
        solve, is_definite = self._band.fixed_point(D, basic)
        if D is not None and not is_definite:
            raise SingularMatrix
        self.is_definite &= is_definite
        accurate: Accurate = solve
        return accurate

    def _residual(self, x: DoubleDouble, b: Vector) -> Vector:
        # D x is one of the terms: its rounding is that of D.
        return -self.product(x, self._D * x.high - b)

    def _norm(self, v: Vector) -> float:
        return float(np.abs(self._weights * v).max(initial=0.0))
