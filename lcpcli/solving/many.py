"""Many problems, one result after another: problems that share M are solved together, in blocks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Set, Sized
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from lcpcli.clock import Stopwatch, seconds
from lcpcli.errors import ParameterError, ProblemError
from lcpcli.linalg.doubles import SMALL_DISTANCE
from lcpcli.linalg.factors import LONG_LU
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.threads import with_limited_threads
from lcpcli.methods import registry as methods
from lcpcli.methods.block_pivoting import Frame, Pivoted, frame_of, in_given_variables, pivoted, refined
from lcpcli.methods.direct import CANDIDATE, CERTAIN, NOTHING, applies
from lcpcli.model.right_hand_sides import Columns, Stack, dimensions
from lcpcli.options import THREADS, Limits
from lcpcli.solving import batch, direct_run
from lcpcli.solving.batch import Batch, BlockAnswers
from lcpcli.solving.call import COMMON_OPTIONS, RunOptions, SolverOptions, chosen, run
from lcpcli.solving.result import Result
from lcpcli.solving.solver import SequenceSteps, Solver
from lcpcli.typing import BoundLike, Mask, Vector
from lcpcli.verify.measure import Measure

if TYPE_CHECKING:
    from types import ModuleType

    from typing_extensions import Unpack

    from lcpcli.model.problem import Problem

AUTO = "auto"
FEWEST_COLUMNS = 4  # fewer columns are faster by themselves
FIRST_BLOCK, BLOCK_GROWTH = 64, 4  # columns of the first block, so that results come soon, and growth of the next ones
BLOCK_NUMBERS = 1 << 16  # in each array of a block, so that a few arrays stay in the cache


@overload
def solve_many(
    M: np.ndarray[tuple[int, int, int], Any],
    Q: Any,
    method: str = "auto",
    *,
    lower: BoundLike = 0.0,
    upper: BoundLike = math.inf,
    infinity: float = math.inf,
    **options: Unpack[RunOptions],
) -> Batch: ...


@overload
def solve_many(
    M: Any,
    Q: Any = None,
    method: str = "auto",
    *,
    lower: BoundLike = 0.0,
    upper: BoundLike = math.inf,
    infinity: float = math.inf,
    sequence: bool = False,
    **options: Unpack[RunOptions],
) -> Iterator[Result]: ...


def solve_many(
    M: Any,
    Q: Any = None,
    method: str = "auto",
    *,
    lower: BoundLike = 0.0,
    upper: BoundLike = math.inf,
    infinity: float = math.inf,
    sequence: bool = False,
    **options: Unpack[RunOptions],
) -> Iterator[Result] | Batch:
    """Solve many problems: one result for each of some Problems, or for each column of Q with one M, in order.

    Each result is computed when it is requested. For columns of Q, blocks of columns are solved together if M is dense
    with n < 2000, or sparse with n <= 200 (`lcpcli.methods.block_pivoting`), in a fraction of the time of a loop over
    `solve`. Other columns are solved one by one, each from the states of the previous solution where that is faster.
    Problems that are not solved in this way are passed to `run`, so that every result is verified, and every failure
    is proved or explained. If a problem has several solutions, the one found may differ from that of `run`.

    With an M for each q, that is M of shape (b, n, n) and q of shape (b, n), the call solves all problems at once and
    returns a `Batch`, which also has arrays of all solutions and their derivatives.

    Parameters
    ----------
    M, Q : M of shape (n, n) as in `solve`, and the right-hand sides q as columns of Q, shape (n, k), or as an iterator,
        from which each q of shape (n,) is taken when its result is requested (see `Solver`). In their place, an
        iterable of Problems, which may be followed by the method; or M of shape (b, n, n) and q of shape (b, n). M is
        copied at the call, Q as results are requested.
    lower, upper : bounds of z, each a number, of shape (n,), or of shape (n, k) with a column for each problem; for a
        batch, of shape (b, n).
    infinity : bounds of at least this size, often 1e20, count as infinite; by default only infinite bounds do.
    compiled : whether to use the kernels of the extra `fast`, which take half a second to load; by default they are
        used after `use_kernels()`, and for at least 1000 columns, problems of a batch or Problems in a list; an
        iterator has no length, so that it must ask for them.
    sequence : whether each of the Problems is solved from the states of the previous one, where these are near, as by a
        `Solver`; M and n may change.
    method, options : as in `solve`, for every problem; a time limit applies to each of them. With options other than
        tol, max_iterations, time_limit, threads, interrupts and compiled, columns are solved one by one. With
        interrupts="return", Ctrl-C ends a problem that is being solved by itself: its result is `interrupted`, and the
        next problem follows.

    Yields
    ------
    Result : for each problem, as from `run`. Its seconds are an equal share of the time of its block. A batch is a
        sequence of such results.

    Raises
    ------
    ProblemError, OptionError : as for `solve`, at the call; in a stream of Problems, when the problem's turn comes.
    KeyboardInterrupt : Ctrl-C was pressed. For a problem that is solved by itself it is Interrupted, unless
        `interrupts` is "return".

    Examples
    --------
    >>> import lcpcli
    >>> [result.z.tolist() for result in lcpcli.solve_many([[2, 0], [0, 4]], [[-4, 2, 1], [2, -4, 1]])]
    [[2.0, 0.0], [0.0, 1.0], [0.0, 0.0]]
    >>> problems = (lcpcli.Problem([[2]], [q]) for q in (-2, 2))
    >>> [result.z.tolist() for result in lcpcli.solve_many(problems)]
    [[1.0], [0.0]]
    """
    if isinstance(Q, str):
        Q, method = None, Q
    kept = {*methods.SWITCHES, "compiled"}
    given = chosen(options, COMMON_OPTIONS, method)
    given = {name: value for name, value in given.items() if value is not False or name in kept}
    methods.check(method, {name: value for name, value in given.items() if name not in COMMON_OPTIONS})
    if "threads" in given:
        THREADS.check(given["threads"])
    limits = Limits.taken_from({**given})
    if Q is None:
        _refuse_as_problems(M, lower=lower, upper=upper, infinity=infinity)
        if sequence:
            _refuse_in_sequence(method, given.keys() - {"interrupts"}, "a sequence", "leave it out")
            return map(SequenceSteps(given).solve, M)
        return _one_by_one(M, method, given)
    if sequence:
        raise ParameterError("sequence", "is for Problems", "leave it out, or give q one by one, as by iter(Q.T)")
    if isinstance(Q, Iterator):
        return _sequence(M, Q, method, given, lower=lower, upper=upper, infinity=infinity)
    if dimensions(M) == 3:
        return Batch(Stack(M, Q, lower, upper, infinity), method, limits, given)
    columns = Columns(M, Q, lower, upper, infinity)
    if method != AUTO or not given.keys() <= batch.BLOCK_OPTIONS or columns.k < FEWEST_COLUMNS:
        return _one_by_one(columns.problems(), method, given)
    if is_sparse(columns.M) or columns.n >= LONG_LU:  # a step for a block takes too long for time limits and Ctrl-C
        return one_after_another(columns, given)
    return _by_blocks(columns, limits, given)


def _one_by_one(problems: Iterable[Problem], method: str, given: dict[str, Any]) -> Iterator[Result]:
    wanted, number = given.get("compiled"), len(problems) if isinstance(problems, Sized) else 0
    compiled = direct_run.uses_kernels(wanted, number) if method == AUTO else bool(wanted)
    for problem in problems:
        yield run(problem, method, **{**given, "compiled": compiled})


def _sequence(M: Any, Q: Iterator[Any], method: str, given: dict[str, Any], **bounds: Any) -> Iterator[Result]:
    """Return the results of a Solver for one q after another."""
    _refuse_in_sequence(method, given.keys(), "an iterator of q", "give their columns as Q, of shape (n, k)")
    solver = Solver(M, **bounds, **given)
    return map(solver.solve, Q)


def _refuse_in_sequence(method: str, names: Set[str], what: str, hint: str) -> None:
    """Raise ParameterError for another method than auto, and for options that a Solver does not have."""
    for name in [*sorted(names - SolverOptions.__annotations__.keys()), *["method"] * (method != AUTO)]:
        raise ParameterError(name, f"has no effect on {what}", hint)


def _refuse_as_problems(problems: Any, **bounds: Any) -> None:
    """Raise ProblemError or OptionError unless the problems are an iterable of Problems, given without bounds."""
    if not isinstance(problems, Iterable) or is_sparse(problems) or isinstance(problems, np.ndarray):
        raise ProblemError("Q", "is missing", "give M and Q, or an iterable of Problems")
    for name, bound in bounds.items():
        if not np.isscalar(bound) or bound != (0.0 if name == "lower" else math.inf):
            raise ParameterError(name, "has no effect on Problems, which have their own bounds", "leave it out")


def _by_blocks(columns: Columns, limits: Limits, given: dict[str, Any]) -> Iterator[Result]:
    like = columns.like
    is_direct = applies(like) and not is_sparse(like.M)
    is_compiled = direct_run.uses_kernels(given.get("compiled"), columns.k)
    fast = direct_run.compiled() if is_direct and is_compiled else None
    first, size, most = 0, FIRST_BLOCK, max(FIRST_BLOCK, BLOCK_NUMBERS // max(1, columns.n))
    while first < columns.k:
        last = min(first + size, columns.k)
        rows = _solved(columns, first, last, limits, fast, threads=given.get("threads"))
        for i in range(last - first):
            result = rows.result(i)
            yield rows.with_share(run(rows.block.problem(i), **given)) if result is None else result
        first, size = last, min(size * BLOCK_GROWTH, most)


@with_limited_threads
@np.errstate(all="ignore")
def _solved(
    columns: Columns,
    first: int,
    last: int,
    limits: Limits,
    fast: ModuleType | None,
    threads: int | None,  # noqa: ARG001 (the decorator limits them)
) -> BlockAnswers:
    """Return the answers to columns first to last - 1: by the measures of the block, or else by the row's own."""
    stopwatch = Stopwatch(seconds, seconds())
    block = columns.block(first, last)
    if fast is not None and block.box.is_orthant:
        data = columns.like.M[np.newaxis], block.q, np.array([columns.like.largest])
        return batch.answers(block, limits, stopwatch, lambda: fast.direct_many(*data, limits.tol), compiled=True)
    measure, frame = Measure(block), frame_of(block)
    ready: Mask = np.asarray((measure.reference_violations <= 0).all(axis=1))
    stopwatch.count("setup")
    R, C = (np.exp2(powers) for powers in (block.units.rows, block.units.columns))
    found = pivoted(frame, ~ready, R, C, limits.max_iterations, lambda: stopwatch.elapsed() > limits.time_limit)
    z = in_given_variables(frame, found.z)
    stopwatch.count("solve")
    surely = ready | (found.ended & _refined(frame, measure, found, z, limits.tol))
    stopwatch.count("verify")
    kinds = np.where(surely, CERTAIN, np.where(found.ended, CANDIDATE, NOTHING))
    return BlockAnswers(block, z, kinds, found.steps, limits, stopwatch, found.by_gradient)


def _refined(frame: Frame, measure: Measure, found: Pivoted, z: Vector, tol: float) -> Mask:
    """Refine in place those z, of shape (m, n), whose residual may be more than rounding; return which of all z surely
    solve their problems, shape (m,)."""
    given = measure.rows(z)
    solved = measure.surely_solves(z, given, min(tol, SMALL_DISTANCE))
    rows = (found.ended & ~solved).nonzero()[0]
    if rows.size:
        part = frame.block.part(rows)
        again, better_z = Measure(part), in_given_variables(frame_of(part), refined(frame, found, rows, given.w[rows]))
        better = again.rows(better_z)
        before, after = again.largest_ratio(z[rows], given.part(rows)), again.largest_ratio(better_z, better)
        solved[rows] = np.minimum(before, after) <= tol
        kept = after < before
        z[rows[kept]] = better_z[kept]
    return solved


def one_after_another(columns: Columns, given: dict[str, Any]) -> Iterator[Result]:
    """Yield the results for all columns, in order; `given` are the options."""
    solver = Solver.of(columns.like, given)
    for problem in columns.problems():
        yield solver.next(problem)
