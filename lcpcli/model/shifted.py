"""A mixed problem with its reference point moved to 0: no digits are spent on where the bounds lie."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcpcli.model.box import LARGEST_X, moved
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector


@dataclass(frozen=True, eq=False)
class Shifted:
    """The problem of M, M z + q and l - z <= z' <= u - z for the reference point z, with the way back."""

    problem: Problem
    given: Problem

    def start(self, x: Vector) -> Vector:
        """x of the shifted problem."""
        return x if self.given.reference_z is None else x - self.given.reference_z / 2

    def back(self, x: Vector) -> Vector:
        """x of the given problem; what is at a bound stays there."""
        box, given, there = self.problem.box, self.given, self.given.reference_z
        assert there is not None
        z = box.z_of(x)
        inside = np.where(z == self.problem.upper, given.upper, z + there)
        at = np.where(z == self.problem.lower, given.lower, inside)
        return np.clip(0.5 * (at - (z - 2 * x)), -LARGEST_X, LARGEST_X)

    @property
    def is_exact(self) -> bool:
        """Whether it is certain that nothing was rounded."""
        return self.given.has_small_integers

    def multipliers(self, y: Vector) -> Vector:
        """Farkas' y for the given problem."""
        return y

    def residual(self, F: Vector) -> Vector:
        """F of the given problem."""
        return F


def shifted(given: Problem) -> Shifted:
    """The problem, where the reference point is not 0; M is shared."""
    there = given.reference_z
    assert there is not None
    with np.errstate(over="ignore"):
        bounds = [moved(bound - there, bound) for bound in (given.lower, given.upper)]
    return Shifted(Problem(given.M, given.q_ref, lower=bounds[0], upper=bounds[1]), given)
