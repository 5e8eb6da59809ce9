"""Many problems of one size, each with its own M, solved at once: arrays of all solutions, and their derivatives.

The results of pivoting on many problems at once, each created when it is read.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, overload

import numpy as np

from lcpcli.clock import Stopwatch, seconds
from lcpcli.linalg.threads import with_limited_threads
from lcpcli.methods import registry as methods
from lcpcli.methods.direct import CERTAIN, MOST_UNKNOWNS, NOTHING, direct_many
from lcpcli.model import views
from lcpcli.model.problem import Problem
from lcpcli.model.right_hand_sides import Stack
from lcpcli.options import Limits
from lcpcli.solving import direct_run
from lcpcli.solving.call import SolverOptions, run
from lcpcli.solving.result import Result
from lcpcli.typing import Indices, Mask, Vector
from lcpcli.verify.point import Criterion, Point

if TYPE_CHECKING:
    from types import ModuleType

    from lcpcli.model.right_hand_sides import Block
    from lcpcli.solving.derivatives import BatchDerivative, BatchGradient

BLOCK_OPTIONS = {*SolverOptions.__annotations__, "interrupts", "compiled"}  # with which problems are solved together
ROUTES: tuple[tuple[str, ...], ...] = (("auto",), ("newton",), ("gradient", "newton"))
FEW_TOGETHER = 12  # unknowns up to which all bounded problems together take less time than kernels for each

Unsolved: TypeAlias = Literal["raise", "nan"]


class Batch(Sequence[Result]):
    """The results of b problems with n unknowns, from `solve_many`: `batch[i]` is a `Result`, made when it is read.

    solved : which problems are solved, shape (b,).
    z, w : their solutions and w = M z + q, shape (b, n). Rows for unsolved problems are nan, so that they cannot be
        mistaken for solutions; `batch[i].z` is the best iterate of such a problem, and its `message` says what failed.

    >>> import lcpcli
    >>> batch = lcpcli.solve_many([[[2, 1], [1, 2]], [[2, 0], [0, 4]]], [[-5, -6], [-4, 2]])
    >>> batch.z.round(3).tolist(), batch.solved.tolist(), batch[1].status.word
    ([[1.333, 2.333], [2.0, 0.0]], [True, True], 'solved')
    """

    def __init__(self, stack: Stack, method: str, limits: Limits, given: dict[str, Any]) -> None:
        self._stack, self._results = stack, dict[int, Result]()
        self._rows: BlockAnswers | None = None
        self.solved: Mask = np.zeros(len(stack), dtype=bool)
        self.z: Vector = np.full(stack.q.shape, np.nan)
        if method == "auto":
            given = {**given, "compiled": direct_run.uses_kernels(given.get("compiled"), len(stack))}
        if (
            len(stack)
            and stack.n <= MOST_UNKNOWNS
            and method == "auto"
            and given.keys() <= BLOCK_OPTIONS
            and not (given["compiled"] and _take_less_time_apart(stack))
        ):
            fast = direct_run.compiled() if given["compiled"] and stack.box.is_orthant else None
            self._rows = _answers(stack.like, stack, limits, fast, threads=given.get("threads"))
            self.solved |= self._rows.certain
            self.z[self.solved] = self._rows.Z[self.solved]
        for i in (~self.solved).nonzero()[0].tolist():
            result = self._result(i)
            if result is None:
                result = run(stack.problem(i), method, **given)
                result = result if self._rows is None else self._rows.with_share(result)
            self._results[i] = result
            self.solved[i] = result.solved
            if result.solved:
                self.z[i] = result.z
        self.z.flags.writeable = self.solved.flags.writeable = False

    def _result(self, i: int) -> Result | None:
        """Return the result for a problem if pivoting has solved it."""
        return None if self._rows is None else self._rows.result(i)

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
            result = self._result(i)
            assert result is not None
            self._results[i] = result
        return self._results[i]

    def __repr__(self) -> str:
        return f"<Batch: {np.count_nonzero(self.solved)} of {len(self)} problems solved, n = {self._stack.n}>"

    @cached_property
    def w(self) -> Vector:
        return self._stack.w(self.z)

    @cached_property
    def _linearizations(self) -> Any:  # the `Linearizations` of `derivative`
        return views.derivative.Linearizations(self._stack, self.z, self.solved)

    def gradient(self, g: Any, J: Any = None, unsolved: Unsolved = "raise") -> BatchGradient:
        """Return the derivatives of a function of each z, or of their sum, with respect to M, q and the bounds.

        g : the gradient of the function at each z, shape (b, n); with J, at each J z, shape (b, k).
        J : shape (k, n) or (b, k, n), as in `Result.gradient`.
        unsolved : "raise" a DerivativeError that names the first problem without derivatives, or "nan" to fill the rows
            of problems that are not solved, or whose solutions have no derivatives.

        >>> import lcpcli
        >>> batch = lcpcli.solve_many([[[2, 1], [1, 2]]], [[-5, -6]])
        >>> batch.gradient([[3, 0]]).q.round(9).tolist()
        [[-2.0, 1.0]]
        """
        found: BatchGradient = views.derivative.gradients(self, self._stack, self._linearizations, g, J, unsolved)
        return found

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
        """Return the derivatives of all z and w for changes of the data in a given direction.

        dM : shape (b, n, n). dq, dlower, dupper : shape (b, n). Without the first dimension they apply to all problems;
        None stands for no change. The other parameters are as in `gradient` and `Result.derivative`.
        """
        changes = {"dM": dM, "dq": dq, "dlower": dlower, "dupper": dupper}
        given = changes, one_sided, J, unsolved
        found: BatchDerivative = views.derivative.derivatives(self, self._stack, self._linearizations, *given)
        return found


def _take_less_time_apart(stack: Stack) -> bool:
    """Return whether kernels for single problems take less time than pivoting in all problems together: with bounds it
    has no kernel, and it needs more steps where M is not symmetric."""
    if stack.box.is_orthant or stack.n <= FEW_TOGETHER:
        return False
    return not np.array_equal(stack.M, stack.M.transpose(0, 2, 1))


@with_limited_threads
def _answers(
    like: Problem,  # noqa: ARG001 (its size decides how many threads there are)
    stack: Stack,
    limits: Limits,
    fast: ModuleType | None,
    threads: int | None,  # noqa: ARG001 (the decorator limits them)
) -> BlockAnswers:
    """Return the answers of block pivoting to all problems, by a kernel if there is one for them."""
    stopwatch = Stopwatch(seconds, seconds())
    data = stack.M, stack.q, stack.largest
    if fast is not None:
        return answers(stack, limits, stopwatch, lambda: fast.direct_many(*data, limits.tol), compiled=True)
    return answers(stack, limits, stopwatch, lambda: direct_many(*data, limits.tol, stack.box))


class _RowResult(Result):
    """The result of a row of a block that surely is a solution, z. Its problem and its point are made when they are
    read, as of many results little more than z is."""

    _row: tuple[Block | Stack, int, Vector]

    @property
    def z(self) -> Vector:
        return self._row[2][self._row[1]] if "_row" in vars(self) else self.point.z

    def __getattr__(self, name: str) -> Any:
        if name not in ("problem", "point"):
            raise AttributeError(name)
        block, i, Z = self._row
        problem = block.problem(i)
        vars(self).update(problem=problem, point=Point.of_solution(Criterion(problem, self.limits.tol), Z[i]))
        return vars(self)[name]

    def __reduce__(self) -> tuple[Any, ...]:
        return Result, tuple(getattr(self, field.name) for field in fields(Result))


class BlockAnswers:
    """The answers of pivoting to the problems of a block.

    Z : the z of each, shape (m, n). kinds, steps : what each is, as `direct.direct_many` returns them, shape (m,).
    by_gradient : which of them began with gradients. parts : the share of each in the time. options : those in effect.
    """

    def __init__(
        self,
        block: Block | Stack,
        Z: Vector,
        kinds: Indices,
        steps: Indices,
        limits: Limits,
        stopwatch: Stopwatch,
        by_gradient: Mask | bool = False,
    ) -> None:
        self.parts = {part: spent / len(Z) for part, spent in stopwatch.parts.items()}
        self.block, self.Z, self._limits = block, Z, limits
        most_steps = limits.max_iterations if sum(self.parts.values()) < limits.time_limit else -1
        kinds = np.where(block.are_moderate & (steps <= most_steps), kinds, NOTHING)
        self.certain: Mask = kinds == CERTAIN
        self._kinds, self._steps = kinds.tolist(), steps.tolist()
        self._routes = np.where(by_gradient, 2, np.minimum(steps, 1)).tolist()
        self.options = methods.options_in_force("auto", block.like, {})

    def result(self, i: int) -> Result | None:
        """Return the result of a row; None if its answer is no solution."""
        kind = self._kinds[i]
        if kind == NOTHING:
            return None
        solved = ROUTES[self._routes[i]], self._steps[i], self._limits, self.options.copy(), self.parts
        if kind == CERTAIN:
            return _RowResult.of_solution(*solved, _row=(self.block, i, self.Z))
        problem = self.block.problem(i)
        point = Point(Criterion(problem, self._limits.tol), self.Z[i])
        return Result.of_solution(*solved, problem=problem, point=point) if point.solves() else None

    def with_share(self, result: Result) -> Result:
        """Return the result of another run for a row, whose share of the time of the block counts too."""
        return replace(result, parts={part: s + self.parts[part] for part, s in result.parts.items()})


def answers(
    block: Block | Stack,
    limits: Limits,
    stopwatch: Stopwatch,
    pivoting: Callable[[], tuple[Vector, Indices]],
    compiled: bool = False,
) -> BlockAnswers:
    """Return the answers to the problems of a block, one or more, by a function that returns z and what they are with
    their steps, shape (m, 2)."""
    stopwatch.count("setup")
    Z, found = pivoting()
    stopwatch.count("solve")
    rows = BlockAnswers(block, Z, found[:, 0], found[:, 1], limits, stopwatch)
    if compiled:
        rows.options["compiled"] = True
    return rows
