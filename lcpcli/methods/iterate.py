"""What a method hands to the loop: its iterates one by one, and finally how it ended."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias, TypeVar

from lcpcli.typing import Vector
from lcpcli.verify.certificate import Certificate


class Iterate(NamedTuple):
    """One iterate of a method that works on F(x) = M z - w + q with z = |x| + x.

    x : shape (n,), a separate array that the method never modifies again.
    F : shape (n,) or None; F or its smoothed form at x if the method has computed it. If it is F itself,
        |min(z, M z + q)| <= |F| componentwise, which saves the loop computing the residual of every iterate.
    step : the step of the published algorithm that produced this iterate, as numbered there; "" if it has only one.
    evaluations : evaluations of F (or of its smoothed form) so far; principal systems solved for pivoting methods.
    method : which method produced it, if several take turns; "" if there is only one.
    signs_final : False if the method knows that a next step would correct signs that are violated beyond rounding: an
        iterate within the tolerance may then not be accurate to the last digits.
    """

    x: Vector
    F: Vector | None
    step: str
    evaluations: int
    method: str = ""
    signs_final: bool = True


@dataclass(frozen=True)
class _Ended:
    """reason : a clause for the user; "" if the kind of ending says it all.
    method : which method ended, where several take turns; "" if there is only one.
    """

    reason: str = ""
    method: str = ""


class Finished(_Ended):
    """The method is complete: its last iterate satisfies its equation up to rounding."""


class Stalled(_Ended):
    """The method makes no further progress in double precision."""


class OutOfTime(_Ended):
    """The method has used up the time that it was given; the reason says what is left undecided."""


class Breakdown(_Ended):
    """The method cannot continue."""


@dataclass(frozen=True)
class NoSolution:
    """The method has found that there is no solution, or has to give up, as the certificate says."""

    certificate: Certificate
    method: str = ""


Ending: TypeAlias = Finished | Stalled | OutOfTime | Breakdown | NoSolution
Stage: TypeAlias = Generator[Iterate, None, Ending]
"""A running method: a generator of the iterates after the start, which returns how it ended."""


FAULTS = (FloatingPointError, MemoryError)
"""What a running method may raise when it cannot continue."""
KINDS = {  # of FloatingPointError, by how numpy's message begins
    "overflow": "an overflow of double precision",
    "divide": "a division by zero",
    "invalid": "an operation on infinite numbers that has no result",
}

Item = TypeVar("Item")
End = TypeVar("End")


def advance(stage: Generator[Item, None, End]) -> Item | End:
    """The next iterate of a stage or, after the last one, how it ended."""
    try:
        return next(stage)
    except StopIteration as end:
        ending: End = end.value
        return ending


def told(fault: FloatingPointError | MemoryError) -> str:
    """One of FAULTS as a clause for the user."""
    if isinstance(fault, MemoryError):
        return "there is not enough memory"
    return next((kind for message, kind in KINDS.items() if str(fault).startswith(message)), str(fault))


def ended(ending: Ending) -> Stage:
    """A stage that ends before its first iterate."""
    return ending
    yield


def limited(stage: Stage, max_iterations: int) -> Stage:
    """The stage, stalled after max_iterations iterates."""
    for _ in range(max_iterations):
        step = advance(stage)
        if not isinstance(step, Iterate):
            return step
        yield step
    return Stalled(f"{max_iterations} iterations were not enough")
