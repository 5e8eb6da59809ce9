"""A trace of the x of iterates, which z does not tell: z = |x| + x is 0 wherever x <= 0."""

from __future__ import annotations

from dataclasses import dataclass, field

from lcpcli.solving.trace import Trace
from lcpcli.typing import Vector
from lcpcli.verify.point import Criterion


@dataclass(repr=False)
class PathTrace(Trace):
    """A trace that also has the x = (z - w) / 2 of its rows; x_of : by the numbers of iterates, among them those of all
    rows."""

    x_of: dict[int, Vector] = field(default_factory=dict)

    def _measure(self, criterion: Criterion) -> None:
        self.x_of |= {waiting.k: waiting.x for waiting in self._waiting}
        super()._measure(criterion)
