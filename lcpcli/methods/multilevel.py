"""Smoothed aggregation: coarse versions of a sparse matrix with positive diagonal.

P. Vaněk, J. Mandel and M. Brezina, Algebraic multigrid by smoothed aggregation for
second and fourth order elliptic problems, Computing 56 (1996) 179-196. Aggregates
around a maximal set of nodes at distances greater than 2: N. Bell, S. Dalton and L. N.
Olson, Exposing fine-grained parallelism in algebraic multigrid methods, SIAM Journal on
Scientific Computing 34 (2012) C123-C152, section 3.

V-cycles for principal submatrices, with basis functions truncated where a constraint is
active: R. Kornhuber, Monotone multigrid methods for elliptic variational inequalities
I, Numerische Mathematik 69 (1994) 167-184. The directions that they make are as good in
single precision, which takes half of the memory and of the time to read it (L. Giraud,
A. Haidar and L. T. Watson, Lecture Notes in Computational Science and Engineering 60
(2008) 357-364).

Nested iteration for the active set of a sparse problem, by coarse versions of the
problem that are solved roughly: A. Brandt and C. W. Cryer, Multigrid algorithms for the
solution of linear complementarity problems arising from free boundary problems, SIAM
Journal on Scientific and Statistical Computing 4 (1983) 655-684. Here the coarse
versions come from the matrix alone, and each coarse correction has the length that
minimizes the energy, as they are too stiff (D. Braess, Towards algebraic multigrid for
elliptic problems of second order, Computing 55 (1995) 379-393). The result is not
exact, but its active set is wrong only close to its edge.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from lcpcli.basis.exchanges import BasicSolutions
from lcpcli.clock import imports
from lcpcli.interrupts import raise_if_timed_out
from lcpcli.linalg.doubles import SMALLEST_NORMAL, generator, largest
from lcpcli.linalg.factors import Solve
from lcpcli.linalg.krylov import dot
from lcpcli.linalg.matrices import (
    absolute_product,
    dense,
    entries,
    plus_diagonal,
    row_parts,
    with_data,
)
from lcpcli.linalg.stencils import Operator
from lcpcli.model.box import Box
from lcpcli.model.problem import Problem
from lcpcli.model.right_hand_sides import like_with
from lcpcli.typing import Indices, Mask, Matrix, Vector

COARSEST = 150  # n up to which a matrix is inverted
# |a_ij| / sqrt(a_ii a_jj) above which j is a strong neighbour of i; halved from level
# to level.
STRENGTH = 0.08
# Largest ratio of the numbers of unknowns from one level to the next.
MAX_UNKNOWNS_RATIO = 0.6
# Largest ratio of the number of entries of a coarse version to that of the matrix.
MAX_ENTRIES_RATIO = 1.5
# Relaxations of the constant vector, which becomes one that relaxation hardly reduces.
RELAXATIONS = 10
# Size of a table of neighbours, which is three times as fast, relative to the entries
# of the graph.
MAX_PADDED = 2
FEW_LEFT = 50  # one node in 50 may be farther than 2 from all roots


class Level(NamedTuple):
    """A matrix of a hierarchy by its products, with the weights of its Jacobi
    relaxation, and the transfer to the next one.

    P : the prolongation from the next matrix, and R : P', which shares its arrays. T :
    P before it is smoothed, with one entry a row, in order, and orthonormal columns.
    coarse : the next matrix, P'AP.
    """

    operator: Operator
    weights: Vector
    R: Matrix
    P: Matrix
    T: Matrix
    coarse: Matrix


class Hierarchy:
    """Coarse versions of A, a csr_array with a positive diagonal, down to COARSEST
    unknowns.

    levels : the levels of all matrices but the last. coarsest : the last one, dense.
    is_stuck : whether a level failed to become much smaller; then there is none.
    """

    def __init__(self, A: Matrix) -> None:
        with imports:
            from scipy.sparse import csr_array
        self.levels = list[Level]()
        self.n = A.shape[0]
        max_entries = MAX_ENTRIES_RATIO * A.nnz
        candidate = np.ones(self.n)
        strength = STRENGTH
        self.is_stuck = False
        while A.shape[0] > COARSEST:
            diagonal = A.diagonal()
            operator = Operator(A)
            nothing = np.zeros(A.shape[0])
            inverse = np.where(diagonal > 0, 1 / np.where(diagonal > 0, diagonal, 1), 0)
            radius = (
                float((inverse * absolute_product(A, np.ones(A.shape[0]))).max()) or 1.0
            )
            # The weights of damped Jacobi relaxation x += weights * (b - A x).
            weights = np.asarray(4 / 3 / radius * inverse)
            for _ in range(RELAXATIONS):
                candidate = operator.relaxed(candidate, nothing, weights)
            candidate = np.where(candidate > 0, candidate, candidate.max() * 1e-3)
            strong = _strong(A, strength, candidate)
            aggregate = _aggregates(strong)
            sizes = np.sqrt(np.bincount(aggregate, weights=candidate**2))
            positions = (
                candidate / sizes[aggregate],
                aggregate,
                np.arange(aggregate.size + 1, dtype=np.int32),
            )
            T = csr_array(positions, shape=(aggregate.size, sizes.size))
            candidate = sizes
            change = (strong @ T).tocsr()
            change.data *= np.repeat(weights, np.diff(change.indptr))
            P = T - change  # after one step of relaxation
            R = P.T.tocsr()
            A = R @ (A @ P)
            self.is_stuck = (
                A.nnz > max_entries or P.shape[1] > MAX_UNKNOWNS_RATIO * P.shape[0]
            )
            if self.is_stuck:
                return
            self.levels.append(Level(operator, weights, R, R.T, T, A))
            strength /= 2
        self.coarsest = dense(A)


def _aggregates(A: Matrix) -> Indices:
    """Return for each unknown the number of its aggregate, shape (n,): each root has
    its neighbours and theirs. Roots have distances greater than 2, and all but one node
    in FEW_LEFT are so close to one; those join a neighbour."""
    n, max_over_neighbours = A.shape[0], _neighbourhood_maximum(A)
    rank = generator(0).permutation(n).astype(np.int32) + 1
    root = np.zeros(n, dtype=bool)
    while np.count_nonzero(rank) > n // FEW_LEFT:
        new = (max_over_neighbours(max_over_neighbours(rank)) == rank) & (rank > 0)
        root |= new
        rank = np.where(max_over_neighbours(max_over_neighbours(new)), 0, rank)
    aggregate = np.zeros(n, dtype=np.int32)
    aggregate[root] = np.arange(1, np.count_nonzero(root) + 1)
    while not aggregate.all():
        aggregate = np.where(aggregate, aggregate, max_over_neighbours(aggregate))
    return np.asarray(aggregate - 1)


def _neighbourhood_maximum(A: Matrix) -> Callable[[Any], Any]:
    """Return a function that returns, for each node of the graph of A, the largest
    value at the node and its neighbours."""
    n = A.shape[0]
    indptr = A.indptr
    indices = A.indices
    degrees = np.diff(A.indptr)
    if degrees.max(initial=0) * n > MAX_PADDED * indices.size:
        return lambda values: np.maximum.reduceat(values[indices], indptr[:-1])
    # The k-th neighbours of all nodes are in row k; nodes with fewer are their own
    # neighbours.
    table = np.tile(np.arange(n, dtype=indices.dtype), (degrees.max(), 1))
    positions = np.arange(indices.size, dtype=indptr.dtype) - np.repeat(
        indptr[:-1], degrees
    )
    table[positions, np.repeat(table[0], degrees)] = indices

    def max_over_neighbours(values: Any) -> Any:
        largest_values = np.empty_like(values)
        for rows in row_parts(values.size):
            values[table[:, rows]].max(axis=0, out=largest_values[rows])
        return largest_values

    return max_over_neighbours


def _strong(A: Matrix, strength: float, candidate: Vector) -> Matrix:
    """Return A with its strong connections and the diagonal alone, changed there so
    that A candidate stays as it is."""
    with imports:
        from scipy.sparse import csr_array
    root = np.sqrt(np.maximum(A.diagonal(), 0))
    is_strong, change = np.empty(A.nnz, dtype=bool), np.zeros(A.shape[0])
    for rows, row_entries, owners in entries(A):
        columns, first = A.indices[row_entries], rows.start
        strong = (
            np.abs(A.data[row_entries]) >= strength * root[rows][owners] * root[columns]
        )
        is_strong[row_entries] = strong | (owners + first == columns)
        weak = np.where(
            is_strong[row_entries], 0.0, A.data[row_entries] * candidate[columns]
        )
        change[rows] = np.bincount(owners, weak, rows.stop - first) / candidate[rows]
    if is_strong.all():
        return A
    kept_entries = np.concatenate(
        ([0], np.cumsum(is_strong, dtype=A.indptr.dtype)), dtype=A.indptr.dtype
    )
    strong = csr_array(
        (A.data[is_strong], A.indices[is_strong], kept_entries[A.indptr]), shape=A.shape
    )
    return plus_diagonal(strong, change)


# Factors of the usual weights in the two sweeps of Jacobi relaxation before each coarse
# correction, and in reverse after it: those of Chebyshev's polynomial for the upper
# eight ninths of the spectrum.
SWEEPS = 0.86, 3.11
# Basic fraction of an aggregate, by weight, above which it takes part in the
# correction.
MOSTLY_BASIC = 0.8
REGULAR = 1e-14  # relative to the largest diagonal entry: added to a coarsest matrix


class VCycles:
    """One V-cycle for each principal submatrix of the finest matrix of a hierarchy, in
    single precision, where T has the shares of the unknowns in their aggregates."""

    def __init__(self, hierarchy: Hierarchy) -> None:
        self._levels, self._coarsest = list[tuple[Level, Any]](), hierarchy.coarsest
        for level in hierarchy.levels:
            R = _single(level.R)
            T = level.T
            work = np.empty((2, level.weights.size), dtype=np.float32)
            operator = level.operator.in_single_precision()
            weights = _single(level.weights)
            self._levels.append(
                (
                    Level(
                        operator,
                        weights,
                        R,
                        R.T,
                        with_data(T, _single(T.data**2)),
                        None,
                    ),
                    work,
                )
            )
        self._buffers = np.empty(hierarchy.n, dtype=np.float32), np.empty(hierarchy.n)
        self._last: tuple[Mask, Solve] | None = None

    def __call__(self, basic: Mask) -> Solve:
        """Return one V-cycle for the principal submatrix of the basic variables, shape
        (n,), symmetric if A is; it takes and returns vectors of shape (n,) that are 0
        elsewhere, the latter in memory that the next cycle overwrites. Nothing is
        formed but masks: an aggregate is treated as basic if almost all of it is, so
        that the coarse versions of the whole matrix serve for every submatrix. It
        raises SingularMatrix."""
        masks = [basic]
        for level, _ in self._levels:
            shares = np.bincount(
                level.T.indices, level.T.data * masks[-1], level.R.shape[0]
            )
            masks.append(shares > MOSTLY_BASIC)
        basic = masks.pop()
        if self._last is None or not np.array_equal(basic, self._last[0]):
            self._last = basic, _inverse(self._coarsest, basic)
        solve = self._last[1]
        for (level, work), mask in reversed(
            list(zip(self._levels, masks, strict=True))
        ):
            solve = partial(
                _v_cycle, level, work, level.weights * mask, _single(mask), solve
            )
        return partial(_in_range, solve, *self._buffers)


def _single(values: Any) -> Any:
    """Return an array, or a sparse matrix, in single precision."""
    return (
        values.astype(np.float32)
        if isinstance(values, np.ndarray)
        else with_data(values, _single(values.data))
    )


def _in_range(solve: Solve, single: Any, image: Vector, b: Vector) -> Vector:
    """Return the value of a linear function in single precision at b in double
    precision, however small or large b is.

    single, image : memory for both."""
    size = largest(b)
    if not SMALLEST_NORMAL < size < np.inf:
        return np.array(b)
    np.multiply(b, 1 / size, out=single, casting="same_kind")
    return np.multiply(solve(single), size, out=image, dtype=np.float64)


def _inverse(A: Vector, basic: Mask) -> Solve:
    """Return a solver of systems with a principal submatrix of a small dense A, for
    vectors of shape (n,)."""
    diagonal = A.diagonal() * basic
    size = diagonal.max(initial=0.0) or 1.0
    regular = np.diag(np.where(diagonal <= REGULAR * size, size, REGULAR * size))
    inverse = _single(
        np.linalg.inv(np.where(np.outer(basic, basic), A, 0.0) + regular) * basic
    )
    return partial(np.matmul, inverse)


def _v_cycle(
    level: Level, work: Any, weights: Any, mask: Any, coarse: Solve, b: Any
) -> Any:
    """Return the result of a cycle from this level on for b, in `work`, which has two
    vectors."""
    A = level.operator
    x, y = work
    first, second = SWEEPS
    np.multiply(weights, b, out=x)
    x *= first
    A.relaxed(x, b, weights, second, y)
    change = level.P @ coarse(level.R @ A.residual(y, b, mask, x))
    change *= mask
    y += change
    A.relaxed(y, b, weights, second, x)
    return A.relaxed(x, b, weights, first, y)


CYCLES = 2  # on each level, with as many on all coarser levels inside each
# Sweeps of projected Jacobi relaxation before, and after, each coarse correction.
SWEEPS_OF_LEVEL = 2
LONGEST_STEP = 3.0  # times the coarse correction
COARSEST_PIVOTS = 30  # block pivots; the coarsest problem rarely takes more than five


class FullApproximation:
    """Approximate solutions of the problem of a matrix, with q and bounds, on each
    level of a hierarchy."""

    def __init__(self, hierarchy: Hierarchy, q: Vector, box: Box) -> None:
        self._levels = hierarchy.levels
        self._q = [q]
        self._boxes = [box]
        self._coarsest_like = Problem(
            hierarchy.coarsest, np.zeros(len(hierarchy.coarsest))
        )
        for level in self._levels:
            self._q.append(level.R @ self._q[-1])
            self._boxes.append(self._boxes[-1].mapped(level.T.T.__matmul__))

    def solution(self) -> Vector:
        """Return an approximate solution, which is 0 or the closest bounds where cycles
        diverge."""
        z = self._boxes[-1].project(np.zeros(self._q[-1].size))
        z = self._coarsest(z, self._q[-1])
        for level in reversed(range(len(self._levels))):
            q, box = self._q[level], self._boxes[level]
            z = box.project(self._levels[level].P @ z)
            for _ in range(CYCLES):
                z = self._cycle(level, z, q)
            other = box.project(np.zeros(q.size))
            if not self._energy(level, z) <= self._energy(level, other):
                z = other
        return z

    def _energy(self, level: int, z: Vector) -> float:
        w = self._levels[level].operator(z)
        w *= 0.5
        w += self._q[level]
        return dot(z, w)

    def _cycle(self, level: int, z: Vector, q: Vector) -> Vector:
        """Return a better z for A z + q, with A the matrix of the level."""
        raise_if_timed_out()
        if level == len(self._levels):
            return self._coarsest(z, q)
        (A, _, R, P, T, A_coarse), box = self._levels[level], self._boxes[level]
        z = self._relaxed(level, z, q)
        w = A(z)
        w += q
        # Where w does not keep z at a bound.
        free = ((box.lower < z) & (z < box.upper)) | (box.project(z - w) != z)
        partly = np.bincount(T.indices, weights=free, minlength=T.shape[1]) > 0
        coarse, residual = T.T @ z, np.where(free | ~partly[T.indices], w, 0.0)
        coarse_right_side = R @ residual - A_coarse @ coarse
        better = coarse
        for _ in range(CYCLES if level else 1):
            better = self._cycle(level + 1, better, coarse_right_side)
        released = (~partly & (better != coarse))[T.indices]
        change = np.where(free | released, P @ (better - coarse), 0.0)
        curvature = dot(change, A(change))
        if curvature > 0:
            change *= min(max(-dot(w, change) / curvature, 0.0), LONGEST_STEP)
        return self._relaxed(level, box.project(z + change), q)

    def _relaxed(self, level: int, z: Vector, q: Vector) -> Vector:
        load = -q
        for _ in range(SWEEPS_OF_LEVEL):
            z = self._boxes[level].project(
                self._levels[level].operator.relaxed(
                    z, load, self._levels[level].weights
                )
            )
        return z

    def _coarsest(self, z: Vector, q: Vector) -> Vector:
        """Return the solution on the coarsest level by block pivoting from z, or the
        last basic solution if that cycles."""
        box = self._boxes[-1]
        basis = box.basis_at(z, self._coarsest_like.M @ z + q)
        for basic_solution in islice(
            BasicSolutions(
                like_with(self._coarsest_like, q, box)
            ).block_principal_pivoting(basis),
            COARSEST_PIVOTS,
        ):
            if basic_solution.is_solution:
                break
        return box.project(basic_solution.z)
