"""Whether the known solutions of a problem solve it, to the digits with which they are given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector
from lcpcli.verify.point import Criterion, Point

ROUGH = 1e-3  # the relative residual up to which z counts as a rounded solution, whatever its digits
# Digits that are attributed to a z: whole numbers are meant exactly, others may be singles.
FEWEST_GIVEN_DIGITS, MOST_GIVEN_DIGITS = 4, 7


def without_wrong_solutions(problem: Problem) -> tuple[Problem, list[str]]:
    """Return the problem without its wrong known solutions, and what is wrong with each of these, as a clause.

    z is wrong if its relative residual is above ROUGH and no changes of its components by a unit in the last digit,
    which matter where M is ill-conditioned, make it satisfy the conditions on each z_i and w_i.
    """
    if not problem.solutions:
        return problem, []
    criterion = Criterion(problem)
    faults = [_fault(Point(criterion, z, is_admissible=False)) for z in problem.solutions]
    kept = tuple(z for z, fault in zip(problem.solutions, faults, strict=True) if not fault)
    if len(kept) == len(faults):
        return problem, []
    names = ["solution"] if len(faults) == 1 else [f"solution[{k}]" for k in range(len(faults))]
    complaints = [f"{name}: {fault}" for name, fault in zip(names, faults, strict=True) if fault]
    return replace(problem, solutions=kept), complaints


@np.errstate(over="ignore", invalid="ignore")
def _fault(point: Point) -> str:
    """Return what is wrong with a solution; "" if nothing is."""
    problem, z, w = point.criterion.problem, point.z, point.w
    relative = point.relative_residuals
    if (relative <= ROUGH).all():
        return ""
    change = _last_digit(z)
    change_of_w = matrices.absolute_product(problem.M, change)
    lower, upper = problem.lower, problem.upper
    wrong = (z < lower - change) | (z > upper + change)
    wrong |= ((w < -change_of_w) & (z < upper - change)) | ((w > change_of_w) & (z > lower + change))
    if not wrong.any():
        return ""
    i = int(np.argmax(np.where(wrong, relative, 0.0)))
    worst = f"z{i + 1} = {z[i]:.3g} and w{i + 1} = {w[i]:.3g}"
    return f"is not a solution: its residual is {point.residual:.2g}, with {worst}; it is ignored"


def _last_digit(z: Vector) -> Vector:
    """Return one unit in the last digit of each z_i, if all have as many digits, or as many decimals, as the longest
    has."""
    spelt = [repr(value).removesuffix(".0").partition("e") for value in np.abs(z[z != 0]).tolist()]
    if not spelt:
        return np.zeros(z.size)
    digits = max(len(text.replace(".", "").strip("0")) for text, _, _ in spelt)
    decimals = max(len(text.partition(".")[2]) - int(power or 0) for text, _, power in spelt)
    digits = min(max(digits, FEWEST_GIVEN_DIGITS), MOST_GIVEN_DIGITS)
    coarsest = 10.0 ** (1 - FEWEST_GIVEN_DIGITS) * float(np.abs(z).max())
    return 10.0 ** (1 - digits) * np.abs(z) + min(10.0**-decimals, coarsest)
