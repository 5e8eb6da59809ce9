"""Bimatrix games: C. E. Lemke, J. T. Howson, Equilibrium points of bimatrix games, J. SIAM 12 (1964) 413-423."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

import numpy as np

from lcpcli.errors import ProblemError, refuse_unknown
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS
from lcpcli.model.arrays import as_matrix
from lcpcli.model.reductions.program import Conditions, names_of
from lcpcli.typing import Vector

KEYS = ("kind", "A", "B", "rows", "columns")


@dataclass(frozen=True, eq=False)
class Game:
    """The game whose equilibria are given by M = [0 R; C' 0] and q = -e, with costs R = r - A and C = c - B.

    A, B : the payoffs of the row and the column player, both of shape (m, k).
    rows, columns : the names of the strategies; empty if they have none.
    """

    A: Vector
    B: Vector
    rows: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()

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
        """The game with these payoffs and names, or a ProblemError."""
        payoffs = [as_matrix(field, values) for field, values in (("A", A), ("B", B))]
        one, other = (matrices.dense(payoff) for payoff in payoffs)
        if one.shape != other.shape:
            shapes = [" x ".join(map(str, each.shape)) for each in (other, one)]
            raise ProblemError("B", f"is {shapes[0]} but A is {shapes[1]}", "make them agree")
        m, k = one.shape
        return cls(one, other, names_of("rows", rows, m, "strategy"), names_of("columns", columns, k, "strategy"))

    def data(self) -> dict[str, Any]:
        held: dict[str, Any] = {"kind": "game", "A": _listed(self.A), "B": _listed(self.B)}
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
        M[:m, m:], M[m:, :m] = _costs("A", self.A), _costs("B", self.B).T
        return M, -np.ones(m + k)

    def names(self, n: int) -> Sequence[str]:  # noqa: ARG002 (as in every origin)
        """The names of the strategies, "" where they have none."""
        m, k = self.A.shape
        return [*(self.rows or [""] * m), *(self.columns or [""] * k)]

    def parts(self, z: Any) -> tuple[Any, Any]:
        """The parts of a z that belong to the row and to the column player."""
        m = self.A.shape[0]
        return z[:m], z[m:]


def _costs(field: str, payoffs: Vector) -> Vector:
    """Positive costs, a constant minus the payoffs, rounded once."""
    decimals = [[Decimal(repr(value)) for value in row] for row in payoffs.tolist()]
    largest, least = max(map(max, decimals)), min(map(min, decimals))
    constant = largest + ((largest - least) or 1)
    costs = np.array([[float(constant - value) for value in row] for row in decimals])
    if not np.isfinite(costs).all():
        raise ProblemError(field, "exceeds the double-precision range", "scale the payoffs")
    return costs


def _complement(costs: Vector, payoffs: Vector) -> bool:
    """Whether costs and payoffs add up to a constant, up to rounding."""
    with np.errstate(over="ignore", invalid="ignore"):
        total = costs + payoffs
        return bool(np.ptp(total) <= 8 * EPS * (np.abs(costs).max() + np.abs(payoffs).max()))


def _listed(payoffs: Vector) -> list[list[float]]:
    """Rows of numbers, whole ones as integers, which JSON shows without a point."""
    return [[int(v) if v.is_integer() and abs(v) < 1e15 else v for v in row] for row in payoffs.tolist()]
