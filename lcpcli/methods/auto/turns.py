"""Methods that take turns on one problem: iterates carry their method's name, and evaluations add up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

from lcpcli.methods.iterate import FAULTS, Breakdown, Iterate, Stage, advance, told
from lcpcli.methods.transformed import in_given_variables
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector


class Turns:
    """The turns taken so far. last : the newest iterate, or the start, after as many evaluations as given."""

    def __init__(self, x0: Vector, evaluations: int = 0) -> None:
        self.last = Iterate(x0, None, "", evaluations)

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


Search: TypeAlias = Callable[..., Stage]
"""Methods that take turns on a problem, called with it and with the turns, from whose last iterate they start."""


def from_reference(problem: Problem, x0: Vector, search: Search) -> Stage:
    """A search in the variables in which the reference point of the problem is 0."""
    if problem.reference_z is None:
        return search(problem, Turns(x0))
    from lcpcli.model.changes import shifted

    change = shifted(problem)
    return in_given_variables(change, search(change.problem, Turns(change.start(x0))))
