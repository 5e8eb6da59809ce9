"""Behavior strategies of a game tree, and the gains by best responses to them, computed
from the terminal nodes of the tree backward over a player's information sets, not from
the matrices of the sequence form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from lcpcli.formulations.equilibria import PER_UNKNOWN, Profile
from lcpcli.formulations.game_tree.game import ExtensiveGame
from lcpcli.formulations.game_tree.tree import GameTree, Player, distinct_labels
from lcpcli.linalg.doubles import EPS, ROW_ROUNDING
from lcpcli.report import wording
from lcpcli.report.document import Table

MAX_SETS = 100  # information sets in a table, a few screens

# A realization plan: for each sequence of the player the product of the probabilities
# of its moves.
Plan = list[Any]
Strategy = list[list[Any]]  # for each information set the probabilities of its actions


@dataclass(frozen=True, eq=False)
class InformationSetStrategy:
    """The strategy of a player at an information set: the player's name, the label, the
    actions and their probabilities, and the probability that the information set is
    reached.
    """

    player: str
    label: str
    actions: list[str]
    probabilities: list[Any]
    reached: Any


@dataclass(frozen=True, eq=False)
class Behavior(Profile):
    """Behavior strategies of both players of a game tree, all numbers as floats or as
    fractions: the strategies at all information sets, in the order of the file, the
    realization plans, the expected payoffs, and how much each player would gain by a
    best response, 0 if that is at the level of rounding errors.
    """

    players: list[str]
    information_sets: list[InformationSetStrategy]
    plans: tuple[Plan, Plan]
    payoffs: tuple[Any, Any]
    gains: tuple[Any, Any]

    def lines(self) -> list[str]:
        return [payoffs_of(self)]

    def tables(self, *, whole: bool = True) -> list[Table]:  # noqa: ARG002
        return [table_of(self.information_sets)]

    @classmethod
    def of(cls, game: ExtensiveGame, strategies: Sequence[Strategy]) -> Behavior:
        """Return the profile of these strategies, in the numbers that they have."""
        tree, players = game.tree, game.tree.players
        one, two = map(plan_of, players, strategies)
        exact = not any(isinstance(value, float) for value in (*one, *two))
        number: Any = Fraction if exact else float
        one, two = list(map(number, one)), list(map(number, two))
        terminal_nodes = _terminal_nodes(tree, number)
        payoffs = list[Any]()
        gains = list[Any]()
        for player, (plan_of_player, other) in enumerate(((one, two), (two, one))):
            best = _best_plan(players[player], terminal_nodes, player, other)
            now, then = (
                _expected(terminal_nodes, player, plan, other)
                for plan in (plan_of_player, best)
            )
            gain = then[0] - now[0]
            rounding = 0 if exact else ROW_ROUNDING * (now[1] + then[1])
            payoffs.append(now[0])
            gains.append(gain if gain > rounding else 0 * abs(gain))
        names = tree.names()
        reached = [[number(0)] * len(player.sets) for player in players]
        for node in tree.nodes:
            if node.owner >= 0:
                i, j = node.sequences
                reached[node.owner][node.where] += number(node.chance) * one[i] * two[j]
        sets = [
            InformationSetStrategy(
                name, label, distinct_labels(information_set.actions), *values
            )
            for name, player, *both in zip(
                names, players, strategies, reached, strict=True
            )
            for label, information_set, *values in zip(
                player.labels(), player.sets, *both, strict=True
            )
        ]
        return cls(
            names, sets, (one, two), (payoffs[0], payoffs[1]), (gains[0], gains[1])
        )

    @classmethod
    def of_plans(cls, game: ExtensiveGame, x: Plan, y: Plan) -> Behavior:
        return cls.of(
            game,
            [
                strategy_of(*each)
                for each in zip(game.tree.players, (x, y), strict=True)
            ],
        )

    def are_best(self, game: ExtensiveGame, tol: float) -> bool:
        """Return whether no player gains more than the tolerance times the terms of its
        gain, which are measured from its payoff.
        """
        allowed = PER_UNKNOWN * sum(game.sizes) * tol
        terminal_nodes = _terminal_nodes(game.tree, float)
        plans = [list(map(float, plan)) for plan in self.plans]
        for player, gain in enumerate(self.gains):
            centre, other = float(self.payoffs[player]), plans[1 - player]
            both = (
                plans[player],
                _best_plan(game.tree.players[player], terminal_nodes, player, other),
            )
            if not gain <= allowed * sum(
                _expected(terminal_nodes, player, plan, other, centre)[1]
                for plan in both
            ):
                return False
        return True


def point_of(game: ExtensiveGame, x: Plan, y: Plan) -> list[Any]:
    """Return the z with these plans, and with the costs of best responses to them, in
    the numbers that they have.
    """
    z = [*x, *y]
    for player, other in ((0, y), (1, x)):
        player_sets = game.tree.players[player]
        exact = not any(isinstance(value, float) for value in other)
        behind: Plan = [0] * player_sets.sequences
        for pair, cost in game.costs[player].at.items():
            behind[pair[player]] -= (cost if exact else float(cost)) * other[
                pair[1 - player]
            ]
        z += [0 - value for value in _best_response(player_sets, behind)[1]]
    return z


def plan_of(player: Player, strategy: Strategy) -> Plan:
    """Return the realization plan of a behavior strategy."""
    plan: Plan = [1]
    for before, probabilities in zip(player.before, strategy, strict=True):
        plan += [plan[before] * probability for probability in probabilities]
    return plan


def strategy_of(player: Player, plan: Plan) -> Strategy:
    """Return the behavior strategy of a plan, uniform at information sets that the
    player's earlier moves exclude.
    """
    strategy: Strategy = []
    for i in range(len(player.sets)):
        total = sum(probabilities := [plan[sequence] for sequence in player.moves(i)])
        if total <= (EPS * len(plan) if isinstance(total, float) else 0):
            probabilities, total = (
                [total * 0 + 1] * len(probabilities),
                len(probabilities),
            )
        strategy.append([value / total for value in probabilities])
    return strategy


def _terminal_nodes(
    tree: GameTree, number: Any
) -> list[tuple[tuple[int, int], Any, list[Any]]]:
    """Return the terminal nodes of a tree with their numbers as floats or fractions."""
    return [
        (at, number(chance), list(map(number, payoffs)))
        for at, chance, payoffs in tree.terminal_nodes
    ]


def _expected(
    terminal_nodes: Sequence[Any], player: int, plan: Plan, other: Plan, centre: Any = 0
) -> tuple[Any, Any]:
    """Return the expected payoff of a player minus the centre, and the sum of the sizes
    of its terms.
    """
    weights = (
        (chance * plan[at[player]] * other[at[1 - player]], payoffs)
        for at, chance, payoffs in terminal_nodes
    )
    terms = [
        weight * (payoffs[player] - centre) for weight, payoffs in weights if weight
    ]
    zero = 0 * terminal_nodes[0][1]
    return sum(terms, zero), sum(map(abs, terms), zero)


def _best_plan(
    player_sets: Player, terminal_nodes: Sequence[Any], player: int, other: Plan
) -> Plan:
    """Return the plan of a pure best response to the plan of the other player."""
    behind: Plan = [0 * terminal_nodes[0][1]] * player_sets.sequences
    for at, chance, payoffs in terminal_nodes:
        if weight := chance * other[at[1 - player]]:
            behind[at[player]] += weight * payoffs[player]
    return plan_of(player_sets, _best_response(player_sets, behind)[0])


def _best_response(player: Player, behind: Plan) -> tuple[Strategy, list[Any]]:
    """Return a pure best response, with the first action of the largest payoff at each
    information set, and the payoff of the game and of the continuation after each
    information set.

    behind : the payoff of each sequence at terminal nodes. Information sets that follow
        others of the player come later, and are decided first.
    """
    behind = [*behind]
    strategy = list[list[Any]]()
    largest = list[Any]()
    for i in range(len(player.sets) - 1, -1, -1):
        payoffs = [behind[sequence] for sequence in player.moves(i)]
        largest.append(max(payoffs))
        chosen = payoffs.index(largest[-1])
        strategy.append([int(move == chosen) for move in range(len(payoffs))])
        behind[player.before[i]] += largest[-1]
    return strategy[::-1], [behind[0], *reversed(largest)]


def payoffs_of(equilibrium: Any) -> str:
    pairs = zip(equilibrium.players, equilibrium.payoffs, strict=True)
    payoffs = (f"{name} {wording.number(value)}" for name, value in pairs)
    return f"payoffs {', '.join(payoffs)}"


def table_of(sets: Sequence[InformationSetStrategy]) -> Table:
    """Return a table of the strategies at information sets, without actions that are
    not chosen.
    """
    chosen = (
        wording.named(
            list(information_set.probabilities),
            information_set.actions,
            wording.number,
            True,
        )[1:-1]
        for information_set in sets
    )
    shown = zip(sets[:MAX_SETS], chosen, strict=False)
    rows = [
        [
            information_set.player,
            information_set.label,
            wording.number(information_set.reached),
            actions,
        ]
        for information_set, actions in shown
    ]
    notes = []
    if len(sets) > MAX_SETS:
        notes = [f"the first {MAX_SETS} of {len(sets)} information sets; JSON has all"]
    return Table(
        ["player", "information set", "reached", "probabilities"],
        [rows],
        (0, 1, 3),
        (3,),
        notes=notes,
    )
