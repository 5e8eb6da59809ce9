"""The iterates of a method on a scaled problem, in the units of the original one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from lcpcli.methods.iterate import Iterate
from lcpcli.model.scaled import Scaled


def in_original_units(units: Scaled, iterates: Iterator[Iterate]) -> Iterator[Iterate]:
    """The iterates with x and F of the original problem."""
    for iterate in iterates:
        with np.errstate(over="ignore"):
            F = None if iterate.F is None else iterate.F / units.R
        yield replace(iterate, x=units.back(iterate.x), F=F)
