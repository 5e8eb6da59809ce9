"""Bimatrix games: C. E. Lemke, J. T. Howson, Equilibrium points of bimatrix games, J. SIAM 12 (1964) 413-423."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Context, Decimal, localcontext
from fractions import Fraction
from typing import Any

import numpy as np

from lcpcli.errors import ProblemError, refuse_unknown
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS
from lcpcli.model.arrays import as_matrix, own
from lcpcli.model.reductions.program import Conditions, names_of
from lcpcli.typing import Vector

KEYS = ("kind", "A", "B", "rows", "columns")
RATIO = re.compile(r"\s*[-+]?[0-9]{1,1000}/0*[1-9][0-9]{0,999}\s*")

EXACT = Context(prec=1000)  # digits enough for sums and differences of any doubles, which have 650 at most

Payoffs = list[list[Fraction]]


@dataclass(frozen=True, eq=False)
class Game:
    """The game whose equilibria are given by M = [0 R; C' 0] and q = -e, with costs R = r - A and C = c - B.

    A, B : the payoffs of the row and the column player, both of shape (m, k).
    rows, columns : the names of the strategies; empty if they have none.
    written : A and B before rounding, if some payoffs are fractions or have more digits than doubles; else the shortest
        decimals count.
    """

    A: Vector
    B: Vector
    rows: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()
    written: tuple[Payoffs, Payoffs] | None = None

    @classmethod
    def parse(cls, data: Mapping[str, Any]) -> Game:
        """The game described in a file, or a ProblemError."""
        refuse_unknown("", data, KEYS)
        for key in ("A", "B"):
            if key not in data:
                raise ProblemError(key, "is missing", f"add the key {key}")
        return cls.of(data["A"], data["B"], data.get("rows", ()), data.get("columns", ()))

    @classmethod
    def of(cls, A: Any, B: Any, rows: Any, columns: Any) -> Game:
        """The game with these payoffs, fractions like "1/3" among them, and names, or a ProblemError."""
        fractional = [_with_fractions(values) for values in (A, B)]
        payoffs = [as_matrix(field, _rounded(values)) for field, values in zip("AB", fractional, strict=True)]
        one, other = (own(matrices.dense(payoff)) for payoff in payoffs)
        if one.shape != other.shape:
            shapes = [" x ".join(map(str, each.shape)) for each in (other, one)]
            raise ProblemError("B", f"is {shapes[0]} but A is {shapes[1]}", "make them agree")
        m, k = one.shape
        names = names_of("rows", rows, m, "strategy"), names_of("columns", columns, k, "strategy")
        if fractional[0] is A and fractional[1] is B:
            return cls(one, other, *names)
        exact = [
            [
                [
                    v if isinstance(v, Fraction) else Fraction(repr(double))
                    for v, double in zip(row, doubles, strict=True)
                ]
                for row, doubles in zip(values, payoffs.tolist(), strict=True)
            ]
            for values, payoffs in zip(fractional, (one, other), strict=True)
        ]
        return cls(one, other, *names, (exact[0], exact[1]))

    def data(self) -> dict[str, Any]:
        exact = self.written or (None, None)
        held: dict[str, Any] = {"kind": "game", "A": _listed(self.A, exact[0]), "B": _listed(self.B, exact[1])}
        names = {"rows": list(self.rows), "columns": list(self.columns)}
        return held | {key: value for key, value in names.items() if value}

    def fits(self, given: Conditions) -> bool:
        m, k = self.A.shape
        if given.q.size != m + k or (given.q != -1).any() or given.lower.any() or (given.upper < np.inf).any():
            return False
        M = matrices.dense(given.M)
        costs = (M[:m, m:], self.A), (M[m:, :m].T, self.B)
        return not M[:m, :m].any() and not M[m:, m:].any() and all(_complement(*each) for each in costs)

    def conditions(self) -> tuple[Vector, Vector]:
        """M and q."""
        m, k = self.A.shape
        M = np.zeros((m + k, m + k))
        with localcontext(EXACT):
            M[:m, m:], M[m:, :m] = _costs("A", self._numbers(0)), _costs("B", self._numbers(1)).T
        return M, -np.ones(m + k)

    def payoffs(self) -> tuple[Payoffs, Payoffs]:
        """A and B as exact numbers."""
        A, B = ([[Fraction(value) for value in row] for row in self._numbers(player)] for player in (0, 1))
        return A, B

    def cost_constants(self) -> tuple[Fraction, Fraction]:
        """The numbers from which the payoffs of the row and of the column player are subtracted."""
        with localcontext(EXACT):
            r, c = (Fraction(_constant(self._numbers(player))) for player in (0, 1))
        return r, c

    def _numbers(self, player: int) -> Any:
        """The payoffs of the row player (0) or the column player (1), as fractions or decimals."""
        if self.written is not None:
            return self.written[player]
        return [[Decimal(repr(value)) for value in row] for row in (self.A, self.B)[player].tolist()]

    def names(self, n: int) -> Sequence[str]:  # noqa: ARG002 (as in every origin)
        """The names of the strategies, "" where they have none."""
        m, k = self.A.shape
        return [*(self.rows or [""] * m), *(self.columns or [""] * k)]

    def parts(self, z: Any) -> tuple[Any, Any]:
        """The parts of a z that belong to the row and to the column player."""
        m = self.A.shape[0]
        return z[:m], z[m:]


def _costs(field: str, payoffs: Any) -> Vector:
    """Positive costs, a constant minus the payoffs, rounded once."""
    constant = _constant(payoffs)
    try:
        costs = np.array([[float(constant - value) for value in row] for row in payoffs])
    except OverflowError:
        costs = np.array([np.inf])
    if not np.isfinite(costs).all():
        raise ProblemError(field, "exceeds the double-precision range", "scale the payoffs")
    return costs


def _constant(payoffs: Any) -> Any:
    """The largest payoff plus their range, or 1 if that is 0."""
    largest, least = max(map(max, payoffs)), min(map(min, payoffs))
    return largest + ((largest - least) or 1)


def _with_fractions(values: Any) -> Any:
    """Payoffs with those that are written as fractions, "1/3", as Fraction; as they are if there is none."""
    if not isinstance(values, (list, tuple)) or not all(isinstance(row, (list, tuple)) for row in values):
        return values
    rows = [[Fraction(v) if isinstance(v, str) and RATIO.fullmatch(v) else v for v in row] for row in values]
    return rows if any(isinstance(v, Fraction) for row in rows for v in row) else values


def _rounded(values: Any) -> Any:
    """Payoffs with each Fraction rounded."""
    if not isinstance(values, (list, tuple)):
        return values
    return [[_double(v) for v in row] if isinstance(row, (list, tuple)) else row for row in values]


def _double(value: Any) -> Any:
    try:
        return float(value) if isinstance(value, Fraction) else value
    except OverflowError:
        return np.inf


def _complement(costs: Vector, payoffs: Vector) -> bool:
    """Whether costs and payoffs add up to a constant, up to rounding."""
    with np.errstate(over="ignore", invalid="ignore"):
        total = costs + payoffs
        return bool(np.ptp(total) <= 8 * EPS * (np.abs(costs).max() + np.abs(payoffs).max()))


def _listed(payoffs: Vector, exact: Payoffs | None) -> list[list[float | str]]:
    """Rows of numbers, whole ones as integers, which JSON shows without a point, fractions as texts."""
    rows: list[list[float | str]] = [
        [int(v) if v.is_integer() and abs(v) < 1e15 else v for v in row] for row in payoffs.tolist()
    ]
    for row, fractions in zip(rows, exact or (), strict=False):
        row[:] = [
            v if Fraction(repr(v)) == fraction else f"{fraction.numerator}/{fraction.denominator}"
            for v, fraction in zip(row, fractions, strict=True)
        ]
    return rows
