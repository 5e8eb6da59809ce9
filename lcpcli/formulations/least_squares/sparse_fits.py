"""Fits with a sparse A: block pivots on many coefficients by A'A, and corrections by
residuals of A itself. They succeed if the signs of all coefficients and multipliers are
certain after that (see `many_fits`).
"""

from __future__ import annotations

import numpy as np

from lcpcli.formulations.least_squares.active_set import (
    Minimizer,
    are_clear,
    exchanges,
    start_of,
)
from lcpcli.formulations.least_squares.factors import lapack
from lcpcli.formulations.least_squares.fit import Data
from lcpcli.typing import Vector

MAX_COEFFICIENTS = 3000  # up to here A'A is stored dense, in at most 72 MB
MAX_CORRECTIONS = 8
# After a correction that is below this, relative to the largest coefficient, the next
# one would be rounding error.
CORRECTED = 1e-14


def minimize_sparse(data: Data) -> Minimizer | None:
    """Return the minimizer of a problem without equations that has been scaled by
    `Scaled`; None if there are equations, or if the signs of a coefficient or
    multiplier remain uncertain.
    """
    A, b, lower, upper, *_ = data
    if data.d.size or lower.size > MAX_COEFFICIENTS or A.shape[0] < lower.size:
        return None
    _, statuses = start_of(data)
    gram = (A.T @ A).toarray()
    exchanged = exchanges(gram, A.T @ b, lower, upper, statuses)
    if exchanged is None or exchanged.n_infeasible:
        return None
    statuses = exchanged.statuses.astype(np.int8)
    point = Minimizer(exchanged.x, b - A @ exchanged.x, np.zeros(0), statuses, 1)
    free = point.free
    rows = np.zeros(0)
    if free.size:
        factor, info = lapack().dpotrf(gram[free[:, np.newaxis], free])
        if info or not _is_corrected(data, point, factor):
            return None
        inverse, _ = lapack().dpotri(factor)
        rows = np.sqrt(np.diagonal(inverse))
    norms = np.sqrt(np.diagonal(gram))
    return point if are_clear(data, point, norms, rows) else None


def _is_corrected(data: Data, point: Minimizer, factor: Vector) -> bool:
    """Correct the free coefficients by residuals of A; return whether the corrections
    became negligible.
    """
    free = point.free
    for _ in range(MAX_CORRECTIONS):
        slopes = (data.A.T @ point.r)[free]
        step, _ = lapack().dpotrs(factor, slopes)
        point.x[free] += step
        point.r = data.b - data.A @ point.x
        if np.abs(step).max() <= CORRECTED * np.abs(point.x[free]).max():
            return True
    return False
