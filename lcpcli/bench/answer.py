"""The outcome of one run of a method or of a peer, in the same terms for both and not yet verified."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from lcpcli.clock import seconds
from lcpcli.interrupts import hides_interrupt
from lcpcli.methods import variants
from lcpcli.model.problem import Problem
from lcpcli.peers import registry as peers
from lcpcli.report.wording import LEVELS
from lcpcli.solving import run as driver
from lcpcli.solving.limits import Limits
from lcpcli.solving.result import Result
from lcpcli.solving.trace import Trace
from lcpcli.typing import Vector

SOLUTION, NONE = "solution", "none"  # possible claims: z is a solution, or there is none
MOST_POINTS = 200

Curve = list[tuple[int, float, float | None]]
Milestones = list[tuple[float, int, float]]


@dataclass(frozen=True, eq=False)
class Answer:
    """The outcome of one run.

    z : shape (n,), or None.
    claim : SOLUTION, NONE, or "" if nothing is claimed.
    status, statement : how it ended, in a word and in a sentence.
    seconds : from the arrays of the problem to the answer; of methods, verified. setup_seconds : of that, until the
        first iterate; None if unknown.
    iterations, evaluations : as in `result.Result`; None if unknown.
    curve : (k, seconds, error) of the iterates or of a selection of them; empty if there are none.
    milestones : (level, k, seconds) of the first iterate with an error of each of LEVELS; None without a solution.
    """

    z: Vector | None
    claim: str
    status: str
    statement: str
    seconds: float
    setup_seconds: float | None = None
    iterations: int | None = None
    evaluations: int | None = None
    curve: Curve | None = None
    milestones: Milestones | None = None

    @property
    def times(self) -> dict[int, float]:
        """The seconds to each iterate of the curve and of the milestones, by its number."""
        return {k: passed for k, passed, _ in self.curve or ()} | {k: passed for _, k, passed in self.milestones or ()}

    def retimed(self, times: Mapping[int, float]) -> Answer:
        """This returns a copy of the answer whose curve and milestones have other times, given by iteration."""
        curve = self.curve and [(k, times[k], error) for k, _, error in self.curve]
        return replace(
            self, curve=curve, milestones=self.milestones and [(a, k, times[k]) for a, k, _ in self.milestones]
        )


class Solver(Protocol):
    """A method or a peer."""

    @property
    def name(self) -> str: ...

    @property
    def kind(self) -> str: ...

    def excludes(self, problem: Problem) -> str: ...

    def solve(self, problem: Problem, tol: float, time_limit: float, with_curve: bool) -> Answer: ...


@dataclass(frozen=True)
class Method:
    """One of METHODS, with its default options but for those in its name, as in shi:p=10."""

    name: str
    kind: str = "method"

    def excludes(self, problem: Problem) -> str:  # noqa: ARG002 (every method accepts every problem)
        return ""

    def solve(self, problem: Problem, tol: float, time_limit: float, with_curve: bool) -> Answer:
        """Raises KeyboardInterrupt if the run was interrupted."""
        nothing = np.array([], dtype=np.intp)
        known = bool(problem.solutions)
        levels = LEVELS if known else ()
        curve = Trace(1, MOST_POINTS, nothing, residuals=not known, levels=levels) if with_curve else None
        variant, limits = variants.parse(self.name), Limits(tol, time_limit=time_limit)
        options, began = variant.options, seconds()
        kept = {name: getattr(problem, name) for name in ("x0", "x1", "solutions", "lower", "upper")}
        anew = Problem(problem.M, problem.q, **kept)
        result = driver.run(anew, variant.method, limits=limits, curve=curve, conclude=False, began=began, **options)
        if result.interrupted:
            raise KeyboardInterrupt
        claim = {0: SOLUTION, 3: NONE}.get(result.status.exit_code, "")
        return Answer(
            z=result.z,
            claim=claim,
            status=result.status.word,
            statement=result.message,
            seconds=result.seconds,
            setup_seconds=result.setup_seconds,
            iterations=result.iterations,
            evaluations=result.evaluations,
            curve=_curve(result),
            milestones=_milestones(result),
        )


@dataclass(frozen=True)
class Peer:
    """One of PEERS."""

    name: str
    kind: str = "peer"

    def excludes(self, problem: Problem) -> str:
        return peers.load(self.name).excludes(problem)

    def solve(self, problem: Problem, tol: float, time_limit: float, with_curve: bool) -> Answer:  # noqa: ARG002
        """Raises KeyboardInterrupt if the run was interrupted."""
        try:
            claim = peers.load(self.name).solve(problem, tol, time_limit)
        except (ImportError, SystemError) as error:
            if hides_interrupt(error):
                raise KeyboardInterrupt from None
            raise
        status = "solved" if claim.solved else "unsolved"
        return Answer(claim.z, SOLUTION if claim.solved else "", status, claim.statement, claim.seconds)


def _curve(result: Result) -> Curve | None:
    """Error against time; the residual if no solution is known."""
    if result.curve is None:
        return None
    known = bool(result.problem.solutions)
    return [(r.k, r.seconds, r.error if known else r.residual) for r in result.curve.rows]


def _milestones(result: Result) -> Milestones | None:
    """The iterations and the time to each level."""
    if result.curve is None or not result.curve.levels:
        return None
    return [(m.level, m.k, m.seconds) for m in result.curve.milestones]
