"""The bounds l <= z <= u of a problem, and for them the change of variables: x with z = mid(l, u, 2x) and w = z - 2x.

For every x, z lies within its bounds and w has the signs that these ask for: w_i >= 0 where z_i < u_i and w_i <= 0
where z_i > l_i. For l = 0 and u infinite, z = |x| + x and w = |x| - x.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from lcpcli.linalg.doubles import LARGEST, largest
from lcpcli.typing import Indices, Mask, Matrix, Vector

LARGEST_X = LARGEST / 2  # |x| up to which z and w are finite


def in_range(x: Vector) -> bool:
    """Whether z and w of x are finite."""
    return largest(x) <= LARGEST_X


def moved(bound: Vector, given: Vector | float) -> Vector:
    """A bound in other variables, kept finite where the given one is."""
    return np.where(np.isfinite(given), np.clip(bound, -LARGEST, LARGEST), bound)


class Basis(NamedTuple):
    """The state of each variable in a basic solution.

    basic : where w_i = 0. upper : where z_i = u_i; None if nowhere. Elsewhere z_i = l_i. All of shape (n,).
    """

    basic: Mask
    upper: Mask | None = None

    def changes(self, other: Basis) -> int:
        """In how many states two differ."""
        differ = self.basic != other.basic
        if self.upper is not None:
            differ |= self.upper != other.upper
        return int(np.count_nonzero(differ))

    def part(self, rows: Indices) -> Basis:
        """Some rows, of states of shape (m, n)."""
        return Basis(self.basic[rows], None if self.upper is None else self.upper[rows])


class Orthant:
    """z >= 0: the bounds of a linear complementarity problem."""

    lower: float = 0.0
    upper: float = np.inf
    kinds: Mapping[str, int] = {}

    def z_of(self, x: Vector) -> Vector:
        """z = |x| + x = 2 max(x, 0)."""
        z: Vector = np.maximum(x, 0.0)
        z += z
        return z

    def reflected(self, x: Vector) -> Vector:
        """z - x = |x|."""
        return np.abs(x)

    def x_of(self, z: Vector, w: Vector) -> Vector:
        """The x = (z - w) / 2 with z = |x| + x and w = |x| - x, where z, w >= 0 and z'w = 0.

        If rounding leaves both of a pair nonzero, the smaller one is set to 0: z and w of a solution are then recovered
        unchanged, not each with the other's error.
        """
        return np.where(z > w, z, -w) / 2

    def x_within(self, z: Vector, w: Vector, basis: Basis) -> Vector:
        """The x of a basic solution, with violated signs set to 0."""
        return 0.5 * np.where(basis.basic, np.maximum(z, 0.0), np.minimum(-w, 0.0))

    def gaps(self, z: Vector, w: Vector, factor: Vector | float = 1.0) -> Vector:
        """min(z, w): the natural residual of each component; with z in other units, min(factor z, w)."""
        return np.minimum(z if isinstance(factor, float) else z * factor, w)

    def distances(self, z: Vector) -> tuple[Vector, Vector | None]:
        """z - l and z - u; None for no upper bound."""
        return z, None

    def basis_of(self, x: Vector) -> Basis:
        """The states that x stands for: basic where x > 0."""
        return Basis(x > 0.0)

    def nonbasic(self, basis: Basis) -> Vector:
        """z where it is not basic, 0 elsewhere."""
        return np.zeros(basis.basic.size)

    def violations(self, z: Vector, w: Vector, basis: Basis) -> Vector:  # noqa: ARG002
        """How far each component is from the signs that its state asks for; negative or 0 where it has them."""
        least: Vector = np.minimum(z, w)
        return np.negative(least, out=least)

    def wrong(self, z: Vector, w: Vector, basis: Basis) -> Mask:  # noqa: ARG002
        """Where a component has not the signs that its state asks for."""
        wrong: Mask = np.minimum(z, w) < 0.0
        return wrong

    def excess(self, z: Vector, w: Vector) -> Vector:
        """By how much w has another sign than an admissible z asks for."""
        return np.where(z > 0, np.abs(w), -w)

    def exchanged(self, basis: Basis, violated: Mask, z: Vector) -> Basis:  # noqa: ARG002
        """The states with those of the violated components exchanged."""
        return Basis(basis.basic ^ violated)

    def project(self, z: Vector) -> Vector:
        """The nearest admissible z."""
        return np.maximum(z, 0.0)

    def on_bounds(self, z: Vector, w: Vector, factor: Vector) -> Vector:
        """The nearest admissible z, but 0 where factor times z is less than w."""
        return np.where(factor * z < w, 0.0, np.maximum(z, 0.0))

    def corrections(self, z: Vector, w: Vector, factor: Vector) -> tuple[Vector, Vector]:
        """sigma and rho for which z - rho is `on_bounds` and w - sigma has the signs that it asks for there."""
        smaller = factor * z < w
        return np.where(smaller, np.minimum(w, 0.0), w), z - self.on_bounds(z, w, factor)

    def in_units(self, C: Vector) -> Orthant:  # noqa: ARG002
        """The bounds of z / C."""
        return self

    def averaged(self, T: Matrix) -> Orthant:  # noqa: ARG002
        """The bounds of T'z, for a nonnegative T with orthonormal columns."""
        return self


@dataclass(frozen=True, eq=False)
class Box:
    """l <= z <= u with any other bounds, each vector of shape (n,); infinite entries are no bounds."""

    lower: Vector
    upper: Vector

    def z_of(self, x: Vector) -> Vector:
        """z = mid(l, u, 2x)."""
        return np.minimum(np.maximum(2 * x, self.lower), self.upper)

    def reflected(self, x: Vector) -> Vector:
        """z - x."""
        return self.z_of(x) - x

    def x_of(self, z: Vector, w: Vector) -> Vector:
        """The x with z = mid(l, u, 2x) and w = z - 2x; of a pair that rounding spoils, the smaller one is dropped."""
        with np.errstate(invalid="ignore"):
            at_lower = (w > 0) & (w >= z - self.lower)
            at_upper = (w < 0) & (-w >= self.upper - z)
        return np.where(at_lower, self.lower - w, np.where(at_upper, self.upper - w, z)) / 2

    def x_within(self, z: Vector, w: Vector, basis: Basis) -> Vector:
        """The x of a basic solution, with basic z moved within their bounds and w of the wrong sign set to 0."""
        assert basis.upper is not None
        w = np.where(self.fixed, w, np.where(basis.upper, np.minimum(w, 0.0), np.maximum(w, 0.0)))
        return 0.5 * np.where(basis.basic, self.project(z), self.nonbasic(basis) - w)

    def gaps(self, z: Vector, w: Vector, factor: Vector | float = 1.0) -> Vector:
        """z - mid(l, u, z - w) = max(z - u, min(z - l, w)), without cancellation: the natural residual.

        With z in other units, max(factor (z - u), min(factor (z - l), w)).
        """
        return np.maximum(factor * (z - self.upper), np.minimum(factor * (z - self.lower), w))

    def distances(self, z: Vector) -> tuple[Vector, Vector | None]:
        """z - l and z - u."""
        return z - self.lower, z - self.upper

    def basis_of(self, x: Vector) -> Basis:
        """The states that x stands for: at the lower bound where 2x <= l, at the upper one where 2x >= u."""
        t = 2 * x
        upper = (t >= self.upper) & (self.lower < self.upper)
        return Basis((t > self.lower) & (t < self.upper), upper)

    def nonbasic(self, basis: Basis) -> Vector:
        """z where it is not basic, 0 elsewhere."""
        assert basis.upper is not None
        return np.where(basis.basic, 0.0, np.where(basis.upper, self.upper, self.lower))

    def violations(self, z: Vector, w: Vector, basis: Basis) -> Vector:
        """How far each component is from what its state asks for; negative or 0 where it has that."""
        assert basis.upper is not None
        beyond: Vector = np.maximum(self.lower - z, z - self.upper)
        signed = np.where(basis.upper, w, -w)
        signed[self.fixed] = 0.0
        return np.where(basis.basic, beyond, signed)

    def wrong(self, z: Vector, w: Vector, basis: Basis) -> Mask:
        """Where a component has not what its state asks for."""
        return self.violations(z, w, basis) > 0.0

    def excess(self, z: Vector, w: Vector) -> Vector:
        """By how much w has another sign than an admissible z asks for; minus infinity where that is any."""
        return np.maximum(np.where(z > self.lower, w, -np.inf), np.where(z < self.upper, -w, -np.inf))

    def exchanged(self, basis: Basis, violated: Mask, z: Vector) -> Basis:
        """The states with those of the violated components exchanged: a basic one goes to the bound that it violates,
        one at a bound becomes basic."""
        assert basis.upper is not None
        leaving = violated & basis.basic & (z > self.upper)
        return Basis(basis.basic ^ violated, (basis.upper & ~violated) | leaving)

    def project(self, z: Vector) -> Vector:
        """The nearest admissible z."""
        return np.minimum(np.maximum(z, self.lower), self.upper)

    def on_bounds(self, z: Vector, w: Vector, factor: Vector) -> Vector:
        """The nearest admissible z, but at a bound where factor times the distance from it is less than the size of a w
        that has the sign for it."""
        at_lower, at_upper = factor * (z - self.lower) < w, factor * (z - self.upper) > w
        return np.where(at_lower, self.lower, np.where(at_upper, self.upper, self.project(z)))

    def corrections(self, z: Vector, w: Vector, factor: Vector) -> tuple[Vector, Vector]:
        """sigma and rho for which z - rho is `on_bounds` and w - sigma has the signs that it asks for there."""
        at_lower, at_upper = factor * (z - self.lower) < w, factor * (z - self.upper) > w
        sigma = np.where(at_lower, np.minimum(w, 0.0), np.where(at_upper, np.maximum(w, 0.0), w))
        return np.where(self.fixed, 0.0, sigma), z - self.on_bounds(z, w, factor)

    def averaged(self, T: Matrix) -> Box:
        """The bounds of T'z, for a nonnegative sparse T with orthonormal columns."""
        return Box(T.T @ self.lower, T.T @ self.upper)

    @property
    def corner(self) -> Vector:
        """The z at the lower bounds, at upper ones where there are no others, and 0 where there are none."""
        return np.where(np.isfinite(self.lower), self.lower, np.where(np.isfinite(self.upper), self.upper, 0.0))

    @cached_property
    def fixed(self) -> Mask:
        """Where l_i = u_i, so that w_i is free."""
        fixed: Mask = self.lower == self.upper
        return fixed

    @cached_property
    def free(self) -> Mask:
        """Where neither bound is finite, so that w_i = 0."""
        free: Mask = (self.lower == -np.inf) & (self.upper == np.inf)
        return free

    @cached_property
    def kinds(self) -> dict[str, int]:
        """How many variables are free, have one bound or both, or are fixed; kinds without any are left out."""
        low, high = np.isfinite(self.lower), np.isfinite(self.upper)
        masks = {
            "free": ~low & ~high,
            "lower bound": low & ~high,
            "upper bound": ~low & high,
            "boxed": low & high & ~self.fixed,
            "fixed": self.fixed,
        }
        return {kind: int(np.count_nonzero(mask)) for kind, mask in masks.items() if mask.any()}

    def in_units(self, C: Vector) -> Box:
        """The bounds of z / C."""
        return Box(self.lower / C, self.upper / C)


ORTHANT = Orthant()
