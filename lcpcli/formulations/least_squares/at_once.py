"""Fits that are solved from A and b at once, and the point that the method proposes for
a run. Their mixed problem, which is larger than A, is made only when it is read."""

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
MAX_ENTRIES = 4_000_000  # of A, up to which it is stored dense
# Of the terms of a row: its violation, far below every tolerance; and of |b|: the terms
# of A x, beyond which they might cancel.
ROUNDING_OF_ROWS = 1000 * EPS
MAX_CANCELLATION = 1e6
REASON = "each row holds to 2e-13 of its own terms"


@np.errstate(all="ignore")
def proposed(data: Data) -> Proposal | None:
    """Return the z of the minimizer; None if the method does not reach one."""
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
    """Problems with one A, b of each being a column of `data.b` or all of it.

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
    """A result whose problem and point are made when they are read."""

    @cached_property
    def answer(self) -> Fit:
        fits, i, Z = self._row
        assert isinstance(fits, Fits)
        return fit_at(fits.origin, fits.data_at(i), Z[i])


def solved_at_once(fits: Fits, began: float) -> Result | None:
    """Return the result of a single fit if its conditions hold to rounding; None if
    they do not, so that a run has to decide."""
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
    """Return whether all conditions hold so well that no measure of a violation, nor of
    the terms of rows, could doubt them; for several fits, in columns, of each.

    The criterion of the package (`verify.measure`) allows a row 1e-10 of its terms, and
    caps these terms by what b and d call for. Here it is 2e-13 of them, for bounds that
    have 0 between them, from which terms are counted; beside equations b and d have to
    explain the terms.
    """
    A, b, lower, upper, E, d = data
    if not ((lower <= 0) & (upper >= 0)).all():
        return np.zeros(b.shape[1:], dtype=bool)
    if x.ndim > 1:
        lower = lower[:, np.newaxis]
        upper = upper[:, np.newaxis]
        d = d[:, np.newaxis]
    of_A, of_E = abs(A), abs(E)
    sizes, others = of_A @ np.abs(x), of_E @ np.abs(x)
    violation = np.abs(r + A @ x - b)
    good = (violation <= ROUNDING_OF_ROWS * (sizes + np.abs(b))).all(axis=0)
    # Without equations there is a minimizer: large terms of A x hide no contradiction.
    if len(data.d):
        largest = np.abs(b).max(axis=0, initial=0.0)
        good &= sizes.max(axis=0, initial=0.0) <= MAX_CANCELLATION * largest
        good &= (others <= MAX_CANCELLATION * np.abs(d)).all(axis=0)
        violation = np.abs(E @ x - d)
        good &= (violation <= ROUNDING_OF_ROWS * (others + np.abs(d))).all(axis=0)
    slopes = A.T @ r + E.T @ y
    terms = ROUNDING_OF_ROWS * (of_A.T @ np.abs(r) + of_E.T @ np.abs(y))
    rises = (slopes <= terms) | (x >= upper)
    falls = (slopes >= -terms) | (x <= lower)
    return np.asarray(good & (rises & falls).all(axis=0))
