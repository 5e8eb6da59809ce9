"""The route for sparse matrices: only products with M if these suffice, else one factorization and finishing.

Block principal pivoting without a factorization is a semismooth Newton method (M. Hintermüller, K. Ito and K. Kunisch,
The primal-dual active set strategy as a semismooth Newton method, SIAM Journal on Optimization 13 (2003) 865-888); here
with inexact solves: each step need only reduce the residual by a digit.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.factors import SingularMatrix, Solve
from lcpcli.linalg.krylov import bicgstab, conjugate_gradients, identity, norm
from lcpcli.linalg.matrices import absolute_product, is_symmetric
from lcpcli.linalg.units import equilibrate
from lcpcli.methods import stages
from lcpcli.methods.fixed_point import fixed_point
from lcpcli.methods.multilevel import Hierarchy, Preconditioners
from lcpcli.methods.newton import finish
from lcpcli.methods.stages import Breakdown, Ending, Finished, Iterate, Stage, Stalled, Turns, advance
from lcpcli.model.box import Basis, Box
from lcpcli.model.changes import in_units
from lcpcli.model.problem import Problem
from lcpcli.options import AUTO
from lcpcli.typing import Indices, Matrix, Vector
from lcpcli.verify.basic_solution import BasicSolution, exchanging

MEMORY = 10  # pairs for Anderson acceleration: more do not find the active set sooner (measured for 5 to 20)
MODULUS_STEPS = 500  # ten times what it needs for the matrices that it is meant for
MODULUS_GROWTH = 1e6  # of |F| over its minimum: the modulus iteration diverges
REDUCTION = 0.1  # of the residual, by one inexact solve
FINAL_REDUCTION = 1e-3  # of the residual, once P is unchanged from the last step
PATIENCE_PRODUCTS = 20  # with M per digit: more indicate an ill-conditioned M
PATIENCE_PRODUCTS_MULTILEVEL = 120  # even so many cost less than a factorization
MAX_STAGNANT_STEPS = 6  # pivoting steps without a new minimum residual that count as cycling
STAGNATION = 100 * EPS  # relative to the terms: a residual that stagnates below this is at rounding level
COARSE_TOLERANCE = 1e-3  # residual of the coarse solutions relative to |q|, unless COARSE_STEPS are reached first
COARSE_STEPS = 12  # on each level: a coarse solution only has to give nearly the right active set
NOT_POSITIVE = "a diagonal entry of M is not positive"


def sparse_route(problem: Problem, x0: Vector, krylov_only: bool = False) -> Stage:
    """Solve the problem in units in which M has diagonal 1: by pivoting with Krylov solves, else by modulus iteration.

    Well-conditioned M, however large and with any fill-in, needs a few dozen products and no factorization
    (`krylov`). It gives up early if convergence is slow. For symmetric M a hierarchy of coarse versions follows
    (`multilevel`), still without factorizing M unless rounding stops it short of the solution. Last come the modulus
    iteration with omega from the spectrum and Anderson acceleration, which finds the active set with one factorization,
    and `finish`.

    It is meant for sparse positive definite and H-matrices; it may fail for other M, and ends as its last part does.

    krylov_only : whether to end after the first part, where other methods are better than the rest: for zeros on the
        diagonal, as in contact, or for a narrow band.
    """
    R, C = _units(problem.M, problem.q)
    units = in_units(problem, R, C)
    return (yield from stages.in_given_variables(units, _parts(units.problem, units.start(x0), krylov_only)))


def _parts(problem: Problem, x: Vector, krylov_only: bool) -> Stage:
    turns = Turns(x)
    ending = yield from turns.take("krylov", krylov(problem, x))
    if krylov_only or isinstance(ending, Stalled | Finished):
        return ending
    if is_symmetric(problem.M):
        ending = yield from turns.take("multilevel", multilevel(problem))
        if isinstance(ending, Stalled):
            return (yield from turns.take("multilevel", finish(problem, turns.last.x, stages.ended(ending))))
        if isinstance(ending, Finished):
            return ending
    last = turns.last.x
    modulus = stages.limited(fixed_point(problem, last, omega=AUTO, anderson=MEMORY), MODULUS_STEPS)
    return (yield from turns.take("fixed-point", finish(problem, last, _while_bounded(modulus))))


def _while_bounded(stage: Stage) -> Stage:
    """Pass on the stage until |F| has grown by a factor MODULUS_GROWTH over its minimum so far."""
    least = np.inf
    while isinstance(step := advance(stage), Iterate):
        if step.F is not None:
            size = float(np.abs(step.F).max())
            if not size <= MODULUS_GROWTH * least:
                return Breakdown("the modulus iteration diverges")
            least = min(size, least)
        yield step
    return step


def _units(M: Matrix, q: Vector) -> tuple[Vector, Vector]:
    """Return diagonals R, C for which a positive diagonal becomes 1 in R M C and symmetry is preserved."""
    diagonal = M.diagonal()
    positive = bool(diagonal.min() > 0)
    if positive and is_symmetric(M):
        root = 1 / np.sqrt(diagonal)
        return root, root
    R, C = equilibrate(M, q)
    return (1 / (diagonal * C) if positive else R), C


def krylov(problem: Problem, x0: Vector) -> Stage:
    """Pivot on all violated signs, solving M_PP z_P = -q_P by conjugate gradients or, if nonsymmetric, BiCGSTAB.

    M must be sparse with positive diagonal, ideally all ones. A solve starts from the last z and ends when its residual
    is a tenth of min(z, Mz + q), so that P is found before the last digits are. It needs only some ten vectors and one
    submatrix of memory.

    Yields x = (z - w) / 2 for each pivoting step; evaluations are products with M. Finished : the residual is zero.
    Stalled : it stagnates at rounding level. Breakdown : a diagonal entry is not positive, a solve takes more than
    PATIENCE_PRODUCTS per digit, or pivoting cycles; M is too ill-conditioned for this method, or not a P-matrix.
    """
    return _steps(_Inexact(problem.M, problem.q, problem.box, problem.box.z_of(x0)))


def multilevel(problem: Problem) -> Stage:
    """Pivot as `krylov` does, for symmetric positive definite M of any condition, with two uses of a `Hierarchy`.

    The hierarchy preconditions the conjugate gradients, and its coarse problems P'MP z + P'q, first solved roughly,
    give the start: block pivoting moves the boundary of the active set by one ring of neighbours per step, so that it
    must start close to it. Yields and returns as `krylov`.
    """
    if not problem.M.diagonal().min() > 0:
        return Breakdown(NOT_POSITIVE)
    hierarchy = Hierarchy(problem.M)
    if hierarchy.stuck:
        return Breakdown("coarsening M does not make it much smaller")
    z = _coarse_start(hierarchy, problem)
    if not isinstance(z, np.ndarray):
        return z
    return (yield from _steps(_Inexact(problem.M, problem.q, problem.box, z, Preconditioners(hierarchy, 0))))


def _coarse_start(hierarchy: Hierarchy, problem: Problem) -> Vector | Ending:
    """Return z on the finest level from solutions on the coarser levels, or how one of these failed."""
    coarse = [(problem.q, problem.box)]
    for P, T in zip(hierarchy.prolongations, hierarchy.tentative, strict=True):
        q, box = coarse[-1]
        coarse.append((P.T @ q, box.mapped(T.T.__matmul__)))
    z = coarse[-1][1].project(np.zeros(coarse[-1][0].size))
    for level in range(len(coarse) - 1, 0, -1):
        q, box = coarse[level]
        own = _Inexact(hierarchy.matrices[level], q, box, z, Preconditioners(hierarchy, level))
        steps, target = _steps(own), COARSE_TOLERANCE * norm(q)
        for _ in range(COARSE_STEPS + 1):
            ending = advance(steps)
            if isinstance(ending, Finished) or own.size <= target:
                break
            if not isinstance(ending, Iterate):
                return ending
        z = hierarchy.prolongations[level - 1] @ box.project(own.z)
    return z


def _steps(own: _Inexact) -> Stage:
    """Pivot by blocks until the residual is zero or no longer falls."""
    if not own.diagonal.min() > 0:
        return Breakdown(NOT_POSITIVE)
    own.measure()
    least, stagnant = own.size, 0
    own.basis = own.box.basis_of(0.5 * (own.z - own.w / own.diagonal))
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
    if least <= STAGNATION * norm(absolute_product(own.M, np.abs(own.z)) + np.abs(own.q)):
        return Stalled("the residual has stopped falling at rounding level")
    return Breakdown("block principal pivoting makes no further progress")


class _Inexact:
    """A problem whose basic solutions are approximated by a Krylov method, preconditioned if there is a preconditioner.

    z, w, basis : the last basic solution; w = M z + q. size : |min(diag(M) z, w)|_2. products : products with M so far.
    """

    basis: Basis

    def __init__(
        self, M: Matrix, q: Vector, box: Box, z: Vector, precondition: Callable[[Indices, Matrix], Solve] | None = None
    ) -> None:
        self.M, self.q, self.box, self.z, self.diagonal = M, q, box, z, M.diagonal()
        symmetric = precondition is not None or is_symmetric(M)
        self._method, self._cost = (conjugate_gradients, 1) if symmetric else (bicgstab, 2)
        self._patience = PATIENCE_PRODUCTS if precondition is None else PATIENCE_PRODUCTS_MULTILEVEL
        self._precondition = precondition or (lambda *_: identity)
        self._cycle: Solve = identity
        self._block: Matrix = None
        self.products = 0

    def measure(self) -> None:
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

    def at(self, basis: Basis) -> BasicSolution:
        """Approximate the basic solution of a basis, and judge its signs after a step of Jacobi's method, counting a z
        at its lower bound as below it; raise SingularMatrix if that takes too long."""
        indices = basis.basic.nonzero()[0]
        unchanged = self._block is not None and not basis.changes(self.basis)
        z = self.box.nonbasic(basis)
        if not unchanged:
            self._block = self.M if indices.size == z.size else self.M[indices][:, indices]
            self._cycle = self._precondition(indices, self._block) if indices.size else identity
        b = -(self.q + self.M @ z if np.count_nonzero(z) else self.q)[indices]
        z[indices] = self._solved(b, self.z[indices], FINAL_REDUCTION if unchanged else REDUCTION)
        self.z, self.basis = z, basis
        self.measure()
        left = np.where(basis.basic, self.w, 0.0)
        z, w = z - left / self.diagonal, self.w - left
        wrong = self.box.wrong(z, w, basis) | (basis.basic & (z == self.box.lower))
        return BasicSolution(basis, z, w, wrong, self.size == 0)

    def _solved(self, b: Vector, start: Vector, reduction: float) -> Vector:
        """Return y with |b - A y|_2 at most `reduction` times the residual; raise SingularMatrix if far above it."""
        if not b.size:
            return b
        most = int(self._patience * -np.log10(reduction)) // self._cost
        with np.errstate(all="ignore"):
            y, left = self._method(self._product, b, start, reduction * self.size, most, self._cycle)
        if not left <= REDUCTION * self.size:
            raise SingularMatrix(f"{self._patience} products with M did not gain a digit")
        return y

    def _product(self, v: Vector) -> Vector:
        self.products += 1
        return np.asarray(self._block @ v)
