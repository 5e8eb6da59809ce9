"""Block principal pivoting with inexact solves for sparse matrices, from a start that is nearly right.

It is a semismooth Newton method: M. Hintermüller, K. Ito and K. Kunisch, The primal-dual active set strategy as a
semismooth Newton method, SIAM Journal on Optimization 13 (2003) 865-888. A step need only reduce the residual by a
digit or two. It moves the edge of the active set by one ring of neighbours, so that it must start close to it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lcpcli.interrupts import check
from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix, Solve
from lcpcli.linalg.krylov import bicgstab, conjugate_gradients, identity, norm
from lcpcli.linalg.matrices import absolute_product, is_narrow, is_symmetric
from lcpcli.methods.full_approximation import FullApproximation
from lcpcli.methods.multilevel import Hierarchy
from lcpcli.methods.stages import Breakdown, Finished, Iterate, Stage, Stalled
from lcpcli.model.box import Basis, Box
from lcpcli.model.problem import Problem
from lcpcli.typing import Mask, Matrix, Vector
from lcpcli.verify.basic_solution import BasicSolution, exchanging

REDUCTION = 0.1  # of the residual, by one inexact solve
FINAL_REDUCTION = 1e-3  # of the residual, once P is unchanged from the last step
PATIENCE_PRODUCTS = 20  # with M per digit: more indicate an ill-conditioned M
MAX_STAGNANT_STEPS = 6  # pivoting steps without a new minimum residual that count as cycling
STAGNATION = 100 * EPS  # relative to the terms: a residual that stagnates below this is at rounding level
NOT_POSITIVE = "a diagonal entry of M is not positive"
AT_ROUNDING = "the residual has stopped falling at rounding level"
NO_PROGRESS = "block principal pivoting makes no further progress"

ROUGH_PRODUCTS, FINAL_PRODUCTS = 3, 100  # preconditioned products of a step, and of the last one at most
TINY = float(np.finfo(np.float64).tiny)
ACCURACY, ROUNDING = 1e-12, 4 * EPS  # relative to the terms of a row: what the last step leaves
ROUNDS_PATIENCE = 3  # steps without a new minimum of wrong signs
HOPS = 4  # along entries of M, from wrong signs: the variables that are pivoted by themselves
MOST_LOCAL_STEPS, SETTLED_CHANGES, SETTLED_SIZE = 40, 0.002, 0.03  # of these; relative to their number, and the start
REUSE_CHANGE = 0.03  # of a set of basic variables: how far it may differ from that whose factors precondition it

Preconditioners = Callable[[Mask], Solve]
"""For each set of basic variables, an approximate inverse of their principal submatrix, for vectors of shape (n,) that
are 0 elsewhere."""


def krylov(problem: Problem, x0: Vector) -> Stage:
    """Pivot on all violated signs, solving M_PP z_P = -q_P by conjugate gradients or, if nonsymmetric, BiCGSTAB.

    M must be sparse with positive diagonal, ideally all ones. A solve starts from the last z and ends when its residual
    is a tenth of min(z, Mz + q), so that P is found before the last digits are. It needs only some ten vectors of
    memory.

    Yields x = (z - w) / 2 for each pivoting step; evaluations are products with M. Finished : the residual is zero.
    Stalled : it stagnates at rounding level. Breakdown : a diagonal entry is not positive, a solve takes more than
    PATIENCE_PRODUCTS per digit, or pivoting cycles; M is too ill-conditioned for this method, or not a P-matrix.
    """
    own = Inexact(problem.M, problem.q, problem.box, problem.box.z_of(x0))
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
    return Stalled(AT_ROUNDING) if least <= STAGNATION * norm(own.terms()) else Breakdown(NO_PROGRESS)


def multilevel(problem: Problem, precondition: Preconditioners | None = None) -> Stage:
    """Pivot by `active_set` from the states that coarse versions of the problem suggest.

    M must be sparse with a positive diagonal, and smooth vectors those that it makes small, as for differential
    equations and graphs. Unless other preconditioners are given, they are V-cycles of the same coarse versions, so that
    nothing is factorized and time and memory are proportional to n. Yields and returns as `active_set`.
    """
    if not problem.M.diagonal().min() > 0:
        return Breakdown(NOT_POSITIVE)
    hierarchy = Hierarchy(problem.M)
    if hierarchy.stuck:
        return Breakdown("coarsening M does not make it much smaller")
    try:
        z = FullApproximation(hierarchy, problem.q, problem.box).solution()
    except SingularMatrix:
        return Breakdown("a coarse version of M is singular")
    return (yield from active_set(problem, z, precondition or hierarchy.preconditioner))


def active_set(problem: Problem, z: Vector, precondition: Preconditioners) -> Stage:
    """Pivot on all violated signs, with a few preconditioned products a step; in between, pivot near these signs only,
    which moves the edge of the active set by several rings at a small cost.

    Yields x = (z - w) / 2 for each step; evaluations are products with M. Stalled : after the last one, whose residual
    is at rounding level. Breakdown : a solve takes more than FINAL_PRODUCTS, or pivoting cycles.
    """
    own = Inexact(problem.M, problem.q, problem.box, z, precondition)
    basis, fewest, waiting = own.basis, problem.n + 1, ROUNDS_PATIENCE
    try:
        while waiting:
            found = own.step(basis)
            if not np.count_nonzero(found.wrong):
                found = own.last_step(basis)
                if not np.count_nonzero(found.wrong):
                    yield own.iterate()._replace(F=None, signs_final=True)
                    return Stalled(AT_ROUNDING)
            yield own.iterate()._replace(F=None, signs_final=False)
            count = int(np.count_nonzero(found.wrong))
            waiting = ROUNDS_PATIENCE if count < fewest else waiting - 1
            fewest = min(count, fewest)
            basis = own.pivoted_near(found)
    except SingularMatrix as error:
        return Breakdown(str(error))
    return Breakdown(NO_PROGRESS)


class Inexact:
    """A problem whose basic solutions are approximated by a Krylov method, preconditioned if there are preconditioners.

    z, w, basis : the last basic solution; w = M z + q. size : |min(diag(M) z, w)|_2. products : products with M so far.
    """

    def __init__(
        self,
        M: Matrix,
        q: Vector,
        box: Box,
        z: Vector,
        precondition: Preconditioners | None = None,
        symmetric: bool | None = None,
    ) -> None:
        self.M, self.q, self.box, self.z, self.diagonal = M, q, box, z, M.diagonal()
        self._symmetric = is_symmetric(M) if symmetric is None else symmetric
        self._method, self._cost = (conjugate_gradients, 1) if self._symmetric else (bicgstab, 2)
        self._precondition = precondition
        self._solve: Solve = identity
        self.products = 0
        self._measure()
        with np.errstate(divide="ignore", invalid="ignore"):
            self.basis = box.basis_of(0.5 * (z - self.w / self.diagonal))

    def _measure(self) -> None:
        """Compute w and the residual."""
        self.w = self.M @ self.z
        self.w += self.q
        self.size = norm(self.box.gaps(self.z, self.w, self.diagonal))
        self.products += 1

    def iterate(self) -> Iterate:
        """Return the x of the last basic solution, with F where z is admissible."""
        x = self.box.x_within(self.z, self.w, self.basis)
        w = self.box.reflected(x) - x
        admissible = bool((self.z == self.box.project(self.z)).all())
        return Iterate(x, self.w - w if admissible else None, "", self.products, signs_final=admissible)

    def terms(self) -> Vector:
        """Return the terms |M| |z| + |q| of each row."""
        terms: Vector = absolute_product(self.M, np.abs(self.z))
        terms += np.abs(self.q)
        return terms

    def at(self, basis: Basis) -> BasicSolution:
        """Approximate the basic solution of a basis; raise SingularMatrix if that takes too long."""
        unchanged = self.products > 1 and not basis.changes(self.basis)
        reduction = FINAL_REDUCTION if unchanged else REDUCTION
        most = int(PATIENCE_PRODUCTS * -np.log10(reduction)) // self._cost
        size = self.size
        left = self._approach(basis, reduction * size, most)
        if not left <= REDUCTION * size:
            raise SingularMatrix(f"{PATIENCE_PRODUCTS} products with M did not gain a digit")
        return self._found(basis)

    def step(self, basis: Basis) -> BasicSolution:
        """Approximate the basic solution of a basis by ROUGH_PRODUCTS."""
        self._approach(basis, 0.0, ROUGH_PRODUCTS)
        return self._found(basis)

    def last_step(self, basis: Basis) -> BasicSolution:
        """Approximate the basic solution of a basis to rounding level; raise SingularMatrix if that takes too long."""
        terms = self.terms()
        most = np.maximum(ROUNDING * terms, ACCURACY * np.minimum(terms, np.abs(self.q).max())) + TINY
        if not self._approach(basis, most, FINAL_PRODUCTS) <= 1:
            raise SingularMatrix(f"{FINAL_PRODUCTS} steps with a preconditioner did not solve a system")
        return self._found(basis)

    def _approach(self, basis: Basis, target: float | Vector, most: int) -> float:
        """Move z towards the basic solution of a basis; return the size of the residual that is left."""
        z, mask = self.box.nonbasic(basis), basis.basic.astype(float)
        if self._precondition is not None and (self._solve is identity or basis.changes(self.basis)):
            self._solve = self._precondition(basis.basic)
        b = -(self.q + self.M @ z if np.count_nonzero(z) else self.q) * mask

        def product(v: Vector) -> Vector:
            check()
            self.products += 1
            image = self.M @ v
            image *= mask
            return np.asarray(image)

        with np.errstate(all="ignore"):
            y, left = self._method(product, b, self.z * mask, target, most, self._solve)
        z += y
        self.z, self.basis = z, basis
        self._measure()
        return left

    def _found(self, basis: Basis) -> BasicSolution:
        """Judge the signs of the last z and w after a step of Jacobi's method, counting a z at its lower bound as below
        it."""
        left = np.where(basis.basic, self.w, 0.0)
        z, w = self.z - left / self.diagonal, self.w - left
        wrong = self.box.wrong(z, w, basis) | (basis.basic & (z == self.box.lower))
        return BasicSolution(basis, z, w, wrong, self.size == 0)

    def pivoted_near(self, found: BasicSolution) -> Basis:
        """Exchange the wrong signs, and pivot with the variables near them alone until their signs settle."""
        basis = self.box.exchanged(found.basis, found.wrong, found.z)
        self.z = np.where(basis.basic, self.box.project(self.z), self.box.nonbasic(basis))
        near = found.wrong.copy()
        for _ in range(HOPS):
            near[self.M[near.nonzero()[0]].indices] = True
        own = near.nonzero()[0]
        rows, outside = self.M[own], np.where(near, 0.0, self.z)
        box, q = self.box.mapped(lambda bound: bound[own]), self.q[own] + rows @ outside
        part = Inexact(rows[:, own], q, box, self.z[own], symmetric=self._symmetric)
        part.settle()
        self.z[own] = part.z
        basic, upper = basis.basic.copy(), None if basis.upper is None else basis.upper.copy()
        basic[own] = part.basis.basic
        if upper is not None and part.basis.upper is not None:
            upper[own] = part.basis.upper
        return Basis(basic, upper)

    def settle(self) -> None:
        """Pivot until few signs are wrong and the residual has fallen, or a solve takes too long."""
        start, steps = self.size, 0
        try:
            for found in exchanging(self, self.basis):
                steps += 1
                changes = np.count_nonzero(found.wrong)
                if steps == MOST_LOCAL_STEPS or (
                    changes <= SETTLED_CHANGES * self.q.size and self.size <= SETTLED_SIZE * start
                ):
                    self.basis = self.box.exchanged(found.basis, found.wrong, found.z)
                    break
        except SingularMatrix:
            return


class Factors:
    """Preconditioners from factors of a principal submatrix, which are kept while few variables change, unless the
    band of M is so narrow that new ones cost little."""

    def __init__(self, M: Matrix) -> None:
        self._change = 0.0 if is_narrow(M) else REUSE_CHANGE
        self._solver, self._basic = PrincipalSolver(M), np.zeros(M.shape[0], dtype=bool)
        self._factors: Solve = identity

    def __call__(self, basic: Mask) -> Solve:
        """Return a solver for the basic variables; it, or this method, raises SingularMatrix."""
        if np.count_nonzero(basic != self._basic) > self._change * np.count_nonzero(basic):
            self._basic, self._factors = basic, self._solver.at(basic.nonzero()[0])
        own, factors, both = self._basic.nonzero()[0], self._factors, basic & self._basic

        def solve(b: Vector) -> Vector:
            x: Vector = b.copy()
            inner = np.zeros(b.size)
            inner[own] = factors((b * both)[own])
            x[both] = inner[both]
            return x

        return solve
