"""The behavior strategies that a z of a game tree represents, verified by best
responses.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from itertools import chain
from typing import Any

import numpy as np

from lcpcli.enumeration.meaning import MeaningToPlayers, Payoff, Values
from lcpcli.errors import ProblemError
from lcpcli.formulations import equilibria
from lcpcli.formulations.equilibria import (
    HINT,
    are_probabilities,
    of_strategies,
    with_strategies,
)
from lcpcli.formulations.game_tree.behavior import (
    Behavior,
    InformationSetStrategy,
    payoffs_of,
    point_of,
    table_of,
)
from lcpcli.formulations.game_tree.game import ExtensiveGame
from lcpcli.model.formulation import Answer
from lcpcli.report.document import Table
from lcpcli.solving.result import Result
from lcpcli.typing import Vector
from lcpcli.verify.verification import Proposed, Verification


@dataclass(frozen=True, eq=False)
class BehaviorEquilibrium(Answer):
    """The equilibrium that a solution of the mixed problem of a game tree represents.

    players : the names of both players.
    information_sets : behavior strategies, the first player's and then the second
        player's information sets, in the order of the file; None, as are the plans,
        payoffs and gains, if the problem is not solved. At an information set that a
        player's earlier moves exclude, its actions have equal probabilities; any other
        probabilities are an equilibrium too.
    plans : the realization plans, for each sequence of a player's moves the product of
        their probabilities.
    payoffs : the expected payoffs of both players. gains : how much each player would
        gain by a best response, computed on the tree, backward over its information
        sets; 0 if the gain is at the level of rounding errors.
    statement : whether the strategies are an equilibrium; they need not be one in each
        subgame.
    exact : the same in fractions if z is proved, else None.
    """

    players: list[str]
    information_sets: list[InformationSetStrategy] | None
    plans: tuple[Vector, Vector] | None
    payoffs: tuple[float, float] | None
    gains: tuple[float, float] | None
    statement: str
    exact: Behavior | None = None

    @property
    def _best(self) -> Any:
        return self.exact or self

    def lines(self) -> list[str]:
        if self.payoffs is None:
            return [self.statement]
        return [payoffs_of(self._best), self.statement]

    def tables(self, *, whole: bool = True) -> list[Table]:  # noqa: ARG002
        return [] if self.payoffs is None else [table_of(self._best.information_sets)]

    def cells(self) -> Mapping[str, Sequence[Any]]:
        if self.payoffs is None:
            return equilibria.cells_of()
        profile = self._best
        return equilibria.cells_of(profile.players, moves(profile), profile.payoffs)


def answer(game: ExtensiveGame, result: Result) -> BehaviorEquilibrium:
    """Return strategies, payoffs and gains if the result is solved, and whether the
    strategies are an equilibrium."""
    reading = profile_of(game, result.z, result.tol) if result.solved else None
    if reading is None:
        unsolved = equilibria.UNSOLVED
        return BehaviorEquilibrium(game.tree.names(), None, None, None, None, unsolved)
    profile, are_equilibrium = reading
    assert isinstance(profile, Behavior)
    exact = None
    if result.exact is not None and result.exact.z is not None:
        exact = behavior_at(game, result.exact.z)
    return BehaviorEquilibrium(
        profile.players,
        profile.information_sets,
        (np.array(profile.plans[0]), np.array(profile.plans[1])),
        profile.payoffs,
        profile.gains,
        (exact or profile).verdict(are_equilibrium),
        exact,
    )


def accepted(game: ExtensiveGame, result: Result) -> Result:
    return equilibria.accepted(game, result, partial(profile_of, game))


def behavior_at(game: ExtensiveGame, z: Sequence[Any]) -> Behavior:
    """Return the strategies that the plans in z represent."""
    x, y, *_ = game.parts(z)
    return Behavior.of_plans(game, list(x), list(y))


@np.errstate(all="ignore")
def profile_of(
    game: ExtensiveGame, z: Sequence[Any] | Vector, tol: float
) -> equilibria.CheckedProfile | None:
    """Return the strategies that z represents, in its numbers, and whether they are an
    equilibrium to the tolerance; None if it represents none.
    """
    values = z.tolist() if isinstance(z, np.ndarray) else z
    x, y, *_ = game.parts(values)
    if min(*x, *y) < 0 or not (x[0] and y[0]):
        return None
    behavior = behavior_at(game, values)
    return equilibria.CheckedProfile(behavior, behavior.are_best(game, tol))


@np.errstate(all="ignore")  # overflow gives infinity
def verified(game: ExtensiveGame, proposed: Proposed) -> Verification:
    """Verify z, or the probabilities of all actions."""
    if len(proposed.values) == proposed.problem.n:
        reading = profile_of(game, proposed.array, proposed.tol)
        verification = proposed.of_z(proposed.values)
        return (
            verification if reading is None else with_strategies(verification, *reading)
        )
    behavior = _proposed(game, proposed.values)
    # A player without moves has a plan of integers.
    number: Callable[[Any], Any] = float if proposed.data is None else Fraction
    z = point_of(game, *(list(map(number, plan)) for plan in behavior.plans))
    are_equilibrium = behavior.are_best(game, proposed.tol)
    return of_strategies(proposed, z, behavior, are_equilibrium)


def _proposed(game: ExtensiveGame, values: Sequence[Any] | Vector) -> Behavior:
    """Return the strategies with these probabilities of all actions, divided by their
    sums; raise ProblemError if they are no probabilities.
    """
    remaining, strategies = iter(values), list[list[list[Any]]]()
    for player in game.tree.players:
        probabilities_of_sets = [
            [next(remaining) for _ in each.actions] for each in player.sets
        ]
        for label, probabilities in zip(
            player.labels(), probabilities_of_sets, strict=True
        ):
            if not are_probabilities(np.array(probabilities, dtype=float)):
                reason = (
                    f"has {', '.join(f'{float(p):.7g}' for p in probabilities)} as "
                    "the probabilities of its actions"
                )
                raise ProblemError(
                    f"information set {label} of {player.name}", reason, HINT
                )
        strategies.append(
            [[p / sum(each) for p in each] for each in probabilities_of_sets]
        )
    return Behavior.of(game, strategies)


def moves(profile: Any) -> list[list[Any]]:
    """Return for each player the probabilities of the last moves of its sequences, 1
    for the empty sequence. profile : a `Behavior` or an answer.
    """
    sets = (
        [each.probabilities for each in profile.information_sets if each.player == name]
        for name in profile.players
    )
    return [[1, *chain(*probabilities)] for probabilities in sets]


class Plans(MeaningToPlayers):
    """What plans of players mean: the probabilities of their moves, and payoffs."""

    vertices = "the plans at its vertices"

    def payoffs(self) -> Mapping[str, Payoff]:
        game, first = self._game, sum(self._game.sizes[:2])
        indices = first, first + game.sizes[2]
        return {
            name: Payoff(i, 1 / costs.factor, costs.constant)
            for name, i, costs in zip(self._players, indices, game.costs, strict=True)
        }

    def shown(self, indices: Sequence[int]) -> list[int]:
        sizes = self._game.sizes
        empty = 0, sizes[0]
        return [i for i in indices if i < sum(sizes[:2]) and i not in empty]

    def at_vertex(self, z: Values) -> tuple[Values, Sequence[Any]]:
        behavior = behavior_at(self._game, z)
        return list(chain(*moves(behavior))), behavior.payoffs

    def equilibrium(self, z: Values) -> Behavior:
        return behavior_at(self._game, z)

    def best(
        self,
        z: Values,
        cell: Callable[[Fraction], str],  # noqa: ARG002
    ) -> tuple[list[str], list[Any]]:
        behavior = behavior_at(self._game, z)
        return [payoffs_of(behavior)], [table_of(behavior.information_sets)]
