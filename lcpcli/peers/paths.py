"""Followers of paths in other packages. Each takes arrays and returns the values of its parameter at breakpoints."""

from __future__ import annotations

import warnings

import numpy as np

from lcpcli.clock import imports
from lcpcli.typing import Vector


def cvxcla(S: Vector, returns: Vector, most: Vector) -> Vector:
    """Return the weights on the return at the turning points of an efficient frontier, decreasing to 0, by cvxcla:
    min x'Sx / 2 - weight returns'x for shares 0 <= x <= most that add up to 1.

    Of the package's classes of covariances, this one updates its factorization; it is the fastest for a dense S.
    """
    with imports:
        from cvxcla import CLA, IncrementalDenseCovariance
    k = returns.size
    budget = {"a": np.ones((1, k)), "b": np.ones(1)}
    bounds = {"lower_bounds": np.zeros(k), "upper_bounds": most}
    found = CLA(mean=returns, covariance=IncrementalDenseCovariance(S), **budget, **bounds)
    return np.array([point.lamb for point in found.turning_points if np.isfinite(point.lamb)])


def lars_path(X: Vector, y: Vector) -> Vector:
    """Return the penalties at the breakpoints of the path of min |y - X b|^2 / 2 + penalty |b|_1, decreasing to 0, by
    scikit-learn.

    Whether it computes X'X is left to it; on wide X it does not, and is faster so.
    """
    with imports:
        from sklearn import linear_model
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        penalties, _, _ = linear_model.lars_path(X, y, method="lasso")
    return np.asarray(penalties * y.size)
