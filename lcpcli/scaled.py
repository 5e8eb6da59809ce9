"""A problem in the units in which it is equilibrated, and the way back."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from lcpcli import linalg
from lcpcli.methods.iterate import Iterate
from lcpcli.problem import Problem
from lcpcli.scaling import equilibrate
from lcpcli.typing import Vector


@dataclass(frozen=True, eq=False)
class Scaled:
    """LCP(R M C, R q) for a problem, with the way back: z = C z', w = w' / R, and F = F' / R.

    Where R and C are powers of two, nothing is rounded on either way.
    """

    problem: Problem
    R: Vector
    C: Vector

    def start(self, x: Vector) -> Vector:
        """x = (z - w) / 2 of the problem in scaled units."""
        return np.maximum(x, 0) / self.C + np.minimum(x, 0) * self.R

    def iterates(self, scaled: Iterator[Iterate]) -> Iterator[Iterate]:
        """The iterates of a method on the scaled problem in the units of the original one."""
        for iterate in scaled:
            x = np.maximum(iterate.x, 0) * self.C
            x += np.minimum(iterate.x, 0) / self.R
            yield replace(iterate, x=x, F=None if iterate.F is None else iterate.F / self.R)


def scale(problem: Problem) -> Scaled:
    """The equilibrated problem; M is copied once."""
    R, C = equilibrate(problem.M, problem.q)
    return Scaled(Problem(linalg.scaled(problem.M, R, C), R * problem.q), R, C)
