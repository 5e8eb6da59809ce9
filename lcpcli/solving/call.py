"""One call from M and q, or from a Problem, to a result."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypedDict, get_args

import numpy as np

from lcpcli.clock import seconds
from lcpcli.errors import OptionError, ParameterError, likely, unknown
from lcpcli.methods import registry as methods
from lcpcli.methods.direct import MAX_NARROW_AS_DENSE, stored
from lcpcli.model.problem import Problem, as_problem
from lcpcli.options import Limits
from lcpcli.solving import driver as driver
from lcpcli.solving.result import Result
from lcpcli.solving.trace import Callback, Trace
from lcpcli.typing import BoundLike, Interrupts, VectorLike

if TYPE_CHECKING:
    from typing_extensions import Unpack

RAISE: Interrupts = "raise"
INTERRUPTS = get_args(Interrupts)


class SolverOptions(TypedDict, total=False):
    """The options of every solver, as `solve` explains them; None, too, means the
    default."""

    tol: float | None
    max_iterations: int | None
    time_limit: float | None
    threads: int | None


class CallOptions(SolverOptions, total=False):
    """The options of every call."""

    trace: bool | Trace
    callback: Callback | None
    interrupts: Interrupts
    compiled: bool | None


class RunOptions(CallOptions, total=False):
    """The options of `solve` and `run`: at first those of all methods, then those that
    methods declare."""

    x0: VectorLike | None
    z0: VectorLike | None
    basis: Sequence[str] | None
    gap: float | None
    scale: bool
    finish: bool
    presolve: bool | None
    x1: VectorLike | None
    p: float | None
    k_star: int | None
    rho: float | None
    sigma: float | None
    omega: float | str | None
    anderson: int | None
    start_slack: float | None
    regularization: float | None
    cover: int | str | None
    ties: str | None
    beta: float | None
    walkers: int | None
    seed: int | None


class NonlinearOptions(CallOptions, total=False):
    """The options of `solve_mcp`."""

    proof: bool
    restarts: int | None
    difference_step: float | None


COMMON_OPTIONS = (
    *methods.START_OPTIONS,
    *CallOptions.__annotations__,
    "gap",
    *methods.ADDITIONS,
)
OF_PROBLEMS = ("name", "names", "solutions", "lower", "upper", "infinity")


def solve(
    M: Any,
    q: VectorLike,
    method: str = "auto",
    *,
    lower: BoundLike = 0.0,
    upper: BoundLike = math.inf,
    infinity: float = math.inf,
    **options: Unpack[RunOptions],
) -> Result:
    """Find z >= 0 with w = M z + q >= 0 and z'w = 0 or, with bounds, the z of
    `Problem`; arrays are never modified.

    Parameters
    ----------
    M, q : shape (n, n), dense or a scipy sparse matrix or array of any format, and
        shape (n,); as in `Problem`.
    lower, upper : bounds of z, each a number or of shape (n,), by default 0 and
        infinity; None means no bound.
    infinity : bounds of at least this size, often 1e20, are treated as infinite; by
        default only infinite bounds are.
    method : "auto", which combines several methods, or a published one, such as "shi"
        or "newton": `lcp help methods` says what each does and guarantees, and `lcp
        solve --help` names their sources.
    x0, z0, basis : at most one starting point: x = (z - w) / 2, or z, with w = M z + q,
        or a `Result.basis`, from which "auto" and "newton" then start. By default x0 =
        0.
    tol : the largest relative residual at which z is accepted as a solution, 1e-10 by
        default.
    max_iterations, time_limit : the iterations and seconds after which to give up, by
        default 10000 and no limit.
    gap : of a program: the largest error of the objective, relative to its size, at
        which it is accepted as solved; by default any (see `Result.objective_error`).
    trace : whether the result keeps all iterates; a `Trace` selects which ones, and
        receives them.
    callback : called after each iteration with its `TraceRow`; a true value, or
        StopIteration, stops the run.
    compiled : whether "auto" uses the kernels of the extra `fast`, for small LCPs.
        Loading them takes half a second, which pays in a loop over many calls. By
        default they are used after `use_kernels()`.
    threads : the number of threads for dense linear algebra, by default 1 unless the
        environment sets it or M is large.
    scale, finish : whether an iterative method, such as "shi", works on the
        equilibrated problem, and whether it stops as soon as the active set yields the
        solution.
    interrupts : what Ctrl-C does: "raise" the error `Interrupted`, or "return" the
        result with the best z so far.
    options : options of the method, such as p or k_star of "shi"; None means the
        default. See `lcp solve --help`.

    Returns
    -------
    Result : its status says whether z is a solution; if the run failed, which raises no
        error, z is the best iterate.

    Raises
    ------
    ProblemError, OptionError : M, q, a bound or the start cannot be used; the method is
        unknown, or an option is unknown, out of range or without effect on the method.
        Both errors are ValueErrors.
    Interrupted : Ctrl-C was pressed; it is a KeyboardInterrupt whose `result` is the
        Result so far.

    Examples
    --------
    >>> import lcpcli
    >>> result = lcpcli.solve([[2, 1], [1, 2]], [-5, -6])
    >>> result.status.word, result.z.round(6).tolist()
    ('solved', [1.333333, 2.333333])
    >>> lcpcli.solve([[2, 1], [1, 2]], [-5, -6], lower=[None, 0], upper=2).z.tolist()
    [1.5, 2.0]
    """
    began = seconds()
    if (
        method == "auto"
        and type(M) is np.ndarray
        and M.ndim == 2
        and M.dtype == np.float64
        and M.shape[0] == M.shape[1] > MAX_NARROW_AS_DENSE
    ):
        M = stored(M)  # which needs no copy of M
    return _run(
        Problem(M, q, lower=lower, upper=upper, infinity=infinity),
        method,
        options,
        began,
    )


def run(
    problem: Problem,
    method: str = "auto",
    **options: Unpack[RunOptions],
) -> Result:
    """Solve a Problem, for instance one from a file, as `solve` does, with the same
    options.

    Without a starting point, the run starts from the x0 of the problem, if it has one.
    If the problem has known solutions, the result gives the error; if it comes from a
    linear or quadratic program or a game, `Result.answer` has the minimizer or the
    equilibrium.

    >>> from lcpcli import Problem, run
    >>> problem = Problem([[2, 1], [1, 2]], [-5, -6], solutions=[[4 / 3, 7 / 3]])
    >>> run(problem, tol=1e-12).error < 1e-12
    True
    >>> failed = run(problem, "fixed-point", omega=50, max_iterations=3)
    >>> failed.solved, failed.message
    (False, 'stopped at the iteration limit')
    >>> run(problem, "newton", tol=2)
    Traceback (most recent call last):
    lcpcli.errors.ParameterError: tol: 2 is out of range; it must be: 0 < tol < 1
    """
    began = seconds()
    return _run(as_problem(problem), method, options, began)


class Interrupted(KeyboardInterrupt):
    """Ctrl-C has ended a call. `result` is the Result with the best iterate so far,
    which may be a solution.

    >>> import lcpcli
    >>> try:
    ...     result = lcpcli.solve([[2, 1], [1, 2]], [-5, -6])
    ... except lcpcli.Interrupted as interrupt:
    ...     result = interrupt.result
    >>> result.interrupted
    False
    """

    __module__ = "lcpcli"  # as it is imported from there

    def __init__(self, result: Result) -> None:
        self.result = result
        super().__init__(result.message)

    def __reduce__(self) -> tuple[type[Interrupted], tuple[Result]]:
        return type(self), (self.result,)


def unless_interrupted(result: Result, interrupts: str) -> Result:
    """Return the result, or raise Interrupted if Ctrl-C has ended the run and
    `interrupts` is "raise"."""
    if result.interrupted and interrupts == RAISE:
        raise Interrupted(result)
    return result


def _run(
    problem: Problem, method: str, options: Mapping[str, object], began: float
) -> Result:
    explicit_options, interrupts = {}, RAISE
    if options:
        explicit_options = chosen(options, COMMON_OPTIONS, method)
        interrupts = explicit_options.pop("interrupts", RAISE)
        explicit_options["trace"] = trace_of(explicit_options.get("trace"), method)
        explicit_options["limits"] = Limits.pop_from(explicit_options)
    result = driver.run(problem, method, began=began, **explicit_options)
    return unless_interrupted(result, interrupts) if result.interrupted else result


def trace_of(wanted: bool | Trace | None, method: str) -> Trace | None:
    """Return the trace that a call of the method is to fill; raise OptionError for
    columns that only other methods have."""
    if isinstance(wanted, Trace):
        methods.require_quantities(wanted.columns, [method])
        return wanted
    return Trace() if wanted else None


def chosen(
    options: Mapping[str, object],
    valid_names: Collection[str],
    method: str = "",
    of: str = "",
) -> dict[str, Any]:
    """Return the options that are not None, which means the default. Raise
    OptionError for an unknown value of `interrupts`, and for a name that is neither
    valid nor, if there is a method, an option of any method; its hint is a likely name.

    of : whose options they are, in words, if there is no method.
    """
    explicit_options = {
        name: value for name, value in options.items() if value is not None
    }
    if explicit_options.get("interrupts", RAISE) not in INTERRUPTS:
        raise ParameterError(
            "interrupts",
            unknown(explicit_options["interrupts"]),
            'give "raise" or "return"',
        )
    for name in (name for name in options if name not in valid_names):
        if method and name in OF_PROBLEMS:
            raise OptionError(
                name, "belongs to the problem", f"write Problem(M, q, {name}=...)"
            )
        method_options = methods.parameters_of(method) if method else []
        if not method or name not in {
            *method_options,
            *methods.OPTIONS,
            *methods.SWITCHES,
        }:
            names = [
                *(each for each in method_options if each not in valid_names),
                *valid_names,
            ]
            reason = f"is not an option of {method or of}"
            raise OptionError(
                name, reason, likely(name, names, f"it has {', '.join(names)}")
            )
    return explicit_options
