"""One call from two problems to the path of solutions between them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from fractions import Fraction
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from lcpcli.clock import seconds
from lcpcli.interrupts import TimeIsUp, check, within
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.model.problem import Problem, as_problem
from lcpcli.options import MAX_BREAKPOINTS, TIME_LIMIT, TOL, Limits
from lcpcli.options import check as check_options
from lcpcli.parametric import path as ends
from lcpcli.parametric.edges import Edge
from lcpcli.parametric.exact_pivoting import ExactEdge, ExactFamily, ExactPivoting
from lcpcli.parametric.family import Family
from lcpcli.parametric.path import ENDS, ExactPath, Path, joined
from lcpcli.parametric.pivoting import Pivoting
from lcpcli.parametric.start import basic_states
from lcpcli.parametric.verified import Verified, verify
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import rounded
from lcpcli.solving import driver
from lcpcli.solving.result import Result, Status
from lcpcli.typing import States, Vector
from lcpcli.verify.certificate import proof

Data: TypeAlias = tuple[ExactProblem, ExactProblem]
MOST_NUMBERS = 2**26  # of z on a path in memory: with those of w one GiB
FILL = "fill the memory for a path; lcp path writes csv and json of any length as they are found"
MOST_AT_ONCE, LEAST_AT_ONCE = 1_000_000, 8  # entries of z, and breakpoints, that are verified together
MOST_POINTS = 10_000  # pivots at one vertex, where ties are broken: more mean that rounding has misled them


@np.errstate(all="ignore")
def path(
    problem: Problem,
    to: Problem,
    *,
    start: float = 0.0,
    stop: float = 1.0,
    tol: float | None = None,
    turns: bool = False,
    max_breakpoints: int | None = None,
    time_limit: float | None = None,
    exact: bool = False,
) -> Path:
    """Follow the solutions from a problem to another one with the same M: parametric principal pivoting.

    Parameters
    ----------
    problem, to : two Problems with the same M, and bounds that are finite in both or in neither.
    start, stop : the values of t at the two problems, start < stop.
    tol : the largest relative residual with which a point counts as a solution, 1e-10 by default.
    turns : whether to go on where the path turns, with t decreasing.
    max_breakpoints, time_limit : the breakpoints and the seconds after which to stop, by default 100000 and no limit.
    exact : whether to compute the breakpoints in fractions, and to prove each piece, the doubles taken as they are.

    Returns
    -------
    Path : its breakpoints t, z and w, how it ends, and whether it is verified; `path(t)` gives z at t. Where the path
        is interrupted, or at a limit, it is the part up to there.

    Raises
    ------
    ProblemError : the problems differ in more than q and the values of bounds.
    OptionError : an option is out of range.

    Examples
    --------
    >>> import lcpcli
    >>> first, last = (lcpcli.Problem([[2, 1], [1, 2]], q) for q in ([1, 1], [-5, -6]))
    >>> path = lcpcli.path(first, last)
    >>> path.t.round(6).tolist(), path.end, path.verified
    ([0.0, 0.142857, 0.2, 1.0], 'reached', True)
    >>> path(0.6).round(6).tolist()
    [0.666667, 1.266667]
    """
    as_problem(problem), as_problem(to)

    def data() -> Data:
        first = ExactProblem.of_floats(problem)
        return first, first.with_vectors_of(to)

    given: dict[str, Any] = {"tol": tol, "max_breakpoints": max_breakpoints, "time_limit": time_limit}
    return follow(Family(problem, to, start, stop), turns, data if exact else None, **given)


def follow(
    family: Family,
    turns: bool = False,
    read: Callable[[], Data] | None = None,
    take: Callable[[Path], object] | None = None,
    **given: Any,
) -> Path:
    """Return the path, in fractions if `read` returns both problems with their numbers as written; `given` are options
    of `path`, None where they are not given.

    take : called for one verified part of the path after another as it is found, so that a path of any length needs
        little memory. The next part, and then the path that is returned, begins with the last two breakpoints of the
        part before. By default all parts are kept, and the whole path is returned.
    """
    began = seconds()
    check_options((TOL, MAX_BREAKPOINTS, TIME_LIMIT), given)
    own = {name: value for name, value in given.items() if value is not None}
    most = int(own.pop("max_breakpoints", MAX_BREAKPOINTS.value))
    if take is not None:
        return _Following(family, Limits(**own), most, turns, read, take).path(began)
    parts: list[Path] = []
    room = max(MOST_NUMBERS // family.problem.n, 2)
    last = _Following(family, Limits(**own), min(most, room), turns, read, parts.append).path(began)
    if last.end == ends.BREAKPOINT_LIMIT and room < most:
        last = replace(last, message=f"{last.message}: {room} with {family.problem.n} unknowns {FILL}")
    return joined([*parts, last])


class _End(NamedTuple):
    """How a path ends: a key of ENDS, a sentence, and the last edge where it is a ray."""

    end: str
    message: str
    ray: Edge | ExactEdge | None = None


class _Point(NamedTuple):
    """A breakpoint: s and z; for a path in fractions also w; and the states on the piece before, None for the first."""

    s: Any
    z: Any
    w: Any
    states: States | None


class _Following:
    """One run along a path. What is known of it survives an interruption.

    read : returns both problems in fractions, for an exact path; else None. take : as for `follow`.
    """

    def __init__(
        self,
        family: Family,
        limits: Limits,
        most: int,
        turns: bool,
        read: Callable[[], Data] | None,
        take: Callable[[Path], object],
    ) -> None:
        self.family, self.limits, self.most, self.turns, self.read, self.take = family, limits, most, turns, read, take
        self.exact: ExactFamily | None = None
        self.points: list[_Point] = []  # that no part has yet but for the first ones, which are verified
        self.known: Verified | None = None  # those
        self.count, self.is_verified = 0, True
        self.end = _End(ends.INTERRUPTED, ENDS[ends.INTERRUPTED])

    def path(self, began: float) -> Path:
        """Follow the path and verify it; return its last part."""
        result: Result | None = None
        try:
            with within(self.limits.time_limit), np.errstate(all="ignore"):  # overflow is found where it matters
                if self.read is not None:
                    self.exact = ExactFamily(*self.read())
                result = driver.run(self.family.problem, "auto", limits=self.limits, conclude=False)
                self.end = self._from(result) if result.solved else _unsolved(result)
        except TimeIsUp:
            self.end = _End(ends.TIME_LIMIT, ENDS[ends.TIME_LIMIT])
        except KeyboardInterrupt:
            pass
        except SingularMatrix:
            self.end = _End(ends.BREAKDOWN, f"{ENDS[ends.BREAKDOWN]}: a basis is too ill-conditioned")
        certificate = result.certificate.vector if result is not None and result.certificate is not None else None
        return self._concluded(certificate, began)

    def _from(self, result: Result) -> _End:
        """Follow the path from a solution of the first problem; return how it ends."""
        states = basic_states(self.family.problem, result.z, result.w, self.family.is_fixed)
        if states is None:
            return _End(ends.UNSOLVED, f"{ENDS[ends.UNSOLVED]} whose basic variables it determines")
        if self.exact is None:
            pivoting = Pivoting(self.family, states)
            return self._along(0.0, pivoting.z * pivoting.C, pivoting.edges())
        exactly = ExactPivoting(self.exact, states)
        if not exactly.is_feasible:
            return _End(ends.UNSOLVED, f"{ENDS[ends.UNSOLVED]}: rounding has led to another basis")
        return self._along(*exactly.vertex(), exactly.edges())

    def _along(self, s: Any, z: Any, edges: Iterable[Edge | ExactEdge]) -> _End:
        """Follow the path from its first point; return how it ends."""
        self._add(s, z, None)
        points = 0
        for edge in edges:
            check()
            if edge.is_ray:
                return _End(ends.RAY, ENDS[ends.RAY], edge)
            if edge.rise < 0 and not edge.is_point and not self.turns:
                return _End(ends.TURN, ENDS[ends.TURN])
            points = points + 1 if edge.is_point else 0
            if points > MOST_POINTS:
                return _End(ends.BREAKDOWN, f"{ENDS[ends.BREAKDOWN]}: ties are not resolved in double precision")
            if isinstance(edge, Edge) and not np.isfinite(edge.z).all():
                return _End(ends.BREAKDOWN, f"{ENDS[ends.BREAKDOWN]}: z is too large for double precision")
            self._append(edge)
            if edge.is_last:
                last = ends.REACHED if edge.s else ends.RETURNED if self.count > 1 else ends.TURN
                return _End(last, ENDS[last])
            if self.count > self.most:
                break
        return _End(ends.BREAKPOINT_LIMIT, ENDS[ends.BREAKPOINT_LIMIT])

    def _append(self, edge: Edge | ExactEdge) -> None:
        """Add the vertex at the end of an edge; if the edge has no length, only the end of the path counts."""
        last = self.points[-1]
        s = last.s if edge.rise == 0 else edge.s  # rounding may have moved it
        if not edge.is_point:
            self._add(s, edge.z, edge.states)
        elif edge.is_last:
            self.points[-1] = self._point(s, edge.z, last.states)

    def _add(self, s: Any, z: Any, states: States | None) -> None:
        """Add a breakpoint; verify those before if there are many."""
        self.points.append(self._point(s, z, states))
        self.count += 1
        if len(self.points) * self.family.problem.n >= MOST_AT_ONCE and len(self.points) > LEAST_AT_ONCE:
            t = [self.family.t_of(float(point.s)) for point in self.points]
            some = next((k for k in range(len(t) - 1, 0, -1) if t[k] != t[k - 1]), 0)  # the others have the last t
            if some > LEAST_AT_ONCE // 2:
                self.take(self._part(some))

    def _point(self, s: Any, z: Any, states: States | None) -> _Point:
        own = None if states is None else states.astype(np.int8)
        return _Point(s, z, None if self.exact is None else self.exact.w(s, z), own)

    def _part(self, some: int) -> Path:
        """Return some of the points as a part of the path, verified, and keep the last two of them."""
        states = np.array([point.states for point in self.points[1:]], dtype=np.int8).reshape(-1, self.family.problem.n)
        exact, own = self._proved(states, some) if self.exact is not None else (None, self._verified(states, some))
        self.is_verified &= own.is_verified
        first = max(some - 2, 0)
        self.points, self.known = self.points[first:], own._replace(t=own.t[first:], z=own.z[first:])
        end, message, _ = self.end
        return Path(
            self.family, own.t, own.z, own.w, states[: some - 1], end, message, self.is_verified, 0.0, exact=exact
        )

    def _verified(self, states: States, some: int) -> Verified:
        """Return some of the points as far as they are verified."""
        family = self.family
        t = np.array([family.t_of(float(point.s)) for point in self.points])
        z = np.array([point.z for point in self.points])
        known = 0
        if self.known is not None:
            known = self.known.t.size
            t[:known], z[:known] = self.known.t, self.known.z
        return verify(family, t, z, states, self.limits.tol, known, some)

    def _proved(self, states: States, some: int) -> tuple[ExactPath, Verified]:
        """Return some of the points in fractions, and rounded, and whether both ends of each piece satisfy its
        conditions."""
        family, exact, points = self.family, self.exact, self.points[:some]
        assert exact is not None
        proved = all(
            exact.satisfies(piece, *end[:3])
            for piece, *both in zip(states, points, points[1:], strict=False)
            for end in both
        )
        start, stop = Fraction(family.start), Fraction(family.stop)
        own = ExactPath(
            [start + point.s * (stop - start) for point in points], [p.z for p in points], [p.w for p in points]
        )
        z, w = (np.array([rounded(row) for row in rows]).reshape(some, -1) for rows in own[1:])
        return own, Verified(np.array([family.t_of(float(point.s)) for point in points]), z, w, proved)

    def _concluded(self, certificate: Vector | None, began: float) -> Path:
        """Return the last part of the path with its end."""
        message, direction = self.end.message, None
        if self.points:
            last = self._part(len(self.points))
        else:
            none = np.zeros((0, self.family.problem.n))
            exact = ExactPath([], [], []) if self.exact is not None else None
            last = Path(self.family, np.zeros(0), none, none, none.astype(np.int8), "", "", False, 0.0, exact=exact)
        if self.end.ray is not None:
            direction = np.array(self.end.ray.z, dtype=float)
            certificate = _proof(self.family.to, self.end.ray)
            if certificate is not None:
                message += "; the second problem is proved to have no solution"
        return replace(
            last,
            end=self.end.end,
            message=message,
            seconds=seconds() - began,
            direction=direction,
            certificate=certificate,
        )


def _unsolved(result: Result) -> _End:
    """Return the end of a path that cannot begin."""
    if result.status in (Status.INFEASIBLE, Status.UNSOLVABLE):
        return _End(ends.INFEASIBLE, f"the first problem {result.message}")
    if result.interrupted:
        return _End(ends.INTERRUPTED, ENDS[ends.INTERRUPTED])
    if result.status is Status.TIME_LIMIT:
        return _End(ends.TIME_LIMIT, ENDS[ends.TIME_LIMIT])
    return _End(ends.UNSOLVED, f"{ENDS[ends.UNSOLVED]}: {result.message}")


def _proof(to: Problem, ray: Edge | ExactEdge) -> Vector | None:
    """Return a vector that proves the second problem infeasible, from the direction of a ray, or from the multipliers
    of its rows, which are a proof if t is at its largest over all solutions of the inequalities; else None."""
    candidates = [np.array(ray.z, dtype=float)]
    if isinstance(ray, Edge):
        assert ray.multipliers is not None
        candidates += [ray.multipliers, -ray.multipliers]
    return next((found for y in candidates if (found := proof(to, y)) is not None), None)
