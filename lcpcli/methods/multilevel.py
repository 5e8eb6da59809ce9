"""Smoothed aggregation: coarse versions of a sparse matrix with positive diagonal, and preconditioning with them.

P. Vaněk, J. Mandel and M. Brezina, Algebraic multigrid by smoothed aggregation for second and fourth order elliptic
problems, Computing 56 (1996) 179-196. Aggregates around a maximal set of nodes at distances greater than 2:
N. Bell, S. Dalton and L. N. Olson, Exposing fine-grained parallelism in algebraic multigrid methods, SIAM Journal on
Scientific Computing 34 (2012) C123-C152, section 3. Basis functions truncated where a constraint is active:
R. Kornhuber, Monotone multigrid methods for elliptic variational inequalities I, Numerische Mathematik 69 (1994)
167-184.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from lcpcli.linalg.factors import Solve
from lcpcli.linalg.matrices import dense
from lcpcli.typing import Indices, Mask, Matrix, Vector

COARSEST = 150  # n up to which a matrix is inverted
STRENGTH = 0.08  # |a_ij| / sqrt(a_ii a_jj) above which j is a strong neighbour of i; halved from level to level
MAX_UNKNOWNS_RATIO = 0.6  # largest ratio of the numbers of unknowns from one level to the next
MAX_ENTRIES_RATIO = 1.5  # largest ratio of the numbers of entries from one level to the next
JACOBI_SWEEPS = 2  # of Jacobi relaxation before, and after, each coarse correction
RELAXATIONS = 10  # of the constant vector, which becomes one that relaxation hardly reduces
MOSTLY_BASIC = 0.75  # of an aggregate, by weight: it takes part in the correction of basic variables
FEW_LEFT = 3  # one node in so many is not covered yet: aggregates are then sought among these alone
REGULAR = 1e-14  # of the largest diagonal entry: what a coarsest matrix gets added


class Hierarchy:
    """Coarse versions P'AP of a matrix, each with the prolongation P to the next finer level.

    matrices : from the given one to the coarsest; scipy.sparse.csr_array.
    prolongations, tentative : from matrices[k + 1] to matrices[k], one fewer than matrices; and the prolongations
        before they are smoothed, with one entry a row, in order, and orthonormal columns.
    weights : those of Jacobi relaxation with matrices[k]. coarsest : the last matrix, dense.
    """

    def __init__(self, A: Matrix) -> None:
        """Coarsen A, a csr_array with a positive diagonal, until COARSEST unknowns are left.

        `stuck` : whether a level failed to become much smaller.
        """
        self.matrices, self.prolongations = [A], []
        self.tentative: list[Matrix] = []
        self.weights: list[Vector] = []
        self.stuck = False
        candidate = np.ones(A.shape[0])
        strength = STRENGTH
        while A.shape[0] > COARSEST:
            weights = _jacobi(A)
            T, candidate = _tentative(A, weights, candidate, strength)
            P = _smoothed(T, A, weights)
            finer, A = A, P.T.tocsr() @ (A @ P)
            self.stuck = P.shape[1] > MAX_UNKNOWNS_RATIO * P.shape[0] or A.nnz > MAX_ENTRIES_RATIO * finer.nnz
            if self.stuck:
                return
            self.matrices.append(A)
            self.prolongations.append(P)
            self.tentative.append(T)
            self.weights.append(weights)
            strength /= 2
        self.coarsest = dense(A)

    def preconditioner(self, basic: Mask) -> Solve:
        """Return one V-cycle for the principal submatrix of the basic variables, shape (n,), symmetric if A is; it
        takes and returns vectors of shape (n,) that are 0 elsewhere. Nothing is formed but masks: an aggregate counts
        as basic if most of it is, so that the coarse versions of the whole matrix serve for every submatrix. It raises
        SingularMatrix."""
        masks = [basic.astype(float)]
        for T in self.tentative:
            shares = np.bincount(T.indices, weights=T.data**2 * masks[-1], minlength=T.shape[1])
            masks.append((shares > MOSTLY_BASIC).astype(float))
        solve = _inverse(self.coarsest, masks.pop() > 0)
        levels = zip(self.matrices, self.prolongations, self.weights, masks, strict=False)
        for A, P, weights, mask in reversed(list(levels)):
            solve = partial(_v_cycle, A, P, weights * mask, mask, solve)
        return solve


def _inverse(A: Vector, basic: Mask) -> Solve:
    """Return a solver of systems with a principal submatrix of a small dense A, for vectors of shape (n,)."""
    diagonal = A.diagonal() * basic
    size = diagonal.max(initial=0.0) or 1.0
    block = np.where(np.outer(basic, basic), A, 0.0) + np.diag(np.where(diagonal <= REGULAR * size, size, REGULAR * size))
    inverse = np.linalg.inv(block) * basic
    return lambda b: inverse @ b


def _v_cycle(A: Matrix, P: Matrix, weights: Vector, mask: Vector, coarse: Solve, b: Vector) -> Vector:
    x = weights * b
    _relax(A, weights, x, b, JACOBI_SWEEPS - 1)
    residual = b - A @ x
    residual *= mask
    change = P @ coarse(P.T @ residual)
    change *= mask
    x += change
    _relax(A, weights, x, b, JACOBI_SWEEPS)
    return x


def _relax(A: Matrix, weights: Vector, x: Vector, b: Vector, sweeps: int) -> None:
    for _ in range(sweeps):
        residual = b - A @ x
        residual *= weights
        x += residual


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
    return csr_array((candidate / sizes[aggregate], aggregate, np.arange(n + 1, dtype=np.int32)), shape=(n, sizes.size)), sizes


def _smoothed(T: Matrix, A: Matrix, weights: Vector) -> Matrix:
    """Return T after one step of relaxation, with A and weights of shape (n, n) and (n,)."""
    change = (A @ T).tocsr()
    change.data *= np.repeat(weights, np.diff(change.indptr))
    return T - change


def _aggregates(A: Matrix, strength: float) -> Indices:
    """Return for each unknown the number of its aggregate, shape (n,)."""
    n = A.shape[0]
    indptr, indices = _strong_neighbours(A, strength)
    rank = np.random.default_rng(0).permutation(n).astype(np.int32) + 1
    root = np.zeros(n, dtype=bool)
    left = _cover(indptr, indices, rank, root, n // FEW_LEFT)
    if left.any():
        maximum = partial(_neighbourhood_maximum, indptr, indices)
        near = np.flatnonzero(maximum(maximum(left)))
        rows = _rows(indptr, indices, near)
        among = np.zeros(near.size, dtype=bool)
        _cover(*rows, left[near], among, 0)
        root[near[among]] = True
    aggregate = np.zeros(n, dtype=np.int32)
    aggregate[root] = np.arange(1, np.count_nonzero(root) + 1)
    for _ in range(2):
        aggregate = np.where(aggregate, aggregate, _neighbourhood_maximum(indptr, indices, aggregate))
    return aggregate - 1


def _cover(indptr: Indices, indices: Indices, rank: Vector, root: Mask, enough: int) -> Vector:
    """Add roots at distances greater than 2 until at most `enough` nodes are farther than 2 from all of them; return
    the ranks of these, and 0 for the others."""
    maximum = partial(_neighbourhood_maximum, indptr, indices)
    while np.count_nonzero(rank) > enough:
        new = (maximum(maximum(rank)) == rank) & (rank > 0)
        root |= new
        rank = np.where(maximum(maximum(new.view(np.int8))), 0, rank)
    return rank


def _neighbourhood_maximum(indptr: Indices, indices: Indices, values: Any) -> Any:
    return np.maximum.reduceat(values[indices], indptr[:-1])


def _rows(indptr: Indices, indices: Indices, nodes: Indices) -> tuple[Indices, Indices]:
    """Return the rows of some nodes, with only the columns of these, renumbered."""
    from scipy.sparse import csr_array

    n = indptr.size - 1
    graph = csr_array((np.ones(indices.size, dtype=np.int8), indices, indptr), shape=(n, n))[nodes][:, nodes]
    return graph.indptr, graph.indices


def _strong_neighbours(A: Matrix, strength: float) -> tuple[Indices, Indices]:
    """Return the strong connections, with every node its own neighbour, as row pointers and column indices."""
    root = np.sqrt(np.maximum(A.diagonal(), 0))
    rows = np.repeat(np.arange(A.shape[0], dtype=A.indices.dtype), np.diff(A.indptr))
    keep = (np.abs(A.data) >= strength * root[rows] * root[A.indices]) | (rows == A.indices)
    return np.concatenate(([0], np.cumsum(keep)))[A.indptr], A.indices[keep]
