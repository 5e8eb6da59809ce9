"""A point near z at which a bound is sharp: |z - z*| <= |z - y| + |y - z*| for any y, so that y may be found anyhow.

Taken is the solution of the complementary basis of z, nearly. If z comes from a solver, that is z* but for rounding,
and the bound for z differs little from the error of z, however badly conditioned M is.
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
    """y >= 0 of shape (n,), with y_i = 0 where M_ii z_i <= (M z + q)_i, and M y + q nearly 0 elsewhere.

    problem, z : n unknowns, M with positive diagonal, and any z of shape (n,). None where no y is found.
    """
    inside = np.flatnonzero(problem.M.diagonal() * z > problem.w(z))
    y = np.zeros_like(z)
    if not inside.size:
        return y
    try:
        solve = solver(problem.M[inside][:, inside])
    except SingularMatrix:
        return None
    for _ in range(REFINEMENTS):
        left = residual(problem, y)
        if left is None:
            return None
        y[inside] -= solve(left[inside])
        if not np.isfinite(y).all():
            return None
    return np.maximum(y, 0.0)


def solver(A: Matrix) -> Solve:
    """For A with positive diagonal: BiCGSTAB where A is sparse and that ends soon, else factors, which may fill in.

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
