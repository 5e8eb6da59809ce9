"""The functions `nnls` and `lsq`, which make a least-squares problem and solve it in
one call.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias, overload

import numpy as np

from lcpcli.clock import seconds
from lcpcli.formulations.least_squares.at_once import Fits, solved_at_once
from lcpcli.formulations.least_squares.fit import data_of, from_lsq
from lcpcli.formulations.least_squares.many_fits import FitBatch
from lcpcli.linalg.threads import limited_for
from lcpcli.model.right_hand_sides import dimensions
from lcpcli.solving.call import RunOptions, run
from lcpcli.solving.result import Result
from lcpcli.typing import BoundLike, Vector, VectorLike

if TYPE_CHECKING:
    from typing_extensions import Unpack


Columns: TypeAlias = np.ndarray[tuple[int, int], Any]


@overload
def nnls(A: Any, b: Columns, **options: Unpack[RunOptions]) -> FitBatch: ...


@overload
def nnls(A: Any, b: VectorLike, **options: Unpack[RunOptions]) -> Result: ...


def nnls(A: Any, b: Any, **options: Unpack[RunOptions]) -> Result | FitBatch:
    """Return the result of nonnegative least squares: the x >= 0 that minimizes |A x -
    b|, in `Result.answer`.

    A, b : shapes (m, n), dense or sparse, and (m,), as in `from_lsq`; or several b as
        columns, shape (m, k), for a `Batch` of results (see `lsq`).
    options : as in `run`.

    `answer.x` and `answer.norm` are what scipy.optimize.nnls returns. `answer` also has
    multipliers, and says whether another x fits as well, or hangs on rounding (see
    `lsq`). Raises ProblemError, which names the argument at fault.

    >>> import lcpcli
    >>> answer = lcpcli.nnls([[1, 1], [1, 2], [1, 3]], [1, 0, 1]).answer
    >>> answer.x.round(6).tolist(), round(answer.norm, 6)
    ([0.666667, 0.0], 0.816497)
    """
    fit: Result | FitBatch = lsq(A, b, 0.0, **options)
    return fit


@overload
def lsq(
    A: Any,
    b: Columns,
    lower: BoundLike = -math.inf,
    upper: BoundLike = math.inf,
    E: Any = None,
    d: VectorLike | None = None,
    **options: Unpack[RunOptions],
) -> FitBatch: ...


@overload
def lsq(
    A: Any,
    b: VectorLike,
    lower: BoundLike = -math.inf,
    upper: BoundLike = math.inf,
    E: Any = None,
    d: VectorLike | None = None,
    **options: Unpack[RunOptions],
) -> Result: ...


def lsq(
    A: Any,
    b: Any,
    lower: BoundLike = -math.inf,
    upper: BoundLike = math.inf,
    E: Any = None,
    d: VectorLike | None = None,
    **options: Unpack[RunOptions],
) -> Result | FitBatch:
    """Return the result of least squares: the x that minimizes |A x - b| subject to
    lower <= x <= upper and E x = d, in `Result.answer`.

    Parameters
    ----------
    A, b, lower, upper, E, d : as in `from_lsq`; by default there are no bounds, and no
        equations. b may have several vectors as columns, shape (m, k).
    options : as in `run`.

    Returns
    -------
    Result : its status is "solved" if the optimality conditions hold to the tolerance,
        relative to the scaling of each row and column, or "infeasible" if no x
        satisfies bounds and equations. `answer` has x, residual (b - A x), norm,
        multipliers and support; proved says whether x is "unique", one of "several",
        with another minimizer in `answer.other`, or determined only "up to rounding" of
        the data. Of several b, a `Batch` of such results, which share factors; its x
        has all coefficients, shape (k, n).

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
    began = seconds()
    if dimensions(b) == 2:
        data, labels = data_of(A, b, lower, upper, E, d)
        shared = data.A, data.lower, data.upper, data.E, data.d
        with limited_for(data.A):
            return FitBatch(Fits(data, labels), partial(_single, shared, options))
    if not options:
        data, labels = data_of(A, b, lower, upper, E, d)
        with limited_for(data.A):
            result = solved_at_once(Fits(data, labels), began)
        if result is not None:
            return result
    return run(from_lsq(A, b, lower, upper, E, d), **options)


def _single(shared: Any, options: Any, b: Vector) -> Result:
    A, lower, upper, *equations = shared
    E, d = equations if equations[1].size else (None, None)
    return run(from_lsq(A, b, lower, upper, E, d), **options)
