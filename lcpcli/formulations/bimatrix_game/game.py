"""A two-player game as an LCP: C. E. Lemke, J. T. Howson, Equilibrium points of
bimatrix games, J. SIAM 12 (1964) 413-423.

With positive costs R and C, a constant minus the payoffs, z = (x, y) solves the LCP
with M = [0 R; C' 0] and q = -e if and only if x and y, each divided by its sum, are an
equilibrium.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from decimal import Context, Decimal, localcontext
from fractions import Fraction
from itertools import chain
from typing import Any

import numpy as np

from lcpcli.errors import (
    IS_MISSING,
    MAKE_AGREE,
    SCALE_PAYOFFS,
    ProblemError,
    quoted,
    refuse_unknown,
)
from lcpcli.files import fields as files
from lcpcli.files.formats import refuse
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS
from lcpcli.model.arrays import as_matrix, by_label, readonly_copy, texts
from lcpcli.model.formulation import (
    CELLS,
    FULL,
    LABELS,
    Conditions,
    Formulation,
    names_of,
    unnamed,
)
from lcpcli.model.formulations import TEXTS
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

KEYS = ("A", "B", "rows", "columns", "players", "sense", *TEXTS)
THREE_PLAYERS = (
    "is a game of more than two players",
    "give payoffs by pairs of players (lcp help equilibria): the equilibria of other "
    "such games are not the solutions of an LCP",
)
DATA_KEYS = ("kind", "A", "B", "rows", "columns", "players")
# A payoff as a text: a decimal or a ratio, of a size that costs little.
PAYOFF = re.compile(
    r"\s*[-+]?(?:[0-9]{1,1000}/0*[1-9][0-9]{0,999}"
    r"|(?:[0-9]{1,1000}(?:\.[0-9]{0,1000})?|\.[0-9]{1,1000})"
    r"(?:[eE][-+]?[0-9]{1,3})?)\s*"
)

# Digits that suffice for sums and differences of any floats, which have at most 650.
EXACT_CONTEXT = Context(prec=1000)
MAX_DIGITS = 15  # a decimal of up to 15 digits is the shortest of its nearest float
SURELY = 2.0**-50  # relative bound on the rounding errors of a sum of small terms

PayoffMatrix = list[list[Fraction]]


def from_game(
    A: Any,
    B: Any = None,
    *,
    rows: Sequence[str] = (),
    columns: Sequence[str] = (),
    players: Sequence[str] = (),
    sense: str = "max",
    name: str = "",
    source: str = "",
    note: str = "",
) -> Problem:
    """Return the LCP whose solutions are the equilibria of a game in which both players
    maximize, or minimize.

    A, B : payoffs of the row and column player, both of shape (m, k); lists may also
        contain fractions like "1/3".
    rows, columns : optional names of the strategies; by default the labels of A, if
        these are texts.
    players : optional names of the row and the column player.
    sense : "min" if A and B are costs, whose negatives are then the payoffs.

    The unknowns are z = (x, y); x and y, each divided by its sum, are the strategies,
    to which `Result.answer` maps z back. A cost is the largest payoff plus the range of
    the payoffs, minus the payoff, so that all costs lie within a factor of two. Payoffs
    are taken as their shortest decimals, fractions as they are. Raises ProblemError,
    which names the field at fault.

    >>> import lcpcli
    >>> game = lcpcli.from_game([[3, 0], [0, 2]], [[0, 2], [3, 0]])
    >>> answer = lcpcli.run(game, "auto").answer
    >>> answer.row.round(6).tolist(), answer.column.round(6).tolist()
    ([0.6, 0.4], [0.4, 0.6])
    """
    if B is None:
        raise ProblemError(
            "B",
            IS_MISSING,
            "give the payoffs of the column player; in a zero-sum game B = -A",
        )
    if hasattr(A, "columns"):
        (B,) = by_label(A, "the columns of A", "columns", B=B)
        (B,) = by_label(A, "the rows of A", B=B)
        rows, columns = rows or texts(A.index), columns or texts(A.columns)
    game = Game.of(A, B, rows, columns, players)
    if sense == "min":
        game = game.negated()
    elif sense != "max":
        raise ProblemError(
            "sense",
            f"is {quoted(str(sense))}",
            'give "max" for payoffs or "min" for costs',
        )
    return Problem(*game.conditions(), name=name, source=source, note=note, origin=game)


@dataclass(frozen=True, eq=False)
class Game(Formulation):
    """The game whose equilibria are represented by M = [0 R; C' 0] and q = -e, with
    costs R = r - A and C = c - B.

    A, B : the payoffs of the row and the column player, both of shape (m, k).
    rows, columns : the names of the strategies; empty if they have none.
    players : the names of the players; empty if they have none.
    written : A and B before rounding, if some payoffs are fractions, or have more
        digits than floats; else shortest decimals.
    """

    A: Vector
    B: Vector
    rows: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()
    written: tuple[PayoffMatrix, PayoffMatrix] | None = None
    players: tuple[str, ...] = ()

    kind = "game"
    form = "written as the game's LCP,"
    inverse = "answers"
    left_out = ("payoffs",)
    counts_solutions = True

    @classmethod
    def of_fields(cls, fields: Mapping[str, Any]) -> Problem:
        if bound := next(filter(files.is_for_bounds, fields), None):
            raise ProblemError(
                bound,
                "is not a key of a game",
                "its unknowns are probabilities; leave it out",
            )
        refuse({"A", "B", "C"} <= fields.keys(), "", *THREE_PLAYERS)
        files.refuse_unknown("", fields, KEYS, "a game")
        data = files.without_nulls(fields)
        for key in ("A", "B"):
            negative = ", -A in a zero-sum game" if key == "B" else ""
            refuse(key not in data, key, IS_MISSING, f"add the key {key}{negative}")
        refuse(any(_depth(data[key]) > 2 for key in ("A", "B")), "", *THREE_PLAYERS)
        return from_game(**data)

    def fields(
        self,
        problem: Problem,  # noqa: ARG002
        *,
        in_text: bool,
    ) -> dict[str, Any] | None:
        """Return the payoffs, in a text as written, and the names."""
        payoffs: Any = (self.A, self.B)
        if in_text and self.written is not None:
            payoffs = (np.array(each, dtype=object) for each in self.written)
        names = {
            key: list(getattr(self, key)) for key in ("rows", "columns", "players")
        }
        return dict(zip("AB", payoffs, strict=True)) | {
            key: each for key, each in names.items() if each
        }

    @classmethod
    def parse(cls, data: Mapping[str, Any]) -> Game:
        refuse_unknown("", data, DATA_KEYS)
        for key in ("A", "B"):
            if key not in data:
                raise ProblemError(key, IS_MISSING, f"add the key {key}")
        return cls.of(
            data["A"],
            data["B"],
            data.get("rows", ()),
            data.get("columns", ()),
            data.get("players", ()),
        )

    @classmethod
    def of(cls, A: Any, B: Any, rows: Any, columns: Any, players: Any = ()) -> Game:
        """Return the game with these names and payoffs, which may be fractions like
        "1/3", or raise ProblemError."""
        (one, exact_one), (other, exact_other) = _payoffs("A", A), _payoffs("B", B)
        if one.shape != other.shape:
            shapes = [" x ".join(map(str, each.shape)) for each in (other, one)]
            raise ProblemError("B", f"is {shapes[0]} but A is {shapes[1]}", MAKE_AGREE)
        m, k = one.shape
        names = (
            names_of("rows", rows, m, "strategy"),
            names_of("columns", columns, k, "strategy"),
        )
        exact = (
            (exact_one or _decimals(one), exact_other or _decimals(other))
            if exact_one or exact_other
            else None
        )
        return cls(one, other, *names, exact, names_of("players", players, 2, "player"))

    def negated(self) -> Game:
        """Return the game with the negative payoffs, for costs."""
        A, B = (
            [[-value for value in row] for row in matrix]
            for matrix in self.written or ([], [])
        )
        return replace(
            self, A=0.0 - self.A, B=0.0 - self.B, written=self.written and (A, B)
        )

    def data(self) -> dict[str, Any]:
        exact = self.written or (None, None)
        fields = {
            "kind": "game",
            "A": _listed(self.A, exact[0]),
            "B": _listed(self.B, exact[1]),
        }
        fields |= {
            "rows": list(self.rows),
            "columns": list(self.columns),
            "players": list(self.players),
        }
        return {key: value for key, value in fields.items() if value}

    def fits(self, conditions: Conditions) -> bool:
        m, k = self.A.shape
        if (
            conditions.q.size != m + k
            or (conditions.q != -1).any()
            or conditions.lower.any()
            or (conditions.upper < np.inf).any()
        ):
            return False
        M = matrices.dense(conditions.M)
        with np.errstate(over="ignore", invalid="ignore"):
            # Their sum is constant up to rounding.
            for costs, payoffs in ((M[:m, m:], self.A), (M[m:, :m].T, self.B)):
                if not np.ptp(costs + payoffs) <= 8 * EPS * (
                    np.abs(costs).max() + np.abs(payoffs).max()
                ):
                    return False
        return not M[:m, :m].any() and not M[m:, m:].any()

    def conditions(self) -> tuple[Vector, Vector]:
        """Return M and q."""
        m, k = self.A.shape
        M, (A, B) = np.zeros((m + k, m + k)), self.written or (self.A, self.B)
        M[:m, m:], M[m:, :m] = _costs("A", A), _costs("B", B).T
        return M, -np.ones(m + k)

    def exact_conditions(self) -> tuple[list[dict[int, Fraction]], list[Fraction]]:
        """Return the rows of M, with exact costs, and q."""
        (A, B), (r, c) = self.payoffs(), self.cost_constants()
        rows = [{len(A) + j: r - value for j, value in enumerate(row)} for row in A]
        rows += [
            {i: c - value for i, value in enumerate(column)}
            for column in zip(*B, strict=True)
        ]
        return rows, [Fraction(-1)] * len(rows)

    def payoffs(self) -> tuple[PayoffMatrix, PayoffMatrix]:
        """Return A and B as exact numbers."""
        return self.written or (_decimals(self.A), _decimals(self.B))

    def cost_constants(self) -> tuple[Fraction, Fraction]:
        """Return the numbers from which the payoffs of the row and of the column player
        are subtracted."""
        r, c = map(_constant, self.payoffs())
        return r, c

    def names(self, n: int, purpose: str = FULL) -> Sequence[str]:  # noqa: ARG002
        """Return the names of the strategies, "" if they have none; labels and cells
        then have their numbers.
        """
        if purpose in (LABELS, CELLS):
            names: list[str] = self.sibling("strategies").names_of(self)
            return names
        m, k = self.A.shape
        return [*(self.rows or unnamed(m)), *(self.columns or unnamed(k))]

    def accepted(self, result: Any) -> Any:
        return self.sibling("answers").accepted(self, result)

    def lengths(self, problem: Any) -> dict[int, str]:
        return {problem.n: "{} and {} strategies".format(*self.A.shape)}

    def joined(self, parts: Mapping[str, Sequence[Any]]) -> list[Any]:
        values: list[Any] = self.sibling("answers").joined(self, parts)
        return values

    def meaning(self, data: Any) -> Any:
        return self.sibling("nash_subsets").Players(data, self)

    def parts(self, z: Any) -> tuple[Any, Any]:
        """Return the parts of a z that belong to the row and to the column player."""
        return z[: len(self.A)], z[len(self.A) :]


def _costs(field: str, payoffs: Any) -> Vector:
    """Return positive costs, a constant minus the payoffs, rounded once. Floats are
    taken as their shortest decimals.
    """
    with suppress(OverflowError), localcontext(EXACT_CONTEXT):
        if isinstance(payoffs, np.ndarray):
            costs = _costs_of_short(payoffs)
            costs = _costs_of_doubles(payoffs) if costs is None else costs
        else:
            constant = _constant(payoffs)
            costs = np.array(
                [[float(constant - value) for value in row] for row in payoffs]
            )
        if np.isfinite(costs).all():
            return costs
    raise ProblemError(field, "exceeds the double-precision range", SCALE_PAYOFFS)


@np.errstate(over="ignore")
def _costs_of_short(payoffs: Vector) -> Vector | None:
    """Return the costs if all payoffs are integer multiples of one power of ten, with
    at most MAX_DIGITS digits, without converting any to a decimal; else None.

    Different decimals of so few digits have different nearest floats, and the integers,
    their differences and the power of ten are exact.
    """
    for digits in range(MAX_DIGITS):
        unit = 10.0**digits
        integers = np.rint(unit * payoffs[:1])
        if not np.abs(integers).max() < 10.0**MAX_DIGITS:
            return None
        if np.array_equal(integers / unit, payoffs[:1]):
            integers = np.rint(unit * payoffs)
            if not np.abs(integers).max() < 10.0**MAX_DIGITS:
                return None
            if np.array_equal(integers / unit, payoffs):
                spread = integers.max() - integers.min()
                return np.asarray((integers.max() + (spread or unit) - integers) / unit)
    return None


@np.errstate(all="ignore")
def _costs_of_doubles(payoffs: Vector) -> Vector:
    """Return the costs for any floats. Only those payoffs are converted to decimals for
    which half an ulp decides how the cost is rounded.

    A cost is s + t minus the difference of the payoff from its decimal, where s + t is
    exact by Knuth's TwoSum.
    """
    extremes = [
        [Decimal(repr(float(extreme))) for extreme in (payoffs.max(), payoffs.min())]
    ]
    exact = _constant(extremes)
    constant = float(exact)
    s = constant - payoffs
    minus = s - constant
    t = (constant - (s - minus)) - (payoffs + minus)
    t += float(exact - Decimal(constant))
    costs = s + t
    residual = np.abs((s - costs) + t) + 0.5 * np.abs(np.spacing(payoffs))
    residual += SURELY * (np.spacing(costs) + np.spacing(constant))
    is_sure = residual < 0.5 * (costs - np.nextafter(costs, 0.0))
    unsure = np.logical_not(is_sure).nonzero()
    costs[unsure] = [
        float(exact - Decimal(repr(value))) for value in payoffs[unsure].tolist()
    ]
    return np.asarray(costs)


def _constant(payoffs: Any) -> Any:
    """Return the largest payoff plus their range, or plus 1 if all payoffs are
    equal."""
    largest, smallest = max(map(max, payoffs)), min(map(min, payoffs))
    return largest + ((largest - smallest) or 1)


def _payoffs(field: str, values: Any) -> tuple[Vector, PayoffMatrix | None]:
    """Return payoffs rounded to floats and, if some are fractions or texts like "1/3",
    also unrounded.
    """
    rows = []
    has_rows = isinstance(values, (list, tuple)) and all(
        isinstance(row, (list, tuple)) for row in values
    )
    # Most payoffs are neither texts nor fractions, and need no conversion.
    if has_rows and not {*map(type, chain.from_iterable(values))} <= {int, float}:
        is_number = PAYOFF.fullmatch
        values = rows = [
            [Fraction(v) if isinstance(v, str) and is_number(v) else v for v in row]
            for row in values
        ]
    rounded = readonly_copy(matrices.dense(as_matrix(field, values)))
    if not any(isinstance(v, Fraction) for row in rows for v in row):
        return rounded, None
    return rounded, [
        [v if isinstance(v, Fraction) else Fraction(repr(float(v))) for v in row]
        for row in rows
    ]


def _decimals(payoffs: Vector) -> PayoffMatrix:
    """Return the shortest decimals of payoffs as fractions."""
    return [[Fraction(repr(value)) for value in row] for row in payoffs.tolist()]


def _listed(payoffs: Vector, exact: PayoffMatrix | None) -> list[list[float | str]]:
    """Return rows of numbers for JSON: integers without a decimal point, and fractions
    as texts.
    """
    rows: list[list[float | str]] = [
        [int(v) if v.is_integer() and abs(v) < 1e15 else v for v in row]
        for row in payoffs.tolist()
    ]
    for i, fractions in enumerate(exact or ()):
        pairs = zip(fractions, rows[i], strict=True)
        rows[i] = [
            v if x == Fraction(repr(v)) else f"{x.numerator}/{x.denominator}"
            for x, v in pairs
        ]
    return rows


def _depth(payoffs: Any) -> int:
    """Return the depth of nested lists."""
    return 1 + _depth(payoffs[0]) if isinstance(payoffs, list) and payoffs else 0
