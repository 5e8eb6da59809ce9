"""Changes of variables: a problem in other units, or with its reference point moved to 0, each with the way back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import are_moderate
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.units import LARGEST_POWER, equilibrate
from lcpcli.model.box import LARGEST_X, moved
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

TERMS = "terms_of_q"  # the attribute of a shifted problem
MODERATE_POWER = 300  # the power of two up to which R q is left unchanged


@dataclass(eq=False, repr=False)
class Change:
    """A problem in variables other than the original ones, with the way there and back; unless a subclass says
    otherwise, x, F and Farkas' y remain the same."""

    problem: Problem
    original: Problem

    @property
    def is_exact(self) -> bool:
        """Return whether surely nothing was rounded or lost, so that both problems have the same solutions."""
        return False

    def start(self, x: Vector) -> Vector:
        """Return the x of the problem in other variables for an x of the original problem."""
        return x

    def back(self, x: Vector) -> Vector:
        """Return the x of the original problem for an x of the problem in other variables."""
        return x

    def residual(self, F: Vector) -> Vector:
        """Return F of the original problem."""
        return F

    def multipliers(self, y: Vector) -> Vector:
        """Return the Farkas vector for the original problem, if y proves that it is infeasible too."""
        return self.residual(y)


@dataclass(eq=False, repr=False)
class Scaled(Change):
    """The problem of R M C, R q, l / C and u / C, with the way back: z = C z', w = w' / R, F = F' / R.

    If R and C are powers of two, neither direction rounds.
    """

    R: Vector
    C: Vector

    def start(self, x: Vector) -> Vector:
        z = self.original.box.z_of(x)
        return 0.5 * (z / self.C - self.R * (z - 2 * x))

    @property
    def is_exact(self) -> bool:
        """Return whether nothing over- or underflows, where R and C are powers of two."""
        with np.errstate(all="ignore"):
            back = matrices.scaled(self.problem.M, 1 / self.R, 1 / self.C) - self.original.M
            box, own = self.original.box, self.problem.box
            keeps_bounds = np.all(own.lower * self.C == box.lower) and np.all(own.upper * self.C == box.upper)
            keeps_q = np.array_equal(self.problem.q / self.R, self.original.q)
            return bool(keeps_q and keeps_bounds and abs(back).max() == 0)

    def multipliers(self, y: Vector) -> Vector:
        """Return R y times a power of two that puts its largest entry between 1 and 2."""
        with np.errstate(all="ignore"):
            y = self.R * y
            return np.ldexp(y, 1 - int(np.frexp(np.abs(y).max())[1]))

    def residual(self, F: Vector) -> Vector:
        return F / self.R

    @np.errstate(over="ignore")
    def back(self, x: Vector) -> Vector:
        """Return x in the original units.

        Where z overflows, x is infinite; where w does, x is the most negative admissible number.
        """
        z = self.problem.box.z_of(x)
        w = (z - 2 * x) / self.R
        return np.maximum(0.5 * (self.C * z - w), -LARGEST_X)


def scale(problem: Problem) -> Scaled:
    """Return the equilibrated problem; M is copied once. An extremely large or small R q is scaled to size about 1.

    The problem is returned unchanged if no powers of two in range achieve that.
    """
    R, C = equilibrate(problem.M, problem.q, problem.row_maxima)
    t = np.exp2(_common_power(problem.q, R, C))
    with np.errstate(over="ignore"):
        R, C = R * t, C / t
        q = R * problem.q
    if not np.isfinite(q).all():
        return Scaled(problem, problem, np.ones(q.size), np.ones(q.size))
    return in_units(problem, R, C)


def in_units(problem: Problem, R: Vector, C: Vector) -> Scaled:
    """Return the problem in the units of these positive diagonals, each of shape (n,)."""
    M, q = matrices.scaled(problem.M, R, C), R * problem.q
    (M.data if is_sparse(M) else M).setflags(write=False)  # so that it is not copied again
    with np.errstate(over="ignore"):
        lower, upper = (moved(bound / C, bound) for bound in (problem.lower, problem.upper))
    return Scaled(Problem(M, q, lower=lower, upper=upper), problem, R, C)


def is_far_from_one(problem: Problem) -> bool:
    """Return whether numbers of the problem are so large or small that products of a few over- or underflow."""
    return not all(map(are_moderate, (problem.M.data if is_sparse(problem.M) else problem.M, problem.q)))


def _common_power(q: Vector, R: Vector, C: Vector) -> float:
    """Return the power of two for R, and its inverse for C, that brings R q into range as far as R and C allow."""
    if not q.any():
        return 0.0
    rows, columns = np.log2(R), np.log2(C)
    size = float((np.frexp(q)[1] + rows).max(where=q != 0, initial=-np.inf))
    if abs(size) <= MODERATE_POWER:
        return 0.0
    low = max(-LARGEST_POWER - rows.min(), columns.max() - LARGEST_POWER)
    high = min(LARGEST_POWER - rows.max(), columns.min() + LARGEST_POWER)
    return float(np.clip(-size, low, high)) if low <= high else 0.0


class Shifted(Change):
    """The problem of M, M z + q and l - z <= z' <= u - z for the reference point z, with the way back."""

    def start(self, x: Vector) -> Vector:
        return x if self.original.reference_z is None else x - self.original.reference_z / 2

    def back(self, x: Vector) -> Vector:
        """Return the x of the original problem; a z at a bound stays at that bound."""
        box, given, reference_z = self.problem.box, self.original, self.original.reference_z
        assert reference_z is not None
        z = box.z_of(x)
        inside = np.where(z == self.problem.upper, given.upper, z + reference_z)
        at = np.where(z == self.problem.lower, given.lower, inside)
        return np.clip(0.5 * (at - (z - 2 * x)), -LARGEST_X, LARGEST_X)

    @property
    def is_exact(self) -> bool:
        return self.original.has_small_integers


def shifted(given: Problem) -> Shifted:
    """Return the problem with its reference point, which is not 0, moved to 0; M is shared."""
    reference_z = given.reference_z
    assert reference_z is not None
    with np.errstate(over="ignore"):
        bounds = [moved(bound - reference_z, bound) for bound in (given.lower, given.upper)]
    problem = Problem(given.M, given.q_ref, lower=bounds[0], upper=bounds[1])
    problem.__dict__[TERMS] = np.abs(given.q) + matrices.absolute_product(given.M, np.abs(reference_z))
    return Shifted(problem, given)


def terms_of_q(problem: Problem) -> Vector:
    """Return the sizes of the terms that were added up to q, as for a shifted problem: their rounding is in q."""
    terms: Vector | None = problem.__dict__.get(TERMS)
    return np.abs(problem.q) if terms is None else terms
