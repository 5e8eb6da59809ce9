"""What a z says about a polymatrix game: mixed strategies, expected payoffs, and what
best responses would gain, computed from the payoffs that the user gave.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
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
    PER_UNKNOWN,
    Profile,
    are_probabilities,
    of_strategies,
    with_strategies,
)
from lcpcli.formulations.players.polymatrix import Polymatrix
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.rational.numbers import brief
from lcpcli.report import wording
from lcpcli.solving.result import Result
from lcpcli.verify.verification import Proposed, Verification


@dataclass(frozen=True, eq=False)
class MixedStrategies(Profile):
    """Mixed strategies of all players, in floating-point numbers or in fractions.

    players, actions : their names.
    strategies : for each player the probabilities of its actions; None if the problem
        is not solved, as are payoffs.
    payoffs : the expected payoffs.
    gains : how much each player would gain by a best response; 0 if that is only
        rounding error.
    statement : whether the strategies are an equilibrium.
    exact : the same in fractions if z is proved, otherwise None.
    """

    players: Sequence[str]
    actions: Sequence[Sequence[str]]
    strategies: Sequence[Sequence[Any]] | None
    payoffs: tuple[Any, ...] | None
    gains: tuple[Any, ...]
    statement: str = ""
    exact: Any = None
    sizes: tuple[float, ...] = field(default=(), repr=False)

    def record(self) -> Mapping[str, Any]:
        names = ("players", "actions", "strategies", "payoffs", "gains", "statement")
        values = {name: getattr(self, name) for name in names}
        return values | {"exact": self.exact and self.exact.record()}

    def lines(self) -> list[str]:
        shown = self.exact or self
        if shown.strategies is None:
            return [self.statement]
        cell = brief if self.is_exact or self.exact else wording.plain_number
        parts = zip(shown.players, shown.strategies, shown.actions, strict=True)
        lines = [
            f"{who} = {wording.named(list(x), of, cell, sparing=True)}"
            for who, x, of in parts
        ]
        pairs = zip(shown.players, shown.payoffs or (), strict=True)
        payoffs = ", ".join(f"{who} {cell(payoff)}" for who, payoff in pairs)
        return [
            *lines,
            f"payoffs: {payoffs}",
            *[shown.statement] * bool(shown.statement),
        ]

    def cells(self) -> Mapping[str, Sequence[Any]]:
        shown: Any = self.exact or self
        if shown.payoffs is None:
            return equilibria.cells_of()
        return equilibria.cells_of(shown.players, shown.strategies, shown.payoffs)

    @property
    def is_exact(self) -> bool:
        return isinstance((self.payoffs or [0.0])[0], Fraction)

    @classmethod
    def of(cls, game: Polymatrix, strategies: Sequence[Sequence[Any]]) -> Any:
        """Return these strategies with their payoffs and gains, in fractions if all
        probabilities are exact, otherwise in floating-point numbers.
        """
        exact = not any(isinstance(p, float) for p in chain(*strategies))
        number: Any = Fraction if exact else float
        payoffs = list[Any]()
        gains = list[Any]()
        sizes = list[float]()
        for player, strategy in enumerate(strategies):
            totals, terms = _totals(game, player, strategies, number)
            payoff = sum(
                (p * u for p, u in zip(strategy, totals, strict=True)), number(0)
            )
            best = max(range(len(strategy)), key=totals.__getitem__)
            mixed = (float(p) * t for p, t in zip(strategy, terms, strict=True))
            sizes.append(terms[best] + sum(mixed))
            gain = totals[best] - payoff
            rounding = 0 if exact else ROW_ROUNDING * sizes[-1]
            payoffs.append(payoff)
            gains.append(gain if gain > rounding else number(0))
        return cls(
            game.names_of_players(),
            game.names_of_actions(),
            strategies,
            tuple(payoffs),
            tuple(gains),
            sizes=tuple(sizes),
        )

    def are_best(self, tol: float) -> bool:
        """Return whether no gain exceeds the tolerance, relative to the terms of which
        the gain is the sum.
        """
        allowed = PER_UNKNOWN * sum(map(len, self.actions)) * tol
        pairs = zip(self.gains, self.sizes, strict=True)
        return all(gain <= allowed * size for gain, size in pairs)


def _totals(
    game: Polymatrix, player: int, strategies: Sequence[Sequence[Any]], number: Any
) -> tuple[list[Any], list[float]]:
    """Return the expected payoff of each action of a player, and for each the sum of
    the absolute values of its terms.
    """
    totals = [number(0)] * game.sizes[player]
    terms = [0.0] * game.sizes[player]
    for (i, j), table in game.payoffs.items():
        for a, row in enumerate(table if i == player else ()):
            for value, p in zip(row, strategies[j], strict=True):
                totals[a] += number(value) * p
                terms[a] += abs(float(number(value) * p))
    return totals, terms


@np.errstate(all="ignore")
def checked_profile_at(
    game: Polymatrix, z: Any, tol: float
) -> equilibria.CheckedProfile | None:
    """Return the strategies that z represents, and whether they are an equilibrium to
    the tolerance; None if a part of z has negative entries or the sum 0.
    """
    values = z.tolist() if isinstance(z, np.ndarray) else z
    parts = game.parts(values)
    if any(min(part) < 0 or not sum(part) for part in parts):
        return None
    profile = MixedStrategies.of(
        game, [[p / sum(weights) for p in weights] for weights in parts]
    )
    return equilibria.CheckedProfile(profile, profile.are_best(tol))


def answer(game: Polymatrix, result: Result) -> MixedStrategies:
    reading = checked_profile_at(game, result.z, result.tol) if result.solved else None
    if reading is None:
        names = game.names_of_players(), game.names_of_actions()
        return MixedStrategies(*names, None, None, (), equilibria.UNSOLVED)
    profile: Any = reading.profile
    exact = None
    if result.exact is not None and result.exact.z is not None:
        exact = MixedStrategies.of(game, game.parts(list(result.exact.z)))
        exact = replace(exact, statement=exact.verdict(True))
    statement = profile.verdict(reading.are_equilibrium)
    equilibrium: MixedStrategies = replace(profile, statement=statement, exact=exact)
    return equilibrium


def accepted(game: Polymatrix, result: Result) -> Result:
    return equilibria.accepted(game, result, partial(checked_profile_at, game))


@np.errstate(all="ignore")  # overflow gives infinity
def verified(game: Polymatrix, proposed: Proposed) -> Verification:
    """Verify z, or the probabilities of all actions."""
    if len(proposed.values) == proposed.problem.n:
        reading = checked_profile_at(game, proposed.array, proposed.tol)
        verification = proposed.of_z(proposed.values)
        return (
            verification if reading is None else with_strategies(verification, *reading)
        )
    # In fractions also where z is wanted in double precision: of payoffs that have a
    # large part in common, differences would be rounding.
    parts = game.parts([Fraction(p) for p in proposed.values])
    for who, strategy in zip(game.names_of_players(), parts, strict=True):
        if not are_probabilities(np.array(strategy, dtype=float)):
            shown = ", ".join(f"{float(p):.7g}" for p in strategy)
            raise ProblemError(who, f"has {shown} as the probabilities", HINT)
    strategies = [[p / sum(strategy) for p in strategy] for strategy in parts]
    profile = MixedStrategies.of(game, strategies)
    best = map(sum, zip(profile.payoffs, profile.gains, strict=True))
    costs = [
        (Fraction(game.constant(i)) - payoff) * Fraction(game.factors[i])
        for i, payoff in enumerate(best)
    ]
    z: list[Any] = [*chain(*strategies), *costs]
    if proposed.data is None:
        z = list(map(float, z))
        profile = MixedStrategies.of(game, game.parts(z[: sum(game.sizes)]))
    return of_strategies(proposed, z, profile, profile.are_best(proposed.tol))


class Equilibria(MeaningToPlayers):
    """What solutions mean: probabilities and payoffs."""

    vertices = "the probabilities at its vertices"

    def payoffs(self) -> Mapping[str, Payoff]:
        game, k = self._game, sum(self._game.sizes)
        return {
            name: Payoff(k + i, 1 / game.factors[i], game.constant(i))
            for i, name in enumerate(self._players)
        }

    def shown(self, indices: Sequence[int]) -> list[int]:
        return [i for i in indices if i < sum(self._game.sizes)]

    def at_vertex(self, z: Values) -> tuple[Values, Any]:
        return z, self._of(z).payoffs

    def _of(self, z: Values) -> MixedStrategies:
        profile: MixedStrategies = MixedStrategies.of(
            self._game, self._game.parts(list(z))
        )
        return profile

    def equilibrium(self, z: Values) -> Any:
        return self._of(z).record()

    def best(
        self,
        z: Values,
        cell: Callable[[Fraction], str],  # noqa: ARG002
    ) -> tuple[list[str], list[Any]]:
        return self._of(z).lines(), []
