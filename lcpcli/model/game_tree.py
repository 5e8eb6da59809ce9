"""Games of two players in extensive form: the nodes of the tree, information sets, and the sequences of moves.

With perfect recall, the moves that a player has made before an information set are the same at all of its nodes; so
each action of each information set stands for one sequence of the player's moves: B. von Stengel, Efficient computation
of behavior strategies, Games and Economic Behavior 14 (1996) 220-246.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple, TypeVar

from lcpcli.errors import ProblemError

MOST_BITS = 3322  # of denominators: a thousand digits
CHANCE, TERMINAL = -1, -2  # in place of a player, 0 or 1

Payoffs = tuple[Fraction, Fraction]
NOTHING = Fraction(0), Fraction(0)

T = TypeVar("T")


class InformationSet(NamedTuple):
    """An information set of a player, or a chance event: its number in the file, its label, and its actions, for an
    event with their probabilities."""

    number: int
    label: str
    actions: tuple[str, ...]
    probabilities: tuple[Fraction, ...] = ()


class Node(NamedTuple):
    """A node of the tree.

    parent, move : the index of the parent among the nodes, -1 for the root, and that of the action that leads here.
    owner, where : the player, 0 or 1, with the index of the information set; CHANCE, with the index of the event; or
        TERMINAL, with -1. payoffs : what the outcome at the node adds.
    """

    parent: int
    move: int
    owner: int
    where: int
    payoffs: Payoffs


@dataclass(frozen=True, eq=False)
class Player:
    """A player, and its sequences of moves: 0 for none yet, then one for each action of each information set.

    before : for each information set, the sequence that leads there. first : the sequence of its first action, those of
    the others follow; all after `before`.
    """

    name: str
    sets: list[InformationSet]
    before: list[int]
    first: list[int]

    @property
    def sequences(self) -> int:
        """Return the number of sequences."""
        return 1 + sum(len(own.actions) for own in self.sets)

    def labels(self) -> list[str]:
        """Return labels of the information sets that differ."""
        return distinct_labels(self.sets, lambda own: own.label, (own.number for own in self.sets))

    def moves(self, index: int) -> range:
        """Return the sequences that end with an action of this information set."""
        first = self.first[index]
        return range(first, first + len(self.sets[index].actions))


@dataclass(frozen=True, eq=False)
class GameTree:
    """A game of two players with perfect recall.

    text, title : as in the file. events : the chance events. nodes : in the order of the file, each before its
    children. sequences : for each node, the sequences of both players' moves that lead there.
    """

    text: str
    title: str
    players: tuple[Player, Player]
    events: list[InformationSet]
    nodes: list[Node]
    sequences: list[tuple[int, int]]

    def names(self) -> list[str]:
        """Return names of the players that differ."""
        return distinct_labels(self.players, lambda player: player.name, (1, 2))

    def chances(self) -> list[Fraction]:
        """Return for each node the product of the probabilities of the chance moves that lead there."""
        found: list[Fraction] = []
        for node in self.nodes:
            above = found[node.parent] if found else Fraction(1)
            is_chance = bool(found) and self.nodes[node.parent].owner == CHANCE
            own = self.events[self.nodes[node.parent].where].probabilities[node.move] if is_chance else 1
            found.append(above if own == 1 else _brief(above * own, "chances"))
        return found

    def totals(self) -> list[Payoffs]:
        """Return for each node the sums of the payoffs from the root to it."""
        found: list[Payoffs] = []
        for node in self.nodes:
            above, own = found[node.parent] if found else NOTHING, node.payoffs
            if above is NOTHING or own is NOTHING:  # as most are, and fractions take long to add
                found.append(own if above is NOTHING else above)
            else:
                one, other = (_brief(sum(pair, Fraction(0)), "payoffs") for pair in zip(above, own, strict=True))
                found.append((one, other))
        return found


def _brief(value: Fraction, of: str) -> Fraction:
    """Return a number of moderate length; raise ProblemError for any other, which would make all that follows slow."""
    if value.denominator.bit_length() > MOST_BITS:
        raise ProblemError("", f"has {of} whose fractions are longer than a thousand digits", "round some of them")
    return value


def distinct_labels(things: Iterable[T], label: Callable[[T], str], numbers: Iterable[int]) -> list[str]:
    """Return the labels of things, with the number of each behind it where the label is empty or repeated."""
    labels = list(map(label, things))
    times = Counter(labels)
    pairs = zip(labels, numbers, strict=True)
    return [own if own and times[own] == 1 else f"{own} {number}".strip() for own, number in pairs]


class Sequences(NamedTuple):
    """The sequences of both players' moves.

    at : for each node, those that lead there. before, first : for each player, as in `Player`. forgotten : the index of
    the first node to which another sequence leads than to a node before it in the same information set, so that recall
    is not perfect; None if there is none.
    """

    at: list[tuple[int, int]]
    before: tuple[list[int], list[int]]
    first: tuple[list[int], list[int]]
    forgotten: int | None = None


def sequences(nodes: Sequence[Node], sets: Sequence[Sequence[InformationSet]]) -> Sequences:
    """Return the sequences of a tree with these nodes and with these information sets of each player, which are in the
    order of their first nodes."""
    found = Sequences([], ([], []), ([], []))
    size = [1, 1]
    for i, node in enumerate(nodes):
        own = list(found.at[node.parent]) if i else [0, 0]
        above = nodes[node.parent]
        if i and above.owner >= 0:
            own[above.owner] = found.first[above.owner][above.where] + node.move
        found.at.append((own[0], own[1]))
        if node.owner < 0:
            continue
        before = found.before[node.owner]
        if node.where == len(before):
            before.append(own[node.owner])
            found.first[node.owner].append(size[node.owner])
            size[node.owner] += len(sets[node.owner][node.where].actions)
        elif before[node.where] != own[node.owner]:
            return found._replace(forgotten=i)
    return found
