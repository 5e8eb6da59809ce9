"""What a method hands to the loop: its iterates one after the other, and in the end how it ended."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import TypeAlias, TypeVar

from lcpcli.typing import Vector
from lcpcli.verify.certificate import Certificate


@dataclass(frozen=True, eq=False)
class Iterate:
    """One iterate of a method that works on F(x) = M z - w + q with z = |x| + x.

    x : shape (n,), an array of its own that the method never changes again.
    F : shape (n,) or None; F or its smoothed form at x if the method has it anyway. Where it is F itself,
        |min(z, M z + q)| <= |F| componentwise, so that the loop need not compute the residual of every iterate.
    step : the step of the published algorithm that made this iterate, as numbered there; "" if it has but one.
    evaluations : evaluations of F (or of its smoothed form) so far; principal systems solved for pivoting methods.
    method : which method made it, where several take turns; "" if there is but one.
    signs_final : False where the method knows that a next step would correct signs that are wrong beyond rounding: an
        iterate within the tolerance may then not be the solution to the last digits.
    """

    x: Vector
    F: Vector | None
    step: str
    evaluations: int
    method: str = ""
    signs_final: bool = True


@dataclass(frozen=True)
class Finished:
    """The method has come to its end: what its last iterate leaves of its equation is rounding.

    method : of this and the other endings, which method ended, where several take turns; "" if there is but one.
    """

    method: str = ""


@dataclass(frozen=True)
class Stalled:
    """The method makes no further progress in double precision, for a reason, a clause for the user."""

    reason: str
    method: str = ""


@dataclass(frozen=True)
class OutOfTime:
    """The method has used up the time that it was given; the reason says what it has not settled."""

    reason: str
    method: str = ""


@dataclass(frozen=True)
class Breakdown:
    """The method cannot go on, for a reason, a clause for the user."""

    reason: str
    method: str = ""


@dataclass(frozen=True)
class NoSolution:
    """The method has found that there is no solution, or where it must give up, as the certificate says."""

    certificate: Certificate
    method: str = ""


Ending: TypeAlias = Finished | Stalled | OutOfTime | Breakdown | NoSolution
Stage: TypeAlias = Generator[Iterate, None, Ending]
"""A method at work: a generator of the iterates after the start, which returns how it ended."""


Item = TypeVar("Item")
End = TypeVar("End")


def advance(stage: Generator[Item, None, End]) -> Item | End:
    """The next iterate of a stage or, after the last one, how it ended."""
    try:
        return next(stage)
    except StopIteration as end:
        ending: End = end.value
        return ending


def ended(ending: Ending) -> Stage:
    """A stage that ends before its first iterate."""
    return ending
    yield


def limited(stage: Stage, most: int) -> Stage:
    """A stage that stalls after so many iterates."""
    for _ in range(most):
        step = advance(stage)
        if not isinstance(step, Iterate):
            return step
        yield step
    return Stalled(f"{most} iterations have not been enough")
