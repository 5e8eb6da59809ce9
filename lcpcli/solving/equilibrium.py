"""What results mean for the game that their problem comes from."""

from __future__ import annotations

import numpy as np

from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.model.reductions.game import Game
from lcpcli.solving.answer import Equilibrium
from lcpcli.solving.result import Result
from lcpcli.typing import Vector


def equilibrium(result: Result, game: Game) -> Equilibrium:
    """Strategies, payoffs and gains if the result is solved, and whether the strategies are an equilibrium."""
    if not result.solved:
        return Equilibrium(None, None, None, None, "not solved, so there are no strategies")
    x, y = (part / part.sum() for part in game.parts(result.z))
    exact = None
    if result.exact is not None and result.exact.z is not None:
        parts = zip(("row", "column"), game.parts(result.exact.z), strict=True)
        exact = {name: [value / sum(part) for value in part] for name, part in parts}
    by_row, by_column = game.A @ y, x @ game.B
    payoffs = float(x @ by_row), float(by_column @ y)
    gains = _gain(by_row, payoffs[0], game.A), _gain(by_column, payoffs[1], game.B)
    allowed = 10 * result.problem.n * result.tol  # M has the payoffs subtracted from a constant, and thereby rounded
    small = result.point.solves() and all(
        gain <= allowed * (float(np.ptp(own)) or 1.0) for gain, own in zip(gains, (game.A, game.B), strict=True)
    )
    found = "an equilibrium" if small else "not an equilibrium to the tolerance"
    by = f"by a best response the row player would gain {gains[0]:.1g}, the column player {gains[1]:.1g}"
    return Equilibrium(x, y, payoffs, gains, f"{found}: {by}", exact)


def _gain(replies: Vector, payoff: float, payoffs: Vector) -> float:
    """What the best reply gains over the payoff; 0 if that is only rounding."""
    gain = float(replies.max()) - payoff
    return gain if gain > ROW_ROUNDING * float(np.abs(payoffs).max()) else 0.0
