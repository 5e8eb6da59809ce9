"""Many problems: one result after another, or all at once; those with one M, or of one
size, are solved together."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set, Sized
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, overload

import numpy as np

from lcpcli.clock import Stopwatch, seconds
from lcpcli.errors import IS_MISSING, LEAVE_OUT, ParameterError, ProblemError
from lcpcli.linalg.doubles import SMALL_DISTANCE
from lcpcli.linalg.factors import LONG_LU
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.threads import with_limited_threads
from lcpcli.methods import registry as methods
from lcpcli.methods.block_pivoting import (
    Frame,
    ManyPivotingResult,
    frame_of,
    in_given_variables,
    refine_once,
    solve_many_by_pivoting,
)
from lcpcli.methods.direct import (
    CANDIDATE,
    CERTAIN,
    MAX_UNKNOWNS,
    NOTHING,
    applies,
    direct_many,
)
from lcpcli.model import views
from lcpcli.model.right_hand_sides import Block, Columns, Stack, dimensions
from lcpcli.options import THREADS, Limits
from lcpcli.solving import direct_run
from lcpcli.solving.call import COMMON_OPTIONS, RunOptions, SolverOptions, chosen, run
from lcpcli.solving.result import Result
from lcpcli.solving.solver import Solver
from lcpcli.typing import BoundLike, Mask, Vector
from lcpcli.verify.acceptance import AT_ONCE, accepted
from lcpcli.verify.measure import Measure
from lcpcli.verify.point import Criterion, Point

if TYPE_CHECKING:
    from types import ModuleType

    from typing_extensions import Unpack

    from lcpcli.model.problem import Problem
    from lcpcli.solving.derivatives import BatchDerivative, BatchGradient

AUTO = "auto"
# Options with which problems are solved together.
BLOCK_OPTIONS = {*SolverOptions.__annotations__, "interrupts", "compiled"}
ROUTES: tuple[tuple[str, ...], ...] = (("auto",), ("newton",), ("gradient", "newton"))
# Unknowns up to which all bounded problems together take less time than kernels for
# each.
FEW_TOGETHER = 12
MIN_COLUMNS = 4  # fewer columns are faster by themselves
# Columns of the first block, so that results come soon, and growth of the next ones.
FIRST_BLOCK, BLOCK_GROWTH = 64, 4
# Numbers in each array of a block, so that a few arrays stay in the cache.
BLOCK_NUMBERS = 1 << 16

Unsolved: TypeAlias = Literal["raise", "nan"]


class ManyOptions(RunOptions, total=False):
    """The options of `solve_many`."""

    lower: BoundLike
    upper: BoundLike
    infinity: float
    sequence: bool


@overload
def solve_many(
    M: np.ndarray[tuple[int, int, int], Any],
    Q: Any,
    method: str = "auto",
    **options: Unpack[ManyOptions],
) -> Batch: ...


@overload
def solve_many(
    M: Any, Q: Any = None, method: str = "auto", **options: Unpack[ManyOptions]
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
    """Solve many problems: one result for each of some Problems, or for each column of
    Q with one M, in order.

    Each result is computed when it is requested. For columns of Q, blocks of columns
    are solved together if M is dense with n < 2000, or sparse with n <= 200
    (`lcpcli.methods.block_pivoting`), in a fraction of the time of a loop over `solve`;
    others one by one, each from the basis of the previous solution where that is
    faster. Problems that are not solved in this way are passed to `run`, so that every
    result is verified, and every failure is proved or explained. If a problem has
    several solutions, the result may differ from that of `run`.

    Parameters
    ----------
    M, Q : M of shape (n, n) as in `solve`, and the right-hand sides q as columns of Q,
        shape (n, k), or as an iterator, from which each q of shape (n,) is taken when
        its result is requested (see `Solver`). Instead of these, an iterable of
        Problems, which may be followed by the method; or, for a batch that is solved at
        once, M of shape (b, n, n) and q of shape (b, n). M is copied at the call, Q as
        results are requested.
    lower, upper, infinity : as in `solve`; bounds may also have a column for each
        problem, shape (n, k), or for a batch a row, shape (b, n).
    compiled : as in `solve`; by default kernels are also used for at least 1000
        columns, problems of a batch or Problems in a list. An iterator has no length,
        so that kernels have to be requested.
    sequence : whether each of the Problems is solved from the basis of the previous
        solution, where this is close, as by a `Solver`; M and n may change.
    method, options : as in `solve`, for every problem; a time limit applies to each of
        them. With options other than tol, max_iterations, time_limit, threads,
        interrupts and compiled, columns are solved one by one. With
        interrupts="return", Ctrl-C stops a problem that is being solved separately: its
        result is `interrupted`, and the next problem follows.

    Yields
    ------
    Result : for each problem, as from `run`. Its seconds are an equal share of the time
        of its block. A `Batch` is a sequence of such results, with arrays of all
        solutions and their derivatives.

    Raises
    ------
    ProblemError, OptionError : as for `solve`, at the call; in a stream of Problems,
        when the problem is reached.
    KeyboardInterrupt : Ctrl-C was pressed: Interrupted for a problem that is solved by
        itself.

    Examples
    --------
    >>> import lcpcli
    >>> results = lcpcli.solve_many([[2, 0], [0, 4]], [[-4, 2, 1], [2, -4, 1]])
    >>> [result.z.tolist() for result in results]
    [[2.0, 0.0], [0.0, 1.0], [0.0, 0.0]]
    >>> problems = (lcpcli.Problem([[2]], [q]) for q in (-2, 2))
    >>> [result.z.tolist() for result in lcpcli.solve_many(problems)]
    [[1.0], [0.0]]
    """
    if isinstance(Q, str):
        Q, method = None, Q
    explicit_options = _validated_options(options, method)
    limits = Limits.pop_from({**explicit_options})
    if Q is None:
        _refuse_as_problems(M, lower=lower, upper=upper, infinity=infinity)
        return _of_problems(M, method, sequence, explicit_options)
    if sequence:
        raise ParameterError(
            "sequence",
            "is for Problems",
            "leave it out, or give q one by one, as by iter(Q.T)",
        )
    if isinstance(Q, Iterator):
        _refuse_in_sequence(
            method,
            explicit_options.keys(),
            "an iterator of q",
            "give their columns as Q, of shape (n, k)",
        )
        return map(
            Solver(
                M, lower=lower, upper=upper, infinity=infinity, **explicit_options
            ).solve,
            Q,
        )
    if dimensions(M) == 3:
        return Batch(
            Stack(M, Q, lower, upper, infinity), method, limits, explicit_options
        )
    columns = Columns(M, Q, lower, upper, infinity)
    if (
        method != AUTO
        or not explicit_options.keys() <= BLOCK_OPTIONS
        or columns.k < MIN_COLUMNS
    ):
        return _one_by_one(columns.problems(), method, explicit_options)
    # A step for a block takes too long for time limits and Ctrl-C.
    if is_sparse(columns.M) or columns.n >= LONG_LU:
        return map(Solver.of(columns.like, explicit_options).next, columns.problems())
    return _by_blocks(columns, limits, explicit_options)


def _validated_options(options: Mapping[str, Any], method: str) -> dict[str, Any]:
    """Return the options that are neither None nor switched off; raise OptionError for
    one that the method does not have, or that is out of range."""
    allowed_if_false = {*methods.SWITCHES, "compiled"}
    explicit_options = {
        name: value
        for name, value in chosen(options, COMMON_OPTIONS, method).items()
        if value is not False or name in allowed_if_false
    }
    of_method = [name for name in explicit_options if name not in COMMON_OPTIONS]
    methods.check(method, {name: explicit_options[name] for name in of_method})
    if "threads" in explicit_options:
        THREADS.check(explicit_options["threads"])
    return explicit_options


def _of_problems(
    problems: Iterable[Problem],
    method: str,
    sequence: bool,
    explicit_options: dict[str, Any],
) -> Iterator[Result]:
    """Return the results of Problems, as a sequence or one by one."""
    if not sequence:
        return _one_by_one(problems, method, explicit_options)
    of_run = explicit_options.keys() - {"interrupts"}
    _refuse_in_sequence(method, of_run, "a sequence", LEAVE_OUT)
    return map(Solver.of(None, explicit_options).follow, problems)


def _one_by_one(
    problems: Iterable[Problem], method: str, explicit_options: dict[str, Any]
) -> Iterator[Result]:
    wanted = explicit_options.get("compiled")
    number = len(problems) if isinstance(problems, Sized) else 0
    compiled = (
        direct_run.uses_kernels(wanted, number) if method == AUTO else bool(wanted)
    )
    for problem in problems:
        yield run(problem, method, **{**explicit_options, "compiled": compiled})


def _refuse_in_sequence(
    method: str, option_names: Set[str], what: str, hint: str
) -> None:
    """Raise ParameterError for another method than auto, and for options that a Solver
    does not have."""
    unknown_names = sorted(option_names - SolverOptions.__annotations__.keys())
    if method != AUTO:
        unknown_names.append("method")
    for name in unknown_names:
        raise ParameterError(name, f"has no effect on {what}", hint)


def _refuse_as_problems(problems: Any, **bounds: Any) -> None:
    """Raise ProblemError or OptionError unless the problems are an iterable of
    Problems, and there are no bounds besides."""
    if (
        not isinstance(problems, Iterable)
        or is_sparse(problems)
        or isinstance(problems, np.ndarray)
    ):
        raise ProblemError("Q", IS_MISSING, "give M and Q, or an iterable of Problems")
    for name, bound in bounds.items():
        if not np.isscalar(bound) or bound != (0.0 if name == "lower" else math.inf):
            raise ParameterError(
                name,
                "has no effect on Problems, which have bounds themselves",
                LEAVE_OUT,
            )


def _by_blocks(
    columns: Columns, limits: Limits, explicit_options: dict[str, Any]
) -> Iterator[Result]:
    like = columns.like
    is_compiled = direct_run.uses_kernels(explicit_options.get("compiled"), columns.k)
    fast = (
        direct_run.compiled()
        if is_compiled and applies(like) and not is_sparse(like.M)
        else None
    )
    first = 0
    size = FIRST_BLOCK
    max_columns = max(FIRST_BLOCK, BLOCK_NUMBERS // max(1, columns.n))
    while first < columns.k:
        began, last = seconds(), min(first + size, columns.k)
        rows = _answers(
            like,
            columns.block(first, last),
            limits,
            fast,
            began,
            threads=explicit_options.get("threads"),
        )
        yield from (rows.result(i, explicit_options) for i in range(last - first))
        first, size = last, min(size * BLOCK_GROWTH, max_columns)


class Batch(Sequence[Result]):
    """The results of b problems with n unknowns, from `solve_many`: `batch[i]` is a
    `Result`, made when it is read.

    solved : which problems are solved, shape (b,).
    z, w : their solutions and w = M z + q, shape (b, n). Rows for unsolved problems are
        nan, so that they cannot be mistaken for solutions; `batch[i].z` is the best
        iterate of such a problem, and its `message` says what failed.

    >>> import lcpcli
    >>> matrices = [[[2, 1], [1, 2]], [[2, 0], [0, 4]]]
    >>> batch = lcpcli.solve_many(matrices, [[-5, -6], [-4, 2]])
    >>> batch.z.round(3).tolist(), batch.solved.tolist(), batch[1].status.word
    ([[1.333, 2.333], [2.0, 0.0]], [True, True], 'solved')
    """

    def __init__(
        self,
        stack: Stack,
        method: str,
        limits: Limits,
        explicit_options: dict[str, Any],
    ) -> None:
        self._stack, self._results = stack, dict[int, Result]()
        self._rows: BlockAnswers | None = None
        self.solved: Mask = np.zeros(len(stack), dtype=bool)
        self.z: Vector = np.full(stack.q.shape, np.nan)
        if method == "auto":
            explicit_options = {
                **explicit_options,
                "compiled": direct_run.uses_kernels(
                    explicit_options.get("compiled"), len(stack)
                ),
            }
        together = (
            method == AUTO
            and len(stack) > 0
            and stack.n <= MAX_UNKNOWNS
            and explicit_options.keys() <= BLOCK_OPTIONS
        )
        if (
            together
            and explicit_options["compiled"]
            and not stack.box.is_orthant
            and stack.n > FEW_TOGETHER
        ):
            # Other M take more steps, for which there is no kernel.
            together = np.array_equal(stack.M, stack.M.transpose(0, 2, 1))
        if together:
            fast = (
                direct_run.compiled()
                if explicit_options["compiled"] and stack.box.is_orthant
                else None
            )
            self._rows = _answers(
                stack.like,
                stack,
                limits,
                fast,
                seconds(),
                threads=explicit_options.get("threads"),
            )
            self.solved |= np.array(self._rows.kinds) == CERTAIN
            self.z[self.solved] = self._rows.Z[self.solved]
        for i in (~self.solved).nonzero()[0].tolist():
            result = (
                run(stack.problem(i), method, **explicit_options)
                if self._rows is None
                else self._rows.result(i, explicit_options)
            )
            self._results[i] = result
            self.solved[i] = result.solved
            if result.solved:
                self.z[i] = result.z
        self.z.flags.writeable = self.solved.flags.writeable = False

    def __len__(self) -> int:
        return len(self._stack)

    @overload
    def __getitem__(self, index: int) -> Result: ...

    @overload
    def __getitem__(self, index: slice) -> list[Result]: ...

    def __getitem__(self, index: int | slice) -> Result | list[Result]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        i = range(len(self))[operator.index(index)]
        if i not in self._results:
            assert self._rows is not None
            self._results[i] = self._rows.result(i, {})
        return self._results[i]

    def __repr__(self) -> str:
        return (
            f"<Batch: {np.count_nonzero(self.solved)} of {len(self)} problems "
            f"solved, n = {self._stack.n}>"
        )

    @cached_property
    def w(self) -> Vector:
        return self._stack.w(self.z)

    @cached_property
    def _linearizations(self) -> Any:  # the `Linearizations` of `derivative`
        return views.derivative.Linearizations(self._stack, self.z, self.solved)

    def gradient(
        self, g: Any, J: Any = None, unsolved: Unsolved = "raise"
    ) -> BatchGradient:
        """Return the derivatives of a function of each z, or of their sum, with respect
        to M, q and the bounds.

        g, J : as in `Result.gradient`, with a first dimension of length b, which J may
            lack.
        unsolved : "raise" a DerivativeError that names the first problem without
            derivatives, or "nan" to fill the rows of problems that are not solved, or
            whose solutions have no derivatives.

        >>> import lcpcli
        >>> batch = lcpcli.solve_many([[[2, 1], [1, 2]]], [[-5, -6]])
        >>> batch.gradient([[3, 0]]).q.round(9).tolist()
        [[-2.0, 1.0]]
        """
        gradient: BatchGradient = views.derivative.gradients(
            self, self._linearizations, g, J, unsolved
        )
        return gradient

    def derivative(
        self,
        dM: Any = None,
        dq: Any = None,
        dlower: Any = None,
        dupper: Any = None,
        one_sided: bool = False,
        J: Any = None,
        unsolved: Unsolved = "raise",
    ) -> BatchDerivative:
        """Return the derivatives of all z and w for changes of the data in one
        direction.

        dM : shape (b, n, n). dq, dlower, dupper : shape (b, n). Without the first
        dimension they apply to all problems; None means no change. The other
        parameters are as in `gradient` and `Result.derivative`.
        """
        changes = {"dM": dM, "dq": dq, "dlower": dlower, "dupper": dupper}
        arguments = changes, one_sided, J, unsolved
        derivative: BatchDerivative = views.derivative.derivatives(
            self, self._linearizations, *arguments
        )
        return derivative


class RowResult(Result):
    """The result of a row of a block that is a solution, z. If that is certain, its
    problem and its point are made only when they are read, as little more than z is
    read of many results."""

    _row: tuple[Block | Stack, int, Vector]

    @property
    def z(self) -> Vector:  # type: ignore[override]
        return self._row[2][self._row[1]] if "_row" in vars(self) else self.point.z

    def __getattr__(self, name: str) -> Any:
        if name not in ("problem", "point"):
            raise AttributeError(name)
        block, i, Z = self._row
        problem = block.problem(i)
        vars(self).update(
            problem=problem,
            point=Point.of_solution(Criterion(problem, self.limits.tol), Z[i]),
        )
        return vars(self)[name]

    def __reduce__(self) -> tuple[Any, ...]:
        return Result, tuple(getattr(self, field.name) for field in fields(Result))


@dataclass(eq=False, repr=False)
class BlockAnswers:
    """The answers of pivoting to the problems of a block.

    Z : the z of each, shape (m, n). kinds, steps : the kind of each answer and its
        number of steps, as `direct.direct_many` returns them. routes : the position of
        its route in ROUTES. parts : its share of the time.
    """

    block: Block | Stack
    Z: Vector
    kinds: list[int]
    steps: list[int]
    routes: list[int]
    limits: Limits
    options: dict[str, Any]
    parts: dict[str, float]

    def result(self, i: int, explicit_options: dict[str, Any]) -> Result:
        """Return the result of a row; if its answer is no solution, that of a run,
        whose time includes its share."""
        solved = (
            ROUTES[self.routes[i]],
            self.steps[i],
            self.limits,
            self.options.copy(),
            self.parts,
        )
        data: dict[str, Any] = {}
        if self.kinds[i] == CERTAIN:
            data = {"_row": (self.block, i, self.Z)}
        else:
            problem, tol = self.block.problem(i), self.limits.tol
        if self.kinds[i] == CANDIDATE:
            point = Point(Criterion(problem, tol), self.Z[i])
            acceptance = accepted(problem, [point], tol, AT_ONCE)
            if acceptance is not None:
                data = {"problem": problem, "point": acceptance.point}
        if data:
            return RowResult.of_solution(*solved, **data)
        result = run(problem, **explicit_options)
        return replace(
            result,
            parts={
                part: spent + self.parts[part] for part, spent in result.parts.items()
            },
        )


@with_limited_threads
@np.errstate(all="ignore")
def _answers(
    like: Problem,
    block: Block | Stack,
    limits: Limits,
    fast: ModuleType | None,
    began: float,
    threads: int | None,  # noqa: ARG001 (the decorator limits them)
) -> BlockAnswers:
    """Return the answers of block pivoting to the problems of a block, by a kernel if
    there is one for them; those of a stack are tested one by one, others by the
    measures of the block and, where these do not decide, one by one."""
    stopwatch = Stopwatch(seconds, began)
    by_gradient = np.zeros(len(block.q), dtype=bool)
    # Columns may have bounds of their own, which `like` has not; the kernel has none.
    kernel = fast.direct_many if fast is not None and block.box.is_orthant else None
    if kernel is not None or isinstance(block, Stack):
        stopwatch.count("setup")
        of_all = like.M[np.newaxis], np.array([like.largest])
        M, largest = (block.M, block.largest) if isinstance(block, Stack) else of_all
        data = M, block.q, largest, limits.tol
        z, codes = direct_many(*data, block.box) if kernel is None else kernel(*data)
        kinds, steps = codes[:, 0], codes[:, 1]
        stopwatch.count("solve")
    else:
        measure, frame = Measure(block), frame_of(block)
        ready: Mask = np.asarray((measure.reference_violations <= 0).all(axis=1))
        stopwatch.count("setup")
        R, C = (np.exp2(powers) for powers in (block.units.rows, block.units.columns))
        pivots = solve_many_by_pivoting(
            frame,
            ~ready,
            R,
            C,
            limits.max_iterations,
            lambda: stopwatch.elapsed() > limits.time_limit,
        )
        z = in_given_variables(frame, pivots.z)
        steps = pivots.steps
        by_gradient = pivots.by_gradient
        stopwatch.count("solve")
        surely = ready | (
            pivots.ended & _refine_in_place(frame, measure, pivots, z, limits.tol)
        )
        stopwatch.count("verify")
        kinds = np.where(surely, CERTAIN, np.where(pivots.ended, CANDIDATE, NOTHING))
    parts = {part: spent / len(z) for part, spent in stopwatch.parts.items()}
    max_steps = limits.max_iterations if sum(parts.values()) < limits.time_limit else -1
    kinds = np.where(block.are_moderate & (steps <= max_steps), kinds, NOTHING)
    # Positions in ROUTES: no step, newton, or gradient and newton.
    routes = np.where(by_gradient, 2, np.minimum(steps, 1)).tolist()
    options = methods.OF_AUTO | ({} if kernel is None else {"compiled": True})
    return BlockAnswers(
        block, z, kinds.tolist(), steps.tolist(), routes, limits, options, parts
    )


def _refine_in_place(
    frame: Frame,
    measure: Measure,
    pivoting_result: ManyPivotingResult,
    z: Vector,
    tol: float,
) -> Mask:
    """Refine, by overwriting, those z, of shape (m, n), whose residual may be more than
    rounding; return which of all z are proved to solve their problems, shape (m,)."""
    rows_of_z = measure.rows(z)
    solved = measure.surely_solves(z, rows_of_z, min(tol, SMALL_DISTANCE))
    rows = (pivoting_result.ended & ~solved).nonzero()[0]
    if rows.size:
        part = frame.block.part(rows)
        again = Measure(part)
        better_z = in_given_variables(
            frame_of(part),
            refine_once(frame, pivoting_result, rows, rows_of_z.w[rows]),
        )
        better = again.rows(better_z)
        before = again.largest_ratio(z[rows], rows_of_z.part(rows))
        after = again.largest_ratio(better_z, better)
        solved[rows] = np.minimum(before, after) <= tol
        is_improved = after < before
        z[rows[is_improved]] = better_z[is_improved]
    return solved
