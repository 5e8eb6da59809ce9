"""Elimination for tridiagonal LCPs with an M-matrix, as for American options and optimal stopping.

As none of the variables that have to be basic for some of the rows ceases to be so for all of them (R. Chandrasekaran,
A special case of the complementary pivot problem, Opsearch 7 (1970) 263-268), variables are only ever added. Gaussian
elimination along a run of basic variables goes on through the variables beyond its end, as if these were basic too:
where the eliminated right-hand side is positive, they are. That is done for all runs at once, in both directions.

With a single run that begins at an end of the grid, that is the elimination of M. J. Brennan and E. S. Schwartz, The
valuation of American put options, Journal of Finance 32 (1977) 449-462, justified for M-matrices by P. Jaillet,
D. Lamberton and B. Lapeyre, Variational inequalities and the pricing of American options, Acta Applicandae Mathematicae
21 (1990) 263-289. Any number of runs in O(n) operations, one variable after another: R. W. Cottle and R. S. Sacher, On
the solution of large, structured linear complementarity problems: the tridiagonal case, Applied Mathematics and
Optimization 3 (1977) 321-340. What is found has to be verified.
"""

from __future__ import annotations

import numpy as np

from lcpcli.clock import imports
from lcpcli.interrupts import check
from lcpcli.linalg.matrices import is_sparse, width
from lcpcli.methods.newton import from_states
from lcpcli.methods.stages import Finished, Iterate, Stage, Stalled
from lcpcli.model.box import of_masks
from lcpcli.model.problem import Problem
from lcpcli.typing import Mask, Matrix, Vector
from lcpcli.verify.point import Criterion, Point

MOST_PASSES = 50  # after which exchanges take over


class Elimination:
    """A tridiagonal matrix, prepared for LCPs with one right-hand side after another.

    is_of_m_matrix : whether it is an M-matrix: no entry off the diagonal is positive, and all pivots are.
    """

    def __init__(self, M: Matrix) -> None:
        with imports:
            from scipy.linalg.lapack import dpttrf, dtbtrs
        self._factorize, self._solve = dpttrf, dtbtrs
        self._below, self._diagonal, self._above = (M.diagonal(side) for side in (-1, 0, 1))
        with np.errstate(invalid="ignore"):
            self._link = np.sqrt(-self._below) * np.sqrt(-self._above)  # of a symmetric matrix with the same pivots
        has_signs = max(self._below.max(), self._above.max()) <= 0.0
        self.is_of_m_matrix = bool(has_signs and not dpttrf(self._diagonal, self._link)[2])

    @np.errstate(all="ignore")
    def solution(self, q: Vector) -> tuple[Vector, Mask]:
        """Return z, shape (n,), and which variables are basic, for an M-matrix and a q."""
        basic = np.zeros(q.size, np.bool_)
        for _ in range(MOST_PASSES):
            begins, ends = ~basic[:-1] & basic[1:], basic[:-1] & ~basic[1:]
            y, pivots = self._eliminated(self._below, self._diagonal, np.where(begins, 0.0, self._link), q)
            back = self._eliminated(
                self._above[::-1], self._diagonal[::-1], np.where(ends, 0.0, self._link)[::-1], q[::-1]
            )
            y_back, pivots_back = (part[::-1] for part in back)
            w = q.copy()
            w[1:] += self._below * np.where(basic[:-1], (y / pivots)[:-1], 0.0)
            w[:-1] += self._above * np.where(basic[1:], (y_back / pivots_back)[1:], 0.0)
            found = basic | (y > 0.0) | (y_back > 0.0) | (w < 0.0)
            if np.array_equal(found, basic):
                break
            basic = found
            check()
        U = np.zeros((2, q.size), order="F")
        U[0, 1:], U[1] = np.where(ends, 0.0, self._above), pivots
        z = self._solve(U, np.where(basic, y, 0.0), uplo="U")[0]
        return np.maximum(z, 0.0), basic

    def _eliminated(self, below: Vector, diagonal: Vector, link: Vector, q: Vector) -> tuple[Vector, Vector]:
        """Return the right-hand side -q after elimination from the first row on, where a link of 0 begins anew, and the
        pivots: the quotients are the last components of the solutions so far."""
        pivots = self._factorize(diagonal, link)[0]
        L = np.ones((2, q.size), order="F")
        L[1, :-1] = np.where(link, below / pivots[:-1], 0.0)
        return self._solve(L, -q, uplo="L", diag="U")[0], pivots


def elimination(M: Matrix) -> Elimination | None:
    """Return the elimination of a sparse tridiagonal M-matrix; None for any other M."""
    if not (is_sparse(M) and M.shape[0] > 1 and M.nnz <= 3 * M.shape[0] and width(M) <= 1):
        return None
    own = Elimination(M)
    return own if own.is_of_m_matrix else None


def eliminated(problem: Problem) -> Stage:
    """Yield the solution by elimination; M is tridiagonal.

    Stalled : M is no M-matrix, or rounding has led to wrong states."""
    own = elimination(problem.M)
    if own is None:
        return Stalled("M is no tridiagonal M-matrix")
    z, basic = own.solution(problem.q)
    basis = of_masks(basic)
    if Point(Criterion(problem), z).solves():
        yield Iterate(problem.box.x_within(z, problem.w(z), basis), None, "", 1)
        return Finished()
    return (yield from from_states(problem, basis))
