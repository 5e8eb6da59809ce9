"""When a run gives up, and the tolerance it has to reach."""

from __future__ import annotations

from dataclasses import dataclass

from lcpcli import options
from lcpcli.options import LIMITS, MAX_ITERATIONS, TIME_LIMIT, TOL


@dataclass(frozen=True)
class Limits:
    """When to stop: at a relative residual of tol, after max_iterations, after time_limit seconds.

    Raises OptionError if one is out of range.

    >>> Limits(time_limit=60)
    Limits(tol=1e-10, max_iterations=10000, time_limit=60)
    """

    tol: float = TOL.value
    max_iterations: int = int(MAX_ITERATIONS.value)
    time_limit: float = TIME_LIMIT.value

    def __post_init__(self) -> None:
        options.check(LIMITS, vars(self))


DEFAULTS = Limits()
