"""Equilibria of games: what a best response to strategies would gain. In extensive form it is computed on the tree,
backward over a player's information sets, not from the sequence form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from lcpcli.linalg.doubles import EPS, ROW_ROUNDING
from lcpcli.model.extensive import ExtensiveGame, moves_of
from lcpcli.model.game_tree import TERMINAL, GameTree, Player
from lcpcli.model.origins import Game
from lcpcli.typing import Vector

Plan = list[Any]  # a realization plan: for each sequence of the player the product of the probabilities of its moves
Strategy = list[list[Any]]  # for each information set the probabilities of its actions


class _Statement:
    """What is said of strategies. players : their names. gains : how much each would gain by a best response."""

    players: Sequence[str]
    gains: tuple[Any, ...]

    def statement(self, are_equilibrium: bool) -> str:
        """Return a sentence on whether the strategies are an equilibrium, and on what a player would gain."""
        tolerance = "" if isinstance(self.gains[0], Fraction) else " to the tolerance"
        found = "an equilibrium" if are_equilibrium else f"not an equilibrium{tolerance}"
        one, other = map(float, self.gains)
        return f"{found}: by a best response {self.players[0]} would gain {one:.1g}, {self.players[1]} {other:.1g}"


@dataclass(frozen=True, eq=False)
class InformationSetStrategy:
    """What a player does at an information set: the player's name, the label, the actions and their probabilities, and
    the probability that the information set is reached."""

    player: str
    label: str
    actions: list[str]
    probabilities: list[Any]
    reached: Any


@dataclass(frozen=True, eq=False)
class Behavior(_Statement):
    """Behavior strategies of both players of a game tree, all numbers in doubles or in fractions: what they do at all
    information sets, in the order of the file, the realization plans, the expected payoffs, and how much each player
    would gain by a best response, 0 if that is only rounding."""

    players: list[str]
    information_sets: list[InformationSetStrategy]
    plans: tuple[Plan, Plan]
    payoffs: tuple[Any, Any]
    gains: tuple[Any, Any]

    @classmethod
    def of(cls, game: ExtensiveGame, strategies: Sequence[Strategy]) -> Behavior:
        """Return what these strategies are, in the numbers that they have."""
        one, two = (plan_of(player, own) for player, own in zip(game.tree.players, strategies, strict=True))
        exact = not any(isinstance(value, float) for value in (*one, *two))
        one, two = (list(map(Fraction if exact else float, plan)) for plan in (one, two))
        tree, payoffs, gains = _Ends.of(game.tree, exact), list[Any](), list[Any]()
        for player, (own, other) in enumerate(((one, two), (two, one))):
            best = plan_of(game.tree.players[player], tree.best_response(player, other))
            now, then = tree.expected(player, own, other), tree.expected(player, best, other)
            gain, rounding = then[0] - now[0], 0 if exact else ROW_ROUNDING * (now[1] + then[1])
            payoffs.append(now[0])
            gains.append(gain if gain > rounding else 0 * abs(gain))
        names = game.tree.names()
        each = zip(names, game.tree.players, strategies, tree.reached((one, two)), strict=True)
        sets = [
            InformationSetStrategy(name, label, moves_of(own.actions), *values)
            for name, player, strategy, numbers in each
            for label, own, *values in zip(player.labels(), player.sets, strategy, numbers, strict=True)
        ]
        return cls(names, sets, (one, two), (payoffs[0], payoffs[1]), (gains[0], gains[1]))

    @classmethod
    def of_plans(cls, game: ExtensiveGame, x: Plan, y: Plan) -> Behavior:
        return cls.of(game, [strategy_of(*each) for each in zip(game.tree.players, (x, y), strict=True)])

    def are_best(self, game: ExtensiveGame, allowed: float) -> bool:
        """Return whether no player gains more than `allowed` of the terms of its gain, counted from what it gets."""
        tree, own = _Ends.of(game.tree, exact=False), [list(map(float, plan)) for plan in self.plans]
        for player, gain in enumerate(self.gains):
            centre, other = float(self.payoffs[player]), own[1 - player]
            plans = own[player], plan_of(game.tree.players[player], tree.best_response(player, other))
            if not gain <= allowed * sum(tree.expected(player, plan, other, centre)[1] for plan in plans):
                return False
        return True


def point_of(game: ExtensiveGame, x: Plan, y: Plan) -> list[Any]:
    """Return the z with these plans, and with the costs of best responses to them, in the numbers that they have."""
    return [*x, *y, *_costs(game, 0, y), *_costs(game, 1, x)]


def _costs(game: ExtensiveGame, player: int, other: Plan) -> list[Any]:
    """Return by the sequence form the least costs against a plan, of the game and behind each information set."""
    own, exact = game.tree.players[player], not any(isinstance(value, float) for value in other)
    at: Plan = [0] * own.sequences
    for pair, cost in game.costs[player].at.items():
        at[pair[player]] += (cost if exact else float(cost)) * other[pair[1 - player]]
    least: list[Any] = []
    for i in range(len(own.sets) - 1, -1, -1):
        least.append(min(at[sequence] for sequence in own.moves(i)))
        at[own.before[i]] += least[-1]
    return [at[0], *reversed(least)]


def plan_of(player: Player, strategy: Strategy) -> Plan:
    plan: Plan = [1]
    for before, probabilities in zip(player.before, strategy, strict=True):
        plan += [plan[before] * probability for probability in probabilities]
    return plan


def strategy_of(player: Player, plan: Plan) -> Strategy:
    """Return the behavior strategy of a plan, uniform at information sets that the player's own moves exclude."""
    found: Strategy = []
    for i in range(len(player.sets)):
        total = sum(own := [plan[sequence] for sequence in player.moves(i)])
        if total <= (EPS * len(plan) if isinstance(total, float) else 0):
            own, total = [total * 0 + 1] * len(own), len(own)
        found.append([value / total for value in own])
    return found


@dataclass(frozen=True, eq=False)
class _Ends:
    """A tree with the chance of each node, and with the sum of payoffs from the root to it, as doubles or fractions."""

    tree: GameTree
    chances: list[Any]
    totals: list[tuple[Any, Any]]

    @classmethod
    def of(cls, tree: GameTree, exact: bool) -> _Ends:
        number: Any = Fraction if exact else float
        totals = [(number(one), number(two)) for one, two in tree.totals()]
        return cls(tree, list(map(number, tree.chances())), totals)

    def expected(self, player: int, own: Plan, other: Plan, centre: Any = 0) -> tuple[Any, Any]:
        """Return the expected payoff of a player less the centre, and the sum of the sizes of its terms."""
        value = terms = self.chances[0] * 0
        each = zip(self.tree.nodes, self.tree.sequences, self.chances, self.totals, strict=True)
        for node, sequences, chance, total in each:
            if node.owner == TERMINAL and (weight := chance * own[sequences[player]] * other[sequences[1 - player]]):
                term = weight * (total[player] - centre)
                value, terms = value + term, terms + abs(term)
        return value, terms

    def best_response(self, player: int, other: Plan) -> Strategy:
        """Return a pure best response to the plan of the other player: at each information set the first action with
        the largest payoff. Those behind more of the player's own moves are decided first: with perfect recall all nodes
        of one lie behind the same moves, so that the payoffs below their actions are known then."""
        tree, nodes = self.tree, self.tree.nodes
        layers, depths, children = list[list[int]](), list[int](), [list[int]() for _ in nodes]
        for i, node in enumerate(nodes):
            depths.append(depths[node.parent] + (nodes[node.parent].owner == player) if i else 0)
            if depths[i] == len(layers):
                layers.append([])
            layers[depths[i]].append(i)
            if i:
                children[node.parent].append(i)
        zero = self.chances[0] * 0
        values = [zero] * len(nodes)  # the payoffs below each node, times what chance and the other player do
        chosen, sums = dict[int, int](), [[zero] * len(own.actions) for own in tree.players[player].sets]
        for layer in reversed(layers):
            own_nodes = [i for i in layer if nodes[i].owner == player]
            for i in own_nodes:
                for move, child in enumerate(children[i]):
                    sums[nodes[i].where][move] += values[child]
            decided = {nodes[i].where for i in own_nodes}
            chosen |= {j: max(range(len(sums[j])), key=sums[j].__getitem__) for j in decided}
            for i in reversed(layer):
                if nodes[i].owner == player:
                    values[i] = values[children[i][chosen[nodes[i].where]]]
                elif nodes[i].owner != TERMINAL:
                    values[i] = sum(values[child] for child in children[i])
                elif weight := self.chances[i] * other[tree.sequences[i][1 - player]]:
                    values[i] = weight * self.totals[i][player]
        return [[int(move == chosen[j]) for move in range(len(own))] for j, own in enumerate(sums)]

    def reached(self, plans: tuple[Plan, Plan]) -> tuple[list[Any], list[Any]]:
        """Return for each information set of both players the probability that it is reached."""
        found = tuple([self.chances[0] * 0] * len(player.sets) for player in self.tree.players)
        for node, (one, two), chance in zip(self.tree.nodes, self.tree.sequences, self.chances, strict=True):
            if node.owner >= 0:
                found[node.owner][node.where] += chance * plans[0][one] * plans[1][two]
        return found[0], found[1]


@dataclass(frozen=True, eq=False)
class Strategies(_Statement):
    """A pair of mixed strategies of a game: the probabilities, the payoffs, and how much each player would gain by a
    best response to the other, 0 if that is only rounding; all doubles, or all fractions."""

    row: Vector
    column: Vector
    payoffs: tuple[Any, ...]
    gains: tuple[Any, ...]
    players: Sequence[str] = ("the row player", "the column player")

    @classmethod
    def of(cls, game: Game, x: Vector, y: Vector) -> Strategies:
        """Return the strategies x, y of a game: doubles, or fractions in arrays of objects, with payoffs as written."""
        exact = x.dtype == object
        number: Any = Fraction if exact else float
        A, B = (np.array(own, dtype=object) for own in game.payoffs()) if exact else (game.A, game.B)
        by_row, by_column = A @ y, x @ B
        row, column = number(x @ by_row), number(by_column @ y)
        gains = number(by_row.max()) - row, number(by_column.max()) - column
        rounding = (0.0, 0.0) if exact else tuple(ROW_ROUNDING * terms for terms in _terms(game, x, y, (0.0, 0.0)))
        by_best = (gain if gain > least else number(0) for gain, least in zip(gains, rounding, strict=True))
        return cls(x, y, (row, column), tuple(by_best), game.players or cls.players)

    def are_best(self, game: Game, allowed: float) -> bool:
        """Return whether no player gains more than `allowed` of the terms of its gain, of payoffs that are met."""
        terms = _terms(game, self.row.astype(float), self.column.astype(float), self.payoffs)
        return all(gain <= allowed * size for gain, size in zip(self.gains, terms, strict=True))


def _terms(game: Game, x: Vector, y: Vector, centres: Sequence[Any]) -> tuple[float, float]:
    """Return each player's terms of its gain: sizes of payoffs less a centre, in its mixture and its best response."""
    found = []
    for A, own, other, centre in ((game.A, x, y, centres[0]), (game.B.T, y, x, centres[1])):
        sizes = np.abs(A - float(centre)) @ other
        found.append(float(own @ sizes + sizes[np.argmax(A @ other)]))
    return found[0], found[1]


def allowance(n: int, tol: float) -> float:
    """Return the largest gain that counts as none, relative to its terms, as payoffs are rounded in M."""
    return 10 * n * tol
