"""The solution at a basis, as where Lemke's path ends, computed anew from M and q."""

from __future__ import annotations

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import LARGEST_DOUBLE
from lcpcli.linalg.factors import SingularMatrix, finite
from lcpcli.methods.lemke_path import LemkePath
from lcpcli.methods.small_numbers import violations
from lcpcli.methods.stages import Breakdown, Finished, Iterate, Stage, Stalled
from lcpcli.model.box import BASIC
from lcpcli.model.problem import Problem
from lcpcli.typing import States, Vector
from lcpcli.verify.basic_solution import BasicSolution, BasicSolutions

LITERAL_STEPS = 8  # exchanges of wrong signs at the end of a path
CORRECTIONS = 3  # of a basic solution: the first computes it, the others make small rows exact too
SINGULAR = 1e-13  # relative: M_BB whose inverse is larger than 1 over this counts as singular
DEPENDENT = 1e-11  # relative: singular values of such an M_BB that count as 0


def solution_at(problem: Problem, path: LemkePath) -> Vector:
    """Return z of the basis at which a path has ended.

    Signs that are wrong beyond rounding belong to numbers so small beside others that z_0 left before they decided:
    they are exchanged, as long as that leads to a solution soon.
    """
    near, _, basis = path.point()
    box, M = problem.box, path.reduction.M
    z = _basic(problem, near, basis, M)
    first = box.project(z)
    if not violations(problem, first).rows.any():
        return first
    solutions = BasicSolutions(problem)
    for _ in range(LITERAL_STEPS):
        w = np.where(basis == BASIC, 0.0, problem.w(z))
        violated = solutions.violated(BasicSolution(basis, z, w, box.wrong(z, w, basis), False))
        if not violated.any():
            return box.project(z)
        basis = box.exchanged(basis, violated, z)
        z = _basic(problem, box.project(z), basis, M)
    return first


def confirmed(problem: Problem, basis: States, near: Vector | None) -> Stage:
    """Yield the basic solution of a basis, if it violates no row beyond rounding, as the one at which a path has
    ended often does for the next q.

    near : a z for a singular M_BB, of which it is then the least correction; None if there is none.
    """
    box, M = problem.box, matrices.dense(problem.M)
    try:
        z = box.project(_basic(problem, near, basis, M))
    except SingularMatrix:
        return Breakdown("the principal submatrix of the given states is singular")
    if violations(problem, z).rows.any():
        return Stalled("the given states are not those of a solution")
    yield Iterate(box.x_within(z, problem.w(z), box.basis_at(z)), None, "block", 1, basis=basis)
    return Finished()


@np.errstate(all="ignore")
def _basic(problem: Problem, near: Vector | None, basis: States, M: Vector) -> Vector:
    """Return z with w_B = 0, as exactly as rounding of each row allows; where M_BB is singular, as for redundant
    contacts, values near z_B are corrected as little as possible; raise SingularMatrix if there are no such values."""
    z, B = problem.box.nonbasic(basis), (basis == BASIC).nonzero()[0]
    if not B.size:
        return z
    A = M[B[:, np.newaxis], B]
    rows = _reciprocal(np.abs(A).max(axis=1))
    A *= rows[:, np.newaxis]
    columns = _reciprocal(np.abs(A).max(axis=0))
    A *= columns
    inverse = _inverse(A)
    if inverse is None:
        if near is None:
            raise SingularMatrix
        inverse, z[B] = np.asarray(np.linalg.pinv(finite(A), rcond=DEPENDENT), np.float64), near[B]
    for _ in range(CORRECTIONS):
        z[B] -= columns * (inverse @ (rows * problem.w(z)[B]))
    return z if near is None else np.where(np.isfinite(z), z, near)


def _reciprocal(sizes: Vector) -> Vector:
    """Return 1 / sizes, 1 for 0; of subnormal sizes the largest double, so that 0 times it stays 0."""
    return np.minimum(1.0 / np.where(sizes > 0.0, sizes, 1.0), LARGEST_DOUBLE)


def _inverse(A: Vector) -> Vector | None:
    """Return the inverse of an equilibrated A; None if it is singular."""
    try:
        inverse = np.asarray(np.linalg.inv(A), np.float64)
    except np.linalg.LinAlgError:
        return None
    return inverse if np.abs(inverse).max() < 1 / SINGULAR else None
