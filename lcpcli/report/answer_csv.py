"""The answer as CSV with all digits: comments on how it was found, a header, then one line per component."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from io import StringIO
from typing import Any

import numpy as np

from lcpcli.model.origins import Game
from lcpcli.model.problem import Problem
from lcpcli.model.program import Program
from lcpcli.report import provenance, strategies, summary
from lcpcli.solving.answer import Minimum
from lcpcli.solving.result import Result

COLUMNS = ("component", "z", "w")  # components from 1
STATE = "state"
OF_PROGRAM = ("part", "value", "bound_multiplier")
OF_GAME = ("player", "probability", "payoff")


def render(results: Sequence[Result], compared: bool) -> str:
    """Columns component, z, w (fractions where these are proved) and, if a problem has bounds, state; of results that
    are compared, problem and method before them. Behind them the names of components, if there are any, and of programs
    and games what each component is."""
    mixed = any(result.problem.is_mixed for result in results)
    origins = [result.problem.origin for result in results]
    games = any(isinstance(origin, Game) for origin in origins)
    named = games or any(any(result.problem.names) for result in results)
    parts = (*OF_PROGRAM * any(isinstance(origin, Program) for origin in origins), *OF_GAME * games)
    header = [*(["problem", "method"] if compared else []), *COLUMNS, *[STATE] * mixed, *["name"] * named, *parts]
    lines = [
        rows(result, [result.problem.name, summary.name(result)] * compared, mixed, _ends(result, named, parts))
        for result in results
    ]
    return comments(provenance.lines(results)) + text([header]) + "".join(lines)


def _ends(result: Result, named: bool, parts: Sequence[str]) -> list[list[str]]:
    """The last cells of each component: its name, and under the names of parts what it is of a program or a game."""
    problem = result.problem
    names, own = problem.names, [dict[str, str]()] * problem.n
    if isinstance(problem.origin, Program):
        own = _of_program(result)
    elif isinstance(problem.origin, Game):
        rows, columns = strategies.names(problem.origin, math.inf)
        names, own = [*rows, *columns], _of_game(result, problem.origin)
    return [
        [" ".join(name.split())] * named + [told.get(part, "") for part in parts]
        for name, told in zip(names, own, strict=True)
    ]


def _of_program(result: Result) -> list[dict[str, str]]:
    """Whether each component is x, y or s, its value in the program's own sense, and the multiplier of its bounds."""
    answer, n = result.answer, result.problem.n
    if not isinstance(answer, Minimum) or answer.x is None:
        return [{}] * n
    assert answer.y is not None
    assert answer.bound_multipliers is not None
    x, y = (answer.exact["x"], answer.exact["y"]) if answer.exact else (answer.x.tolist(), answer.y.tolist())
    pairs = zip(x, answer.bound_multipliers.tolist(), strict=True)
    cells = [("x", number(value), repr(multiplier)) for value, multiplier in pairs]
    cells += [("y", number(value), "") for value in y]
    cells += [("s", number(value), "") for value in _vectors(result)[0][len(cells) :]]
    return [dict(zip(OF_PROGRAM, each, strict=True)) for each in cells]


def _of_game(result: Result, game: Game) -> list[dict[str, str]]:
    """The player that each component is of, the probability of its strategy, and what the player gets in all."""
    z, _ = _vectors(result)
    is_exact = bool(z) and not isinstance(z[0], float)
    *probabilities, by_row, by_column = strategies.of_iterate(game, np.array(z, dtype=object) if is_exact else result.z)
    m, k = game.A.shape
    players = [("row", by_row)] * m + [("column", by_column)] * k
    cells = [(player, value, payoff) for (player, payoff), value in zip(players, probabilities, strict=True)]
    texts = [[each[0], *("" if cell is None else number(cell) for cell in each[1:])] for each in cells]
    return [dict(zip(OF_GAME, each, strict=True)) for each in texts]


def names(problem: Problem) -> list[list[str]]:
    """A cell with the name of each component, in one line."""
    return [[" ".join(name.split())] for name in problem.names]


def rows(result: Result, start: Sequence[str], mixed: bool, ends: Sequence[list[str]] = ()) -> str:
    """A line for each component of a result, which starts with these cells and ends with its own of others; mixed is
    whether there is a state."""
    states = [[state] for state in result.basis] if mixed else [[]] * result.problem.n
    return text(
        [*start, i, number(z), number(w), *state, *end]
        for i, (z, w, state, end) in enumerate(
            zip(*_vectors(result), states, ends or [[]] * result.problem.n, strict=True), 1
        )
    )


def _vectors(result: Result) -> tuple[Sequence[float | Fraction], Sequence[float | Fraction]]:
    """z and w, as fractions where these are proved."""
    exact = result.exact
    if exact is not None and exact.z and exact.w:
        return exact.z, exact.w
    return result.z.tolist(), result.w.tolist()


def number(value: float | Fraction) -> str:
    """A number with all its digits."""
    if isinstance(value, float):
        return repr(value)
    from lcpcli.rational import numbers

    return numbers.text(value)


def comments(lines: Sequence[str]) -> str:
    """Lines of text as comments."""
    return "".join(f"# {line}\n" for line in lines)


def text(cells: Iterable[Sequence[Any]]) -> str:
    """Rows of cells as CSV."""
    out = StringIO()
    csv.writer(out, lineterminator="\n").writerows(cells)
    return out.getvalue()
