"""One call from M and q to a result."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from numpy.typing import ArrayLike

from lcpcli.clock import seconds
from lcpcli.errors import OptionError, likely
from lcpcli.methods import registry as methods
from lcpcli.model.problem import Problem
from lcpcli.solving import run as driver
from lcpcli.solving.limits import Limits
from lcpcli.solving.result import Result
from lcpcli.solving.trace import Trace

COMMON_OPTIONS = ("x0", "z0", "tol", "max_iterations", "time_limit", "scale", "finish", "trace", "threads")


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
    """Find z >= 0 with w = M z + q >= 0 and z'w = 0; the arrays passed in are never modified.

    Parameters
    ----------
    M : shape (n, n); a dense array, nested sequences, or a scipy sparse matrix or array of any format.
    q : shape (n,).
    method : "auto", which combines several methods, or a published one: "shi" (El foutayeni and Khaladi
        2012), "fixed-point" (Schäfer 2004), "newton" (Kostreva 1978; Júdice and Pires 1994), "lemke" (Lemke 1965),
        "milp" (Pardalos and Rosen 1988). Their modules in `lcpcli.methods` give the sources.
    x0, z0 : the start, as x = (z - w) / 2 or as z with w = M z + q; at most one of them, by default x0 = 0.
    tol : the largest relative residual at which z counts as a solution, 1e-10 by default.
    max_iterations, time_limit : when to give up: by default after 10000 iterations, with no time limit (in seconds).
    trace : whether the result keeps all iterates.
    options : options of the method, as on the command line with underscores; None means "not given". For "shi" p,
        k_star, rho, sigma and x1, for "fixed-point" omega and anderson, for both scale and finish; for all threads, the
        number used for dense linear algebra, by default one unless the environment sets it or M is very large.

    Returns
    -------
    Result : its status says whether z is a solution; if it failed, z is still the best one found. A problem that is
        hard or has no solution never raises an error.

    Raises
    ------
    ProblemError : M, q or the start cannot be used.
    OptionError : the method is unknown, or an option is unknown, out of range or without effect on the method.

    Examples
    --------
    >>> import lcpcli
    >>> result = lcpcli.solve([[2, 1], [1, 2]], [-5, -6])
    >>> result.status.word, result.z.round(6).tolist()
    ('solved', [1.333333, 2.333333])
    >>> failed = lcpcli.solve([[2, 1], [1, 2]], [-5, -6], "fixed-point", omega=50, max_iterations=3)
    >>> failed.solved, failed.message
    (False, 'stopped at the iteration limit')
    >>> failed.advice
    'try --method auto, or --scale --finish, with --max-iterations 10000'
    >>> lcpcli.solve([[2, 1]], [-5, -6])
    Traceback (most recent call last):
    lcpcli.errors.ProblemError: M: is 1 x 2; make it square
    """
    began = seconds()
    _refuse_unknown(method, options)
    limits = _given({"tol": tol, "max_iterations": max_iterations, "time_limit": time_limit})
    stops, kept = Limits(**limits) if limits else None, Trace() if trace else None
    return driver.run(Problem(M, q), method, x0, z0=z0, limits=stops, trace=kept, began=began, **_given(options))


def _given(options: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in options.items() if value is not None}


def _refuse_unknown(method: str, names: Collection[str]) -> None:
    """Raise OptionError for a name that is not an option of any method, with those that this method has."""
    if not names:
        return
    known = [name for name in methods.parameters_of(method) if name not in COMMON_OPTIONS]
    for name in names:
        if name not in {*known, *COMMON_OPTIONS, *methods.OPTIONS, *methods.ADDITIONS}:
            hint = likely(name, (*known, *COMMON_OPTIONS), f"it has {', '.join((*known, *COMMON_OPTIONS))}")
            raise OptionError(name, f"is not an option of {method}", hint)
