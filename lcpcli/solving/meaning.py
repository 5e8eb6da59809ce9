"""What results mean for what their problem comes from."""

from __future__ import annotations

from collections.abc import Sequence

from lcpcli.model.origins import Game
from lcpcli.model.program import Program
from lcpcli.solving.answer import Answer
from lcpcli.solving.equilibrium import equilibrium
from lcpcli.solving.minimum import minima
from lcpcli.solving.result import Result


def answers(results: Sequence[Result]) -> list[Answer | None]:
    """What each of the results on one problem means for its origin; None if it has none."""
    origin = results[0].problem.origin
    if isinstance(origin, Program):
        return [*minima(results, origin)]
    if isinstance(origin, Game):
        return [equilibrium(result, origin) for result in results]
    return [None] * len(results)
