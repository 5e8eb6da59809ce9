"""Conclusions from results, so that reports only have to format them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lcpcli.solving.result import Result
from lcpcli.verify.point import Criterion, Point
from lcpcli.verify.refinement import is_rounding


def concluded(results: Sequence[Result]) -> list[Result]:
    """The results, all on one problem, with `suggestions`, and with `answer` if the problem has an origin; as they are
    but `interrupted` if Ctrl-C comes before that."""
    try:
        return _concluded(results)
    except KeyboardInterrupt:
        return interrupted(results)


def interrupted(results: Sequence[Result]) -> list[Result]:
    """The results after Ctrl-C, from which nothing more is to be concluded."""
    return [replace(result, interrupted=True) for result in results]


def _concluded(results: Sequence[Result]) -> list[Result]:
    advised = [result if result.solved else _with_advice(result) for result in results]
    if not results or results[0].problem.origin is None:
        return advised
    from lcpcli.solving.meaning import answers

    return [replace(result, answer=answer) for result, answer in zip(advised, answers(results), strict=True)]


def _with_advice(result: Result) -> Result:
    from lcpcli.solving.advice import suggestions

    return replace(result, suggestions=suggestions(result))


@np.errstate(over="ignore", invalid="ignore")
def verified(result: Result) -> Result:
    """The result with `verified`: by the relative residual of z, recomputed, or else by exact arithmetic."""
    if not result.solved:
        return result
    point = Point(Criterion(result.problem, result.tol), result.z, is_admissible=False)
    return replace(result, verified=point.solves() or is_rounding(result.problem, result.z, result.tol))
