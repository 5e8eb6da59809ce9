"""A point near z at which a bound is sharp: |z - z*| <= |z - y| + |y - z*| for any y, however y is found.

y is approximately the solution of the complementary basis of z. If z comes from a solver, that is z* up to rounding,
and the bound for z is close to the error of z, however ill-conditioned M is.
"""

from __future__ import annotations

import numpy as np

from lcpcli.bounds.rounding import residual
from lcpcli.linalg import factors
from lcpcli.linalg.factors import SingularMatrix, Solve
from lcpcli.linalg.krylov import bicgstab, identity, norm
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector

KRYLOV_STEPS = 100
KRYLOV_TARGET = 1e-8  # relative to the right-hand side
REFINEMENTS = 3


def neighbour(problem: Problem, z: Vector) -> Vector | None:
    """y >= 0 of shape (n,), with y_i = 0 where M_ii z_i <= (M z + q)_i, and M y + q approximately 0 elsewhere.

    With bounds, y is the basic solution of the states of z - w_i / M_ii, moved within the bounds.

    problem, z : n unknowns, M with positive diagonal, and any z of shape (n,). None if no y is found.
    """
    basis = problem.box.basis_of(0.5 * (z - problem.w(z) / problem.M.diagonal()))
    y, active = problem.box.nonbasic(basis), np.flatnonzero(basis.basic)
    if not active.size:
        return y
    try:
        solve = solver(problem.M[active][:, active])
    except SingularMatrix:
        return None
    for _ in range(REFINEMENTS):
        left = residual(problem, y)
        if left is None:
            return None
        y[active] -= solve(left[active])
        if not np.isfinite(y).all():
            return None
    return problem.box.project(y)


def solver(A: Matrix) -> Solve:
    """A solver for A with positive diagonal: BiCGSTAB if A is sparse and it converges fast, else factors, with fill-in.

    Raises SingularMatrix.
    """
    if is_sparse(A):
        inverse = 1 / A.diagonal()

        def iterate(b: Vector) -> tuple[Vector, bool]:
            target = KRYLOV_TARGET * norm(inverse * b)
            x, size = bicgstab(
                lambda v: inverse * (A @ v), inverse * b, np.zeros(b.size), target, KRYLOV_STEPS, identity
            )
            return x, size <= target

        if iterate(A.diagonal())[1]:
            return lambda b: iterate(b)[0]
    return factors.factorizer(A)(0.0)
