"""Evident solutions, and signs of mistakes in the data of a problem."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from lcpcli.classes.entries import weak_row
from lcpcli.classes.verdict import NO, YES, Verdict
from lcpcli.diagnosis.matrix import Spectrum, Spread
from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix

BAD_SPREAD = 4.0  # decades
BAD_CONDITION = 1e12
NEARLY = 1e-12  # relative to the largest entry: an asymmetry that looks like rounding


def obvious(problem: Problem, classes: dict[str, Verdict]) -> str:
    """What is evident about the solutions from M, its classes and q; "" if nothing is.

    M is a P-matrix if and only if there is exactly one for every q: H. Samelson, R. M. Thrall, O. Wesler, A partition
    theorem for Euclidean n-space, Proc. Amer. Math. Soc. 9 (1958) 805-807.
    """
    if problem.is_mixed:
        return _obvious_with_bounds(problem, classes)
    if (problem.q >= 0).all():
        alone = ", the unique one, as M is a P-matrix" if classes["p_matrix"].word == YES else ""
        return f"q >= 0: z = 0 is a solution{alone}"
    rows = (problem.q < 0) & ~_with_positive_entry(problem)
    if rows.any():
        i = int(np.flatnonzero(rows)[0]) + 1
        return f"q{i} < 0 and no entry of row {i} of M is positive: there is no solution, as w{i} < 0 for every z >= 0"
    if classes["p_matrix"].word == YES:
        return "there is exactly one solution, for this and every other q, as M is a P-matrix"
    return ""


def _obvious_with_bounds(problem: Problem, classes: dict[str, Verdict]) -> str:
    box, unique = problem.box, classes["p_matrix"].word == YES
    there = box.project(np.zeros(problem.n))
    if not box.gaps(there, problem.q_ref).any():
        return f"the z within the bounds nearest to 0 is a solution{', the unique one, as M is a P-matrix' * unique}"
    if unique:
        return "there is exactly one solution, for these and all other bounds and every q, as M is a P-matrix"
    if not {"free", "lower bound", "upper bound"} & set(box.kinds):
        return "there is a solution, as all bounds are finite"
    return ""


def _with_positive_entry(problem: Problem) -> NDArray[np.bool_]:
    return np.asarray((problem.M > 0).sum(axis=1)).ravel() > 0


def hints(
    problem: Problem,
    classes: dict[str, Verdict],
    spread: tuple[Spread, Spread],
    condition: float | None,
    ends: Spectrum | None,
    check: Callable[[], None],
) -> list[str]:
    """Possible mistakes in the data, and advice on them; only with evidence. `check` may raise Late."""
    found = []
    before, after = spread
    if before.largest > BAD_SPREAD and after.largest < before.largest - 1:
        found.append(
            f"badly scaled: the largest entries of rows or columns vary by {before.largest:.1f} decades, "
            f"by {after.largest:.1f} after equilibration; use auto, or --scale with shi and fixed-point"
        )
    if condition is not None and BAD_CONDITION < condition < math.inf:
        digits = min(math.log10(condition), 16.0)
        found.append(f"ill-conditioned, even after equilibration: about {digits:.0f} digits of z may be lost")
    if ends is not None and classes["positive_semidefinite"].word == NO and _by_rounding(ends, problem.n):
        found.append("M fails to be positive semidefinite only by rounding errors: perhaps it was meant to be")
    if classes["symmetric"].word == NO:
        found += _transposed(problem, classes, check)
    return found


def _by_rounding(ends: Spectrum, n: int) -> bool:
    return abs(ends.smallest) <= 4 * n * EPS * ends.largest


def _transposed(problem: Problem, classes: dict[str, Verdict], check: Callable[[], None]) -> list[str]:
    """Whether M looks like the transpose of the intended matrix, or is symmetric up to rounding."""
    M = problem.M
    with np.errstate(over="ignore"):
        difference = abs(M - M.T).max()
    if difference <= NEARLY * abs(M).max():
        return ["M is symmetric up to rounding: if it should be, symmetrize it, which halves the work"]
    if classes["strictly_diagonally_dominant"].word == NO and weak_row(_transpose(M), check) is None:
        return ["strictly diagonally dominant by columns, not by rows: if rows were intended, M is transposed"]
    return []


def _transpose(M: Matrix) -> Matrix:
    return M.T.tocsr() if is_sparse(M) else np.ascontiguousarray(M.T)
