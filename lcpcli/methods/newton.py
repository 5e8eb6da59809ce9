"""Block principal pivoting on one problem: newton, a start from given states, and the finish of another method.

Generalized Newton on F(x) = 0: where x has no zero, F is linear, and the Newton step from x leads to the basic solution
of the complementary set P = {i : x_i > 0}: M_PP z_P = -q_P, w_P = 0, z_N = 0, w_N = M_NP z_P + q_N. Indices of negative
entries are exchanged. With bounds, a basic variable goes to the bound that it violates, and a variable at a bound whose
w has the wrong sign becomes basic. The exchanges and their source are in `basis.exchanges`, their safeguard in
`direct`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from lcpcli.basis.exchanges import BasicSolutions, System
from lcpcli.clock import imports
from lcpcli.linalg.doubles import largest
from lcpcli.linalg.factors import MOST_NUMPY_ROWS, SingularMatrix
from lcpcli.linalg.krylov import gmres
from lcpcli.linalg.matrices import is_narrow, is_sparse, product
from lcpcli.methods.direct import Safeguard
from lcpcli.methods.stages import Breakdown, Finished, Iterate, Stage, Stalled, Turns, advance
from lcpcli.model.box import BASIC
from lcpcli.model.problem import Problem
from lcpcli.typing import States, Vector

if TYPE_CHECKING:
    from lcpcli.methods.direct import Made

LEAST_INDEX, FINISH = "least index", "finish"
SLOW = "the active set settles too slowly"
LEAST_INDEX_STEPS = 60  # before other methods are tried: block steps advance, these may take 2^n
FAST_STEP = 0.5  # of the violations: what a fast step from given states leaves at most
# Other steps after which states are not nearly right; a step costs little if the band is narrow.
SLOW_STEPS, SLOW_STEPS_NARROW = 2, 12
NEAR_BOUND = 1e-9  # relative to the largest |z_i|: how far rounding may have moved z beyond a bound

GLANCES = 2  # steps of GMRES that decide whether the states of a start are worth a factorization:
MOST_WRONG_AT_A_GLANCE = 0.4  # of all signs; of random states it is half, of right ones a quarter or fewer

STABLE_ITERATES = 2  # consecutive iterates with nearly unchanged P before an attempt to finish
SPARSE_PRODUCTS = 30.0  # with M that take as long as a sparse factorization, unless that fills in much
DENSE_PRODUCTS = 0.03  # the same for a dense one, by its order: n / 3, of which blocks in the cache save most
MAX_CHANGE = 0.004  # of n: the change of P per iterate up to which it counts as nearly unchanged


def newton(
    problem: Problem | System, x0: Vector, patience: float = math.inf, hasty: bool = False, growing: bool = False
) -> Stage:
    """Exchange all indices whose z_i or w_i is negative; after BLOCK_PATIENCE steps without a new minimum of their
    number, exchange only the least index.

    Ends at the solution after finitely many steps for every P-matrix M and every q, in practice after a handful. For
    other matrices it may meet a singular M_PP or cycle. An iteration costs one factorization of M_PP and one product
    with M.

    Of x0 only the signs matter. patience : the largest number of exchanges of the least index: unlike block steps, they
    may take 2^n. hasty : whether it is given up where it is `Safeguard.is_hopeless`, as another method follows.
    growing : whether blocks are exchanged without the safeguard while no basic variable is wrong: the basic variables
    of a Z-matrix then stay basic, as in `z_matrix`.
    """
    system = problem if isinstance(problem, System) else BasicSolutions(problem)
    guard, step = Safeguard(x0.size, patience), "block"
    try:
        for evaluations, found in enumerate(system.exchanging(system.box.basis_of(x0)), 1):
            yield Iterate(found.x, None, step, evaluations, signs_final=found.is_solution)
            infeasible = int(np.count_nonzero(found.wrong))
            if not infeasible:
                break
            if growing and not found.wrong[found.basis == BASIC].any():
                step = "block"
                continue
            guard.choose(found.wrong, infeasible)
            if guard.left < 0:
                return Stalled("the least-index steps were not enough")
            if hasty and guard.is_hopeless(x0.size):
                return Stalled(SLOW)
            step = LEAST_INDEX if guard.single else "block"
    except SingularMatrix as error:
        return Breakdown(str(error))
    return Finished()


def without_w(problem: Problem) -> Stage:
    """Solve M z = -q, for a solution with w = 0 whose z_i at bounds have any sign by rounding, as on a set of published
    problems with indefinite M: exchanges go astray there, as these z_i have no definite states.

    Finished : z is within its bounds up to NEAR_BOUND, so that it may solve the problem. Stalled : it is not.
    """
    try:
        found = BasicSolutions(problem).at(np.full(problem.n, BASIC, dtype=np.int8))
    except SingularMatrix as error:
        return Breakdown(str(error))
    if not (found.is_solution or largest(problem.box.project(found.z) - found.z) <= NEAR_BOUND * largest(found.z)):
        return Stalled("components of z are beyond their bounds where w = 0")
    yield Iterate(problem.box.x_within(found.z, found.w, found.basis), None, "block", 1)
    return Finished()


def iterates_of(made: Iterable[Made]) -> Iterator[Iterate]:
    """Yield the basic solutions that block pivoting has made in another place as iterates of newton."""
    for evaluations, (z, w, single) in enumerate(made, 1):
        step = LEAST_INDEX if single else "block"
        yield Iterate((z - w) / 2, None, step, evaluations, "newton", signs_final=False)


def dense_route(problem: Problem, x0: Vector, patience: float = LEAST_INDEX_STEPS, hasty: bool = False) -> Stage:
    """Run newton from x0 or, if x0 = 0, from the reference point and its w (z = 0 and w = q for an LCP); for large n,
    from the active set at which projected gradients arrive.

    A product with M costs a small part of a factorization, and a few dozen of them correct most of the signs that
    block pivoting would take several factorizations for, if M is a well-conditioned P-matrix.
    """
    reference = 0.0 if problem.reference_z is None else problem.reference_z
    start = x0 if np.count_nonzero(x0) else (reference - problem.q_ref) / 2
    if problem.n <= MOST_NUMPY_ROWS:
        return (yield from newton(problem, start, patience, hasty))
    with imports:
        from lcpcli.methods.projected_gradient import projected_gradient
    turns = Turns(x0)
    ending = yield from turns.take("gradient", projected_gradient(problem, x0))
    start = start if isinstance(ending, Breakdown) else turns.last.x
    return (yield from turns.take("newton", newton(problem, start, patience, hasty)))


def from_states(problem: Problem, basis: States, solutions: BasicSolutions | None = None) -> Stage:
    """Pivot by blocks from nearly right states, while most steps leave at most FAST_STEP of the violations.

    The states of a solution take one factorization, even where many components are 0 up to rounding. Finished : no sign
    is violated beyond rounding. Stalled or Breakdown : the states are far from right. solutions : those of the problem,
    if they have been made before.
    """
    solutions, before = solutions or BasicSolutions(problem), problem.n
    slow = SLOW_STEPS_NARROW if is_sparse(problem.M) and is_narrow(problem.M) else SLOW_STEPS
    try:
        for evaluations, found in enumerate(solutions.exchanging(basis), 1):
            violations = solutions.count_violations(found)
            if not violations:
                yield Iterate(problem.box.x_within(found.z, found.w, found.basis), None, "block", evaluations)
                return Finished()
            yield Iterate(found.x, None, "block", evaluations, signs_final=False)
            slow, before = slow - (violations > FAST_STEP * before), violations
            if not slow:
                break
    except SingularMatrix as error:
        return Breakdown(str(error))
    return Stalled("the given states are not close to the states of a solution")


def from_start(problem: Problem, basis: States) -> Stage:
    """Pivot as `from_states` from the states of a start, unless a rough basic solution of a large M, which costs less
    than a factorization, has more than MOST_WRONG_AT_A_GLANCE wrong signs.

    Of right states, few of these are wrong if M + M' is nearly positive definite. That is unknown; but where an
    M_ii <= 0 shows that it is not, nothing is concluded.
    """
    M, diagonal = problem.M, problem.M.diagonal()
    if problem.n > MOST_NUMPY_ROWS and diagonal.min() > 0.0:
        with np.errstate(all="ignore"):
            z, factors = problem.box.nonbasic(basis), np.where(basis == BASIC, 1.0 / diagonal, 0.0)
            w = problem.w(z) if np.count_nonzero(z) else problem.q.copy()
            step = gmres(lambda v: factors * product(M, v), -factors * w, GLANCES)
            w += product(M, step)
            w[basis == BASIC] = 0.0
            wrong = np.count_nonzero(problem.box.wrong(z + step, w, basis))
        if wrong > MOST_WRONG_AT_A_GLANCE * problem.n:
            return Stalled("the given states are far from those of a solution")
    return (yield from from_states(problem, basis))


def finish(problem: Problem, x0: Vector | None, stage: Stage) -> Stage:
    """Pass on the iterates of a stage, and end with the solution as soon as their active set yields it, with no sign
    violated beyond rounding; it has step "finish", and the ending is Finished. Otherwise end as the stage does.

    An attempt, as by `from_states`, begins when P is nearly unchanged for STABLE_ITERATES iterates and attempts have
    cost no more than the evaluations of the stage so far, as products with M; and in any case when the stage ends.

    x0 : the start of the stage, whose active set counts too; None if it has none.
    """
    box, solutions, basis = problem.box, BasicSolutions(problem), None if x0 is None else problem.box.basis_of(x0)
    tried, spent, stable, evaluations = b"", 0.0, 0, 0
    while True:
        step = advance(stage)
        is_due = basis is not None
        if isinstance(step, Iterate):
            yield step
            before, basis, evaluations = basis, box.basis_of(step.x), step.evaluations
            near = before is not None and np.count_nonzero(basis != before) <= MAX_CHANGE * problem.n
            stable = stable + 1 if near else 0
            is_due = stable >= STABLE_ITERATES and spent + _products(problem, basis) <= evaluations
        if basis is not None and is_due and basis.tobytes() != tried:
            tried, attempt = basis.tobytes(), from_states(problem, basis, solutions)
            with np.errstate(over="ignore", invalid="ignore"):
                while isinstance(found := advance(attempt), Iterate):
                    last, spent = found, spent + _products(problem, basis)
            if isinstance(found, Finished):
                yield last._replace(step=FINISH, evaluations=evaluations + last.evaluations)
                return Finished()
        if not isinstance(step, Iterate):
            return step


def _products(problem: Problem, basis: States) -> float:
    """Return about how many products with M a step of pivoting from this basis takes as long as."""
    if is_sparse(problem.M):
        return SPARSE_PRODUCTS
    share = float(np.count_nonzero(basis == BASIC)) / problem.n
    return 1.0 + DENSE_PRODUCTS * share**3 * problem.n
