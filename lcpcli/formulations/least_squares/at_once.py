"""Fits that are solved directly from A and b, and the point that this method proposes
for a run of the mixed problem. The mixed problem, whose matrix is larger than A, is
made only when it is read.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from lcpcli.clock import Stopwatch, seconds
from lcpcli.formulations.least_squares.active_set import minimize
from lcpcli.formulations.least_squares.answers import Fit, fit_at
from lcpcli.formulations.least_squares.fit import Data, LeastSquares, problem_of
from lcpcli.formulations.least_squares.scaling import Scaled
from lcpcli.formulations.least_squares.sparse_fits import minimize_sparse
from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.matrices import dense, is_sparse
from lcpcli.model.formulation import Proposal
from lcpcli.model.problem import Problem
from lcpcli.options import DEFAULTS
from lcpcli.solving.many import RowResult
from lcpcli.solving.result import Result
from lcpcli.typing import Mask, Vector

METHOD = "least-squares"
MAX_ENTRIES = 4_000_000  # entries of A, up to which it is stored dense: 32 MB
# The conditions must hold to this, relative to the terms of each row. It is 2e-13, far
# below every tolerance that a user may set for a run that is not exact.
ROUNDING_OF_ROWS = 1000 * EPS
# With equations, the terms of A x may be this many times the largest |b|, and those of
# E x this many times |d|. Larger terms cancel, which may hide a contradiction.
MAX_CANCELLATION = 1e6
REASON = "each row holds to 2e-13 of its own terms"


@np.errstate(all="ignore")
def proposed(data: Data) -> Proposal | None:
    """Return the z of the minimizer; None if the active-set method does not reach
    one.
    """
    minimizer = None
    if is_sparse(data.A):
        scaled = Scaled.of(data)
        minimizer = minimize_sparse(scaled.data)
        if minimizer is None and data.A.shape[0] * data.A.shape[1] > MAX_ENTRIES:
            return None
    if minimizer is None:
        data = data._replace(A=dense(data.A), E=dense(data.E))
        scaled = Scaled.of(data)
        minimizer = minimize(scaled.data)
    if minimizer is None:
        return None
    x = np.clip(scaled.x(minimizer.x), data.lower, data.upper)
    z = np.concatenate((scaled.r(minimizer.r), x, scaled.y(minimizer.y)))
    is_certain = holds(data, scaled.r(minimizer.r), x, scaled.y(minimizer.y)).all()
    return Proposal(z, minimizer.steps, METHOD, REASON * bool(is_certain))


class Fits:
    """Least-squares problems with the same A.

    data : the numbers of the problems; b has one column for each of them, or is the
        vector of the only one.
    labels : the names of the coefficients, if they have any.
    """

    def __init__(self, data: Data, labels: tuple[str, ...]) -> None:
        self.data = data
        self.origin = LeastSquares(len(data.b), data.lower.size, labels)

    def data_at(self, i: int) -> Data:
        data = self.data
        return data if data.b.ndim == 1 else data._replace(b=data.b[:, i])

    def problem(self, i: int) -> Problem:
        return problem_of(self.data_at(i), self.origin)


class FitResult(RowResult):
    """A result whose problem and answer are made when they are first read."""

    @cached_property
    def answer(self) -> Fit:
        fits, i, Z = self._row
        assert isinstance(fits, Fits)
        return fit_at(fits.origin, fits.data_at(i), Z[i])


def solved_at_once(fits: Fits, began: float) -> Result | None:
    """Return the result of a single fit if its conditions hold to rounding; None
    otherwise, in which case a run of the mixed problem has to decide.

    began : when the call began, for the times in the result.
    """
    data, stopwatch = fits.data, Stopwatch(seconds, began)
    stopwatch.count("setup")
    proposal = proposed(data)
    stopwatch.count("solve")
    if proposal is None or not proposal.reason:
        return None
    stopwatch.count("verify")
    row: Any = fits, 0, proposal.z[np.newaxis]
    return FitResult.of_solution(
        (METHOD,), proposal.steps, DEFAULTS, {}, stopwatch.parts, _row=row
    )


@np.errstate(all="ignore")
def holds(data: Data, r: Vector, x: Vector, y: Vector) -> Mask:
    """Return whether all optimality conditions hold so closely that verification with
    any tolerance would accept the point; for several fits, which are columns of r, x
    and y, one truth value for each.

    The criterion of the package (`verify.measure`) allows a row a violation of 1e-10 of
    its terms, and does not count terms that are much larger than b and d explain. Here
    a row may be violated by 2e-13 of its terms. Bounds must have 0 between them,
    because the criterion counts terms from the bounds; and with equations the terms
    must be explained by b and d.
    """
    A, b, lower, upper, E, d = data
    if not ((lower <= 0) & (upper >= 0)).all():
        return np.zeros(b.shape[1:], dtype=bool)
    if x.ndim > 1:
        lower = lower[:, np.newaxis]
        upper = upper[:, np.newaxis]
        d = d[:, np.newaxis]
    of_A = abs(A)
    sizes = of_A @ np.abs(x)
    violation = np.abs(r + A @ x - b)
    good = (violation <= ROUNDING_OF_ROWS * (sizes + np.abs(b))).all(axis=0)
    slopes = A.T @ r
    terms = of_A.T @ np.abs(r)
    # Without equations a minimizer always exists, so that cancellation in A x cannot
    # hide a contradiction.
    if len(data.d):
        of_E = abs(E)
        others = of_E @ np.abs(x)
        largest = np.abs(b).max(axis=0, initial=0.0)
        good &= sizes.max(axis=0, initial=0.0) <= MAX_CANCELLATION * largest
        good &= (others <= MAX_CANCELLATION * np.abs(d)).all(axis=0)
        violation = np.abs(E @ x - d)
        good &= (violation <= ROUNDING_OF_ROWS * (others + np.abs(d))).all(axis=0)
        slopes = slopes + E.T @ y
        terms = terms + of_E.T @ np.abs(y)
    terms = ROUNDING_OF_ROWS * terms
    rises = (slopes <= terms) | (x >= upper)
    falls = (slopes >= -terms) | (x <= lower)
    return np.asarray(good & (rises & falls).all(axis=0))
