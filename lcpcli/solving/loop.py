"""The one loop: it takes iterates from a method, times it, measures them and reports how it ended."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from lcpcli.interrupts import TimeIsUp
from lcpcli.methods.iterate import Breakdown, Ending, Finished, Iterate, NoSolution, OutOfTime, Stage, advance
from lcpcli.methods.registry import METHODS
from lcpcli.model.modulus import LARGEST_X, z_of
from lcpcli.model.problem import Problem
from lcpcli.solving.limits import Limits
from lcpcli.solving.observer import Observer
from lcpcli.solving.result import Result, Status
from lcpcli.solving.trace import PendingRow, Trace
from lcpcli.typing import Vector
from lcpcli.verify.accuracy import Accuracy
from lcpcli.verify.certificate import Certificate, proves_infeasible
from lcpcli.verify.refinement import is_rounded_solution

MEASURED_FROM = 100  # times the tolerance: the bound on the residual from which on the residual itself is computed
ROUNDED = "z is the exact solution up to rounding of its last digits"
EXTRA_ITERATIONS = 3  # iterations after the tolerance is reached, if the method reports that signs are still wrong
GROWTH_LIMIT = 1e100  # times the first bound on the residual, beyond which the run has diverged
FINISHED = "the method has terminated, as its equation is solved to rounding level"
UNVERIFIED = "the certificate of infeasibility failed exact verification"


class Loop:
    """The state of one run.

    The residual bound of an iterate is a bound on its relative residual that F gives for free, or else that residual.
    """

    def __init__(
        self,
        problem: Problem,
        method: str,
        limits: Limits,
        traces: tuple[Trace | None, Trace | None],
        clock: Callable[[], float],
        observer: Observer | None,
        x0: Vector,
    ) -> None:
        self.problem, self.method, self.limits, self.traces, self.clock = problem, method, limits, traces, clock
        self.began = clock()
        self.observer, self.accuracy = observer, Accuracy(problem, limits.tol)
        self.setup_seconds, self.solve_seconds = 0.0, 0.0
        self.start, self.k, self.evaluations = Iterate(x0, None, "", 0), -1, 0
        self.last = self.best = np.clip(x0, -LARGEST_X, LARGEST_X)
        self.best_bound = self.first_bound = math.inf
        self.extra = 0
        self.route: list[str] = []
        self.certificate: Certificate | None = None
        self._measured: tuple[Vector | None, float] = None, math.inf

    def run(self, begin: Callable[[], Stage]) -> tuple[Status, str]:
        """Take the start, then the iterates of the method that `begin` sets up; returns how that ended, and why."""
        try:
            if stop := self._take(self.start):
                return stop
            with self.setting_up(), np.errstate(over="raise", invalid="raise", divide="raise"):
                stage = begin()
            while True:
                step = self._next(stage)
                if not isinstance(step, Iterate):
                    return self._ended(step)
                self._note_method(step.method)
                if stop := self._take(step):
                    return stop
        except FloatingPointError as reason:
            return Status.BREAKDOWN, f"{reason} after {max(self.k, 0)} iterations"
        except TimeIsUp:
            return Status.TIME_LIMIT, "in the middle of a step"
        except KeyboardInterrupt:
            return Status.INTERRUPTED, ""

    @contextmanager
    def setting_up(self) -> Iterator[None]:
        """Count the time spent inside as set-up of the method."""
        began = self.clock()
        try:
            yield
        finally:
            self.setup_seconds += self.clock() - began

    def _next(self, stage: Stage) -> Iterate | Ending:
        """The next iterate or the ending; its time is added to the solve time."""
        began = self.clock()
        try:
            with np.errstate(over="raise", invalid="raise", divide="raise"):
                return advance(stage)
        finally:
            self.solve_seconds += self.clock() - began

    def _take(self, iterate: Iterate) -> tuple[Status, str] | None:
        """Record an iterate; returns how the run ends and why, if it ends with it."""
        self.k += 1
        self.evaluations = iterate.evaluations
        in_range = bool(np.abs(iterate.x).max() <= LARGEST_X)
        bound = self._residual_bound(iterate) if in_range else math.inf
        if in_range:
            self.last = iterate.x
            self._keep(iterate)
        if bound < self.best_bound:
            self.best_bound, self.best = bound, iterate.x
        if not self.first_bound < math.inf:
            self.first_bound = bound
        if self.observer:
            self.observer.note(iterate.method or self.method, self.k, bound)
        if in_range and self._worth_measuring(bound) and self._passes(iterate.x):
            self.best = iterate.x
            self.extra += 1
            if iterate.signs_final or self.extra > EXTRA_ITERATIONS:
                return Status.SOLVED, ""
        return self._stopping_rule(bound)

    def _stopping_rule(self, bound: float) -> tuple[Status, str] | None:
        """The first stopping rule that holds after an iterate with this residual bound, other than that it solves the
        problem: its status and the reason, "" where the status says it all."""
        if METHODS[self.method].iterates and not bound <= GROWTH_LIMIT * self.first_bound:
            return Status.DIVERGED, ""
        if self.k >= self.limits.max_iterations:
            return Status.ITERATION_LIMIT, ""
        return (Status.TIME_LIMIT, "") if self._time_is_up() else None

    def _ended(self, ending: Ending) -> tuple[Status, str]:
        """The status and the reason when the method itself ends."""
        self._note_method(ending.method)
        if isinstance(ending, NoSolution):
            return self._without_solution(ending.certificate)
        if isinstance(ending, Finished):
            return Status.STALLED, FINISHED
        if isinstance(ending, Breakdown):
            return Status.BREAKDOWN, ending.reason
        time_is_up = isinstance(ending, OutOfTime) or self._time_is_up()
        return (Status.TIME_LIMIT if time_is_up else Status.STALLED), ending.reason

    def _without_solution(self, certificate: Certificate) -> tuple[Status, str]:
        """The status that a certificate justifies; a Farkas vector is first checked against M and q."""
        if certificate.kind == "farkas":
            if certificate.vector is None or not proves_infeasible(self.problem, certificate.vector):
                return Status.STALLED, UNVERIFIED
            self.certificate = certificate
            return Status.INFEASIBLE, certificate.statement
        self.certificate = certificate
        return Status.RAY if certificate.kind == "ray" else Status.UNSOLVABLE, certificate.statement

    def _note_method(self, method: str) -> None:
        """Add a method to the route; "" is the one that was asked for."""
        method = method or self.method
        if method not in self.route:
            self.route.append(method)

    def _time_is_up(self) -> bool:
        """Whether the time is up; measuring the iterates counts too, as the user waits for that as well."""
        return self.clock() - self.began >= self.limits.time_limit

    def _worth_measuring(self, bound: float) -> bool:
        """Whether to compute the residual, which costs a product with M: if the bound is near the tolerance, and at
        k = 0, 1, 2, 4, 8, ..., in case the bound never decreases although the residual does."""
        return bound <= MEASURED_FROM * self.limits.tol or self.k & (self.k - 1) == 0

    def _residual_bound(self, iterate: Iterate) -> float:
        return self._relative_residual(iterate.x) if iterate.F is None else self.accuracy.bound(iterate.F)

    def _passes(self, x: Vector) -> bool:
        """Whether the relative residual at x is at most the tolerance."""
        if x is self._measured[0]:
            return self._measured[1] <= self.limits.tol
        return self.accuracy.passes(z_of(x), self.limits.tol)

    def _relative_residual(self, x: Vector) -> float:
        """The relative residual at x; the last one is cached."""
        if x is not self._measured[0]:
            z = z_of(x)
            self._measured = x, self.accuracy.relative_residual(z, self.accuracy.w(z))
        return self._measured[1]

    def _keep(self, iterate: Iterate) -> None:
        method = iterate.method or self.method
        for trace in self.traces:
            if trace is not None:
                pending = PendingRow(max(self.k, 0), iterate.x, self.solve_seconds, iterate.step, method)
                trace.add(pending, self.accuracy)

    def result(self, in_force: dict[str, Any], status: Status, reason: str) -> Result:
        """The result at the last iterate, or at the best. "Solved" is decided here, however the run ended: by the
        relative residual, or by exact arithmetic where z is as close to the solution as doubles allow."""
        if self.k < 0:  # interrupted before anything was kept
            self._keep(replace(self.start, x=self.last))
        for trace in self.traces:
            if trace is not None:
                trace.close(self.accuracy)
        best = self.last
        rounded = self._relative_residual(best) > self.limits.tol and is_rounded_solution(self.problem, z_of(best))
        if self.best is not best and not rounded and self._relative_residual(best) > self.limits.tol:
            best = min((best, self.best), key=self._relative_residual)
        z = z_of(best)
        w = self.accuracy.w(z)
        relative = self.accuracy.relative_residual(z, w)
        if relative <= self.limits.tol:
            status, reason = Status.SOLVED, ""
        elif rounded:
            status, reason = Status.SOLVED, f"{ROUNDED}, which leaves a relative residual of {relative:.1e}"
        elif best is not self.last:
            reason = f"{reason}; " * bool(reason) + "the best iterate is reported, not the last"
        return Result(
            problem=self.problem,
            method=self.method,
            status=status,
            message=f"{status.value}: {reason}" if reason else status.value,
            z=z,
            w=w,
            iterations=max(self.k, 0),
            evaluations=self.evaluations,
            residual=self.accuracy.natural_residual(z, w),
            relative_residual=relative,
            error=self.accuracy.error(z),
            setup_seconds=self.setup_seconds,
            solve_seconds=self.solve_seconds,
            tol=self.limits.tol,
            warm=False,
            options=in_force,
            trace=self.traces[0],
            curve=self.traces[1],
            route=tuple(self.route) or (self.method,),
            certificate=self.certificate if status is not Status.SOLVED else None,
        )
