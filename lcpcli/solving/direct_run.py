"""Attempts that may answer a problem at once, before the loop of `auto`: a table, each
row of which is a quick form of rows of the table in `auto.attempts`, by kernels if
there are any.

If nobody sees their steps, they run without the loop, which takes as long as they do
for few unknowns; otherwise the loop takes their steps as the first iterates of `auto`.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from itertools import chain, islice
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, TypeVar

import numpy as np

from lcpcli.clock import Stopwatch, imports
from lcpcli.errors import OptionError, ParameterError
from lcpcli.interrupts import TimeIsUp, deadline_after, hides_interrupt
from lcpcli.linalg.doubles import is_finite, number_of
from lcpcli.methods import direct
from lcpcli.methods.direct import (
    MAX_COMPILED,
    MAX_PIVOTED,
    MAX_UNKNOWNS,
    MIN_FOR_PIQP,
    DirectAnswer,
    Made,
    may_be_program,
)
from lcpcli.model.box import BASIC, of_masks
from lcpcli.model.changes import Change, Scaled
from lcpcli.model.problem import Problem
from lcpcli.options import KERNELS, MISSING, Limits, has_numba, wants_kernels
from lcpcli.solving.result import Result
from lcpcli.typing import BasisStatus, Vector
from lcpcli.verify.acceptance import (
    AT_ONCE,
    BY_CRITERION,
    CLEANED,
    Acceptance,
    Extent,
    accepted,
)
from lcpcli.verify.final_states import (
    MAX_DECIDED,
    may_hide_term,
    without_rounding,
)
from lcpcli.verify.measure import FEW_UNKNOWNS, Rows
from lcpcli.verify.point import Criterion, Point

if TYPE_CHECKING:
    from types import ModuleType

    from lcpcli.auto.attempts import AttemptRule, Structure
    from lcpcli.methods.stages import Iterate, RecordedStages, Stage
    from lcpcli.model.formulation import Proposal
    from lcpcli.model.words import Start
    from lcpcli.solving.prepared_matrix import PreparedMatrix

# Unknowns of a program up to which kernels for mixed problems take less time than PIQP.
MAX_BY_KERNELS = 100
MANY = 1000  # problems from which on loading the kernels is worthwhile
# Relative to the largest component, in the column scaling of M: what elimination leaves
# of zeros is smaller.
ELIMINATED_ZERO = 2.0**-53
# Relative to the tolerance: the relative residual up to which a point need not be
# replaced by a basic solution.
EARLY = 0.1
# The acceptance test for points of the first stages of `auto`: where entries of q would
# have to be treated as 0, later stages follow, which may not need that.
FIRST_STAGES = Extent(CLEANED, is_exact=True)
# Relative to the largest |q_i|: the natural residual up to which a start is tested as a
# solution.
NEARLY_SOLVED = 1e-6
# Basic solutions from the last basis of a sequence: if none of them is a solution, this
# basis was not close to that of one.
MAX_TRIED_BASES = 3


@cache
def compiled() -> ModuleType | None:
    """Return the module of the compiled kernels, which takes half a second to load;
    None without the extra `fast`, or if its numba fails, as with a version of numpy
    that is too new for it, or if its cache cannot be used, which a message says."""
    if not has_numba():
        return None
    with imports:
        try:
            from lcpcli.kernels import compiled
        except (ImportError, RuntimeError, OptionError) as error:
            if hides_interrupt(error):
                raise KeyboardInterrupt from None
            return None
    return compiled


def acceptance_test(
    problem: Problem, z: Vector, tol: float
) -> tuple[bool | None, Rows | None]:
    """Return what the kernels, if there are any, decide about a z within its bounds for
    a problem with sparse M: whether it solves the problem, and its rows; None for what
    they do not decide."""
    fast = compiled()
    return (None, None) if fast is None else fast.test_sparse(problem, z, tol)


def uses_kernels(wanted: bool | None, number: int) -> bool:
    """Return whether the compiled kernels are to be used, without loading them: where
    they are wanted or, by default (None), after `use_kernels()`, or where there are so
    many problems that loading them is worthwhile, and numba is installed. Raise
    OptionError if they are wanted and it is not."""
    if wanted and not has_numba():
        raise ParameterError("compiled", *MISSING)
    return (
        wanted
        if wanted is not None
        else wants_kernels() or (number >= MANY and has_numba())
    )


def use_kernels(wanted: bool = True) -> None:
    """Use the compiled kernels of the extra `fast` in every later call of this process
    that has no `compiled`, and in processes that it starts, as if it were called with
    compiled=True; methods other than "auto" are as before. The environment variable
    LCPCLI_KERNELS=1 does the same from the start.

    wanted : False for what each call does by default.

    >>> import lcpcli
    >>> lcpcli.use_kernels()
    >>> lcpcli.use_kernels(False)
    """
    if wanted and not has_numba():
        raise ParameterError("use_kernels", *MISSING)
    os.environ[KERNELS] = "1" if wanted else "0"
    wants_kernels.cache_clear()


@dataclass(eq=False, repr=False)
class Session:
    """A run of `auto` that has been set up: what its attempts share, each of which
    returns the result of `result_if_accepted`.

    options : the options in force.
    start : the start, whose basis comes first; None if there is none.
    recorded_stages : receives the first stages as they ran, unless it is None.
    prepared : what a sequence keeps of M; None for a single problem.
    proposal : the point that the formulation proposes in a sequence from the last
        basis; None if there is none.
    is_compiled : whether kernels are used, if there are any.
    is_shown : whether somebody sees the steps.
    interrupted : whether Ctrl-C has ended an attempt.
    lost : the basic solutions from which `newton` continues in the first stages.
    answer : the last answer that was tested.
    extent : the acceptance test of the last point of an attempt.
    evaluations : those of the first stages, also if they lead to no solution.
    certain : a z that is known to solve the problem, though its relative residual does
        not show it, and why.
    change : to the units in which the attempts are made; None if there is no other.
    """

    problem: Problem
    limits: Limits
    options: dict[str, Any]
    stopwatch: Stopwatch
    is_compiled: bool = False
    start: Start | None = None
    recorded_stages: RecordedStages | None = None
    prepared: PreparedMatrix | None = None
    proposal: Proposal | None = None
    is_shown: bool = False
    interrupted: bool = False
    lost: Sequence[Made] = ()
    answer: DirectAnswer | None = None
    extent: Extent = AT_ONCE
    evaluations: int = 0
    certain: tuple[Vector, str] | None = None
    change: Change | None = None

    @property
    def within(self) -> Session:
        """Return the session of the same run in the units of the attempts."""
        change = self.change
        if not isinstance(change, Scaled):
            return self
        start = None if self.start is None else self.start.in_units_of(change)
        return replace(self, problem=change.problem, change=None, start=start)

    def is_late(self) -> bool:
        """Return whether the time is up."""
        return not self.stopwatch.total < self.limits.time_limit

    def point(self, z: Vector, problem: Problem | None = None) -> Point:
        """Return the point of a z, for the problem or another form of it."""
        return Point(Criterion(problem or self.problem, self.limits.tol), z)

    def result_if_accepted(
        self,
        answer: DirectAnswer | None,
        route: tuple[str, ...] = (),
        why: str = "",
    ) -> Result | None:
        """Return the result of an answer at which an attempt ended, if it solves the
        problem within the limits.

        route : the methods that took part; by default those of the answer. why : the
            reason why it is known to be a solution if the relative residual does not
            show it; else "".
        """
        self.stopwatch.count("solve")
        self.answer = answer
        reason: str | None = None
        point = None if answer is None else answer.point
        if answer is not None and answer.steps <= self.limits.max_iterations:
            if point is None:
                criterion = Criterion(self.problem, self.limits.tol)
                make = Point.of_solution if answer.is_certain else Point
                point = make(criterion, answer.z)
            if answer.is_certain:
                reason = ""
            elif acceptance := accepted(
                self.problem, [point], self.limits.tol, self.extent
            ):
                reason = acceptance.reason
            elif why:
                reason = why
                self.certain = answer.z, why
        self.stopwatch.count("verify")
        if answer is None or point is None or reason is None:
            return None
        if self.limits.time_limit < math.inf and self.is_late():
            return None
        steps, method = answer.steps, answer.method
        if not route and steps:
            route = ("newton", method)[steps < 2 or method == "newton" :]
        return Result.of_solution(
            route or ("auto",),
            steps,
            self.limits,
            self.options,
            self.stopwatch.parts,
            answer.evaluations,
            answer.end,
            reason,
            problem=self.problem,
            point=point,
        )


Item = TypeVar("Item")
End = TypeVar("End")
Steps: TypeAlias = Generator["Made | Iterate", None, Result | None]
"""The steps of an attempt, which returns the result at a solution, or None."""


class Quick(NamedTuple):
    """An attempt that may answer at once.

    min_unknowns, applies : for how many unknowns it is made, and for which sessions.
    steps : how. is_timed : whether it may take so long that a time limit has to stop
        it.
    needs_origin : whether it is made only for problems with a formulation.
    """

    min_unknowns: int
    applies: Callable[[Session], bool]
    steps: Callable[[Session], Steps]
    is_timed: bool = False
    needs_origin: bool = False


def answered(session: Session) -> Result | None:
    """Return the result of the first attempt on the problem of a session that reaches a
    solution; None if none does. Nobody sees its steps."""
    within = session.within
    for attempt in attempts(within):
        steps = attempt.steps(within)
        result = _in_time(within, steps) if attempt.is_timed else exhausted(steps)
        if result is not None and within is not session:
            result = _in_given_units(session, result)
        if result is not None:
            return result
    return None


@np.errstate(all="ignore")
def _in_given_units(session: Session, result: Result) -> Result | None:
    """Return a result in the units of the attempts as one of the problem of a session;
    None if z does not solve that. If doubles cannot represent z in the units of the
    data, the run continues in these."""
    change = session.change
    assert isinstance(change, Scaled)
    z = change.z_outside(result.z)
    if not is_finite(z):
        session.change, session.recorded_stages = None, {}
        return None
    answer = DirectAnswer(
        session.problem.box.project(z),
        False,
        result.iterations,
        evaluations=result.evaluations,
        end=result.end,
    )
    session.extent = FIRST_STAGES
    return session.result_if_accepted(answer, result.route)


def exhausted(steps: Generator[Item, None, End], made: list[Item] | None = None) -> End:
    """Run all of these steps, which nobody sees, and return what they return; `made`,
    unless it is None, receives the steps."""
    while True:
        try:
            step = next(steps)
        except StopIteration as end:
            result: End = end.value
            return result
        if made is not None:
            made.append(step)


@np.errstate(all="ignore")
def _in_time(session: Session, steps: Steps) -> Result | None:
    """Return the result of steps that nobody sees; None if their time is up."""
    try:
        with deadline_after(session.limits.time_limit - session.stopwatch.elapsed()):
            return exhausted(steps)
    except TimeIsUp:
        return None


strictly_exhausted = np.errstate(over="raise", invalid="raise", divide="raise")(
    exhausted
)


def proposed_steps(session: Session) -> Steps:
    """Return the result at the point that the formulation of the problem proposes, in a
    sequence from the last basis, if there is such a point and it is a solution; else
    None."""
    yield from ()
    proposal = session.proposal
    if proposal is None:
        session.stopwatch.count("setup")
        proposal = session.problem.formulation.proposed(session.problem)
    if proposal is None:
        return None
    answer = DirectAnswer(
        proposal.z, proposal.is_certain, proposal.steps, proposal.method
    )
    return session.result_if_accepted(answer, (proposal.method,), proposal.reason)


# Without it: a portfolio in 200 unknowns takes 2.9 times as long.
def program_steps(session: Session) -> Steps:
    """Return the result of a convex program to whose solution PIQP and a few basic
    solutions lead; else None."""
    with imports:
        from lcpcli.methods.convex_program import convex_program
        from lcpcli.methods.stages import FAULTS, Breakdown, Iterate, advance, ended
    session.stopwatch.count("setup")
    limits = session.limits
    box = session.problem.box
    extent = session.extent if session.extent.share else BY_CRITERION
    steps = 0
    acceptance: Acceptance | None = None
    # The last iterate without rounding errors of 0, and as it is, if these points have
    # not been tested yet.
    points: list[Point] = []
    try:
        stage = convex_program(session.problem)
        while steps < limits.max_iterations:
            step = advance(stage)
            if not isinstance(step, Iterate):
                break
            session.stopwatch.count("solve")
            steps, z = steps + 1, box.z_of(step.x)
            points = [session.point(z)]
            if step.basis is None:  # else z is right to its last digits
                rounded = without_rounding(
                    z, np.exp2(-session.problem.units.columns), ELIMINATED_ZERO
                )
                points.insert(0, session.point(box.project(rounded)))
            if step.signs_final:
                acceptance = accepted(session.problem, points, limits.tol, extent)
                points = []
            else:
                tol = EARLY * limits.tol
                early = Point(Criterion(session.problem, tol), points[0].z)
                acceptance = accepted(session.problem, [early], tol, AT_ONCE)
            session.stopwatch.count("verify")
            if acceptance is not None:
                break
            yield step
        if acceptance is None and points:
            acceptance = accepted(session.problem, points, limits.tol, extent)
    except FAULTS:
        acceptance = None
    if acceptance is None and session.recorded_stages is not None:
        # PIQP is not run again.
        session.recorded_stages["piqp"] = [
            ended(Breakdown("PIQP does not lead to a solution"))
        ]
    if acceptance is None:
        return None
    answer = DirectAnswer(
        acceptance.point.z, False, steps, "piqp", point=acceptance.point
    )
    return session.result_if_accepted(answer, ("piqp",))


# Without it: contact in 32 unknowns by kernels takes 12 times as long.
def direct_steps(session: Session) -> Steps:
    """Return the result of a problem to which this applies, if the answer at a start,
    of kernels or of block pivoting is a solution, or the first stages of `auto` lead to
    one; else None."""
    problem, start = session.problem, session.start
    fast = compiled() if session.is_compiled else None
    if fast is not None:
        session.options["compiled"] = True
    session.stopwatch.count("setup")
    if fast is not None and start is None and problem.is_mixed:
        answer = fast.mixed(problem, session.limits.tol)
        if answer is not None:
            return session.result_if_accepted(answer)
    # With more unknowns, or far sides, only the kernels for mixed problems come before
    # the loop. A step of a nonlinear run has the attempts below alone.
    is_for_loop = session.is_compiled and not session.extent.share
    if is_for_loop and (problem.n > MAX_PIVOTED or problem.has_far_sides):
        return None
    dense = problem
    if type(problem.M) is not np.ndarray:
        stays_banded = fast is None and direct.is_full_band(problem.M)
        dense = problem if stays_banded else direct.as_dense(problem)
    if start is not None and start.z is not None:
        if start.gap <= NEARLY_SOLVED * problem.sizes_of_q[1]:
            point, box = session.point(start.z, dense), dense.box
            if (
                fast is not None
                and box.is_orthant
                and fast.solves(dense, start.z, session.limits.tol)
            ):
                point = Point.of_solution(point.criterion, start.z)
            if np.array_equal(box.project(start.z), start.z) and point.solves():
                return session.result_if_accepted(
                    DirectAnswer(start.z, True, 0, point=point)
                )
        # Pivoting takes no longer than solving one system and testing its solution.
        if not start.is_near or problem.n <= FEW_UNKNOWNS:
            start = None
    result = session.result_if_accepted(
        (yield from _answer(session, start, dense, fast))
    )
    if result is not None or session.is_late():
        return result
    steps = first_steps(session, start, dense, fast)
    if session.is_shown:
        return (yield from steps)
    with (
        suppress(TimeIsUp),
        deadline_after(session.limits.time_limit - session.stopwatch.elapsed()),
    ):
        # The loop raises errors of numpy, too.
        return strictly_exhausted(steps)
    return None


def _answer(
    session: Session, start: Start | None, problem: Problem, fast: ModuleType | None
) -> Generator[Made, None, DirectAnswer | None]:
    """Return the answer of a direct attempt on a problem with dense M, from the basis
    of a start if there is one; None if there is no answer."""
    tol = session.limits.tol
    answer: DirectAnswer | None = None
    basic = None if start is None else start.basis == BASIC
    has_diagonal = 0.0 not in problem.M.diagonal().tolist()
    if not has_diagonal and start is None and problem.n > 1 and not problem.M[0, 0]:
        with imports:
            from lcpcli.methods.bimatrix import costs, pure
        z = pure(problem, costs(problem))
        if z is not None:
            return DirectAnswer(z, False, 1, "pure")
    is_small, box = problem.n <= MAX_UNKNOWNS, problem.box
    if is_small and box.is_orthant and (has_diagonal or problem.n <= MAX_DECIDED):
        if start is None and has_diagonal:
            basic = direct.basic_zeros(problem)
        if fast is not None:
            answer = fast.direct(problem, tol, basic)
        else:
            is_continued = has_diagonal and basic is None
            steps = direct.exchanges(problem, tol, basic)
            answer = yield from _answer_of_exchanges(
                session, problem, steps, is_continued
            )
        if answer is not None:
            return answer
    elif start is None:
        # The signs of w show whether the reference point is a solution.
        reference = 0.0 if problem.reference_z is None else problem.reference_z
        nearest = box.project(reference - problem.q_ref)
        if not number_of(nearest != reference):
            return DirectAnswer(np.array(problem.reference_point), False, 0)
        if has_diagonal and is_small and not box.is_orthant:
            steps = direct.exchanges_within_bounds(problem, tol)
            return (yield from _answer_of_exchanges(session, problem, steps, False))
    # With zeros on the diagonal, newton rarely converges.
    if not has_diagonal and fast is not None and box.is_orthant:
        answer = fast.lemke(problem, tol, basic)
    return answer


def _answer_of_exchanges(
    session: Session,
    problem: Problem,
    steps: Generator[Made, None, DirectAnswer | None],
    is_continued: bool,
) -> Generator[Made, None, DirectAnswer | None]:
    """Return the answer of block pivots in numpy. is_continued : whether the first
    stages continue from them if they lead to no solution; if not, they are shown only
    if they lead to one."""
    made = list[Made]()
    if session.is_shown:
        answer = yield from _seen(steps, made, is_continued)
    else:
        with np.errstate(all="ignore"):
            answer = exhausted(steps, made)
    if answer is None:
        session.lost = made if is_continued else ()
        return None
    if not answer.is_clear and may_hide_term(problem, answer.z):
        answer = direct.without_doubtful_terms(problem, answer)
    if answer is not None and not is_continued:
        yield from made
    return answer


def _seen(
    steps: Generator[Made, None, DirectAnswer | None],
    made: list[Made],
    is_continued: bool,
) -> Generator[Made, None, DirectAnswer | None]:
    """Return the answer of block pivots, each of which is made when it is requested;
    pass them on if the first stages continue from them."""
    while True:
        try:
            with np.errstate(all="ignore"):
                made.append(next(steps))
        except StopIteration as end:
            answer: DirectAnswer | None = end.value
            return answer
        if is_continued:
            yield made[-1]


def first_steps(
    session: Session, start: Start | None, dense: Problem, fast: ModuleType | None
) -> Steps:
    """Return the result of the first stages of `auto` on the problem, as the loop of
    `auto` returns it; None if they do not reach an accepted solution. dense : the
    problem in the form that these stages take."""
    with imports:
        from lcpcli.auto.attempts import FIRST, Structure, attempts_in_rounds, phases
        from lcpcli.methods.newton import SLOW, iterate_of
        from lcpcli.methods.stages import (
            Finished,
            Iterate,
            MethodSequence,
            Part,
            Stalled,
            advance,
            ended,
            recorded,
        )
    made_before = None
    iterates = [iterate_of(made, k) for k, made in enumerate(session.lost, 1)]
    passed = {id(each.x) for each in iterates}  # passed on when they were made
    if iterates:
        made_before = {"newton": [ended(Stalled(SLOW), *iterates)]}
    structure = Structure(dense, np.zeros(dense.n), made_before)
    if fast is not None:
        structure.follow = fast.follow
    if session.prepared is not None:
        structure.reduced = session.prepared.reduced
    phase: Sequence[AttemptRule] = FIRST
    extent = FIRST_STAGES
    if session.extent.share:
        structure.is_linearization = True
        (phase,) = phases(structure)
        extent = session.extent
    sequence, route = MethodSequence(structure.x0), list[str]()
    parts = attempts_in_rounds(structure, phase)
    if start is not None:
        parts = chain([Part("newton", _from(start, dense, structure))], parts)
    for part in parts:
        if session.recorded_stages is not None:
            part.stage = recorded(part.method, part.stage, session.recorded_stages)
        stage = sequence.run_part(part)
        while isinstance(step := advance(stage), Iterate):
            route.append(step.method)
            if id(step.x) not in passed:
                yield step
        session.evaluations = sequence.last.evaluations
        if not isinstance(step, Finished):
            continue
        last = sequence.last
        point = session.point(dense.box.z_of(last.x), dense)
        acceptance = accepted(dense, [point], session.limits.tol, extent, last.basis)
        if acceptance is None and structure.is_linearization:
            continue
        if acceptance is None or not acceptance.solved:
            return None
        point, steps = acceptance.point, len(route)
        of_run = route[-1], last.evaluations, acceptance.basis, point
        answer = DirectAnswer(point.z, False, steps, *of_run)
        return session.result_if_accepted(answer, tuple(dict.fromkeys(route)))
    return None


def _from(start: Start, problem: Problem, structure: Structure) -> Stage:
    """Return the stage that begins at the basis of a start: block pivots; or, where the
    diagonal of M has zeros, one system, as for contact, or if the start is a z, the
    systems that interior solves last, as for programs."""
    with imports:
        from lcpcli.methods.lemke import feasible_basic_solution, from_last_basis
        from lcpcli.methods.newton import from_start
    if structure.is_linearization:
        return from_last_basis(problem, start.basis)
    if problem.M.diagonal().all():
        return from_start(problem, start.basis)
    if start.z is None:
        return feasible_basic_solution(problem, start.basis)
    with imports:
        from lcpcli.methods.interior import at_point
    return at_point(structure.thin, start.x)


def elimination_steps(session: Session) -> Steps:
    """Return the result of a problem of a sequence whose M is a tridiagonal M-matrix,
    or almost one, if elimination, or a few block pivots from its basis, lead to a
    solution; else None."""
    yield from ()  # no step of a sequence is seen
    problem, prepared = session.problem, session.prepared
    assert prepared is not None
    assert prepared.elimination is not None
    session.stopwatch.count("setup")
    z, basic = prepared.elimination.solution(problem.q_ref)
    if prepared.elimination.is_changed:
        return _from_last_basis(session, of_masks(basic), prepared)
    if problem.reference_z is not None:
        z += problem.reference_z
    return session.result_if_accepted(
        DirectAnswer(z, False, 1, "elimination", end=of_masks(basic))
    )


def last_basis_steps(session: Session) -> Steps:
    """Return the result of a problem of a sequence that is solved by the basis of the
    last solution, or by a few block pivots from it; else None."""
    yield from ()  # no step of a sequence is seen
    prepared = session.prepared
    start = session.start
    result = None
    assert prepared is not None
    if start is not None and not prepared.is_paused:
        result = _from_last_basis(session, start.basis, prepared)
        prepared.pause(result is not None)
    prepared.next()
    return result


@np.errstate(all="ignore")
def _from_last_basis(
    session: Session, basis: BasisStatus, prepared: PreparedMatrix
) -> Result | None:
    with imports:
        from lcpcli.basis.exchanges import BasicSolutions
        from lcpcli.methods.stages import FAULTS
    box, limits = session.problem.box, session.limits
    exchanges = BasicSolutions(
        session.problem, prepared.principal
    ).block_principal_pivoting(basis)
    pivoting = islice(exchanges, min(MAX_TRIED_BASES, limits.max_iterations))
    try:
        with deadline_after(limits.time_limit):
            steps, basic_solution = next(
                (k, basic_solution)
                for k, basic_solution in enumerate(pivoting, 1)
                if basic_solution.is_solution
            )
    except (*FAULTS, TimeIsUp, StopIteration):
        return None
    z = box.z_of(box.x_within(basic_solution.z, basic_solution.w, basic_solution.basis))
    return session.result_if_accepted(DirectAnswer(z, False, steps))


def pivots_first(session: Session) -> bool:
    """Return whether a problem has so few unknowns and moderate numbers that pivoting
    comes first, perhaps by kernels; it has no x0, and its bounds are used as they
    are."""
    problem = session.problem
    if not problem.is_moderate or problem.x0 is not None:
        return False
    is_compiled = session.is_compiled and session.prepared is None
    if is_compiled and problem.is_mixed:  # the kernels search for far bounds
        return problem.n <= MAX_COMPILED and (
            problem.origin is None or not problem.has_far_sides
        )
    return problem.n <= MAX_PIVOTED and not problem.has_far_sides


def _is_program(session: Session) -> bool:
    return session.start is None and may_be_program(session.problem)


def _has_quick_kernels(session: Session) -> bool:
    return session.is_compiled and session.problem.n <= MAX_BY_KERNELS


def _is_eliminated(session: Session) -> bool:
    problem, prepared = session.problem, session.prepared
    has_elimination = prepared is not None and prepared.elimination is not None
    return has_elimination and problem.is_moderate and problem.is_shifted_lcp


PIVOTING = Quick(0, pivots_first, direct_steps)
QUICK = (
    Quick(
        0,
        lambda s: s.start is None,
        proposed_steps,
        is_timed=True,
        needs_origin=True,
    ),
    Quick(
        MIN_FOR_PIQP,
        lambda s: not _has_quick_kernels(s) and _is_program(s),
        program_steps,
        is_timed=True,
    ),
    PIVOTING,
    Quick(
        MIN_FOR_PIQP,
        lambda s: _has_quick_kernels(s) and _is_program(s),
        program_steps,
        is_timed=True,
    ),
)
# The attempts on a problem of a sequence.
IN_SEQUENCE = (
    Quick(2, _is_eliminated, elimination_steps),
    Quick(0, lambda s: s.proposal is not None, proposed_steps, needs_origin=True),
    PIVOTING,
    Quick(0, lambda s: not pivots_first(s), last_basis_steps),
)


def attempts(session: Session) -> Iterator[Quick]:
    """Yield the attempts that are made on the problem of a session, in their order."""
    problem = session.problem
    for row in QUICK if session.prepared is None else IN_SEQUENCE:
        if problem.n < row.min_unknowns or (
            row.needs_origin and problem.origin is None
        ):
            continue
        if row.applies(session):
            yield row
