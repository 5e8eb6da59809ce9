"""The path of solutions between two problems with the same M: `lcpcli.path`.

A run solves the first problem, moves along the solutions to one with a nonsingular
basis, and follows the path by parametric pivoting. The breakpoints are verified in
groups while the path is followed, so that the part that is known survives an
interruption.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from lcpcli.clock import seconds
from lcpcli.interrupts import (
    TimeIsUp,
    deadline_after,
    deferring_signals,
    raise_if_timed_out,
)
from lcpcli.linalg.doubles import generator
from lcpcli.linalg.factors import SingularMatrix, checked_solver, finite
from lcpcli.linalg.matrices import dense, product
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.model.changes import scale
from lcpcli.model.problem import Problem, as_problem
from lcpcli.options import MAX_BREAKPOINTS, TIME_LIMIT, TOL, Limits
from lcpcli.options import check as check_options
from lcpcli.parametric import path as terminations
from lcpcli.parametric.path import ENDS, ExactPath, Family, Path
from lcpcli.parametric.pivoting import Edge, ExactFamily, ExactPivoting, Pivoting
from lcpcli.parametric.verified import Breakpoints, verify
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import rounded
from lcpcli.solving import driver
from lcpcli.solving.result import Result, Status
from lcpcli.typing import BasisStatus, Mask, Matrix, Vector
from lcpcli.verify.certificate import first_proof

# A singular value of a basis below this, relative to the largest one, is considered 0.
SINGULAR = 2.0**-40
# A basis is nonsingular if a system with a known solution is solved with this relative
# error: a third of the digits are correct.
RECOVERED = 2.0**-16
# Changes below this, relative to the largest one, are considered 0.
ROUNDING_RTOL = 2.0**-40


def basic_states(
    problem: Problem, z: Vector, w: Vector, is_fixed: Mask
) -> BasisStatus | None:
    """Return a basis at which the problem has a solution and M_BB is nonsingular, shape
    (n,); None if the solutions close to z contain a line.

    is_fixed : where both bounds are equal on the whole path.

    A solution z with singular M_BB is moved along a null vector of M_BB, which keeps
    w_B = 0, until another component reaches a bound or its w reaches 0, as a point is
    moved to a vertex of its polyhedron.
    """
    basis = problem.box.basis_at(z, w)
    basis[problem.box.fixed] = np.where(w[problem.box.fixed] < 0, UPPER, LOWER)
    basis[is_fixed] = LOWER
    units = scale(problem)
    low, high = units.problem.box.vectors(problem.n)
    z, w = units.z_inside(z), units.w_inside(w)
    for _ in range(4 * problem.n + 1):
        raise_if_timed_out()
        null = _null_vector(units.problem.M, basis)
        if null is None:
            return basis
        basic = basis == BASIC
        change = product(units.problem.M, null)
        gaps = np.where(basic, null, np.where(basis == UPPER, -change, change))
        gaps[is_fixed] = 0.0
        gaps[np.abs(gaps) <= ROUNDING_RTOL * np.abs(gaps).max()] = 0.0
        below = np.where(
            basic, z - low, np.maximum(np.where(basis == UPPER, -w, w), 0.0)
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            above = np.where(basic, high - z, np.inf)
            steps = np.array(
                [
                    np.where(s * gaps < 0, below, np.where(s * gaps > 0, above, np.inf))
                    for s in (1, -1)
                ]
            )
            steps /= np.abs(gaps)
        steps[:, gaps == 0] = np.inf
        side, k = np.unravel_index(np.argmin(steps), steps.shape)
        if steps[side, k] == np.inf:
            return None
        step = (1 - 2 * int(side)) * steps[side, k]
        z, w = z + step * null, w + step * change
        if not basic[k]:
            basis[k] = BASIC
        else:
            basis[k] = LOWER if step * gaps[k] < 0 else UPPER
    return None


def _null_vector(M: Matrix, statuses: BasisStatus) -> Vector | None:
    """Return v of shape (n,), zero outside B, with M_BB v_B = 0 for an equilibrated M;
    None if M_BB is nonsingular.
    """
    basic = np.flatnonzero(statuses == BASIC)
    if not basic.size:
        return None
    block, generic = M[basic][:, basic], generator(0).uniform(1, 2, basic.size)
    with suppress(SingularMatrix):
        if (
            np.abs(checked_solver(block)(product(block, generic)) - generic).max()
            <= RECOVERED
        ):
            return None
    _, values, rows = np.linalg.svd(finite(dense(block)))
    if values[-1] > SINGULAR * values[0]:
        return None
    v = np.zeros(statuses.size)
    v[basic] = rows[-1]
    return v


# Breakpoints are verified when their z have this many numbers, or there are this many
# breakpoints: enough to share the cost, and few enough that the rest is verified within
# a second after Ctrl-C. In exact arithmetic there is nothing to share.
AT_ONCE = 500_000
MIN_AT_ONCE = 4
MAX_AT_ONCE = 1000
EXACT_AT_ONCE = 16


class _Breakpoint(NamedTuple):
    """A breakpoint: s, t in double precision, z, w if it is exact or verified, and the
    basis on the piece before it, or None.
    """

    s: Any
    t: float
    z: Any
    w: Any
    statuses: BasisStatus | None


def _rows(rows: list[Any], family: Family, kind: type = float) -> Any:
    """Return rows of n numbers as an array of this type, also if there are none."""
    return np.array(rows, kind).reshape(len(rows), family.problem.n)


Data: TypeAlias = tuple[ExactProblem, ExactProblem]
MAX_NUMBERS = 2**26  # numbers of z on a path: together with w they take one GiB
FILL = (
    "fill the memory for a path; follow it in several spans of t, with --from and --to"
)
# Unknowns and breakpoints of a path that is followed in fractions in about a second.
MAX_EXACT, MAX_EXACT_BREAKPOINTS = 40, 200
# Degenerate pivots at one vertex: more than this mean that rounding prevents the
# perturbation from breaking ties.
MAX_POINTS = 10_000


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
    """Follow the solutions from a problem to another one with the same M: parametric
    principal pivoting.

    Parameters
    ----------
    problem, to : two Problems with the same M; each bound is finite in both or in
        neither.
    start, stop : the values of t at the two problems, start < stop.
    tol : the largest relative residual at which a point is accepted as a solution,
        1e-10 by default.
    turns : whether to continue with decreasing t at turning points.
    max_breakpoints, time_limit : the breakpoints and seconds after which to stop, by
        default 100000 and no limit.
    exact : whether to compute the breakpoints in fractions and to prove each piece,
        with the floats taken as exact.

    Returns
    -------
    Path : its breakpoints t, z and w, how it terminates, and whether it is verified;
        `path(t)` gives z at t. If the path is interrupted or reaches a limit, this is
        the part up to there.

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

    explicit_options: dict[str, Any] = {
        "tol": tol,
        "max_breakpoints": max_breakpoints,
        "time_limit": time_limit,
    }
    family = Family(problem, to, start, stop)
    read = partial(_of_floats, family) if exact else None
    return follow(family, turns, read, **explicit_options)


def follow(
    family: Family,
    turns: bool = False,
    read: Callable[[], Data] | None = None,
    **option_values: Any,
) -> Path:
    """Return the path, in fractions if `read` is not None: it returns both problems
    with their numbers as written. `option_values` are options of `path`, each None if
    it was not specified.
    """
    began = seconds()
    check_options((TOL, MAX_BREAKPOINTS, TIME_LIMIT), option_values)
    explicit_options = {
        name: value for name, value in option_values.items() if value is not None
    }
    max_breakpoints = int(
        explicit_options.pop("max_breakpoints", MAX_BREAKPOINTS.value)
    )
    max_points_in_memory = max(MAX_NUMBERS // max(1, family.problem.n), 2)
    limits = Limits(**explicit_options)
    run = partial(
        _Following,
        family,
        max_breakpoints=min(max_breakpoints, max_points_in_memory),
        follows_turns=turns,
    )
    path = run(limits, read=read).path(began)
    if read is None and _may_be_followed_again(path):
        path = _by_fractions(path, run, limits, began)
    if (
        path.end == terminations.BREAKPOINT_LIMIT
        and max_points_in_memory < max_breakpoints
    ):
        size = f"{max_points_in_memory} with {family.problem.n} unknowns"
        return replace(path, message=f"{path.message}: {size} {FILL}")
    return path


def _may_be_followed_again(path: Path) -> bool:
    """Return whether a path that is not verified, but was followed to its last point,
    can be followed in fractions in about a second: numbers that are small compared with
    others may have been lost by rounding."""
    ends = terminations
    return (
        not path.verified
        and path.end
        in (ends.REACHED, ends.RETURNED, ends.RAY, ends.TURN, ends.BREAKDOWN)
        and path.problem.n <= MAX_EXACT
        and 0 < path.t.size <= MAX_EXACT_BREAKPOINTS
    )


def _by_fractions(
    path: Path, run: Callable[..., _Following], limits: Limits, began: float
) -> Path:
    """Return a path as it is in fractions, with rounded numbers that are verified as
    those of other paths are; or the path itself, if they are not verified, or there is
    no time left."""
    remaining = limits.time_limit - (seconds() - began)
    if not remaining > 0:
        return path
    limits = replace(limits, time_limit=remaining)
    exact = run(limits, read=partial(_of_floats, path.family)).path(began)
    if not exact.verified:
        return path
    breakpoints = Breakpoints(exact.t, exact.z, exact.states)
    t, z, w, is_verified = verify(path.family, breakpoints, limits.tol)
    if not is_verified:
        return path
    return replace(exact, t=t, z=z, w=w, exact=None, seconds=seconds() - began)


def _of_floats(family: Family) -> Data:
    return ExactProblem.of_floats(family.problem), ExactProblem.of_floats(family.to)


class _Termination(NamedTuple):
    """How a path terminates: a key of ENDS, a sentence, and the last edge if it is a
    ray."""

    end: str
    message: str
    ray: Edge | None = None


class _Following:
    """One run along a path. The breakpoints are verified in order, in groups, while the
    path is followed; in floating-point arithmetic, verification may change their t and
    z by rounding errors. The known part survives an interruption.

    read : returns both problems in fractions, for an exact path, otherwise None. exact
        : these problems, and the ones between them.
    """

    def __init__(
        self,
        family: Family,
        limits: Limits,
        max_breakpoints: int,
        follows_turns: bool,
        read: Callable[[], Data] | None,
    ) -> None:
        self.family = family
        self.limits = limits
        self.max_breakpoints = max_breakpoints
        self.turns = follows_turns
        self.read = read
        self.points = list[_Breakpoint]()
        self._done = 0
        self._are_solutions = True
        self.exact: ExactFamily | None = None
        self.end = _Termination(
            terminations.INTERRUPTED, ENDS[terminations.INTERRUPTED]
        )

    def path(self, began: float) -> Path:
        """Follow the path and verify it."""
        result: Result | None = None
        try:
            # Overflow is detected by tests of the results.
            with deadline_after(self.limits.time_limit), np.errstate(all="ignore"):
                if self.read is not None:
                    self.exact = ExactFamily(*self.read())
                result = driver.run(self.family.problem, "auto", limits=self.limits)
                if result.interrupted:
                    raise KeyboardInterrupt
                self.end = self._from(result)
        except TimeIsUp:
            self.end = _Termination(
                terminations.TIME_LIMIT, ENDS[terminations.TIME_LIMIT]
            )
        except KeyboardInterrupt:
            pass  # self.end already says so
        except SingularMatrix:
            self.end = _Termination(
                terminations.BREAKDOWN,
                f"{ENDS[terminations.BREAKDOWN]}: a basis is too ill-conditioned",
            )
        certificate = (
            result.certificate.vector
            if result is not None and result.certificate is not None
            else None
        )
        path, direction = self._path(), None
        termination, message, ray = self.end
        if ray is not None:
            direction = np.array(ray.z, dtype=float)
            candidates = (
                [direction]
                if ray.multipliers is None
                else [direction, ray.multipliers, -ray.multipliers]
            )
            # The multipliers of the rows are a proof if t is maximal over all solutions
            # of the inequalities; both signs are tested.
            proof = first_proof(self.family.to, candidates, whole=True)
            certificate = None if proof is None else proof.vector
            if certificate is not None:
                message += "; the second problem is proved to have no solution"
        last: dict[str, Any] = {
            "end": termination,
            "message": message,
            "direction": direction,
            "certificate": certificate,
        }
        return replace(path, **last, seconds=seconds() - began)

    def _from(self, result: Result) -> _Termination:
        """Follow the path from a solution of the first problem, in floating-point or
        exact arithmetic; return how it terminates."""
        if result.status.has_no_solution:
            return _Termination(
                terminations.INFEASIBLE, f"the first problem {result.message}"
            )
        if result.status is Status.TIME_LIMIT:
            return _Termination(terminations.TIME_LIMIT, ENDS[terminations.TIME_LIMIT])
        if not result.solved:
            return _Termination(
                terminations.UNSOLVED,
                f"{ENDS[terminations.UNSOLVED]}: {result.message}",
            )
        basis = basic_states(
            self.family.problem, result.z, result.w, self.family.is_fixed
        )
        if basis is None:
            return _Termination(
                terminations.UNSOLVED,
                f"{ENDS[terminations.UNSOLVED]} whose basic variables it determines",
            )
        if self.exact is None:
            pivoting = Pivoting(self.family, basis)
            return self._along(
                0.0, pivoting.units.z_outside(pivoting.z), pivoting.edges()
            )
        exactly = ExactPivoting(self.exact, basis)
        if not exactly.is_feasible:
            return _Termination(
                terminations.UNSOLVED,
                f"{ENDS[terminations.UNSOLVED]}: rounding has led to another basis",
            )
        return self._along(*exactly.vertex(), exactly.edges())

    def _along(self, s: Any, z: Any, edges: Iterable[Edge]) -> _Termination:
        """Add the vertex at s, and the far vertex of each edge; return how the path
        terminates."""
        self.add(s, z, None)
        points = 0
        for edge in edges:
            raise_if_timed_out()
            if edge.is_ray:
                return _Termination(terminations.RAY, ENDS[terminations.RAY], edge)
            if edge.rise < 0 and not edge.is_point and not self.turns:
                return _Termination(terminations.TURN, ENDS[terminations.TURN])
            points = points + 1 if edge.is_point else 0
            if points > MAX_POINTS:
                return _Termination(
                    terminations.BREAKDOWN,
                    f"{ENDS[terminations.BREAKDOWN]}: ties are not resolved in double "
                    "precision",
                )
            if self.exact is None and not np.isfinite(edge.z).all():
                return _Termination(
                    terminations.BREAKDOWN,
                    f"{ENDS[terminations.BREAKDOWN]}: z is too large for double "
                    "precision",
                )
            self._append(edge)
            if edge.is_last:
                termination = terminations.TURN
                if edge.s:
                    termination = terminations.REACHED
                elif len(self.points) > 1:
                    termination = terminations.RETURNED
                return _Termination(termination, ENDS[termination])
            if len(self.points) > self.max_breakpoints:
                break
        return _Termination(
            terminations.BREAKPOINT_LIMIT, ENDS[terminations.BREAKPOINT_LIMIT]
        )

    def _append(self, edge: Edge) -> None:
        """Add the vertex to which an edge leads. An edge without length adds none, but
        as the last edge of the path its vertex replaces the last one.
        """
        last = self.points[-1]
        s = last.s if edge.rise == 0 else edge.s  # rounding may have moved it
        if not edge.is_point:
            self.add(s, edge.z, edge.statuses)
        elif edge.is_last:
            self.points[-1] = self.point(s, edge.z, last.statuses)

    def add(self, s: Any, z: Any, statuses: BasisStatus | None) -> None:
        """Add a breakpoint, with the basis on the piece before it; verify those before
        it if there are many.
        """
        points = self.points
        points.append(self.point(s, z, statuses))
        new, n = len(points) - self._done, self.family.problem.n
        max_pending = MAX_AT_ONCE if self.exact is None else EXACT_AT_ONCE
        if new >= MIN_AT_ONCE and (new * n >= AT_ONCE or new >= max_pending):
            each = range(len(points) - 1, self._done, -1)
            # Breakpoints with the same t as the last one are verified together later.
            self._verify(next((k for k in each if points[k].t != points[k - 1].t), 0))

    def point(self, s: Any, z: Any, statuses: BasisStatus | None) -> _Breakpoint:
        # This form is exactly a at s = 0 and b at s = 1.
        t = self.family.start * (1 - float(s)) + self.family.stop * float(s)
        return _Breakpoint(
            s, t, z, None if self.exact is None else self.exact.w(s, z), statuses
        )

    def _verify(self, n_verified: int) -> None:
        """Verify the first `n_verified` breakpoints, except those that have been
        verified.
        """
        if n_verified <= self._done:
            return
        first = max(self._done - 2, 0)
        points = self.points[first:]
        verified_points = points[: n_verified - first]
        if self.exact is not None:
            endpoints = (
                (point.statuses, endpoint)
                for before, point in pairwise(verified_points)
                for endpoint in (before, point)
            )
            is_verified = all(
                self.exact.satisfies(basis, endpoint.s, endpoint.z, endpoint.w)
                for basis, endpoint in endpoints
                if basis is not None
            )
        else:
            breakpoints = Breakpoints(
                np.array([point.t for point in points]),
                _rows([point.z for point in points], self.family),
                _rows([point.statuses for point in points[1:]], self.family, np.int8),
            )
            t, z, w, is_verified = verify(
                self.family,
                breakpoints,
                self.limits.tol,
                self._done - first,
                len(verified_points),
            )
            rows = zip(verified_points, t.tolist(), z, w, strict=True)
            verified_points = [point._replace(t=t, z=z, w=w) for point, t, z, w in rows]
        with deferring_signals():
            self.points[first:n_verified], self._done = verified_points, n_verified
            self._are_solutions &= is_verified

    def _path(self) -> Path:
        """Return the verified path, without its termination."""
        self._verify(len(self.points))
        family = self.family
        points = self.points
        exact = None
        z, w = [point.z for point in points], [point.w for point in points]
        if self.exact is not None:
            start, stop = Fraction(family.start), Fraction(family.stop)
            exact = ExactPath(
                [start + point.s * (stop - start) for point in points], z, w
            )
            z, w = ([rounded(row) for row in rows] for rows in (z, w))
        t = np.array([point.t for point in points])
        bases = [point.statuses for point in points[1:]]
        is_verified = (
            bool(points) and self._are_solutions and points[0].t == float(family.start)
        )
        arrays = _rows(z, family), _rows(w, family), _rows(bases, family, np.int8)
        return Path(family, t, *arrays, "", "", is_verified, 0.0, exact=exact)
