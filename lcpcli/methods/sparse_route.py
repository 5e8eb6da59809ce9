"""The route for sparse matrices: only products with M if these suffice, else one factorization and finishing."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import NamedTuple

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.krylov import bicgstab, conjugate_gradients, identity, norm
from lcpcli.linalg.matrices import absolute_product, is_symmetric
from lcpcli.linalg.units import equilibrate
from lcpcli.methods.fixed_point import fixed_point
from lcpcli.methods.multilevel import Hierarchy
from lcpcli.methods.newton import finish
from lcpcli.methods.stages import (
    Breakdown,
    Ending,
    Finished,
    Iterate,
    Stage,
    Stalled,
    Turns,
    advance,
    ended,
    in_given_variables,
    limited,
)
from lcpcli.model.box import Basis, Box
from lcpcli.model.problem import Problem
from lcpcli.model.scaled import in_units
from lcpcli.options import AUTO
from lcpcli.typing import Indices, Matrix, Vector

MEMORY = 10  # pairs for Anderson acceleration: more do not find the active set sooner (measured for 5 to 20)
MODULUS_STEPS = 500  # ten times what it needs for the matrices that it is meant for
GROWTH = 1e6  # of |F| over its minimum: the modulus iteration diverges


def sparse_route(problem: Problem, x0: Vector, krylov_only: bool = False) -> Stage:
    """Solve the problem in units in which M has diagonal 1: by pivoting with Krylov solves, else by modulus iteration.

    Well-conditioned M, however large and with any fill-in, needs a few dozen products and no factorization
    (`krylov`). It gives up early if convergence is slow. For symmetric M a hierarchy of coarse versions follows
    (`multilevel`), still without factorizing M unless rounding stops it short of the solution. Last come the modulus
    iteration with omega from the spectrum and Anderson acceleration, which finds the active set with one factorization,
    and `finish`.

    Parameters
    ----------
    problem : the LCP, n unknowns, M sparse.
    x0 : starting point, shape (n,).
    krylov_only : whether to end after the first part, as where others are better: with zeros on the diagonal, as for
        contact, or a narrow band.

    Yields
    ------
    Iterate : in the problem's own units; `method` names the part of the route.

    Returns
    -------
    As the last part. It is meant for positive definite and H-matrices; it may fail for other M.
    """
    R, C = _units(problem.M, problem.q)
    units = in_units(problem, R, C)
    return (yield from in_given_variables(units, _parts(units.problem, units.start(x0), krylov_only)))


def _parts(problem: Problem, x: Vector, krylov_only: bool) -> Stage:
    turns = Turns(x)
    ending = yield from turns.take("krylov", krylov(problem, x))
    if krylov_only or isinstance(ending, Stalled | Finished):
        return ending
    if matrices.is_symmetric(problem.M):
        ending = yield from turns.take("multilevel", multilevel(problem))
        if isinstance(ending, Stalled):
            return (yield from turns.take("multilevel", finish(problem, turns.last.x, ended(ending))))
        if isinstance(ending, Finished):
            return ending
    last = turns.last.x
    modulus = limited(fixed_point(problem, last, omega=AUTO, anderson=MEMORY), MODULUS_STEPS)
    return (yield from turns.take("fixed-point", finish(problem, last, _while_bounded(modulus))))


def _while_bounded(stage: Stage) -> Stage:
    """The stage, until |F| has grown by a factor GROWTH over its minimum so far."""
    least = np.inf
    while isinstance(step := advance(stage), Iterate):
        if step.F is not None:
            size = float(np.abs(step.F).max())
            if not size <= GROWTH * least:
                return Breakdown("the modulus iteration diverges")
            least = min(size, least)
        yield step
    return step


def _units(M: Matrix, q: Vector) -> tuple[Vector, Vector]:
    """Diagonals R, C of shape (n,) that make the diagonal of R M C one if it is positive, and preserve symmetry."""
    diagonal = M.diagonal()
    positive = bool(diagonal.min() > 0)
    if positive and matrices.is_symmetric(M):
        root = 1 / np.sqrt(diagonal)
        return root, root
    R, C = equilibrate(M, q)
    return (1 / (diagonal * C) if positive else R), C


REDUCTION = 0.1  # of the residual, by one inexact solve
FINAL_REDUCTION = 1e-3  # the same once P is unchanged from the last step
PATIENCE = 20  # products with M per digit: more indicate an ill-conditioned M
PATIENCE_MULTILEVEL = 120  # even so they cost less than a factorization
REUSE_CHANGE = 0.03  # of P: how far it may differ from the set for which the preconditioner was built
MAX_STAGNANT_STEPS = 6  # pivoting steps without a new minimum residual that count as cycling
STAGNATION = 100 * EPS  # relative to the terms: a residual that stagnates below this is at rounding level
COARSE_TOLERANCE = 1e-3  # residual of the coarse solutions relative to |q|, unless COARSE_STEPS are reached first
COARSE_STEPS = 12
NOT_POSITIVE = "a diagonal entry of M is not positive"

Preconditioner = Callable[[Indices, Matrix], Callable[[Vector], Vector]]


def krylov(problem: Problem, x0: Vector) -> Stage:
    """Pivot on all violated signs at once, solving M_PP z_P = -q_P by conjugate gradients or, nonsymmetric, BiCGSTAB.

    M must be sparse with positive diagonal, ideally all ones. A solve starts from the last z and ends when its residual
    is a tenth of min(z, Mz + q), so that P is found before the last digits are. It needs only some ten vectors and one
    submatrix of memory.

    Parameters
    ----------
    problem : the LCP, n unknowns, M sparse.
    x0 : starting point, shape (n,).

    Yields
    ------
    Iterate : x = (z - w) / 2 for each pivoting step. Evaluations are products with M.

    Returns
    -------
    Finished : the residual is zero. Stalled : it stagnates at rounding level. Breakdown : a diagonal entry is not
        positive, a solve takes more than PATIENCE products per digit, or pivoting cycles; M is too ill-conditioned for
        this method, or not a P-matrix.
    """
    return _iterates(problem, problem.box.z_of(x0), _Inner(is_symmetric(problem.M)))


def multilevel(problem: Problem) -> Stage:
    """The same for symmetric positive definite M of any condition number, with `multilevel.Hierarchy` used twice.

    It preconditions the conjugate gradients, and its coarse problems P'MP z + P'q, first solved roughly, give the
    start: block pivoting moves the boundary of the active set by one ring of neighbours per step, so that it must start
    close to it. Yields and returns as `krylov`.
    """
    if not problem.M.diagonal().min() > 0:
        return Breakdown(NOT_POSITIVE)
    hierarchy = Hierarchy(problem.M)
    if hierarchy.stuck:
        return Breakdown("coarsening M does not make it much smaller")
    z = _coarse_start(hierarchy, problem)
    if not isinstance(z, np.ndarray):
        return z
    return (yield from _iterates(problem, z, _Inner(True, _preconditioner(hierarchy, 0))))


def _iterates(problem: Problem, z: Vector, inner: _Inner) -> Stage:
    box, states = problem.box, _pivot(problem.M, problem.q, problem.box, z, inner)
    while isinstance(state := advance(states), _State):
        x = box.x_within(state.z, state.w, state.basis)
        w = box.reflected(x) - x
        admissible = bool((state.z == box.project(state.z)).all())
        yield Iterate(x, state.w - w if admissible else None, "", inner.products, signs_final=admissible)
    return state


def _coarse_start(hierarchy: Hierarchy, problem: Problem) -> Vector | Ending:
    """z on the finest level from solutions on the coarser ones, or how one of these failed."""
    coarse = [(problem.q, problem.box)]
    for P, T in zip(hierarchy.prolongations, hierarchy.tentative, strict=True):
        q, box = coarse[-1]
        coarse.append((P.T @ q, box.mapped(T.T.__matmul__)))
    z = coarse[-1][1].project(np.zeros(coarse[-1][0].size))
    for level in range(len(coarse) - 1, 0, -1):
        q, box = coarse[level]
        states = _pivot(hierarchy.matrices[level], q, box, z, _Inner(True, _preconditioner(hierarchy, level)))
        target = COARSE_TOLERANCE * norm(q)
        for step in range(COARSE_STEPS + 1):
            state = advance(states)
            if isinstance(state, Finished):
                break
            if not isinstance(state, _State):
                return state
            z = state.z
            if state.size <= target or step >= COARSE_STEPS:
                break
        z = hierarchy.prolongations[level - 1] @ box.project(z)
    return z


def _preconditioner(hierarchy: Hierarchy, level: int) -> Preconditioner:
    return lambda indices, block: hierarchy.preconditioner(level, indices, block)


class _State(NamedTuple):
    """z and w = M z + q, shape (n,), the states, and |min(diag(M) z, w)|_2."""

    z: Vector
    w: Vector
    basis: Basis
    size: float


def _pivot(M: Matrix, q: Vector, box: Box, z: Vector, inner: _Inner) -> Generator[_State, None, Ending]:
    diagonal = M.diagonal()
    if not diagonal.min() > 0:
        return Breakdown(NOT_POSITIVE)
    w = M @ z + q
    size = least = norm(box.gaps(z, w, diagonal))
    stagnant_steps, basis = 0, None
    if size == 0:
        yield _State(z, w, box.basis_of(z / 2), size)
        return Finished()
    while True:
        previous, basis = basis, box.basis_of(0.5 * (z - w / diagonal))
        unchanged = previous is not None and not basis.changes(previous)
        if not unchanged and not inner.select(M, np.flatnonzero(basis.basic)):
            return Breakdown("a coarse version of M is singular")
        at_bounds = box.nonbasic(basis)
        b = -(q + M @ at_bounds if at_bounds.any() else q)[inner.indices]
        solved = inner.solve(b, z[inner.indices], size, FINAL_REDUCTION if unchanged else REDUCTION)
        if solved is None:
            return Breakdown(f"{inner.patience} products with M did not gain a digit")
        z = at_bounds
        z[inner.indices] = solved
        w = M @ z
        w += q
        size = norm(box.gaps(z, w, diagonal))
        yield _State(z, w, basis, size)
        stagnant_steps = 0 if size < least else stagnant_steps + 1
        least = min(size, least)
        if size == 0:
            return Finished()
        if stagnant_steps >= MAX_STAGNANT_STEPS:
            if least <= STAGNATION * norm(absolute_product(M, np.abs(z)) + np.abs(q)):
                return Stalled("the residual has stopped falling at rounding level")
            return Breakdown("block principal pivoting has stopped making progress")


class _Inner:
    """Solves with principal submatrices by a Krylov method, preconditioned if a preconditioner is given."""

    def __init__(self, symmetric: bool, precondition: Preconditioner | None = None) -> None:
        self._method, self._cost = (conjugate_gradients, 1) if symmetric else (bicgstab, 2)
        self._precondition = precondition
        self.patience = PATIENCE if precondition is None else PATIENCE_MULTILEVEL
        self._cycle: Callable[[Vector], Vector] = identity
        self._built_cycle: Callable[[Vector], Vector] = identity
        self._built: Indices = np.zeros(0, dtype=np.intp)
        self.products = 1
        self.indices: Indices = np.zeros(0, dtype=np.intp)

    def select(self, M: Matrix, indices: Indices) -> bool:
        """Select the principal submatrix of these indices; False if its preconditioner cannot be built."""
        self.indices = indices
        self._block = M if indices.size == M.shape[0] else M[indices][:, indices]
        if self._precondition is None or not indices.size:
            return True
        positions = np.full(M.shape[0], -1)
        positions[self._built] = np.arange(self._built.size)
        positions = positions[indices]
        known = np.flatnonzero(positions >= 0)
        if indices.size + self._built.size - 2 * known.size <= REUSE_CHANGE * indices.size:
            self._cycle = _carried_over(self._built_cycle, self._built.size, positions[known], known)
            return True
        try:
            self._cycle = self._built_cycle = self._precondition(indices, self._block)
        except SingularMatrix:
            return False
        self._built = indices
        return True

    def solve(self, b: Vector, start: Vector, residual: float, reduction: float) -> Vector | None:
        """y with |b - A y|_2 <= reduction * residual, from a start; None if it falls far short."""
        self.products += 1
        if not b.size:
            return b
        max_iterations = int(self.patience * -np.log10(reduction)) // self._cost
        with np.errstate(all="ignore"):
            y, remaining = self._method(self._product, b, start, reduction * residual, max_iterations, self._cycle)
        return y if remaining <= REDUCTION * residual else None

    def _product(self, v: Vector) -> Vector:
        self.products += 1
        image: Vector = self._block @ v
        return image


def _carried_over(
    cycle: Callable[[Vector], Vector], size: int, positions: Indices, known: Indices
) -> Callable[[Vector], Vector]:
    """A preconditioner for one index set from that of another, of given size: its principal part, and the identity.

    known are the positions of the common indices in the new set, places those in the old one.
    """

    def carried(b: Vector) -> Vector:
        old = np.zeros(size)
        old[positions] = b[known]
        x: Vector = b.copy()
        x[known] = cycle(old)[positions]
        return x

    return carried
