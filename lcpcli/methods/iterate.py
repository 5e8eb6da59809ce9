"""What a method hands to the driver, and how it says that it cannot go on."""

from __future__ import annotations

from dataclasses import dataclass

from lcpcli.typing import Vector
from lcpcli.verify.certificate import Certificate


@dataclass(frozen=True, eq=False)
class Iterate:
    """One iterate of a method that works on F(x) = M z - w + q with z = |x| + x.

    x : shape (n,), an array of its own that the method never changes again.
    F : shape (n,) or None; F or its smoothed form at x if the method has it anyway. Where it is F itself,
        |min(z, M z + q)| <= |F| componentwise, so that the driver need not compute the residual of every iterate.
    step : the step of the published algorithm that made this iterate, as numbered there; "" if it has but one.
    evaluations : evaluations of F (or of its smoothed form) so far; principal systems solved for pivoting methods.
    method : which method made it, where several take turns; "" if there is but one.
    settled : False where the method knows that a next step would mend signs that are wrong beyond rounding: an iterate
        within the tolerance may then not be the solution to the last digits.
    """

    x: Vector
    F: Vector | None
    step: str
    evaluations: int
    method: str = ""
    settled: bool = True


class Ending(Exception):
    """A method ends here. `method` says which, where several take turns."""

    method = ""


class Breakdown(Ending):
    """The method cannot go on; the argument is the reason, as a clause for the user."""


class NoSolution(Ending):
    """The method has found out that there is no solution, or where it must give up; the argument is the Certificate."""

    def __init__(self, certificate: Certificate) -> None:
        super().__init__(certificate.statement)
        self.certificate = certificate


class Stalled(Ending):
    """The method has got as far as rounding lets it; the argument says what holds it there.

    evaluations : how many evaluations it has cost to find that out.
    """

    def __init__(self, reason: str, evaluations: int = 0) -> None:
        super().__init__(reason)
        self.evaluations = evaluations


class OutOfTime(Stalled):
    """The method has used up the time that it was given."""
