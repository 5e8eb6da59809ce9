"""The set of all solutions as far as it was found, and what is known about it."""

from __future__ import annotations

from dataclasses import dataclass

from lcpcli.enumeration.equilibria import Equilibria
from lcpcli.enumeration.piece import Piece
from lcpcli.enumeration.search import Solutions
from lcpcli.errors import count
from lcpcli.model.origins import Game
from lcpcli.model.program import Program
from lcpcli.rational.polyhedra import Point
from lcpcli.rational.problem import ExactProblem
from lcpcli.solving.no_minimum import undecided

COMPLETE, UNSOLVABLE = "complete", "unsolvable"  # proved to be all; proved that there are none
ENOUGH, TIME_LIMIT, INTERRUPTED = "max_solutions", "time_limit", "interrupted"  # what ended the search before
UNLISTED = {
    ENOUGH: ", as many as were asked for",
    TIME_LIMIT: " by the time limit",
    INTERRUPTED: " before the search was interrupted",
}
OTHERS = {True: "there are others", None: "there may be others"}


@dataclass(frozen=True)
class SolutionSet:
    """The pieces of a solution set.

    data : the problem. pieces : those that were found. equilibria : of a game those of the pieces; else None.
    status : COMPLETE, UNSOLVABLE or what ended the search. others : whether there are other solutions; None if that is
    not known. seconds : that it took.
    """

    data: ExactProblem
    pieces: tuple[Piece, ...]
    equilibria: Equilibria | None
    status: str
    others: bool | None
    seconds: float

    @classmethod
    def of(cls, search: Solutions, ended: str, seconds: float) -> SolutionSet:
        """What a search has found; `ended` is what ended it if it is not complete."""
        pieces, held = search.arranged()
        status = (COMPLETE if pieces else UNSOLVABLE) if search.complete else ended
        return cls(search.problem, pieces, held, status, search.others, seconds)

    @property
    def complete(self) -> bool:
        """Whether these are proved to be all solutions."""
        return self.others is False

    @property
    def points(self) -> list[Point]:
        """Each isolated solution, and each vertex of a piece, once; of a game in the order of the equilibria."""
        vertices = {vertex: None for piece in self.pieces for vertex in piece.vertices}
        if self.equilibria is None:
            return list(vertices)
        places = (k for subset in self.equilibria.subsets for k in subset.extreme)
        own = (vertex for piece in self.pieces for vertex in piece.vertices)
        return [vertex for _, vertex in sorted(dict(zip(places, own, strict=True)).items())]

    @property
    def game(self) -> Game | None:
        """The game whose equilibria are the solutions."""
        origin = self.data.problem.origin
        return origin if isinstance(origin, Game) else None

    @property
    def count(self) -> str:
        """How many solutions were found, or equilibria, in words."""
        words = self._solutions() if self.equilibria is None else self._equilibria(self.equilibria)
        return words + " found" * (not self.complete)

    @property
    def message(self) -> str:
        """The whole in one sentence."""
        if self.status == UNSOLVABLE:
            told = "no solution: every choice of states is excluded in rational arithmetic"
            origin = self.data.problem.origin
            return f"{told}; {undecided(origin).statement}" if isinstance(origin, Program) else told
        found = self.count
        if not self.complete:
            if not self.pieces:
                return f"no solution was found{UNLISTED[self.status]}; there may be some"
            return f"{found}{UNLISTED[self.status]}; {OTHERS[self.others]}"
        isolated = all(piece.is_point for piece in self.pieces)
        if isolated and len(self.pieces) == 1:
            return f"{found}, proved to be the only one"
        return f"{found}{', all isolated' * isolated}, proved to be all"

    def _solutions(self) -> str:
        points = sum(piece.is_point for piece in self.pieces)
        faces = len(self.pieces) - points
        if not faces:
            return count(points, "solution")
        return f"infinitely many solutions: {f'{points} isolated and ' * bool(points)}{count(faces, 'face')}"

    def _equilibria(self, held: Equilibria) -> str:
        extreme = len(held.extreme)
        if all(piece.is_point for piece in self.pieces):
            return f"{extreme} {'equilibrium' if extreme == 1 else 'equilibria'}"
        subsets = count(len(held.subsets), "maximal Nash subset")
        joined = "" if held.components is None else f" in {count(len(held.components), 'component')}"
        return f"infinitely many equilibria: {extreme} extreme ones, {subsets}{joined}"
