"""Reduction of a bimatrix game to the LCP whose solutions are its equilibria."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lcpcli.model.labels import payoffs_by_label, texts
from lcpcli.model.problem import Problem
from lcpcli.model.reductions.game import Game


def from_game(
    A: Any,
    B: Any,
    *,
    rows: Sequence[str] = (),
    columns: Sequence[str] = (),
    name: str = "",
    source: str = "",
    note: str = "",
) -> Problem:
    """The LCP whose solutions are the equilibria of a game in which both players maximize.

    A, B : payoffs of the row and of the column player, both of shape (m, k); in lists also fractions, "1/3".
    rows, columns : names of the strategies, or nothing; by default the labels of A, if it has texts as labels.

    z = (x, y); x and y, each divided by its sum, are the strategies. `Result.answer` maps it back. A cost is the
    largest payoff plus the range of the payoffs minus the payoff, so that costs lie within a factor of two. Payoffs
    are taken as their shortest decimals, fractions as they are. Raises ProblemError, which names the field.

    >>> import lcpcli
    >>> answer = lcpcli.run(lcpcli.from_game([[3, 0], [0, 2]], [[2, 0], [0, 3]]), "auto").answer
    >>> answer.row.round(6).tolist(), answer.column.round(6).tolist()
    ([0.6, 0.4], [0.4, 0.6])
    """
    if hasattr(A, "columns"):
        B = payoffs_by_label(A, B)
        rows, columns = rows or texts(A.index), columns or texts(A.columns)
    game = Game.of(A, B, rows, columns)
    return Problem(*game.conditions(), name=name, source=source, note=note, origin=game)
