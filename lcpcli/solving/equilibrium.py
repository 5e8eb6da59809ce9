"""What results mean for the game that their problem comes from."""

from __future__ import annotations

from lcpcli.model.origins import Game
from lcpcli.solving.answer import Equilibrium
from lcpcli.solving.result import Result
from lcpcli.verify.equilibrium import Strategies, allowance


def equilibrium(result: Result, game: Game) -> Equilibrium:
    """Strategies, payoffs and gains if the result is solved, and whether the strategies are an equilibrium."""
    if not result.solved:
        return Equilibrium(None, None, None, None, "not solved, so there are no strategies")
    x, y = (part / part.sum() for part in game.parts(result.z))
    exact = None
    if result.exact is not None and result.exact.z is not None:
        parts = zip(("row", "column"), game.parts(result.exact.z), strict=True)
        exact = {name: [value / sum(part) for value in part] for name, part in parts}
    own = Strategies.of(game, x, y)
    small = result.point.solves() and own.are_best(game, allowance(result.problem.n, result.tol))
    (by_row, by_column), (row, column) = own.payoffs, own.gains
    return Equilibrium(x, y, (by_row, by_column), (row, column), own.statement(small), exact)
