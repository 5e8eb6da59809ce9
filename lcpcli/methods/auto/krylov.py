"""Block principal pivoting without a factorization, for large sparse matrices.

J. J. Júdice and F. M. Pires, A block principal pivoting algorithm for large-scale strictly monotone linear
complementarity problems, Computers and Operations Research 21 (1994) 587-596, as a semismooth Newton method (M.
Hintermüller, K. Ito and K. Kunisch, The primal-dual active set strategy as a semismooth Newton method, SIAM Journal on
Optimization 13 (2003) 865-888), with inexact solves: each step only has to reduce the residual by a digit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.krylov import bicgstab, conjugate_gradients, identity, norm
from lcpcli.linalg.matrices import is_symmetric
from lcpcli.linalg.products import absolute_product
from lcpcli.methods.auto.multilevel import Hierarchy
from lcpcli.methods.iterate import Breakdown, Iterate, Stalled
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Mask, Matrix, Vector

REDUCTION = 0.1  # of the residual by one inexact solve
SETTLED = 1e-3  # the same once P has not changed from the last step
PATIENCE = 20  # products with M for a digit: more tell of an ill-conditioned M
PATIENCE_MULTILEVEL = 120  # they cost less than a factorization even so
REUSE = 0.03  # of P may differ from the set that the preconditioner was made for
WAIT = 6  # pivoting steps without a new least residual, before it is said to cycle
ROUNDING = 100 * float(np.finfo(np.float64).eps)
COARSE = 1e-3  # residual relative to |q| to which the coarse problems are solved, in at most COARSE_STEPS steps
COARSE_STEPS = 12

Preconditioner = Callable[[Indices, Matrix], Callable[[Vector], Vector]]


def krylov(problem: Problem, x0: Vector) -> Iterator[Iterate]:
    """Pivot on all wrong signs at once, M_PP z_P = -q_P solved by conjugate gradients or, nonsymmetric, by BiCGSTAB.

    M must be sparse with positive diagonal, best all ones. A solve starts from the last z and ends when its residual is
    a tenth of what min(z, Mz + q) was, so that P is settled on the way to the last digits. No memory is needed beyond
    some ten vectors and one submatrix.

    Parameters
    ----------
    problem : the LCP, n unknowns, M sparse.
    x0 : starting point, shape (n,).

    Yields
    ------
    Iterate : x0, then x = (z - w) / 2 for each pivoting step. Evaluations are products with M.

    Raises
    ------
    Breakdown : a diagonal entry is not positive, a solve has not reached its aim in PATIENCE products for a digit, or
        pivoting cycles; M is too ill conditioned for this method, or not a P-matrix.
    Stalled : the residual has stopped falling at rounding level.
    """
    yield Iterate(x0, None, "", 0)
    inner = _Inner(is_symmetric(problem.M))
    yield from _iterates(problem.M, problem.q, 2 * np.maximum(x0, 0), inner)


def multilevel(problem: Problem, x0: Vector) -> Iterator[Iterate]:
    """The same for symmetric positive definite M of any condition, with `multilevel.Hierarchy` in two places.

    It preconditions the conjugate gradients, and its coarse problems P'MP z + P'q, solved first and roughly, give the
    start: block pivoting moves the boundary of the active set by one ring of neighbours a step, so that it must begin
    near its place. Parameters, yields and raises as `krylov`, except that x0 is only yielded, not used.
    """
    yield Iterate(x0, None, "", 0)
    hierarchy = Hierarchy(problem.M)
    z = _coarse_start(hierarchy, problem.q)
    yield from _iterates(problem.M, problem.q, z, _Inner(True, _preconditioner(hierarchy, 0)))


def _iterates(M: Matrix, q: Vector, z: Vector, inner: _Inner) -> Iterator[Iterate]:
    for state in _pivot(M, q, z, inner):
        w = np.where(state.inside, 0, np.maximum(state.w, 0))
        yield Iterate(0.5 * (np.maximum(state.z, 0) - w), None, "", inner.products)


def _coarse_start(hierarchy: Hierarchy, q: Vector) -> Vector:
    loads = [q]
    for P in hierarchy.prolongations:
        loads.append(P.T @ loads[-1])
    z = np.zeros(loads[-1].size)
    for level in range(len(loads) - 1, 0, -1):
        inner = _Inner(True, _preconditioner(hierarchy, level))
        aim = COARSE * norm(loads[level])
        for step, state in enumerate(_pivot(hierarchy.matrices[level], loads[level], z, inner)):
            z = state.z
            if state.size <= aim or step >= COARSE_STEPS:
                break
        z = hierarchy.prolongations[level - 1] @ np.maximum(z, 0)
    return z


def _preconditioner(hierarchy: Hierarchy, level: int) -> Preconditioner:
    return lambda indices, block: hierarchy.preconditioner(level, indices, block)


class _State(NamedTuple):
    """z and w = M z + q, shape (n,), the mask of P, and |min(diag(M) z, w)|_2."""

    z: Vector
    w: Vector
    inside: Mask
    size: float


def _pivot(M: Matrix, q: Vector, z: Vector, inner: _Inner) -> Iterator[_State]:
    diagonal = M.diagonal()
    if not diagonal.min() > 0:
        raise Breakdown("a diagonal entry of M is not positive")
    w = M @ z + q
    size = least = norm(np.minimum(z * diagonal, w))
    waited, inside = 0, np.zeros(q.size, dtype=bool)
    if size == 0:
        yield _State(z, w, z > 0, size)
        return
    while True:
        scaled = z * diagonal
        before, inside = inside, scaled > w
        settled = np.array_equal(before, inside)
        if not settled:
            inner.take(M, np.flatnonzero(inside))
        start, z = z, np.zeros(q.size)
        z[inner.indices] = inner.solve(-q[inner.indices], start[inner.indices], size, SETTLED if settled else REDUCTION)
        w = M @ z
        w += q
        size = norm(np.minimum(z * diagonal, w))
        yield _State(z, w, inside, size)
        waited = 0 if size < least else waited + 1
        least = min(size, least)
        if size == 0:
            return
        if waited >= WAIT:
            if least <= ROUNDING * norm(absolute_product(M, np.abs(z)) + np.abs(q)):
                raise Stalled("the residual has stopped falling at rounding level")
            raise Breakdown("block principal pivoting has stopped making progress")


class _Inner:
    """Solves with principal submatrices by a Krylov method, preconditioned if there is something to do it with."""

    def __init__(self, symmetric: bool, precondition: Preconditioner | None = None) -> None:
        self._method, self._cost = (conjugate_gradients, 1) if symmetric else (bicgstab, 2)
        self._precondition = precondition
        self._patience = PATIENCE if precondition is None else PATIENCE_MULTILEVEL
        self._cycle: Callable[[Vector], Vector] = identity
        self._built_cycle: Callable[[Vector], Vector] = identity
        self._built: Indices = np.zeros(0, dtype=np.intp)
        self.products = 1
        self.indices: Indices = np.zeros(0, dtype=np.intp)

    def take(self, M: Matrix, indices: Indices) -> None:
        """Turn to the principal submatrix of these indices."""
        self.indices = indices
        self._block = M if indices.size == M.shape[0] else M[indices][:, indices]
        if self._precondition is None or not indices.size:
            return
        places = np.full(M.shape[0], -1)
        places[self._built] = np.arange(self._built.size)
        places = places[indices]
        known = np.flatnonzero(places >= 0)
        if indices.size + self._built.size - 2 * known.size <= REUSE * indices.size:
            self._cycle = _carried_over(self._built_cycle, self._built.size, places[known], known)
            return
        try:
            self._cycle = self._built_cycle = self._precondition(indices, self._block)
        except SingularMatrix:
            raise Breakdown("a coarse version of M is singular") from None
        self._built = indices

    def solve(self, b: Vector, start: Vector, residual: float, reduction: float) -> Vector:
        """y with |b - A y|_2 <= reduction * residual, from a start."""
        self.products += 1
        if not b.size:
            return b
        most = int(self._patience * -np.log10(reduction)) // self._cost
        with np.errstate(all="ignore"):
            y, left = self._method(self._product, b, start, reduction * residual, most, self._cycle)
        if not left <= REDUCTION * residual:
            raise Breakdown(f"{self._patience} products with M have not given a digit")
        return y

    def _product(self, v: Vector) -> Vector:
        self.products += 1
        image: Vector = self._block @ v
        return image


def _carried_over(
    cycle: Callable[[Vector], Vector], size: int, places: Indices, known: Indices
) -> Callable[[Vector], Vector]:
    """A preconditioner for one index set from that of another, of given size: its principal part, and the identity.

    known are the positions of the common indices in the new set, places those in the old one.
    """

    def carried(b: Vector) -> Vector:
        old = np.zeros(size)
        old[places] = b[known]
        x: Vector = b.copy()
        x[known] = cycle(old)[places]
        return x

    return carried
