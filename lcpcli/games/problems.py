"""Games of two players in strategic form as complementarity problems."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lcpcli.errors import IS_MISSING, ProblemError, quoted
from lcpcli.model.arrays import by_label, texts
from lcpcli.model.origins import Game
from lcpcli.model.problem import Problem


def from_game(
    A: Any,
    B: Any = None,
    *,
    rows: Sequence[str] = (),
    columns: Sequence[str] = (),
    players: Sequence[str] = (),
    sense: str = "max",
    name: str = "",
    source: str = "",
    note: str = "",
) -> Problem:
    """Return the LCP whose solutions are the equilibria of a game in which both players
    maximize, or minimize.

    A, B : payoffs of the row and column player, both of shape (m, k); lists may also
        contain fractions like "1/3".
    rows, columns : optional names of the strategies; by default the labels of A, if
        these are texts.
    players : optional names of the row and the column player.
    sense : "min" if A and B are costs, whose negatives are then the payoffs.

    The unknowns are z = (x, y); x and y, each divided by its sum, are the strategies,
    to which `Result.answer` maps z back. A cost is the largest payoff plus the range of
    the payoffs, minus the payoff, so that all costs lie within a factor of two. Payoffs
    are taken as their shortest decimals, fractions as they are. Raises ProblemError,
    which names the field at fault.

    >>> import lcpcli
    >>> game = lcpcli.from_game([[3, 0], [0, 2]], [[0, 2], [3, 0]])
    >>> answer = lcpcli.run(game, "auto").answer
    >>> answer.row.round(6).tolist(), answer.column.round(6).tolist()
    ([0.6, 0.4], [0.4, 0.6])
    """
    if B is None:
        raise ProblemError(
            "B",
            IS_MISSING,
            "give the payoffs of the column player; in a zero-sum game B = -A",
        )
    if hasattr(A, "columns"):
        (B,) = by_label(A, "the columns of A", "columns", B=B)
        (B,) = by_label(A, "the rows of A", B=B)
        rows, columns = rows or texts(A.index), columns or texts(A.columns)
    game = Game.of(A, B, rows, columns, players)
    if sense == "min":
        game = game.negated()
    elif sense != "max":
        raise ProblemError(
            "sense",
            f"is {quoted(str(sense))}",
            'give "max" for payoffs or "min" for costs',
        )
    return Problem(*game.conditions(), name=name, source=source, note=note, origin=game)
