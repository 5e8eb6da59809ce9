"""The paths of runs on LCPs with two unknowns: the data of their picture, and which problems have one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from lcpcli.errors import ParameterError
from lcpcli.linalg import matrices
from lcpcli.report import wording
from lcpcli.report.figures.data import Pair, Trajectories, Trajectory

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.solving.result import Result
    from lcpcli.typing import Vector

PATHS = "paths"
MOST = 6  # problems on a page, two in a row


def require(problems: Sequence[Problem]) -> None:
    """Refuse problems whose F is not linear in the quadrants of a plane, and more problems than a page has room for."""
    if len(problems) > MOST:
        fault = f"would draw {len(problems)} problems, and a page has room for {MOST}"
        raise ParameterError(PATHS, fault, "draw fewer at a time")
    for problem in problems:
        if problem.is_mixed or problem.n != 2:
            fault = f"draws LCPs with two unknowns, not one with {wording.size(problem)}"
            raise ParameterError(PATHS, fault, "leave it out")


def of_runs(runs: Sequence[Sequence[Result]]) -> list[Trajectories]:
    """Return the paths of runs, grouped by problem; the curve of each run must have kept x."""
    return [_of_problem(results) for results in runs]


def _of_problem(results: Sequence[Result]) -> Trajectories:
    problem, own = results[0].problem, []
    for result in results:
        rows = result.curve.rows if result.curve else []
        x = [_pair(row.x) for row in rows if row.x is not None]
        own.append(Trajectory(result.method, wording.name(result), [row.k for row in rows], x))
    known = [*problem.solutions, *(result.z for result in results if result.solved)]
    return Trajectories(
        title=wording.title(problem),
        M=matrices.dense(problem.M).tolist(),
        q=problem.q.tolist(),
        solutions=[_pair((z - problem.w(z)) / 2) for z in known],
        paths=own,
        provenance="; ".join(wording.provenance(results)),
    )


def _pair(x: Vector) -> Pair:
    first, second = x.tolist()
    return first, second
