"""Paths beside those of other packages: paths.py [seconds]

Microseconds for each breakpoint of the path between two members of a family, and the largest error of a breakpoint,
relative to the length of the path: of `lcpcli.path`, and of cvxcla for efficient frontiers and `lars_path` of
scikit-learn for the LASSO, where these are installed (pip install cvxcla scikit-learn). Both run in turns from arrays
in memory to their last breakpoint, with the verification of ours, for so many seconds (2) and at least three times.
The errors are those of up to ten breakpoints, evenly spread; the exact ones follow from the states of our path by a
refinement in integers. The ratio is the median of the ratios of both times in the same turn.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from importlib.util import find_spec
from statistics import median
from typing import Any, NamedTuple

import numpy as np
from exact_breakpoints import exact_shares

import lcpcli
from lcpcli import Path, Problem
from lcpcli.gallery import families, programs

MOST_EXACT = 10  # breakpoints of a path whose errors are computed; each may take a tenth of a second
LEAST_REPEATS, MOST_REPEATS = 3, 1000
Vector = np.ndarray[Any, np.dtype[np.float64]]
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

    def problems(self) -> Iterator[Problem]:
        """Yield the problems at both ends."""
        for k in (0, 1):
            yield families.make(self.family, self.n, **self.kept, **{name: ends[k] for name, ends in self.ends.items()})


RETURN, PENALTY = {"weight": (256.0, 0.0)}, {"penalty": (1.0, 0.0)}
CASES = (
    Case("frontier", 102, RETURN, peer="cvxcla"),
    Case("frontier", 502, RETURN, peer="cvxcla"),
    Case("lasso", 200, PENALTY, {"samples": 40}, peer="sklearn"),
    Case("lasso", 1000, PENALTY, {"samples": 200}, peer="sklearn"),
    Case("all-cones", 10, {"t": (-1.0, 1023.0)}),
    Case("two-obstacles", 100, {"load": (0.0, 4.0)}),
    Case("american-put", 100, {"strike": (1.0, 1.2)}),
    Case("spatial-prices", 120, {"tax": (0.0, 18.0)}),
)


def turning_points(S: Vector, returns: Vector, most: Vector) -> Vector:
    """The weights on the return at the turning points of an efficient frontier, decreasing to 0, by cvxcla:
    min x'Sx / 2 - weight returns'x for shares 0 <= x <= most that add up to 1. Of the package's classes of covariances,
    this one updates its factorization; it is the fastest for a dense S."""
    from cvxcla import CLA, IncrementalDenseCovariance

    k = returns.size
    budget = {"a": np.ones((1, k)), "b": np.ones(1)}
    bounds = {"lower_bounds": np.zeros(k), "upper_bounds": most}
    found = CLA(mean=returns, covariance=IncrementalDenseCovariance(S), **budget, **bounds)
    return np.array([point.lamb for point in found.turning_points if np.isfinite(point.lamb)])


def penalties(X: Vector, y: Vector) -> Vector:
    """The penalties at the breakpoints of the path of min |y - X b|^2 / 2 + penalty |b|_1, decreasing to 0, by
    scikit-learn. Whether it computes X'X is left to it; on wide X it does not, and is faster so."""
    from sklearn import linear_model

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return np.asarray(linear_model.lars_path(X, y, method="lasso")[0] * y.size)


def sides(case: Case) -> tuple[Callable[[], Path], Follower]:
    """What follows the path from arrays, and what does so by the other package."""
    first, last = case.problems()
    M, q, lower, upper = first.M.copy(), first.q, first.lower, first.upper  # M writable, as the arrays of users are

    def ours() -> Path:
        problem = Problem(M, q, lower=lower, upper=upper)
        return lcpcli.path(problem, Problem(problem.M, last.q, lower=lower, upper=upper))

    if case.family == "frontier":
        k, weight = first.n - 2, case.ends["weight"][0]
        S, returns, most = M[:k, :k].copy(), -q[:k] / weight, upper[:k].copy()
        return ours, lambda: 1 - turning_points(S, returns, most) / weight
    if case.family != "lasso":
        return ours, lambda: np.empty(0)
    X, y = programs.regression(first.n // 2, 0, case.kept["samples"])

    def ours_of_samples() -> Path:
        M, c = programs.gram(X, y)
        problem = Problem(M, c + abs(c).max())
        return lcpcli.path(problem, Problem(problem.M, c))

    def theirs() -> Vector:
        found = penalties(X, y)
        return np.asarray(1 - found / found[0])

    return ours_of_samples, theirs


def timed(call: Callable[[], object]) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


def errors(found: Path, shares: Vector | None) -> tuple[float, float]:
    """The largest errors of our breakpoints and of those of the other package, not a number where there are none."""
    exact = exact_shares(found, MOST_EXACT)
    a, length = Fraction(found.family.start), Fraction(found.family.stop) - Fraction(found.family.start)
    ours = (float(abs((Fraction(found.t[k]) - a) / length - share)) for k, share in exact)
    nearest = ((shares[np.abs(shares - float(s)).argmin()], s) for _, s in exact) if shares is not None else ()
    return max(ours, default=np.nan), max((float(abs(Fraction(t) - s)) for t, s in nearest), default=np.nan)


def main(budget: float) -> None:
    print(f"{'path':38}{'n':>5}{'breakpoints':>12}{'us each':>9}{'error':>9}  beside  us each    error  ratio")
    for case in CASES:
        ours, theirs = sides(case)
        found, is_there = ours(), bool(case.peer) and find_spec(case.peer) is not None
        shares = theirs() if is_there else None
        times: list[float] = []
        peer_times: list[float] = []
        began = time.perf_counter()
        while len(times) < LEAST_REPEATS or (time.perf_counter() - began < budget and len(times) < MOST_REPEATS):
            times.append(timed(ours))
            if is_there:
                peer_times.append(timed(theirs))
        own, other = errors(found, shares)
        line = f"{case.name:38}{found.problem.n:5}{found.t.size:12}{1e6 * median(times) / found.t.size:9.1f}{own:9.1e}"
        if shares is not None:
            ratio = median(one / another for one, another in zip(times, peer_times, strict=True))
            line += f"  {case.peer:7}{1e6 * median(peer_times) / shares.size:8.1f}{other:9.1e}{ratio:7.2f}"
        print(line if found.end == "reached" and found.verified else f"{line}  {found.end}, verified: {found.verified}")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 2.0)
