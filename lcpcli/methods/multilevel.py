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

from lcpcli.clock import imports
from lcpcli.linalg.doubles import generator
from lcpcli.linalg.factors import Solve
from lcpcli.linalg.matrices import absolute_product, dense, plus_diagonal
from lcpcli.typing import Indices, Mask, Matrix, Vector

COARSEST = 150  # n up to which a matrix is inverted
STRENGTH = 0.08  # |a_ij| / sqrt(a_ii a_jj) above which j is a strong neighbour of i; halved from level to level
MAX_UNKNOWNS_RATIO = 0.6  # largest ratio of the numbers of unknowns from one level to the next
MAX_ENTRIES_RATIO = 1.5  # largest ratio of the number of entries of a coarse version to that of the matrix
# Times the usual weights, for the two sweeps of Jacobi relaxation before each coarse correction, and in reverse after
# it: those of Chebyshev's polynomial for the upper eight ninths of the spectrum.
SWEEPS = 0.86, 3.11
RELAXATIONS = 10  # of the constant vector, which becomes one that relaxation hardly reduces
MOSTLY_BASIC = 0.8  # of an aggregate, by weight: it takes part in the correction of basic variables
MOST_PADDED = 2  # times the entries of a graph: those of a table of neighbours, which is three times as fast
FEW_LEFT = 50  # one node in so many may be farther than 2 from all roots
REGULAR = 1e-14  # of the largest diagonal entry: what a coarsest matrix gets added


class Hierarchy:
    """Coarse versions P'AP of a matrix, each with the prolongation P to the next finer level.

    matrices : from the given one to the coarsest; scipy.sparse.csr_array.
    prolongations, tentative : from matrices[k + 1] to matrices[k], one fewer than matrices; and the prolongations
        before they are smoothed, with one entry a row, in order, and orthonormal columns. restrictions, averages : the
        transposes of both.
    weights : those of Jacobi relaxation with matrices[k]. coarsest : the last matrix, dense.
    """

    prolongations: list[Matrix]
    restrictions: list[Matrix]
    tentative: list[Matrix]
    averages: list[Matrix]
    weights: list[Vector]

    def __init__(self, A: Matrix) -> None:
        """Coarsen A, a csr_array with a positive diagonal, until COARSEST unknowns are left.

        `stuck` : whether a level failed to become much smaller.
        """
        self.matrices, self.weights = [A], []
        self.prolongations, self.restrictions, self.tentative, self.averages = [], [], [], []
        self.stuck = False
        candidate = np.ones(A.shape[0])
        strength = STRENGTH
        while A.shape[0] > COARSEST:
            weights = _jacobi(A)
            candidate = _relaxed(A, weights, candidate)
            strong = _strong(A, strength, candidate)
            T, candidate = _tentative(_aggregates(strong), candidate)
            P = _smoothed(T, strong, weights)
            A = P.T.tocsr() @ (A @ P)
            is_dense = A.nnz > MAX_ENTRIES_RATIO * self.matrices[0].nnz
            self.stuck = is_dense or P.shape[1] > MAX_UNKNOWNS_RATIO * P.shape[0]
            if self.stuck:
                return
            self.matrices.append(A)
            self.prolongations.append(P)
            self.restrictions.append(P.T)
            self.tentative.append(T)
            self.averages.append(T.T)
            self.weights.append(weights)
            strength /= 2
        self.coarsest = dense(A)
        self._last: tuple[Mask, Solve] | None = None

    def preconditioner(self, basic: Mask) -> Solve:
        """Return one V-cycle for the principal submatrix of the basic variables, shape (n,), symmetric if A is; it
        takes and returns vectors of shape (n,) that are 0 elsewhere. Nothing is formed but masks: an aggregate counts
        as basic if most of it is, so that the coarse versions of the whole matrix serve for every submatrix. It raises
        SingularMatrix."""
        masks = [basic.astype(float)]
        for T in self.tentative:
            shares = np.bincount(T.indices, weights=T.data**2 * masks[-1], minlength=T.shape[1])
            masks.append((shares > MOSTLY_BASIC).astype(float))
        basic = masks.pop() > 0
        if self._last is None or not np.array_equal(basic, self._last[0]):
            self._last = basic, _inverse(self.coarsest, basic)
        solve = self._last[1]
        levels = zip(self.matrices, self.prolongations, self.restrictions, self.weights, masks, strict=False)
        for A, P, R, weights, mask in reversed(list(levels)):
            solve = partial(_v_cycle, A, P, R, weights * mask, mask, solve)
        return solve


def _inverse(A: Vector, basic: Mask) -> Solve:
    """Return a solver of systems with a principal submatrix of a small dense A, for vectors of shape (n,)."""
    diagonal = A.diagonal() * basic
    size = diagonal.max(initial=0.0) or 1.0
    regular = np.diag(np.where(diagonal <= REGULAR * size, size, REGULAR * size))
    inverse = np.linalg.inv(np.where(np.outer(basic, basic), A, 0.0) + regular) * basic
    return lambda b: inverse @ b


def _v_cycle(A: Matrix, P: Matrix, R: Matrix, weights: Vector, mask: Vector, coarse: Solve, b: Vector) -> Vector:
    first, second = SWEEPS
    x = weights * b
    x *= first
    _relax(A, weights, second, x, b)
    residual = b - A @ x
    residual *= mask
    change = P @ coarse(R @ residual)
    change *= mask
    x += change
    _relax(A, weights, second, x, b)
    _relax(A, weights, first, x, b)
    return x


def _relax(A: Matrix, weights: Vector, factor: float, x: Vector, b: Vector) -> None:
    """Add factor * weights * (b - A x) to x."""
    residual = A @ x
    np.subtract(b, residual, out=residual)
    residual *= weights
    residual *= factor
    x += residual


def _jacobi(A: Matrix) -> Vector:
    """Return the weights of damped Jacobi relaxation x += weights * (b - A x), 4/3 over a spectral bound."""
    diagonal = A.diagonal()
    inverse = np.where(diagonal > 0, 1 / np.where(diagonal > 0, diagonal, 1), 0)
    radius = float((inverse * absolute_product(A, np.ones(A.shape[0]))).max()) or 1.0
    return np.asarray(4 / 3 / radius * inverse)


def _relaxed(A: Matrix, weights: Vector, candidate: Vector) -> Vector:
    """Return the positive vector that RELAXATIONS make of the candidate."""
    for _ in range(RELAXATIONS):
        candidate = candidate - weights * (A @ candidate)
    return np.where(candidate > 0, candidate, candidate.max() * 1e-3)


def _tentative(aggregate: Indices, candidate: Vector) -> tuple[Matrix, Vector]:
    """Return the piecewise prolongation with the candidate in its range, and the coarse candidate."""
    with imports:
        from scipy.sparse import csr_array
    sizes = np.sqrt(np.bincount(aggregate, weights=candidate**2))
    entries = candidate / sizes[aggregate], aggregate, np.arange(aggregate.size + 1, dtype=np.int32)
    return csr_array(entries, shape=(aggregate.size, sizes.size)), sizes


def _smoothed(T: Matrix, A: Matrix, weights: Vector) -> Matrix:
    """Return T after one step of relaxation, with A and weights of shape (n, n) and (n,)."""
    change = (A @ T).tocsr()
    change.data *= np.repeat(weights, np.diff(change.indptr))
    return T - change


def _aggregates(A: Matrix) -> Indices:
    """Return for each unknown the number of its aggregate, shape (n,): each root has its neighbours and theirs. Roots
    have distances greater than 2, and all but one node in FEW_LEFT are so close to one; those join a neighbour."""
    n, graph = A.shape[0], _Graph(A.indptr, A.indices)
    rank = generator(0).permutation(n).astype(np.int32) + 1
    root = np.zeros(n, dtype=bool)
    while np.count_nonzero(rank) > n // FEW_LEFT:
        new = (graph.maximum(graph.maximum(rank)) == rank) & (rank > 0)
        root |= new
        rank = np.where(graph.maximum(graph.maximum(new)), 0, rank)
    aggregate = np.zeros(n, dtype=np.int32)
    aggregate[root] = np.arange(1, np.count_nonzero(root) + 1)
    while not aggregate.all():
        aggregate = np.where(aggregate, aggregate, graph.maximum(aggregate))
    return np.asarray(aggregate - 1)


class _Graph:
    """A graph in which every node is its own neighbour, as row pointers and column indices of its matrix."""

    def __init__(self, indptr: Indices, indices: Indices) -> None:
        self._indptr, self._indices, n = indptr, indices, indptr.size - 1
        degrees = np.diff(indptr)
        self._table: Any = None  # of the k-th neighbours of all nodes, in row k; nodes with fewer are their own
        if degrees.max(initial=0) * n <= MOST_PADDED * indices.size:
            self._table = np.tile(np.arange(n, dtype=indices.dtype), (degrees.max(), 1))
            places = np.arange(indices.size, dtype=indptr.dtype) - np.repeat(indptr[:-1], degrees)
            self._table[places, np.repeat(self._table[0], degrees)] = indices

    def maximum(self, values: Any) -> Any:
        """Return the largest value among the neighbours of each node."""
        if self._table is None:
            return np.maximum.reduceat(values[self._indices], self._indptr[:-1])
        return values[self._table].max(axis=0)


def _strong(A: Matrix, strength: float, candidate: Vector) -> Matrix:
    """Return A with its strong connections and the diagonal alone, changed there so that A candidate stays as it is."""
    with imports:
        from scipy.sparse import csr_array
    n, root = A.shape[0], np.sqrt(np.maximum(A.diagonal(), 0))
    rows = np.repeat(np.arange(n, dtype=A.indices.dtype), np.diff(A.indptr))
    keep = (np.abs(A.data) >= strength * root[rows] * root[A.indices]) | (rows == A.indices)
    if keep.all():
        return A
    kept = np.concatenate(([0], np.cumsum(keep, dtype=A.indptr.dtype)), dtype=A.indptr.dtype)
    weak = np.where(keep, 0.0, A.data * candidate[A.indices])
    strong = csr_array((A.data[keep], A.indices[keep], kept[A.indptr]), shape=A.shape)
    return plus_diagonal(strong, np.bincount(rows, weights=weak, minlength=n) / candidate)
