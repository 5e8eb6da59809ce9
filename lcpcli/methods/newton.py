"""Block principal pivoting on one problem: newton, its starts, also by projected
gradients, and the finish of another method.

Generalized Newton on F(x) = 0: where x has no zero, F is linear, and the Newton step
from x leads to the basic solution of the complementary set P = {i : x_i > 0}: M_PP z_P
= -q_P, w_P = 0, z_N = 0, w_N = M_NP z_P + q_N. The next pivot is on the indices of
negative entries. With bounds, a basic variable goes to the bound that it violates, and
a variable at a bound whose w is infeasible becomes basic. The pivots and their source
are in `basis.exchanges`, their safeguard in `direct`.

Projected gradients determine active sets that are almost right by products with M
alone: J. Barzilai and J. M. Borwein, Two-point step size gradient methods, IMA Journal
of Numerical Analysis 8 (1988) 141-148, projected as in E. G. Birgin, J. M. Martínez and
M. Raydan, Nonmonotone spectral projected gradient methods on convex sets, SIAM Journal
on Optimization 10 (2000) 1196-1211, with alternating step sizes (Y.-H. Dai and R.
Fletcher, Projected Barzilai-Borwein methods for large-scale box-constrained quadratic
programming, Numerische Mathematik 100 (2005) 21-47) and without a line search.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lcpcli.basis.exchanges import BasicSolutions, BasisSolver
from lcpcli.linalg.doubles import largest
from lcpcli.linalg.factors import MAX_NUMPY_ROWS, SingularMatrix
from lcpcli.linalg.krylov import gmres
from lcpcli.linalg.matrices import is_narrow, is_sparse, product
from lcpcli.methods.direct import Safeguard
from lcpcli.methods.stages import (
    Breakdown,
    Finished,
    Iterate,
    MethodSequence,
    Stage,
    Stalled,
    advance,
)
from lcpcli.model.box import BASIC, Box
from lcpcli.model.problem import Problem
from lcpcli.typing import BasisStatus, Vector

if TYPE_CHECKING:
    from lcpcli.methods.direct import Made

LEAST_INDEX, FINISH = "least index", "finish"
SLOW = "the active set converges too slowly"
# Single pivots before other methods are run: block pivots advance, single ones may take
# 2^n steps.
MAX_LEAST_INDEX_STEPS = 60
FAST_STEP = 0.5  # the largest fraction of the violations after a fast step
# Slower steps after which the starting basis is not almost right; a step costs little
# if the band is narrow.
SLOW_STEPS, SLOW_STEPS_NARROW = 2, 12
# Relative to the largest |z_i|: how far rounding may have moved z beyond a bound.
NEAR_BOUND = 1e-9

# Steps of GMRES that decide whether the basis of a start is worth a factorization.
CHECK_STEPS = 2
# Fraction of infeasible components after these; of a random basis it is a half, of a
# right one a quarter or less.
MAX_INFEASIBLE_FRACTION_AT_CHECK = 0.4

# Consecutive iterates with almost unchanged P before an attempt to finish.
STABLE_ITERATES = 2
# Products with M that take as long as a sparse factorization, unless that fills in
# much.
SPARSE_PRODUCTS = 30.0
# Products with M that take as long as a dense factorization, relative to n: they would
# be n / 3, but for blocks that stay in the cache.
DENSE_PRODUCTS = 0.03
# Relative to n: the change of P per iterate up to which P is almost unchanged.
MAX_CHANGE = 0.004


class Exchange(NamedTuple):
    """The quantities of a basic solution. infeasibilities : the number of infeasible
    components; the next pivot is on all of them or on the least index."""

    infeasibilities: int


def _exchange_at(z: Vector, w: Vector) -> Exchange:
    return Exchange(int(np.count_nonzero(np.minimum(z, w) < 0)))


def newton(
    problem: Problem | BasisSolver,
    x0: Vector,
    patience: float = math.inf,
    hasty: bool = False,
    growing: bool = False,
) -> Stage:
    """Pivot on all indices whose z_i or w_i is negative; after BLOCK_PATIENCE steps
    without a new minimum of their number, pivot on the least index only.

    Terminates at the solution after finitely many steps for every P-matrix M and every
    q, in practice after a handful. For other matrices it may meet a singular M_PP or
    cycle. An iteration costs one factorization of M_PP and one product with M.

    Of x0 only the signs matter. patience : the largest number of pivots on the least
    index: unlike block pivots, they may take 2^n. hasty : whether it stops where it is
    `Safeguard.is_hopeless`, as another method follows.
    growing : whether block pivots go without the safeguard while no basic variable is
        infeasible: the basic variables of a Z-matrix then stay basic, as in `z_matrix`.
    """
    system = problem if isinstance(problem, BasisSolver) else BasicSolutions(problem)
    guard, step = Safeguard(x0.size, patience), "block"
    try:
        for evaluations, basic_solution in enumerate(
            system.block_principal_pivoting(system.box.basis_of(x0)), 1
        ):
            infeasible = int(np.count_nonzero(basic_solution.wrong))
            yield Iterate(
                basic_solution.x,
                None,
                step,
                evaluations,
                signs_final=basic_solution.is_solution,
                quantities=partial(
                    Exchange, 0 if basic_solution.is_solution else infeasible
                ),
            )
            if not infeasible:
                break
            if (
                growing
                and not basic_solution.wrong[basic_solution.basis == BASIC].any()
            ):
                step = "block"
                continue
            guard.choose(basic_solution.wrong, infeasible)
            if guard.left < 0:
                return Stalled("the least-index steps were not enough")
            if hasty and guard.is_hopeless(x0.size):
                return Stalled(SLOW)
            step = LEAST_INDEX if guard.single else "block"
    except SingularMatrix as error:
        return Breakdown(str(error))
    return Finished()


def without_w(problem: Problem) -> Stage:
    """Solve M z = -q, for a solution with w = 0 whose z_i at bounds have any sign by
    rounding, as on a set of published problems with indefinite M: block pivots go
    astray there, as the status of these z_i is not unique.

    Finished : z is within its bounds up to NEAR_BOUND, so that it may solve the
        problem. Stalled : it is not.
    """
    try:
        basic_solution = BasicSolutions(problem).at(
            np.full(problem.n, BASIC, dtype=np.int8)
        )
    except SingularMatrix as error:
        return Breakdown(str(error))
    if not (
        basic_solution.is_solution
        or largest(problem.box.project(basic_solution.z) - basic_solution.z)
        <= NEAR_BOUND * largest(basic_solution.z)
    ):
        return Stalled("components of z are beyond their bounds where w = 0")
    yield Iterate(
        problem.box.x_within(basic_solution.z, basic_solution.w, basic_solution.basis),
        None,
        "block",
        1,
    )
    return Finished()


def iterate_of(made: Made, evaluations: int) -> Iterate:
    """Return a basic solution of block pivoting elsewhere as an iterate of newton."""
    z, w, is_single = made
    return Iterate(
        (z - w) / 2,
        None,
        LEAST_INDEX if is_single else "block",
        evaluations,
        "newton",
        signs_final=False,
        quantities=partial(_exchange_at, z, w),
    )


def dense_route(
    problem: Problem,
    x0: Vector,
    patience: float = MAX_LEAST_INDEX_STEPS,
    hasty: bool = False,
) -> Stage:
    """Run newton from x0 or, if x0 = 0, from the reference point and its w (z = 0 and w
    = q for an LCP); for large n, from the active set at which projected gradients
    arrive.

    A product with M costs a small part of a factorization, and a few dozen of them
    correct almost all infeasibilities for which block pivoting would take several
    factorizations, if M is a well-conditioned P-matrix.
    """
    reference = 0.0 if problem.reference_z is None else problem.reference_z
    start = x0 if np.count_nonzero(x0) else (reference - problem.q_ref) / 2
    if problem.n <= MAX_NUMPY_ROWS:
        return (yield from newton(problem, start, patience, hasty))
    sequence = MethodSequence(x0)
    ending = yield from sequence.run_stage("gradient", projected_gradient(problem, x0))
    start = start if isinstance(ending, Breakdown) else sequence.last.x
    return (
        yield from sequence.run_stage("newton", newton(problem, start, patience, hasty))
    )


def from_states(
    problem: Problem, basis: BasisStatus, solutions: BasicSolutions | None = None
) -> Stage:
    """Pivot by blocks from an almost right basis, while all but a few steps leave at
    most FAST_STEP of the violations.

    The basis of a solution takes one factorization, even where many components are 0 up
    to rounding. Finished : there is no infeasibility beyond rounding. Stalled or
    Breakdown : the basis is far from right. solutions : those of the problem, if they
    have been made before.
    """
    solutions, before = solutions or BasicSolutions(problem), problem.n
    slow = (
        SLOW_STEPS_NARROW
        if is_sparse(problem.M) and is_narrow(problem.M)
        else SLOW_STEPS
    )
    try:
        for evaluations, basic_solution in enumerate(
            solutions.block_principal_pivoting(basis), 1
        ):
            violations = solutions.count_violations(basic_solution)
            if not violations:
                yield Iterate(
                    problem.box.x_within(
                        basic_solution.z, basic_solution.w, basic_solution.basis
                    ),
                    None,
                    "block",
                    evaluations,
                    quantities=partial(Exchange, 0),
                )
                return Finished()
            yield Iterate(
                basic_solution.x,
                None,
                "block",
                evaluations,
                signs_final=False,
                quantities=partial(Exchange, violations),
            )
            slow, before = slow - (violations > FAST_STEP * before), violations
            if not slow:
                break
    except SingularMatrix as error:
        return Breakdown(str(error))
    return Stalled("the starting basis is not close to a solution basis")


def from_start(problem: Problem, basis: BasisStatus) -> Stage:
    """Pivot as `from_states` from the basis of a start, unless a rough basic solution
    of a large M, which costs less than a factorization, has more than
    MAX_INFEASIBLE_FRACTION_AT_CHECK of infeasible components.

    From a right basis, few components are infeasible if M + M' is almost positive
    definite. That is unknown; but where an M_ii <= 0 shows that it is not, nothing is
    concluded.
    """
    M, diagonal = problem.M, problem.M.diagonal()
    if problem.n > MAX_NUMPY_ROWS and diagonal.min() > 0.0:
        with np.errstate(all="ignore"):
            z = problem.box.nonbasic(basis)
            factors = np.where(basis == BASIC, 1.0 / diagonal, 0.0)
            w = problem.w(z) if np.count_nonzero(z) else problem.q.copy()
            step = gmres(lambda v: factors * product(M, v), -factors * w, CHECK_STEPS)
            w += product(M, step)
            w[basis == BASIC] = 0.0
            n_infeasible = np.count_nonzero(problem.box.wrong(z + step, w, basis))
        if n_infeasible > MAX_INFEASIBLE_FRACTION_AT_CHECK * problem.n:
            return Stalled("the starting basis is far from that of a solution")
    return (yield from from_states(problem, basis))


def finish(problem: Problem, x0: Vector | None, stage: Stage) -> Stage:
    """Pass on the iterates of a stage, and finally the solution as soon as their active
    set yields it, without infeasibility beyond rounding; it has step "finish", and the
    ending is Finished. Otherwise return the ending of the stage.

    An attempt, as by `from_states`, begins when P is almost unchanged for
    STABLE_ITERATES iterates and attempts have cost no more than the evaluations of the
    stage so far, as products with M; and in any case when the stage finishes.

    x0 : the start of the stage, whose active set is used too; None if it has none.
    """
    box = problem.box
    solutions = BasicSolutions(problem)
    basis = None if x0 is None else problem.box.basis_of(x0)
    visited_basis = b""
    spent = 0.0
    stable = 0
    evaluations = 0
    while True:
        step = advance(stage)
        is_due = basis is not None
        if isinstance(step, Iterate):
            yield step
            before = basis
            basis = box.basis_of(step.x)
            evaluations = step.evaluations
            is_stable = (
                before is not None
                and np.count_nonzero(basis != before) <= MAX_CHANGE * problem.n
            )
            stable = stable + 1 if is_stable else 0
            is_due = (
                stable >= STABLE_ITERATES
                and spent + _products(problem, basis) <= evaluations
            )
        if basis is not None and is_due and basis.tobytes() != visited_basis:
            visited_basis = basis.tobytes()
            attempt = from_states(problem, basis, solutions)
            with np.errstate(over="ignore", invalid="ignore"):
                while isinstance(outcome := advance(attempt), Iterate):
                    last, spent = outcome, spent + _products(problem, basis)
            if isinstance(outcome, Finished):
                yield last._replace(
                    step=FINISH, evaluations=evaluations + last.evaluations
                )
                return Finished()
        if not isinstance(step, Iterate):
            return step


def _products(problem: Problem, basis: BasisStatus) -> float:
    """Return how many products with M take about as long as a step of pivoting from
    this basis."""
    if is_sparse(problem.M):
        return SPARSE_PRODUCTS
    basic_fraction = float(np.count_nonzero(basis == BASIC)) / problem.n
    return 1.0 + DENSE_PRODUCTS * basic_fraction**3 * problem.n


GRADIENT_BLOCK = 4  # steps between two checks of the active set
# Largest number of status changes at two checks with which the active set has
# converged: so many, or one in so many unknowns.
SETTLED_INDICES, SETTLED_ONE_IN = 8, 500
# Checks within which the changes have to decrease, for the iteration to continue.
CHECKS_TO_ADVANCE = 3
# Growth of |w|^2, scaled to a diagonal of ones, at which the iteration diverges.
GRADIENT_GROWTH = 1e6
# Steps at most; for large n as many as take no longer than a factorization, if these
# are more.
MAX_GRADIENT_STEPS = 40
MAX_PER_UNKNOWN = 1 / 12
# Largest size, whose reciprocal is the smallest, at which products stay within single
# precision.
SINGLE_RANGE = 1e9


# Without it: dense P-matrices of 300 to 1000 unknowns take 1.3 to 1.6 times as long.
def projected_gradient(problem: Problem, x0: Vector) -> Stage:
    """Iterate z' = mid(l, u, z - t D^-1 (M z + q)), D = diag(M), with Barzilai and
    Borwein's two step sizes t alternately.

    A dense M is used in single precision, unless numbers are too large or small for it:
    that is enough for a likely basis, and a product takes half the time, or less where
    M in double precision does not fit in the cache.

    Yields only the last x = (z - D^-1 w) / 2, which represents the likely basis, as the
    work of the loop on an iterate may take as long as a step. Finished : the active set
    has converged. Stalled : it has not converged within MAX_GRADIENT_STEPS, or makes no
    further progress.
    """
    box, diagonal = problem.box, problem.M.diagonal()
    if not diagonal.min() > 0:
        return Breakdown("a diagonal entry of M is not positive")
    units, start = 1 / np.sqrt(diagonal), box.z_of(x0)
    w_start = (
        problem.w(start)
        if np.count_nonzero(problem.from_reference(start))
        else problem.q_ref
    )
    few_changes = max(SETTLED_INDICES, x0.size // SETTLED_ONE_IN)
    history = [x0.size for _ in range(CHECKS_TO_ADVANCE)]
    box = box.in_units(units)
    z = start / units
    w = units * w_start

    def scaled_w(z: Vector) -> Vector:
        return np.asarray(units * problem.w(units * z))

    w_of: Callable[[Vector], Vector] = scaled_w
    sizes = (problem.largest, largest(z), largest(w), units.max(), 1 / units.min())
    if (
        not is_sparse(problem.M)
        and max(sizes) <= SINGLE_RANGE
        and largest(w) >= 1 / SINGLE_RANGE
    ):
        M, scale, q, z, w = (
            array.astype(np.float32)
            for array in (problem.M, units, units * problem.q, z, w)
        )
        box = box.in_single_precision()

        def w_of(z: Vector) -> Vector:
            w = product(M, scale * z)
            w *= scale
            w += q
            return w

    for last in gradient_steps(box, w_of, z, w):
        history.append(last.changes)
        active_set_converged = max(history[-2:]) <= few_changes
        if (
            active_set_converged
            or not last.bounded
            or history[-1] >= max(few_changes, *history[-1 - CHECKS_TO_ADVANCE : -1])
        ):
            break
    if not last.bounded:
        return Breakdown("the projected gradient iteration diverges")
    products = 1 + GRADIENT_BLOCK * (len(history) - CHECKS_TO_ADVANCE)
    yield Iterate(0.5 * units * (last.z - last.w), None, "", products, "", False)
    return (
        Finished()
        if active_set_converged
        else Stalled("the active set did not converge")
    )


class GradientCheck(NamedTuple):
    """The iterate of `gradient_steps` at a check: z and its w, of shape (n,) or (m, n),
    the basis that they represent, the number of changes in it since the last check, and
    whether the iteration is bounded."""

    z: Vector
    w: Vector
    basis: BasisStatus
    changes: int
    bounded: Any


def gradient_steps(
    box: Box, w_of: Callable[[Vector], Vector], z: Vector, w: Vector
) -> Iterator[GradientCheck]:
    """Iterate on problems scaled to a diagonal of ones, one or many, and yield every
    GRADIENT_BLOCK steps.

    w_of : M z + q, as a new array. z, w : the start, shape (n,), or (m, n) for m
        problems.
    """
    basis = box.basis_of(0.5 * (z - w))
    start = _dots(w, w)
    t = z.dtype.type(0.5)
    for step in range(
        1, max(MAX_GRADIENT_STEPS, round(MAX_PER_UNKNOWN * z.shape[-1])) + 1
    ):
        change = t * w
        former, z = z, box.project(np.subtract(z, change, out=change))
        before, w = w, w_of(z)
        z_change, w_change = z - former, w - before
        along = _dots(z_change, w_change)
        with np.errstate(divide="ignore", invalid="ignore"):
            lengths = (
                _dots(z_change, z_change) / along
                if step % 2
                else along / _dots(w_change, w_change)
            )
        t = np.where(along > 0, lengths, t)  # else M shows no positive curvature
        if step % GRADIENT_BLOCK == 0:
            last, basis = basis, box.basis_of(0.5 * (z - w))
            bounded = (_dots(w, w) <= GRADIENT_GROWTH * start)[..., 0]
            yield GradientCheck(
                z, w, basis, int(np.count_nonzero(basis != last)), bounded
            )


def _dots(A: Vector, B: Vector) -> Vector:
    """Return the inner products of vectors, or of the rows of matrices, shape (1,) or
    (m, 1)."""
    return np.asarray(np.einsum("...i,...i->...", A, B))[..., np.newaxis]
