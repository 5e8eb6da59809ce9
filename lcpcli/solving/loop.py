"""The common loop: it takes iterates from a method, times the method, measures them and
reports how it ended."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import count
from lcpcli.interrupts import TimeIsUp, remaining
from lcpcli.linalg.matrices import may_be_stiff
from lcpcli.methods import stages
from lcpcli.methods.registry import declared
from lcpcli.methods.stages import Ending, Iterate, Stage
from lcpcli.model.box import LARGEST_X, in_range
from lcpcli.options import DEFAULTS
from lcpcli.solving.observers import NOBODY, Seen
from lcpcli.solving.result import Result, Status
from lcpcli.typing import BasisStatus, Vector
from lcpcli.verify.acceptance import (
    AT_ONCE,
    PROVED,
    WITHOUT_ROUNDING,
    Acceptance,
    Extent,
    accepted,
)
from lcpcli.verify.measure import FEW_UNKNOWNS
from lcpcli.verify.point import Criterion, Point

if TYPE_CHECKING:
    from lcpcli.solving.direct_run import Session
    from lcpcli.solving.trace import Callback, TraceRow
    from lcpcli.verify.certificate import Proof

# The residual itself is computed once its bound is at most this multiple of the
# tolerance.
MEASURED_FROM = 100
MEASURED_EVERY = 16  # iterations, if the method gives no bound on the residual
TOLD = 0.5  # seconds beyond the time limit that the message mentions
EXCEEDED = (
    "the last step and the verification, which are not cut short, took {:.1f} s more"
)
INTERVAL = 0.2  # seconds between two reports: often enough for the eye
BY_CALLBACK = "by the callback"
# Iterations after the tolerance is reached, if the method reports that its active set
# is not final.
EXTRA_ITERATIONS = 3
# The run has diverged once the bound on the residual exceeds this multiple of the first
# one.
GROWTH_LIMIT = 1e100
# Evaluations times n + OVERHEAD, and iterations, from which on a method that is not
# made for stiff problems is stopped if it gains nothing: some seconds.
MUCH_WORK = 2e6
OVERHEAD = 500
MIN_SLOW = 1024
GAINED_NOTHING = "the residual has not lost a digit in the last {} iterations"
FINISHED = (
    "the equation of the method is solved up to rounding, but z does not solve the "
    "problem"
)
# What is said where the numbers as written decide otherwise than the doubles.
SOLVABLE_AS_WRITTEN = (
    "the problem in double precision has no solution, with the numbers as written it "
    "has one"
)
EXCLUDED_AS_WRITTEN = (
    "with the numbers as written the problem has no solution, in double precision it "
    "may have one"
)
EXCLUDED_BOTH_WAYS = (
    "each complementary set is excluded in exact arithmetic, with the numbers as "
    "written as well as in double precision"
)
UNKNOWN_AS_WRITTEN = (
    "the problem in double precision has no solution; whether it has one with the "
    "numbers as written is not known"
)
# Statuses whose message explains the failure where M is stiff.
FAILED = (
    Status.ITERATION_LIMIT,
    Status.STALLED,
    Status.BREAKDOWN,
    Status.DIVERGED,
    Status.RAY,
)
STATUS_OF_CERTIFICATE = {
    "farkas": Status.INFEASIBLE,
    "exhaustion": Status.UNSOLVABLE,
    "ray": Status.RAY,
}
STATUS_OF_VERDICT = {
    "solved": Status.SOLVED,
    "ill_posed": Status.ILL_POSED,
    "infeasible": Status.INFEASIBLE,
    "doubt": Status.STALLED,
}
NEAR_THE_CRITERION = Extent(WITHOUT_ROUNDING)


@dataclass(eq=False, repr=False)
class Loop:
    """The data of one run. The residual bound of an iterate is a bound on its relative
    residual that F gives at no cost, or else the residual. finishes : whether a
    solution with other small entries replaces an iterate as the answer, as by
    `auto`."""

    session: Session
    criterion: Criterion
    method: str
    last: Vector
    seen: Seen = NOBODY
    finishes: bool = False
    k: int = -1
    evaluations: int = 0
    extra: int = 0
    best_bound: float = math.inf
    bound_before: float = math.inf
    first_bound: float = math.inf
    last_by: str = ""
    best_by: str = ""
    end: BasisStatus | None = None
    certificate: Proof | None = None
    solution: Point | None = None
    _newest: tuple[Vector | None, Point | None] = None, None

    def __post_init__(self) -> None:
        self.problem, self.route = self.criterion.problem, list[str]()
        self.limits, self.stopwatch = self.session.limits, self.session.stopwatch
        self.traces = [trace for trace in self.seen.traces if trace is not None]
        self.asks_for_quantities = any(trace.columns for trace in self.traces)
        if self.problem.reference_z is not None and self.criterion.reference_solves:
            self.last = self.problem.box.x_of(
                self.problem.reference_point, self.problem.q_ref
            )
        self.start, self.best = Iterate(self.last, None, "", 0), self.last
        self._last_report, self._began = (self.method, 0, math.inf), time.monotonic()
        self._due = self._began + INTERVAL

    def run(self, begin: Callable[[], Stage]) -> tuple[Status, str]:
        """Take the start, then the iterates of the method that `begin` sets up; return
        how the run ended, and why."""
        tick = self.stopwatch.count
        try:
            if stop := self._take(self.start):
                return stop
            if self.session.interrupted:
                raise KeyboardInterrupt
            tick("verify")
            # Measuring ignores these errors.
            with np.errstate(over="raise", invalid="raise", divide="raise"):
                try:
                    stage = begin()
                finally:
                    tick("setup")
                while True:
                    try:
                        step = stages.advance(stage)
                    finally:
                        tick("solve")
                    self._note_method(step.method)
                    if not isinstance(step, Iterate):
                        break
                    stop = self._take(step)
                    callback = self.seen.callback
                    if callback is not None and self._calls_for_the_end(step, callback):
                        stop = stop or (Status.INTERRUPTED, BY_CALLBACK)
                    if stop:
                        return stop
                    tick("verify")
            return self._ended(step)
        except stages.FAULTS as error:
            return (
                Status.BREAKDOWN,
                f"{stages.clause_on(error)} after {count(max(self.k, 0), 'iteration')}",
            )
        except TimeIsUp:
            return Status.TIME_LIMIT, "in the middle of a step"
        except KeyboardInterrupt:
            self.session.interrupted = True
            return Status.INTERRUPTED, ""

    def _take(self, iterate: Iterate) -> tuple[Status, str] | None:
        """Record an iterate; return the status and the reason, if the run stops with
        this iterate."""
        self.k += 1
        self.evaluations = iterate.evaluations
        finite = in_range(iterate.x)
        bound, point = self._measured(iterate) if finite else (math.inf, None)
        if finite:
            self.last, self.last_by = iterate.x, iterate.method
            if self.traces:
                self._add_to_traces(iterate)
        elif not self.k:
            self.last = self.best = np.clip(iterate.x, -LARGEST_X, LARGEST_X)
        if bound < self.best_bound:
            self.best_bound = bound
            self.best = iterate.x
            self.best_by = iterate.method
        self.first_bound = self.first_bound if self.first_bound < math.inf else bound
        if self.seen.observe is not None:
            self._last_report = iterate.method or self.method, self.k, bound
            self.report_if_due()
        solution = None
        if point is not None and (why := self._certainty(point)):
            self.best, self.end, self.solution = iterate.x, iterate.basis, point
            return Status.SOLVED, why
        # For many unknowns a solution close to the point is sought, but not in the
        # middle of an iteration, which continues.
        if point is not None:
            is_last = iterate.F is None and self.k > 0 and self.problem.n > FEW_UNKNOWNS
            solution = self._accepted(
                [point], NEAR_THE_CRITERION if is_last else AT_ONCE
            )
        if solution is not None:
            self.best, self.end = iterate.x, iterate.basis
            self.solution = solution.point
            self.extra += 1
            if iterate.signs_final or self.extra > EXTRA_ITERATIONS:
                return Status.SOLVED, ""
        return self._stopping_rule(iterate, bound)

    def _certainty(self, point: Point) -> str:
        """Return why an attempt knows that the point solves the problem; "" if it does
        not."""
        if self.session.certain is None:
            return ""
        z, why = self.session.certain
        return why if np.array_equal(z, point.z) else ""

    def _measured(self, iterate: Iterate) -> tuple[float, Point | None]:
        """Return a bound on the relative residual, infinite if unknown, and the point
        if it is worth measuring, at the cost of two products with M: without F at
        iterates that may be the last, and every few iterations; with F close to the
        tolerance, and at k = 0, 1, 2, 4, 8, ..., in case the bound never decreases
        although the residual does; for a nonlinear problem, only if the iterate is
        final."""
        if iterate.F is not None:
            bound = self.criterion.bound(iterate.F)
            worth = (
                bound <= MEASURED_FROM * self.limits.tol or self.k & (self.k - 1) == 0
            )
            # Measuring F and J costs as much as the next step.
            worth &= iterate.signs_final or self.criterion.is_linear
            return bound, self._at(iterate.x) if worth else None
        if not iterate.signs_final and self.k % MEASURED_EVERY:
            return math.inf, None
        point = self._at(iterate.x)
        return point.size if self.k and not point.solves() else math.inf, point

    def _stopping_rule(
        self, iterate: Iterate, bound: float
    ) -> tuple[Status, str] | None:
        """Return the status and the reason of the first stopping rule that applies,
        other than a solution."""
        if (
            declared(self.method).iterates
            and not bound <= GROWTH_LIMIT * self.first_bound
        ):
            # Whether F itself, computed from M and q, has grown.
            with np.errstate(over="ignore", invalid="ignore"):
                each = [
                    (self.problem.box.z_of(x), x) for x in (self.start.x, iterate.x)
                ]
                first, last = (
                    self.criterion.bound(self.problem.w(z) - (z - 2 * x))
                    for z, x in each
                )
            if not last <= GROWTH_LIMIT * first:
                return Status.DIVERGED, ""
        if self.k >= self.limits.max_iterations:
            return Status.ITERATION_LIMIT, ""
        work = self.evaluations * (self.problem.n + OVERHEAD)
        if self.k & (self.k - 1) == 0 and work >= MUCH_WORK:
            slow, self.bound_before = self._is_too_slow(), self.best_bound
            if slow:
                return Status.STALLED, GAINED_NOTHING.format(self.k // 2)
        return (Status.TIME_LIMIT, "") if self._time_is_up() else None

    def _is_too_slow(self) -> bool:
        """Return whether a published method has gained no digit since it had made half
        as many iterations, on a stiff problem that it is not made for; the user, who
        sets another limit, knows better."""
        if (
            self.k < MIN_SLOW
            or self.limits.max_iterations != DEFAULTS.max_iterations
            or not self.best_bound > 0.1 * self.bound_before
            or not may_be_stiff(self.problem.M)
        ):
            return False
        return bool(self._explanation())

    def _explanation(self) -> str:
        with imports:
            from lcpcli.solving.stiffness import explanation
        return explanation(self.problem, self.method)

    def _ended(self, ending: Ending) -> tuple[Status, str]:
        """Return the status and the reason when the method itself stops: those that a
        certificate justifies, once it is verified on M and q."""
        if isinstance(ending, stages.NoSolution):
            with imports:
                from lcpcli.verify.certificate import verify_claim
            claim = ending.certificate
            self.certificate = verify_claim(
                self.problem, claim, declared(self.method).excludes_exactly
            )
            if self.certificate is None:
                return self._ended_as_written(claim)
            return STATUS_OF_CERTIFICATE[
                self.certificate.kind
            ], self.certificate.statement
        if isinstance(ending, stages.Finished):
            return (
                Status.STALLED,
                f"{ending.reason}, but z does not solve the problem"
                if ending.reason
                else FINISHED,
            )
        if isinstance(ending, stages.Breakdown):
            return Status.BREAKDOWN, ending.reason
        time_is_up = self._time_is_up() or (
            isinstance(ending, stages.OutOfTime) and remaining() < math.inf
        )
        return (Status.TIME_LIMIT if time_is_up else Status.STALLED), ending.reason

    def _ended_as_written(self, claim: Proof) -> tuple[Status, str]:
        """Return how a run has ended whose claim does not hold for the doubles of the
        problem as well as for its numbers as written: with a solution for these or
        without one, if exact arithmetic decides it; stalled if the claim is false of
        both; otherwise ill-posed."""
        with imports:
            from lcpcli.rational.numbers import rounded
            from lcpcli.rational.written import are_same
            from lcpcli.verify.certificate import (
                UNVERIFIED,
                proof_as_written,
                solution_as_written,
            )
        is_complete = declared(self.method).excludes_exactly
        holds_for_doubles = claim.holds(self.problem.having(written=None), is_complete)
        # Only the exact arithmetic of `auto` claims what is true of the numbers as
        # written alone.
        may_hold = claim.kind != "ray" and self.method == "auto"
        try:
            if not (holds_for_doubles or may_hold) or are_same(self.problem):
                return Status.STALLED, UNVERIFIED[claim.kind]
            solution = solution_as_written(self.problem)
        except TimeIsUp:
            if not holds_for_doubles:
                return Status.STALLED, UNVERIFIED[claim.kind]
            return Status.ILL_POSED, UNKNOWN_AS_WRITTEN
        if solution is None and not holds_for_doubles:
            return Status.ILL_POSED, EXCLUDED_AS_WRITTEN
        if solution is None:
            self.certificate = proof_as_written(self.problem, claim)
            kind = self.certificate.kind
            reason = self.certificate.statement or EXCLUDED_BOTH_WAYS
            return STATUS_OF_CERTIFICATE[kind], reason
        if self.method != "auto":
            return Status.STALLED, SOLVABLE_AS_WRITTEN
        z = rounded(solution)
        x = self.problem.box.x_of(z, self.problem.w(z))
        point = self._at(x) if in_range(x) else None
        if point is None or not point.solves():
            return Status.ILL_POSED, SOLVABLE_AS_WRITTEN
        self.k += 1
        self.best, self.end, self.solution = x, None, point
        self._note_method("exact")
        return Status.SOLVED, ""

    def _note_method(self, method: str) -> None:
        """Add a method to the route; "" is the requested method."""
        method = method or self.method
        if method not in self.route:
            self.route.append(method)

    def report_if_due(self) -> None:
        """Call `observe` with what was seen last, if it is time; also during a long
        step."""
        now = time.monotonic()
        if self.seen.observe is not None and now >= self._due:
            self._due = now + INTERVAL
            self.seen.observe(*self._last_report, now - self._began)

    def _time_is_up(self) -> bool:
        """Return whether the time of this run, or of what it is part of, is up;
        measuring the iterates counts too."""
        limit = self.limits.time_limit
        return (
            limit < math.inf and self.stopwatch.elapsed() >= limit
        ) or remaining() <= 0

    def _at(self, x: Vector) -> Point:
        """Return the point of x with its measures; the last one is cached."""
        measured, point = self._newest
        if point is None or x is not measured:
            point = self.criterion.point(self.problem.box.z_of(x))
            self._newest = x, point
        return point

    def _add_to_traces(self, iterate: Iterate) -> None:
        """Add an iterate to the traces; the time that this takes does not count."""
        row = self._row(iterate, self.asks_for_quantities)
        for trace in self.traces:
            if self.k == 1 and trace.columns:
                trace.complete_start(iterate)
            trace.add(row, self.criterion)
        self.stopwatch.skip()

    def _row(self, iterate: Iterate, asks: bool) -> TraceRow:
        """Return the row of an iterate. asks : whether its quantities may be read."""
        with imports:
            from lcpcli.solving.trace import row_of
        self.stopwatch.count("verify")
        z, at = self.problem.box.z_of(iterate.x), self.stopwatch.total
        return row_of(iterate, self.method, max(self.k, 0), z, at, asks)

    def _calls_for_the_end(self, iterate: Iterate, callback: Callback) -> bool:
        """Return whether the callback stops the run after this iterate; its own time
        does not count."""
        if not in_range(iterate.x):
            return False
        with imports:
            from lcpcli.solving.trace import LateRow
        row = LateRow.of(self._row(iterate, True), self.criterion)
        if not self.criterion.is_linear:
            _ = row.residual  # F is called during the run, not after it
        try:
            with np.errstate(over="warn", invalid="warn", divide="warn"):
                return bool(callback(row))
        except StopIteration:
            return True
        finally:
            self.stopwatch.skip()

    def result(self, status: Status, reason: str) -> Result:
        """Return the result at the last or the best iterate. "Solved" is decided here,
        however the run ended: by the relative residual, or by exact arithmetic where z
        is as close to the solution as double precision allows."""
        point, reason, status = self._verified(status, reason)
        if status in FAILED and may_be_stiff(self.problem.M):
            reason = "; ".join(filter(None, (reason, self._explanation())))
        self.stopwatch.count("verify")
        late = self.stopwatch.total - self.limits.time_limit
        if status is Status.TIME_LIMIT and late > TOLD:
            reason = "; ".join(filter(None, (reason, EXCEEDED.format(late))))
        if self.k < 0 and self.traces:  # interrupted before anything was recorded
            self._add_to_traces(self.start._replace(x=self.last))
        for trace in self.traces:
            trace.close(self.criterion)
        is_solved = status is Status.SOLVED
        return Result.of_solution(
            tuple(self.route) or (self.method,),
            max(self.k, 0),
            self.limits,
            self.session.options,
            self.stopwatch.parts,
            self.evaluations,
            self.end if is_solved else None,
            problem=point.criterion.problem,
            point=point,
            method=self.method,
            status=status,
            message=status.sentence(reason),
            trace=self.seen.traces[0],
            curve=self.seen.traces[1],
            certificate=None if is_solved else self.certificate,
            interrupted=self.session.interrupted,
            nearest=self.last_by,
        )

    def _verified(self, status: Status, reason: str) -> tuple[Point, str, Status]:
        """Return the point to report, with the reason and the status that it justifies.
        An exact proof that there is no solution overrides a small residual."""
        if self.solution is not None and self._certainty(self.solution):
            return self.solution, reason, status
        last, best = self._at(self.last), self._at(self.best)
        # A proof that holds only up to rounding: a solution close to a point may
        # outweigh it. One that holds exactly is final.
        refutation = self.certificate
        if refutation is not None and not refutation.is_rounded:
            refutation = None
        if status.has_no_solution and refutation is None:
            return last, reason, status
        points = [last, best]
        if self.solution is not None:
            points.insert(1, self.solution)
        acceptance = self._accepted(points, NEAR_THE_CRITERION)
        if acceptance is not None:
            return acceptance.point, acceptance.reason, Status.SOLVED
        if not self.session.interrupted and status is not Status.TIME_LIMIT:
            seconds = self.limits.time_limit - self.stopwatch.elapsed()
            acceptance = self._accepted(
                [last, best],
                Extent(
                    first=PROVED,
                    keeps=not self.finishes,
                    seconds=seconds,
                    refutation=refutation,
                ),
            )
        if acceptance is not None and acceptance.verdict != "doubt":
            self.certificate = acceptance.certificate or self.certificate
            return (
                acceptance.point,
                acceptance.reason,
                STATUS_OF_VERDICT[acceptance.verdict],
            )
        if refutation is not None:
            return last, reason, status
        if acceptance is not None and status is Status.STALLED:
            reason = acceptance.reason
        return self._nearest(last, best, reason, status)

    def _accepted(self, points: list[Point], extent: Extent) -> Acceptance | None:
        criterion = self.criterion
        return accepted(criterion.problem, points, criterion.tol, extent)

    def _nearest(
        self, last: Point, best: Point, reason: str, status: Status
    ) -> tuple[Point, str, Status]:
        """Return the one of two points, neither of which is a solution, that is closer
        to one."""
        nearest = min(
            (last, best),
            key=lambda point: (
                not point.nearly_solves(),
                point.relative_residual,
                point.residual,
            ),
        )
        if nearest is not last:
            self.last_by = self.best_by
            if reason:
                reason = f"{reason}; "
            reason += "the best iterate is reported, not the last"
        return nearest, reason, status
