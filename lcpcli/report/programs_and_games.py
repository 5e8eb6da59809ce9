"""Answers as lines, and the strategies of games."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from lcpcli.model.formulation import Answer
from lcpcli.rational.numbers import brief
from lcpcli.report import wording
from lcpcli.solving.minimum import Equilibrium
from lcpcli.solving.result import Result


def lines(result: Result, compared: bool) -> list[str]:
    """Return lines on the answer, or with the strategies of a game, as far as they are
    known, with their meaning and their exact parts. compared : whether they name the
    result."""
    answer: Any = result.answer
    if answer is None:
        return []
    if isinstance(answer, Answer):
        texts = answer.compared_lines() if compared else answer.lines()
    else:
        texts = _of_game(result.problem.origin, answer)
    return [f"{wording.name(result)}: " * compared + text for text in texts]


def _of_game(game: Any, answer: Equilibrium) -> list[str]:
    parts = [] if answer.row is None else strategies(game, answer)
    texts = [", ".join(parts), answer.statement]
    texts += [
        f"exact {key} = {wording.vector(part, brief)}"
        for key, part in (answer.exact or {}).items()
        if part
    ]
    return [text for text in texts if text]


def strategies(
    game: Any, own: Any, cell: Callable[[Any], str] = wording.plain_number
) -> list[str]:
    """Return lines with the mixed strategies row and column, as vectors or by the names
    of the strategies played, and with the payoffs."""
    one, other = game.players or ("row", "column")
    row = wording.named(list(own.row), game.rows, cell, sparing=True)
    column = wording.named(list(own.column), game.columns, cell, sparing=True)
    return [
        f"{one} = {row}",
        f"{other} = {column}",
        f"payoffs {cell(own.payoffs[0])} and {cell(own.payoffs[1])}",
    ]
