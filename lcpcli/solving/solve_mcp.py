"""One call from F and J to a result of a nonlinear complementarity problem, by linear
problems, which have to yield a good step, not a proof."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.basis.free_variables import WithoutFree
from lcpcli.clock import Stopwatch, imports, seconds
from lcpcli.errors import (
    LEAVE_OUT,
    LCPError,
    ParameterError,
    ProblemError,
    missing,
    out_of_range,
)
from lcpcli.linalg.doubles import is_finite
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.threads import with_limited_threads
from lcpcli.methods import registry as methods
from lcpcli.methods.direct import MAX_PIVOTED, MAX_UNKNOWNS, may_be_program
from lcpcli.methods.josephy_newton import josephy_newton
from lcpcli.methods.lemke import SHORT_PATH
from lcpcli.model.arrays import FROM_0, as_vector
from lcpcli.model.box import Box, in_words
from lcpcli.model.evaluations import Evaluations
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.model.problem import Problem
from lcpcli.model.words import Start
from lcpcli.options import DEFAULTS, Limits
from lcpcli.solving import driver
from lcpcli.solving.call import (
    RAISE,
    NonlinearOptions,
    chosen,
    trace_of,
    unless_interrupted,
)
from lcpcli.solving.direct_run import (
    Session,
    direct_steps,
    exhausted,
    program_steps,
    uses_kernels,
)
from lcpcli.solving.direct_run import compiled as kernels
from lcpcli.solving.loop import Loop
from lcpcli.solving.observers import Seen
from lcpcli.solving.result import Result, Status
from lcpcli.solving.trace import Callback, Trace
from lcpcli.typing import BasisStatus, BoundLike, Interrupts, Matrix, Vector, VectorLike
from lcpcli.verify.acceptance import AS_IT_IS, Extent, accepted
from lcpcli.verify.nonlinear_point import (
    NonlinearCriterion,
    NonlinearPoint,
    proved_bound,
)

if TYPE_CHECKING:
    from typing_extensions import Unpack

METHOD = "josephy-newton"
MOVES = 1e-2, 1e-1, 1.0  # of all components, from a start where F is not finite


def solve_mcp(
    F: Callable[[Vector], Any] | NonlinearProblem,
    J: Callable[[Vector], Any] | None = None,
    *,
    lower: BoundLike = 0.0,
    upper: BoundLike = math.inf,
    infinity: float = math.inf,
    x0: VectorLike | None = None,
    names: Sequence[str] = (),
    pattern: Any = None,
    jax: bool = False,
    z0: VectorLike | None = None,
    **options: Unpack[NonlinearOptions],
) -> Result:
    """Find l <= z <= u with F_i(z) >= 0 where z_i < u_i and F_i(z) <= 0 where z_i >
    l_i: a nonlinear complementarity problem or, where z_i has neither bound, an
    equation F_i(z) = 0.

    Parameters
    ----------
    F : a function from z, shape (n,), to n numbers. Outside its domain it may return
        nan or infinity, or raise an ArithmeticError: steps are then cut back. Or a
        NonlinearProblem, as `read_nl` returns it, instead of all arguments up to names.
    J : a function from z to the Jacobian of F, shape (n, n), dense or a scipy sparse
        matrix or array. By default it is computed by finite differences, of which F
        needs about half of its digits.
    lower, upper, infinity : bounds of z, as in `solve`.
    z0 : the z to start from, shape (n,), moved within the bounds; by default the z
        within the bounds that is closest to 0. Where F is not finite there, it is moved
        a little further inside. With a NonlinearProblem it replaces that of the
        problem. x0 is another name of it; in `solve` that is (z - w) / 2.
    names : the names of the unknowns, for `result["name"]`, messages and tables.
    pattern : for finite differences, a sparse matrix that is not 0 where J may not be;
        by default it is determined by 2 n evaluations if n > 100, and J is dense for
        smaller n.
    jax : whether J is computed by jax, for an F that jax can trace.
    proof : whether, if it is solved, `bound` is a proved bound on |z - z*|_inf for a
        solution z*, the only one that close, by interval arithmetic, which a problem
        from `read_nl` has.
    difference_step : the step of finite differences, relative to each z_j, or to 1
        where that is smaller; by default 1.5e-8, or what suits F where it is noisy or
        changes fast.
    restarts : how many other attempts are made where the method gets stuck, the first
        three from the same start; by default 12, or with at most 200 unknowns as many
        of these as take about a second, by counted work.
    tol, max_iterations, time_limit, trace, callback, threads, interrupts, compiled : as
        in `solve`; an iteration is a step of Newton's method, and solves a linear
        complementarity problem.

    Returns
    -------
    Result : z, w = F(z) and all else that `solve` returns. "Solved" claims that F,
        evaluated at z once more, violates no row by more than tol times its terms |J|
        |z| + |F - J z|, which differences of F confirm, or than the noise of rounding
        in F; see `verify.nonlinear_point`. The message says where F is noisy, and where
        J is wrong. Any other status proves nothing: where the method stalls, the
        problem may have solutions elsewhere. `problem` is the linear problem with M =
        J(z) and w(z) = F(z), which has the same z; so `derivative` and `gradient` are
        those of the nonlinear problem, with dq for the change of F by a parameter.

    Raises
    ------
    ProblemError, OptionError, Interrupted : as `solve` does; ProblemError also if F or
        J returns anything but numbers of the right shape, or F is not finite close to
        x0.

    Examples
    --------
    The price at which the supply p + p^2 / 4 meets the demand 9 / (1 + p):

    >>> import lcpcli
    >>> result = lcpcli.solve_mcp(lambda p: p + p**2 / 4 - 9 / (1 + p), x0=[1.0])
    >>> result.status.word, result.z.round(6).tolist(), result.route
    ('solved', [2.0], ('josephy-newton',))
    """
    began = seconds()
    explicit_options = chosen(options, NonlinearOptions.__annotations__, of="solve_mcp")
    if isinstance(F, NonlinearProblem):
        others: dict[str, tuple[Any, Any]]
        others = {
            "lower": (lower, 0.0),
            "upper": (upper, math.inf),
            "infinity": (infinity, math.inf),
            "J": (J, None),
        }
        others |= {
            "x0": (x0, None),
            "names": (names or None, None),
            "jax": (jax, False),
        }
        for name, (value, default) in others.items():
            if np.ndim(value) or value != default:
                raise ParameterError(
                    name,
                    "has no effect on a NonlinearProblem, which has one already",
                    LEAVE_OUT,
                )
        problem = F if z0 is None else F.starting_at(z0)
    else:
        if x0 is not None and z0 is not None:
            raise ParameterError(
                "x0", "is another name of z0, which is passed too", LEAVE_OUT
            )
        x0 = x0 if z0 is None else as_vector("z0", z0)
        if jax:
            F, J = by_jax(F, J)
        problem = NonlinearProblem(
            F, J, lower=lower, upper=upper, infinity=infinity, x0=x0, names=names
        )
        if z0 is not None:
            problem = problem.starting_at(z0)
    return run_nonlinear(
        problem,
        pattern=pattern,
        began=began,
        limits=Limits.pop_from(explicit_options),
        **explicit_options,
    )


@with_limited_threads
def run_nonlinear(
    problem: NonlinearProblem,
    *,
    pattern: Any = None,
    began: float | None = None,
    limits: Limits = DEFAULTS,
    trace: bool | Trace = False,
    curve: Trace | None = None,
    callback: Callback | None = None,
    threads: int | None = None,  # noqa: ARG001 (the decorator limits them)
    interrupts: Interrupts = RAISE,
    proof: bool = False,
    compiled: bool | None = None,
    difference_step: float | None = None,
    **chosen: Any,
) -> Result:
    """Return the result for a NonlinearProblem, with the options of `solve_mcp`.

    began : the beginning of the run, by default now. curve : a trace for figures. proof
    : whether, if it is solved, its `bound` is a proof that a solution is as close as
        that, and no other one is; this needs the problem's `interval`.
    """
    driver.check_callback(callback)
    methods.check(METHOD, chosen)
    _check_step(problem, difference_step)
    is_compiled = uses_kernels(compiled, 1) and kernels() is not None
    options = methods.declared(METHOD).options
    in_force = {each.name: chosen.get(each.name, each.default) for each in options}
    kept_trace = trace_of(trace, METHOD)
    stopwatch = Stopwatch(seconds, seconds() if began is None else began)
    evaluations = Evaluations(problem, pattern, difference_step)
    start = _start(evaluations)
    with np.errstate(all="ignore"):
        criterion = NonlinearCriterion(evaluations, limits.tol)
        linear = partial(
            solution_of_linearization, evaluations=evaluations, is_compiled=is_compiled
        )
        stage = partial(
            josephy_newton,
            evaluations,
            start,
            linear,
            **in_force,
            is_brief="restarts" not in chosen,
        )
        stopwatch.count("setup")
        seen = Seen((kept_trace, curve), None, callback)
        session = Session(criterion.problem, limits, in_force, stopwatch)
        loop = Loop(session, criterion, METHOD, start / 2, seen)
        if is_compiled:
            in_force["compiled"] = True
        result = driver.ended(loop, stage)
        if result.status in (Status.SOLVED, Status.STALLED):
            result = _with_remarks(result)
    if proof and result.solved:
        result = replace(result, bound=proved_bound(problem, result.z))
    return unless_interrupted(result, interrupts)


def _check_step(problem: NonlinearProblem, difference_step: float | None) -> None:
    """Raise ParameterError for an invalid step of finite differences."""
    if difference_step is None:
        return
    if problem.J is not None:
        raise ParameterError(
            "difference_step",
            "has no effect on a J that is supplied",
            "leave one of them out",
        )
    if not 0 < difference_step < 1:
        raise ParameterError(
            "difference_step",
            out_of_range(f"{difference_step:g}"),
            "give one between 0 and 1",
        )


def _with_remarks(result: Result) -> Result:
    """Return the result with what is known of F and J at its z."""
    point = result.point
    assert isinstance(point, NonlinearPoint)
    is_refuted = point.is_doubtful and not result.solved
    return replace(
        result,
        message="; ".join([result.message, *point.remarks()]),
        verified=False if is_refuted else result.verified,
    )


def _start(evaluations: Evaluations) -> Vector:
    """Return x0 or, if F is not finite there, the first of a few points further inside
    the bounds where it is; raise ProblemError if there is none."""
    problem, z = evaluations.problem, evaluations.problem.x0
    F = evaluations.known_values(z)
    towards = np.where(problem.upper - z < z - problem.lower, -1.0, 1.0)
    for move in () if is_finite(F) else MOVES:
        moved = problem.box.project(z + move * towards)
        if is_finite(evaluations.known_values(moved)):
            return moved
    if (undefined := problem.undefined(z)) is not None:
        i, value = undefined
        row = (
            f"F is {value} there, in row {problem.names[i]}"
            if problem.names[i]
            else f"F[{i}] is {value} there"
        )
        name = problem.start_name
        raise ProblemError(name, row, f"start where F is defined and finite {FROM_0}")
    return z


def by_jax(F: Callable[[Vector], Any], J: Any) -> list[Callable[[Vector], Any]]:
    """Return F and its Jacobian by jax, both in double precision, whatever the usual
    precision of jax is."""
    if J is not None:
        raise ParameterError(
            "jax", "computes J, which is passed too", "leave one of them out"
        )
    with imports:
        try:
            import jax
        except ModuleNotFoundError:
            raise ParameterError("jax", *missing("jax")) from None
        try:
            from jax import enable_x64
        except ImportError:  # as before version 0.8
            from jax.experimental import enable_x64

    def in_doubles(function: Callable[[Vector], Any], z: Vector) -> Any:
        with enable_x64(True):
            return np.asarray(function(z))

    return [partial(in_doubles, jax.jit(traced)) for traced in (F, jax.jacfwd(F))]


# Limits of every linearization, also of one that `run` solves: one that takes more
# iterations may have no solution, and further digits make no step better, as F measures
# each step, and the next step has another linearization.
LINEAR = Limits(tol=1e-8, max_iterations=100)
# The acceptance test of a step that is worthwhile, although z is no solution.
STEP = Extent(AS_IT_IS, share=1e-2)
PIVOTS_OF_RUN = 250  # whose time is that of what `run` does besides


def solution_of_linearization(
    M: Matrix,
    q: Vector,
    box: Box,
    basis: BasisStatus | None,
    longer: bool,
    evaluations: Evaluations,
    is_compiled: bool,
) -> tuple[Vector, BasisStatus] | None:
    """Return a solution of the linear problem, or a point that almost solves it, and
    its basis; None if there is neither.

    basis : the basis from which pivoting starts; None for that of the start. longer :
    whether a problem with few unknowns, on which else only the attempts of a step are
    made, is passed to `run` with its proofs. evaluations : whose pivots are counted.
    is_compiled : whether kernels are used.
    """
    if longer and q.size > MAX_UNKNOWNS:
        return None
    try:
        problem = Problem(M, q, lower=box.lower, upper=box.upper)
        if not longer and problem.n <= MAX_PIVOTED:
            return _step(problem, basis, evaluations, is_compiled)
        if may_be_program(problem):
            session = _session(problem, is_compiled)
            answer = exhausted(program_steps(session))
            if answer is not None:
                evaluations.pivots += PIVOTS_OF_RUN
                return _with_states(answer)
        if not longer and is_sparse(problem.M):
            with suppress(SingularMatrix):
                without_free = WithoutFree(problem)
                within = None if basis is None else basis[without_free.bounded]
                point_and_states = _step(
                    without_free.reduced, within, evaluations, is_compiled
                )
                if point_and_states is None:
                    return None
                z, statuses = without_free.recover(*point_and_states)
                return (z, statuses) if _is_step(problem, z) else None
        result = driver.run(
            problem,
            "auto",
            basis=None if basis is None else in_words(basis),
            limits=LINEAR,
            compiled=is_compiled,
        )
    except LCPError:  # numbers overflow
        return None
    if result.interrupted:
        raise KeyboardInterrupt
    # The pivots of a run without a solution, which takes longest, are counted too.
    evaluations.pivots += PIVOTS_OF_RUN + result.evaluations
    if result.solved or _is_step(problem, result.z):
        return _with_states(result)
    return None


def _is_step(problem: Problem, z: Vector) -> bool:
    return accepted(problem, [z], LINEAR.tol, STEP) is not None


def _with_states(result: Result) -> tuple[Vector, BasisStatus]:
    """Return the z of a result with its basis."""
    z, final_basis = result.z, result.end
    return z, result.problem.box.basis_at(z) if final_basis is None else final_basis


def _session(
    problem: Problem, is_compiled: bool, start: Start | None = None
) -> Session:
    """Return a session on a linearization, in which a good step is accepted."""
    stopwatch = Stopwatch(seconds, seconds())
    return Session(problem, LINEAR, {}, stopwatch, is_compiled, start, extent=STEP)


def _step(
    problem: Problem,
    basis: BasisStatus | None,
    evaluations: Evaluations,
    is_compiled: bool,
) -> tuple[Vector, BasisStatus] | None:
    """Return the z and basis that the attempts of a step reach on a problem with few
    unknowns, from a basis of another problem; without one, from that of the reference
    point if there are more than SHORT_PATH unknowns. None if there is no step."""
    if basis is None and problem.n > SHORT_PATH:
        basis = problem.box.basis_at(problem.reference_point, problem.q_ref)
    start = None if basis is None else Start(problem, basis)
    session = _session(problem, is_compiled, start)
    with np.errstate(all="ignore"):
        result = exhausted(direct_steps(session))
    if result is None:
        evaluations.pivots += session.evaluations
        return None
    evaluations.pivots += result.evaluations
    return _with_states(result)
