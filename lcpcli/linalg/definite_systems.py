"""Linear systems with a sparse M where M + M' is positive definite, solved to more
digits than double precision has.

Iterative refinement starts from factors in double precision and computes residuals in
twice the precision (J. H. Wilkinson, Rounding Errors in Algebraic Processes (1963),
chapter 3). It converges while the condition number of the diagonally scaled matrix is
below about 1e15. If it does not, a narrow band is factorized in fixed-point arithmetic
instead.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from lcpcli.linalg.banded import Banded
from lcpcli.linalg.double_double import AccurateProduct, DoubleDouble
from lcpcli.linalg.doubles import EPS, ROUNDING
from lcpcli.linalg.factors import SingularMatrix, Solve, positive_pivots, sparse_lu
from lcpcli.linalg.krylov import (
    StoppingCriterion,
    conjugate_gradients,
    extreme_eigenvalues,
    gmres,
)
from lcpcli.linalg.matrices import (
    absolute_product,
    is_symmetric,
    plus_diagonal,
    principal,
    scaled,
    with_data,
)
from lcpcli.linalg.shifted_systems import Bordered, SuperLU, dense_places
from lcpcli.typing import Indices, Mask, Matrix, Vector

# Residual relative to the right-hand side at which refinement stops: more accurate
# search directions do not make the methods converge in fewer steps.
MIN_ACCURACY = 1e-12
# Refinement stops when a step reduces the residual by less than this factor.
SLOW_REFINEMENT = 0.5
MAX_REFINEMENTS = 12
# The limit on the steps of the Krylov method that replaces a solve, and the reduction
# of the residual at which it stops.
KRYLOV_STEPS, KRYLOV_REDUCTION = 30, 1e-3
# A basic solution needs no further refinement when the last change is below REFINED
# times the largest component, or below LAST_DIGIT times every component.
REFINED, LAST_DIGIT = EPS**1.6, EPS / 8
# Rounding the entries of a positive definite M with diagonal 1 moves its eigenvalues no
# further below 0 than this.
SHIFT = 4 * EPS
Accurate: TypeAlias = Callable[[Vector], DoubleDouble]


def is_nearly_definite(M: Matrix) -> bool:
    """Return whether M + M', of a sparse M with a positive diagonal, is positive
    definite up to rounding of its entries: whether the diagonally scaled matrix plus
    SHIFT I has a Cholesky factorization.
    """
    S = _symmetric_part(M)
    band, shift = Banded(S, symmetric=True), np.full(M.shape[0], SHIFT)
    try:
        if band.is_affordable:
            band.factorize(shift)
            return True
        lu = sparse_lu(symmetric=True)(plus_diagonal(S, shift))
    except SingularMatrix:
        return False
    return positive_pivots(lu)


def condition(M: Matrix) -> float:
    """Return an estimate, correct to a factor of about two, of the condition number of
    the diagonally scaled M + M' of a sparse M with a positive diagonal; it is infinite
    if M + M' has no Cholesky factorization in double precision.
    """
    eigenvalues = extreme_eigenvalues(_symmetric_part(M))
    return math.inf if eigenvalues is None else eigenvalues[1] / eigenvalues[0]


def _symmetric_part(M: Matrix) -> Matrix:
    """Return D (M + M') D / 2 with the diagonal scaling D of `diagonal_units`."""
    D = diagonal_units(M)
    S = scaled(M, D, D)
    return S if is_symmetric(M) else (S + S.T) * 0.5


def diagonal_units(M: Matrix) -> Vector:
    """Return D, powers of two, for which the diagonal of D M D is about 1. If M + M' is
    positive definite, no other D makes its condition number much smaller (A. van der
    Sluis, Condition numbers and equilibration of matrices, Numerische Mathematik 14
    (1969) 14-23).
    """
    return np.asarray(np.exp2(np.rint(-0.5 * np.log2(M.diagonal()))))


class DefiniteSystems:
    """Solutions of systems with M + diag(D), for one D after another, and of systems
    with principal submatrices of M.

    product : M z + q for z in double-double. extended : the number of factorizations
    that were computed in fixed-point arithmetic. is_definite : False once a system has
    shown that M + M' + 2 diag(D) is not positive definite.
    """

    def __init__(self, M: Matrix, S: Vector | None) -> None:
        self.product = AccurateProduct(M)
        self._row_sum = float(absolute_product(M, np.ones(M.shape[0])).max())
        self._symmetric = bool(is_symmetric(M) if S is None else (S > 0).all())
        band = Banded(M, self._symmetric)
        self._band = band if band.is_affordable else None
        self._factors_in_doubles: Banded | _Sparse = self._band or _Sparse(M)
        self.extended = 0
        self.is_definite = True
        self._shift = 0.0
        self._exact: Accurate | None = None

    def factorize(self, D: Vector) -> None:
        """Factorize M + diag(D); raise SingularMatrix if that is not definite, even
        with SHIFT added to the diagonal for rounding of the entries.
        """
        self._D, self._exact = D + self._shift if self._shift else D, None
        self._weights = 1.0 / (1.0 + D)
        try:
            self._factors_in_doubles.factorize(self._D)
        except SingularMatrix:
            self._factors_in_doubles.factorize(D + SHIFT)

    def solve(self, b: Vector, target: float = 0.0) -> tuple[DoubleDouble, Vector]:
        """Return x and r = b - (M + diag(D)) x, whose weighted norm is at most the
        larger of `target` and MIN_ACCURACY |b|, unless the matrix proves indefinite;
        raise SingularMatrix if factors in fixed-point arithmetic fail.
        """
        if self._exact is not None:
            return self._exact(b), np.zeros(b.size)
        size = self._norm(b)
        goal = max(MIN_ACCURACY * size, target)
        x = DoubleDouble.of(self._factors_in_doubles.solve(b))
        # The backward error of Cholesky's method is a small multiple of EPS |A| |x|
        # (Higham, Accuracy and Stability of Numerical Algorithms, theorem 10.4).
        if ROUNDING * self._row_sum * float(np.abs(x.high).max()) <= goal:
            return x, np.zeros(b.size)
        for improve in (self._factors_in_doubles.solve, self._accelerated):
            x, r, residual_size = self._iterative_refinement(x, b, goal, improve)
            if residual_size <= goal:
                return x, r
        try:
            self._exact = self._in_fixed_point(self._D, None)
        except SingularMatrix:
            # Refinement has removed all components of the residual but those in
            # directions of negative or almost zero curvature.
            self.is_definite, self._shift = False, SHIFT
            return x, r
        return self._exact(b), np.zeros(b.size)

    def _iterative_refinement(
        self, x: DoubleDouble, b: Vector, goal: float, improve: Solve
    ) -> tuple[DoubleDouble, Vector, float]:
        """Return x, its residual and the norm of the residual after iterative
        refinement with the approximate solver `improve`, which stops when a step
        reduces the residual by less than SLOW_REFINEMENT.
        """
        r = self._residual(x, b)
        residual_size, last = self._norm(r), np.inf
        for _ in range(MAX_REFINEMENTS):
            if residual_size <= goal or not residual_size <= SLOW_REFINEMENT * last:
                break
            better = x + improve(r)
            r_of_better = self._residual(better, b)
            last, size = residual_size, self._norm(r_of_better)
            if not size < residual_size:
                break
            x = better
            r = r_of_better
            residual_size = size
        return x, r, residual_size

    def _accelerated(self, b: Vector) -> Vector:
        """Return an approximate solution by a Krylov method preconditioned by the
        factors. The factors are wrong only in the few directions whose eigenvalues are
        at the level of rounding errors, and each of them takes the method one or two
        steps.
        """
        nothing = np.zeros(b.size)

        def product(v: Vector) -> Vector:
            image = self.product(DoubleDouble(v, nothing), nothing)
            image += self._D * v
            return image

        if not self._symmetric:
            return gmres(product, b, KRYLOV_STEPS, self._factors_in_doubles.solve)
        target = KRYLOV_REDUCTION * self._norm(b)
        stopping = StoppingCriterion(target, KRYLOV_STEPS, self._norm)
        solve = self._factors_in_doubles.solve
        return conjugate_gradients(product, b, nothing, stopping, solve)[0]

    def basic(self, q: Vector, z: Vector, basic: Mask) -> tuple[DoubleDouble, Vector]:
        """Return z with z_B such that w_B = (M z + q)_B = 0 and the other components
        unchanged, and its w; raise SingularMatrix if M_BB is not definite, or if
        refinement does not converge and the band is too wide for fixed-point
        arithmetic.
        """
        start = DoubleDouble.of(np.where(basic, 0.0, z))
        w = self.product(start, q)
        if not basic.any():
            return start, w
        try:
            refined_solution = self._refined_basis(start, w, q, basic)
            if refined_solution is not None:
                return refined_solution
        except SingularMatrix:
            pass
        exact = self._in_fixed_point(None, basic)
        change = exact(np.where(basic, -w, 0.0))
        solution = start + change
        # w is rounded to double precision, so that the first correction has a relative
        # error of EPS; the second one removes it.
        w = self.product(solution, q)
        solution = solution + exact(np.where(basic, -w, 0.0))
        return solution, np.where(basic, 0.0, self.product(solution, q))

    def _refined_basis(
        self, z: DoubleDouble, w: Vector, q: Vector, basic: Mask
    ) -> tuple[DoubleDouble, Vector] | None:
        """Return the basic solution by iterative refinement with factors in double
        precision, as `basic` does; None if refinement does not converge.
        """
        self._factors_in_doubles.factorize(None, basic)
        solve, last = self._factors_in_doubles.solve, np.inf
        for _ in range(MAX_REFINEMENTS):
            change = solve(np.where(basic, -w, 0.0))
            size = float(np.abs(change).max())
            if not size <= SLOW_REFINEMENT * last:
                return None
            z, last = z + change, size
            w = self.product(z, q)
            sizes = np.abs(z.high)
            if (
                size <= REFINED * float(sizes.max())
                or (np.abs(change) <= LAST_DIGIT * sizes).all()
            ):
                return z, np.where(basic, 0.0, w)
        return None

    def _in_fixed_point(self, D: Vector | None, basic: Mask | None) -> Accurate:
        """Return a solver in double-double numbers for M + diag(D) or M_BB by factors
        in fixed-point arithmetic; raise SingularMatrix if the band is too wide, or
        M + diag(D) has a pivot that is not positive."""
        if self._band is None or not self._band.has_fixed_point:
            raise SingularMatrix
        self.extended += 1
        solve, is_definite = self._band.fixed_point(D, basic)
        if D is not None and not is_definite:
            raise SingularMatrix
        accurate: Accurate = solve
        return accurate

    def _residual(self, x: DoubleDouble, b: Vector) -> Vector:
        # The rounding error of D x is equivalent to a relative change EPS of D, which
        # is a diagonal that the caller chose and need not be exact.
        return -self.product(x, self._D * x.high - b)

    def _norm(self, v: Vector) -> float:
        """Return max |v_i| / (1 + D_i)."""
        return float(np.abs(self._weights * v).max(initial=0.0))


class _Sparse:
    """Systems with one M as `Banded` solves them, by factors with little fill-in."""

    def __init__(self, M: Matrix) -> None:
        self._M = M
        self._dense = dense_places(M)
        self._factors_of_M = _factors(M, self._dense)
        self.solve: Solve = self._factors_of_M.solve

    def factorize(self, d: Vector | None, basic: Mask | None = None) -> None:
        n = self._M.shape[0]
        if basic is None:
            self._factors_of_M.factorize(np.zeros(n) if d is None else d)
            self.solve = self._factors_of_M.solve
        elif isinstance(self._factors_of_M, SuperLU):
            # The submatrix is factorized in the order of M, which saves the search for
            # another: rows and columns outside the basis are those of the identity.
            both = np.repeat(basic, np.diff(self._M.indptr)) & basic[self._M.indices]
            masked = with_data(self._M, np.where(both, self._M.data, 0.0))
            basis_factors = SuperLU(masked, self._factors_of_M.order)
            basis_factors.factorize(np.where(basic, 0.0, 1.0))
            self.solve = basis_factors.solve
        else:
            self._factorize_basis(basic.nonzero()[0])

    def _factorize_basis(self, B: Indices) -> None:
        block = principal(self._M, B)
        basis_factors = _factors(block, dense_places(block))
        basis_factors.factorize(np.zeros(B.size))

        def solve(b: Vector) -> Vector:
            x = np.zeros(b.size)
            x[B] = basis_factors.solve(b[B])
            return x

        self.solve = solve


def _factors(M: Matrix, dense: Indices) -> SuperLU | Bordered:
    return Bordered(M, dense) if dense.size else SuperLU(M)
