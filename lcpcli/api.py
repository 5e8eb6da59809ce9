"""One call from M and q to a result."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any

from numpy.typing import ArrayLike

from lcpcli import driver, methods
from lcpcli.errors import OptionError
from lcpcli.options import OPTIONS
from lcpcli.problem import Problem
from lcpcli.result import Result
from lcpcli.trace import Trace

OF_ALL = ("x0", "z0", "tol", "max_iterations", "time_limit", "scale", "finish", "trace")


def solve(
    M: Any,
    q: ArrayLike,
    method: str = "auto",
    *,
    x0: ArrayLike | None = None,
    z0: ArrayLike | None = None,
    tol: float | None = None,
    max_iterations: int | None = None,
    time_limit: float | None = None,
    trace: bool = False,
    **options: Any,
) -> Result:
    """Solve the LCP of M and q by a method; the arrays given are never changed.

    Parameters
    ----------
    M : shape (n, n); a dense array, nested sequences, or a scipy sparse matrix or array of any format.
    q : shape (n,).
    method : one of `lcpcli.methods.METHODS`.
    x0, z0 : the start, as x = (z - w) / 2 or as z with w = M z + q; at most one of them, by default x0 = 0.
    tol, max_iterations, time_limit : when to stop; None is the default of the command line.
    trace : whether the result keeps all iterates.
    options : options of the method, as on the command line with underscores; None is "not given".

    Raises
    ------
    ProblemError : M, q or a start cannot be used.
    OptionError : the method is unknown, or an option is unknown, out of its range or without effect on the method.
    """
    known = [name for name in methods.options_of(methods.load(method)) if name not in OF_ALL]
    for name in options:
        if name not in known and name not in OPTIONS and name not in methods.ADDITIONS:
            close = get_close_matches(name.casefold(), (*known, *OF_ALL), n=1)
            mend = f"did you mean {close[0]}?" if close else f"it has {', '.join((*known, *OF_ALL))}"
            raise OptionError(name, f"is no option of {method}", mend)
    stops: dict[str, Any] = {"tol": tol, "max_iterations": max_iterations, "time_limit": time_limit}
    limits = driver.Limits(**{name: value for name, value in stops.items() if value is not None})
    chosen = {name: value for name, value in options.items() if value is not None}
    return driver.run(Problem(M, q), method, x0, z0=z0, limits=limits, trace=Trace() if trace else None, **chosen)
