"""Basic solutions of sparse problems that are approximated by Krylov methods, and block principal pivoting on them.

It is a semismooth Newton method: M. Hintermüller, K. Ito and K. Kunisch, The primal-dual active set strategy as a
semismooth Newton method, SIAM Journal on Optimization 13 (2003) 865-888; here with inexact solves: each step need only
reduce the residual by a digit.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lcpcli.basis.exchanges import BasicSolution, exchanging
from lcpcli.interrupts import check
from lcpcli.linalg.doubles import EPS, ROUNDING
from lcpcli.linalg.factors import SingularMatrix, Solve
from lcpcli.linalg.krylov import Measure, bicgstab, conjugate_gradients, dot, identity, norm, relative_to
from lcpcli.linalg.matrices import absolute_product, is_symmetric
from lcpcli.linalg.stencils import Operator
from lcpcli.methods.stages import Breakdown, Finished, Iterate, Stage, Stalled
from lcpcli.model.box import BASIC, Box
from lcpcli.model.problem import Problem
from lcpcli.typing import Mask, Matrix, States, Vector

REDUCTION = 0.1  # of the residual, by one inexact solve
FINAL_REDUCTION = 1e-3  # of the residual, once P is unchanged from the last step
PATIENCE_PRODUCTS = 20  # with M per digit: more indicate an ill-conditioned M
MAX_STAGNANT_STEPS = 6  # pivoting steps without a new minimum residual that count as cycling
STAGNATION = 100 * EPS  # relative to the terms: a residual that stagnates below this is at rounding level
ROUGH_STEPS, FINAL_STEPS = 3, 100  # of a preconditioned method: of a rough solve, and at most of the last one
ACCURACY = 1e-12  # relative to the terms of a row: what the last solve leaves
TINY = float(np.finfo(np.float64).tiny)
NOT_POSITIVE = "a diagonal entry of M is not positive"
ROUNDING_REACHED = "the residual has stopped falling at rounding level"
NO_PROGRESS = "block principal pivoting makes no further progress"

Preconditioners = Callable[[Mask], Solve]
"""For each set of basic variables, an approximate inverse of their principal submatrix, for vectors of shape (n,) that
are 0 elsewhere."""


def krylov(problem: Problem, x0: Vector, symmetric: bool | None = None) -> Stage:
    """Pivot on all violated signs, solving M_PP z_P = -q_P by conjugate gradients or, if nonsymmetric, BiCGSTAB.

    M must be sparse with positive diagonal, ideally all ones. A solve starts from the last z and ends when its residual
    is a tenth of min(z, Mz + q), so that P is found before the last digits are. It needs only some ten vectors of
    memory.

    symmetric : whether M is, up to rounding, if that is known.

    Yields x = (z - w) / 2 for each pivoting step; evaluations are products with M. Finished : the residual is zero.
    Stalled : it stagnates at rounding level. Breakdown : a diagonal entry is not positive, a solve takes more than
    PATIENCE_PRODUCTS per digit, or pivoting cycles; M is too ill-conditioned for this method, or not a P-matrix.
    """
    own = Inexact(problem.M, problem.q, problem.box, problem.box.z_of(x0), symmetric=symmetric)
    if not own.diagonal.min() > 0:
        return Breakdown(NOT_POSITIVE)
    least, stagnant = own.size, 0
    if own.size == 0:
        yield own.iterate()
        return Finished()
    try:
        for found in exchanging(own, own.basis):
            yield own.iterate()
            if found.is_solution:
                return Finished()
            stagnant = 0 if own.size < least else stagnant + 1
            least = min(own.size, least)
            if stagnant >= MAX_STAGNANT_STEPS:
                break
    except SingularMatrix as error:
        return Breakdown(str(error))
    return Stalled(ROUNDING_REACHED) if least <= STAGNATION * norm(own.terms()) else Breakdown(NO_PROGRESS)


class Inexact:
    """A problem whose basic solutions are approximated by a Krylov method, preconditioned if there are preconditioners.

    z, w, basis : the last basic solution; w = M z + q. size : |min(diag(M) z, w)|_2. products : products with M so far.
    parts : slices of a block of rows each, with the bounds there.
    """

    def __init__(
        self,
        M: Matrix,
        q: Vector,
        box: Box,
        z: Vector,
        precondition: Preconditioners | None = None,
        symmetric: bool | None = None,
        operator: Operator | None = None,
    ) -> None:
        self.M, self.q, self.box, self.z, self.diagonal = M, q, box, z, M.diagonal()
        self._operator = operator or Operator(M)
        self.parts = [(part, box.part(part)) for part in self._operator.parts]
        self.is_symmetric = is_symmetric(M) if symmetric is None else symmetric
        self._method, self._cost = (conjugate_gradients, 1) if self.is_symmetric else (bicgstab, 2)
        self._image = np.empty(q.size) if self.is_symmetric else None  # of the last product, if one at a time is needed
        self._precondition = precondition
        self._solve: Solve = identity
        self.products = 0
        self._measure()
        with np.errstate(divide="ignore", invalid="ignore"):
            self.basis = box.basis_of(0.5 * (z - self.w / self.diagonal))

    def _measure(self) -> None:
        """Compute w and the residual."""
        self.w, square = np.empty(self.z.size), 0.0
        for k, (part, box) in enumerate(self.parts):
            w = np.add(self._operator.block(k, self.z), self.q[part], out=self.w[part])
            gaps = box.gaps(self.z[part], w, self.diagonal[part])
            square += dot(gaps, gaps)
        self.size = float(np.sqrt(square))
        self.products += 1

    @property
    def x(self) -> Vector:
        """Return the x of the last basic solution."""
        x = np.empty(self.z.size)
        for part, box in self.parts:
            x[part] = box.x_within(self.z[part], self.w[part], self.basis[part])
        return x

    def iterate(self) -> Iterate:
        """Return the x of the last basic solution, with F where z is admissible."""
        x = self.x
        w = self.box.reflected(x) - x
        admissible = bool((self.z == self.box.project(self.z)).all())
        return Iterate(x, self.w - w if admissible else None, "", self.products, signs_final=admissible)

    def terms(self) -> Vector:
        """Return the terms |M| |z| + |q| of each row."""
        terms: Vector = absolute_product(self.M, np.abs(self.z))
        terms += np.abs(self.q)
        return terms

    def at(self, basis: States) -> BasicSolution:
        """Approximate the basic solution of a basis; raise SingularMatrix if that takes too long."""
        unchanged = self.products > 1 and np.array_equal(basis, self.basis)
        reduction = FINAL_REDUCTION if unchanged else REDUCTION
        most = int(PATIENCE_PRODUCTS * -np.log10(reduction)) // self._cost
        size = self.size
        left = self._approach(basis, reduction * size, most)
        if not left <= REDUCTION * size:
            raise SingularMatrix(f"{PATIENCE_PRODUCTS} products with M did not gain a digit")
        return self._found(basis)

    def rough_step(self, basis: States) -> BasicSolution:
        """Approximate the basic solution of a basis by ROUGH_STEPS."""
        self._approach(basis, 0.0, ROUGH_STEPS)
        return self._found(basis)

    def last_step(self, basis: States) -> BasicSolution:
        """Approximate the basic solution of a basis to rounding level; raise SingularMatrix if that takes too long."""
        terms = self.terms()
        most = np.maximum(ROUNDING * terms, ACCURACY * np.minimum(terms, np.abs(self.q).max())) + TINY
        if not self._approach(basis, 1.0, FINAL_STEPS, relative_to(most)) <= 1:
            raise SingularMatrix(f"{FINAL_STEPS} steps with a preconditioner did not solve a system")
        return self._found(basis)

    def _approach(self, basis: States, target: float, most: int, measure: Measure = norm) -> float:
        """Move z towards the basic solution of a basis; return what its residual is by this measure."""
        z, basic = self.box.nonbasic(basis), basis == BASIC
        mask = basic.astype(float)
        if self._precondition is not None and (self._solve is identity or not np.array_equal(basis, self.basis)):
            self._solve = self._precondition(basic)
        b = -(self.q + self._operator(z) if np.count_nonzero(z) else self.q) * mask

        def product(v: Vector) -> Vector:
            check()
            self.products += 1
            return np.asarray(self._operator(v, mask, self._image))

        with np.errstate(all="ignore"):
            y, left = self._method(product, b, self.z * mask, target, most, self._solve, measure)
        z += y
        self.z, self.basis = z, basis
        self._measure()
        return left

    def _found(self, basis: States) -> BasicSolution:
        """Judge the signs of the last z and w after a step of Jacobi's method, counting a z at its lower bound as below
        it."""
        z, w, wrong = self.z.copy(), self.w.copy(), np.empty(basis.size, dtype=bool)
        for part, box in self.parts:
            basic = basis[part] == BASIC
            left = np.where(basic, w[part], 0.0)
            w[part] -= left
            z[part] -= left / self.diagonal[part]
            wrong[part] = box.wrong(z[part], w[part], basis[part]) | (basic & (z[part] == box.lower))
        return BasicSolution(basis, z, w, wrong, self.size == 0)
