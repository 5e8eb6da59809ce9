"""Basic solutions: some variables at a bound, for the others w = 0; and which signs they violate beyond rounding.

For a set B of basic variables and z_N at their bounds, M_BB z_B = -(q + M z_N)_B and w_N = (M z + q)_N. It solves the
problem if each basic variable lies within its bounds and w has the sign that each bound asks for. A violation counts
if it exceeds the rounding error of its row, ROW_ROUNDING (|M| |z| + |q|)_i; for a z_i, in units of w, as much as the
largest |M_ij| makes of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from lcpcli.linalg import factors
from lcpcli.linalg.doubles import ROW_ROUNDING, is_finite
from lcpcli.linalg.factors import PrincipalSolver
from lcpcli.linalg.matrices import absolute_product, product
from lcpcli.model.box import Basis
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Mask, Vector

FEW_WRONG = 0.05  # of all signs: if no more are wrong, whether they are so beyond rounding is checked


class BasicSolution(NamedTuple):
    """The basic solution of one basis.

    z, w : shape (n,); w is 0 where basic.
    wrong : where a sign is violated, by however little; shape (n,).
    is_solution : whether none is violated beyond rounding; if many are wrong, it is assumed that some are.
    """

    basis: Basis
    z: Vector
    w: Vector
    wrong: Mask
    is_solution: bool

    @property
    def x(self) -> Vector:
        """(z - w) / 2."""
        return 0.5 * (self.z - self.w)


class BasicSolutions:
    """The basic solutions of a problem, one after another: factors are kept while they can be updated.

    solver : of systems with M, if it has been used for another problem with the same M.
    """

    def __init__(self, problem: Problem, solver: PrincipalSolver | None = None) -> None:
        self._problem, self._solver = problem, solver or PrincipalSolver(problem.M)

    def exchanging(self, basis: Basis) -> Iterator[BasicSolution]:
        """Yield the basic solution of a basis, then the one with its `wrong` signs exchanged, and so on: block
        principal pivoting (M. M. Kostreva, Linear Algebra and its Applications 21 (1978) 207-215). Whoever changes
        `wrong` in between chooses what is exchanged. SingularMatrix as for `at`."""
        while True:
            found = self.at(basis)
            yield found
            basis = self._problem.box.exchanged(found.basis, found.wrong, found.z)

    def at(self, basis: Basis) -> BasicSolution:
        """Return the basic solution of a basis; SingularMatrix, with a clause for the user, if M_BB is singular or
        numbers overflow.

        If it is a solution, z is refined once by its residual w_B, unless that is already at rounding level.
        """
        problem, indices = self._problem, basis.basic.nonzero()[0]
        z = problem.box.nonbasic(basis)
        start = product(problem.M, z) + problem.q if problem.is_mixed and z.any() else problem.q
        if not indices.size:
            return self._judged(basis, z, start.copy())
        try:
            return self._refined(basis, z, indices, start[indices])
        except factors.SingularMatrix:
            raise factors.SingularMatrix(f"the principal submatrix of {indices.size} indices is singular") from None

    def _refined(self, basis: Basis, z: Vector, indices: Indices, own: Vector) -> BasicSolution:
        """The basic solution with these basic indices, for z at bounds elsewhere and w = own there."""
        problem, solve = self._problem, self._solver.at(indices)
        z[indices] = solve(-own)
        for refines in (True, False):
            if not is_finite(z):
                raise factors.SingularMatrix
            w = product(problem.M, z)
            w += problem.q
            residual = w[indices]
            w[indices] = 0.0
            found = self._judged(basis, z, w)
            if not (refines and found.is_solution) or self._is_rounding(residual, z, indices):
                break
            z[indices] -= solve(residual)
        return found

    def _judged(self, basis: Basis, z: Vector, w: Vector) -> BasicSolution:
        """The basic solution of these z and w."""
        wrong = self._problem.box.wrong(z, w, basis)
        count = np.count_nonzero(wrong)
        found = BasicSolution(basis, z, w, wrong, not count)
        if not 0 < count <= FEW_WRONG * wrong.size:
            return found
        return found._replace(is_solution=not self.violated(found).any())

    def _is_rounding(self, residual: Vector, z: Vector, rows: Indices) -> bool:
        """Whether the residual in these rows of w is within the rounding error of their terms, of which q alone is a
        lower bound."""
        problem = self._problem
        size, own = np.abs(residual), np.abs(problem.q[rows])
        if np.count_nonzero(size <= ROW_ROUNDING * own) == rows.size:
            return True
        terms = absolute_product(problem.M, np.abs(z))[rows]
        return bool(np.count_nonzero(size <= ROW_ROUNDING * (terms + own)) == rows.size)

    def violated(self, found: BasicSolution) -> Mask:
        """Where signs are violated beyond rounding."""
        problem = self._problem
        violated: Mask = found.wrong.copy()
        rows = violated.nonzero()[0]
        violations = problem.box.violations(found.z, found.w, found.basis)[rows]
        violated[rows] = violations > violation_by_rounding(problem, found.z, found.basis, rows)
        return violated


def violation_by_rounding(problem: Problem, z: Vector, basis: Basis, rows: Indices) -> Vector:
    """How far rounding errors alone may take the signs of these rows of a basic solution: w_i, or z_i if basic."""
    terms = ROW_ROUNDING * (absolute_product(problem.M[rows], np.abs(z)) + np.abs(problem.q[rows]))
    with np.errstate(divide="ignore", invalid="ignore"):
        in_z = np.where(terms > 0, terms / problem.row_maxima[rows], 0.0)
    return np.where(basis.basic[rows], in_z, terms)
