"""A run of `auto` around the table of `attempts`: starts, few unknowns, far bounds,
presolve before it, and milp as the last resort.

Problems with few unknowns are solved by pivoting and, if double precision leaves the
answer open, in exact arithmetic on numbers of any size. It leaves the answer open where
a row has a term that rounding of another term hides, as in x_1 - x_2 = 3 with both
close to 1e16: a violation of the size of that term is then no more than rounding. An
exact solution is sought close to a point, and then by a tree search over the
complementary bases, which reaches one or proves that there is none. Both use the
original problem: in other variables, rounding might lose the proof.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import cached_property, partial
from itertools import chain, takewhile
from typing import Any

import numpy as np

from lcpcli.auto.attempts import (
    EXACT,
    FIRST,
    LATER,
    MILP,
    PRESOLVE,
    Structure,
    attempts_in_rounds,
    is_eliminated,
    phases,
)
from lcpcli.clock import imports
from lcpcli.interrupts import TimeIsUp, raise_if_timed_out
from lcpcli.linalg import factors
from lcpcli.linalg.doubles import SMALL_DISTANCE, is_finite
from lcpcli.linalg.matrices import is_sparse
from lcpcli.methods import stages
from lcpcli.methods.newton import from_start
from lcpcli.methods.stages import (
    Ending,
    Finished,
    Iterate,
    MethodSequence,
    NoSolution,
    Part,
    Search,
    Stage,
    Stalled,
    advance,
    changed,
)
from lcpcli.model.changes import Change
from lcpcli.model.problem import Problem
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import rounded
from lcpcli.rational.tree import solution_search
from lcpcli.rational.written import exact_data
from lcpcli.typing import Vector
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

REFINED = "refined"
# Refinements of one point: each may correct basis statuses that the earlier ones have
# left wrong.
MAX_REFINEMENTS = 3
# Evaluations for which a search continues after a proof up to rounding, or after a
# point that violates rows only by what may be rounding: a multiple of the evaluations
# so far, and at least MIN_PATIENCE; for a sparse M at least four for each unknown, up
# to MAX_SPARSE_PATIENCE.
PATIENCE = 2
MIN_PATIENCE = 200
MAX_SPARSE_PATIENCE = 2000
AS_ROUNDING = "the remaining violations are at the level of rounding errors"
EXCLUDED = "each complementary set is excluded in exact arithmetic"
OUT_OF_RANGE = (
    "there is a solution, but doubles cannot represent it: its numbers are too "
    "large or too small"
)
LOST_BY_ROUNDING = (
    "there is a solution, but its nearest doubles do not solve the problem"
)
UNDECIDED_IN_TIME = "exact arithmetic did not decide the problem in time"
# A point at which a search may stop is accepted if a solution close to it is proved
# (the run itself tests whether anything speaks against the point), and a point whose
# rows may hide terms if exact arithmetic verifies it.
IF_PROVED, IF_EXACT = Extent(PROVED), Extent(AS_IT_IS, is_exact=True)
NOTHING = list[Fraction]()  # the tree has been searched, and has no solution
# Unknowns up to which exact pivoting starts from a basis that is almost right.
MAX_PIVOTED_EXACTLY = 100
# Relaxations of a problem with far sides: each leaves fewer of them out.
MAX_RELAXATIONS = 16
# Work limits of the tree search, in nominal seconds: the first one, within which it
# decides almost all problems; it continues between other methods, each time with twice
# the previous limit, at most the largest one, up to the maximum in total.
FIRST_SEARCH_WORK = 0.25
LARGEST_SEARCH_WORK = 2.0
MAX_SEARCH_WORK = 16.0


def auto(
    problem: Problem,
    x0: Vector,
    *,
    presolve: bool = True,
    is_basic_start: bool = False,
    is_warm_start: bool = False,
    recorded_stages: stages.RecordedStages | None = None,
) -> Stage:
    """Solve any LCP, or prove that it has no solution, by the first method in the table
    that succeeds, and at last by milp, which returns a solution or a proof that there
    is none, or stops at its limits.

    Free variables that equations define are substituted first. Where the reference
    point is a solution, that is the answer, unless the caller supplies a start.

    x0 : start (z - w) / 2, shape (n,); pivoting methods use only its signs.
    presolve : whether the problem to which presolve reduces a mixed problem is solved
        first.
    is_basic_start : whether x0 represents the basis of a likely solution: pivoting
        starts from this basis, and unless it is almost right, x0 is not used any
        further.
    is_warm_start : whether x0 is close to a solution, whose basis is then attempted
        first where M has zeros on the diagonal.
    recorded_stages : first attempts in the table that have been made already, by
        method; none has solved the problem.
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
                change,
                x0,
                partial(
                    auto,
                    presolve=presolve,
                    is_basic_start=is_basic_start,
                    is_warm_start=is_warm_start,
                ),
            )
    search = partial(_searched, presolve=presolve, is_warm_start=is_warm_start)
    if problem.has_far_sides:
        return _relaxed_first(problem, x0, search, is_basic_start)
    # Iterates of the other stages are in other variables; piqp has ended.
    if recorded_stages and problem.reference_z is not None:
        recorded_stages = {
            name: made for name, made in recorded_stages.items() if name == "piqp"
        }
    return small(problem, x0, search, is_basic_start, recorded_stages)


# Without it: bounds of 1e19 leave a problem in 22 unknowns unsolved.
def _relaxed_first(
    problem: Problem, x0: Vector, search: Search, is_basic_start: bool
) -> Stage:
    """Solve the problem without its far sides by all methods but milp. Those that the
    answer violates, or with which a proof would not hold, are included in the next
    relaxation: a relaxation without a solution proves nothing. They are first moved
    closer, as their size leaves no digits for other numbers; the basis is most often
    the same. At the sides where they are, its basic solution is tested, too. If no
    relaxation leads to an answer, the original problem is solved.

    `change.sides` are the sides that a relaxation leaves out, `change.moved_sides` the
    far sides that it includes. An iterate that solves the problem completes the run:
    the code after it is for those that do not."""
    with imports:
        from lcpcli.model.changes import Relaxed, relaxed
    sequence = MethodSequence(x0)
    first = partial(small, search=partial(search, milp=False))
    change, may_drop = relaxed(problem), True
    for _ in range(MAX_RELAXATIONS):
        if not isinstance(change, Relaxed):
            break
        inner = MethodSequence(change.start(x0))
        stage = inner.run_stage(
            "", first(change.problem, inner.last.x, is_basic_start=is_basic_start)
        )
        ending = yield from sequence.run_stage("", stages.moved_back(change, stage))
        if isinstance(ending, Finished) and change.moved_sides.number:
            yield _at_basic_solution(
                sequence, relaxed(problem, change.sides, is_moved=False)
            )
        if not change.sides.number:
            break
        met = change.met(sequence.last.x)
        if isinstance(ending, NoSolution):
            y = ending.certificate.vector
            if y is not None:
                proof = first_proof(problem, [y], whole=True)
                if proof is not None:
                    return replace(ending, certificate=proof)
                met = change.needed(y)
        if isinstance(ending, (Finished, NoSolution)) and met.number:
            change = relaxed(problem, change.sides.without(met))
        elif not (isinstance(ending, Finished) and change.moved_sides.number):
            # It is not known which of the sides matter.
            change = relaxed(problem, change.sides.without(change.sides))
        elif may_drop and (idle := change.idle(inner.last.x)).number:
            # If there are several minimizers, one may be at sides that do not matter:
            # once, these are left out again.
            change, may_drop = relaxed(problem, change.sides.joined(idle)), False
        elif change.is_moved:
            # The basis depends on how far away these sides are.
            change = relaxed(problem, change.sides, is_moved=False)
        else:
            change = relaxed(problem, change.sides.without(change.sides))
    return (
        yield from sequence.run_stage("", small(problem, x0, search, is_basic_start))
    )


def _at_basic_solution(sequence: MethodSequence, change: Change) -> Iterate:
    """Replace the last iterate by the basic solution of its basis in the problem of a
    change of variables, and return it. If that does not solve a small problem, it is
    the exact solution close to it, if there is one.
    """
    problem, box = change.problem, change.problem.box
    basis = sequence.last.basis
    if basis is None:
        basis = change.original.box.basis_of(sequence.last.x)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        z_of_change = box.z_of(change.start(sequence.last.x))
        z = accurate_basic_solution(problem, z_of_change, basis)
        if (
            problem.n <= MAX_PIVOTED_EXACTLY
            and not Point(
                Criterion(change.original), change.original.box.project(z)
            ).solves()
        ):
            data = exact_data(change.original)
            exact = from_point(data, z, Effort(EXHAUSTION_EFFORT))
            if exact is not None:
                z = rounded(exact)
        x = change.back(box.x_within(z, problem.w(z), basis))
    sequence.last = sequence.last._replace(x=x, F=None, step=REFINED, signs_final=True)
    return sequence.last


def _searched(
    problem: Problem, x0: Vector, milp: bool = True, **search_options: Any
) -> Stage:
    """Run the methods one after another, as `_search` does, in the variables in which
    the reference point is 0; then in those of the problem, if rounding to these spoils
    the solution; and then milp, if it takes part, on the original problem."""
    sequence = MethodSequence(x0)
    search: Search = partial(_search, milp=milp, **search_options)
    if problem.reference_z is None:
        ending = yield from search(problem, sequence)
    else:
        ending = yield from sequence.run_stage(
            "", stages.from_reference(problem, x0, partial(search, given=problem))
        )
    if isinstance(ending, Finished) and problem.reference_z is not None:
        z = problem.box.z_of(sequence.last.x)
        accepted_point = accepted(problem, [z], Criterion(problem).tol, IF_PROVED)
        if accepted_point is None or not accepted_point.solved:
            ending = yield from sequence.run_stage(
                "", search(problem, MethodSequence(x0), recorded_stages=None)
            )
    if milp and isinstance(ending, stages.Undecided):
        return (
            yield from sequence.run_stage(
                "milp", stages.begin("milp", problem, sequence.last.x)
            )
        )
    return ending


# This function has more than six parameters: they are the options of `auto` and those
# that `_searched` and `small` add, each of which passes on the others unchanged.
def _search(
    problem: Problem,
    sequence: MethodSequence,
    presolve: bool,
    is_basic_start: bool = False,
    is_warm_start: bool = False,
    milp: bool = True,
    recorded_stages: stages.RecordedStages | None = None,
    is_decided: Callable[[], bool] = lambda: False,
    given: Problem | None = None,
) -> Stage:
    """Run the methods before milp one after another, from the start in `sequence`.

    presolve, is_basic_start, is_warm_start, recorded_stages : as in `auto`.
    milp : whether nodes of its tree are examined.
    is_decided : called after each attempt, for other work in between; if it returns
        True, the search stops.
    given : the problem before its reference point was moved to 0, if it was.
    """
    criterion, start = Criterion(problem), sequence.last.x
    x0 = np.zeros(problem.n) if is_basic_start else start
    structure = Structure(problem, x0, recorded_stages, given)
    first = _at_start(structure, start, is_basic_start, is_warm_start)
    undecided_ending: NoSolution | Stalled | None = None
    # Finite once there is an ending that only a better one replaces.
    evaluations_left = math.inf
    for part in chain(first, attempts_before_milp(structure, presolve)):
        # Work beyond the limit is worthwhile for linear alone, which may have a proof.
        is_refused = part.method == "milp" and not milp
        if is_refused or (evaluations_left <= 0 and part.method != "linear"):
            continue
        before = sequence.last
        ending = yield from sequence.run_part(part, max(evaluations_left, 1))
        if isinstance(ending, stages.GivenUp):
            return ending
        evaluations_left -= sequence.last.evaluations - before.evaluations
        if not isinstance(ending, Finished) and is_decided():
            return Stalled("exact arithmetic has decided the problem")
        if isinstance(ending, NoSolution) and _is_proof(ending):
            if not ending.certificate.is_rounded:
                return ending
            if not isinstance(undecided_ending, NoSolution):
                undecided_ending = ending
                evaluations_left = _patience(problem, sequence)
        if sequence.last is before and not isinstance(ending, Finished):
            continue  # at a point that has been tested
        point = Point(criterion, problem.box.z_of(sequence.last.x))
        if isinstance(ending, Finished) and point.solves():
            # Rounding to the original variables may have left a larger residual.
            return ending
        if point.nearly_solves():
            # It may be as close as double precision comes.
            yield sequence.last._replace(F=None, signs_final=True)
            if (yield from _improved(problem, sequence, criterion.tol)):
                return Finished()
            is_large = problem.n > measure.FEW_UNKNOWNS
            if undecided_ending is None and is_large and point.size <= SMALL_DISTANCE:
                undecided_ending = Stalled(AS_ROUNDING)
                evaluations_left = _patience(problem, sequence)
        if evaluations_left <= 0 and isinstance(undecided_ending, NoSolution):
            break
    return undecided_ending or stages.Undecided("no other method is attempted")


def _at_start(
    structure: Structure, start: Vector, is_basic_start: bool, is_warm_start: bool
) -> list[Part]:
    """Return the part, if any, that begins at a start that is close to a solution."""
    problem = structure.original_problem
    if is_basic_start:
        if is_eliminated(structure):
            return []
        return [Part("newton", from_start(problem, problem.box.basis_of(start)))]
    if is_warm_start and not problem.M.diagonal().all():
        with imports:
            from lcpcli.methods.interior import at_point
        return [Part("interior", at_point(problem, start, structure.recorded_stages))]
    return []


def _patience(problem: Problem, sequence: MethodSequence) -> float:
    """Return for how many evaluations a search continues once there is an ending that
    only a better one replaces."""
    min_evaluations = MIN_PATIENCE
    if is_sparse(problem.M):
        min_evaluations = max(min_evaluations, min(4 * problem.n, MAX_SPARSE_PATIENCE))
    return max(min_evaluations, PATIENCE * sequence.last.evaluations)


# Without it: 30 springs of stiffness 1e-9 to 1e9 reach a time limit, where they are
# ill-posed, as shown in 0.2 seconds.
def _improved(
    problem: Problem, sequence: MethodSequence, tol: float
) -> Generator[Iterate, None, bool]:
    """Yield the last iterate refined to its last digits or, for few unknowns, made
    exact; return whether it is a solution up to rounding, or a solution with its basis
    is proved to exist by one linear system."""
    if problem.n <= measure.FEW_UNKNOWNS:
        return isinstance((yield from exactly(problem, sequence)), Finished)
    box = problem.box
    z = box.z_of(sequence.last.x)
    accepted_point = accepted(problem, [z], tol, IF_PROVED)
    if accepted_point is not None and accepted_point.solved:
        if accepted_point.point.z is not z:
            # Refinement in double precision might move this point.
            z = accepted_point.point.z
            x = box.x_within(z, problem.w(z), box.basis_at(z))
            sequence.last = sequence.last._replace(
                x=x, F=None, step=REFINED, signs_final=True
            )
            yield sequence.last
        return True
    for _ in range(MAX_REFINEMENTS):
        before, basis = sequence.last.x, box.basis_of(sequence.last.x)
        with np.errstate(over="ignore", invalid="ignore"):
            z = accurate_basic_solution(problem, box.z_of(before), basis)
            x = box.x_within(z, problem.w(z), basis)
        sequence.last = sequence.last._replace(
            x=x, F=None, step=REFINED, signs_final=True
        )
        yield sequence.last
        if np.array_equal(x, before):
            break
    accepted_point = accepted(problem, [box.z_of(sequence.last.x)], tol, IF_PROVED)
    return accepted_point is not None and accepted_point.solved


def attempts_before_milp(structure: Structure, presolve: bool) -> Iterator[Part]:
    """Yield the parts of a run before milp in order, for few unknowns only those after
    exact arithmetic. presolve : whether presolve takes part."""
    after = phases(structure)
    if (EXACT,) in after:
        after = after[after.index((EXACT,)) + 1 :]
    for phase in after:
        if phase == (PRESOLVE,):
            if presolve and PRESOLVE.applies(structure):
                yield from _of_presolved(structure.original_problem, structure.x0)
        elif phase != (MILP,):
            yield from attempts_in_rounds(structure, phase)


def _of_presolved(problem: Problem, x0: Vector) -> Iterator[Part]:
    """Yield the parts of a run on a mixed problem after presolve, if that is
    worthwhile."""
    with imports:
        from lcpcli.presolve.presolve import presolved
    change = presolved(problem)
    if change is None or not (
        problem.n <= factors.MAX_NUMPY_ROWS or change.is_worthwhile
    ):
        return
    reduced_structure = Structure(change.problem, change.start(x0))
    for phase in FIRST, LATER:
        for part in attempts_in_rounds(reduced_structure, phase):
            stage = stages.in_given_variables(change, MethodSequence().run_part(part))
            yield Part(part.method, stage)


class Tree:
    """The search of the tree of complementary bases of a problem with few unknowns in
    exact arithmetic, which is suspended and continued. Most problems never need it, so
    that it is set up when it is first used.

    data : the problem in exact numbers, those of its text if it was read from one.
    is_decided : whether the search has ended.
    solution : the exact solution of the search; None if there is none.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._budget = Effort()
        self._next_work = FIRST_SEARCH_WORK
        self.is_decided = False
        self.solution: list[Fraction] | None = None

    @cached_property
    def data(self) -> ExactProblem:
        return exact_data(self._problem)

    @cached_property
    def _search(self) -> Iterator[list[Fraction] | None]:
        return solution_search(self.data, self._budget.steps(self.data))

    def continues_search(self) -> bool:
        """Continue the search up to its next work limit; return whether the problem is
        decided."""
        until = min(self._budget.spent + self._next_work, MAX_SEARCH_WORK)
        while not self.is_decided and self._budget.spent < until:
            tree_result = next(self._search, NOTHING)
            self.is_decided = tree_result is not None
            self.solution = None if tree_result is NOTHING else tree_result
        self._next_work = min(2 * self._next_work, LARGEST_SEARCH_WORK)
        return self.is_decided


def small(
    problem: Problem,
    x0: Vector,
    search: Search,
    is_basic_start: bool = False,
    recorded_stages: stages.RecordedStages | None = None,
) -> Stage:
    """Solve a problem of at most FEW_UNKNOWNS: where pivoting finds no solution, exact
    arithmetic decides at once, or alternates with the other methods, which `search`
    runs. For a larger problem only `search` is run.

    is_basic_start : whether x0 represents the basis of a likely solution.
    """
    if problem.n > measure.FEW_UNKNOWNS:
        return search(
            problem, x0, is_basic_start=is_basic_start, recorded_stages=recorded_stages
        )
    return _solve_few_unknowns(problem, x0, search, is_basic_start, recorded_stages)


def _solve_few_unknowns(
    problem: Problem,
    x0: Vector,
    search: Search,
    is_basic_start: bool,
    recorded_stages: stages.RecordedStages | None,
) -> Stage:
    tree, sequence = Tree(problem), MethodSequence(x0)
    pivoting = partial(
        _pivoting, recorded_stages=recorded_stages, is_basic_start=is_basic_start
    )
    ending = yield from _with_doubtful_points_exact(
        problem, sequence, stages.from_reference(problem, x0, pivoting), tree
    )
    if _is_proof(ending):
        return ending
    ending = yield from exactly(problem, sequence, tree)
    if not isinstance(ending, Stalled):
        return ending
    start = np.zeros(problem.n) if is_basic_start else sequence.last.x
    others = search(problem, start, is_decided=tree.continues_search)
    last = yield from _with_doubtful_points_exact(problem, sequence, others)
    if _is_proof(last):
        return last
    if tree.is_decided:
        return (yield from exactly(problem, sequence, tree))
    return ending if isinstance(last, Stalled) else last


def _is_proof(ending: Ending) -> bool:
    return isinstance(ending, NoSolution) and ending.certificate.kind != "ray"


def _with_doubtful_points_exact(
    problem: Problem, sequence: MethodSequence, stage: Stage, tree: Tree | None = None
) -> Stage:
    """Pass on a stage. At an iterate with final signs where rounding may hide terms of
    a row, an exact solution that is accepted instead of it is yielded first; where it
    is left in doubt, `exactly` follows, and its ending is returned unless it is
    stalled. The iterate itself comes last, in case the run goes on."""
    done = sequence.last.evaluations
    while isinstance(step := advance(stage), Iterate):
        sequence.last = step = step._replace(evaluations=done + step.evaluations)
        z = problem.box.z_of(step.x)
        accepted_point = None
        if step.signs_final and is_doubtful(problem, z):
            point = Point(Criterion(problem), z)
            accepted_point = accepted(
                problem, [point], point.criterion.tol, IF_EXACT, step.basis
            )
        if accepted_point is not None and not accepted_point.solved:
            continued = MethodSequence(step.x)
            continued.last = continued.last._replace(evaluations=step.evaluations)
            ending = yield from exactly(problem, continued, tree)
            if not isinstance(ending, Stalled):
                return ending
        elif accepted_point is not None and accepted_point.point is not point:
            z = accepted_point.point.z
            x = problem.box.x_of(z, problem.w(z))
            yield Iterate(
                x, None, "exact", step.evaluations, "exact", basis=accepted_point.basis
            )
        yield step
    return step


def _pivoting(
    problem: Problem,
    sequence: MethodSequence,
    recorded_stages: stages.RecordedStages | None,
    is_basic_start: bool,
) -> Stage:
    """Run the attempts before exact arithmetic until one finishes or has a proof, and
    return the ending of the last one that was run.

    is_basic_start : whether newton starts from the basis of the last iterate first;
        this iterate is then not used any further, and the others start from 0.
    """
    ending: Ending = Finished()
    first = (
        [Part("newton", from_start(problem, problem.box.basis_of(sequence.last.x)))]
        if is_basic_start
        else []
    )
    structure = Structure(
        problem,
        np.zeros(problem.n) if is_basic_start else sequence.last.x,
        recorded_stages,
    )
    before = takewhile(lambda phase: phase != (EXACT,), phases(structure))
    rounds = chain.from_iterable(
        attempts_in_rounds(structure, phase) for phase in before
    )
    for part in chain(first, rounds):
        ending = yield from sequence.run_part(part)
        if isinstance(ending, Finished) or _is_proof(ending):
            break
    return ending


def exactly(
    problem: Problem, sequence: MethodSequence, tree: Tree | None = None
) -> Stage:
    """Yield (z - w) / 2 of an exact solution, rounded, for a problem of at most
    `measure.FEW_UNKNOWNS`: of one close to the last iterate, or else of one that the
    tree, if there is one, reaches within its next work limit. For at most MAX_DECIDED
    unknowns the tree comes first, as it decides sooner than pivoting from a basis that
    is not right.

    Finished : there is a solution. NoSolution : it is proved that there is none.
    Stalled : there are solutions, but they are out of range or do not solve the problem
        when rounded to double precision; or none was reached in time.
    """
    return (
        yield from sequence.run_stage(
            "exact", _exact(problem, problem.box.z_of(sequence.last.x), tree)
        )
    )


def _exact(problem: Problem, z: Vector, tree: Tree | None) -> Stage:
    data = exact_data(problem) if tree is None else tree.data
    reason = UNDECIDED_IN_TIME

    def solutions() -> Iterator[list[Fraction] | None]:
        if tree is not None and problem.n <= MAX_DECIDED and tree.continues_search():
            yield tree.solution
        if tree is None or not tree.is_decided or tree.solution is not None:
            with suppress(TimeIsUp):
                yield from_point(
                    data, np.where(np.isfinite(z), z, 0.0), Effort(EXHAUSTION_EFFORT)
                )
            raise_if_timed_out()
        if tree is not None and tree.continues_search():
            yield tree.solution

    for solution in (each for each in solutions() if each is not None):
        exact_z, exact_w = rounded(solution), rounded(data.w(solution))
        if not (is_finite(exact_z) and is_finite(exact_w)):
            reason = OUT_OF_RANGE
            continue
        x = problem.box.x_of(exact_z, exact_w)
        yield Iterate(x, None, "exact", 1)
        rounded_z = problem.box.z_of(x)
        accepted_point = accepted(
            problem, [rounded_z], Criterion(problem).tol, IF_PROVED
        )
        if accepted_point is not None and accepted_point.solved:
            return Finished()
        reason = LOST_BY_ROUNDING
    if tree is None or not tree.is_decided or tree.solution is not None:
        return Stalled(reason)
    with suppress(TimeIsUp):
        y = farkas_vector(data, Effort(EXHAUSTION_EFFORT).steps(data))
        if y is not None:
            return NoSolution(Proof.of_fractions(data, y))
    return NoSolution(Proof("exhaustion", statement=EXCLUDED))
