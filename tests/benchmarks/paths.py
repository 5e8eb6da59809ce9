"""Paths beside those of other packages: paths.py [seconds]

Microseconds for each breakpoint of the path between two members of a family, of
`lcpcli.path`, and of cvxcla for efficient frontiers and `lars_path` of scikit-learn for
the LASSO, where these are installed (pip install cvxcla scikit-learn). Both run in
turns from arrays in memory to their last breakpoint, with the verification of ours, for
so many seconds (2) and at least three times. The ratio is the median of the ratios of
both times in the same turn. The errors are those of up to ten breakpoints, relative to
the length of the path; the exact ones follow from the states of our path by a
refinement in integers.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
import warnings
from fractions import Fraction
from importlib.util import find_spec
from statistics import median

import numpy as np
from exact_breakpoints import exact_shares
from measuring import in_turns, show

import lcpcli
from lcpcli import Problem
from lcpcli.formulations.quadratic_program import families as programs
from lcpcli.gallery import families

MIN_REPEATS, MAX_REPEATS = 3, 1000
WIDTHS = (8, 5, 12, 8, 8, 8, 8, 6)
# Breakpoints of a path whose errors are computed; each may take a tenth of a second.
MAX_EXACT = 10


FRONTIERS = (102, 502)  # unknowns
LASSOS = ((200, 40), (1000, 200))  # unknowns and samples


def turning_points(S, returns, most):
    """The weights on the return at the turning points of an efficient frontier,
    decreasing to 0, by cvxcla: min x'Sx / 2 - weight returns'x for shares 0 <= x <=
    most that add up to 1. Of the package's classes of covariances, this one updates its
    factorization; it is the fastest for a dense S."""
    from cvxcla import CLA, IncrementalDenseCovariance

    k = returns.size
    budget = {"a": np.ones((1, k)), "b": np.ones(1)}
    bounds = {"lower_bounds": np.zeros(k), "upper_bounds": most}
    found = CLA(
        mean=returns, covariance=IncrementalDenseCovariance(S), **budget, **bounds
    )
    return np.array(
        [point.lamb for point in found.turning_points if np.isfinite(point.lamb)]
    )


def penalties(X, y):
    """The penalties at the breakpoints of the path of min |y - X b|^2 / 2 + penalty
    |b|_1, decreasing to 0, by scikit-learn. Whether it computes X'X is left to it; on
    wide X it does not, and is faster so."""
    from sklearn import linear_model

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return np.asarray(linear_model.lars_path(X, y, method="lasso")[0] * y.size)


def frontier(n):
    """A path of weights on the return from 256 to 0, and both ways to follow it."""
    weight = 256.0
    first, last = (families.make("frontier", n, weight=each) for each in (weight, 0.0))
    # M writable, as the arrays of users are.
    M, q, lower, upper = first.M.copy(), first.q, first.lower, first.upper
    S = M[: n - 2, : n - 2].copy()
    returns = -q[: n - 2] / weight
    most = upper[: n - 2].copy()

    def ours():
        problem = Problem(M, q, lower=lower, upper=upper)
        return lcpcli.path(
            problem, Problem(problem.M, last.q, lower=lower, upper=upper)
        )

    return ours, lambda: 1 - turning_points(S, returns, most) / weight


def lasso(n, samples):
    """A path from the least penalty with a solution of 0 to none, and both ways to
    follow it."""
    X, y = programs.regression(n // 2, 0, samples)

    def ours():
        G, b = X.T @ X, X.T @ y
        c = np.concatenate((-b, b))
        problem = Problem(np.block([[G, -G], [-G, G]]), c + abs(c).max())
        return lcpcli.path(problem, Problem(problem.M, c))

    def theirs():
        found = penalties(X, y)
        return np.asarray(1 - found / found[0])

    return ours, theirs


def error(shares, exact):
    """The largest distance of an exact breakpoint from the nearest of these."""
    return max(
        (float(min(abs(found - share) for found in shares)) for share in exact),
        default=np.nan,
    )


def row(name, n, ours, theirs, budget):
    found, calls = ours(), (ours, theirs) if theirs else (ours,)
    assert found.end == "reached"
    assert found.verified
    own, *other = in_turns(
        *calls, most=MAX_REPEATS, least=MIN_REPEATS, budget=budget, warm_up=0
    )
    exact = [share for _, share in exact_shares(found, MAX_EXACT)]
    first, last = Fraction(found.family.start), Fraction(found.family.stop)
    shares = [(Fraction(t) - first) / (last - first) for t in found.t.tolist()]
    cells = [
        name,
        n,
        found.t.size,
        1e6 * median(own) / found.t.size,
        error(shares, exact),
    ]
    if not theirs:
        return [*cells, "", "", ""]
    others = theirs().tolist()
    ratios = [one / another for one, another in zip(own, other[0], strict=True)]
    return [
        *cells,
        1e6 * median(other[0]) / len(others),
        error(list(map(Fraction, others)), exact),
        median(ratios),
    ]


def main(budget):
    show(
        ("path", "n", "breakpoints", "us each", "error", "theirs", "error", "ratio"),
        WIDTHS,
    )
    for name, peer, follow, sizes in (
        ("frontier", "cvxcla", frontier, [(n,) for n in FRONTIERS]),
        ("lasso", "sklearn", lasso, LASSOS),
    ):
        for size in sizes:
            ours, theirs = follow(*size)
            show(
                row(name, size[0], ours, theirs if find_spec(peer) else None, budget),
                WIDTHS,
            )


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 2.0)
