"""How a solve ended, and what exact arithmetic proves about a problem."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from fractions import Fraction


class Status(Enum):
    """How a solve ended. The value is for users; `word` is for JSON and scripts.

    SOLVED : the relative residual, recomputed from M and q, is at most the tolerance.
    ITERATION_LIMIT, TIME_LIMIT : stopped by a limit.
    STALLED : the method makes no further progress in double precision, or its claim fails verification.
    DIVERGED : the iterates diverge.
    BREAKDOWN : the method cannot continue, for instance because a matrix is singular.
    INFEASIBLE : proved to have no z >= 0 with M z + q >= 0 or, with bounds, no z within them whose w has the signs that
        they require; the certificate holds the Farkas vector.
    UNSOLVABLE : proved to have no solution, as every complementary set is excluded.
    ILL_POSED : the problem in doubles has a solution, too large to satisfy the tolerance, but a change of M within its
        rounding provably leaves none; the certificate holds the Farkas vector of that proof.
    RAY : Lemke's method ended on a ray, which proves nothing for this M.
    INTERRUPTED : ended by Ctrl-C, or by a callback.

    >>> from lcpcli import Status
    >>> [status.word for status in Status if status.has_no_solution]
    ['infeasible', 'unsolvable']
    """

    SOLVED = "solved"
    ITERATION_LIMIT = "stopped at the iteration limit"
    TIME_LIMIT = "stopped at the time limit"
    STALLED = "stalled"
    DIVERGED = "diverged"
    BREAKDOWN = "broke down"
    INFEASIBLE = "proved infeasible"
    UNSOLVABLE = "has no solution"
    ILL_POSED = "ill-posed"
    RAY = "ended on a ray"
    INTERRUPTED = "interrupted"

    @property
    def word(self) -> str:
        """Return the word for the status in JSON and scripts, its name in lower case."""
        return self.name.lower()

    def sentence(self, reason: str) -> str:
        """Return the sentence about a run with this status and reason; the reason is "" if the status says it all."""
        statement = Status.UNSOLVABLE.value if self is Status.INFEASIBLE else self.value
        return f"{statement}: {reason}" if reason else statement

    @property
    def has_no_solution(self) -> bool:
        """Return whether the problem is proved to have no solution."""
        return self in (Status.INFEASIBLE, Status.UNSOLVABLE)


class Exact(NamedTuple):
    """What rational arithmetic proves about a problem whose decimals are taken as written.

    status : solved, infeasible or unsolvable; None if nothing was proved.
    proof : how the status is proved, as a clause for the user.
    z, w : the solution and w = M z + q, each of length n, if it is solved; else None.
    y : of length n, a Farkas vector of integers, if it is infeasible; else None.
    """

    status: Status | None
    proof: str
    z: list[Fraction] | None = None
    w: list[Fraction] | None = None
    y: list[Fraction] | None = None
