"""Elimination for tridiagonal LCPs with an M-matrix, as for American options and optimal stopping.

As none of the variables that have to be basic for some of the rows ceases to be so for all of them (R. Chandrasekaran,
A special case of the complementary pivot problem, Opsearch 7 (1970) 263-268), variables are only ever added. Gaussian
elimination along a run of basic variables goes on through the variables beyond its end, as if these were basic too:
where the eliminated right-hand side is positive, they are. That is done for all runs at once, in both directions.

With a single run from an end of the grid, a single elimination is enough: M. J. Brennan and E. S. Schwartz, The
valuation of American put options, Journal of Finance 32 (1977) 449-462, and for M-matrices P. Jaillet, D. Lamberton and
B. Lapeyre, Variational inequalities and the pricing of American options, Acta Applicandae Mathematicae 21 (1990)
263-289. Any number of runs in O(n) operations, one variable after another: R. W. Cottle and R. S. Sacher, On
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
        self._known = dict[int, tuple[Vector, Vector]]()
        self.is_of_m_matrix = bool(has_signs and not dpttrf(self._diagonal, self._link)[2])

    def _whole(self, turn: int) -> tuple[Vector, Vector]:
        """Return the factors L and U without cuts, in the order of rows (1) or in the opposite order (-1)."""
        if turn not in self._known:
            below, above = (self._below, self._above)[::turn]
            L, pivots = self._factors(below[::turn], self._diagonal[::turn], self._link[::turn])
            self._known[turn] = L, _upper(pivots, above[::turn])
        return self._known[turn]

    @np.errstate(all="ignore")
    def solution(self, q: Vector) -> tuple[Vector, Mask]:
        """Return z, shape (n,), and which variables are basic, for an M-matrix and a q."""
        n, basic = q.size, q < 0.0
        for turn in (1, -1) if basic.argmax() < basic[::-1].argmax() else (-1, 1):
            L, U = self._whole(turn)
            y, own = self._solve(L, -q[::turn], uplo="L", diag="U")[0], q[::turn]
            is_basic = y > 0.0
            count = n - int(is_basic[::-1].argmax()) if is_basic.any() else 0
            if not (own[count + 1 :] < 0.0).any():  # as y = -w in row `count`
                z = np.zeros(n)
                z[:count] = self._solve(U[:, :count], y[:count], uplo="U")[0] if count else 0.0
                if z.min() >= 0.0:
                    return z[::turn].copy(), (np.arange(n) < count)[::turn]
            basic |= is_basic[::turn]
        return self._in_runs(q, basic)

    def _in_runs(self, q: Vector, basic: Mask) -> tuple[Vector, Mask]:
        """Return z and which variables are basic, among them those that are known to be."""
        for _ in range(MOST_PASSES):
            begins, ends = ~basic[:-1] & basic[1:], basic[:-1] & ~basic[1:]
            L, pivots = self._factors(self._below, self._diagonal, np.where(begins, 0.0, self._link))
            back = self._factors(self._above[::-1], self._diagonal[::-1], np.where(ends, 0.0, self._link)[::-1])
            y = self._solve(L, -q, uplo="L", diag="U")[0]
            y_back = self._solve(back[0], -q[::-1], uplo="L", diag="U")[0]
            w = q.copy()
            w[1:] += self._below * np.where(basic[:-1], (y / pivots)[:-1], 0.0)
            w[:-1] += self._above * np.where(basic[1:], (y_back / back[1])[-2::-1], 0.0)
            found = basic | (y > 0.0) | (y_back[::-1] > 0.0) | (w < 0.0)
            if np.array_equal(found, basic):
                break
            basic = found
            check()
        U = _upper(pivots, np.where(ends, 0.0, self._above))
        return np.maximum(self._solve(U, np.where(basic, y, 0.0), uplo="U")[0], 0.0), basic

    def _factors(self, below: Vector, diagonal: Vector, link: Vector) -> tuple[Vector, Vector]:
        """Return the factor L, which begins anew at a link of 0, and the pivots. With y = -L^-1 q, y_i / pivots_i is
        the last component of the solution of the rows up to i."""
        pivots = self._factorize(diagonal, link)[0]
        L = np.ones((2, pivots.size), order="F")
        L[1, :-1] = np.where(link, below / pivots[:-1], 0.0)
        return L, pivots


def _upper(pivots: Vector, above: Vector) -> Vector:
    U = np.zeros((2, pivots.size), order="F")
    U[0, 1:], U[1] = above, pivots
    return U


def of_tridiagonal(M: Matrix) -> Elimination | None:
    """Return the elimination of a sparse tridiagonal M-matrix; None for any other M."""
    if not (is_sparse(M) and M.shape[0] > 1 and M.nnz <= 3 * M.shape[0] and width(M) <= 1):
        return None
    own = Elimination(M)
    return own if own.is_of_m_matrix else None


def eliminated(problem: Problem) -> Stage:
    """Yield the solution by elimination; M is tridiagonal.

    Stalled : M is no M-matrix, or rounding has led to wrong states."""
    own = of_tridiagonal(problem.M)
    if own is None:
        return Stalled("M is no tridiagonal M-matrix")
    z, basic = own.solution(problem.q)
    basis = of_masks(basic)
    if Point(Criterion(problem), z).solves():
        yield Iterate(problem.box.x_within(z, problem.w(z), basis), None, "", 1)
        return Finished()
    return (yield from from_states(problem, basis))
