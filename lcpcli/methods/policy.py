"""The policy: which method is tried first, and which one next if it breaks down, stalls or exhausts its budget."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from functools import partial
from itertools import chain

import numpy as np

from lcpcli import clock, interrupts
from lcpcli.linalg import factors
from lcpcli.linalg.matrices import is_narrow, is_sparse
from lcpcli.methods import stages
from lcpcli.methods.newton import LEAST_INDEX_STEPS, dense_route, from_states, newton
from lcpcli.methods.small import SMALL_PIVOTS, exactly, small
from lcpcli.methods.stages import (
    Finished,
    Iterate,
    NoSolution,
    Search,
    Stage,
    Stalled,
    Turns,
    ended,
    in_given_variables,
)
from lcpcli.model.changes import is_far_from_one, scale
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector
from lcpcli.verify import measure
from lcpcli.verify.certificate import Certificate, farkas_statement, is_clear, proves_infeasible
from lcpcli.verify.point import Criterion, Point
from lcpcli.verify.refinement import is_rounded_solution, refined

REFINED = "refined"
MANY_SHORT_ROWS = 0.2  # of all rows: with no more than one entry, from which on presolve may help the best methods too
MUCH_SMALLER = 0.8  # of the unknowns: what presolve may leave if milp is to begin with that
SIMPLEX_SECONDS = 1.5e-5  # per entry of M, for a linear program before the interior point method has its turn
LEAST_SIMPLEX_SECONDS = 0.1  # the same at least: small linear programs take less
NEWTON_SETTLING_FACTOR = 0.2  # most changes of state in a step of newton, relative to the last step, if it is to go on
MOST_LEMKE_FIRST = 50  # unknowns of the standard form up to which lemke is as fast as the interior point method
LEMKE_PIVOTS = 20  # per unknown, once others have been tried


def auto(
    problem: Problem, x0: Vector, *, time_limit: float = math.inf, presolve: bool = True, states: bool = False
) -> Stage:
    """Solve any LCP, or prove that it has no solution, by the first method that succeeds.

    Dense M: `dense_route`, as newton solves almost every problem with a P-matrix in a handful of factorizations, and
    in one or two from an active set that is nearly right; then interior, if M + M' is positive semidefinite. Sparse M:
    first `sparse_route`, which needs only products with M if these suffice, then newton, then interior, or first
    interior where the band of M is narrow; then `linear`, which proves most infeasible problems infeasible. The
    conditions of programs are given to newton, while it is fast, and to interior, after `linear` if M is skew. If these
    break down, stall or exhaust their budgets, lemke takes over, which solves problems with copositive-plus or
    otherwise well-behaved M, then `restarts` of it, which solve games, and then milp, which finds a solution or a proof
    that there is none, or reaches its limits. For mixed problems that are not solved at once, all of these get first
    what presolve leaves. Few unknowns are left to `small`. If there are bounds of 1e20 or more, all of these but milp
    are tried first without them.

    x0 : start, shape (n,), in the units of z; pivoting methods use only its signs.
    time_limit : seconds after which milp gives up; the driver ends the others.
    presolve : whether a mixed problem is first solved by what presolve leaves of it.
    states : whether x0 stands for states that a solution may have: these are tried first, and unless they are nearly
        right, x0 is not used any further.

    Yields the iterates of the methods, each with its method's name. NoSolution : with a Farkas proof or by exhaustion,
    as by lemke and milp. Otherwise it ends as the last method does.
    """
    search = partial(_search, time_limit=time_limit, presolve=presolve, states=states)
    return (_relaxed_first if problem.may_have_far_bounds else _from_start)(problem, x0, search)


def _relaxed_first(problem: Problem, x0: Vector, search: Search) -> Stage:
    """Solve the problem without its far bounds, if it has any, by all methods but milp, and then as given."""
    from lcpcli.model.far_bounds import relaxed

    change = relaxed(problem)
    if change is None:
        return (yield from _from_start(problem, x0, search))
    turns, first = Turns(x0), _from_start(change.problem, change.start(x0), partial(search, milp=False))
    ending = yield from turns.take("", in_given_variables(change, first))
    if isinstance(ending, NoSolution) and ending.certificate.kind != "ray":
        return ending
    return (yield from turns.take("", _from_start(problem, x0, search)))


def _from_start(problem: Problem, x0: Vector, search: Search) -> Stage:
    return (small if problem.n <= measure.FEW_UNKNOWNS else stages.from_reference)(problem, x0, search)


def _search(
    problem: Problem, turns: Turns, time_limit: float, presolve: bool, states: bool, milp: bool = True
) -> Stage:
    """Take the methods in turn, from the start in `turns`; presolve, states : as in `auto`; milp : whether milp comes
    last."""
    x0, criterion, deadline = turns.last.x, Criterion(problem), interrupts.deadline(time_limit)
    first = [("newton", from_states(problem, x0))] if states else []
    if states:
        x0 = np.zeros(problem.n)
    in_turn = _stages_with_presolve if presolve and problem.is_mixed else _stages
    for name, stage in chain(first, in_turn(problem, x0, deadline)):
        ending = yield from turns.take(name, stage)
        if isinstance(ending, NoSolution) and ending.certificate.kind != "ray":
            return ending
        point = Point(criterion, problem.box.z_of(turns.last.x))
        if isinstance(ending, Finished) and point.solves():
            return ending  # although rounding to the given variables may leave a larger residual
        if point.nearly_solves():
            yield turns.last._replace(F=None, signs_final=True)  # it may be all that doubles can do
            if (yield from _improved(problem, turns)):
                return Finished()
    undecided = Stalled("no other method is tried")
    if problem.n <= measure.FEW_UNKNOWNS:
        ending = yield from exactly(problem, turns, decide=True)
        if not isinstance(ending, Stalled):
            return ending
        undecided = ending
    if not milp:
        return undecided
    ending = yield from turns.take("milp", stages.begin("milp", problem, x0, time_limit=_remaining(deadline)))
    return undecided if problem.n <= measure.FEW_UNKNOWNS and isinstance(ending, Stalled) else ending


def _improved(problem: Problem, turns: Turns) -> Generator[Iterate, None, bool]:
    """Yield the last iterate refined to its last digits or, for few unknowns, made exact; return whether it is a
    solution up to rounding."""
    if problem.n <= measure.FEW_UNKNOWNS:
        return isinstance((yield from exactly(problem, turns, decide=False)), Finished)
    box, basis = problem.box, problem.box.basis_of(turns.last.x)
    with np.errstate(over="ignore", invalid="ignore"):
        z = refined(problem, box.z_of(turns.last.x), basis)
        x = box.x_within(z, problem.w(z), basis)
    turns.last = turns.last._replace(x=x, F=None, step=REFINED, signs_final=True)
    yield turns.last
    return is_rounded_solution(problem, problem.box.z_of(turns.last.x))


def _stages_with_presolve(problem: Problem, x0: Vector, deadline: float) -> Iterator[tuple[str, Stage]]:
    """Yield the methods before milp in order; for a mixed problem first on what presolve leaves of it, but a small or
    dense one is first given to newton, which takes no longer than presolve."""
    first = _first(problem) if _is_large_and_sparse(problem) else ""
    given = _stages(problem, x0, deadline, first, always_interior=True)
    if not _is_large_and_sparse(problem):
        yield next(given)
    if _may_gain_by_presolve(problem, first):
        yield from _presolved_stages(problem, x0, deadline)
    yield from given


def _is_large_and_sparse(problem: Problem) -> bool:
    return is_sparse(problem.M) and problem.n > factors.MOST_NUMPY_ROWS


def _may_gain_by_presolve(problem: Problem, first: str) -> bool:
    """Return whether many rows have at most one entry, or variables are fixed; or else M is not monotone as it is."""
    M = problem.M
    lengths = np.diff(M.indptr) if is_sparse(M) else np.count_nonzero(M, axis=1)
    if np.count_nonzero(problem.box.fixed | (lengths <= 1)) >= MANY_SHORT_ROWS * problem.n:
        return True
    if _is_large_and_sparse(problem):
        return not (first or M.diagonal().all())
    from lcpcli.linalg.krylov import is_semidefinite

    return not is_semidefinite(M)


def _presolved_stages(problem: Problem, x0: Vector, deadline: float) -> Iterator[tuple[str, Stage]]:
    """Yield the methods on what presolve leaves of a problem, or its proof that there is no solution."""
    from lcpcli.model.presolve import Presolved, Refuted, presolved

    change = presolved(problem)
    if isinstance(change, Refuted) and is_clear(problem, change.y) and proves_infeasible(problem, change.y):
        yield "presolve", ended(NoSolution(Certificate("farkas", farkas_statement(problem), change.y)))
    if isinstance(change, Presolved) and (problem.n <= factors.MOST_NUMPY_ROWS or change.is_worthwhile):
        start = change.start(x0)
        for name, stage in _stages(change.problem, start, deadline, always_interior=True):
            yield name, _clearly(problem, in_given_variables(change, stage))
        if change.kept.size <= MUCH_SMALLER * problem.n:
            limit = _remaining(deadline) / 2
            stage = stages.begin("milp", change.problem, start, time_limit=limit)
            yield "milp", in_given_variables(change, stage)


def _clearly(problem: Problem, stage: Stage) -> Stage:
    """Pass on the stage; a proof that would not hold for slightly different data counts as none."""
    ending = yield from stage
    y = ending.certificate.vector if isinstance(ending, NoSolution) and ending.certificate.kind == "farkas" else None
    return ending if y is None or is_clear(problem, y) else Stalled("its proof hangs on rounding in the data")


def _stages(
    problem: Problem, x0: Vector, deadline: float, first: str | None = None, always_interior: bool = False
) -> Iterator[tuple[str, Stage]]:
    """Yield the methods before milp in order, by name, each created when its turn comes.

    first : as from `_first`. always_interior : whether interior is tried for M that is not monotone too: nothing is
        guaranteed then, but it solves most first-order conditions of programs that are not convex.
    """
    large_and_sparse = _is_large_and_sparse(problem)
    if first is None:
        first = _first(problem) if large_and_sparse else ""
    if first == "linear":
        from lcpcli.methods.linear import linear

        limit = max(SIMPLEX_SECONDS * problem.M.nnz, LEAST_SIMPLEX_SECONDS)
        yield first, linear(problem, min(limit, _remaining(deadline)))
    if first:
        yield "newton", _while_fast(problem, newton(problem, x0, problem.n))
        yield "interior", stages.begin("interior", problem, x0)
    elif large_and_sparse:
        from lcpcli.methods.sparse_route import sparse_route

        narrow = is_narrow(problem.M)
        yield "sparse", sparse_route(problem, x0, krylov_only=narrow or not problem.M.diagonal().all())
        if narrow:
            first = "interior"
            yield first, stages.begin("interior", problem, x0)
    sparse = is_sparse(problem.M)
    yield "newton", newton(problem, x0, problem.n) if sparse else dense_route(problem, x0)
    if is_far_from_one(problem):
        yield from _stages_in_scaled_units(problem, x0)
    if problem.n + problem.box.kinds.get("boxed", 0) <= MOST_LEMKE_FIRST:
        yield "lemke", stages.limited(stages.begin("lemke", problem, x0), SMALL_PIVOTS * problem.n)
    from lcpcli.linalg.krylov import is_semidefinite
    from lcpcli.methods.lemke import restarts
    from lcpcli.methods.linear import linear

    if not first and (large_and_sparse or is_semidefinite(problem.M)):
        always_interior = False
        yield "interior", stages.begin("interior", problem, x0)
    if large_and_sparse or problem.is_mixed:
        yield "linear", linear(problem, _remaining(deadline))
    yield "lemke", stages.limited(stages.begin("lemke", problem, x0), LEMKE_PIVOTS * problem.n)
    if always_interior and not first:
        yield "interior", stages.begin("interior", problem, x0)
    yield "lemke", stages.as_lcp(restarts, problem, x0)


def _while_fast(problem: Problem, stage: Stage) -> Stage:
    """Run newton until a step changes more than NEWTON_SETTLING_FACTOR of the states that the last step changed.

    Circuits need three steps, each with one factorization; most programs end it at the first one.
    """
    basis, most = problem.box.basis_of(np.zeros(problem.n)), math.inf
    while isinstance(step := stages.advance(stage), Iterate):
        before, basis = basis, problem.box.basis_of(step.x)
        changes = basis.changes(before)
        yield step
        if changes > most:
            return Stalled("the active set settles too slowly")
        most = NEWTON_SETTLING_FACTOR * changes
    return step


def _first(problem: Problem) -> str:
    """Return the method to try first on a program with sparse M; "" for other problems, or if M is not monotone."""
    if problem.M.diagonal().all():  # there are zeros for the rows of a program
        return ""
    from lcpcli.linalg.krylov import is_semidefinite
    from lcpcli.methods.linear import is_skew

    if is_skew(problem.M):
        return "linear"
    S = problem.signs
    return "interior" if S is not None and (S[0] != S).any() and is_semidefinite(problem.M) else ""


def _stages_in_scaled_units(problem: Problem, x0: Vector) -> Iterator[tuple[str, Stage]]:
    """Yield newton and lemke in units in which products of a few numbers neither over- nor underflow."""
    units = scale(problem)
    start = units.start(x0)
    yield "newton", in_given_variables(units, newton(units.problem, start, LEAST_INDEX_STEPS))
    lemke = stages.limited(stages.begin("lemke", units.problem, start), LEMKE_PIVOTS * problem.n)
    yield "lemke", in_given_variables(units, lemke)


def _remaining(deadline: float) -> float:
    """Return the remaining seconds, at least a millisecond."""
    return max(deadline - clock.seconds(), 1e-3)
