"""Chandrasekaran's method for Z-matrices, those without a positive entry off the
diagonal, and elimination for tridiagonal M-matrices, as for American options and
optimal stopping.

R. Chandrasekaran, A special case of the complementary pivot problem, Opsearch 7 (1970)
263-268: from z = 0, each i with w_i < 0 becomes basic, and stays so, as every later
step lowers the other w. This terminates after at most n pivots at the least solution,
or at a pivot that is not positive: the multipliers of its row are nonnegative, and
prove that the problem is infeasible. Here a block pivot makes all i with w_i < 0 basic
at once, which leads to the same basis.

If M is tridiagonal, Gaussian elimination along a run of basic variables continues
through the variables beyond it, as if these were basic too: where the eliminated
right-hand side is positive, they are. That is done for all runs at once, in both
directions.

With a single run from a boundary of the grid, a single elimination is enough: M. J.
Brennan and E. S. Schwartz, The valuation of American put options, Journal of Finance 32
(1977) 449-462, and for M-matrices P. Jaillet, D. Lamberton and B. Lapeyre, Variational
inequalities and the pricing of American options, Acta Applicandae Mathematicae 21
(1990) 263-289. Any number of runs in O(n) operations, one variable after another: R. W.
Cottle and R. S. Sacher, On the solution of large, structured linear complementarity
problems: the tridiagonal case, Applied Mathematics and Optimization 3 (1977) 321-340. A
few positive entries off the diagonal are ignored; block pivots continue from the basis.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from lcpcli.basis.exchanges import BasicSolution, BasicSolutions
from lcpcli.clock import imports
from lcpcli.interrupts import TimeIsUp, raise_if_timed_out
from lcpcli.linalg.doubles import each_step
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix
from lcpcli.linalg.matrices import (
    dense,
    is_sparse,
    may_be_eliminated,
    positive_links,
)
from lcpcli.methods.newton import from_states
from lcpcli.methods.stages import (
    Breakdown,
    Finished,
    Iterate,
    NoSolution,
    Stage,
    Stalled,
)
from lcpcli.model.box import of_masks
from lcpcli.model.problem import Problem
from lcpcli.rational import elimination
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import rounded, rounded_direction, whole_multiple, zeros
from lcpcli.rational.written import exact_data
from lcpcli.typing import Mask, Matrix, Vector
from lcpcli.verify.certificate import Proof, first_proof
from lcpcli.verify.exact_solution import ExactBasis, exact_basis
from lcpcli.verify.farkas import max_exact_unknowns
from lcpcli.verify.point import Criterion, Point

# Work limit of exact arithmetic, in nominal seconds, where double precision fails.
EXACT_EFFORT = 30.0


def _exchanged(
    system: _InDoubles | _InFractions, basic: list[int]
) -> tuple[list[int], Any]:
    """Return the last basis, in the order in which variables became basic, and
    multipliers if a pivot is not positive."""
    n_checked = 0
    while negative := system.negative(basic):
        raise_if_timed_out()
        n_checked, basic = len(basic), basic + negative
    if negative is not None:
        return basic, None
    last = len(basic)  # the first `n_checked` are those of an M-matrix, these are not
    while last - n_checked > 1:
        middle = (n_checked + last) // 2
        n_checked, last = (
            (middle, last)
            if system.is_m_matrix(basic[:middle])
            else (n_checked, middle)
        )
    return basic, system.multipliers(basic[:n_checked], basic[n_checked])


class _InDoubles:
    """M and q in double precision, with the systems of some basic indices.
    basic_solution : the last one."""

    basic_solution: BasicSolution

    def __init__(self, problem: Problem) -> None:
        self._M, self._solver = problem.M, PrincipalSolver(problem.M)
        self._solutions = BasicSolutions(problem, self._solver)

    def negative(self, basic: Sequence[int]) -> list[int] | None:
        """Return the other i with w_i < 0 in the basic solution; None if that is not
        unique, or has a z_i < 0."""
        self.basic_solution = self._solutions.at(
            of_masks(np.isin(np.arange(self._M.shape[0]), basic))
        )
        negative: list[int] = np.flatnonzero(self.basic_solution.w < 0.0).tolist()
        return negative if self.basic_solution.z.min(initial=0.0) >= 0.0 else None

    def is_m_matrix(self, basic: Sequence[int]) -> bool:
        """Return whether M_BB is a nonsingular M-matrix: whether M_BB v = e has a
        solution v > 0."""
        indices = np.sort(np.array(basic, dtype=np.intp))
        try:
            return bool(
                (self._solver.solve(indices, np.ones(indices.size)) > 0.0).all()
            )
        except SingularMatrix:
            return False

    def multipliers(self, basic: Sequence[int], i: int) -> Vector:
        """Return y with y_i = 1, y_B = -M_BB^-T M_iB' and 0 elsewhere."""
        y, indices = np.zeros(self._M.shape[0]), np.sort(np.array(basic, dtype=np.intp))
        y[i] = 1.0
        if indices.size:
            T = (
                self._M.T.tocsr()
                if is_sparse(self._M)
                else np.ascontiguousarray(self._M.T)
            )
            y[indices] = np.maximum(
                PrincipalSolver(T).solve(indices, -dense(self._M[[i]])[0, indices]), 0.0
            )
        return y


class _InFractions:
    """M and q in fractions, with the systems of some basic indices, as in
    `_InDoubles`."""

    basic_solution: ExactBasis | None

    def __init__(self, data: ExactProblem, budget: Effort) -> None:
        self._data, self._effort = data, budget

    def negative(self, basic: Sequence[int]) -> list[int] | None:
        self._block(basic)
        self.basic_solution = exact_basis(
            self._data, of_masks(np.isin(np.arange(self._data.n), basic))
        )
        if self.basic_solution is None or not (
            self.basic_solution.unique
            and self.basic_solution.gaps.keys().isdisjoint(basic)
        ):
            return None
        return sorted(self.basic_solution.gaps)

    def is_m_matrix(self, basic: Sequence[int]) -> bool:
        indices = sorted(basic)
        x, free = elimination.solve(
            self._block(indices), [self._data.scales[i] for i in indices]
        )
        return x is not None and not free and min(x) > 0

    def multipliers(self, basic: Sequence[int], i: int) -> list[Fraction]:
        indices = sorted(basic)
        y = zeros(self._data.n)
        data = self._data
        y[i] = Fraction(data.scales[i])
        if indices:
            transposed = [list(row) for row in zip(*self._block(indices), strict=True)]
            x, _ = elimination.solve(
                transposed, [-data.rows[i].get(j, 0) for j in indices]
            )
            for j, value in zip(indices, x or (), strict=True):
                y[j] = value * data.scales[j]
        return [Fraction(value) for value in whole_multiple(y)]

    def _block(self, indices: Sequence[int]) -> list[list[int]]:
        """Return the block of some rows and columns; raise TimeIsUp where a system with
        it would take too long."""
        if len(indices) > max_exact_unknowns():
            raise TimeIsUp
        A = [[self._data.rows[i].get(j, 0) for j in indices] for i in indices]
        self._effort.spend(elimination.duration(A))
        return A


# Without it: some problems with singular Z-matrices in 60 to 100 unknowns, which are
# ill-posed, are not decided in seconds.
def decided(
    data: ExactProblem, budget: Effort, basic: Sequence[int] = ()
) -> tuple[list[Fraction] | None, list[Fraction] | None]:
    """Return the least solution of an LCP with a Z-matrix, or a y that proves that
    there is none, exactly; neither if that takes too much effort. basic : a guess at
    the basis of the solution."""
    system = _InFractions(data, budget)
    for guess in (list(basic), []):
        try:
            _, y = _exchanged(system, guess)
            z = (
                system.basic_solution.z
                if y is None and system.basic_solution is not None
                else None
            )
        except TimeIsUp:
            raise_if_timed_out()  # whether all of the time is up
            break
        if y is not None and data.refuted_by(y):
            return None, y
        if z is not None and data.is_solution(z):
            return z, None
    return None, None


@each_step(all="ignore")
def z_matrix(problem: Problem) -> Stage:
    """Solve an LCP with a Z-matrix, or prove that it is infeasible: in double precision
    and, if its answer does not hold, in exact arithmetic.

    Yields the least solution. NoSolution : with a Farkas proof. Breakdown : it is too
    large for exact arithmetic.
    """
    system = _InDoubles(problem)
    basic = list[int]()
    y = None
    try:
        basic, y = _exchanged(system, basic)
        if y is None:
            x = problem.box.x_within(
                system.basic_solution.z,
                system.basic_solution.w,
                system.basic_solution.basis,
            )
            if Point(Criterion(problem), problem.box.z_of(x)).solves():
                yield Iterate(x, None, "block", 1)
                return Finished()
        elif proof := first_proof(problem, [y], whole=True):
            return NoSolution(proof)
    except SingularMatrix:
        pass
    data = exact_data(problem)
    z, multipliers = decided(data, Effort(EXACT_EFFORT), basic)
    if multipliers is not None:
        approximate_proofs = [rounded_direction(multipliers)]
        proof = first_proof(problem, approximate_proofs, whole=True)
        return NoSolution(proof or Proof.of_fractions(data, multipliers))
    if z is None:
        return Breakdown("exact arithmetic takes too long")
    yield Iterate(problem.box.x_of(rounded(z), rounded(data.w(z))), None, "exact", 1)
    return Finished()


MAX_PASSES = 50  # after which block pivots take over


class Elimination:
    """A tridiagonal matrix, without its positive entries off the diagonal, prepared for
    LCPs with one right-hand side after another.

    is_of_m_matrix : whether it is an M-matrix, as all pivots are positive. is_changed :
        whether it had such entries, so that its solutions have only an almost right
        basis.
    """

    def __init__(self, M: Matrix) -> None:
        with imports:
            from scipy.linalg.lapack import dpttrf, dtbtrs
        self._factorize, self._solve = dpttrf, dtbtrs
        self.is_changed, self._diagonal = positive_links(M) > 0, M.diagonal()
        self._below, self._above = (
            np.minimum(M.diagonal(side), 0.0) for side in (-1, 1)
        )
        # Off the diagonal of a symmetric matrix with the same pivots.
        self._link = np.sqrt(-self._below) * np.sqrt(-self._above)
        self._cached_factors = dict[int, tuple[Vector, Vector]]()
        self.is_of_m_matrix = not dpttrf(self._diagonal, self._link)[2]

    def _full_elimination(self, direction: int) -> tuple[Vector, Vector]:
        """Return the factors L and U without cuts, in the order of rows (1) or in the
        opposite order (-1)."""
        if direction not in self._cached_factors:
            below, above = (self._below, self._above)[::direction]
            L, pivots = self._factors(
                below[::direction], self._diagonal[::direction], self._link[::direction]
            )
            self._cached_factors[direction] = (
                L,
                np.asfortranarray([np.append(0.0, above[::direction]), pivots]),
            )
        return self._cached_factors[direction]

    @np.errstate(all="ignore")
    def solution(self, q: Vector) -> tuple[Vector, Mask]:
        """Return z, shape (n,), and which variables are basic, for an M-matrix and a
        q."""
        n, basic = q.size, q < 0.0
        for direction in (1, -1) if basic.argmax() < basic[::-1].argmax() else (-1, 1):
            L, U = self._full_elimination(direction)
            y = self._solve(L, -q[::direction], uplo="L", diag="U")[0]
            right_side = q[::direction]
            is_basic = y > 0.0
            count = n - int(is_basic[::-1].argmax()) if is_basic.any() else 0
            if not (right_side[count + 1 :] < 0.0).any():  # as y = -w in row `count`
                z = np.zeros(n)
                z[:count] = (
                    self._solve(U[:, :count], y[:count], uplo="U")[0] if count else 0.0
                )
                if z.min() >= 0.0:
                    return z[::direction].copy(), (np.arange(n) < count)[::direction]
            basic |= is_basic[::direction]
        return self._in_runs(q, basic)

    def _in_runs(self, q: Vector, basic: Mask) -> tuple[Vector, Mask]:
        """Return z and which variables are basic, among them those that are known to
        be."""
        for _ in range(MAX_PASSES):
            run_starts, run_ends = ~basic[:-1] & basic[1:], basic[:-1] & ~basic[1:]
            L, pivots = self._factors(
                self._below, self._diagonal, np.where(run_starts, 0.0, self._link)
            )
            back = self._factors(
                self._above[::-1],
                self._diagonal[::-1],
                np.where(run_ends, 0.0, self._link)[::-1],
            )
            y = self._solve(L, -q, uplo="L", diag="U")[0]
            y_back = self._solve(back[0], -q[::-1], uplo="L", diag="U")[0]
            w = q.copy()
            w[1:] += self._below * np.where(basic[:-1], (y / pivots)[:-1], 0.0)
            w[:-1] += self._above * np.where(basic[1:], (y_back / back[1])[-2::-1], 0.0)
            new_basic = basic | (y > 0.0) | (y_back[::-1] > 0.0) | (w < 0.0)
            if np.array_equal(new_basic, basic):
                break
            basic = new_basic
            raise_if_timed_out()
        U = np.asfortranarray(
            [np.append(0.0, np.where(run_starts | run_ends, 0.0, self._above)), pivots]
        )
        return np.maximum(
            self._solve(U, np.where(basic, y, 0.0), uplo="U")[0], 0.0
        ), basic

    def _factors(
        self, below: Vector, diagonal: Vector, link: Vector
    ) -> tuple[Vector, Vector]:
        """Return the factor L, which starts again at a link of 0, and the pivots. With
        y = -L^-1 q, y_i / pivots_i is the last component of the solution of the rows up
        to i."""
        pivots = self._factorize(diagonal, link)[0]
        L = np.ones((2, pivots.size), order="F")
        L[1, :-1] = np.where(link, below / pivots[:-1], 0.0)
        return L, pivots


def of_tridiagonal(M: Matrix) -> Elimination | None:
    """Return the elimination of a sparse tridiagonal M-matrix, or of one with a few
    positive entries off the diagonal; None for any other M."""
    if not may_be_eliminated(M):
        return None
    elimination = Elimination(M)
    return elimination if elimination.is_of_m_matrix else None


def eliminated(problem: Problem) -> Stage:
    """Yield the solution by elimination, or by block pivots from its basis. Stalled : M
    is not such a matrix, or the basis is far from right."""
    elimination = of_tridiagonal(problem.M)
    if elimination is None:
        return Stalled("M is no tridiagonal M-matrix")
    z, basic = elimination.solution(problem.q)
    basis = of_masks(basic)
    if not elimination.is_changed and Point(Criterion(problem), z).solves():
        yield Iterate(problem.box.x_within(z, problem.w(z), basis), None, "", 1)
        return Finished()
    return (yield from from_states(problem, basis))
