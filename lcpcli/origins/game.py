"""Bimatrix games as LCPs, and back: C. E. Lemke, J. T. Howson, Equilibrium points of bimatrix games, J. SIAM 12 (1964)
413-423.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli import linalg
from lcpcli.errors import ProblemError
from lcpcli.problem import Problem, as_matrix, count, kind
from lcpcli.typing import Matrix, Vector

if TYPE_CHECKING:
    from fractions import Fraction

    from lcpcli.result import Result

EPS = float(np.finfo(float).eps)
KEYS = ("kind", "A", "B", "rows", "columns")


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """What a solution of the LCP says of the game.

    row, column : the mixed strategies, probabilities in the order of the game's rows and columns; None where it is not
        solved, and so are the others.
    payoffs : what the row and the column player may expect, in the game's units.
    gains : how much more either of them would get by the best response to the other, computed from A and B; 0 where
        that is no more than rounding.
    statement : whether the strategies are an equilibrium.
    exact : row and column as fractions where z is proved, else None.
    """

    row: Vector | None
    column: Vector | None
    payoffs: tuple[float, float] | None
    gains: tuple[float, float] | None
    statement: str
    exact: dict[str, list[Fraction]] | None = None


@dataclass(frozen=True, eq=False)
class Game:
    """The game of which M = [0 R; C' 0] and q = -e, with costs R = r - A and C = c - B, give the equilibria.

    A, B : the payoffs of the row and the column player, shape (m, k) both.
    rows, columns : the names of the strategies; empty if they have none.
    """

    A: Vector
    B: Vector
    rows: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()

    @classmethod
    def parse(cls, data: Mapping[str, Any]) -> Game:
        """The game that a file describes, or a ProblemError."""
        from lcpcli.files.keys import refuse_unknown

        refuse_unknown("", data, KEYS)
        for key in ("A", "B"):
            if key not in data:
                raise ProblemError(key, "is missing", f"add the key {key}")
        return cls.of(data["A"], data["B"], data.get("rows", ()), data.get("columns", ()))

    @classmethod
    def of(cls, A: Any, B: Any, rows: Any, columns: Any) -> Game:
        """The game of these payoffs and names, or a ProblemError."""
        payoffs = [as_matrix(field, values) for field, values in (("A", A), ("B", B))]
        one, other = (linalg.dense(payoff) for payoff in payoffs)
        if one.shape != other.shape:
            shapes = [" x ".join(map(str, each.shape)) for each in (other, one)]
            raise ProblemError("B", f"is {shapes[0]} but A is {shapes[1]}", "make them agree")
        m, k = one.shape
        return cls(one, other, _names("rows", rows, m), _names("columns", columns, k))

    def data(self) -> dict[str, Any]:
        held: dict[str, Any] = {"kind": "game", "A": _listed(self.A), "B": _listed(self.B)}
        names = {"rows": list(self.rows), "columns": list(self.columns)}
        return held | {key: value for key, value in names.items() if value}

    def fits(self, M: Matrix, q: Vector) -> bool:
        m, k = self.A.shape
        if q.size != m + k or (q != -1).any():
            return False
        M = linalg.dense(M)
        costs = (M[:m, m:], self.A), (M[m:, :m].T, self.B)
        return not M[:m, :m].any() and not M[m:, m:].any() and all(_complement(*each) for each in costs)

    def problem(self, **texts: str) -> Problem:
        """The LCP."""
        m, k = self.A.shape
        M = np.zeros((m + k, m + k))
        M[:m, m:], M[m:, :m] = _costs("A", self.A), _costs("B", self.B).T
        return Problem(M, -np.ones(m + k), origin=self, **texts)

    def answer(self, result: Result) -> Equilibrium:
        """Strategies, payoffs and gains of a result that is solved, and whether that is an equilibrium."""
        m = self.A.shape[0]
        if not result.solved:
            return Equilibrium(None, None, None, None, "not solved, so that there are no strategies")
        x, y = (part / part.sum() for part in (result.z[:m], result.z[m:]))
        exact = None
        if result.exact is not None and result.exact.z is not None:
            parts = {"row": result.exact.z[:m], "column": result.exact.z[m:]}
            exact = {name: [value / sum(part) for value in part] for name, part in parts.items()}
        by_row, by_column = self.A @ y, x @ self.B
        payoffs = float(x @ by_row), float(by_column @ y)
        gains = _gain(by_row, payoffs[0], self.A), _gain(by_column, payoffs[1], self.B)
        small = all(
            gain <= 10 * result.problem.n * result.tol * _span(payoff)
            for gain, payoff in zip(gains, (self.A, self.B), strict=True)
        )
        found = "an equilibrium" if small else "no equilibrium to the tolerance"
        told = f"{found}: by a best response the row player would gain {gains[0]:.1g}, the column player {gains[1]:.1g}"
        return Equilibrium(x, y, payoffs, gains, told, exact)


def from_game(
    A: Any,
    B: Any,
    *,
    rows: Sequence[str] = (),
    columns: Sequence[str] = (),
    name: str = "",
    source: str = "",
    note: str = "",
) -> Problem:
    """The LCP whose solutions are the equilibria of a game in which either player maximises.

    A, B : payoffs of the row and of the column player, shape (m, k) both.
    rows, columns : names of the strategies, or nothing.

    z = (x, y); x and y, each divided by its sum, are the strategies. `Result.answer` maps it back. A cost is what the
    payoff lacks to the largest one and the span of payoffs together, so that costs lie within a factor of two. Payoffs
    count as the shortest decimals that they are. Raises ProblemError, which names the field.

    >>> import lcpcli
    >>> answer = lcpcli.run(lcpcli.from_game([[3, 0], [0, 2]], [[2, 0], [0, 3]]), "auto").answer
    >>> answer.row.round(6).tolist(), answer.column.round(6).tolist()
    ([0.6, 0.4], [0.4, 0.6])
    """
    return Game.of(A, B, rows, columns).problem(name=name, source=source, note=note)


def _costs(field: str, payoffs: Vector) -> Vector:
    """Positive costs, a constant less the payoffs, rounded once."""
    decimals = [[Decimal(repr(value)) for value in row] for row in payoffs.tolist()]
    largest, least = max(map(max, decimals)), min(map(min, decimals))
    constant = largest + ((largest - least) or 1)
    costs = np.array([[float(constant - value) for value in row] for row in decimals])
    if not np.isfinite(costs).all():
        raise ProblemError(field, "spans more than double precision holds", "scale the payoffs")
    return costs


def _complement(costs: Vector, payoffs: Vector) -> bool:
    """Whether costs and payoffs add up to a constant, but for rounding."""
    with np.errstate(over="ignore", invalid="ignore"):
        total = costs + payoffs
        return bool(np.ptp(total) <= 8 * EPS * (np.abs(costs).max() + np.abs(payoffs).max()))


def _gain(replies: Vector, payoff: float, payoffs: Vector) -> float:
    """What the best of the replies gets beyond the payoff; 0 where that is no more than rounding of the payoffs."""
    gain = float(replies.max()) - payoff
    return gain if gain > 8 * EPS * float(np.abs(payoffs).max()) else 0.0


def _span(payoffs: Vector) -> float:
    return float(np.ptp(payoffs)) or 1.0


def _listed(payoffs: Vector) -> list[list[float]]:
    """Rows of numbers, whole ones as integers, which JSON shows without a point."""
    return [[int(v) if v.is_integer() and abs(v) < 1e15 else v for v in row] for row in payoffs.tolist()]


def _names(field: str, given: Any, size: int) -> tuple[str, ...]:
    if not isinstance(given, (list, tuple)):
        raise ProblemError(field, f"is {kind(given)}", "give a list of names")
    for i, name in enumerate(given):
        if not isinstance(name, str):
            raise ProblemError(f"{field}[{i}]", f"is {kind(name)}", "give a text")
    if given and len(given) != size:
        raise ProblemError(field, f"has {count(len(given), 'name')} for {count(size, 'strategy')}", "make them agree")
    return tuple(given)
