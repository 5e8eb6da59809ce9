"""Games of two players in extensive form: the tree, its text in .efg files, and as its
sequence form a mixed problem of the size of the tree.

With perfect recall, the moves that a player has made before an information set are the
same at all of its nodes; so each action of each information set stands for one sequence
of the player's moves: D. Koller, N. Megiddo, B. von Stengel, Efficient computation of
equilibria for extensive two-person games, Games and Economic Behavior 14 (1996)
247-259; B. von Stengel, Efficient computation of behavior strategies, 220-246.

A file has a title, the names of the players and perhaps a comment, and then the nodes,
each before its children, which are in the order of its actions: chance nodes, personal
nodes and terminal nodes, each with an outcome. Information sets, chance events and
outcomes have numbers; what is said of one where it is first named need not be said
again. Outcome 0 pays nothing; the payoffs of all outcomes on a path add up. Numbers are
integers, decimals or fractions, and commas count as blanks. Labels have no meaning and
may be repeated. (Gambit, Software Tools for Game Theory,
https://www.gambit-project.org, file formats.)
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import islice
from typing import Any, NamedTuple, TypeVar

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import (
    CUT_OFF,
    ENDS_TOO_EARLY,
    SCALE_PAYOFFS,
    ProblemError,
    count,
    kind,
    quoted,
    refuse_unknown,
)
from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.matrices import compressed
from lcpcli.model.program import Conditions

MOST_DENSE = 200  # unknowns up to which M is dense, as pivoting is fast there
LARGEST_INTEGER = 2**53  # up to here every integer is a double
MOST_BITS = 3322  # of denominators: a thousand digits
CHANCE, TERMINAL = -1, -2  # in place of a player, 0 or 1

Payoffs = tuple[Fraction, Fraction]
Rows = list[dict[int, Fraction]]
NOTHING = Fraction(0), Fraction(0)

T = TypeVar("T")


class InformationSet(NamedTuple):
    """An information set, or a chance event: its number in the file, label, actions,
    and an event's probabilities."""

    number: int
    label: str
    actions: tuple[str, ...]
    probabilities: tuple[Fraction, ...] = ()


class Node(NamedTuple):
    """A node of the tree.

    parent, move : the index of the parent among the nodes, -1 for the root, and that of
        the action that leads here.
    owner, where : the player, 0 or 1, with the index of the information set; CHANCE,
        with the index of the event; or TERMINAL, with -1.
    sequences, chance, payoffs : of the way from the root to the node the sequences of
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


# In place of the parent that the root does not have.
ROOT = Node(-1, 0, TERMINAL, -1, (0, 0), Fraction(1), NOTHING)


@dataclass(frozen=True, eq=False)
class Player:
    """A player, and its sequences of moves: 0 for none yet, then one for each action of
    each information set. before : for each of these, the sequence that leads there.
    first : that of its first action; those of the others follow."""

    name: str
    sets: list[InformationSet]
    before: list[int]
    first: list[int]

    @property
    def sequences(self) -> int:
        return 1 + sum(len(own.actions) for own in self.sets)

    def labels(self) -> list[str]:
        return distinct_labels(
            [own.label for own in self.sets], [own.number for own in self.sets]
        )

    def moves(self, index: int) -> range:
        """Return the sequences that end with an action of this information set."""
        return range(first := self.first[index], first + len(self.sets[index].actions))


@dataclass(frozen=True, eq=False)
class GameTree:
    """A game of two players with perfect recall, as in a file. events : the chance
    events. text : that of the file."""

    text: str
    title: str
    players: tuple[Player, Player]
    events: list[InformationSet]
    nodes: list[Node]

    def names(self) -> list[str]:
        return distinct_labels([player.name for player in self.players])

    @cached_property
    def ends(self) -> list[tuple[tuple[int, int], Fraction, Payoffs]]:
        """Return the sequences, the chance and the payoffs of each end of the game that
        chance does not exclude."""
        return [
            node[-3:] for node in self.nodes if node.owner == TERMINAL and node.chance
        ]


def _brief(value: Fraction, of: str) -> Fraction:
    """Return a number of moderate length; raise ProblemError for any other, which would
    make all that follows slow."""
    if value.denominator.bit_length() > MOST_BITS:
        raise ProblemError(
            "",
            f"has {of} whose fractions are longer than a thousand digits",
            "round some of them",
        )
    return value


def distinct_labels(labels: Sequence[str], numbers: Sequence[int] = ()) -> list[str]:
    """Return labels, with the number of each, by default its place, behind it where the
    label is empty or repeated."""
    times, pairs = (
        Counter(labels),
        zip(labels, numbers or range(1, len(labels) + 1), strict=True),
    )
    return [
        own if own and times[own] == 1 else f"{own} {number}".strip()
        for own, number in pairs
    ]


# A text, a brace, a word, or an open quote.
TOKEN = re.compile(r'"(?:\\.|[^"\\])*"|[{}]|[^\s,{}"]+|"', re.DOTALL)
NUMBER = re.compile(
    r"[-+]?(?:[0-9]{1,1000}(?:\.[0-9]{0,1000})?|\.[0-9]{1,1000})"
    r"(?:[eE][-+]?[0-9]{1,3})?|"
    r"[-+]?[0-9]{1,1000}/0*[1-9][0-9]{0,999}"
)
LARGEST = 10**300  # payoff: sums and differences of a few are doubles
NODES = {"c": "chance", "p": "a player", "t": "the end"}


class _Reading:
    """The words of a text that are left to be read, and what has been read so far."""

    def __init__(self, text: str) -> None:
        self.words: list[str] = [*TOKEN.findall(text), "", ""]
        self.text, self.place = text, 0
        self.outcomes = {0: NOTHING}
        self.sets: dict[int, list[InformationSet]] = {CHANCE: [], 0: [], 1: []}
        # The index of each set, by its number.
        self.numbers: dict[int, dict[int, int]] = {CHANCE: {}, 0: {}, 1: {}}

    def fault(self, fault: str, hint: str, place: int | None = None) -> ProblemError:
        """Return the error for the word at a place, by default the last one that was
        read."""
        at = max(self.place - 1, 0) if place is None else place
        if (found := next(islice(TOKEN.finditer(self.text), at, None), None)) is None:
            return ProblemError("", ENDS_TOO_EARLY, CUT_OFF)
        return ProblemError(
            f"line {self.text.count(chr(10), 0, found.start()) + 1}", fault, hint
        )

    def word(
        self, pattern: str | re.Pattern[str] = "", of: str = "", hint: str = ""
    ) -> str:
        """Return the next word, which has to match a pattern, in full."""
        self.place += 1
        word = self.words[self.place - 1]
        if pattern and not re.fullmatch(pattern, word):
            raise self.fault(f"has {quoted(word)} in place of {of}", hint)
        return word

    @property
    def next_is_text(self) -> bool:
        return self.words[self.place][:1] == '"' and len(self.words[self.place]) > 1

    def name(self) -> str:
        word = self.word(r'(?s)".*"', "a name", "put names in quotes")
        return re.sub(r"\\(.)", r"\1", word[1:-1], flags=re.DOTALL)

    def whole(self, of: str) -> int:
        return int(
            self.word("[0-9]{1,9}", f"the number of {of}", "give a whole number")
        )

    def number(self) -> Fraction:
        value = Fraction(
            word := self.word(
                NUMBER, "a number", "give an integer, a decimal or a fraction"
            )
        )
        if abs(value) > LARGEST:
            raise self.fault(
                f"has {quoted(word)}, too large for doubles", SCALE_PAYOFFS
            )
        return value

    def listed(self, each: Callable[[], T]) -> tuple[T, ...] | None:
        """Return what is between braces; None if there is no list."""
        if self.words[self.place] != "{":
            return None
        self.place += 1
        found = []
        while self.words[self.place] != "}":
            found.append(each())
        self.place += 1
        return tuple(found)

    def tree(self) -> GameTree:
        if (self.word(), self.word()) != ("EFG", "2") or self.word() not in ("R", "D"):
            raise ProblemError(
                "line 1",
                "is not the beginning of a game tree",
                "begin the file with EFG 2 R",
            )
        title, players = self.name(), self.listed(self.name)
        if players is None:
            raise self.fault(
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
        if word := self.word():
            raise self.fault(
                f"has {quoted(word)} after the last node of the tree",
                "remove it, or correct the nodes",
            )
        return GameTree(self.text, title, both, self.sets[CHANCE], nodes)

    def comments(self) -> None:
        while self.next_is_text:
            self.place += 1

    def nodes(self, players: tuple[Player, Player]) -> list[Node]:
        """Return the nodes, and add what leads to the information sets, in the order of
        first nodes, to the players."""
        found, pending = list[Node](), [(-1, 0)]
        letters = ", ".join(f"{letter} for {what}" for letter, what in NODES.items())
        while pending:
            place, (parent, move) = self.place, pending.pop()
            word = self.word(
                "|".join(NODES), "a node", f"begin each node with {letters}"
            )
            self.name()
            owner = {"c": CHANCE, "t": TERMINAL}.get(word) or self.player()
            index = self.information_set(owner) if owner != TERMINAL else -1
            moves = len(self.sets[owner][index].actions) if owner != TERMINAL else 0
            pending += [(len(found), k) for k in range(moves - 1, -1, -1)]
            above, own = found[parent] if found else ROOT, self.outcome()
            sequences, chance, payoffs = (
                list(above.sequences),
                above.chance,
                above.payoffs,
            )
            if above.owner >= 0:
                sequences[above.owner] = players[above.owner].first[above.where] + move
            elif (
                above.owner == CHANCE
                and (odds := self.sets[CHANCE][above.where].probabilities[move]) != 1
            ):
                chance = _brief(chance * odds, "chances")
            if payoffs is NOTHING:
                payoffs = own
            elif own is not NOTHING:  # as few are, and fractions take long to add
                payoffs = (
                    _brief(payoffs[0] + own[0], "payoffs"),
                    _brief(payoffs[1] + own[1], "payoffs"),
                )
            found.append(
                Node(
                    parent,
                    move,
                    owner,
                    index,
                    (sequences[0], sequences[1]),
                    chance,
                    payoffs,
                )
            )
            if owner >= 0:
                self.recall(owner, players[owner], index, sequences[owner], place)
        return found

    def recall(
        self, owner: int, player: Player, index: int, before: int, place: int
    ) -> None:
        """Take note of the sequence before an information set, which has to be the same
        at all of its nodes."""
        if index == len(player.before):
            player.before.append(before)
            player.first.append(
                player.first[-1] + len(player.sets[index - 1].actions) if index else 1
            )
        elif player.before[index] != before:
            named = f"information set {player.sets[index].number} of player {owner + 1}"
            fault = (
                f"has no perfect recall: other own moves lead to {named} than before"
            )
            raise self.fault(
                fault,
                "give an information set to each history of a player's own moves",
                place,
            )

    def player(self) -> int:
        if (number := self.whole("a player")) not in (1, 2):
            raise self.fault(f"names player {number} of 2", "give 1 or 2")
        return number - 1

    def information_set(self, owner: int) -> int:
        """Return the index of the information set, or of the event, that comes next."""
        what = "chance event" if owner == CHANCE else "information set"
        number, known = (
            self.whole(f"{'an' * (owner >= 0) or 'a'} {what}"),
            self.numbers[owner],
        )
        named = f"{what} {number}" + f" of player {owner + 1}" * (owner >= 0)
        label, place = self.name() if self.next_is_text else "", self.place
        given = self.listed(
            lambda: (self.name(), self.number() if owner == CHANCE else Fraction(0))
        )
        if given is not None:
            actions, odds = (
                tuple(name for name, _ in given),
                tuple(odd for _, odd in given) * (owner == CHANCE),
            )
            if not actions:
                raise self.fault(f"lists no action for {named}", "list at least one")
            if odds and (min(odds) < 0 or sum(odds) != 1):
                fault = (
                    f"the probabilities of {named} are not at least 0 with the sum 1"
                )
                raise self.fault(
                    fault, "give fractions, such as 1/3, whose sum is 1", place
                )
            own = InformationSet(number, label, actions, odds)
            if number not in known:
                known[number] = len(self.sets[owner])
                self.sets[owner].append(own)
            elif (first := self.sets[owner][known[number]])[2:] != own[2:]:
                listed = "actions" if first.actions != actions else "probabilities"
                raise self.fault(
                    f"lists other {listed} for {named} than before",
                    "correct one of them",
                    place,
                )
        elif number not in known:
            raise self.fault(
                f"names {named} before its actions",
                "list its actions where it is first named",
            )
        return known[number]

    def outcome(self) -> Payoffs:
        number = self.whole("an outcome")
        if self.next_is_text:
            self.place += 1
        place, given = self.place, self.listed(self.number)
        if given is not None and len(given) != 2:
            raise self.fault(
                f"has {count(len(given), 'payoff')} for 2 players",
                "give one for each",
                place,
            )
        if given is None and number not in self.outcomes:
            raise self.fault(
                f"names outcome {number} before its payoffs",
                "give them where it is first named",
            )
        known = self.outcomes.setdefault(number, given or NOTHING)
        if given is not None and known != given:
            raise self.fault(
                f"gives outcome {number} other payoffs than it has",
                "correct one of them",
                place,
            )
        return known


class Costs(NamedTuple):
    """The costs of a player: factor (constant - payoff), at each pair of sequences that
    leads to ends of the game the expectation over chance moves, summed over these
    ends."""

    at: dict[tuple[int, int], Fraction]
    constant: Fraction
    factor: Fraction


@dataclass(frozen=True, eq=False)
class ExtensiveGame:
    """The game tree whose equilibria are given by z = (x, y, u, v), with costs C and D
    of both players:

        0 <= x,  C y - E'u >= 0,  u free,  Ex = e,
        0 <= y,  D'x - F'v >= 0,  v free,  Fy = f.

    x and y are the realization plans: for each sequence of the player the product of
    the probabilities of its moves. Ex = e says that the empty sequence has probability
    1, and that what leads to an information set is distributed over its actions. u has
    the cost of the game to its player, and then of what follows each information set.
    Costs are positive, so that M is copositive, and Lemke's method ends at a solution:
    the largest payoff plus their range, minus the payoff, times what makes all costs
    integers, if doubles have these, and a power of two.
    """

    tree: GameTree

    @classmethod
    def parse(cls, data: Mapping[str, Any]) -> ExtensiveGame:
        refuse_unknown("", data, ("kind", "efg"))
        return cls.of(data.get("efg"))

    @classmethod
    def of(cls, text: Any) -> ExtensiveGame:
        """Return the game in a text, or raise ProblemError."""
        if not isinstance(text, str):
            raise ProblemError(
                "efg", f"is {kind(text)}", "give the text of an .efg file"
            )
        return cls(_Reading(text).tree())

    def data(self) -> dict[str, Any]:
        return {"kind": "efg", "efg": self.tree.text}

    def fits(self, given: Conditions) -> bool:
        own = self.conditions()
        if given.M.shape != own.M.shape or not all(
            map(np.array_equal, given[1:], own[1:])
        ):
            return False
        return bool(
            abs(compressed(given.M) - compressed(own.M)).max()
            <= 8 * EPS * abs(own.M).max()
        )

    @cached_property
    def costs(self) -> tuple[Costs, Costs]:
        return _costs(self.tree, 0), _costs(self.tree, 1)

    @property
    def is_rounded(self) -> bool:
        """Return whether some costs are no doubles."""
        return any(
            Fraction(float(cost)) != cost
            for own in self.costs
            for cost in own.at.values()
        )

    @property
    def sizes(self) -> tuple[int, int, int, int]:
        one, two = self.tree.players
        return one.sequences, two.sequences, 1 + len(one.sets), 1 + len(two.sets)

    @property
    def actions(self) -> int:
        return sum(player.sequences - 1 for player in self.tree.players)

    def parts(self, z: Any) -> list[Any]:
        ends = np.cumsum(self.sizes)
        return [z[end - size : end] for end, size in zip(ends, self.sizes, strict=True)]

    def exact_conditions(self) -> tuple[Rows, list[Fraction], list[Fraction | None]]:
        """Return the rows of M, q and the lower bounds, as fractions."""
        size_x, size_y, size_u, size_v = self.sizes
        x, y, u, v = 0, size_x, size_x + size_y, size_x + size_y + size_u
        rows: Rows = [{} for _ in range(v + size_v)]
        for (i, j), cost in self.costs[0].at.items():
            rows[x + i][y + j] = cost
        for (i, j), cost in self.costs[1].at.items():
            rows[y + j][x + i] = cost
        for player, plan, value in zip(self.tree.players, (x, y), (u, v), strict=True):
            sets = (
                (i + 1, player.moves(i), [before])
                for i, before in enumerate(player.before)
            )
            # Of row k of E, the columns of its entries 1 and -1.
            for k, moves, before in [(0, [0], []), *sets]:
                for entry, sequences in ((1, moves), (-1, before)):
                    for sequence in sequences:
                        rows[value + k][plan + sequence] = Fraction(entry)
                        rows[plan + sequence][value + k] = Fraction(-entry)
        q = [Fraction(-1 if i in (u, v) else 0) for i in range(len(rows))]
        return rows, q, [Fraction(0) if i < u else None for i in range(len(rows))]

    def conditions(self) -> Conditions:
        rows, q, lower = self.exact_conditions()
        values = np.array([float(a) for row in rows for a in row.values()])
        places = (
            [i for i, row in enumerate(rows) for _ in row],
            [j for row in rows for j in row],
        )
        if len(q) > MOST_DENSE:
            with imports:
                from scipy.sparse import csr_array
            M: Any = csr_array((values, places), shape=(len(q), len(q)))
        else:
            M = np.zeros((len(q), len(q)))
            M[places] = values
        low = np.array([-np.inf if bound is None else 0.0 for bound in lower])
        return Conditions(M, np.array(q, dtype=float), low, np.full(len(q), np.inf))

    def _names(self) -> list[tuple[str, str, str]]:
        """Return three ever longer names of each component: of a sequence by its last
        move, of a cost by its set."""
        plans, values = list[tuple[str, str, str]](), list[str]()
        for who, player in zip(self.tree.names(), self.tree.players, strict=True):
            plans.append((who, who, who))
            values.append(f"cost of {who}")
            for label, own in zip(player.labels(), player.sets, strict=True):
                moves = (
                    (move, f"{label}: {move}") for move in distinct_labels(own.actions)
                )
                plans += [(move, longer, f"{who}: {longer}") for move, longer in moves]
                values.append(f"cost of {who}: {label}")
        return [*plans, *((name, name, name) for name in values)]

    def names(self, n: int) -> Sequence[str]:  # noqa: ARG002 (as in every origin)
        return [name for *_, name in self._names()]

    @property
    def headings(self) -> list[str]:
        """Return the shortest names of the components that differ, for tables."""
        short, longer, full = zip(*self._names(), strict=True)
        times, times_longer = Counter([*short, *full]), Counter(longer)
        return [
            one
            if times[one] == 1 or one == name
            else two
            if times_longer[two] == 1
            else name
            for one, two, name in zip(short, longer, full, strict=True)
        ]


def _costs(tree: GameTree, player: int) -> Costs:
    """Return the costs of a player."""
    largest, least = (
        extreme(payoffs[player] for *_, payoffs in tree.ends) for extreme in (max, min)
    )
    constant, at = largest + ((largest - least) or 1), dict[tuple[int, int], Fraction]()
    for sequences, chance, payoffs in tree.ends:
        at[sequences] = at.get(sequences, 0) + chance * (constant - payoffs[player])
    greatest, common = max(at.values()), 1
    for cost in at.values():
        if common.bit_length() <= MOST_BITS:
            common = math.lcm(common, cost.denominator)
    factor = Fraction(common, math.gcd(*(cost.numerator for cost in at.values())))
    whole = greatest * factor
    is_double = common.bit_length() <= MOST_BITS and whole <= LARGEST_INTEGER
    factor = factor / 2 ** int(whole).bit_length() if is_double else 1 / greatest
    return Costs({pair: cost * factor for pair, cost in at.items()}, constant, factor)
