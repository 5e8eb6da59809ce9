"""Smoothed aggregation: coarse versions of a sparse symmetric positive definite matrix, and preconditioning with them.

P. Vaněk, J. Mandel and M. Brezina, Algebraic multigrid by smoothed aggregation for second and fourth order elliptic
problems, Computing 56 (1996) 179-196. Aggregates around a maximal set of nodes at distances greater than 2:
N. Bell, S. Dalton and L. N. Olson, Exposing fine-grained parallelism in algebraic multigrid methods, SIAM Journal on
Scientific Computing 34 (2012) C123-C152, section 3.
"""

from __future__ import annotations

from functools import partial
from typing import Any, TypeAlias

import numpy as np

from lcpcli.linalg.factors import SingularMatrix, Solve, sparse_lu
from lcpcli.linalg.krylov import identity
from lcpcli.linalg.matrices import plus_diagonal
from lcpcli.typing import Indices, Matrix, Vector

COARSEST = 500  # n up to which a matrix is factorized
STRENGTH = 0.08  # |a_ij| / sqrt(a_ii a_jj) above which j is a strong neighbour of i; halved from level to level
MAX_UNKNOWNS_RATIO = 0.6  # largest ratio of the numbers of unknowns from one level to the next
MAX_ENTRIES_RATIO = 1.5  # largest ratio of the numbers of entries from one level to the next
JACOBI_SWEEPS = 2  # of Jacobi relaxation before, and after, each coarse correction
RELAXATIONS = 10  # of the constant vector, which becomes one that relaxation hardly reduces
REUSE_CHANGE = 0.03  # of an index set: how far it may differ from that for which a preconditioner was built


Level: TypeAlias = tuple[Matrix, Matrix, Matrix, Vector]
"""A matrix A (n, n), the prolongation P (n, m) from the next coarser level, P', and the weights of Jacobi (n,)."""


class Hierarchy:
    """Coarse versions P'AP of a matrix, each with the prolongation P to the next finer level.

    matrices : from the given one to the coarsest; scipy.sparse.csr_array.
    prolongations, tentative : from matrices[k + 1] to matrices[k], one fewer than matrices; and the prolongations
        before they are smoothed, with one entry a row and orthonormal columns.
    """

    def __init__(self, A: Matrix) -> None:
        """Coarsen A, a csr_array with a positive diagonal, until COARSEST unknowns are left.

        `stuck` : whether a level failed to become much smaller.
        """
        self.matrices, self.prolongations = [A], []
        self.tentative: list[Matrix] = []
        self.stuck = False
        candidate = np.ones(A.shape[0])
        strength = STRENGTH
        while A.shape[0] > COARSEST:
            weights = _jacobi(A)
            T, candidate = _tentative(A, weights, candidate, strength)
            P = _smoothed(T, A, weights)
            finer, A = A, (P.T @ (A @ P)).tocsr()
            self.stuck = P.shape[1] > MAX_UNKNOWNS_RATIO * P.shape[0] or A.nnz > MAX_ENTRIES_RATIO * finer.nnz
            if self.stuck:
                return
            self.matrices.append(A)
            self.prolongations.append(P)
            self.tentative.append(T)
            strength /= 2

    def preconditioner(self, level: int, indices: Indices, block: Matrix) -> Solve:
        """Return one symmetric V-cycle for a principal submatrix, the block of matrices[level] at the given indices.

        It keeps the aggregates, but smooths the prolongations anew with the block, so that they decay to zero at the
        edge of the index set: if they are merely truncated there, more than twice the iterations are needed.
        """
        levels = []
        for k, full in enumerate(self.tentative[level:]):
            weights = _jacobi(block)
            P = _smoothed(full[indices] if k == 0 else full, block, weights)
            restriction = P.T.tocsr()
            levels.append((block, P, restriction, weights))
            block = restriction @ (block @ P)
        diagonal = block.diagonal()
        size = diagonal.max(initial=0.0) or 1.0
        floor = np.where(diagonal <= 1e-14 * size, size, 1e-14 * size)
        coarse = sparse_lu(symmetric=True)(plus_diagonal(block, floor)).solve
        return lambda b: _v_cycle(levels, coarse, b)


class Preconditioners:
    """Preconditioners of principal submatrices of one level, one after another, carried over while the indices
    change little."""

    def __init__(self, hierarchy: Hierarchy, level: int) -> None:
        self._new = partial(hierarchy.preconditioner, level)
        self._built: Indices = np.zeros(0, dtype=np.intp)
        self._cycle: Solve = identity

    def __call__(self, indices: Indices, block: Matrix) -> Solve:
        """Return the preconditioner of the block at the given indices; raise SingularMatrix if there is none."""
        positions = np.full(max(indices.max(), self._built.max(initial=0)) + 1, -1)
        positions[self._built] = np.arange(self._built.size)
        known = np.flatnonzero(positions[indices] >= 0)
        places = positions[indices[known]]
        if indices.size + self._built.size - 2 * known.size > REUSE_CHANGE * indices.size:
            try:
                self._cycle = self._new(indices, block)
            except SingularMatrix:
                raise SingularMatrix("a coarse version of M is singular") from None
            self._built = indices
            return self._cycle
        built, cycle = self._built.size, self._cycle

        def carried(b: Vector) -> Vector:
            """Apply the preconditioner of the former block to the indices in common, and the identity to the others."""
            old = np.zeros(built)
            old[places] = b[known]
            x: Vector = b.copy()
            x[known] = cycle(old)[places]
            return x

        return carried


def _v_cycle(levels: list[Level], coarse: Solve, b: Vector) -> Vector:
    if not levels:
        return coarse(b)
    A, P, restriction, weights = levels[0]
    x = weights * b
    for _ in range(JACOBI_SWEEPS - 1):
        x += weights * (b - A @ x)
    x += P @ _v_cycle(levels[1:], coarse, restriction @ (b - A @ x))
    for _ in range(JACOBI_SWEEPS):
        x += weights * (b - A @ x)
    return x


def _jacobi(A: Matrix) -> Vector:
    """Return the weights of damped Jacobi relaxation x += weights * (b - A x), 4/3 over a spectral bound."""
    diagonal = A.diagonal()
    inverse = np.where(diagonal > 0, 1 / np.where(diagonal > 0, diagonal, 1), 0)
    radius = float((inverse * (abs(A) @ np.ones(A.shape[0]))).max()) or 1.0
    return np.asarray(4 / 3 / radius * inverse)


def _tentative(A: Matrix, weights: Vector, candidate: Vector, strength: float) -> tuple[Matrix, Vector]:
    """Return the piecewise prolongation with the relaxed candidate in its range, and the coarse candidate."""
    from scipy.sparse import csr_array

    n = A.shape[0]
    for _ in range(RELAXATIONS):
        candidate = candidate - weights * (A @ candidate)
    candidate = np.where(candidate > 0, candidate, candidate.max() * 1e-3)
    aggregate = _aggregates(A, strength)
    sizes = np.sqrt(np.bincount(aggregate, weights=candidate**2))
    return csr_array((candidate / sizes[aggregate], aggregate, np.arange(n + 1)), shape=(n, sizes.size)), sizes


def _smoothed(T: Matrix, A: Matrix, weights: Vector) -> Matrix:
    """Return T after one step of relaxation, with A and weights of shape (n, n) and (n,)."""
    change = (A @ T).tocsr()
    change.data *= np.repeat(weights, np.diff(change.indptr))
    return T - change


def _aggregates(A: Matrix, strength: float) -> Indices:
    """Return for each unknown the number of its aggregate, shape (n,)."""
    n = A.shape[0]
    indptr, indices = _strong_neighbours(A, strength)

    def neighbourhood_maximum(v: Any) -> Any:
        return np.maximum.reduceat(v[indices], indptr[:-1])

    rank = np.random.default_rng(0).permutation(n)
    unassigned, root = np.ones(n, dtype=bool), np.zeros(n, dtype=bool)
    while unassigned.any():
        v = np.where(unassigned, rank, -1)
        new = unassigned & (neighbourhood_maximum(neighbourhood_maximum(v)) == v)
        root |= new
        unassigned &= ~neighbourhood_maximum(neighbourhood_maximum(new))
    aggregate = np.full(n, -1)
    aggregate[root] = np.arange(np.count_nonzero(root))
    aggregate = neighbourhood_maximum(aggregate)
    return np.asarray(np.where(aggregate < 0, neighbourhood_maximum(aggregate), aggregate))


def _strong_neighbours(A: Matrix, strength: float) -> tuple[Indices, Indices]:
    """Return the strong connections, with every node its own neighbour, as row pointers and column indices."""
    root = np.sqrt(np.maximum(A.diagonal(), 0))
    rows = np.repeat(np.arange(A.shape[0]), np.diff(A.indptr))
    keep = (np.abs(A.data) >= strength * root[rows] * root[A.indices]) | (rows == A.indices)
    counts = np.bincount(rows[keep], minlength=A.shape[0])
    return np.concatenate(([0], np.cumsum(counts))), A.indices[keep]
