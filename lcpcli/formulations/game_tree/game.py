"""A game tree as a mixed problem of the size of the tree: its sequence form.

With perfect recall, the moves that a player has made before an information set are the
same at all of its nodes; so each action of each information set corresponds to one
sequence of the player's moves: D. Koller, N. Megiddo, B. von Stengel, Efficient
computation of equilibria for extensive two-person games, Games and Economic Behavior 14
(1996) 247-259; B. von Stengel, Efficient computation of behavior strategies, 220-246.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, NamedTuple

from lcpcli.errors import refuse_unknown
from lcpcli.files import fields as files
from lcpcli.formulations.game_tree.tree import (
    MAX_BITS,
    GameTree,
    distinct_labels,
    tree_in,
)
from lcpcli.model.formulation import (
    FULL,
    HEADINGS,
    InFractions,
)
from lcpcli.model.formulations import TEXTS
from lcpcli.model.problem import Problem

MAX_DENSE = 200  # unknowns up to which M is dense, as pivoting is then fast
LARGEST_INTEGER = 2**53  # every integer up to this is exact in double precision

Rows = list[dict[int, Fraction]]


def from_efg(text: str, *, name: str = "", source: str = "", note: str = "") -> Problem:
    """Return the mixed problem whose solutions are the equilibria of a game tree of two
    players with perfect recall.

    text : the game in the format of Gambit's .efg files; `lcpcli.read` takes such a
        file.
    name : by default the title of the game. source, note : further texts of the
        problem.

    The unknowns are the realization plans of both players and their costs, as in
    `ExtensiveGame`; `Result.answer` maps them back to probabilities of actions at
    information sets. Raises ProblemError, which names the line at fault.

    >>> import lcpcli
    >>> entry = '''EFG 2 R "entry" { "entrant" "incumbent" }
    ... p "" 1 1 "" { "in" "out" } 0
    ... p "" 2 1 "" { "fight" "share" } 0
    ... t "" 1 "" { -1 -1 }
    ... t "" 2 "" { 1 1 }
    ... t "" 3 "" { 0 2 }'''
    >>> answer = lcpcli.run(lcpcli.from_efg(entry)).answer
    >>> answer.payoffs
    (1.0, 1.0)
    """
    game = ExtensiveGame(tree_in(text))
    M, q, lower, upper = game.conditions()
    problem = Problem(
        M,
        q,
        name=name or game.tree.title,
        source=source,
        note=note,
        lower=lower,
        upper=upper,
    )
    # This skips the check of `Problem` that the formulation fits M and q.
    return problem.having(origin=game)


class Costs(NamedTuple):
    """The costs of a player, factor (constant - payoff): for each pair of sequences
    that leads to terminal nodes, the expectation over chance moves, summed over these
    nodes.
    """

    at: dict[tuple[int, int], Fraction]
    constant: Fraction
    factor: Fraction


@dataclass(frozen=True, eq=False)
class ExtensiveGame(InFractions):
    """The game tree whose equilibria are represented by z = (x, y, u, v), with costs C
    and D of both players:

        0 <= x,  C y - E'u >= 0,  u free,  Ex = e,
        0 <= y,  D'x - F'v >= 0,  v free,  Fy = f.

    x and y are the realization plans: for each sequence of the player the product of
    the probabilities of its moves. Ex = e says that the empty sequence has probability
    1, and that the probability of reaching an information set is distributed over its
    actions. u contains the cost of the game to its player, and then the cost of the
    continuation after each information set.

    Costs are positive, so that M is copositive, and Lemke's method leads to a solution.
    They are the largest payoff plus the range of the payoffs, minus the payoff,
    multiplied by a factor that makes all costs integers, if double precision represents
    these, and by a power of two.
    """

    tree: GameTree

    kind = "efg"
    form = "written as the game's mixed problem,"
    inverse = "answers"
    left_out = ("game tree",)
    max_dense = MAX_DENSE

    @classmethod
    def of_fields(cls, fields: Mapping[str, Any]) -> Problem:
        files.refuse_unknown("", fields, ("efg", *TEXTS), "a game tree")
        texts = files.without_nulls({key: fields.get(key) for key in TEXTS})
        return from_efg(fields["efg"], **texts)

    def fields(
        self,
        problem: Problem,  # noqa: ARG002
        *,
        in_text: bool,
    ) -> dict[str, Any] | None:
        # Formats of arrays cannot contain the text of a game tree.
        return {"efg": self.tree.text} if in_text else None

    @classmethod
    def parse(cls, data: Mapping[str, Any]) -> ExtensiveGame:
        refuse_unknown("", data, ("kind", "efg"))
        return cls(tree_in(data.get("efg")))

    def data(self) -> dict[str, Any]:
        return {"kind": "efg", "efg": self.tree.text}

    @cached_property
    def costs(self) -> tuple[Costs, Costs]:
        """Return the costs of both players, as coefficients of pairs of their
        sequences.
        """
        chances = [chance for _, chance, _ in self.tree.terminal_nodes]
        common = _common(chances)
        weights = _multiples(chances, common) if common else []
        one, two = (_costs(self.tree, player, weights, common) for player in (0, 1))
        return one, two

    @property
    def sizes(self) -> tuple[int, int, int, int]:
        one, two = self.tree.players
        return one.sequences, two.sequences, 1 + len(one.sets), 1 + len(two.sets)

    @property
    def actions(self) -> int:
        return sum(player.sequences - 1 for player in self.tree.players)

    def exact_conditions(self) -> tuple[Rows, list[Fraction], list[Fraction | None]]:
        """Return the rows of M, q and the lower bounds, as fractions."""
        size_x, size_y, size_u, size_v = self.sizes
        x = 0
        y = size_x
        u = size_x + size_y
        v = size_x + size_y + size_u
        rows: Rows = [{} for _ in range(v + size_v)]
        zero, one = Fraction(0), Fraction(1)
        for (i, j), cost in self.costs[0].at.items():
            rows[x + i][y + j] = cost
        for (i, j), cost in self.costs[1].at.items():
            rows[y + j][x + i] = cost
        for player, plan, value in zip(self.tree.players, (x, y), (u, v), strict=True):
            sets = (
                (i + 1, player.moves(i), [before])
                for i, before in enumerate(player.before)
            )
            # The columns of the entries 1 and -1 of row k of E.
            for k, next_sequences, before in [(0, [0], []), *sets]:
                for entry, other, sequences in (
                    (one, -one, next_sequences),
                    (-one, one, before),
                ):
                    for sequence in sequences:
                        rows[value + k][plan + sequence] = entry
                        rows[plan + sequence][value + k] = other
        q = [-one if i in (u, v) else zero for i in range(len(rows))]
        return rows, q, [zero if i < u else None for i in range(len(rows))]

    def _names(self) -> list[tuple[str, str, str]]:
        """Return three names of increasing length of each component: of a sequence by
        its last move, of a cost by its information set.
        """
        plans, values = list[tuple[str, str, str]](), list[str]()
        for who, player in zip(self.tree.names(), self.tree.players, strict=True):
            plans.append((who, who, who))
            values.append(f"cost of {who}")
            for label, information_set in zip(
                player.labels(), player.sets, strict=True
            ):
                names_of_moves = (
                    (move, f"{label}: {move}")
                    for move in distinct_labels(information_set.actions)
                )
                plans += [
                    (move, longer, f"{who}: {longer}")
                    for move, longer in names_of_moves
                ]
                values.append(f"cost of {who}: {label}")
        return [*plans, *((name, name, name) for name in values)]

    def names(self, n: int, purpose: str = FULL) -> Sequence[str]:  # noqa: ARG002
        """Return the full names, or, for tables, the shortest ones that are
        distinct.
        """
        if purpose != HEADINGS:
            return [name for *_, name in self._names()]
        short, longer, full = zip(*self._names(), strict=True)
        times, times_longer = Counter([*short, *full]), Counter(longer)
        names = list[str]()
        for one, two, name in zip(short, longer, full, strict=True):
            if times[one] == 1 or one == name:
                names.append(one)
            elif times_longer[two] == 1:
                names.append(two)
            else:
                names.append(name)
        return names

    def lengths(self, problem: Problem) -> dict[int, str]:
        return {problem.n: "z", self.actions: "the probabilities of all actions"}

    def meaning(self, data: Any) -> Any:
        return self.sibling("answers").Plans(data, self, self.tree.names())


def _costs(tree: GameTree, player: int, weights: list[int], chances: int) -> Costs:
    """Return the costs of a player.

    weights : the chances of the terminal nodes as multiples of 1 / `chances`; empty if
        that has too many digits.
    """
    payoffs = [payoffs[player] for _, _, payoffs in tree.terminal_nodes]
    units = _common(payoffs)
    if weights and units:
        sequences = [each for each, _, _ in tree.terminal_nodes]
        return _whole_costs(
            sequences, weights, _multiples(payoffs, units), chances, units
        )
    largest, smallest = max(payoffs), min(payoffs)
    constant = largest + ((largest - smallest) or 1)
    at = dict[tuple[int, int], Fraction]()
    for (pair, chance, _), payoff in zip(tree.terminal_nodes, payoffs, strict=True):
        at[pair] = at.get(pair, 0) + chance * (constant - payoff)
    greatest, common = max(at.values()), 1
    for cost in at.values():
        if common.bit_length() <= MAX_BITS:
            common = math.lcm(common, cost.denominator)
    factor = Fraction(common, math.gcd(*(cost.numerator for cost in at.values())))
    scaled_greatest = greatest * factor
    is_double = common.bit_length() <= MAX_BITS and scaled_greatest <= LARGEST_INTEGER
    factor = (
        factor / 2 ** int(scaled_greatest).bit_length() if is_double else 1 / greatest
    )
    return Costs({pair: cost * factor for pair, cost in at.items()}, constant, factor)


def _common(numbers: Iterable[Fraction]) -> int:
    """Return the least common multiple of the denominators; 0 if it is long."""
    common = 1
    for each in {number.denominator for number in numbers}:
        common = math.lcm(common, each)
        if common.bit_length() > MAX_BITS:
            return 0
    return common


def _multiples(numbers: Iterable[Fraction], common: int) -> list[int]:
    """Return numbers as integer multiples of 1 / `common`."""
    return [number.numerator * (common // number.denominator) for number in numbers]


def _whole_costs(
    sequences: Sequence[tuple[int, int]],
    weights: Sequence[int],
    payoffs: Sequence[int],
    chances: int,
    units: int,
) -> Costs:
    """Return the costs of a player computed in integers, from the sequences, chances
    and payoffs of the terminal nodes: chances are multiples of 1 / `chances`, and
    payoffs of 1 / `units`.
    """
    largest, smallest = max(payoffs), min(payoffs)
    constant = largest + ((largest - smallest) or units)
    at = dict[tuple[int, int], int]()
    for pair, weight, payoff in zip(sequences, weights, payoffs, strict=True):
        at[pair] = at.get(pair, 0) + weight * (constant - payoff)
    numerator, divisor = chances * units, math.gcd(*at.values())
    greatest = max(at.values())
    common = numerator // math.gcd(numerator, divisor)
    is_long = common.bit_length() > MAX_BITS
    if is_long or greatest // divisor > LARGEST_INTEGER:
        divisor, power = 1, greatest  # costs are rounded, whatever the factor
    else:
        power = 2 ** (greatest // divisor).bit_length()
    factor = Fraction(numerator, divisor * power)
    scaled = {each: Fraction(each // divisor, power) for each in set(at.values())}
    costs = {pair: scaled[each] for pair, each in at.items()}
    return Costs(costs, Fraction(constant, units), factor)
