"""The equilibrated problem, and the transformation back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import are_moderate
from lcpcli.linalg.equilibration import LARGEST_POWER, equilibrate
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.modulus import LARGEST_X
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

MODERATE = 300  # the power of two up to which R q is left unchanged


@dataclass(frozen=True, eq=False)
class Scaled:
    """LCP(R M C, R q) for a problem, with the transformation back: z = C z', w = w' / R, and F = F' / R.

    If R and C are powers of two, neither direction rounds.
    """

    problem: Problem
    R: Vector
    C: Vector

    def start(self, x: Vector) -> Vector:
        """x = (z - w) / 2 of the problem in scaled units."""
        return np.maximum(x, 0) / self.C + np.minimum(x, 0) * self.R

    @np.errstate(over="ignore")
    def back(self, x: Vector) -> Vector:
        """An x of the scaled problem in the units of the original one.

        Where z overflows, x is infinite; where w does, x is the most negative number admitted.
        """
        original: Vector = np.maximum(x, 0) * self.C
        original += np.maximum(np.minimum(x, 0) / self.R, -LARGEST_X)
        return original


def scale(problem: Problem) -> Scaled:
    """The equilibrated problem; M is copied once. If R q would be extremely large or small, it is scaled to size one.

    The problem unchanged if no powers of two in range achieve that.
    """
    R, C = equilibrate(problem.M, problem.q, problem.row_maxima)
    t = np.exp2(_common_power(problem.q, R, C))
    with np.errstate(over="ignore"):
        R, C = R * t, C / t
        q = R * problem.q
    if not np.isfinite(q).all():
        return Scaled(problem, np.ones(q.size), np.ones(q.size))
    return Scaled(Problem(matrices.scaled(problem.M, R, C), q), R, C)


def is_far_from_one(problem: Problem) -> bool:
    """Whether numbers of the problem are so large or small that products of a few of them overflow or underflow."""
    return not all(map(are_moderate, (problem.M.data if is_sparse(problem.M) else problem.M, problem.q)))


def _common_power(q: Vector, R: Vector, C: Vector) -> float:
    """The power of two for R, and its inverse for C, that brings R q into range as far as R and C allow."""
    if not q.any():
        return 0.0
    rows, columns = np.log2(R), np.log2(C)
    size = float((np.frexp(q)[1] + rows).max(where=q != 0, initial=-np.inf))
    if abs(size) <= MODERATE:
        return 0.0
    low = max(-LARGEST_POWER - rows.min(), columns.max() - LARGEST_POWER)
    high = min(LARGEST_POWER - rows.max(), columns.min() + LARGEST_POWER)
    return float(np.clip(-size, low, high)) if low <= high else 0.0
