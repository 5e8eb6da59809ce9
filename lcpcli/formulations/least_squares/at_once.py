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
from lcpcli.formulations.least_squares.optimality import REASON, holds
from lcpcli.formulations.least_squares.scaling import Scaled
from lcpcli.formulations.least_squares.sparse_fits import minimize_sparse
from lcpcli.linalg.matrices import dense, is_sparse
from lcpcli.linalg.threads import limited_for
from lcpcli.model.formulation import Proposal
from lcpcli.model.problem import Problem
from lcpcli.options import DEFAULTS
from lcpcli.solving.many import RowResult
from lcpcli.solving.result import Result

METHOD = "least-squares"
MAX_ENTRIES = 4_000_000  # entries of A, up to which it is stored dense: 32 MB
# Fraction of nonzero entries of A up to which products of sparse matrices take less
# time than those of dense ones, which take up to three times as much memory.
MAX_FILLED = 0.25


@np.errstate(all="ignore")
def proposed(data: Data) -> Proposal | None:
    """Return the z of the minimizer; None if the active-set method does not reach
    one.
    """
    minimizer = None
    size = data.A.shape[0] * data.A.shape[1]
    if is_sparse(data.A) and data.A.nnz <= MAX_FILLED * size:
        scaled = Scaled.of(data)
        minimizer = minimize_sparse(scaled.data)
        if minimizer is None and size > MAX_ENTRIES:
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
        with limited_for(fits.data.A):
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
