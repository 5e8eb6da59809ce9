"""The iterates of a game as its players see them: probabilities under the names of the strategies, and payoffs."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from lcpcli.model.origins import Game
from lcpcli.typing import Vector
from lcpcli.verify.equilibrium import Strategies

PAYOFFS = ("row gets", "column gets")


def names(game: Game, most: float) -> tuple[list[str], list[str]]:
    """These are the names of the rows and of the columns; a strategy is called x1 or y1 if it has no name, or one of
    that length or more."""
    m, k = game.A.shape
    given = (("x", game.rows or [""] * m), ("y", game.columns or [""] * k))
    rows, columns = (
        [name if 0 < len(name) < most else f"{letter}{i}" for i, name in enumerate(own, 1)] for letter, own in given
    )
    return rows, columns


def headings(game: Game) -> list[str]:
    """This gives each strategy and each payoff a heading, and no two of them the same one."""
    rows, columns = names(game, np.inf)
    times = Counter([*rows, *columns, *PAYOFFS])
    parts = (("row", rows), ("column", columns))
    return [*(name if times[name] == 1 else f"{player} {name}" for player, own in parts for name in own), *PAYOFFS]


@np.errstate(all="ignore")  # an iterate may be anything
def of_iterate(game: Game, z: Vector) -> list[Any]:
    """These are the probabilities that z stands for, and then the payoffs, doubles or fractions as z has; they are None
    for a player whose part of z is no strategy, and both payoffs are None then."""
    parts = game.parts(z)
    sums = [part.sum() for part in parts]
    given = [min(part) >= 0 and 0 < total < np.inf for part, total in zip(parts, sums, strict=True)]
    x, y = (part / total for part, total in zip(parts, sums, strict=True))
    payoffs = Strategies.of(game, x, y).payoffs if all(given) else (None, None)
    shown = (own.tolist() if there else [None] * own.size for own, there in zip((x, y), given, strict=True))
    return [*(value for own in shown for value in own), *payoffs]
