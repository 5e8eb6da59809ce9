"""Polymatrix games: the payoff of a player is a sum over the other players, of a matrix
for each pair. J. T. Howson, Jr., Equilibria of polymatrix games, Management Science 18
(1972) 312-318.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import repeat
from typing import Any

import numpy as np

from lcpcli.errors import (
    GIVE_NUMBER,
    IS_EMPTY,
    IS_MISSING,
    MAKE_AGREE,
    ProblemError,
    kind,
    numbers_for,
    quoted,
    refuse_unknown,
)
from lcpcli.files import fields as files
from lcpcli.files.formats import refuse
from lcpcli.model.arrays import FROM_0
from lcpcli.model.formulation import FULL, InFractions, names_of
from lcpcli.model.formulations import TEXTS
from lcpcli.model.problem import Problem
from lcpcli.rational.numbers import NUMBER, ratio, shortest_decimal, text, zeros

Table = tuple[tuple[Fraction, ...], ...]
Pair = tuple[int, int]
LARGEST = 10**300  # the largest payoff: sums of a million such do not overflow
LARGEST_INTEGER = 2**53  # up to here every integer is a double precision number


def from_polymatrix(
    payoffs: Mapping[Any, Any],
    players: Sequence[str] = (),
    actions: Sequence[Sequence[str]] = (),
    **texts: Any,
) -> Problem:
    """Return the mixed problem whose solutions are the equilibria of a polymatrix game,
    in which all players maximize.

    payoffs : for pairs (i, j) of players, by index or name, the matrix of what i gets
        from j, of shape (actions of i, actions of j); the payoff of i is the sum over
        all j. A missing pair has zeros. Payoffs may be fractions, also texts like
        "1/3", and floats are read as their shortest decimals.
    players, actions : optional names of the players, and for each player of its
        actions.
    texts : name, source and note of the problem.

    The unknowns are the probabilities of all actions, player by player, and then for
    each player the cost of a best response, a constant minus its payoff. Raises
    ProblemError, which names the field at fault.

    >>> import lcpcli
    >>> pennies = [[1, -1], [-1, 1]]
    >>> other = [[-1, 1], [1, -1]]
    >>> problem = lcpcli.from_polymatrix({(0, 1): pennies, (1, 0): other})
    >>> lcpcli.exact(problem).answer.exact.payoffs
    (Fraction(0, 1), Fraction(0, 1))
    """
    called = names_of("players", players)
    tables = {
        _pair(pair, called): _table(_field(pair), value)
        for pair, value in _pairs(payoffs).items()
    }
    if not tables:
        raise ProblemError("payoffs", IS_EMPTY, "give a matrix for a pair of players")
    n = len(called) or 1 + max(map(max, tables))
    sizes = _sizes(n, tables, called)
    if not isinstance(actions, (list, tuple)):
        reason, hint = f"is {kind(actions)}", "give a list of names for each player"
        raise ProblemError("actions", reason, hint)
    if actions and len(actions) != n:
        reason = numbers_for(len(actions), "list", n, "player")
        raise ProblemError("actions", reason, MAKE_AGREE)
    named = tuple(
        names_of(f"actions[{i}]", value, size, "action")
        for i, (value, size) in enumerate(zip(actions, sizes, strict=False))
    )
    game = Polymatrix(sizes, tables, called, named)
    M, q, lower, upper = game.conditions()
    problem = Problem(M, q, lower=lower, upper=upper, **texts)
    # `Problem` would check that the game fits the conditions, which were made from it.
    return problem.having(origin=game)


def _pairs(payoffs: Any) -> dict[Any, Any]:
    """Return the matrices by pairs of players, also if payoffs is an object of
    objects.
    """
    if not isinstance(payoffs, Mapping):
        hint = "give an object of matrices by players, and by those they play against"
        raise ProblemError("payoffs", f"is {kind(payoffs)}", hint)
    tables = dict[Any, Any]()
    for key, inner in payoffs.items():
        tables |= (
            {(key, other): table for other, table in inner.items()}
            if isinstance(inner, Mapping)
            else {key: inner}
        )
    return tables


def _field(pair: Any) -> str:
    """Return the name of the matrix of a pair in messages, such as payoffs[0][1]."""
    named = pair if isinstance(pair, tuple) else (pair,)
    return "payoffs" + "".join(f"[{each}]" for each in named)


def _pair(raw_pair: Any, players: Sequence[str]) -> Pair:
    hint = "give two players, by name or by index"
    if not isinstance(raw_pair, tuple) or len(raw_pair) != 2:
        raise ProblemError(_field(raw_pair), "is no pair", hint)
    indices = list[int]()
    for name in raw_pair:
        index = players.index(name) if name in players else name
        is_index = isinstance(index, (int, np.integer)) and not isinstance(index, bool)
        if not is_index or not 0 <= index < (len(players) or math.inf):
            shown = quoted(name) if isinstance(name, str) else str(name)
            raise ProblemError(_field(raw_pair), f"has no player {shown}", hint)
        indices.append(int(index))
    if indices[0] == indices[1]:
        raise ProblemError(_field(raw_pair), "has a player against itself", hint)
    return indices[0], indices[1]


def _table(field: str, raw_table: Any) -> Table:
    rows = raw_table.tolist() if hasattr(raw_table, "tolist") else raw_table
    is_table = isinstance(rows, (list, tuple)) and all(
        isinstance(row, (list, tuple)) and len(row) for row in rows
    )
    if not is_table or not rows:
        reason = IS_EMPTY if is_table else "is no matrix"
        raise ProblemError(field, reason, "give its rows, each a list of payoffs")
    for i, row in enumerate(rows):
        if len(row) != len(rows[0]):
            reason = f"has {len(row)} entries and row 0 has {len(rows[0])}"
            raise ProblemError(f"{field}[{i}]", reason, f"{MAKE_AGREE} {FROM_0}")
    return tuple(
        tuple(_payoff(f"{field}[{i}][{j}]", value) for j, value in enumerate(row))
        for i, row in enumerate(rows)
    )


def _payoff(field: str, raw_value: Any) -> Fraction:
    is_number = isinstance(raw_value, str) and NUMBER.fullmatch(raw_value)
    if is_number and "inf" not in raw_value.casefold():
        try:
            value = ratio(raw_value.strip())
        except ProblemError as error:
            raise error.inside(field) from None
    elif isinstance(raw_value, bool) or not isinstance(
        raw_value, (int, float, Fraction)
    ):
        raise ProblemError(field, f"is {kind(raw_value)}", GIVE_NUMBER)
    elif isinstance(raw_value, float):
        if not math.isfinite(raw_value):
            raise ProblemError(field, f"is {raw_value}", GIVE_NUMBER)
        value = shortest_decimal(raw_value)
    else:
        value = Fraction(raw_value)
    if abs(value) > LARGEST:
        raise ProblemError(field, "is too large for doubles", "scale the payoffs")
    return value


def _sizes(
    n: int, tables: Mapping[Pair, Table], players: Sequence[str]
) -> tuple[int, ...]:
    sizes = dict[int, int]()
    for (i, j), table in tables.items():
        for player, size in ((i, len(table)), (j, len(table[0]))):
            if sizes.setdefault(player, size) != size:
                reason = f"has {size} actions of player {player}, not {sizes[player]}"
                pair = tuple(players[k] for k in (i, j)) if players else (i, j)
                raise ProblemError(_field(pair), reason, f"{MAKE_AGREE} {FROM_0}")
    for player in range(n):
        if player not in sizes:
            shown = quoted(players[player]) if players else player
            raise ProblemError("payoffs", f"has no pair of player {shown}", "add one")
    return tuple(sizes[player] for player in range(n))


@dataclass(frozen=True, eq=False)
class Polymatrix(InFractions):
    """The game whose equilibria are described by z = (x, v), with costs C_ij = k_ij -
    payoffs: for each player i

        0 <= x_i,  sum over j of C_ij x_j - v_i e >= 0,  v_i free,  e'x_i = 1.

    Costs are positive, so that M is copositive. k_ij is the largest payoff of the pair
    plus the difference between the largest and the smallest one, or plus 1 if all are
    equal. The costs of a player are multiplied by their common denominator, if the
    products are exact in double precision, and divided by a power of two.

    sizes : how many actions each player has.
    payoffs : the matrices of pairs of players; other pairs have zeros.
    players, actions : their names; empty if they have none.
    """

    sizes: tuple[int, ...]
    payoffs: Mapping[Pair, Table]
    players: tuple[str, ...] = ()
    actions: tuple[tuple[str, ...], ...] = ()

    kind = "polymatrix"
    form = "written as the game's mixed problem,"
    left_out = ("payoffs",)
    counts_solutions = True
    inverse = "strategies"

    @classmethod
    def of_fields(cls, fields: Mapping[str, Any]) -> Problem:
        valid_keys = ("payoffs", "players", "actions", *TEXTS)
        files.refuse_unknown("", fields, valid_keys, "a polymatrix game")
        is_null = fields["payoffs"] is None
        refuse(is_null, "payoffs", "is null", "give matrices by pairs")
        return from_polymatrix(**files.without_nulls(fields))

    def fields(self, problem: Any, *, in_text: bool) -> dict[str, Any] | None:
        del problem
        data = self.data()
        return {key: data[key] for key in data if key != "kind"} if in_text else None

    @classmethod
    def parse(cls, data: Mapping[str, Any]) -> Polymatrix:
        refuse_unknown("", data, ("kind", "payoffs", "players", "actions"))
        if "payoffs" not in data:
            raise ProblemError("payoffs", IS_MISSING, "add the key payoffs")
        arguments = {key: data[key] for key in data if key != "kind"}
        origin: Any = from_polymatrix(**arguments).origin
        return origin if isinstance(origin, cls) else cls((), {})

    def data(self) -> dict[str, Any]:
        names = self.names_of_players()
        payoffs: dict[str, Any] = {}
        for (i, j), table in self.payoffs.items():
            rows = [[_for_json(value) for value in row] for row in table]
            payoffs.setdefault(names[i], {})[names[j]] = rows
        fields = {"kind": self.kind, "players": names, "payoffs": payoffs}
        return fields | (
            {"actions": list(map(list, self.actions))} if self.actions else {}
        )

    def names_of_players(self) -> list[str]:
        numbers = range(1, len(self.sizes) + 1)
        return list(self.players) or [f"player {number}" for number in numbers]

    @cached_property
    def constants(self) -> dict[Pair, Fraction]:
        constants = {}
        for pair, table in self.payoffs.items():
            largest, smallest = max(map(max, table)), min(map(min, table))
            constants[pair] = largest + ((largest - smallest) or 1)
        return constants

    @cached_property
    def factors(self) -> list[Fraction]:
        """Return for each player the number by which its costs are multiplied."""
        factors = []
        for player in range(len(self.sizes)):
            costs = list[Fraction]()
            for pair, table in self.payoffs.items():
                if pair[0] == player:
                    constant = self.constants[pair]
                    costs += [constant - value for row in table for value in row]
            common = math.lcm(*(cost.denominator for cost in costs))
            largest = common * max([Fraction(0), *costs])
            is_short = common <= LARGEST_INTEGER and largest <= LARGEST_INTEGER
            power = 2 ** int(largest).bit_length() if is_short else 1
            factors.append(Fraction(common if is_short else 1, power))
        return factors

    def constant(self, player: int) -> Fraction:
        """Return the sum of all k_ij of a player: its expected payoff is this constant
        minus its expected cost.
        """
        constants = (value for (i, _), value in self.constants.items() if i == player)
        return sum(constants, Fraction(0))

    def exact_conditions(
        self,
    ) -> tuple[list[dict[int, Fraction]], list[Fraction], list[Fraction | None]]:
        """Return the rows of M, q and the lower bounds, as fractions."""
        starts = [0, *np.cumsum(self.sizes).tolist()]
        k = starts[-1]
        n = len(self.sizes)
        one = Fraction(1)
        rows: list[dict[int, Fraction]] = [{} for _ in range(k + n)]
        for (i, j), table in self.payoffs.items():
            for a, row in enumerate(table, starts[i]):
                constant, factor = self.constants[i, j], self.factors[i]
                costs = ((constant - value) * factor for value in row)
                rows[a] |= dict(enumerate(costs, starts[j]))
        for i in range(n):
            for a in range(starts[i], starts[i + 1]):
                rows[a][k + i], rows[k + i][a] = -one, one
        q = [*zeros(k), *repeat(-one, n)]
        return rows, q, [*zeros(k), *repeat(None, n)]

    def names(self, n: int, purpose: str = FULL) -> Sequence[str]:  # noqa: ARG002
        names = self.names_of_players()
        strategies = [
            f"{who}: {action}"
            for who, actions in zip(names, self.names_of_actions(), strict=True)
            for action in actions
        ]
        return [*strategies, *(f"cost of {who}" for who in names)]

    def names_of_actions(self) -> Sequence[Sequence[str]]:
        if self.actions:
            return self.actions
        return [[str(a + 1) for a in range(size)] for size in self.sizes]

    def lengths(self, problem: Any) -> dict[int, str]:
        return {problem.n: "z", sum(self.sizes): "the probabilities of all actions"}

    def meaning(self, data: Any) -> Any:
        answers = self.sibling("strategies")
        return answers.Equilibria(data, self, self.names_of_players())


def _for_json(value: Fraction) -> int | float | str:
    if value.denominator == 1 and abs(value) < 10**15:
        return int(value)
    double = float(value)
    return double if shortest_decimal(double) == value else text(value)
