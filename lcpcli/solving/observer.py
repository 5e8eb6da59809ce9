"""Somebody looks on while a method runs: what it has come to is told by the clock, not by the iterate."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

INTERVAL = 0.2  # seconds between two tellings

Observe = Callable[[str, int, float, float], None]


class Observer:
    """Passes on how a run goes, at most every INTERVAL seconds.

    tell : called with the method at work, the number k of the last iterate, the bound of its relative residual that
        the driver goes by, infinite where there is none yet, and the seconds since the observer was made.
    """

    def __init__(self, tell: Observe, method: str) -> None:
        self._tell = tell
        self._seen = method, 0, math.inf
        self._began = time.monotonic()
        self._due = self._began + INTERVAL

    def saw(self, method: str, k: int, bound: float) -> None:
        """Take note of one more iterate."""
        self._seen = method, k, bound
        self.look()

    def look(self) -> None:
        """Tell what was seen last, if it is time; called also while a long step is going on."""
        now = time.monotonic()
        if now >= self._due:
            self._due = now + INTERVAL
            self._tell(*self._seen, now - self._began)
