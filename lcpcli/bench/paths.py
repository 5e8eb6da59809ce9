"""Paths beside those of other packages: time per breakpoint, and errors of breakpoints against exact ones.

Both run from arrays in memory to all their breakpoints, ours until the path is verified, in turns.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from statistics import median
from typing import Any, NamedTuple

import numpy as np

from lcpcli.bench.accuracy_tables import NOWHERE, Sheet
from lcpcli.bench.exact_breakpoints import exact_shares
from lcpcli.bench.timing import LEAST_REPEATS, MOST_REPEATS
from lcpcli.clock import seconds
from lcpcli.gallery import families as gallery
from lcpcli.gallery import programs
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.parametric.following import path
from lcpcli.parametric.path import INTERRUPTED, Path
from lcpcli.peers import paths as followers
from lcpcli.peers.registry import FOLLOWERS, installed
from lcpcli.report import wording
from lcpcli.typing import Vector

MOST_EXACT = 10  # breakpoints of a path whose errors are computed; each may take a tenth of a second

BESIDE = [distribution for distribution, _ in FOLLOWERS.values()]

Problems = tuple[Problem, Problem]
Follower = Callable[[], Vector]  # returns the s of its breakpoints


class Case(NamedTuple):
    """A path between two members of a family. ends : parameters that move, with both values; kept : other ones."""

    family: str
    n: int
    ends: Mapping[str, tuple[float, float]]
    kept: Mapping[str, int] = {}
    peer: str = ""

    @property
    def name(self) -> str:
        moves = (f"{name}={first:g}..{last:g}" for name, (first, last) in self.ends.items())
        return " ".join([self.family, *moves])

    def problems(self) -> Problems:
        """Return the problems at both ends."""
        moved: list[dict[str, Any]] = [{name: ends[k] for name, ends in self.ends.items()} for k in (0, 1)]
        first, last = (gallery.make(self.family, self.n, **self.kept, **values) for values in moved)
        return first, last


RETURN, PENALTY = {"weight": (256.0, 0.0)}, {"penalty": (1.0, 0.0)}
CASES = (
    Case("frontier", 102, RETURN, peer="cvxcla"),
    Case("frontier", 502, RETURN, peer="cvxcla"),
    Case("lasso", 200, PENALTY, {"samples": 40}, peer="lars_path"),
    Case("lasso", 1000, PENALTY, {"samples": 200}, peer="lars_path"),
    Case("all-cones", 10, {"t": (-1.0, 1023.0)}),
    Case("two-obstacles", 100, {"load": (0.0, 4.0)}),
    Case("american-put", 100, {"strike": (1.0, 1.2)}),
    Case("spatial-prices", 120, {"tax": (0.0, 18.0)}),
)


@dataclass
class Row:
    """What was measured on a case: breakpoints, the seconds of each repeat, and the largest error of a breakpoint,
    relative to the length of the path, None if unknown; of ours, and of the peer, if there is one and it is installed.

    missing : the distribution to install for the peer.
    """

    path: str
    n: int
    breakpoints: int
    end: str
    verified: bool
    seconds: list[float]
    error: float | None
    peer: str = ""
    missing: str = ""
    peer_breakpoints: int | None = None
    peer_seconds: list[float] = field(default_factory=list)
    peer_error: float | None = None

    @property
    def ratio(self) -> float | None:
        """Return the median ratio of our time to that of the peer in the same turn."""
        pairs = zip(self.seconds, self.peer_seconds, strict=False)
        return median(ours / theirs for ours, theirs in pairs) if self.peer_seconds else None


def measure(case: Case, budget: float) -> Row:
    """Follow the path of a case, in turns with its peer, for at least so many seconds or as often as counts."""
    problems = case.problems()
    ours, theirs = _sides(case, problems)
    distribution = FOLLOWERS[case.peer][0] if case.peer else ""
    missing = distribution if distribution and installed(distribution) is None else ""
    found, shares = ours(), theirs() if theirs and not missing else None
    times: list[float] = []
    peer_times: list[float] = []
    began = seconds()
    while len(times) < LEAST_REPEATS or (seconds() - began < budget and len(times) < MOST_REPEATS):
        times.append(_timed(ours))
        if theirs and shares is not None:
            peer_times.append(_timed(theirs))
    exact = exact_shares(found, MOST_EXACT)
    a, length = Fraction(found.family.start), Fraction(found.family.stop) - Fraction(found.family.start)
    row = Row(case.name, found.problem.n, found.t.size, found.end, found.verified, times, None, case.peer, missing)
    if exact:
        row.error = max(float(abs((Fraction(found.t[k]) - a) / length - share)) for k, share in exact)
    if shares is not None:
        begins_earlier = bool(shares[0])  # than the path: then its start is none of the peer's breakpoints
        row.peer_breakpoints, row.peer_seconds = int((shares >= 0).sum()) + begins_earlier, peer_times
        row.peer_error = max((_distance(shares, share) for _, share in exact), default=None)
    return row


def _distance(shares: Vector, share: Fraction) -> float:
    """Return the distance of the nearest of several numbers."""
    nearest = float(shares[np.abs(shares - float(share)).argmin()])
    return float(abs(Fraction(nearest) - share))


def _timed(run: Callable[[], object]) -> float:
    began = seconds()
    run()
    return seconds() - began


def _sides(case: Case, problems: Problems) -> tuple[Callable[[], Path], Follower | None]:
    """Return what follows the path from arrays, and what does so by the peer."""
    first, last = problems
    M, q, lower, upper = conditions_of(first)
    M = M.copy()  # writable, as the arrays of users are

    def ours() -> Path:
        problem = Problem(M, q, lower=lower, upper=upper)
        return _whole(path(problem, Problem(problem.M, last.q, lower=lower, upper=upper)))

    if case.peer == "cvxcla":
        k = first.n - 2
        weight = case.ends["weight"][0]
        S, returns, most = M[:k, :k].copy(), -q[:k] / weight, upper[:k].copy()
        return ours, lambda: 1 - followers.cvxcla(S, returns, most) / weight
    if case.peer == "lars_path":
        X, y = programs.regression(first.n // 2, 0, case.kept["samples"])

        def ours_of_samples() -> Path:
            M, c = programs.gram(X, y)
            problem = Problem(M, c + abs(c).max())
            return _whole(path(problem, Problem(problem.M, c)))

        def theirs() -> Vector:
            penalties = followers.lars_path(X, y)
            return np.asarray(1 - penalties / penalties[0])

        return ours_of_samples, theirs
    return ours, None


def _whole(found: Path) -> Path:
    """Return a path; raise KeyboardInterrupt if it was interrupted."""
    if found.end == INTERRUPTED:
        raise KeyboardInterrupt
    return found


def sheet(rows: list[Row]) -> Sheet:
    """Return the table."""
    header = ["problem", "n", "breakpoints", "us each", "error", "beside", "breakpoints", "us each", "error", "ratio"]
    cells = [
        [
            *(row.path, str(row.n), str(row.breakpoints), _each(row.seconds, row.breakpoints), _level(row.error)),
            *(row.peer or NOWHERE, NOWHERE if row.peer_breakpoints is None else str(row.peer_breakpoints)),
            *(_each(row.peer_seconds, row.peer_breakpoints), _level(row.peer_error)),
            NOWHERE if row.ratio is None else f"{row.ratio:.2f}",
        ]
        for row in rows
    ]
    notes = [
        "us each: median time of the path over its breakpoints, both ends included; ratio: median ratio of both times.",
        f"error: of up to {MOST_EXACT} breakpoints, evenly spread, against exact ones, relative to the path's length.",
    ]
    notes += [f"{row.path}, n = {row.n}: {row.end}, not verified." for row in rows if not row.verified]
    if missing := sorted({row.missing for row in rows} - {""}):
        notes.append(f"not installed: {', '.join(missing)}; pip install 'linear-complementarity[peers]'")
    return Sheet("Paths: time per breakpoint, and its error", header, [cells], notes)


def _each(times: list[float], breakpoints: int | None) -> str:
    return wording.digits(1e6 * median(times) / breakpoints) if times and breakpoints else NOWHERE


def _level(error: float | None) -> str:
    return NOWHERE if error is None else f"{error:.1e}"
