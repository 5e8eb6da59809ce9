"""Reports the progress of a run to an observer, at intervals of time rather than of iterates."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

INTERVAL = 0.2  # seconds between two reports

Observe = Callable[[str, int, float, float], None]


class Observer:
    """Reports how a run is going, at most every INTERVAL seconds.

    report : called with the method at work, the number k of the last iterate, the bound on its relative residual that
        the loop uses, infinite if there is none yet, and the seconds since the observer was made.
    """

    def __init__(self, report: Observe, method: str) -> None:
        self._report = report
        self._seen = method, 0, math.inf
        self._began = time.monotonic()
        self._due = self._began + INTERVAL

    def note(self, method: str, k: int, bound: float) -> None:
        """Note one more iterate."""
        self._seen = method, k, bound
        self.report_if_due()

    def report_if_due(self) -> None:
        """Report what was noted last, if it is time; also called during a long step."""
        now = time.monotonic()
        if now >= self._due:
            self._due = now + INTERVAL
            self._report(*self._seen, now - self._began)
