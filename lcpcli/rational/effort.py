"""How much work exact arithmetic may do, counted rather than timed: the same input gives the same output everywhere."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

from lcpcli.interrupts import TimeIsUp, remaining
from lcpcli.rational.exact_problem import ExactProblem

# What a pivot on n rows usually takes, in seconds, for each of n^2 entries, and for each of their bits and rows.
OF_ENTRY, OF_BIT = 2e-7, 6e-10


class Effort:
    """Work that may be done, in the seconds that it takes on a usual machine, and what has been `spent` of it; besides,
    the time limit of the run holds."""

    def __init__(self, seconds: float = math.inf) -> None:
        self._most, self.spent = seconds, 0.0

    def allows(self, seconds: float = 0.0) -> bool:
        """Return whether so much work may still be done."""
        return self.spent + seconds <= self._most and seconds < remaining()

    def spend(self, seconds: float) -> None:
        """Count work; raise TimeIsUp if that is more than there was, or when the time is up."""
        self.spent += seconds
        if not self.allows():
            raise TimeIsUp

    def steps(self, data: ExactProblem) -> Callable[[], None]:
        """Return a function to call before each pivot on a tableau of these data, which counts it."""
        return partial(self.spend, data.n**2 * (OF_ENTRY + OF_BIT * data.n * data.bits))
