"""Who sees the iterates of a run. A run that nobody sees loads no more than this."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

if TYPE_CHECKING:
    from lcpcli.solving.trace import Callback, Trace


Observe: TypeAlias = Callable[[str, int, float, float], None]
"""What is called with the method at work, the number k of the last iterate, the bound
on its relative residual that the loop uses, infinite if there is none yet, and the
seconds since the loop was made."""


class Seen(NamedTuple):
    """Who sees the iterates of a run: a trace and a curve, which keep them, an observer
    of the progress, and a callback, which is called after each iterate."""

    traces: tuple[Trace | None, Trace | None] = (None, None)
    observe: Observe | None = None
    callback: Callback | None = None


NOBODY = Seen()
