"""Random games in extensive form with perfect recall, as the text of .efg files, and their payoffs by brute force."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import product
from random import Random

from lcpcli.games.behavior import Strategy
from lcpcli.model.game_tree import CHANCE, GameTree


class Maker:
    """A random tree. Nodes of a player behind the same own move, with as many actions, may share an information set."""

    def __init__(self, seed: int, depth: int = 4) -> None:
        self.random, self.outcomes, self.events = Random(seed), 0, 0
        self.sets: dict[tuple[int, tuple[int, int], int], list[int]] = {}
        self.numbers = {1: 0, 2: 0}
        self.lines = [f'EFG 2 R "tree {seed}" {{ "one" "two" }} "a comment, with {{ braces }}"']
        self.node(depth, {1: (0, 0), 2: (0, 0)})

    def node(self, depth: int, last: dict[int, tuple[int, int]]) -> None:
        kind = self.random.choice("cpppp") if depth else "t"
        moves = self.random.randint(1 if depth < 4 else 2, 3)
        if kind == "t" or (depth < 3 and self.random.random() < 0.3):
            self.lines.append(f't "" {self.outcome()}')
            return
        if kind == "c":
            self.events += 1
            weights = [self.random.randint(0, 4) for _ in range(moves)]
            weights[0] += 1
            listed = " ".join(f'"" {Fraction(weight, sum(weights))}' for weight in weights)
            self.lines.append(f'c "" {self.events} "" {{ {listed} }} 0')
            for _ in range(moves):
                self.node(depth - 1, last)
            return
        player = self.random.choice((1, 2))
        known = self.sets.setdefault((player, last[player], moves), [])
        number = self.random.choice([*known, 0])
        described = ""
        if not number:
            self.numbers[player] += 1
            number = self.numbers[player]
            known.append(number)
            described = '"" { ' + " ".join(f'"{k}"' for k in range(moves)) + " } "
        extra = self.outcome() if self.random.random() < 0.2 else "0"
        self.lines.append(f'p "" {player} {number} {described}{extra}')
        for move in range(1, moves + 1):
            self.node(depth - 1, {**last, player: (number, move)})

    def outcome(self) -> str:
        self.outcomes += 1
        one, two = (Fraction(self.random.randint(-6, 6), self.random.choice((1, 1, 2, 3))) for _ in range(2))
        return f'{self.outcomes} "" {{ {one}, {two} }}'


def text_of(seed: int, depth: int = 4) -> str:
    return "\n".join(Maker(seed, depth).lines)


def payoffs(tree: GameTree, strategies: Sequence[Strategy]) -> list[Fraction]:
    """The expected payoffs, node by node from the root, without plans or sequences."""
    reach = [Fraction(1)]
    for node in tree.nodes[1:]:
        above = tree.nodes[node.parent]
        odds = tree.events[above.where].probabilities if above.owner == CHANCE else strategies[above.owner][above.where]
        reach.append(reach[node.parent] * odds[node.move])
    return [sum((r * n.payoffs[i] for r, n in zip(reach, tree.nodes, strict=True)), Fraction(0)) for i in (0, 1)]


def pure_strategies(tree: GameTree, player: int) -> Iterator[Strategy]:
    """All pure strategies of a player."""
    sizes = [len(own.actions) for own in tree.players[player].sets]
    for moves in product(*map(range, sizes)):
        yield [[Fraction(k == move) for k in range(size)] for size, move in zip(sizes, moves, strict=True)]


def gains(tree: GameTree, strategies: Sequence[Strategy]) -> list[Fraction]:
    """What each player would gain by the best of all its pure strategies."""
    now = payoffs(tree, strategies)
    one = max(payoffs(tree, (pure, strategies[1]))[0] for pure in pure_strategies(tree, 0))
    two = max(payoffs(tree, (strategies[0], pure))[1] for pure in pure_strategies(tree, 1))
    return [one - now[0], two - now[1]]
