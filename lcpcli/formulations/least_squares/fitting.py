"""Fits in one call, and the point that the active-set method proposes for a run."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.formulations.least_squares.active_set import minimize
from lcpcli.formulations.least_squares.fit import Data, from_lsq
from lcpcli.formulations.least_squares.scaling import Scaled
from lcpcli.linalg.matrices import dense, is_sparse
from lcpcli.model.formulation import Proposal
from lcpcli.solving.call import RunOptions, run
from lcpcli.solving.result import Result
from lcpcli.typing import BoundLike, VectorLike

if TYPE_CHECKING:
    from typing_extensions import Unpack

METHOD = "least-squares"
MAX_ENTRIES = 4_000_000  # of A, up to which it is stored dense


@np.errstate(all="ignore")
def proposed(data: Data) -> Proposal | None:
    """Return the z of the minimizer; None if the method does not reach one."""
    if is_sparse(data.A):
        if data.A.shape[0] * data.A.shape[1] > MAX_ENTRIES:
            return None
        data = data._replace(A=dense(data.A), E=dense(data.E))
    scaled = Scaled.of(data)
    found = minimize(scaled.data)
    if found is None:
        return None
    x = np.clip(scaled.x(found.x), data.lower, data.upper)
    z = np.concatenate((scaled.r(found.r), x, scaled.y(found.y)))
    return Proposal(z, found.steps, METHOD)


def nnls(A: Any, b: VectorLike, **options: Unpack[RunOptions]) -> Result:
    """Return the result of nonnegative least squares: the x >= 0 that minimizes |A x -
    b|, in `Result.answer`.

    A, b : shapes (m, n), dense or sparse, and (m,), as in `from_lsq`.
    options : as in `run`.

    `answer.x` and `answer.norm` are what scipy.optimize.nnls returns. `answer` also has
    multipliers, and says whether another x fits as well, or hangs on rounding (see
    `lsq`). Raises ProblemError, which names the argument at fault.

    >>> import lcpcli
    >>> answer = lcpcli.nnls([[1, 1], [1, 2], [1, 3]], [1, 0, 1]).answer
    >>> answer.x.round(6).tolist(), round(answer.norm, 6)
    ([0.666667, 0.0], 0.816497)
    """
    return run(from_lsq(A, b, lower=0.0), **options)


def lsq(
    A: Any,
    b: VectorLike,
    lower: BoundLike = -math.inf,
    upper: BoundLike = math.inf,
    E: Any = None,
    d: VectorLike | None = None,
    **options: Unpack[RunOptions],
) -> Result:
    """Return the result of least squares: the x that minimizes |A x - b| subject to
    lower <= x <= upper and E x = d, in `Result.answer`.

    Parameters
    ----------
    A, b, lower, upper, E, d : as in `from_lsq`; by default there are no bounds, and no
        equations.
    options : as in `run`.

    Returns
    -------
    Result : its status is "solved" if the optimality conditions hold to the tolerance,
        in the units of each row and column, or "infeasible" if no x satisfies bounds
        and equations. `answer` has x, residual (b - A x), norm, multipliers and
        support; proved says whether x is "unique", one of "several", with another
        minimizer in `answer.other`, or determined only "up to rounding" of the data.

    Raises
    ------
    ProblemError, OptionError : an argument cannot be used. Both are ValueErrors.

    Examples
    --------
    Weights that sum to 1:

    >>> import lcpcli
    >>> A, b = [[1, 0, 2], [0, 1, 1], [1, 1, 0]], [1.2, 0.5, 0.8]
    >>> answer = lcpcli.lsq(A, b, lower=0, E=[1, 1, 1], d=1).answer
    >>> answer.x.round(6).tolist(), answer.proved
    ([0.55, 0.15, 0.3], 'unique')
    """
    return run(from_lsq(A, b, lower, upper, E, d), **options)
