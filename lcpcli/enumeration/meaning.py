"""What exact solutions of a problem mean in terms of its formulation, such as a game:
for objectives, and for tables, CSV and JSON of all solutions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from lcpcli.enumeration.pieces import Piece
from lcpcli.errors import count
from lcpcli.model.formulation import Answer
from lcpcli.rational.dictionary import RationalPoint
from lcpcli.rational.exact_problem import ExactProblem

if TYPE_CHECKING:
    from lcpcli.verify.certificate import Proof

Values = Sequence[Fraction]


class Payoff(NamedTuple):
    """A quantity that an objective may contain like an unknown: constant - slope z_i, i
    from 0.
    """

    unknown: int
    slope: Fraction
    constant: Fraction


class InPayoffs(NamedTuple):
    """A problem in whose unknowns payoffs are linear, and a function that returns z of
    the original problem.
    """

    data: ExactProblem
    z_of: Callable[[Values], list[Fraction]]


class Listing(NamedTuple):
    """A table of solutions, in groups of rows. total : the number of rows."""

    header: list[str]
    groups: Iterable[Iterable[list[str]]]
    total: int
    remarks: list[str]


class Arrangement:
    """Pieces of a solution set in the order in which they are shown; a `Meaning` may
    return an object of a derived class.

    complete : whether they are proved to be all.
    equilibria : the equilibria of a game; None for other problems.
    """

    equilibria: Any = None

    def __init__(self, pieces: Sequence[Piece], complete: bool) -> None:
        self.pieces: Sequence[Piece] = tuple(pieces)
        self.complete = complete

    @cached_property
    def points(self) -> Sequence[RationalPoint]:
        """Return each isolated solution, and each vertex of a piece, once."""
        return vertices_of(self.pieces)

    def count(self) -> str:
        """Return how many solutions there are, in words."""
        points = sum(piece.is_point for piece in self.pieces)
        faces = len(self.pieces) - points
        if not faces:
            return count(points, "solution")
        isolated = f"{points} isolated and " if points else ""
        return f"infinitely many solutions: {isolated}{count(faces, 'face')}"

    def record(self) -> dict[str, Any]:
        """Return the entries of JSON about all solutions together."""
        return {"components": None, "degenerate": None}

    def table(
        self,
        kept: Sequence[int],  # noqa: ARG002
        most: float,  # noqa: ARG002
        cell: Callable[[Fraction], str],  # noqa: ARG002
    ) -> Listing | None:
        """Return the table of solutions in terms of the formulation; None for a table
        of z and w. kept : the components of z that are shown. most : the largest width
        of names.
        """
        return None

    def cells(
        self,
        *,
        exact: bool,  # noqa: ARG002
    ) -> tuple[Sequence[str], Iterable[tuple[Any, ...]]] | None:
        """Return the columns of CSV and its rows, one for each component of each
        solution; None for those of z and w.
        """
        return None


def vertices_of(pieces: Iterable[Piece]) -> list[RationalPoint]:
    """Return the distinct vertices of pieces."""
    return list(dict.fromkeys(vertex for piece in pieces for vertex in piece.vertices))


class Meaning:
    """The meaning of a problem that is defined by M and q only; the `meaning` of a
    formulation returns an object of a derived class.

    data : the problem in exact numbers.
    vertices : the name, in a remark, of the points whose averages make up a face.
    columns : the columns of CSV after z and w.
    """

    vertices = "its vertices"
    columns: Sequence[str] = ()

    def __init__(self, data: ExactProblem) -> None:
        self.data = data

    def payoffs(self) -> Mapping[str, Payoff]:
        """Return the payoffs of players, by their names."""
        return {}

    def in_payoffs(self) -> InPayoffs:
        """Return the problem in which the payoffs are linear; by default this one."""
        return InPayoffs(self.data, list)

    def shown(self, indices: Sequence[int]) -> Sequence[int]:
        """Return which of these components are shown in tables."""
        return indices

    def headings(self, indices: Sequence[int]) -> list[str]:
        """Return the headings of the columns after those of these components."""
        return [f"w{i + 1}" for i in indices]

    def row(
        self,
        kind: str,
        z: Values,
        w: Values,
        indices: Sequence[int],
        cell: Callable[[Fraction], str],
    ) -> tuple[Values, list[str]]:
        """Return the values of the components of z, and the cells of the columns after
        them. kind : vertex, ray or line.
        """
        del kind
        return z, [cell(w[i]) for i in indices]

    def equilibrium(self, z: Values) -> Any:
        """Return the equilibrium that a solution represents, or None if there is
        none.
        """
        del z

    def record(self, z: Values) -> dict[str, Any]:
        """Return the entries of JSON about a solution in addition to z and w."""
        return {"equilibrium": self.equilibrium(z)}

    def cells(self, z: Values) -> Sequence[Sequence[Any]]:
        """Return the cells of `columns` for each component of a solution or of a
        direction, numbers as fractions.
        """
        return [()] * len(z)

    def without_solution(self, proof: Proof | None) -> Answer | None:
        """Return what it means for the formulation that there is no solution, for which
        a proof may exist; None if it means nothing else.
        """
        del proof
        return None

    def objective(
        self,
        z: Values,
        moved: tuple[int, Fraction] | None = None,
    ) -> Fraction | None:
        """Return the objective value of z, or None if there is no objective. moved : i
        and t if q_i is replaced by q_i + t.
        """
        del z, moved
        return None

    def best(
        self, z: Values, cell: Callable[[Fraction], str]
    ) -> tuple[list[str], list[Any]]:
        """Return lines and tables of text about the best solution."""
        del z, cell
        return [], []

    def take(
        self, vertices: Sequence[RationalPoint], check: Callable[[], None]
    ) -> None:
        """Prepare for vertices that a search has computed. `check` counts a step of the
        search, and may raise.
        """

    def arranged(self, pieces: Sequence[Piece], complete: bool) -> Arrangement:
        """Return pieces in the order in which they are shown; their vertices have been
        passed to `take`. complete : whether they are proved to be all.
        """
        return Arrangement(pieces, complete)


class MeaningToPlayers(Meaning):
    """The meaning of solutions at whose vertices each player has a payoff or a cost.

    heading : that of the column of a player, with a placeholder for the name.
    """

    heading = "{} gets"

    def __init__(self, data: ExactProblem, game: Any, players: Sequence[str]) -> None:
        super().__init__(data)
        self._game, self._players = game, players

    def headings(self, indices: Sequence[int]) -> list[str]:  # noqa: ARG002
        return [self.heading.format(name) for name in self._players]

    def row(
        self,
        kind: str,
        z: Values,
        w: Values,  # noqa: ARG002
        indices: Sequence[int],  # noqa: ARG002
        cell: Callable[[Fraction], str],
    ) -> tuple[Values, list[str]]:
        if kind != "vertex":  # a direction has the changes of the components
            return z, [""] * len(self._players)
        components, amounts = self.at_vertex(z)
        return components, [*map(cell, amounts)]

    def at_vertex(self, z: Values) -> tuple[Values, Sequence[Any]]:
        """Return the components that are shown, and the payoffs or costs."""
        raise NotImplementedError


def meaning_of(data: ExactProblem) -> Meaning:
    """Return the meaning of a problem in terms of its formulation."""
    meaning: Meaning = data.problem.formulation.meaning(data) or Meaning(data)
    return meaning
