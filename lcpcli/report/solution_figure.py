"""The picture of all solutions: complementary cones of an LCP in two unknowns, or best replies of a 2 x 2 game."""

from __future__ import annotations

from itertools import product

from lcpcli.enumeration.search import SolutionSet
from lcpcli.errors import ParameterError
from lcpcli.linalg import matrices
from lcpcli.model.origins import Game
from lcpcli.model.problem import Problem
from lcpcli.rational.numbers import brief
from lcpcli.report import plotting, wording
from lcpcli.report.figures import game_figure
from lcpcli.report.figures.data import Cones, Replies


def require(problem: Problem) -> None:
    """Raise ParameterError for a problem that has no picture, of cones or of best replies."""
    if not exists(problem):
        fault = (
            "draws the complementary cones of an LCP with two unknowns, or the best replies of a 2 x 2 game, "
            f"not a problem with {wording.size(problem)}"
        )
        raise ParameterError("plot", fault, "leave it out")


def draw(found: SolutionSet, form: str) -> bytes:
    """Draw the picture of a problem that has one, in a format of pictures."""
    if _is_small_game(found.data.problem):
        return plotting.replies(replies(found), form)
    return plotting.cones(cones(found), form)


def exists(problem: Problem) -> bool:
    """Return whether a problem has a picture of its complementary cones or of best replies."""
    return _is_small_game(problem) or (not problem.is_mixed and problem.n == 2)


def _is_small_game(problem: Problem) -> bool:
    return isinstance(problem.origin, Game) and problem.origin.A.shape == (2, 2)


def cones(found: SolutionSet) -> Cones:
    """Return the picture of the cones. A cone contains q if there is a solution with w = 0 in its set and z = 0
    outside."""
    problem = found.data.problem
    solutions = [list(zip(z, found.data.w(z), strict=True)) for z in found.points]
    sets = [(first, second) for second, first in product((0, 1), repeat=2)]  # of the unknowns that may be positive
    return Cones(
        title=wording.title(problem),
        M=matrices.dense(problem.M).tolist(),
        q=problem.q.tolist(),
        holding=[any(not (one[first] or other[second]) for one, other in solutions) for first, second in sets],
        count=found.count,
        names=tuple(problem.names),
        provenance=[f"{wording.PROGRAM}: {found.message}"],
    )


def replies(found: SolutionSet) -> Replies:
    """Return the picture of the best replies in a 2 x 2 game. A maximal Nash subset is a rectangle: any pair of its
    strategies is an equilibrium."""
    game, held = found.game, found.equilibria
    assert game is not None
    assert held is not None
    A, B = game.payoffs()
    rows, columns = list(game.rows or ("x1", "x2")), list(game.columns or ("y1", "y2"))
    corners = []
    for subset in held.subsets:
        p, q = ([float(strategy[0]) for strategy in part] for part in (subset.rows, subset.columns))
        corners.append(((min(p), min(q)), (max(p), max(q))))
    return Replies(
        title=wording.title(found.data.problem),
        A=[list(map(brief, row)) for row in A],
        B=[list(map(brief, row)) for row in B],
        rows=rows,
        columns=columns,
        row=[(float(p), float(q)) for p, q in game_figure.of_row(A)],
        column=[(float(p), float(q)) for p, q in game_figure.of_column(B)],
        equilibria=[(float(each.row[0]), float(each.column[0])) for each in held.extreme],
        subsets=corners,
        count=found.count,
        provenance=[f"{wording.PROGRAM}: {found.message}"],
    )
