"""Runs of `auto` that `methods.direct` completes, in compiled form if there is one: no loop, and the same results."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import cache
from typing import TYPE_CHECKING, Any

from lcpcli.clock import Stopwatch
from lcpcli.methods import registry as methods
from lcpcli.methods.direct import Answer, direct
from lcpcli.model.problem import Problem
from lcpcli.options import Limits
from lcpcli.solving.result import Result, Status
from lcpcli.typing import Vector
from lcpcli.verify.point import Criterion, Point

if TYPE_CHECKING:
    from types import ModuleType

    from lcpcli.model.right_hand_sides import Block

NUMBA = "numba"  # the package of the extra `fast`
SOLVED = {"method": "auto", "status": Status.SOLVED, "message": Status.SOLVED.sentence("")}


@cache
def compiled() -> ModuleType | None:
    """Return the module of the compiled kernels, which takes half a second to load; None without the extra `fast`, or
    if its numba fails, as with a version of numpy that is too new for it."""
    from importlib.util import find_spec

    if find_spec(NUMBA) is None:
        return None
    try:
        from lcpcli.methods import compiled
    except (ImportError, RuntimeError):
        return None
    return compiled


def solved_directly(
    problem: Problem, limits: Limits, chosen: dict[str, Any], stopwatch: Stopwatch, is_compiled: bool
) -> Result | None:
    """Return the result of a problem to which `direct` applies, if it surely is a solution; else None.

    chosen : the options of `auto` that are given.
    """
    in_force = methods.options_in_force("auto", problem, chosen, limits.time_limit)
    stopwatch.count("setup")
    fast = compiled() if is_compiled else None
    answer: Answer | None = (direct if fast is None else fast.direct)(problem, limits.tol)
    stopwatch.count("solve")
    result = None if answer is None else result_of(answer, problem, limits, in_force, stopwatch.parts)
    stopwatch.count("verify")
    return result if stopwatch.total < limits.time_limit else None


def result_of(
    answer: Answer, problem: Problem, limits: Limits, in_force: dict[str, Any], parts: dict[str, float]
) -> Result | None:
    """Return the result of a run that ended with this answer; None if it is no solution, or took too many steps."""
    criterion, steps = Criterion(problem, limits.tol), answer.steps + answer.pivots
    point = Point.of_solution(criterion, answer.z) if answer.is_certain else Point(criterion, answer.z)
    if steps > limits.max_iterations or not point.solves():
        return None
    common = {"problem": problem, "point": point, "parts": parts, "limits": limits, "options": in_force}
    return solution(common, steps, route(answer))


def route(answer: Answer) -> tuple[str, ...]:
    """Return the methods that took part."""
    return ("newton", "lemke") if answer.pivots else ("newton",) if answer.steps else ("auto",)


def solution(given: dict[str, Any], steps: int, route: tuple[str, ...], kind: type[Result] = Result) -> Result:
    """Return the result of `auto` for a problem that it has solved, in a fraction of the time of the constructor:
    fields with a default are left to the class."""
    result = kind.__new__(kind)
    vars(result).update(SOLVED, iterations=steps, evaluations=steps, route=route, **given)  # as it is frozen
    return result


class _RowResult(Result):
    """The result of a row of a block that surely is a solution. Its problem and its point are made when they are read,
    as of many results little more than z is."""

    _row: tuple[Block, int, Answer]

    @property
    def z(self) -> Vector:
        return self._row[2].z if "_row" in vars(self) else self.point.z

    def __getattr__(self, name: str) -> Any:
        if name not in ("problem", "point"):
            raise AttributeError(name)
        block, i, answer = self._row
        problem = block.problem(i)
        vars(self).update(problem=problem, point=Point.of_solution(Criterion(problem, self.limits.tol), answer.z))
        return vars(self)[name]

    def __reduce__(self) -> tuple[Any, ...]:
        return Result, tuple(getattr(self, field.name) for field in fields(self))


def results_of_rows(
    block: Block, answer_of: Callable[[int], Answer | None], limits: Limits, share: dict[str, float]
) -> Callable[[int], Result | None]:
    """Return the function that returns the result of a row of a block of LCPs, if its answer is a solution."""
    options = methods.options_in_force("auto", block.like, {}, limits.time_limit)
    is_late, moderate = sum(share.values()) >= limits.time_limit, block.are_moderate.tolist()

    def row_result(i: int) -> Result | None:
        answer = answer_of(i) if moderate[i] and not is_late else None
        if answer is None:
            return None
        steps = answer.steps + answer.pivots
        if not answer.is_certain or steps > limits.max_iterations:
            return result_of(answer, block.problem(i), limits, options.copy(), share)
        common = {"parts": share, "limits": limits, "options": options.copy(), "_row": (block, i, answer)}
        return solution(common, steps, route(answer), _RowResult)

    return row_result
