"""Methods that take turns on one problem: iterates carry their method's name, and evaluations add up."""

from __future__ import annotations

from dataclasses import replace

from lcpcli.methods.iterate import FAULTS, Breakdown, Iterate, Stage, advance, told
from lcpcli.typing import Vector


class Turns:
    """The turns taken so far. last : the newest iterate, or the start."""

    def __init__(self, x0: Vector) -> None:
        self.last = Iterate(x0, None, "", 0)

    def take(self, method: str, stage: Stage) -> Stage:
        """One turn of a method, which may itself consist of named methods; FAULTS are breakdowns."""
        done = self.last.evaluations
        while True:
            try:
                step = advance(stage)
            except FAULTS as fault:
                return Breakdown(told(fault), method)
            if not isinstance(step, Iterate):
                return replace(step, method=step.method or method)
            x, F, how, evaluations, name, final = step
            self.last = Iterate(x, F, how, done + evaluations, name or method, final)
            yield self.last
