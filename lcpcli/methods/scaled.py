"""The iterates of a method on a scaled problem, in the units of the original one."""

from __future__ import annotations

import numpy as np

from lcpcli.methods.iterate import Iterate, Stage, advance
from lcpcli.model.scaled import Scaled


def in_original_units(units: Scaled, stage: Stage) -> Stage:
    """The stage with x and F of the original problem."""
    while True:
        step = advance(stage)
        if not isinstance(step, Iterate):
            return step
        with np.errstate(over="ignore"):
            F = None if step.F is None else step.F / units.R
        yield step._replace(x=units.back(step.x), F=F)
