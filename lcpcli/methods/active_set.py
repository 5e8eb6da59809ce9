"""Block principal pivoting on large sparse problems, whose basic solutions are
approximated by Krylov methods.

It is a semismooth Newton method: M. Hintermüller, K. Ito and K. Kunisch, The
primal-dual active set strategy as a semismooth Newton method, SIAM Journal on
Optimization 13 (2003) 865-888; here with inexact solves: each step need only reduce the
residual by a digit.

A step for all variables moves the edge of the active set by one ring of neighbours. So
it has to start close to this edge, as coarse versions of the problem suggest, and
between two steps the variables close to infeasibilities are pivoted by themselves, with
the others fixed, which costs little.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import islice
from typing import NamedTuple

import numpy as np

from lcpcli.basis.exchanges import BasicSolution, block_principal_pivoting
from lcpcli.interrupts import raise_if_timed_out
from lcpcli.linalg.doubles import EPS, ROUNDING, SMALLEST_NORMAL
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix, Solve
from lcpcli.linalg.krylov import (
    Measure,
    StoppingCriterion,
    bicgstab,
    conjugate_gradients,
    identity,
    norm,
    relative_to,
)
from lcpcli.linalg.matrices import absolute_product, is_narrow, is_symmetric
from lcpcli.linalg.stencils import Operator
from lcpcli.linalg.units import equilibrate
from lcpcli.methods import stages
from lcpcli.methods.multilevel import FullApproximation, Hierarchy, VCycles
from lcpcli.methods.newton import finish
from lcpcli.methods.stages import (
    Breakdown,
    Finished,
    Iterate,
    MethodSequence,
    Stage,
    Stalled,
)
from lcpcli.model.box import BASIC, Box
from lcpcli.model.changes import in_units
from lcpcli.model.problem import Problem
from lcpcli.typing import BasisStatus, Mask, Matrix, Vector

REDUCTION = 0.1  # of the residual, by one inexact solve
FINAL_REDUCTION = 1e-3  # of the residual, once P is unchanged from the last step
PATIENCE_PRODUCTS = 20  # with M per digit: more indicate an ill-conditioned M
# Pivoting steps without a new minimum of the residual, after which pivoting is
# considered to cycle.
MAX_STAGNANT_STEPS = 6
# Relative to |M| |z| + |q|: a residual that stagnates below this is at rounding level.
STAGNATION = 100 * EPS
# Steps of a preconditioned method: in a rough solve, and at most in the last one.
ROUGH_STEPS, FINAL_STEPS = 3, 100
ACCURACY = 1e-12  # relative to the terms of a row: what the last solve leaves
ROUNDING_REACHED = "the residual has stopped falling at rounding level"
NO_PROGRESS = "block principal pivoting makes no further progress"

Preconditioners = Callable[[Mask], Solve]
"""For each set of basic variables, an approximate inverse of their principal submatrix,
for vectors of shape (n,) that are 0 elsewhere."""


# Without it: a dominant M in 2000 unknowns takes 400 times as long.
def krylov(problem: Problem, x0: Vector, symmetric: bool) -> Stage:
    """Pivot on all infeasibilities, solving M_PP z_P = -q_P by conjugate gradients or,
    if M is not symmetric, BiCGSTAB.

    M must be sparse with positive diagonal, ideally all ones. A solve starts from the
    last z and stops when its residual is a tenth of min(z, Mz + q), so that P converges
    before the last digits do. It needs only some ten vectors of memory. symmetric :
    whether M is, up to rounding.

    Yields x = (z - w) / 2 for each pivoting step, with F where z is within its bounds;
    evaluations are products with M.
    Finished : the residual is zero. Stalled : it stagnates at rounding level. Breakdown
    : the steps do not advance. Raises SingularMatrix if M is too ill-conditioned for
    this method, or no P-matrix.
    """
    box = problem.box
    start = KrylovStart(box.z_of(x0))
    inexact = Inexact(problem.M, problem.q, box, start, symmetric)
    smallest_residual = inexact.size
    stagnant = 0
    pivoting = block_principal_pivoting(inexact, inexact.basis)
    while stagnant < MAX_STAGNANT_STEPS:
        if inexact.size:
            next(pivoting)
        x = box.x_within(inexact.z, inexact.w, inexact.basis)
        F = (
            inexact.w - (box.reflected(x) - x)
            if (inexact.z == box.project(inexact.z)).all()
            else None
        )
        yield Iterate(x, F, "", inexact.products, signs_final=F is not None)
        if not inexact.size:
            return Finished()
        stagnant = 0 if inexact.size < smallest_residual else stagnant + 1
        smallest_residual = min(inexact.size, smallest_residual)
    return (
        Stalled(ROUNDING_REACHED)
        if smallest_residual <= STAGNATION * norm(inexact.terms())
        else Breakdown(NO_PROGRESS)
    )


class KrylovStart(NamedTuple):
    """How pivoting with Krylov methods starts: from a z, with preconditioners, and with
    products with M, if there are any."""

    z: Vector
    precondition: Preconditioners | None = None
    operator: Operator | None = None


class Inexact:
    """A problem whose basic solutions are approximated by a Krylov method, perhaps
    preconditioned.

    z, w, basis : the last basic solution; w = M z + q. size : |min(diag(M) z, w)|_2.
        products : products with M so far.
    """

    def __init__(
        self,
        M: Matrix,
        q: Vector,
        box: Box,
        start: KrylovStart,
        symmetric: bool,
    ) -> None:
        self.M = M
        self.q = q
        self.box = box
        self.z = start.z
        self.diagonal = M.diagonal()
        self._operator = start.operator or Operator(M)
        self.is_symmetric = symmetric
        self._method, self._cost = (
            (conjugate_gradients, 1) if symmetric else (bicgstab, 2)
        )
        # The buffer of the products, if one at a time is needed.
        self._image = np.empty(q.size) if symmetric else None
        self._precondition = start.precondition
        self.products = 0
        self._solve: Solve = identity
        self._measure()
        with np.errstate(divide="ignore", invalid="ignore"):
            self.basis = box.basis_of(0.5 * (self.z - self.w / self.diagonal))

    def _measure(self) -> None:
        self.w = self._operator(self.z)
        self.w += self.q
        self.size = norm(self.box.gaps(self.z, self.w, self.diagonal))
        self.products += 1

    def terms(self) -> Vector:
        """Return the terms |M| |z| + |q| of each row."""
        terms: Vector = absolute_product(self.M, np.abs(self.z))
        terms += np.abs(self.q)
        return terms

    def at(self, basis: BasisStatus) -> BasicSolution:
        """Approximate the basic solution of a basis; raise SingularMatrix if that takes
        too long."""
        unchanged = self.products > 1 and np.array_equal(basis, self.basis)
        reduction = FINAL_REDUCTION if unchanged else REDUCTION
        max_steps = int(PATIENCE_PRODUCTS * -np.log10(reduction)) // self._cost
        size = self.size
        if not self.approach(basis, reduction * size, max_steps) <= REDUCTION * size:
            raise SingularMatrix(
                f"{PATIENCE_PRODUCTS} products with M did not gain a digit"
            )
        return self.basic_solution_of(basis)

    def approach(
        self, basis: BasisStatus, target: float, max_steps: int, measure: Measure = norm
    ) -> float:
        """Move z towards the basic solution of a basis in at most max_steps steps,
        until the measure of the residual is at most the target; return this measure."""
        z, basic = self.box.nonbasic(basis), basis == BASIC
        mask = basic.astype(float)
        if self._precondition is not None and (
            self._solve is identity or not np.array_equal(basis, self.basis)
        ):
            self._solve = self._precondition(basic)
        b = -(self.q + self._operator(z) if np.count_nonzero(z) else self.q) * mask

        def product(v: Vector) -> Vector:
            raise_if_timed_out()
            self.products += 1
            return np.asarray(self._operator(v, mask, self._image))

        with np.errstate(all="ignore"):
            stopping = StoppingCriterion(target, max_steps, measure)
            y, residual_size = self._method(
                product, b, self.z * mask, stopping, self._solve
            )
        z += y
        self.z, self.basis = z, basis
        self._measure()
        return residual_size

    def basic_solution_of(self, basis: BasisStatus) -> BasicSolution:
        """Return the last z and w after a step of Jacobi's method, with their
        infeasibilities; a basic z_i at its lower bound is treated as below it."""
        basic = basis == BASIC
        residual = np.where(basic, self.w, 0.0)
        z, w = self.z - residual / self.diagonal, self.w - residual
        wrong = self.box.wrong(z, w, basis) | (basic & (z == self.box.lower))
        return BasicSolution(basis, z, w, wrong, self.size == 0)


ROUNDS_PATIENCE = 3  # steps without a new minimum of infeasibilities
# Variables at most so many entries of M away from infeasibilities are pivoted by
# themselves.
HOPS = 8
MAX_LOCAL_STEPS = 40  # of pivoting with these
# Local pivoting stops once there are so few infeasibilities, relative to the number of
# these variables, and the residual is so small, relative to that at its start.
SETTLED_CHANGES, SETTLED_SIZE = 0.002, 0.03
# Fraction by which a set of basic variables may differ from the set whose factors
# precondition it.
REUSE_CHANGE = 0.03


# Without it: an obstacle with 10,000 unknowns takes twice as long.
def multilevel(problem: Problem, symmetric: bool) -> Stage:
    """Pivot by `active_set` from the basis that coarse versions of the problem suggest.

    M must be sparse with a positive diagonal, and smooth vectors those that it makes
    small, as for differential equations and graphs. V-cycles of the same coarse
    versions are the preconditioners, so that nothing is factorized, and time and memory
    are proportional to n. Takes `symmetric`, yields, returns and raises as
    `active_set`.
    """
    return active_set(problem, partial(_coarse_start, problem), symmetric)


def _coarse_start(problem: Problem) -> KrylovStart:
    hierarchy = Hierarchy(problem.M)
    if hierarchy.is_stuck:
        raise SingularMatrix("coarsening M does not make it much smaller")
    z = FullApproximation(hierarchy, problem.q, problem.box).solution()
    cycles = VCycles(hierarchy)  # in single precision, and without the hierarchy
    operator = hierarchy.levels[0].operator if hierarchy.levels else None
    return KrylovStart(z, cycles, operator)


def active_set(
    problem: Problem, start_factory: Callable[[], KrylovStart], symmetric: bool
) -> Stage:
    """Pivot on all infeasibilities, with a few preconditioned products a step; between
    two steps, pivot close to these only, which moves the edge of the active set by
    several rings at a small cost.

    start_factory : returns the start, or raises SingularMatrix.
    symmetric : whether M is symmetric, up to rounding.

    Yields x = (z - w) / 2 for each step; evaluations are products with M. Stalled : the
    residual of the last one is at rounding level. Raises SingularMatrix if a system is
    singular.
    """
    inexact = Inexact(problem.M, problem.q, problem.box, start_factory(), symmetric)
    basis = inexact.basis
    min_infeasible = problem.n + 1
    nonmonotone_steps_left = ROUNDS_PATIENCE
    while nonmonotone_steps_left:
        inexact.approach(basis, 0.0, ROUGH_STEPS)
        basic_solution = inexact.basic_solution_of(basis)
        if not np.count_nonzero(basic_solution.wrong):
            terms = inexact.terms()
            error_bounds = (
                np.maximum(
                    ROUNDING * terms,
                    ACCURACY * np.minimum(terms, np.abs(inexact.q).max()),
                )
                + SMALLEST_NORMAL
            )
            if (
                not inexact.approach(basis, 1.0, FINAL_STEPS, relative_to(error_bounds))
                <= 1
            ):
                return Breakdown(
                    f"{FINAL_STEPS} steps with a preconditioner did not solve a system"
                )
            basic_solution = inexact.basic_solution_of(basis)
        count = int(np.count_nonzero(basic_solution.wrong))
        x = problem.box.x_within(inexact.z, inexact.w, inexact.basis)
        yield Iterate(x, None, "", inexact.products, signs_final=not count)
        if not count:
            return Stalled(ROUNDING_REACHED)
        nonmonotone_steps_left = (
            ROUNDS_PATIENCE if count < min_infeasible else nonmonotone_steps_left - 1
        )
        min_infeasible = min(count, min_infeasible)
        basis = _pivot_locally(inexact, basic_solution)
    return Breakdown(NO_PROGRESS)


# Without it: an obstacle with 250,000 unknowns takes 12 steps for 5, in 1.15 times the
# time.
def _pivot_locally(inexact: Inexact, basic_solution: BasicSolution) -> BasisStatus:
    """Pivot on the infeasibilities, and then with the variables close to them alone,
    until their basis hardly changes; return the basis."""
    box = inexact.box
    basis = inexact.box.exchanged(
        basic_solution.basis, basic_solution.wrong, basic_solution.z
    )
    inexact.z = np.where(basis == BASIC, box.project(inexact.z), box.nonbasic(basis))
    is_local = basic_solution.wrong.copy()
    for _ in range(HOPS):
        is_local[inexact.M[is_local.nonzero()[0]].indices] = True
    local_indices = is_local.nonzero()[0]
    rows, z = inexact.M[local_indices], inexact.z[local_indices]
    inexact.z[local_indices] = 0.0
    q = inexact.q[local_indices] + rows @ inexact.z
    local_problem = Inexact(
        rows[:, local_indices],
        q,
        box.part(local_indices),
        KrylovStart(z),
        inexact.is_symmetric,
    )
    start = local_problem.size
    try:
        for local_solution in islice(
            block_principal_pivoting(local_problem, local_problem.basis),
            MAX_LOCAL_STEPS,
        ):
            basis[local_indices] = local_problem.box.exchanged(
                local_solution.basis, local_solution.wrong, local_solution.z
            )
            if (
                np.count_nonzero(local_solution.wrong) <= SETTLED_CHANGES * q.size
                and local_problem.size <= SETTLED_SIZE * start
            ):
                break
    except SingularMatrix:
        basis[local_indices] = local_problem.basis
    inexact.z[local_indices] = local_problem.z
    return basis


class Factors:
    """Preconditioners from factors of a principal submatrix, which are reused while few
    variables change, unless the band of M is so narrow that new ones cost little; they,
    or a call for one, raise SingularMatrix."""

    def __init__(self, M: Matrix) -> None:
        self._change = 0.0 if is_narrow(M) else REUSE_CHANGE
        self._solver, self._basic = PrincipalSolver(M), np.zeros(M.shape[0], dtype=bool)
        self._factors: Solve = identity

    def __call__(self, basic: Mask) -> Solve:
        if np.count_nonzero(basic != self._basic) > self._change * np.count_nonzero(
            basic
        ):
            self._basic, self._factors = basic, self._solver.at(basic.nonzero()[0])
        factored_indices = self._basic.nonzero()[0]
        factors = self._factors
        both = basic & self._basic

        def solve(b: Vector) -> Vector:
            inner = np.zeros(b.size)
            inner[factored_indices] = factors((b * both)[factored_indices])
            return np.where(both, inner, b)

        return solve


# Median excess of the diagonal entries, which are 1, over the others of their rows,
# below which products alone do not suffice.
WEAK_DOMINANCE = 0.02
STIFF = "conjugate gradients converge slowly, and M is no M-matrix"


def sparse_route(
    problem: Problem, x0: Vector, is_stiff: Callable[[], bool] = lambda: False
) -> Stage:
    """Solve the problem, scaled so that M has diagonal 1, by pivoting with inexact
    solves.

    Well-conditioned M, however large and with any fill-in, needs a few dozen products
    and no factorization (`krylov`). It gives up early if convergence is slow, and is
    skipped where no entry off the diagonal is positive and these almost add up to the
    diagonal, as for differential equations. Then the start and the solves come from
    coarse versions of M (`multilevel`), or, where these converge slowly, the solves
    come from factors of principal submatrices. Where rounding stops the solves of these
    last two short of the tolerance, `finish` factorizes the last submatrix; where it
    stops `krylov`, the stage ends as stalled.

    It is meant for sparse positive definite and H-matrices; it may fail for other M,
    and then returns the ending of its last part.

    is_stiff : returns whether M is positive definite, but no M-matrix, so that
        `methods.definite` follows, which is made for such M: then `krylov` alone is
        run, which solves them while they are well-conditioned, and gives up after some
        60 products, 1 % of the time that follows.
    """
    diagonal = problem.M.diagonal()
    if not diagonal.min() > 0:
        return Breakdown("a diagonal entry of M is not positive")
    symmetric = is_symmetric(problem.M)
    C = 1 / np.sqrt(diagonal) if symmetric else equilibrate(problem.M, problem.q)[1]
    units = in_units(problem, C if symmetric else 1 / (diagonal * C), C)
    problem, sequence = units.problem, MethodSequence(units.start(x0), change=units)
    x, M = sequence.last.x, problem.M
    # No positive entry off the diagonal, which is 1.
    is_z_matrix = np.count_nonzero(M.data > 0) == M.shape[0]
    if not (is_z_matrix and np.median(M @ np.ones(M.shape[0])) < WEAK_DOMINANCE):
        ending = yield from sequence.run_stage("krylov", krylov(problem, x, symmetric))
        if isinstance(ending, Stalled | Finished):
            return ending
        if is_stiff():
            return Breakdown(STIFF)
    ending = yield from sequence.run_stage("multilevel", multilevel(problem, symmetric))
    if isinstance(ending, Breakdown):
        z = problem.box.z_of(sequence.last.x)
        stage = active_set(problem, lambda: KrylovStart(z, Factors(M)), symmetric)
        ending = yield from sequence.run_stage("multilevel", stage)
    if isinstance(ending, Stalled):
        stage = finish(problem, sequence.last.x, stages.ended(ending))
        return (yield from sequence.run_stage("multilevel", stage))
    return ending
