"""One call from two problems to the path of solutions between them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
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
from lcpcli.parametric.parts import Parts
from lcpcli.parametric.path import ENDS, Path, joined
from lcpcli.parametric.pivoting import Pivoting
from lcpcli.parametric.start import basic_states
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.solving import driver
from lcpcli.solving.result import Result, Status
from lcpcli.typing import Vector
from lcpcli.verify.certificate import proof

Data: TypeAlias = tuple[ExactProblem, ExactProblem]
MOST_NUMBERS = 2**26  # of z on a path in memory: with those of w one GiB
FILL = "fill the memory for a path; follow it in several spans of t, with --from and --to"
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
    problem, to : two Problems with the same M; each bound is finite in both or in neither.
    start, stop : the values of t at the two problems, start < stop.
    tol : the largest relative residual at which a point counts as a solution, 1e-10 by default.
    turns : whether to continue with decreasing t where the path turns.
    max_breakpoints, time_limit : the breakpoints and seconds after which to stop, by default 100000 and no limit.
    exact : whether to compute the breakpoints in fractions and to prove each piece, with the doubles taken as exact.

    Returns
    -------
    Path : its breakpoints t, z and w, how it ends, and whether it is verified; `path(t)` gives z at t. If the path is
        interrupted or reaches a limit, this is the part up to there.

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
    **given: Any,
) -> Path:
    """Return the path, in fractions if `read` is given, which returns both problems with their numbers as written;
    `given` are options of `path`, None where they are not given."""
    began = seconds()
    check_options((TOL, MAX_BREAKPOINTS, TIME_LIMIT), given)
    own = {name: value for name, value in given.items() if value is not None}
    most = int(own.pop("max_breakpoints", MAX_BREAKPOINTS.value))
    limits = Limits(**own)
    parts = Parts(family, limits.tol)
    room = max(MOST_NUMBERS // max(1, family.problem.n), 2)
    last = _Following(parts, limits, min(most, room), turns, read).path(began)
    if last.end == ends.BREAKPOINT_LIMIT and room < most:
        last = replace(last, message=f"{last.message}: {room} with {family.problem.n} unknowns {FILL}")
    return joined([*parts.found, last])


class _End(NamedTuple):
    """How a path ends: a key of ENDS, a sentence, and the last edge where it is a ray."""

    end: str
    message: str
    ray: Edge | ExactEdge | None = None


class _Following:
    """One run along a path. What is known of it survives an interruption.

    read : returns both problems in fractions, for an exact path; else None.
    """

    def __init__(self, parts: Parts, limits: Limits, most: int, turns: bool, read: Callable[[], Data] | None) -> None:
        self.parts, self.family, self.limits, self.most, self.turns = parts, parts.family, limits, most, turns
        self.read = read
        self.end = _End(ends.INTERRUPTED, ENDS[ends.INTERRUPTED])

    def path(self, began: float) -> Path:
        """Follow the path and verify it; return its last part."""
        result: Result | None = None
        try:
            with within(self.limits.time_limit), np.errstate(all="ignore"):  # overflow is found where it matters
                if self.read is not None:
                    self.parts.exact = ExactFamily(*self.read())
                result = driver.run(self.family.problem, "auto", limits=self.limits)
                if result.interrupted:
                    raise KeyboardInterrupt
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
        if self.parts.exact is None:
            pivoting = Pivoting(self.family, states)
            return self._along(0.0, pivoting.units.z_outside(pivoting.z), pivoting.edges())
        exactly = ExactPivoting(self.parts.exact, states)
        if not exactly.is_feasible:
            return _End(ends.UNSOLVED, f"{ENDS[ends.UNSOLVED]}: rounding has led to another basis")
        return self._along(*exactly.vertex(), exactly.edges())

    def _along(self, s: Any, z: Any, edges: Iterable[Edge | ExactEdge]) -> _End:
        """Follow the path from its first point; return how it ends."""
        self.parts.add(s, z, None)
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
                last = ends.REACHED if edge.s else ends.RETURNED if self.parts.count > 1 else ends.TURN
                return _End(last, ENDS[last])
            if self.parts.count > self.most:
                break
        return _End(ends.BREAKPOINT_LIMIT, ENDS[ends.BREAKPOINT_LIMIT])

    def _append(self, edge: Edge | ExactEdge) -> None:
        """Add the vertex at the end of an edge; if the edge has no length, only the end of the path counts."""
        s = self.parts.last.s if edge.rise == 0 else edge.s  # rounding may have moved it
        if not edge.is_point:
            self.parts.add(s, edge.z, edge.states)
        elif edge.is_last:
            self.parts.replace_last(s, edge.z)

    def _concluded(self, certificate: Vector | None, began: float) -> Path:
        """Return the last part of the path with its end."""
        message, direction = self.end.message, None
        last = self.parts.rest()
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
    if result.status.has_no_solution:
        return _End(ends.INFEASIBLE, f"the first problem {result.message}")
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
