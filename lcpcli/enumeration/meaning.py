"""What exact solutions of a problem mean for what it was made from: for tables, CSV and
JSON of all solutions, and for objectives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

from lcpcli.model.formulation import Answer
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.verify.certificate import Proof

Values = Sequence[Fraction]


class Payoff(NamedTuple):
    """A quantity that an objective may have in place of an unknown: constant - slope
    z_i, i from 0."""

    unknown: int
    slope: Fraction
    constant: Fraction


class Meaning:
    """This is the meaning of a problem that is given by M and q; a formulation returns
    an object of a derived class from its `meaning`.

    data : the problem in exact numbers.
    vertices : what the solutions of a face are averages of, in a remark.
    columns : in CSV, behind z and w.
    """

    vertices = "its vertices"
    columns: Sequence[str] = ()

    def __init__(self, data: ExactProblem) -> None:
        self.data = data

    def payoffs(self) -> Mapping[str, Payoff]:
        """Return the payoffs of players, by their names."""
        return {}

    def shown(self, indices: list[int]) -> list[int]:
        """Return which of these components tables show."""
        return indices

    def headings(self, indices: Sequence[int]) -> list[str]:
        """Return the headings of the columns behind those of these components."""
        return [f"w{i + 1}" for i in indices]

    def row(
        self,
        kind: str,
        z: Values,
        w: Values,
        indices: Sequence[int],
        cell: Callable[[Fraction], str],
    ) -> tuple[Values, list[str]]:
        """Return the values of the components of z, and the cells behind them. kind :
        vertex, ray or line."""
        del kind
        return z, [cell(w[i]) for i in indices]

    def record(self, z: Values) -> dict[str, Any]:
        """Return what JSON has of a solution besides z and w."""
        del z
        return {"equilibrium": None}

    def cells(self, z: Values) -> Sequence[Sequence[Any]]:
        """Return for each component of a solution, or of a direction, the cells of the
        `columns`, numbers as fractions."""
        return [()] * len(z)

    def without_solution(self, proof: Proof | None) -> Answer | None:
        """Return what it means that there is no solution, for which there may be a
        proof in numbers; None if nothing else."""
        del proof
        return None

    def objective(
        self,
        z: Values,
        moved: tuple[int, Fraction] | None = None,
    ) -> Fraction | None:
        """Return what z minimizes or maximizes; None if nothing. moved : i and t, where
        q_i has become q_i + t."""
        del z, moved
        return None

    def best(self, z: Values) -> tuple[list[str], list[Any]]:
        """Return lines and tables about the best solution."""
        del z
        return [], []


def meaning_of(data: ExactProblem) -> Meaning:
    found: Meaning = data.problem.formulation.meaning(data) or Meaning(data)
    return found
