"""Basic solutions, their infeasibilities beyond rounding, and block principal pivoting,
which pivots on these.

For a set B of basic variables, for which w_B = 0, and z_N at their bounds, M_BB z_B =
-(q + M z_N)_B and w_N = (M z + q)_N. This basic solution solves the problem if each
basic variable lies within its bounds and w has the signs required by complementarity. A
violation is an infeasibility beyond rounding if it exceeds the rounding error of its
row, ROW_ROUNDING (|M| |z| + |q|)_i; for a z_i the same holds after multiplication by
the largest |M_ij|.

M. M. Kostreva, Block pivot methods for solving the complementarity problem, Linear
Algebra and its Applications 21 (1978) 207-215.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Generator
from typing import Any, NamedTuple

import numpy as np

from lcpcli.linalg.doubles import (
    LARGEST_DOUBLE,
    MAX_COPIED_ENTRIES,
    ROW_ROUNDING,
    is_finite,
)
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix, Solve, finite
from lcpcli.linalg.matrices import (
    absolute_product,
    is_sparse,
    product,
    row_and_column_maxima,
)
from lcpcli.model.box import BASIC, Box
from lcpcli.model.problem import Problem
from lcpcli.typing import BasisStatus, Indices, Mask, Vector


class BasicSolution(NamedTuple):
    """The basic solution of one basis, or of m bases, one in each row.

    z, w : shape (n,) or (m, n); w is 0 where basic.
    wrong : where there is an infeasibility, however small; of the same shape.
    is_solution : whether there is no infeasibility beyond rounding.
    """

    basis: BasisStatus
    z: Vector
    w: Vector
    wrong: Mask
    is_solution: bool

    @property
    def x(self) -> Vector:
        return 0.5 * (self.z - self.w)


def block_principal_pivoting(
    problem: Any, basis: BasisStatus
) -> Generator[BasicSolution, Indices | None, None]:
    """Yield the basic solution of a basis, then the one after a block pivot on its
    infeasibilities, and so on. The caller may choose the indices of the next pivot by
    changing `wrong` in between, as a safeguard does.

    problem : has a `box` and basic solutions, `at(basis)`, of one problem or of m;
        `part(rows)` are the problems whose rows are sent.
    """
    while True:
        basic_solution = problem.at(basis)
        rows = yield basic_solution
        basis = problem.box.exchanged(
            basic_solution.basis, basic_solution.wrong, basic_solution.z
        )
        if rows is not None:
            problem, basis = problem.part(rows), basis[rows]


class BasisSolver(ABC):
    """The basic solutions of w = M z + q, one after another, for M of any kind: a
    subclass has its products and solvers.

    row_maxima, largest : the largest |M_ij| of each row, shape (n,), and of all.
    has_terms : whether all `terms` take less time than a solve.
    """

    box: Box
    q: Vector
    row_maxima: Vector
    largest: float
    has_terms = True

    @abstractmethod
    def product(self, z: Vector) -> Vector:
        """Return M z, as a new array."""

    @abstractmethod
    def terms(self, z: Vector, rows: Indices | None = None) -> Vector:
        """Return |M| |z| + |q|, in all rows or some of them."""

    @abstractmethod
    def solver(self, indices: Indices) -> Solve:
        """Return a solver of systems with M_PP, accurate to at least half of all
        digits; it or this method raises SingularMatrix."""

    block_principal_pivoting = (
        block_principal_pivoting  # raises SingularMatrix as `at` does
    )

    def at(self, basis: BasisStatus) -> BasicSolution:
        """Return the basic solution of a basis, refined once by its residual w_B if it
        is a solution; raise SingularMatrix, with a clause for the user, if M_BB is
        singular or numbers overflow."""
        indices, z = np.logical_not(basis).nonzero()[0], self.box.nonbasic(basis)
        start = self.product(z) + self.q if np.count_nonzero(z) else self.q
        if not indices.size:
            return self._with_infeasibilities(basis, z, start.copy())
        try:
            return self._accurate_basic_solution(basis, z, indices, start[indices])
        except SingularMatrix:
            raise SingularMatrix(
                f"the principal submatrix of order {indices.size} is singular"
            ) from None

    def _accurate_basic_solution(
        self, basis: BasisStatus, z: Vector, indices: Indices, w_basic: Vector
    ) -> BasicSolution:
        """Return the basic solution with these basic indices, for z at its bounds
        elsewhere, and w_basic, the w of these indices at z_basic = 0."""
        solve = self.solver(indices)
        z[indices] = solve(-w_basic)
        for refines in (True, False):
            if not is_finite(z):
                raise SingularMatrix
            w = self.product(z)
            w += self.q
            if not is_finite(w):
                raise SingularMatrix
            residual = w[indices]
            w[indices] = 0.0
            basic_solution = self._with_infeasibilities(basis, z, w)
            if not (refines and basic_solution.is_solution):
                break
            size = np.abs(residual)
            if (
                np.count_nonzero(size <= ROW_ROUNDING * np.abs(self.q[indices]))
                == indices.size
            ):
                # The residuals are within the rounding error of their rows, of which
                # that of q is a lower bound.
                break
            if (
                self.has_terms
                and np.count_nonzero(size <= ROW_ROUNDING * self.terms(z)[indices])
                == indices.size
            ):
                break
            z[indices] -= solve(residual)
        return basic_solution

    def _with_infeasibilities(
        self, basis: BasisStatus, z: Vector, w: Vector
    ) -> BasicSolution:
        """Return the basic solution of these z and w, with its infeasibilities."""
        violations = self.box.violations(z, w, basis)
        wrong = violations > 0.0
        count = np.count_nonzero(wrong)
        basic_solution = BasicSolution(basis, z, w, wrong, not count)
        if not count:
            return basic_solution
        worst = int(violations.argmax())
        violation = float(violations[worst]) * (
            self.row_maxima[worst] if basis[worst] == BASIC else 1.0
        )
        if violation > ROW_ROUNDING * (
            abs(self.q[worst]) + self.largest * float(np.abs(z).sum())
        ):
            # This bound on the rounding error of the row needs only the sizes of the
            # rows of M.
            return basic_solution
        return basic_solution._replace(
            is_solution=not self.violated(basic_solution).any()
        )

    def count_violations(self, basic_solution: BasicSolution) -> int:
        """Return how many infeasibilities exceed rounding; only these stay in
        `wrong`."""
        basic_solution.wrong[:] = self.violated(basic_solution)
        return int(np.count_nonzero(basic_solution.wrong))

    def violated(self, basic_solution: BasicSolution) -> Mask:
        violated: Mask = basic_solution.wrong.copy()
        rows = violated.nonzero()[0]
        violations = self.box.violations(
            basic_solution.z, basic_solution.w, basic_solution.basis
        )[rows]
        row_errors = ROW_ROUNDING * self.terms(basic_solution.z, rows)
        basic = basic_solution.basis[rows] == BASIC
        violated[rows] = violations > in_units_of_state(
            row_errors, self.row_maxima[rows], basic
        )
        return violated


class BasicSolutions(BasisSolver):
    """The basic solutions of a problem, by a solver of systems with its M, which
    another problem may share."""

    def __init__(self, problem: Problem, solver: PrincipalSolver | None = None) -> None:
        self._problem = problem
        self.box = problem.box
        self.q = problem.q
        M = problem.M
        self._solver = solver or PrincipalSolver(M, problem.latest)
        self.has_terms = is_sparse(M) or M.size <= MAX_COPIED_ENTRIES

    @property
    def row_maxima(self) -> Vector:  # type: ignore[override]
        return self._problem.row_maxima

    @property
    def largest(self) -> float:  # type: ignore[override]
        return self._problem.largest

    def product(self, z: Vector) -> Vector:
        return product(self._problem.M, z)

    def terms(self, z: Vector, rows: Indices | None = None) -> Vector:
        M, q = (
            (self._problem.M, self.q)
            if rows is None
            else (self._problem.M[rows], self.q[rows])
        )
        return absolute_product(M, np.abs(z)) + np.abs(q)

    def solver(self, indices: Indices) -> Solve:
        return self._solver.at(indices)


def in_units_of_state(terms: Vector, maxima: Vector, basic: Mask) -> Vector:
    """Return the errors of rows as errors of what their basis status restricts: of z_i
    if it is basic, divided by the largest |M_ij|, else of w_i."""
    in_z = np.divide(terms, maxima, where=maxima > 0, out=np.zeros_like(terms))
    return np.where(basic, in_z, terms)


# Corrections of a basic solution: the first one computes it, the others make small rows
# exact as well.
CORRECTIONS = 3
# An equilibrated M_BB is treated as singular if an entry of its inverse exceeds the
# reciprocal of this.
SINGULAR = 1e-13
DEPENDENT = 1e-11  # relative: singular values of such an M_BB that are treated as 0


class CorrectedSolutions(BasicSolutions):
    """The basic solutions of a problem, with CORRECTIONS.

    M : dense. initial_guess : if M_BB is singular, as for redundant contacts, these z_B
        are corrected as little as possible; if it is None, SingularMatrix is raised.
    """

    def __init__(
        self, problem: Problem, M: Vector, initial_guess: Vector | None = None
    ) -> None:
        super().__init__(problem, PrincipalSolver(M))
        self._M, self.initial_guess = M, initial_guess

    @np.errstate(all="ignore")
    def at(self, basis: BasisStatus) -> BasicSolution:
        z = self.z_at(basis)
        return self._with_infeasibilities(
            basis, z, np.where(basis == BASIC, 0.0, self._problem.w(z))
        )

    @np.errstate(all="ignore")
    def z_at(self, basis: BasisStatus) -> Vector:
        """Return z of the basic solution of a basis."""
        z = self.box.nonbasic(basis)
        B = (basis == BASIC).nonzero()[0]
        initial_guess = self.initial_guess
        q, reference = self._problem.q_ref, self._problem.reference_point
        start = z if initial_guess is None else initial_guess
        is_regular = not B.size or solve_basic(self._M, q, reference, z, B, start)
        if initial_guess is not None:
            return np.where(np.isfinite(z), z, initial_guess)
        if not is_regular:
            raise SingularMatrix
        return z


def solve_basic(
    M: Vector,
    q: Vector,
    reference: Vector,
    z: Vector,
    B: Indices,
    initial_guess: Vector,
) -> bool:
    """Set z_B so that w_B = M (z - reference) + q is 0, as exactly as rounding of each
    row allows, for a dense M, and return whether M_BB is regular; if not, the values
    `initial_guess` z_B are corrected as little as possible. It is compiled as well."""
    ones, A = np.ones(B.size), M[B][:, B]
    rows = reciprocals(row_and_column_maxima(A, ones, ones)[0])
    A *= rows.reshape(-1, 1)
    columns = reciprocals(row_and_column_maxima(A, ones, ones)[1])
    A *= columns
    inverse, is_regular = A, False
    try:
        inverse = np.ascontiguousarray(np.linalg.inv(A))
        is_regular = np.abs(inverse).max() < 1.0 / SINGULAR
    except Exception:  # numba catches no other: A is singular
        pass
    if not is_regular:
        z[B] = initial_guess[B]
        inverse = np.ascontiguousarray(np.linalg.pinv(finite(A), DEPENDENT))
    for _ in range(CORRECTIONS):
        w = M @ (z - reference) + q
        z[B] -= columns * (inverse @ (rows * w[B]))
    return bool(is_regular)


def reciprocals(sizes: Vector) -> Vector:
    """Return 1 / sizes, but 1 for 0, and the largest finite number for subnormal sizes,
    so that 0 times it stays 0."""
    inverses: Vector = np.minimum(1.0 / (sizes + (sizes == 0.0)), LARGEST_DOUBLE)
    return inverses
