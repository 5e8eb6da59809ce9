"""All solutions of a problem: `lcpcli.solutions`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import count, product

from lcpcli import clock, options
from lcpcli.enumeration.blocks import blocks, restricted
from lcpcli.enumeration.equilibria import Equilibria, equilibria
from lcpcli.enumeration.of_game import pieces_of
from lcpcli.enumeration.piece import Piece, combined
from lcpcli.enumeration.pieces import pieces
from lcpcli.errors import ProblemError
from lcpcli.errors import count as counted
from lcpcli.interrupts import TimeIsUp
from lcpcli.model.problem import Problem, as_problem
from lcpcli.model.reductions.game import Game
from lcpcli.options import MAX_SOLUTIONS, TIME_LIMIT
from lcpcli.rational.polyhedra import Point
from lcpcli.rational.problem import ExactProblem

LARGEST = 500  # unknowns of a block
SHOWN = 4  # pieces that are printed
ENDING = 0.5  # seconds for putting together the equilibria that were found by the time limit, for each of three steps


def solutions(
    problem: Problem | ExactProblem, *, time_limit: float | None = None, max_solutions: int | None = None
) -> Solutions:
    """All solutions of a problem, in exact arithmetic: an iterator over the pieces of the solution set.

    The set is a union of polyhedra, one for each choice of a state (at the lower bound, basic, at the upper bound) for
    every unknown. The pieces are the maximal ones of these: isolated solutions, and faces given by vertices, rays and
    lines, in fractions. All are verified, and once the iterator has ended, `complete` says whether they are proved to
    be all. The number of pieces, and the time, may double with each unknown. What has been found is kept, and given
    again by another loop.

    Parameters
    ----------
    problem : a Problem, whose doubles count as they are, or an ExactProblem. Of one with a game as its origin the
        payoffs count, as written or as their shortest decimals, and `equilibria` has the equilibria.
    time_limit : seconds after which to stop; by default there is no limit. max_solutions : how many pieces to stop at.

    Raises
    ------
    ProblemError, OptionError : for anything else.

    Examples
    --------
    >>> import lcpcli
    >>> found = lcpcli.solutions(lcpcli.Problem([[0, 1], [0, 0]], [-1, 0]))
    >>> for piece in found:
    ...     print([list(map(str, vertex)) for vertex in piece.vertices], [list(map(str, ray)) for ray in piece.rays])
    [['0', '1']] [['0', '1']]
    [['0', '1']] [['1', '0']]
    >>> found
    <Solutions: 2 pieces, all of them: (0, 1) + ray (0, 1); (0, 1) + ray (1, 0)>
    >>> len(list(found))
    2

    The source of the method for games is in `enumeration.best_replies`; the tree for other problems cuts a branch only
    where a row of an integer dictionary shows that it is empty, or that it lies in a piece found before.
    """
    options.check((TIME_LIMIT, MAX_SOLUTIONS), {"time_limit": time_limit, "max_solutions": max_solutions})
    data = problem if isinstance(problem, ExactProblem) else ExactProblem.of_floats(as_problem(problem))
    return Solutions(data, TIME_LIMIT.value if time_limit is None else time_limit, max_solutions)


class Solutions(Iterator[Piece]):
    """The pieces of a solution set, as they are found; iterating again gives the same ones, without another search.

    problem : the problem, in exact arithmetic. pieces : those found so far. complete : whether they are proved to be
    all. equilibria : those of a game, once the first piece has been asked for; else None.
    """

    def __init__(self, problem: ExactProblem, time_limit: float, most: int | None) -> None:
        origin = problem.problem.origin
        self._game = origin if isinstance(origin, Game) else None
        self.problem = problem if self._game is None else ExactProblem.of_decimals(problem.problem)
        self._blocks = sorted(blocks(self.problem), key=len)
        if self._game is None and len(self._blocks[-1]) > LARGEST:
            fault = f"has {len(self._blocks[-1])} unknowns that depend on each other"
            raise ProblemError("M", fault, f"all solutions are listed up to {LARGEST}; lcp solve finds one")
        self.pieces: list[Piece] = []
        self.complete = False
        self.equilibria: Equilibria | None = None
        self._time_limit, self._most, self._deadline = time_limit, most, math.inf
        self._search = self._started()

    def __iter__(self) -> Iterator[Piece]:
        """From the first piece on: those found so far, then further ones."""
        for i in count():
            if i == len(self.pieces) and next(self, None) is None:
                return
            yield self.pieces[i]

    def __repr__(self) -> str:
        pieces = [str(piece) for piece in self.pieces[:SHOWN]] + ["..."] * (len(self.pieces) > SHOWN)
        known = "all of them" if self.complete else "not known to be all"
        return f"<Solutions: {counted(len(self.pieces), 'piece')}, {known}{': ' * bool(pieces)}{'; '.join(pieces)}>"

    def __next__(self) -> Piece:
        if len(self.pieces) == self._most:
            raise StopIteration
        try:
            piece = next(self._search)
        except TimeIsUp:
            raise StopIteration from None
        self.pieces.append(piece)
        return piece

    def stop(self) -> None:
        """End the search at the next step, as after the time limit; signal handlers may call it at any time."""
        self._deadline = -math.inf

    @property
    def points(self) -> list[Point]:
        """Each isolated solution, and each vertex of a piece, once."""
        return list(dict.fromkeys(vertex for piece in self.pieces for vertex in piece.vertices))

    def _started(self) -> Iterator[Piece]:
        self._deadline = min(self._deadline, clock.seconds() + self._time_limit)
        if self._game is not None:
            self.equilibria = equilibria(*self._game.payoffs(), self._check)
            yield from pieces_of(self.equilibria, self._game, self.problem, self._check)
            self.complete = self.equilibria.complete
        else:
            yield from self._products()
            self.complete = True

    def _products(self) -> Iterator[Piece]:
        """All combinations of the pieces of the blocks, those of the largest block as they are found."""
        data, parts = self.problem, self._blocks
        found: list[list[Piece]] = []
        for indices in parts[:-1]:
            found.append(list(pieces(restricted(data, indices), self._check, self._deadline)))
            if not found[-1]:
                return
        last = data if not found else restricted(data, parts[-1])
        for piece in pieces(last, self._check, self._deadline):
            for others in product(*found):
                yield combined([*others, piece], parts, data.n, self._check) if others else piece

    def _check(self) -> None:
        """Raise TimeIsUp after the deadline, and then once more after the time for putting together what was found."""
        now = clock.seconds()
        if now > self._deadline:
            self._deadline = now + min(ENDING, self._time_limit)
            raise TimeIsUp
