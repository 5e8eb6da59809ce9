"""The picture of a path: its data, and writing it to a file.

The picture of all solutions: complementary cones of an LCP in two unknowns.

The picture of the paths of runs on LCPs with two unknowns.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from lcpcli.enumeration.search import SolutionSet
from lcpcli.errors import ParameterError
from lcpcli.linalg import matrices
from lcpcli.model.problem import Problem
from lcpcli.report import plotting, wording
from lcpcli.report.figures.data import Cones, Pair, Response, Trajectories, Trajectory

if TYPE_CHECKING:
    from lcpcli.parametric.path import Path
    from lcpcli.report.path_terms import Terms
    from lcpcli.solving.result import Result
    from lcpcli.typing import Vector

SAMPLES = 24  # of the objective on a piece, on which it is a parabola
MOST_SAMPLES = 4000  # on a path, more than a figure shows
PATHS = "paths"
MOST_PROBLEMS = 6  # whose paths of iterates are on a page, two in a row


def plot(path: Path, file: str | os.PathLike[str] | None = None, show: Sequence[str] = ()) -> plotting.Picture:
    """Draw a path, and write the picture to a file if there is one: .png, .svg or .pdf."""
    plotting.require()
    return plotting.Picture((), response(path, [show] if isinstance(show, str) else show)).saved(file)


def response(path: Path, chosen: Sequence[str] = ()) -> Response:
    """Return the data of the picture: the components of z, of a program those of x, that are not always 0.

    chosen : names of unknowns, or of a program's multipliers, as for `wording.places`, instead.
    """
    from lcpcli.report import path_terms

    terms = path_terms.Terms(path)
    moving, names, z = terms.moving, terms.names(), path.z
    if chosen:
        shown, z = wording.places(names, chosen), np.array(list(map(terms.values, z)))
    else:
        z = z if terms.program is None else z[:, : terms.program.variables]
        shown = np.flatnonzero(z.any(axis=0)).tolist()
    return Response(
        title=", ".join(filter(None, (wording.title(path.problem), wording.size(path.problem)))),
        abscissa=f"{moving.name}{f' ({moving.word})' * bool(moving.word)}" if moving else "t",
        across=_across(terms, path.t.tolist()),
        names=[names[i] for i in shown],
        lines=[z[:, i].tolist() for i in shown],
        jumps=path.jumps,
        turns=path_terms.turns(path),
        objective=_objective(terms) if terms.program is not None else None,
        is_frontier=terms.is_quadratic and moving is not None and moving.what.startswith("row"),
        provenance=[f"{wording.PROGRAM}: {path_terms.line(path)}"],
    )


def _across(terms: Terms, t: list[float]) -> list[float]:
    return list(map(float, map(terms.moved, t))) if terms.moving else t


def _objective(terms: Terms) -> list[Pair]:
    """Return points (number that moves, objective) of the path."""
    path = terms.path
    pieces = path.t.size - 1
    shares = np.linspace(0, 1, max(2, min(SAMPLES, MOST_SAMPLES // max(pieces, 1))))
    t, z = path.t.tolist(), path.z
    points = list(zip(t[:1], z[:1], strict=True))
    for k in range(pieces):
        points += [((1 - s) * t[k] + s * t[k + 1], (1 - s) * z[k] + s * z[k + 1]) for s in shares[1:].tolist()]
    values = [terms.objective(*point) for point in points]
    return list(zip(_across(terms, [point[0] for point in points]), values, strict=True))


def require(problem: Problem) -> None:
    """Raise ParameterError for a problem that has no picture of cones."""
    if not exists(problem):
        fault = f"draws the complementary cones of an LCP with two unknowns, not a problem with {wording.size(problem)}"
        raise ParameterError("plot", fault, "leave it out")


def draw(found: SolutionSet, form: str) -> bytes:
    """Draw the picture of a problem that has one, in a format of pictures."""
    return plotting.cones(cones(found), form)


def exists(problem: Problem) -> bool:
    """Return whether a problem has a picture of its complementary cones."""
    return not problem.is_mixed and problem.n == 2


def cones(found: SolutionSet) -> Cones:
    """Return the picture of the cones. A cone contains q if there is a solution with w = 0 in its set and z = 0
    outside."""
    problem = found.data.problem
    solutions = [list(zip(z, found.data.w(z), strict=True)) for z in found.points]
    sets = [(first, second) for second, first in product((0, 1), repeat=2)]  # of the unknowns that may be positive
    holding = [any(not (one[first] or other[second]) for one, other in solutions) for first, second in sets]
    told = [f"{wording.PROGRAM}: {found.message}"]
    return Cones(wording.title(problem), *_data(problem), holding, found.count, tuple(problem.names), told)


def require_paths(problems: Sequence[Problem]) -> None:
    """Refuse problems whose F is not linear in the quadrants of a plane, and more problems than a page has room for."""
    if len(problems) > MOST_PROBLEMS:
        fault = f"would draw {len(problems)} problems, and a page has room for {MOST_PROBLEMS}"
        raise ParameterError(PATHS, fault, "draw fewer at a time")
    for problem in problems:
        if problem.is_mixed or problem.n != 2:
            fault = f"draws LCPs with two unknowns, not one with {wording.size(problem)}"
            raise ParameterError(PATHS, fault, "leave it out")


def trajectories(runs: Sequence[Sequence[Result]]) -> list[Trajectories]:
    """Return the paths of runs, grouped by problem; the curve of each run must have kept x."""
    found = []
    for results in runs:
        problem, own = results[0].problem, []
        for result in results:
            rows = result.curve.rows if result.curve else []
            x = [_pair(row.x) for row in rows if row.x is not None]
            own.append(Trajectory(result.method, wording.name(result), [row.k for row in rows], x))
        known = [*problem.solutions, *(result.z for result in results if result.solved)]
        solutions = [_pair((z - problem.w(z)) / 2) for z in known]
        by = "; ".join(wording.provenance(results))
        found.append(Trajectories(wording.title(problem), *_data(problem), solutions, own, by))
    return found


def _data(problem: Problem) -> tuple[list[list[float]], list[float]]:
    return matrices.dense(problem.M).tolist(), problem.q.tolist()


def _pair(x: Vector) -> Pair:
    first, second = x.tolist()
    return first, second
