"""The path of solutions between two problems with the same M, whose q and bounds change
linearly: its breakpoints, and how it terminates.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import OptionError, ProblemError
from lcpcli.linalg.matrices import are_equal
from lcpcli.model import views
from lcpcli.model.arrays import FROM_0
from lcpcli.model.box import WORDS, in_words
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.typing import BasisStatus, Mask, Vector

if TYPE_CHECKING:
    import os
    from fractions import Fraction

REACHED = "reached"
RETURNED = "returned"
RAY = "ray"
TURN = "turn"
BREAKPOINT_LIMIT = "breakpoint_limit"
TIME_LIMIT = "time_limit"
INTERRUPTED = "interrupted"
BREAKDOWN = "breakdown"
UNSOLVED, INFEASIBLE = "unsolved", "infeasible"
ROWS = "; each row of a program has one side in both, or two, or is an equation in both"
OTHER_M = ("differs between the two problems", f"give two problems with one M{ROWS}")
ENDS = {
    REACHED: "the path reaches the second problem",
    RETURNED: "the path returns to the first problem, at another solution of it",
    RAY: (
        "the path terminates on a ray, along which z grows without bound at constant t"
    ),
    TURN: "turning point: the path continues with t decreasing",
    BREAKPOINT_LIMIT: "stopped at the limit of breakpoints",
    TIME_LIMIT: "stopped at the time limit",
    INTERRUPTED: "interrupted",
    BREAKDOWN: "broke down",
    UNSOLVED: "no solution of the first problem was computed",
    INFEASIBLE: "the first problem is proved to have no solution",
}


class StateChange(NamedTuple):
    """A change of basis at a breakpoint: component `index`, and its basis status before
    and after, lower, basic or upper.
    """

    index: int  # type: ignore[assignment]  # instead of the method of tuples
    before: str
    after: str


class ExactPath(NamedTuple):
    """The breakpoints in fractions: t of length m, and z and w of each, of length n."""

    t: list[Fraction]
    z: list[list[Fraction]]
    w: list[list[Fraction]]


@dataclass(frozen=True, eq=False, repr=False)
class Path:
    """The solutions z(t) of the problems with the data (1 - s) FROM + s TO, where t = a
    + s (b - a).

    On a piece, that is between two breakpoints, z and w are linear in t; consecutive
    pieces join. Unless M is a P-matrix, a problem may have other solutions that are not
    on the path.

    problem, to : the two problems, with the same M.
    t : shape (m,), the parameter at the breakpoints in the order of the path, starting
        with a. It increases up to a turning point, and stays constant at a jump, where
        z moves from one solution of a problem to another.
    z, w : shape (m, n), the solutions at the breakpoints, and w = M z + q.
    states : shape (m - 1, n), the basis status of each component on each piece: -1 at
        the lower bound, 0 basic, where w = 0, and 1 at the upper bound.
    end : why the path terminates, a key of `ENDS`; `message` says it in a sentence.
    verified : whether each breakpoint solves its problem, by the criterion of `solve`
        for the same tolerance, and both endpoints of each piece satisfy the conditions
        of its basis, so that every point between them solves its problem too, as the
        module `verified` explains. If `exact` is there, this is verified in fractions.
    direction : the direction of z, shape (n,), if the path terminates on a ray; else
        None.
    certificate : a vector y of shape (n,), as in `Proof`, if it terminates on a ray and
        y proves that the second problem has no solution, or if `end` is "infeasible"
        and y proves that the first one has none; otherwise None.
    exact : the breakpoints in fractions, if requested; otherwise None.
    seconds : the time from the problems in memory to the verified path.

    >>> import lcpcli
    >>> first, second = (lcpcli.Problem([[2]], [q]) for q in (1, -1))
    >>> lcpcli.path(first, second)  # doctest: +NORMALIZE_WHITESPACE
    <Path for t from 0 to 1: the path reaches the second problem; 3 breakpoints,
     verified>
    """

    family: Family
    t: Vector
    z: Vector
    w: Vector
    states: BasisStatus
    end: str
    message: str
    verified: bool
    seconds: float
    direction: Vector | None = None
    certificate: Vector | None = None
    exact: ExactPath | None = None

    @property
    def problem(self) -> Problem:
        return self.family.problem

    @property
    def to(self) -> Problem:
        return self.family.to

    @property
    def reached(self) -> bool:
        """Return whether the path reaches the second problem."""
        return self.end == REACHED

    @property
    def complete(self) -> bool:
        """Return whether the path is verified and was not stopped by a limit or an
        error: it leads to the second problem, back to the first one, to a turning point
        or to a ray.
        """
        return self.verified and self.end in (REACHED, RETURNED, RAY, TURN)

    @property
    def basis(self) -> list[list[str]]:
        """Return the basis status of the components on each piece, in words as in
        `Result.basis`.
        """
        return [in_words(piece) for piece in self.states]

    @cached_property
    def changes(self) -> list[list[StateChange]]:
        """Return the changes of basis at each breakpoint except the first and the last,
        m - 2 lists. A list may be empty, or have several changes if pieces of zero
        length have been left out.
        """
        return [
            [
                StateChange(i, WORDS[before[i]], WORDS[after[i]])
                for i in np.flatnonzero(before != after).tolist()
            ]
            for before, after in pairwise(self.states)
        ]

    @cached_property
    def jumps(self) -> Sequence[int]:
        """Return the pieces on which t is constant."""
        jumps: list[int] = np.flatnonzero(np.diff(self.t) == 0).tolist()
        return jumps

    def __getitem__(self, name: str) -> Vector:
        """Return the component of z with this name at the breakpoints, shape (m,), as
        `Result` does."""
        with imports:
            from lcpcli.model.words import component
        return component(self.problem, name, self.z)

    @np.errstate(all="ignore")
    def __call__(self, t: float) -> Vector:
        """Return z(t), shape (n,). If the path passes t several times, or is constant
        in t there, return all its points, and the endpoints of the segments on which t
        is constant, shape (k, n).
        """
        points = [
            z for piece in range(self.t.size - 1) for z in self._on_piece(piece, t)
        ]
        if self.t.size == 1 and t == self.t[0]:
            points = [self.z[0]]
        if not points:
            span = (
                f"from {self.t.min():g} to {self.t.max():g}"
                if self.t.size
                else "nowhere"
            )
            raise OptionError(
                "t", f"is {t:g}, and the path is known {span}", "give a t there"
            )
        different = [
            z
            for k, z in enumerate(points)
            if not any(np.array_equal(z, other) for other in points[:k])
        ]
        return different[0] if len(different) == 1 else np.array(different)

    def _on_piece(self, k: int, t: float) -> list[Vector]:
        """Return z(t) on piece k, both endpoints if t is constant on it, none if the
        piece does not contain t."""
        first, last = self.t[k : k + 2]
        if not min(first, last) <= t <= max(first, last):
            return []
        if t in (first, last):
            return [
                z
                for endpoint, z in zip((first, last), self.z[k : k + 2], strict=True)
                if t == endpoint
            ]
        share = (t - first) / (last - first)
        return [(1 - share) * self.z[k] + share * self.z[k + 1]]

    def to_dict(self) -> dict[str, Any]:
        """Return the object that `lcp path --format json` writes."""
        return dict(views.path_formats.data(self))

    def plot(
        self, file: str | os.PathLike[str] | None = None, show: Sequence[str] = ()
    ) -> Any:
        """Draw z_i(t), and for a program the objective, in a `Picture`, as
        `lcpcli.plot` does for results.

        show : the names of the unknowns to draw, or of a program's multipliers; *
        matches any text. By default all unknowns that are not always 0 are drawn; for a
        program, only x.
        """
        return views.plotting.plot_path(self, file, show)

    def __repr__(self) -> str:
        return str(views.path_formats.line(self))


class Family:
    """The problems with the data (1 - s) FROM + s TO, where t = a + s (b - a), 0 <= s
    <= 1.

    problem, to : the problems FROM and TO. Raises ProblemError unless they have the
        same M and the same finite bounds, up to the values of these.
    start, stop : a and b, two numbers, a < b, otherwise it raises OptionError. is_mixed
        : whether one of the problems is a mixed problem.
    """

    def __init__(
        self, problem: Problem, to: Problem, start: float = 0.0, stop: float = 1.0
    ) -> None:
        if not (math.isfinite(start) and math.isfinite(stop) and start < stop):
            raise OptionError(
                "start",
                f"is {start:g}, and stop {stop:g}",
                "give finite numbers, start < stop",
            )
        _refuse_different(problem, to)
        self.problem = problem
        self.to = to
        self.start = start
        self.stop = stop
        self.is_mixed, self._last = problem.is_mixed or to.is_mixed, (start, problem)
        first, last = conditions_of(problem), conditions_of(to)
        self._bounds = (first.lower, last.lower), (first.upper, last.upper)

    def share(self, t: Any) -> Any:
        """Return s for t, a number or an array."""
        return (t - self.start) / (self.stop - self.start)

    def q(self, share: Vector | float) -> Vector:
        """Return q at s, exactly that of the two problems at s = 0 and s = 1; for s of
        shape (m, 1), of shape (m, n).
        """
        return _between(self.problem.q, self.to.q, share)

    def bounds(self, share: Vector | float) -> tuple[Vector, Vector]:
        """Return l and u at s, with the shapes of q."""
        low, high = (_between(*lower_upper, share) for lower_upper in self._bounds)
        return low, high

    def sizes_of_moving_bounds(self, share: float) -> Vector:
        """Return the size of the terms (1 - s) l_0 and s l_1 of each bound that moves,
        or of its upper one if that is larger; otherwise 0."""
        sizes = np.zeros(self.problem.n)
        for first, last in self._bounds:
            terms = (1 - share) * np.abs(first) + share * np.abs(last)
            sizes = np.where(first == last, sizes, np.maximum(sizes, terms))
        return sizes

    @cached_property
    def is_fixed(self) -> Mask:
        """Return where both bounds are equal on the whole path, so that w_i may have
        any sign.
        """
        (low, last_low), (high, last_high) = self._bounds
        return np.asarray((low == high) & (last_low == last_high))

    def at(self, t: float) -> Problem:
        """Return the problem at t, with its numbers rounded to double precision; it
        shares cached facts and factors of M with the others.
        """
        if self._last[0] != t:
            share, before = self.share(t), self._last[1]
            low, high = self.bounds(share) if self.is_mixed else (0.0, np.inf)
            problem = Problem(
                self.problem.M, self.q(share), self.problem.name, lower=low, upper=high
            )
            cached = {"facts": before.facts, "latest": before.latest}
            self._last = (t, problem.having(**cached))
        return self._last[1]


def _between(first: Vector, last: Vector, share: Vector | float) -> Vector:
    """Return (1 - share) first + share last; equal numbers, among them infinite ones,
    unchanged.
    """
    same = first == last
    with np.errstate(invalid="ignore"):
        moved: Vector = (1 - share) * first + share * last
    return np.where(same, first, moved)


def _refuse_different(problem: Problem, to: Problem) -> None:
    """Raise ProblemError unless two problems differ only in q and values of bounds."""
    if problem.n != to.n:
        raise ProblemError(
            "n",
            f"is {problem.n} and {to.n}",
            f"give two problems with the same unknowns{ROWS}",
        )
    if not are_equal(problem.M, to.M):
        raise ProblemError("M", *OTHER_M)
    first, last = conditions_of(problem), conditions_of(to)
    for field in ("lower", "upper"):
        differs = np.isfinite(getattr(first, field)) != np.isfinite(
            getattr(last, field)
        )
        for i in np.flatnonzero(differs)[:1].tolist():
            reason = "is finite in one problem and infinite in the other"
            raise ProblemError(
                f"{field}[{i}]",
                reason,
                f"give bounds that are finite in both or in neither {FROM_0}",
            )
