"""Paths beside those of other packages: paths.py [seconds]

Microseconds for each breakpoint of the path between two members of a family, of `lcpcli.path`, and of cvxcla for
efficient frontiers and `lars_path` of scikit-learn for the LASSO, where these are installed (pip install cvxcla
scikit-learn). Both run in turns from arrays in memory to their last breakpoint, with the verification of ours, for so
many seconds (2) and at least three times. The ratio is the median of the ratios of both times in the same turn. The
distance is that of their breakpoints from ours, relative to the length of the path.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from importlib.util import find_spec
from statistics import median
from typing import Any, NamedTuple

import numpy as np
from measuring import in_turns, show

import lcpcli
from lcpcli import Path, Problem
from lcpcli.gallery import families, programs

LEAST_REPEATS, MOST_REPEATS = 3, 1000
WIDTHS = (30, 5, 12, 8, 8, 8, 6, 9)
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


def distance(shares: Vector, others: Vector) -> float:
    """The largest distance of a breakpoint of the other package from the nearest of ours."""
    return max((float(abs(shares - other).min()) for other in others), default=np.nan)


def main(budget: float) -> None:
    show(("path", "n", "breakpoints", "us each", "beside", "us each", "ratio", "distance"), WIDTHS)
    for case in CASES:
        ours, theirs = sides(case)
        found, is_there = ours(), bool(case.peer) and find_spec(case.peer) is not None
        calls = (ours, theirs) if is_there else (ours,)
        own, *other = in_turns(*calls, most=MOST_REPEATS, least=LEAST_REPEATS, budget=budget, warm_up=0)
        cells = [case.name, found.problem.n, found.t.size, 1e6 * median(own) / found.t.size, "", "", "", ""]
        if other:
            theirs_at, ratios = theirs(), [one / another for one, another in zip(own, other[0], strict=True)]
            shares = (found.t - found.family.start) / (found.family.stop - found.family.start)
            each = 1e6 * median(other[0]) / theirs_at.size
            cells[4:] = [case.peer, each, median(ratios), distance(shares, theirs_at)]
        show(cells, WIDTHS)
        assert (found.end, found.verified) == ("reached", True)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 2.0)
