"""The tree of a game, as in the text of an .efg file.

A file has a title, the names of the players and perhaps a comment, and then the nodes,
each before its children, which are in the order of its actions: chance nodes, personal
nodes and terminal nodes, each with an outcome. Information sets, chance events and
outcomes have numbers; they are described where they are first named, and the
description need not be repeated. Outcome 0 has payoffs 0; the payoffs of all outcomes
on a path add up. Numbers are integers, decimals or fractions, and commas are treated as
blanks. Labels have no meaning and may be repeated. (Gambit, Software Tools for Game
Theory, https://www.gambit-project.org, file formats.)
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import islice
from typing import Any, NamedTuple, TypeVar

from lcpcli.errors import (
    CUT_OFF,
    ENDS_TOO_EARLY,
    SCALE_PAYOFFS,
    ProblemError,
    count,
    kind,
    quoted,
)
from lcpcli.formulations.gambit import TOKEN, Payoffs

MAX_BITS = 3322  # limit on denominators: a thousand digits
CHANCE, TERMINAL = -1, -2  # the owner of a node that belongs to no player, 0 or 1

NOTHING: Payoffs = Fraction(0), Fraction(0)

T = TypeVar("T")


class InformationSet(NamedTuple):
    """An information set, or a chance event: its number in the file, label, actions,
    and the probabilities of an event.
    """

    number: int
    label: str
    actions: tuple[str, ...]
    probabilities: tuple[Fraction, ...] = ()


class Node(NamedTuple):
    """A node of the tree.

    parent, move : the index of the parent among the nodes, -1 for the root, and that of
        the action that leads from it to this node.
    owner, where : the player, 0 or 1, with the index of the information set; CHANCE,
        with the index of the event; or TERMINAL, with -1.
    sequences, chance, payoffs : on the path from the root to the node, the sequences of
        both players' moves, the product of the probabilities of the chance moves, and
        the sums of the payoffs.
    """

    parent: int
    move: int
    owner: int
    where: int
    sequences: tuple[int, int]
    chance: Fraction
    payoffs: Payoffs


# An artificial parent of the root.
ROOT = Node(-1, 0, TERMINAL, -1, (0, 0), Fraction(1), NOTHING)


@dataclass(frozen=True, eq=False)
class Player:
    """A player, and its sequences of moves: 0 for the empty one, then one for each
    action of each information set. before : for each information set, the sequence that
    leads to it. first : the sequence of its first action; those of the others follow.
    """

    name: str
    sets: list[InformationSet]
    before: list[int]
    first: list[int]

    @property
    def sequences(self) -> int:
        return 1 + sum(len(information_set.actions) for information_set in self.sets)

    def labels(self) -> list[str]:
        return distinct_labels(
            [information_set.label for information_set in self.sets],
            [information_set.number for information_set in self.sets],
        )

    def moves(self, index: int) -> range:
        """Return the sequences whose last action is one of this information set."""
        return range(first := self.first[index], first + len(self.sets[index].actions))


@dataclass(frozen=True, eq=False)
class GameTree:
    """A two-player game with perfect recall, as in a file. events : the chance events.
    text : the text of the file.
    """

    text: str
    title: str
    players: tuple[Player, Player]
    events: list[InformationSet]
    nodes: list[Node]

    def names(self) -> list[str]:
        return distinct_labels([player.name for player in self.players])

    @cached_property
    def terminal_nodes(self) -> list[tuple[tuple[int, int], Fraction, Payoffs]]:
        """Return the sequences, the chance and the payoffs of each terminal node that
        chance does not exclude.
        """
        return [
            node[-3:] for node in self.nodes if node.owner == TERMINAL and node.chance
        ]


def _brief(value: Fraction, of: str) -> Fraction:
    """Return a number of moderate length; raise ProblemError for any other, which would
    make all computations slow.
    """
    if value.denominator.bit_length() > MAX_BITS:
        raise ProblemError(
            "",
            f"has {of} whose fractions are longer than a thousand digits",
            "round some of them",
        )
    return value


def distinct_labels(labels: Sequence[str], numbers: Sequence[int] = ()) -> list[str]:
    """Return labels; a label that is empty or repeated is followed by its number, by
    default its position.
    """
    times = Counter(labels)
    pairs = zip(labels, numbers or range(1, len(labels) + 1), strict=True)
    return [
        label if label and times[label] == 1 else f"{label} {number}".strip()
        for label, number in pairs
    ]


NUMBER = re.compile(
    r"[-+]?(?:[0-9]{1,1000}(?:\.[0-9]{0,1000})?|\.[0-9]{1,1000})"
    r"(?:[eE][-+]?[0-9]{1,3})?|"
    r"[-+]?[0-9]{1,1000}/0*[1-9][0-9]{0,999}"
)
LARGEST = 10**300  # payoffs up to this have sums and differences that do not overflow
NODES = {"c": "chance", "p": "a player", "t": "the end"}
OWNERS = {"c": CHANCE, "t": TERMINAL}  # of nodes that name none
MAX_DIGITS = 9  # of the numbers of players, information sets and outcomes
ESCAPED = re.compile(r"\\(.)", re.DOTALL)


def _fraction(number: str) -> Fraction:
    """Return the value of a NUMBER. `Fraction` of a text takes several times as long as
    of integers."""
    numerator, _, denominator = number.partition("/")
    if denominator:
        return Fraction(int(numerator), int(denominator))
    whole, _, decimals = number.partition(".")
    if "e" in number or "E" in number:
        return Fraction(number)
    return Fraction(int(whole + decimals), 10 ** len(decimals))


def is_text(token: str) -> bool:
    """Return whether a token is a text, and no open quote."""
    return token[:1] == '"' and len(token) > 1


def tree_in(text: Any) -> GameTree:
    """Return the game in a text, or raise ProblemError."""
    if not isinstance(text, str):
        raise ProblemError("efg", f"is {kind(text)}", "give the text of an .efg file")
    return _Reading(text).tree()


class _Reading:
    """The tokens of a text that remain to be read, and the parts that have been
    read.
    """

    def __init__(self, text: str) -> None:
        self.tokens: list[str] = [*TOKEN.findall(text), "", ""]
        self.text, self.position = text, 0
        self.outcomes = {0: NOTHING}
        self.sets: dict[int, list[InformationSet]] = {CHANCE: [], 0: [], 1: []}
        # The index of each set, by its number.
        self.numbers: dict[int, dict[int, int]] = {CHANCE: {}, 0: {}, 1: {}}
        # Values of repeated tokens: numbers, and the actions of an information set, by
        # the tokens in its braces.
        self.values: dict[str, Fraction] = {}
        self.actions: dict[tuple[int, int], tuple[str, ...]] = {}

    def error(
        self, reason: str, hint: str, position: int | None = None
    ) -> ProblemError:
        """Return the error for the token at a position, by default the last one that
        was read.
        """
        at = max(self.position - 1, 0) if position is None else position
        if (token := next(islice(TOKEN.finditer(self.text), at, None), None)) is None:
            return ProblemError("", ENDS_TOO_EARLY, CUT_OFF)
        return ProblemError(
            f"line {self.text.count(chr(10), 0, token.start()) + 1}", reason, hint
        )

    def other(self, of: str, hint: str) -> ProblemError:
        """Return the error for the last token, which is none of the kind `of`."""
        token = self.tokens[self.position - 1]
        return self.error(f"has {quoted(token)} instead of {of}", hint)

    def next_token(self) -> str:
        self.position += 1
        return self.tokens[self.position - 1]

    def name(self) -> str:
        token = self.next_token()
        if not is_text(token):
            raise self.other("a name", "put names in quotes")
        return ESCAPED.sub(r"\1", token[1:-1]) if "\\" in token else token[1:-1]

    def integer(self, of: str) -> int:
        token = self.next_token()
        # As a pattern does, in a third of the time.
        is_whole = token.isdecimal() and token.isascii() and len(token) <= MAX_DIGITS
        if not is_whole:
            raise self.other(of, "give an integer")
        return int(token)

    def number(self) -> Fraction:
        token = self.next_token()
        if token in self.values:
            return self.values[token]
        if not NUMBER.fullmatch(token):
            raise self.other("a number", "give an integer, a decimal or a fraction")
        value = _fraction(token)
        size = abs(value.numerator)
        # The first comparison, without a product, is enough for all usual numbers.
        if size > LARGEST and size > LARGEST * value.denominator:
            raise self.error(
                f"has {quoted(token)}, too large for doubles", SCALE_PAYOFFS
            )
        self.values[token] = value
        return value

    def in_braces(self) -> tuple[str, ...] | None:
        """Return the tokens between the next braces without reading them; None if there
        are none.
        """
        if self.tokens[self.position] != "{":
            return None
        try:
            closing = self.tokens.index("}", self.position)
        except ValueError:  # no brace closes the list
            return None
        return tuple(self.tokens[self.position + 1 : closing])

    def listed(self, each: Callable[[], T]) -> tuple[T, ...] | None:
        """Return the items between braces; None if there is no list."""
        if self.tokens[self.position] != "{":
            return None
        self.position += 1
        items = []
        while self.tokens[self.position] != "}":
            items.append(each())
        self.position += 1
        return tuple(items)

    def tree(self) -> GameTree:
        if (self.next_token(), self.next_token()) != (
            "EFG",
            "2",
        ) or self.next_token() not in ("R", "D"):
            raise ProblemError(
                "line 1",
                "is not the beginning of a game tree",
                "begin the file with EFG 2 R",
            )
        title, players = self.name(), self.listed(self.name)
        if players is None:
            raise self.error(
                "has no players after the title",
                'write EFG 2 R "title" { "one" "two" }',
            )
        if len(players) != 2:
            only = "only its equilibria are the solutions of an LCP"
            raise ProblemError(
                "",
                f"is a game of {count(len(players), 'player')}",
                f"give one of two: {only}",
            )
        self.comments()
        both = (
            Player(players[0], self.sets[0], [], []),
            Player(players[1], self.sets[1], [], []),
        )
        nodes = self.nodes(both)
        self.comments()
        if token := self.next_token():
            raise self.error(
                f"has {quoted(token)} after the last node of the tree",
                "remove it, or correct the nodes",
            )
        return GameTree(self.text, title, both, self.sets[CHANCE], nodes)

    def comments(self) -> None:
        while is_text(self.tokens[self.position]):
            self.position += 1

    def nodes(self, players: tuple[Player, Player]) -> list[Node]:
        """Return the nodes, and add the sequences that lead to the information sets, in
        the order of their first nodes, to the players.
        """
        nodes, pending = list[Node](), [(-1, 0)]
        letters = ", ".join(f"{letter} for {what}" for letter, what in NODES.items())
        hint = f"begin each node with {letters}"
        while pending:
            position, (parent, move) = self.position, pending.pop()
            token = self.next_token()
            if token not in NODES:
                raise self.other("a node", hint)
            self.name()
            owner = OWNERS.get(token) or self.player()
            index = self.information_set(owner) if owner != TERMINAL else -1
            if owner != TERMINAL:
                n_actions = len(self.sets[owner][index].actions)
                pending += [(len(nodes), k) for k in range(n_actions - 1, -1, -1)]
            above, outcome = nodes[parent] if nodes else ROOT, self.outcome()
            sequences = above.sequences
            chance = above.chance
            payoffs = above.payoffs
            if above.owner >= 0:
                last = players[above.owner].first[above.where] + move
                others = sequences[1 - above.owner]
                sequences = (others, last) if above.owner else (last, others)
            elif (
                above.owner == CHANCE
                and (odds := self.sets[CHANCE][above.where].probabilities[move]) != 1
            ):
                chance = _brief(chance * odds, "chances")
            if payoffs is NOTHING:
                payoffs = outcome
            elif outcome is not NOTHING:  # most are, and adding fractions is slow
                payoffs = (
                    _brief(payoffs[0] + outcome[0], "payoffs"),
                    _brief(payoffs[1] + outcome[1], "payoffs"),
                )
            nodes.append(Node(parent, move, owner, index, sequences, chance, payoffs))
            if owner >= 0:
                self.recall(owner, players[owner], index, sequences[owner], position)
        return nodes

    def recall(
        self, owner: int, player: Player, index: int, before: int, position: int
    ) -> None:
        """Record the sequence before an information set, which has to be the same at
        all of its nodes.
        """
        if index == len(player.before):
            player.before.append(before)
            player.first.append(
                player.first[-1] + len(player.sets[index - 1].actions) if index else 1
            )
        elif player.before[index] != before:
            named = f"information set {player.sets[index].number} of player {owner + 1}"
            reason = (
                f"has no perfect recall: other moves of this player lead to {named} "
                "than before"
            )
            raise self.error(
                reason,
                "give an information set to each history of a player's moves",
                position,
            )

    def player(self) -> int:
        if (number := self.integer("the number of a player")) not in (1, 2):
            raise self.error(f"names player {number} of 2", "give 1 or 2")
        return number - 1

    def information_set(self, owner: int) -> int:
        """Return the index of the next information set or chance event in the text."""
        of = "the number of an information set"
        if owner == CHANCE:
            of = "the number of a chance event"
        number = self.integer(of)
        indices = self.numbers[owner]
        label = self.name() if is_text(self.tokens[self.position]) else ""
        position = self.position
        names = self.in_braces()
        if names is not None and self.actions.get((owner, number)) == names:
            self.position += len(names) + 2
            return indices[number]
        named = f"chance event {number}"
        if owner != CHANCE:
            named = f"information set {number} of player {owner + 1}"
        actions_in_text = self.listed(
            lambda: (self.name(), self.number() if owner == CHANCE else Fraction(0))
        )
        if actions_in_text is not None:
            actions = tuple(name for name, _ in actions_in_text)
            odds = tuple(odd for _, odd in actions_in_text) * (owner == CHANCE)
            if not actions:
                raise self.error(f"lists no action for {named}", "list at least one")
            if odds and (min(odds) < 0 or sum(odds) != 1):
                reason = (
                    f"the probabilities of {named} are not at least 0 with the sum 1"
                )
                raise self.error(
                    reason, "give fractions, such as 1/3, whose sum is 1", position
                )
            information_set = InformationSet(number, label, actions, odds)
            if number not in indices:
                indices[number] = len(self.sets[owner])
                self.sets[owner].append(information_set)
                self.actions[owner, number] = names or ()
            elif (first := self.sets[owner][indices[number]])[2:] != information_set[
                2:
            ]:
                listed = "actions" if first.actions != actions else "probabilities"
                raise self.error(
                    f"lists other {listed} for {named} than before",
                    "correct one of them",
                    position,
                )
        elif number not in indices:
            raise self.error(
                f"names {named} before its actions",
                "list its actions where it is first named",
            )
        return indices[number]

    def outcome(self) -> Payoffs:
        number = self.integer("the number of an outcome")
        if is_text(self.tokens[self.position]):
            self.position += 1
        position, payoffs = self.position, self.listed(self.number)
        if payoffs is not None and len(payoffs) != 2:
            raise self.error(
                f"has {count(len(payoffs), 'payoff')} for 2 players",
                "give one for each",
                position,
            )
        if payoffs is None and number not in self.outcomes:
            raise self.error(
                f"names outcome {number} before its payoffs",
                "give them where it is first named",
            )
        outcome = self.outcomes.setdefault(number, payoffs or NOTHING)
        if payoffs is not None and outcome != payoffs:
            raise self.error(
                f"gives outcome {number} other payoffs than it has",
                "correct one of them",
                position,
            )
        return outcome
