"""All solutions of a problem: `lcpcli.solutions`.

The connected components of M are searched one by one (`pieces`), and their pieces are
combined; a search stops when all pieces are known, or at a limit.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from copy import copy
from itertools import tee
from typing import Any

import numpy as np

from lcpcli import clock, options
from lcpcli.clock import imports
from lcpcli.enumeration.meaning import Arrangement, meaning_of, vertices_of
from lcpcli.enumeration.pieces import Piece, combined, pieces
from lcpcli.errors import ProblemError, count
from lcpcli.interrupts import TimeIsUp, deadline_after, raise_if_timed_out
from lcpcli.linalg import matrices
from lcpcli.model.problem import Problem, as_problem
from lcpcli.rational.dictionary import RationalPoint
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.written import exact_data
from lcpcli.verify.error_theorems import semidefinite_by_rounding

# The largest connected component of M: a search in a larger one would practically never
# finish.
MAX_BLOCK_UNKNOWNS = 500
SHOWN_PIECES = 4  # pieces that are printed, so that they fit on a few lines
# The pieces are proved to be all; it is proved that there are none.
COMPLETE, UNSOLVABLE = "complete", "unsolvable"
# The limit that ended the search.
ENOUGH = "max_solutions"
TIME_LIMIT = "time_limit"
INTERRUPTED = "interrupted"
UNLISTED = {
    ENOUGH: ", as many as requested",
    TIME_LIMIT: " by the time limit",
    INTERRUPTED: " before the search was interrupted",
}
# Added to a proved statement that depends on the rounding of entries of M.
ROUNDED = (
    " for the numbers as stored, which are rounded: up to that, M is positive "
    "semidefinite"
)
OTHERS_WORDING = {True: "there are others", None: "there may be others"}
# Steps of the search for one more piece than requested, if the requested ones took
# fewer.
MIN_FURTHER_STEPS = 1000


@np.errstate(all="ignore")
def solutions(
    problem: Problem | ExactProblem,
    *,
    time_limit: float | None = None,
    max_solutions: int | None = None,
) -> Solutions:
    """Find all solutions of a problem, in exact arithmetic: return an iterator over the
    pieces of the solution set.

    The set is a union of polyhedra, one for each choice of a basis status (at the lower
    bound, basic, at the upper bound) for every unknown. The pieces are the maximal
    polyhedra among these: isolated solutions, and faces described by vertices, rays and
    lines, in fractions. All are verified. Once the iterator has ended, `complete` says
    whether the list is proved to be complete, and `others`, if that is known, whether
    there are other pieces. The number of pieces, and the time, may double with each
    unknown. The pieces are stored, and a second loop yields them again.

    Parameters
    ----------
    problem : a Problem, whose numbers are taken as written, those of arrays as their
        shortest decimals unless they have too many digits; or an ExactProblem. If its
        origin is a game or a game tree, the payoffs are used, as written or as their
        shortest decimals; `equilibria` then has the equilibria of a game.
    time_limit : seconds after which to stop; by default there is no limit.
    max_solutions : the largest number of pieces to list; by default there is no limit.

    Raises
    ------
    ProblemError, OptionError : a parameter is of the wrong kind, or out of range.

    Examples
    --------
    >>> import lcpcli
    >>> pieces = lcpcli.solutions(lcpcli.Problem([[0, 1], [0, 0]], [-1, 0]))
    >>> in_text = lambda vectors: [list(map(str, vector)) for vector in vectors]
    >>> for piece in pieces:
    ...     print(in_text(piece.vertices), in_text(piece.rays))
    [['0', '1']] [['1', '0']]
    [['0', '1']] [['0', '1']]
    >>> pieces
    <Solutions: 2 pieces, all of them: (0, 1) + ray (1, 0); (0, 1) + ray (0, 1)>
    >>> len(list(pieces))
    2

    The search is a tree over the basis statuses, which cuts a branch only where a row
    of an integer dictionary shows that it is empty, or that it lies in a known piece.
    The pieces of a game in which a player has few strategies are combinations of the
    vertices of two polyhedra, which are all enumerated before the first combination: at
    once if they are few, and otherwise if the search in the tree does not end soon.
    """
    explicit_options = {"time_limit": time_limit, "max_solutions": max_solutions}
    options.check((options.TIME_LIMIT, options.MAX_SOLUTIONS), explicit_options)
    limit = options.TIME_LIMIT.value if time_limit is None else time_limit
    return Solutions(in_exact_numbers(problem), limit, max_solutions)


def in_exact_numbers(problem: Problem | ExactProblem) -> ExactProblem:
    """Return a problem in exact numbers, unless it has them: those as written, or its
    doubles if these have so many digits that nobody wrote them. Raises ProblemError if
    `refuse_large` does.
    """
    data = problem if isinstance(problem, ExactProblem) else None
    rounded = as_problem(problem) if data is None else data.problem
    refuse_large(rounded)
    return exact_data(rounded) if data is None else data


def refuse_large(problem: Problem) -> None:
    """Raise ProblemError if M has a connected component with more than
    MAX_BLOCK_UNKNOWNS unknowns.
    """
    if problem.n <= MAX_BLOCK_UNKNOWNS:
        return
    with imports:
        from scipy.sparse.csgraph import connected_components

        from lcpcli.methods.bimatrix import costs
    if costs(problem) is not None:  # a first solution is computed fast
        return
    _, part = connected_components(matrices.compressed(problem.M != 0), directed=False)
    if (unknowns := int(np.bincount(part).max())) > MAX_BLOCK_UNKNOWNS:
        reason = f"has {unknowns} unknowns that depend on each other"
        raise ProblemError(
            "M",
            reason,
            f"all solutions are listed up to {MAX_BLOCK_UNKNOWNS}; lcp solve finds one",
        )


class Solutions(Iterator[Piece]):
    """The pieces of a solution set, as they become known; iterating again yields the
    same ones, without another search.

    problem : the problem, in exact arithmetic. pieces : the pieces known so far, none
        of which lies in another piece of the set. complete : whether they are proved to
        be all of the pieces. others : whether there are others; None if that is not
        known.

    Once `max_solutions` are known, the search for one more takes up to about as many
    steps again. A copy, for instance by pickle, has the pieces known when it was made,
    and no others.
    """

    def __init__(
        self,
        problem: ExactProblem,
        time_limit: float,
        max_pieces: int | None,
        effort: Effort | None = None,
    ) -> None:
        self.problem, self.meaning = problem, meaning_of(problem)
        self._blocks = self.problem.blocks
        self.pieces: list[Piece] = []
        self.others: bool | None = None
        self._time_limit = time_limit
        self._max_pieces = max_pieces
        self._deadline = math.inf
        self._steps, self._last = 0, math.inf
        self._spend = (effort or Effort()).steps(self.problem)
        self._search = self._started()

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_search": iter(())}

    def __iter__(self) -> Iterator[Piece]:
        """Iterate from the first piece on: over the pieces known so far, then over
        further ones.
        """
        i = 0
        while i < len(self.pieces) or next(self, None) is not None:
            yield self.pieces[i]
            i += 1

    def __repr__(self) -> str:
        pieces = [str(piece) for piece in self.pieces[:SHOWN_PIECES]]
        if len(self.pieces) > SHOWN_PIECES:
            pieces.append("...")
        completeness = {
            False: "all of them",
            True: "not all",
            None: "as far as the search has come",
        }[self.others]
        number = count(len(self.pieces), "piece")
        listing = f": {'; '.join(pieces)}" if pieces else ""
        return f"<Solutions: {number}, {completeness}{listing}>"

    def __next__(self) -> Piece:
        enough = len(self.pieces) == self._max_pieces
        if enough:
            if self._last < math.inf:
                raise StopIteration
            self._last = self._steps + max(self._steps, MIN_FURTHER_STEPS)
        if not self._steps:  # the search begins
            self._deadline = min(self._deadline, clock.seconds() + self._time_limit)
        try:
            with deadline_after(self._deadline - clock.seconds()):
                piece = next(self._search)
        except TimeIsUp:
            raise StopIteration from None
        if enough:
            self.others = True
            raise StopIteration
        self.pieces.append(piece)
        return piece

    def stop(self) -> None:
        """Stop the search at the next step, as at the time limit; signal handlers may
        call it at any time.
        """
        self._deadline = -math.inf

    @property
    def complete(self) -> bool:
        """Return whether the pieces are proved to be all of them."""
        return self.others is False

    @property
    def points(self) -> list[RationalPoint]:
        """Return each isolated solution, and each vertex of a piece, once."""
        return vertices_of(self.pieces)

    @property
    def equilibria(self) -> Any:
        """Return the equilibria of a game in the pieces known so far; None for other
        problems."""
        return self.arranged().equilibria

    def equilibrium(self, z: RationalPoint) -> Any:
        """Return the equilibrium of a game that a vertex of a piece represents; None
        for other problems.
        """
        return self.meaning.equilibrium(z)

    def arranged(self) -> Arrangement:
        """Return the pieces known so far in the order in which they are shown."""
        return self.meaning.arranged(self.pieces, self.complete)

    def _started(self) -> Iterator[Piece]:
        """Yield the pieces: the combinations of those of the connected components."""
        data, parts = self.problem, self._blocks
        searches = []
        for indices in parts:
            self._check()
            part = data.part(indices) if len(parts) > 1 else data
            searches.append(tee(pieces(part, self._check), 1)[0])
        if all(next(copy(search), None) is not None for search in searches):
            for chosen in _combinations(searches):
                piece = (
                    chosen[0]
                    if len(parts) == 1
                    else combined(chosen, parts, data.n, self._check)
                )
                self.meaning.take(piece.vertices, self._check)
                yield piece
        self.others = False

    def _check(self) -> None:
        """Count a step; raise TimeIsUp after the deadline or the last step, or when the
        effort is used up.
        """
        raise_if_timed_out()
        self._steps += 1
        self._spend()
        if self._steps > self._last or clock.seconds() > self._deadline:
            raise TimeIsUp


def _combinations(searches: Sequence[Iterator[Piece]]) -> Iterator[tuple[Piece, ...]]:
    """Yield all combinations of the pieces that some searches find, each at least one.
    The searches are copied, so that each computes no more pieces than are needed;
    the piece of the last search changes last.
    """
    remaining = [copy(search) for search in searches]
    chosen = [next(each) for each in remaining]
    while True:
        yield tuple(chosen)
        for k, search in enumerate(searches):
            piece = next(remaining[k], None)
            if piece is not None:
                chosen[k] = piece
                break
            remaining[k] = copy(search)
            chosen[k] = next(remaining[k])
        else:
            return


class SolutionSet:
    """The solutions that a search has computed, in the order in which they are shown.

    arranged : their pieces, and what these mean.
    status : COMPLETE, UNSOLVABLE, or the limit that ended the search. seconds : the
        time of the search.
    """

    def __init__(self, search: Solutions, ended: str, seconds: float) -> None:
        self.data = search.problem
        self.complete = search.complete
        self.others = search.others
        self.seconds = seconds
        self.meaning, self.arranged = search.meaning, search.arranged()
        self.pieces = self.arranged.pieces
        self.status = ended
        if self.complete:
            self.status = COMPLETE if self.pieces else UNSOLVABLE

    @property
    def count(self) -> str:
        """Return how many solutions, or equilibria, are known, in words."""
        return self.arranged.count() + ("" if self.complete else " found")

    @property
    def message(self) -> str:
        """Return the outcome in one sentence."""
        if self.status == UNSOLVABLE:
            with imports:
                from lcpcli.enumeration.meaning import meaning_of
            sentence = (
                "no solution: every complementary basis is excluded in rational "
                "arithmetic"
            )
            means = meaning_of(self.data).without_solution(None)
            return sentence if means is None else f"{sentence}; {means.statement}"
        if not self.complete:
            others = OTHERS_WORDING[self.others] if self.pieces else "there may be some"
            return (
                f"{self.count if self.pieces else 'no solution is known'}"
                f"{UNLISTED[self.status]}; "
                f"{others}"
            )
        isolated = all(piece.is_point for piece in self.pieces)
        rounded = ROUNDED if hangs_on_rounding(self.data) else ""
        if isolated and len(self.pieces) == 1:
            return f"{self.count}, proved to be the only one{rounded}"
        all_isolated = ", all isolated" if isolated else ""
        return f"{self.count}{all_isolated}, proved to be all{rounded}"


def hangs_on_rounding(data: ExactProblem) -> bool:
    """Return whether the data are rounded numbers whose rounding decides whether M is
    positive definite: proved statements about them may then not hold for the data
    before rounding.
    """
    by_rounding = semidefinite_by_rounding(data.problem.M) is not None
    return by_rounding and data.are_doubles()
