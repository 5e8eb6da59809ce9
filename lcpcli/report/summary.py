"""The lines below the iterates, one per method: its cost and the quality of its result."""

from __future__ import annotations

import math
from collections.abc import Sequence

from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.model.problem import Problem
from lcpcli.report import numbers
from lcpcli.report.formats import LEVELS
from lcpcli.solving.result import Result
from lcpcli.solving.trace import Milestone

SHORT = {"iteration_limit": "k limit", "time_limit": "t limit"}  # for crowded rows
NOT_REACHED = "-"
WIDE = 2.0  # the spread of times from which on it is told

Cells = tuple[list[str], list[list[str]]]


def build(results: Sequence[Result]) -> Cells:
    """Header and rows: with the cost to each of the levels of error if recorded, else the plain counts."""
    noted = any(result.curve is not None and result.curve.levels for result in results)
    return _milestones(results) if noted else _counts(results)


def leaders(results: Sequence[Result]) -> set[tuple[int, int]]:
    """The cells of `build`, by row and column, with the shortest time to each level of error, among several runs."""
    firsts = set()
    for j, level in enumerate(LEVELS, start=1):
        seconds = {
            i: milestone.seconds
            for i, result in enumerate(results)
            for milestone in (result.curve.milestones if result.curve else ())
            if milestone.level == level
        }
        if len(results) > 1 and seconds:
            firsts.add((min(seconds, key=lambda i: seconds[i]), j))
    return firsts


def name(result: Result) -> str:
    """The name of a run: its method, the options that set it apart, and "warm" if it started near the solution."""
    return f"{result.label or result.method}{' warm' * result.warm}"


def residual(result: Result) -> str:
    """The natural residual of a result, 0 if it is no more than rounding of the terms of each row."""
    return numbers.short(result.residual, math.inf if result.relative_residual <= ROW_ROUNDING else 0.0)


def error(value: float | None, problem: Problem) -> str:
    """An error, 0 if it is no more than rounding of the solution."""
    return numbers.short(value, ROW_ROUNDING * problem.size_of_solutions)


def doubt(result: Result) -> str:
    """A warning for a solved run whose z differs from the solution in its leading digits; else ""."""
    near = result.error is None or result.error <= LEVELS[0] * result.problem.size_of_solutions
    if near or not result.solved:
        return ""
    return (
        f"the residual is small but z is far from the {result.problem.reference} solution: "
        "either it is another solution, or M is so ill-conditioned that the residual says little"
    )


def spread(result: Result) -> str:
    """A warning where the times of a run, although the least of its repetitions, may say little; else ""."""
    if result.spread is None or result.spread <= WIDE:
        return ""
    return f"half of its repetitions took over {result.spread:.1f} times as long: other programs disturb the times"


def bound(result: Result) -> str:
    """The proved bound on the error, or that there is none; "" if not requested."""
    if result.bound is None:
        return ""
    if not result.bound.proved:
        return f"no bound: {result.bound.source}"
    return f"|z - z*| <= {numbers.above(result.bound.value)} ({result.bound.source})"


def _counts(results: Sequence[Result]) -> Cells:
    header = ["method", "iterations", "evaluations", "end", "residual", "error", "status", "verified"]
    rows = [
        [
            name(result),
            str(result.iterations),
            str(result.evaluations),
            numbers.duration(_end(result)),
            residual(result),
            error(result.error, result.problem),
            result.word.replace("_", " "),
            _verified(result),
        ]
        for result in results
    ]
    if all(result.verified is None for result in results):
        header, rows = header[:-1], [row[:-1] for row in rows]
    if all(result.error is None for result in results):
        header.remove("error")
        for row in rows:
            del row[5]
    return header, rows


def _milestones(results: Sequence[Result]) -> Cells:
    header = [
        "method",
        *(f"to {numbers.level(level)}" for level in LEVELS),
        "end",
        "error",
        "status",
        "verified",
    ]
    rows = []
    for result in results:
        reached = {m.level: _cell(m) for m in (result.curve.milestones if result.curve else ())}
        end = _taken(result.iterations, _end(result))
        levels = [reached.get(level, NOT_REACHED) for level in LEVELS]
        status = SHORT.get(result.word, result.word)
        rows.append([name(result), *levels, end, error(result.error, result.problem), status, _verified(result)])
    return header, rows


def _end(result: Result) -> float:
    """The seconds until the last iterate, by the clock of the iterates."""
    rows = result.trace.rows if result.trace else []
    return rows[-1].seconds if rows else result.seconds


def _verified(result: Result) -> str:
    """The time until the verified answer; FALSE for a claim that does not hold."""
    if result.verified is None:
        return NOT_REACHED
    return numbers.duration(result.seconds) if result.verified else "FALSE"


def _cell(milestone: Milestone) -> str:
    return _taken(milestone.k, milestone.seconds)


def _taken(k: int, seconds: float) -> str:
    return f"{k}/{numbers.duration(seconds)}".replace(" ", "")
