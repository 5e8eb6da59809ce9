"""What surrounds the table in `attempts`: starts, few unknowns, far bounds, presolve
before it, and milp at the end.

For few unknowns it is pivoting and, if doubles leave the answer open, exact arithmetic
on numbers of any size. They do so where a row has a term that rounding of another term
hides, as in x_1 - x_2 = 3 with both near 1e16: a violation of the size of that term is
then no more than rounding. An exact solution is sought near a point, and then by the
tree over the states of all unknowns, which finds one or proves that there is none. Both
take the problem as given: in other variables, rounding might lose the proof.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import cached_property, partial
from itertools import chain, takewhile
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.auto.attempts import (
    EXACT,
    FIRST,
    LATER,
    MILP,
    PRESOLVE,
    Structure,
    in_rounds,
    phases,
)
from lcpcli.clock import imports
from lcpcli.interrupts import TimeIsUp, raise_if_timed_out
from lcpcli.linalg import factors
from lcpcli.linalg.doubles import SMALL_DISTANCE, is_finite
from lcpcli.linalg.matrices import accurate_residual, dense, is_sparse
from lcpcli.methods import stages
from lcpcli.methods.newton import from_start
from lcpcli.methods.stages import (
    Ending,
    Finished,
    Iterate,
    NoSolution,
    Part,
    Search,
    Stage,
    Stalled,
    Turns,
    advance,
    changed,
)
from lcpcli.model.box import BASIC
from lcpcli.model.changes import Change
from lcpcli.model.problem import Problem
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import rounded, rounded_direction
from lcpcli.rational.tree import solution_search
from lcpcli.typing import States, Vector
from lcpcli.verify import measure
from lcpcli.verify.acceptance import AS_IT_IS, PROVED, Extent, accepted
from lcpcli.verify.certificate import (
    EXHAUSTION_EFFORT,
    Proof,
    first_proof,
)
from lcpcli.verify.exact_solution import accurate_basic_solution, from_point
from lcpcli.verify.farkas import farkas_vector
from lcpcli.verify.final_states import MAX_DECIDED, is_doubtful
from lcpcli.verify.point import Criterion, Point

if TYPE_CHECKING:
    pass

REFINED = "refined"
# Of one point: each may change states that those before it have left wrong.
MAX_REFINEMENTS = 3
# How long a solution is sought after a proof up to rounding, or after a point that
# violates rows only by what may be rounding: a part of the evaluations so far, and at
# least so many; for a sparse M four for each unknown, up to so many.
PATIENCE, MIN_PATIENCE, MAX_SPARSE_PATIENCE = 2, 200, 2000
AS_ROUNDING = "what is left of violations may be rounding of larger numbers"
EXCLUDED = "each complementary set is excluded in exact arithmetic"
OUT_OF_RANGE = (
    "there is a solution, but doubles cannot represent it: its numbers are too "
    "large or too small"
)
LOST_BY_ROUNDING = (
    "there is a solution, but its nearest doubles do not solve the problem"
)
UNDECIDED_IN_TIME = "exact arithmetic did not decide the problem in time"
# What is asked of a point that a search may end at: whether a solution near it is
# proved; the run asks whether anything speaks against it. And of one whose rows may
# hide terms: whether exact arithmetic confirms it.
IF_PROVED, IF_EXACT = Extent(PROVED), Extent(AS_IT_IS, is_exact=True)
NOTHING = list[Fraction]()  # after all nodes of a tree without a solution
MAX_PIVOTED_EXACTLY = 100  # unknowns, from states that are nearly right
# Of a problem with far sides: each leaves fewer of them out; at first only those less
# that are met first.
MAX_RELAXATIONS, SINGLE_RELAXATIONS = 16, 4
# Of the tree, in counted work: what it does at first, in which it decides nearly all
# problems; after turns of other methods it goes on, each time with twice that or the
# largest share, up to the most in all.
FIRST_EFFORT, LARGEST_EFFORT, MAX_EFFORT = 0.25, 2.0, 16.0


def auto(
    problem: Problem,
    x0: Vector,
    *,
    presolve: bool = True,
    states: bool = False,
    near: bool = False,
    tried: stages.Tried | None = None,
) -> Stage:
    """Solve any LCP, or prove that it has no solution, by the first method in the table
    that succeeds, and milp last, which finds a solution or a proof that there is none,
    or reaches its limits.

    Free variables that equations define are substituted before. Where the reference
    point is a solution, that is the answer, unless the run has a start of its own,
    which the problem does not have.

    x0 : start, shape (n,), in the units of z; pivoting methods use only its signs.
    presolve : whether a mixed problem is first solved by what presolve leaves of it.
    states : whether x0 stands for states that a solution may have: these are tried
        first, and unless they are nearly right, x0 is not used any further.
    near : whether x0 is of a z near a solution, whose states are tried first where M
        has zeros on the diagonal.
    tried : first attempts in the table that have been made, by method; none has solved
        the problem.
    """
    if (
        problem.x0 is not None
        and np.array_equal(x0, problem.x0)
        and Criterion(problem).reference_solves
    ):
        trivial = problem.box.x_of(problem.reference_point, problem.q_ref)
        return stages.ended(Finished(), Iterate(trivial, None, "", 0))
    if problem.is_mixed:
        with imports:
            from lcpcli.presolve.presolve import substituted
        change = substituted(problem)
        if not change.is_identity:
            return changed(
                change, x0, partial(auto, presolve=presolve, states=states, near=near)
            )
    search = partial(_searched, presolve=presolve, near=near)
    if problem.has_far_sides:
        return _relaxed_first(problem, x0, search, states)
    # Iterates would be in other variables; but piqp has ended.
    if tried and problem.reference_z is not None:
        tried = {name: made for name, made in tried.items() if name == "piqp"}
    return small(problem, x0, search, states, tried)


# Without it: bounds of 1e19 leave a problem in 22 unknowns unsolved.
def _relaxed_first(problem: Problem, x0: Vector, search: Search, states: bool) -> Stage:
    """Solve the problem without its far sides by all methods but milp. Those that the
    answer is beyond, or that keep a proof from holding with them, count the next time:
    a relaxation without a solution proves nothing. They are first moved nearer, as
    their size leaves no digits for anything beside them; the states are most often the
    same. In the end the problem is solved as given.

    A solution within the far sides is one of the problem, which ends the run."""
    with imports:
        from lcpcli.model.changes import Relaxed, relaxed
    turns, first = Turns(x0), partial(small, search=partial(search, milp=False))
    change, has_all = relaxed(problem), True
    for k in range(MAX_RELAXATIONS):
        if not isinstance(change, Relaxed):
            break
        inner = Turns(change.start(x0))
        stage = inner.take("", first(change.problem, inner.last.x, states=states))
        ending = yield from turns.take("", stages.moved_back(change, stage))
        if isinstance(ending, Finished) and change.moved_sides.number:
            yield _with_states_of(turns, relaxed(problem, change.sides, is_moved=False))
        if not change.sides.number:
            break
        met = change.met(turns.last.x)
        if isinstance(ending, NoSolution):
            y = ending.certificate.vector
            if y is not None:
                proof = first_proof(problem, [y], whole=True)
                if proof is not None:
                    return replace(ending, certificate=proof)
                met = change.needed(y, is_first=k < SINGLE_RELAXATIONS)
        if isinstance(ending, (Finished, NoSolution)) and met.number:
            change = relaxed(problem, change.sides.without(met))
        elif not (isinstance(ending, Finished) and change.moved_sides.number):
            # It is not known which of them count.
            change = relaxed(problem, change.sides.without(change.sides))
        elif has_all and (idle := change.idle(inner.last.x)).number:
            # Where there are several minimizers, one may be at sides that do not count.
            change, has_all = relaxed(problem, change.sides.joined(idle)), False
        elif change.is_moved:
            # The states depend on how far these sides are.
            change = relaxed(problem, change.sides, is_moved=False)
        else:
            change = relaxed(problem, change.sides.without(change.sides))
    return (yield from turns.take("", small(problem, x0, search, states)))


def _with_states_of(turns: Turns, change: Change) -> Iterate:
    """Return the last iterate with the basic solution of its states in the problem of a
    change."""
    problem, box = change.problem, change.problem.box
    basis = turns.last.basis
    if basis is None:
        basis = change.original.box.basis_of(turns.last.x)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        near = box.z_of(change.start(turns.last.x))
        z = accurate_basic_solution(problem, near, basis)
        if z is near:
            # The system is singular, as at a face of minimizers. Where sides have
            # moved, most often only values of rows change with them.
            z = _with_values_of_rows(problem, near, basis)
        if (
            problem.n <= MAX_PIVOTED_EXACTLY
            and not Point(
                Criterion(change.original), change.original.box.project(z)
            ).solves()
        ):
            data = ExactProblem.of_floats(change.original)
            exact = from_point(data, z, Effort(EXHAUSTION_EFFORT))
            if exact is not None:
                z = rounded(exact)
        x = change.back(box.x_within(z, problem.w(z), basis))
    turns.last = turns.last._replace(x=x, F=None, step=REFINED, signs_final=True)
    return turns.last


def _with_values_of_rows(problem: Problem, z: Vector, basis: States) -> Vector:
    """Return z with those basic z_j changed that occur in one row, of a basic z_i,
    alone, so that w_i = 0 there."""
    M, z = problem.M, np.where(basis == BASIC, z, problem.box.nonbasic(basis))
    rows, columns = M.nonzero()
    number = np.bincount(columns, minlength=z.size)
    is_alone = (
        (number[columns] == 1) & (basis[columns] == BASIC) & (basis[rows] == BASIC)
    )
    rows, first = np.unique(rows[is_alone], return_index=True)
    columns = columns[is_alone][first]
    if not np.isfinite(z).all():
        return z
    w = -accurate_residual(M[rows], z, -problem.q[rows])
    z[columns] -= w / dense(M[rows])[np.arange(rows.size), columns]
    return z


def _searched(problem: Problem, x0: Vector, milp: bool = True, **how: Any) -> Stage:
    """Take the methods in turn, as `_search` does, in the variables in which the
    reference point is 0, or else in those of the problem, where rounding to these
    spoils the solution, and then milp, if it is among them, on the problem as given."""
    turns = Turns(x0)
    search: Search = partial(_search, milp=milp, **how)
    if problem.reference_z is None:
        ending = yield from search(problem, turns)
    else:
        ending = yield from turns.take("", stages.from_reference(problem, x0, search))
    if isinstance(ending, Finished) and problem.reference_z is not None:
        z = problem.box.z_of(turns.last.x)
        found = accepted(problem, [z], Criterion(problem).tol, IF_PROVED)
        if found is None or not found.solved:
            ending = yield from turns.take("", search(problem, Turns(x0), tried=None))
    if milp and isinstance(ending, stages.Undecided):
        return (
            yield from turns.take("milp", stages.begin("milp", problem, turns.last.x))
        )
    return ending


def _search(
    problem: Problem,
    turns: Turns,
    presolve: bool,
    states: bool = False,
    near: bool = False,
    milp: bool = True,
    tried: stages.Tried | None = None,
    is_decided: Callable[[], bool] = lambda: False,
) -> Stage:
    """Take the methods before milp in turn, from the start in `turns`; presolve,
    states, near, tried : as in `auto`; milp : whether nodes of its tree are examined;
    is_decided : called after each turn, for other work between the turns; if it returns
    True, the search ends."""
    x0, criterion = turns.last.x, Criterion(problem)
    first = list[Part]()
    if states:
        first = [Part("newton", from_start(problem, problem.box.basis_of(x0)))]
        x0 = np.zeros(problem.n)
    elif near and not problem.M.diagonal().all():
        with imports:
            from lcpcli.methods.interior import at_point
        tried = tried or {}
        first = [Part("interior", at_point(problem, x0, tried))]
    last: NoSolution | Stalled | None = None
    left = math.inf  # evaluations, once it is known with what the search is to end
    for part in chain(first, all_parts(problem, x0, presolve, tried)):
        # Which may have a proof.
        is_refused = part.method == "milp" and not milp
        if is_refused or (left <= 0 and part.method != "linear"):
            continue
        before = turns.last
        ending = yield from turns.go_on(part, max(left, 1))
        if isinstance(ending, stages.GivenUp):
            return ending
        left -= turns.last.evaluations - before.evaluations
        if not isinstance(ending, Finished) and is_decided():
            return Stalled("exact arithmetic has decided the problem")
        if isinstance(ending, NoSolution) and _is_proof(ending):
            if not ending.certificate.is_rounded:
                return ending
            if not isinstance(last, NoSolution):
                last, left = ending, _patience(problem, turns)
        if turns.last is before and not isinstance(ending, Finished):
            continue  # at a point that has been judged
        point = Point(criterion, problem.box.z_of(turns.last.x))
        if isinstance(ending, Finished) and point.solves():
            # Although rounding to the given variables may leave a larger residual.
            return ending
        if point.nearly_solves():
            # It may be all that doubles can do.
            yield turns.last._replace(F=None, signs_final=True)
            if (yield from _improved(problem, turns, criterion.tol)):
                return Finished()
            is_large = problem.n > measure.FEW_UNKNOWNS
            if last is None and is_large and point.size <= SMALL_DISTANCE:
                last, left = Stalled(AS_ROUNDING), _patience(problem, turns)
        if left <= 0 and isinstance(last, NoSolution):
            break
    return stages.Undecided("no other method is tried") if last is None else last


def _patience(problem: Problem, turns: Turns) -> float:
    """Return for how many evaluations a search goes on that knows with what it is to
    end."""
    least = MIN_PATIENCE
    if is_sparse(problem.M):
        least = max(least, min(4 * problem.n, MAX_SPARSE_PATIENCE))
    return max(least, PATIENCE * turns.last.evaluations)


def _improved(
    problem: Problem, turns: Turns, tol: float
) -> Generator[Iterate, None, bool]:
    """Yield the last iterate refined to its last digits or, for few unknowns, made
    exact; return whether it is a solution up to rounding, or one is shown to exist by
    one system with its states."""
    if problem.n <= measure.FEW_UNKNOWNS:
        return isinstance((yield from exactly(problem, turns)), Finished)
    box = problem.box
    z = box.z_of(turns.last.x)
    found = accepted(problem, [z], tol, IF_PROVED)
    if found is not None and found.solved:
        if found.point.z is not z:
            # Which refinement in doubles might move.
            z = found.point.z
            x = box.x_within(z, problem.w(z), box.basis_at(z))
            turns.last = turns.last._replace(
                x=x, F=None, step=REFINED, signs_final=True
            )
            yield turns.last
        return True
    for _ in range(MAX_REFINEMENTS):
        before, basis = turns.last.x, box.basis_of(turns.last.x)
        with np.errstate(over="ignore", invalid="ignore"):
            z = accurate_basic_solution(problem, box.z_of(before), basis)
            x = box.x_within(z, problem.w(z), basis)
        turns.last = turns.last._replace(x=x, F=None, step=REFINED, signs_final=True)
        yield turns.last
        if np.array_equal(x, before):
            break
    found = accepted(problem, [box.z_of(turns.last.x)], tol, IF_PROVED)
    return found is not None and found.solved


def all_parts(
    problem: Problem, x0: Vector, presolve: bool, tried: stages.Tried | None = None
) -> Iterator[Part]:
    """Yield the parts of a run before milp in order, for few unknowns those after exact
    arithmetic. presolve : whether it takes part. tried : as in `Structure`."""
    structure = Structure(problem, x0, tried)
    after = phases(structure)
    if (EXACT,) in after:
        after = after[after.index((EXACT,)) + 1 :]
    for phase in after:
        if phase == (PRESOLVE,):
            if presolve and PRESOLVE.applies(structure):
                yield from _of_presolved(problem, x0)
        elif phase != (MILP,):
            yield from in_rounds(structure, phase)


def _of_presolved(problem: Problem, x0: Vector) -> Iterator[Part]:
    """Yield the parts of a run on what presolve leaves of a mixed problem, if that is
    worthwhile."""
    with imports:
        from lcpcli.presolve.presolve import presolved
    change = presolved(problem)
    if change is None or not (
        problem.n <= factors.MAX_NUMPY_ROWS or change.is_worthwhile
    ):
        return
    left = Structure(change.problem, change.start(x0))
    for phase in FIRST, LATER:
        for part in in_rounds(left, phase):
            stage = stages.in_given_variables(change, Turns().go_on(part))
            yield Part(part.method, _clearly(problem, stage))


def _clearly(problem: Problem, stage: Stage) -> Stage:
    """Pass on the stage; a proof that would not hold for slightly different data counts
    as none."""
    ending = yield from stage
    if not isinstance(ending, NoSolution) or ending.certificate.kind != "farkas":
        return ending
    is_clear = ending.certificate.is_clear(problem)
    return ending if is_clear else Stalled("its proof hangs on rounding in the data")


class Tree:
    """The tree over the states of a problem with few unknowns in exact arithmetic,
    which is suspended and goes on; most problems never need it, so that it is set up
    when it is first asked.

    data : the problem in exact numbers. is_decided : whether the tree has ended.
    solution : the exact solution that it has found; None if there is none.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem, self._effort, self._share = problem, Effort(), FIRST_EFFORT
        self.is_decided = False
        self.solution: list[Fraction] | None = None

    @cached_property
    def data(self) -> ExactProblem:
        return ExactProblem.of_floats(self._problem)

    @cached_property
    def _search(self) -> Iterator[list[Fraction] | None]:
        return solution_search(self.data, self._effort.steps(self.data))

    def goes_on(self) -> bool:
        """Do the next share of the work; return whether the problem is decided."""
        until = min(self._effort.spent + self._share, MAX_EFFORT)
        while not self.is_decided and self._effort.spent < until:
            found = next(self._search, NOTHING)
            self.is_decided, self.solution = (
                found is not None,
                None if found is NOTHING else found,
            )
        self._share = min(2 * self._share, LARGEST_EFFORT)
        return self.is_decided


def small(
    problem: Problem,
    x0: Vector,
    search: Search,
    states: bool = False,
    tried: stages.Tried | None = None,
) -> Stage:
    """Solve a problem of at most FEW_UNKNOWNS: where pivoting finds no solution, exact
    arithmetic decides, between the turns of the other methods, which `search` runs, if
    it has not decided in its first one. A larger problem is left to `search`. states :
    whether x0 stands for states that a solution may have."""
    if problem.n > measure.FEW_UNKNOWNS:
        return search(problem, x0, states=states, tried=tried)
    return _few(problem, x0, search, states, tried)


def _few(
    problem: Problem,
    x0: Vector,
    search: Search,
    states: bool,
    tried: stages.Tried | None,
) -> Stage:
    tree, turns = Tree(problem), Turns(x0)
    pivoting = partial(_pivoting, tried=tried, states=states)
    ending = yield from _without_doubt(
        problem, turns, stages.from_reference(problem, x0, pivoting), tree
    )
    if _is_proof(ending):
        return ending
    ending = yield from exactly(problem, turns, tree)
    if not isinstance(ending, Stalled):
        return ending
    start = np.zeros(problem.n) if states else turns.last.x
    others = search(problem, start, is_decided=tree.goes_on)
    last = yield from _without_doubt(problem, turns, others)
    if _is_proof(last):
        return last
    if tree.is_decided:
        return (yield from exactly(problem, turns, tree))
    return ending if isinstance(last, Stalled) else last


def _is_proof(ending: Ending) -> bool:
    return isinstance(ending, NoSolution) and ending.certificate.kind != "ray"


def _without_doubt(
    problem: Problem, turns: Turns, stage: Stage, tree: Tree | None = None
) -> Stage:
    """Pass on a stage up to a solution where rounding hides terms: it is replaced by an
    exact one, if one is found."""
    done = turns.last.evaluations
    while isinstance(step := advance(stage), Iterate):
        turns.last = step = step._replace(evaluations=done + step.evaluations)
        z = problem.box.z_of(step.x)
        found = None
        if step.signs_final and is_doubtful(problem, z):
            point = Point(Criterion(problem), z)
            found = accepted(
                problem, [point], point.criterion.tol, IF_EXACT, step.basis
            )
        if found is not None and not found.solved:
            ending = yield from exactly(problem, Turns(step.x, step.evaluations), tree)
            if not isinstance(ending, Stalled):
                return ending
        elif found is not None and found.point is not point:
            z = found.point.z
            x = problem.box.x_of(z, problem.w(z))
            yield Iterate(
                x, None, "exact", step.evaluations, "exact", basis=found.basis
            )
        yield step
    return step


def _pivoting(
    problem: Problem, turns: Turns, tried: stages.Tried | None, states: bool
) -> Stage:
    ending: Ending = Finished()
    first = (
        [Part("newton", from_start(problem, problem.box.basis_of(turns.last.x)))]
        if states
        else []
    )
    structure = Structure(
        problem, np.zeros(problem.n) if states else turns.last.x, tried
    )
    before = takewhile(lambda phase: phase != (EXACT,), phases(structure))
    rounds = chain.from_iterable(in_rounds(structure, phase) for phase in before)
    for part in chain(first, rounds):
        ending = yield from turns.go_on(part)
        if isinstance(ending, Finished) or _is_proof(ending):
            break
    return ending


def exactly(problem: Problem, turns: Turns, tree: Tree | None = None) -> Stage:
    """Yield (z - w) / 2 of an exact solution, rounded, for a problem of at most
    `measure.FEW_UNKNOWNS`: of one near the last iterate, or else of one that the tree
    finds, if it is given, in its next share of work. For at most MAX_DECIDED unknowns
    the tree comes first, as it decides sooner than pivoting from states that are not
    right.

    Finished : there is a solution. NoSolution : it is proved that there is none.
    Stalled : solutions were found, but are out of range or do not solve the problem
    when rounded to doubles; or none was found in time.
    """
    return (
        yield from turns.take(
            "exact", _exact(problem, problem.box.z_of(turns.last.x), tree)
        )
    )


def _exact(problem: Problem, z: Vector, tree: Tree | None) -> Stage:
    data, reason = (
        ExactProblem.of_floats(problem) if tree is None else tree.data,
        UNDECIDED_IN_TIME,
    )

    def solutions() -> Iterator[list[Fraction] | None]:
        if tree is not None and problem.n <= MAX_DECIDED and tree.goes_on():
            yield tree.solution
        if tree is None or not tree.is_decided or tree.solution is not None:
            with suppress(TimeIsUp):
                yield from_point(
                    data, np.where(np.isfinite(z), z, 0.0), Effort(EXHAUSTION_EFFORT)
                )
            raise_if_timed_out()
        if tree is not None and tree.goes_on():
            yield tree.solution

    for solution in (each for each in solutions() if each is not None):
        exact_z, exact_w = rounded(solution), rounded(data.w(solution))
        if not (is_finite(exact_z) and is_finite(exact_w)):
            reason = OUT_OF_RANGE
            continue
        x = problem.box.x_of(exact_z, exact_w)
        yield Iterate(x, None, "exact", 1)
        near = problem.box.z_of(x)
        found = accepted(problem, [near], Criterion(problem).tol, IF_PROVED)
        if found is not None and found.solved:
            return Finished()
        reason = LOST_BY_ROUNDING
    if tree is None or not tree.is_decided or tree.solution is not None:
        return Stalled(reason)
    with suppress(TimeIsUp):
        y = farkas_vector(data, Effort(EXHAUSTION_EFFORT).steps(data))
        if y is not None and (proof := first_proof(problem, [rounded_direction(y)])):
            return NoSolution(proof)
    return NoSolution(Proof("exhaustion", statement=EXCLUDED))
