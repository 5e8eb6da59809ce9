"""When a run gives up, and what it must reach."""

from __future__ import annotations

from dataclasses import dataclass

from lcpcli import options
from lcpcli.options import OPTIONS


@dataclass(frozen=True)
class Limits:
    """When to stop: at a relative residual of tol, after max_iterations, after time_limit seconds.

    Raises OptionError where one is out of its range.

    >>> from lcpcli import Limits
    >>> Limits(time_limit=60)
    Limits(tol=1e-10, max_iterations=10000, time_limit=60)
    """

    tol: float = float(OPTIONS["tol"].default or 0)
    max_iterations: int = int(OPTIONS["max_iterations"].default or 0)
    time_limit: float = float(OPTIONS["time_limit"].default or 0)

    def __post_init__(self) -> None:
        options.check(tol=self.tol, max_iterations=self.max_iterations, time_limit=self.time_limit)
