"""What a solve comes to: its status, its numbers and, where it was asked for, its trace."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.certificate import Certificate
from lcpcli.problem import Problem
from lcpcli.typing import Indices, Vector

if TYPE_CHECKING:
    from fractions import Fraction


class Status(Enum):
    """How a solve ended. The value is what the user reads; `word` is what JSON and scripts read."""

    SOLVED = "solved"
    ITERATION_LIMIT = "stopped at the iteration limit"
    TIME_LIMIT = "stopped at the time limit"
    STALLED = "stalled"
    DIVERGED = "diverged"
    BREAKDOWN = "broke down"
    INFEASIBLE = "proved to have no solution, not even z >= 0 with Mz + q >= 0"
    UNSOLVABLE = "proved to have no solution"
    RAY = "ended in a ray"
    INTERRUPTED = "interrupted"

    @property
    def word(self) -> str:
        return self.name.lower()

    @property
    def exit_code(self) -> int:
        """0 solved, 1 not solved, 3 proved to have no solution, 130 interrupted (as shells report SIGINT)."""
        return {"SOLVED": 0, "INFEASIBLE": 3, "UNSOLVABLE": 3, "INTERRUPTED": 130}.get(self.name, 1)


@dataclass(frozen=True, eq=False)
class TraceRow:
    """One iterate in a trace.

    k : its number; the start is 0.
    z : its z = |x| + x, shape (n,), or the components that the trace was asked to keep.
    residual, error : as in Result; None where they were not asked for, or no solution is known.
    seconds : time that the method took from the end of its set-up to this iterate, nothing else counted.
    step : the step of the published algorithm that made it; "" if the method has but one.
    method : the method that made it.
    """

    k: int
    z: Vector
    residual: float | None
    error: float | None
    seconds: float
    step: str
    method: str


@dataclass(frozen=True, eq=False)
class Passing:
    """An iterate that may yet leave the trace, and has not been measured: its number, x, seconds, step and method."""

    k: int
    x: Vector
    seconds: float
    step: str
    method: str


Measure = Callable[["Trace", Passing], TraceRow]


@dataclass
class Trace:
    """Which iterates to keep and what of them; it fills while the method runs, and holds its rows in order.

    every : keep the start, the first, every so-many-th and the last three iterates.
    most : where that comes to more rows than this, `every` is doubled, and again; None sets no limit.
    components : indices of the components of z to keep; None keeps them all.
    residuals : whether each row's residual is read by anybody; each costs one product with M.
    """

    every: int = 1
    most: int | None = None
    components: Indices | None = None
    residuals: bool = True
    rows: list[TraceRow] = field(default_factory=list)
    _last: list[Passing] = field(default_factory=list)

    def add(self, passing: Passing, measure: Measure) -> None:
        """Take one more iterate; the one that is no longer among the last three is measured if it stays."""
        self._last.append(passing)
        if len(self._last) > 3:
            leaving = self._last.pop(0)
            if self._stays(leaving.k):
                self.rows.append(measure(self, leaving))
        if self.most is not None and len(self.rows) + 3 > self.most:
            self.every *= 2
            self.rows = [row for row in self.rows if self._stays(row.k)]

    def close(self, measure: Measure) -> None:
        """The run has ended: the last three stay."""
        self.rows += [measure(self, passing) for passing in self._last]
        self._last.clear()

    def _stays(self, k: int) -> bool:
        return k <= 1 or k % self.every == 0


@dataclass(frozen=True, eq=False)
class Exact:
    """What rational arithmetic says of a problem whose decimals are taken as they are written.

    status : solved, infeasible or unsolvable; None where nothing was proved.
    proof : how it is proved, as a clause for the user.
    z, w : the solution and w = M z + q, each of length n, where it is solved; else None.
    y : of length n, a Farkas vector, where it is infeasible; else None.
    """

    status: Status | None
    proof: str
    z: list[Fraction] | None = None
    w: list[Fraction] | None = None
    y: list[Fraction] | None = None


@dataclass(frozen=True, eq=False)
class Result:
    """The outcome of one method on one problem. A failed result still carries its best iterate and its trace.

    status, message : how it ended, in one word and in one sentence.
    z, w : the best iterate and w = M z + q, each of shape (n,), in the problem's units.
    iterations, evaluations : iterations done; evaluations of F, or of its smoothed form, in them.
    residual, relative_residual, error : as defined in `accuracy.Accuracy`, recomputed from M and q; error is None
        where no solution is known.
    setup_seconds, solve_seconds : until the first iterate, and from there to the last.
    options : the method's options that were in force.
    trace : the rows kept, or None if none were asked for.
    route : the methods that took part, in order.
    certificate : the proof that there is no solution, or the ray on which Lemke's method ended; else None.
    exact : what has been proved exactly, or None if that was not asked for.
    """

    problem: Problem
    method: str
    status: Status
    message: str
    z: Vector
    w: Vector
    iterations: int
    evaluations: int
    residual: float
    relative_residual: float
    error: float | None
    setup_seconds: float
    solve_seconds: float
    options: dict[str, Any]
    trace: Trace | None
    route: tuple[str, ...]
    certificate: Certificate | None
    exact: Exact | None = None

    @property
    def exit_code(self) -> int:
        """That of the status, but 1 where an exact proof was asked for and not found."""
        unproved = self.exact is not None and self.exact.status is None
        return 1 if unproved and not self.interrupted else self.status.exit_code

    @property
    def solved(self) -> bool:
        return self.status is Status.SOLVED

    @property
    def interrupted(self) -> bool:
        return self.status is Status.INTERRUPTED


def z_of(x: Vector) -> Vector:
    """z = |x| + x = 2 max(x, 0)."""
    z: Vector = np.maximum(x, 0.0)
    z += z
    return z


def x_of(z: Vector, w: Vector) -> Vector:
    """The x = (z - w) / 2 with z = |x| + x and w = |x| - x, where z, w >= 0 and z'w = 0.

    Where rounding leaves both of a pair away from 0, the smaller one counts as 0: z and w of a solution then come
    back as they are, and not each with the other's error.
    """
    return np.where(z > w, z, -w) / 2
