"""Scaling factors of rows and columns that a matrix itself suggests, equilibration, and
generalized inverses of scaled matrices.

The scaling of A. R. Curtis and J. K. Reid, On the automatic scaling of matrices for
Gaussian elimination, IMA Journal of Applied Mathematics 10 (1972) 118-124, has
diagonals R and C that minimize the sum of the squares of log2 |R_i M_ij C_j| over the
nonzero entries. They are unique up to a constant for each connected component of the
bipartite graph of rows and columns, in which each nonzero M_ij is an edge. Therefore
quantities of the scaled problem do not depend on how the data were scaled.

With rho = log2 R and gamma = -log2 C, the normal equations have the Laplacian of this
graph as their matrix. For a matrix without zeros, means of its rows and columns solve
them. Few unknowns, and those of a narrow band, are eliminated directly. Others are
computed by conjugate gradients, which take few steps unless the graph has a large
diameter, and otherwise by sparse elimination, which causes little fill-in in such
graphs.

Equilibration: for positive diagonals R and C the solutions of LCP(R M C, R q) are z /
C, and their w is scaled by R. With R and C computed from the matrix itself, criteria in
the scaled problem hardly depend on the scaling of the data.

For a singular matrix, `PseudoInverse` computes a solution, the components that all
solutions share, and whether there is a solution.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import FAR_FROM_ONE, ROW_ROUNDING, generic, largest, sizes
from lcpcli.linalg.factors import finite
from lcpcli.linalg.krylov import (
    Operator,
    StoppingCriterion,
    conjugate_gradients,
    identity,
    norm,
)
from lcpcli.linalg.matrices import (
    FEW_AS_DENSE,
    absolute_product,
    column_maxima,
    compressed_multiplier,
    is_sparse,
    row_parts,
    width,
)
from lcpcli.typing import Indices, Mask, Matrix, Vector

if TYPE_CHECKING:
    from lcpcli.linalg.compressed_rows import Arrays

# Each sweep of equilibration halves the logarithms of the largest entries, so that 30
# sweeps suffice for the whole range of double precision unless M couples rows and
# columns.
MAX_SWEEPS = 30
# If the largest entries of rows or columns differ by more than a factor of 2^40,
# logarithms are balanced first (Curtis and Reid), then the largest entries.
UNITS_FAR_APART = 40.0
# If the exponents of the first sweep differ by at most this, their range limits the
# exponents of all sweeps.
NEAR_UNITS = 4.0
# Binary digits by which later exponents may leave the range of the first sweep.
EXPONENT_MARGIN = 4.0
# Limit on the exponents of 2 in R and C, so that R, C and quotients by them stay
# finite.
LARGEST_POWER = 1000.0
# Conjugate gradients stop when the estimated error of all exponents is below this times
# the largest exponent of the first step, or 1. For programs the lower accuracy saves
# more than it costs, as they are solved in few milliseconds.
CONVERGED_ERROR, CONVERGED_ERROR_OF_PROGRAM = 1e-8, 1e-3
# Steps of conjugate gradients after which elimination is used instead.
FEW_CG_STEPS = 100
# The limit on the steps if there are so many rows that elimination may take too long,
# and for a symmetric M of at most FEW_SYMMETRIC rows.
MAX_CG_STEPS = 300
# A symmetric M of at most FEW_AS_DENSE rows, by dense factors, or of at most
# FEW_SYMMETRIC rows with at most 4 entries a row on average, is solved by elimination,
# which takes half as long as conjugate gradients for narrow grids. For networks of
# transport and spatial prices, conjugate gradients would take .7 of its time with 400
# unknowns, .4 with 2000 and .2 with 8000, but leave an error of 1e-3 in the exponents
# for circuits.
THIN = 4
FEW_SYMMETRIC, LARGEST_ELIMINATED = 10_000, 100_000  # rows
# Bandwidth up to which band factors take less time than conjugate gradients.
BAND = 5
# The relative change of all entries, in the Euclidean norm, from which on scaling
# factors are computed anew.
FAR_CHANGE = 0.3
# Rows up to which dense normal equations take no longer than conjugate gradients.
MAX_DENSE = 48
# Rows up to which conjugate gradients multiply by a dense M as it is, whatever the
# number of its zeros.
FEW_ROWS = 256
# Fraction of nonzero entries above which conjugate gradients multiply by a dense M as
# it is, and the limit on their steps then.
DENSE, DENSE_CG_STEPS = 0.2, 30
# Entries of the equilibrated matrix that are smaller do not take part in the fit.
TINY = 2.0**-50
# Fits, each without the entries that are tiny by the one before.
MAX_FITS = 5
SETTLED = 0.25  # binary digits by which a sweep changes no factor any more


class Units(NamedTuple):
    """Scaling factors R and C.

    rows, columns : log2 of R and of C, shape (n,). row_part, column_part : the numbers
    of the connected components of rows and columns, 0 to parts - 1, shape (n,).
    """

    rows: Vector
    columns: Vector
    row_part: Indices
    column_part: Indices
    parts: int

    def diagonals(self) -> tuple[Vector, Vector]:
        """Return R and C, rounded to powers of two, so that scaling by them is
        exact.
        """
        return np.exp2(np.rint(self.rows)), np.exp2(np.rint(self.columns))

    def largest(self, values: Vector, component_of: Indices) -> Vector:
        """Return the largest value in each connected component, shape (..., parts), for
        values of rows or columns of shape (..., n) whose components are `component_of`;
        minus infinity for an empty component.
        """
        if self.parts == 1:
            return np.asarray(values.max(axis=-1, keepdims=True, initial=-np.inf))
        largest_values = np.full((*values.shape[:-1], self.parts), -np.inf)
        # Indexing without an ellipsis takes a fraction of the time.
        position: Any = component_of if values.ndim == 1 else (..., component_of)
        np.maximum.at(largest_values, position, values)
        return largest_values


def units(M: Matrix, S: Vector | None = None) -> Units:
    """Return the scaling factors of M by Curtis and Reid, for M dense or in compressed
    sparse rows, with finite entries. In each connected component, the mean of log2 R
    over the entries equals that of log2 C.

    Entries that are tiny when all rows and columns have largest entries of about 1 take
    no part: no term of their row and column can feel them, and the exponents of the
    tails of a Gaussian would decide all others.

    S : 1 for variables and -1 for multipliers, if M is the matrix of a program.
    """
    fitted, entries = _units_of_all(M, S), M.data if is_sparse(M) else M
    smallest, largest_entry = sizes(entries)
    for _ in range(0 if smallest >= TINY * largest_entry else MAX_FITS):
        before, counted = entries, _without_tiny_entries(M, fitted)
        entries = counted.data if is_sparse(M) else counted
        if np.array_equal(before, entries):
            break
        fitted = _units_of_all(counted, S)
    return fitted


def _units_of_all(M: Matrix, S: Vector | None) -> Units:
    """Return the scaling factors as `units` does, of which all entries are part."""
    if is_sparse(M):
        return _sparse(M, S)
    if M.all():
        n, nothing = M.shape[0], np.zeros(M.shape[0], dtype=np.intp)
        rows, columns = _sums(M) / max(n, 1)
        middle = float(rows.sum()) / max(2 * n, 1)
        return Units(middle - rows, middle - columns, nothing, nothing, 1)
    fitted = (
        _dense(M, CONVERGED_ERROR if S is None else CONVERGED_ERROR_OF_PROGRAM)
        if M.shape[0] <= FEW_ROWS or np.count_nonzero(M) > DENSE * M.size
        else None
    )
    if fitted is not None:
        return fitted
    return _sparse(matrices.thinned(M, M.size), S)


@np.errstate(all="ignore")  # of entries that take no part
def _without_tiny_entries(M: Matrix, all_units: Units) -> Matrix:
    """Return M with zeros for entries below TINY times the largest ones of their row
    and column, in units in which all of these are about 1: those to which Ruiz's
    sweeps lead from the units of all entries, so that other units of the data lead to
    the same."""
    n = M.shape[0]
    powers = np.concatenate((all_units.rows, all_units.columns))
    for _ in range(MAX_SWEEPS):
        found = sizes_in_units(M, powers)
        changes = 0.5 * np.log2(found + (found == 0.0))
        powers = powers - changes
        if np.abs(changes).max() <= SETTLED:
            break
    scaled = matrices.scaled(M, np.exp2(powers[:n]), np.exp2(powers[n:]))
    if is_sparse(M):
        kept = np.where(np.abs(scaled.data) < TINY, 0.0, M.data)
        return M if kept.all() else matrices.with_data(M, kept)
    return np.where(np.abs(scaled) < TINY, 0.0, M)


class Base:
    """A dense M whose scaling factors are known; those of other matrices with almost
    the same entries are bounded by comparison.

    The fit of log2 |M_ij| by sums of a number for its row and one for its column is an
    orthogonal projection, so that it changes by no more than the logarithms do, in the
    Euclidean norm. rho_i - rho_k is a sum of fitted numbers with alternating signs
    along a path of at most 2 n edges, and changes by at most sqrt(2 n) times that.
    """

    def __init__(self, M: Vector, units: Units) -> None:
        self.M, self.units = M, units

    @cached_property
    def _used(self) -> Mask:
        return np.asarray(self.M != 0)

    @cached_property
    def _inverses(self) -> Vector:
        M = self.M
        return np.divide(1.0, M, where=self._used, out=np.zeros(M.shape))

    @np.errstate(all="ignore")
    def digits_to(self, M: Vector) -> float:
        """Return a bound on how many binary digits rho_i - rho_k of M differs by, for
        rows of one component; infinite if other entries are 0, or M is not close to the
        known one.
        """
        if not np.array_equal(M != 0, self._used):
            return math.inf
        changes = ((M - self.M) * self._inverses).ravel()
        return self.digits_for(math.sqrt(np.dot(changes, changes)))

    def digits_for(self, change: float) -> float:
        """Return this bound for the Euclidean norm of the relative changes of the
        entries."""
        if not change < FAR_CHANGE:
            return math.inf
        of_logarithms = change / (math.log(2) * (1 - change))
        return math.sqrt(2 * len(self.M)) * of_logarithms


def _sums(M: Vector) -> Vector:
    """Return the sums of log2 |M_ij| in rows and in columns of a matrix without zeros,
    shape (2, n)."""
    sums = np.zeros((2, M.shape[0]))
    for rows in row_parts(*M.shape):
        logarithms = np.log2(np.abs(M[rows]))
        sums[0, rows] = logarithms.sum(axis=1)
        sums[1] += logarithms.sum(axis=0)
    return sums


def _dense(M: Vector, error: float) -> Units | None:
    """Return the scaling factors of a dense M; None if conjugate gradients need more
    than DENSE_CG_STEPS to an estimated error of this size.

    For few rows, the singular normal equations, from which rho is eliminated, are
    solved directly: they become regular if v v' is added for each connected component,
    where v is 1 in its columns, which spans the null space.
    """
    n, used = M.shape[0], M != 0
    entries = used.astype(np.float64)
    logarithms = np.log2(np.abs(M), where=used, out=np.zeros(M.shape))
    sums, counts = (
        np.array([terms_of_sum.sum(axis=1), terms_of_sum.sum(axis=0)])
        for terms_of_sum in (logarithms, entries)
    )
    if n > MAX_DENSE:
        scaled = entries / np.multiply.outer(*map(_roots, counts))
        times = [scaled.__matmul__, scaled.T.__matmul__]
        rho, gamma, has_converged = _by_gradients(
            [*sums], [*counts], times, DENSE_CG_STEPS, error
        )
        if not has_converged:
            return None
    row_part, column_part, n_components = _components(used)
    if n <= MAX_DENSE:
        of_rows = np.maximum(counts[0], 1.0)
        shares = entries.T / of_rows
        N = (column_part[:, np.newaxis] == column_part) - shares @ entries
        N.flat[:: n + 1] += counts[1]
        gamma = np.linalg.solve(N, shares @ sums[0] - sums[1])
        rho = -(sums[0] + entries @ gamma) / of_rows
    return Units(
        *_centred(
            np.concatenate((rho, gamma)),
            counts,
            np.concatenate((row_part, column_part)),
            n_components,
        ),
        row_part,
        column_part,
        n_components,
    )


def _sparse(M: Matrix, S: Vector | None = None) -> Units:
    """Return the scaling factors of a sparse M, with S as in `units`: by band factors,
    by conjugate gradients, or by elimination where these need too many steps."""
    with imports:
        from lcpcli.linalg.compressed_rows import transposed
    if not M.data.all():
        M = M.copy()
        M.eliminate_zeros()
    n = M.shape[0]
    # scipy would examine each index to choose this type itself.
    index = np.int32 if max(2 * n + 1, M.nnz) < 2**31 else np.int64
    indptr, indices = (each.astype(index, copy=False) for each in (M.indptr, M.indices))
    rows = indptr, indices, np.log2(np.abs(M.data))
    columns = rows if S is not None else transposed(M.shape, *rows)
    is_symmetric = S is not None or all(map(np.array_equal, rows, columns))
    has_diagonal = bool(M.diagonal().all())
    component_of, n_components = _sparse_components(
        n, indptr, indices, has_diagonal, is_symmetric
    )
    counts = np.array([np.diff(indptr), np.diff(columns[0])], dtype=np.float64)
    sums = [
        compressed_multiplier(M.shape, *row_arrays)(np.ones(n))
        for row_arrays in ((rows,) if is_symmetric else (rows, columns))
    ]
    sums = [sums[0], sums[-1]]
    if counts.max(initial=0.0) <= 2 * BAND + 1 and (farthest := width(M)) <= BAND:
        times = [_product((*each[:2], np.ones(M.nnz)), n) for each in (rows, columns)]
        roots = _first_of_components(component_of, n_components)
        x = _banded(M, farthest, np.array(sums), counts, times, roots)
    else:
        is_limit_large = n > LARGEST_ELIMINATED or (is_symmetric and n <= FEW_SYMMETRIC)
        max_steps = MAX_CG_STEPS if is_limit_large else FEW_CG_STEPS
        has_converged = False
        if not is_symmetric:
            times = [
                _product(_scaled(*each), n)
                for each in ((rows, *counts), (columns, *counts[::-1]))
            ]
            *both, has_converged = _by_gradients(sums, [*counts], times, max_steps)
            x = np.concatenate(both)
        elif n > FEW_AS_DENSE and (n > FEW_SYMMETRIC or M.nnz > THIN * n):
            is_eliminated = np.zeros(n, dtype=bool) if S is None else S < 0
            symmetric_fit, has_converged = _symmetric(
                M, sums[0], counts[0], is_eliminated, max_steps
            )
            x = np.concatenate((symmetric_fit, symmetric_fit))
        if not has_converged and n <= LARGEST_ELIMINATED:
            E = matrices.with_data(M, np.ones(M.nnz))
            x = _eliminated(E, sums, counts, component_of, n_components, is_symmetric)
    rho, gamma = _centred(x, counts, component_of, n_components)
    if is_symmetric:
        rho = gamma = (rho + gamma) / 2
    return Units(rho, gamma, component_of[:n], component_of[n:], n_components)


def _sparse_components(
    n: int, indptr: Indices, indices: Indices, has_diagonal: bool, is_symmetric: bool
) -> tuple[Indices, int]:
    """Return the connected component of each row and then of each column of a sparse
    matrix, shape (2 n,), and the number of components.

    If the whole diagonal is nonzero, row i and column i are in one component, so that
    the graph of n unknowns has the same components. If the pattern is symmetric, the
    graph with edges in both directions takes less time: its strong components are
    those, and scipy transposes nothing.
    """
    with imports:
        from scipy.sparse.csgraph import connected_components

        from lcpcli.linalg.compressed_rows import of_arrays
    size = n
    if not has_diagonal:
        size = 2 * n
        edges = indices.size
        if is_symmetric:
            indptr = np.concatenate((indptr, indptr[1:] + edges))
            indices = np.concatenate((indices + n, indices))
        else:
            no_entries = np.full(n, edges, dtype=indptr.dtype)
            indptr = np.concatenate((indptr, no_entries))
            indices = indices + n
    graph = of_arrays((size, size), indptr, indices, np.ones(indices.size))
    n_components, component_of = connected_components(
        graph, directed=is_symmetric, connection="strong"
    )
    return (np.tile(component_of, 2) if has_diagonal else component_of), n_components


# Without it: an obstacle with 40,000 unknowns takes 1.85 times as long.
def _symmetric(
    M: Matrix, sums: Vector, counts: Vector, is_eliminated: Mask, max_steps: int
) -> tuple[Vector, bool]:
    """Return rho = gamma for a matrix M with symmetric |M|, and whether conjugate
    gradients have converged.

    sums, counts : of the logarithms, and the numbers of entries, in rows.
    is_eliminated : the rows of the multipliers of a program, which are eliminated from
        the normal equations if there are no entries between them.
    """
    with imports:
        from lcpcli.linalg.compressed_rows import block
    first = is_eliminated.nonzero()[0]
    other = (~is_eliminated).nonzero()[0]
    off_diagonal_block = block(M, first, other)
    error = CONVERGED_ERROR_OF_PROGRAM if first.size else CONVERGED_ERROR
    if off_diagonal_block[1].size < counts[first].sum():
        first, other = first[:0], np.arange(counts.size)
        off_diagonal_block = block(M, first, other)
    of_logarithms, of_entries = ([v[first], v[other]] for v in (sums, counts))
    forth = _scaled(off_diagonal_block, *of_entries)
    back = _scaled(block(M, other, first), *of_entries[::-1])
    times = [_product(forth, other.size), _product(back, first.size)]
    inner = block(M, other, other)
    if inner[1].size:
        times.append(_product(_scaled(inner, of_entries[1], of_entries[1]), other.size))
    x = np.empty(counts.size)
    x[first], x[other], has_converged = _by_gradients(
        of_logarithms, of_entries, times, max_steps, error
    )
    return x, has_converged


def _scaled(arrays: Arrays, of_rows: Vector, of_columns: Vector) -> Arrays:
    """Return the matrix with entries 1 / sqrt(r c), where r and c are the counts of
    their rows and columns.
    """
    indptr, indices, _ = arrays
    return (
        indptr,
        indices,
        np.repeat(1 / _roots(of_rows), np.diff(indptr)) / _roots(of_columns)[indices],
    )


def _product(matrix: Arrays, columns: int) -> Operator:
    """Return the product with a matrix of this number of columns."""
    return compressed_multiplier((matrix[0].size - 1, columns), *matrix)


def _centred(
    x: Vector, counts: Vector, component_of: Indices, n_components: int
) -> tuple[Vector, Vector]:
    """Return the rows rho and the columns gamma of x after a constant is added in each
    connected component, such that their means over the entries of the matrix are equal.
    """
    (rows, columns), n = counts, counts.shape[1]
    entries = np.maximum(np.bincount(component_of[:n], rows, n_components), 1.0)
    totals = np.bincount(component_of[:n], rows * x[:n], n_components) - np.bincount(
        component_of[n:], columns * x[n:], n_components
    )
    change = totals / (2 * entries)
    return x[:n] - change[component_of[:n]], x[n:] + change[component_of[n:]]


def _by_gradients(
    sums: Sequence[Vector],
    counts: Sequence[Vector],
    times: Sequence[Operator],
    max_steps: int,
    error: float = CONVERGED_ERROR,
) -> tuple[Vector, Vector, bool]:
    """Return rho and gamma by conjugate gradients on the normal equations, scaled to
    diagonal 1, from which rho is eliminated, which halves the number of steps; and
    whether they converged within `max_steps`.

    sums, counts : of the logarithms, and the numbers of entries, in rows and in
    columns. times : the products with the matrix that has 1 / sqrt(r c) for each entry,
    where r and c are the counts of its row and column, with its transpose and, if there
    are any, with the same matrix of entries between columns.
    """
    (forth, back, *among), (of_rows, of_columns) = times, map(_roots, counts)
    means = sums[0] / of_rows
    b = back(means) - sums[1] / of_columns

    def product(v: Vector) -> Vector:
        image = v - back(forth(v)) if of_rows.size else v.copy()
        for other in among:
            image += other(v)
        return image

    max_error, root = error * max(largest(b / of_columns), 1.0), max(b.size, 1) ** 0.5

    def measure(r: Vector) -> float:
        mean = norm(r) / root
        return mean if mean > max_error else largest(r / of_columns)

    stopping = StoppingCriterion(max_error, max_steps, measure)
    gamma, residual_size = conjugate_gradients(
        product, b, np.zeros(b.size), stopping, identity
    )
    return (
        -(means + forth(gamma)) / of_rows,
        gamma / of_columns,
        residual_size <= max_error,
    )


def _roots(counts: Vector) -> Vector:
    """Return the square roots of counts, 1 for a count of 0."""
    return np.sqrt(np.maximum(counts, 1.0))


def _first_of_components(component_of: Indices, n_components: int) -> Indices:
    """Return the first row or column of each connected component."""
    first = np.empty(n_components, dtype=np.intp)
    first[component_of[::-1]] = np.arange(component_of.size - 1, -1, -1)
    return first


def _eliminated(
    E: Matrix,
    sums: Sequence[Vector],
    counts: Vector,
    component_of: Indices,
    n_components: int,
    is_symmetric: bool,
) -> Vector:
    """Return rho and then gamma, shape (2 n,), by sparse elimination and one step of
    refinement. One unknown in each connected component is fixed at about 0, as the
    equations are singular. For a symmetric matrix rho = gamma is computed; its
    equations are singular only in components that do not contain both a row and its
    column.

    E : the matrix with ones as entries.
    """
    with imports:
        from scipy.sparse import block_array

        from lcpcli.linalg.shifted_systems import systems
    n = E.shape[0]
    if is_symmetric:
        roots = np.unique(
            np.minimum(component_of[:n], component_of[n:]), return_index=True
        )[1]
        roots = roots[component_of[roots] != component_of[n + roots]]
        b = -sums[0]
        d = counts[0].copy()
        E = E.toarray() if n <= FEW_AS_DENSE else E
        factors = systems(E, np.ones(n))
    else:
        E = block_array([[None, E], [E.T, None]], format="csr")
        roots = _first_of_components(component_of, n_components)
        b = -np.concatenate(sums)
        d = counts.flatten()
        factors = systems(E, None)
    d[roots] += 1.0
    factors.factorize(d)
    x = factors.solve(b)
    x += factors.solve(b - d * x - E @ x)
    return np.tile(x, 2) if is_symmetric else x


# Without it: an American put with 40 prices takes 1.4 times as long.
def _banded(
    M: Matrix,
    farthest: int,
    sums: Vector,
    counts: Vector,
    times: list[Callable[[Vector], Vector]],
    roots: Indices,
) -> Vector:
    """Return rho and then gamma, shape (2 n,), for a matrix of bandwidth `farthest`, by
    banded Cholesky factors and one step of refinement. Row i of M is unknown 2 i, and
    column j unknown 2 j + 1. The unknowns `roots` are fixed at about 0, as the
    equations are singular.

    times : the products with the matrix of ones and with its transpose.
    """
    with imports:
        from scipy.linalg import cho_solve_banded, cholesky_banded
    n, last = M.shape[0], 2 * farthest + 1
    rows, columns = 2 * np.repeat(np.arange(n), np.diff(M.indptr)), 2 * M.indices + 1
    N = np.zeros((last + 1, 2 * n))
    N[last - np.abs(rows - columns), np.maximum(rows, columns)] = 1.0
    N[last] = counts.T.ravel()
    N[last, 2 * (roots % n) + roots // n] += 1.0
    factors = cholesky_banded(N, overwrite_ab=True, check_finite=False)
    x = np.zeros((2, n))
    for _ in range(2):
        residual = sums + counts * x + [times[0](x[1]), times[1](x[0])]
        x -= (
            cho_solve_banded((factors, False), residual.T.ravel(), check_finite=False)
            .reshape(n, 2)
            .T
        )
    return x.ravel()


def _components(used: Mask) -> tuple[Indices, Indices, int]:
    """Return the connected components of rows and of columns of a dense matrix with
    this mask of nonzero entries, and the number of components: by breadth-first search
    or, for few rows, by integers whose bits are the columns of a component.
    """
    n, count = used.shape[0], 0
    rows, columns = np.full((2, n), -1, dtype=np.intp)
    if n <= MAX_DENSE:
        parts = list[int]()
        for row in np.packbits(used, axis=1, bitorder="little"):
            part = int.from_bytes(row.tobytes(), "little")
            for other in parts:
                if other & part:
                    part |= other
            parts = [other for other in parts if not other & part]
            if part:
                parts.append(part)
        count = len(parts)
        if count == 1:  # the usual case, without a loop over the columns
            columns[used.any(axis=0)] = 0
        for i, rest in enumerate(parts if count > 1 else ()):
            while rest:
                lowest = rest & -rest
                columns[lowest.bit_length() - 1] = i
                rest ^= lowest
        rows = np.where(used.any(axis=1), columns[used.argmax(axis=1)], -1)
    for i in range(n if n > MAX_DENSE else 0):
        if rows[i] >= 0:
            continue
        front: Indices = np.array([i])
        while front.size:
            rows[front] = count
            reached = (used[front].any(axis=0) & (columns < 0)).nonzero()[0]
            columns[reached] = count
            front = (used[:, reached].any(axis=1) & (rows < 0)).nonzero()[0]
        count += 1
    for each in (rows, columns):
        alone = (each < 0).nonzero()[0]
        each[alone] = np.arange(count, count + alone.size)
        count += alone.size
    return rows, columns, count


def equilibrate(
    M: Matrix, q: Vector, rows: Vector | None = None
) -> tuple[Vector, Vector]:
    """Return diagonals R, C of shape (n,) for which the largest entries of the rows and
    columns of R |M| C are about 1.

    Rows and columns are divided simultaneously by the square roots of their largest
    entries (D. Ruiz, A scaling algorithm to equilibrate both rows and columns norms in
    matrices, RAL-TR-2001-034), repeatedly until every largest entry lies between 1/2
    and 2, at most MAX_SWEEPS times. The divisors are powers of two, so that scaling is
    exact, and stay finite. A symmetric M stays symmetric: R = C. A zero row is scaled
    until its entry of q is as large as the largest other one; a zero column is not
    scaled. Uncoupled blocks of M keep common factors. If the exponents of the first
    sweep differ by at most NEAR_UNITS, no exponent leaves their range by more than
    EXPONENT_MARGIN.

    rows : the largest |entry| of each row of M, if they are known: the rest of M need
    then not be read if its diagonal is almost as large.
    """
    rows = matrices.row_maxima(M) if rows is None else rows
    diagonal = np.abs(M.diagonal())
    power = common_power(float(diagonal.min()), float(rows.max())) if q.size else 0.0
    if not math.isnan(power):
        common = np.full(q.size, 2.0**power)
        return common, common
    sizes = np.concatenate((rows, matrices.column_maxima(M)))
    powers = moderate_powers(M, sizes, diagonal)
    if not powers.size:
        far = units(M)
        powers = np.clip(
            np.rint(np.concatenate((far.rows, far.columns))),
            -LARGEST_POWER,
            LARGEST_POWER,
        )
        powers = swept(M, sizes_in_units(M, powers), diagonal, powers, False)
    row_power, column_power = powers[: q.size], powers[q.size :]
    empty = (rows == 0) & (q != 0)
    if empty.any():
        sizes = row_power[~empty] + 2 * half_power(np.abs(q[~empty]))
        size = sizes[q[~empty] != 0].max(initial=-LARGEST_POWER)
        powers_of_q = 2 * half_power(np.abs(q[empty]))
        row_power[empty] = np.clip(
            (size if size > -LARGEST_POWER else 0.0) - powers_of_q,
            -LARGEST_POWER,
            LARGEST_POWER,
        )
    return np.exp2(row_power), np.exp2(column_power)


def moderate_powers(M: Matrix, sizes: Vector, diagonal: Vector) -> Vector:
    """Return the exponents of 2 in R and then in C that `equilibrate` computes by
    sweeps alone, shape (2 n,); an empty array if the largest entries are so far apart
    that logarithms are balanced first.

    sizes, diagonal : the largest entries of rows and then of columns, and |M_ii|.

    This function and those that it calls are compiled as well, for a dense M.
    """
    n = diagonal.size
    power = common_power(diagonal.min(), sizes[:n].max())
    if not np.isnan(power):
        return np.full(2 * n, power)
    if are_far_apart(sizes[:n]) or are_far_apart(sizes[n:]):
        return np.empty(0)
    return swept(M, sizes, diagonal, np.zeros(2 * n), True)


def swept(
    M: Matrix, sizes: Vector, diagonal: Vector, powers: Vector, is_limited: bool
) -> Vector:
    """Return the exponents after at most MAX_SWEEPS of equilibration.

    powers : the initial exponents.
    sizes : the largest entries of rows and then of columns after scaling by these.
    is_limited : whether exponents may leave the range of those of the first sweep by at
        most EXPONENT_MARGIN, if that range is at most NEAR_UNITS.
    """
    n, changes = diagonal.size, half_power(sizes)
    low, high = -LARGEST_POWER, LARGEST_POWER
    if is_limited and changes.max() - changes.min() <= NEAR_UNITS:
        low, high = -changes.max() - EXPONENT_MARGIN, -changes.min() + EXPONENT_MARGIN
    none = diagonal == 0.0
    logarithms = np.log2(diagonal + none) - 4.0 * LARGEST_POWER * none
    for _ in range(MAX_SWEEPS):
        if not changes.any():
            break
        powers = np.minimum(np.maximum(powers - changes, low), high)
        if (powers[:n] + powers[n:] + logarithms >= -1.0).all():
            break  # as no entry is now above 2, all largest ones lie between 1/2 and 2
        changes = half_power(sizes_in_units(M, powers))
    return powers


def sizes_in_units(M: Matrix, powers: Vector) -> Vector:
    """Return the largest entries of rows, and then of columns, of the matrix scaled
    with these exponents, shape (2 n,).
    """
    factors, n = np.exp2(powers), M.shape[0]
    rows, columns = matrices.row_and_column_maxima(M, factors[:n], factors[n:])
    return np.concatenate((rows, columns))


def common_power(least: float, largest: float) -> float:
    """Return the exponent of 2 with which all rows and columns can be scaled alike, as
    their largest entries lie between `least`, the smallest |M_ii|, and `largest`, the
    largest |M_ij|; NaN if these two need different exponents, or are far from 1.
    """
    if not (least > 1.0 / FAR_FROM_ONE and largest < FAR_FROM_ONE):
        return np.nan
    first, last = -np.rint(0.5 * np.log2(largest)), -np.rint(0.5 * np.log2(least))
    return float(first) if first == last else np.nan


def are_far_apart(sizes: Vector) -> bool:
    """Return whether nonzero sizes differ by more than a factor of 2^UNITS_FAR_APART,
    more than common units of measurement do.
    """
    used = sizes[sizes > 0.0]
    return bool(
        used.size > 0 and np.log2(used.max()) - np.log2(used.min()) > UNITS_FAR_APART
    )


def half_power(sizes: Vector) -> Vector:
    """Return half the binary logarithm of each size, rounded to an integer; 0 where the
    size is 0."""
    powers: Vector = np.rint(0.5 * np.log2(sizes + (sizes == 0.0)))
    return powers


# A matrix is considered singular if rounding errors change solutions by more than this
# relative to them: fewer than three digits are then correct.
MIN_DIGITS = 1e-3
# Pivots or singular values that are smaller than this relative to the largest are
# considered 0.
MIN_SINGULAR_VALUE = ROW_ROUNDING / MIN_DIGITS


def largest_growth(A: Matrix, solve: Callable[[Vector], Vector]) -> float:
    """Return the largest relative change of a component of the solution of A x = b,
    after scaling the columns of A to largest entry 1, if each row changes by a generic
    multiple of its size. It is a lower bound on a condition number that does not depend
    on the scaling of the data; NaN if A has a zero column.

    solve : solves A x = b.
    """
    known_solution = 1 / column_maxima(A)
    changes = absolute_product(A, known_solution) * generic(known_solution.size)
    return float(np.abs(solve(changes) / known_solution).max())


class PseudoInverse:
    """A generalized inverse G of a dense matrix A of shape (k, k), with A G A = A and G
    A G = G, and bases of the null spaces of A and of A'.

    With the scaling R and C of Curtis and Reid, a factorization R A C P = Q T with
    column pivoting (G. H. Golub and C. F. Van Loan, Matrix Computations, 4th ed., Johns
    Hopkins 2013, section 5.4) reveals the rank r, the number of pivots larger than
    rounding errors. With T = (T_11, T_12) in its first r rows, and Q_1 the first r
    columns of Q,

        G = C P (T_11^-1 Q_1', 0) R,

    A x = 0 for x = C v, v = P (-T_11^-1 T_12, I), and A'y = 0 for y = R u, u the other
    columns of Q.

    If v_i is exactly 0, its computed value is small compared with max |v|. So a_i'v is
    treated as 0 if it is small compared with |a|_1 max |v|. Compared with |a|'|v| it
    would never be small: where v_i = 0 for all nonzero a_i, that sum consists of the
    same rounding errors.

    min_pivot : a pivot is considered 0 if it is smaller than this relative to the
    largest.
    """

    def __init__(self, A: Vector, min_pivot: float = MIN_SINGULAR_VALUE) -> None:
        with imports:
            from scipy.linalg import qr, solve_triangular
        R, C = units(A).diagonals()
        Q, T, order = qr(finite(R[:, np.newaxis] * A * C), pivoting=True)
        pivots = np.abs(T.diagonal())
        rank = int(np.count_nonzero(pivots > min_pivot * pivots[:1]))
        self._C, self._R = C, R
        inverse, self._null = np.zeros(A.shape), np.zeros((len(A), len(A) - rank))
        inverse[order[:rank]] = solve_triangular(T[:rank, :rank], Q[:, :rank].T)
        self._inverse = C[:, np.newaxis] * inverse * R
        self._null[order[:rank]] = -solve_triangular(T[:rank, :rank], T[:rank, rank:])
        self._null[order[rank:]] = np.eye(len(A) - rank)
        self._left_null = Q[:, rank:]
        self.is_singular = rank < len(A)
        # The first pivot that is considered 0, relative to the last one that is not.
        self.gap = float(pivots[rank] / pivots[rank - 1]) if 0 < rank < len(A) else 0.0
        # Bound on the relative rounding error in the bases of the null spaces.
        condition = pivots[0] / pivots[rank - 1] if rank else 1.0
        self._rounding = len(A) * ROW_ROUNDING * condition

    def __call__(self, b: Vector, transposed: bool = False) -> Vector:
        """Return G b or G'b."""
        return np.asarray((self._inverse.T if transposed else self._inverse) @ b)

    def determines(self, J: Vector) -> Mask:
        """Return for which rows J_i of J, shape (m, k), J_i x is the same for all
        solutions x of A x = b, up to rounding.
        """
        return self._vanish(J * self._C, self._null)

    def is_consistent(self, b: Vector, magnitudes: Vector) -> bool:
        """Return whether A x = b has a solution, up to rounding.

        magnitudes : the sums of the |terms| that were added up to b.
        """
        sizes = self._R * magnitudes
        return bool(self._vanish(self._R * b, self._left_null, sizes).all())

    def contradictions(self, b: Vector) -> Vector:
        """Return by how much each system A x = b is inconsistent, for the columns b of
        an array of shape (k, m): the products u'b with the null vectors u of A', shape
        (j, m), relative to |b|; 0 where they are at the level of rounding errors.
        """
        scaled = self._R[:, np.newaxis] * b
        sizes = np.abs(scaled).sum(axis=0)
        products = self._left_null.T @ scaled / np.where(sizes > 0, sizes, 1.0)
        return np.asarray(np.where(np.abs(products) <= self._rounding, 0.0, products))

    def free(self, rows: Vector) -> Mask:
        """Return which components of x differ among the solutions of A x = b that have
        the same value of rows x, for rows of shape (m, k).
        """
        scaled = rows * self._C
        sizes = np.abs(scaled).sum(axis=1, keepdims=True)
        shares = scaled @ self._null / np.where(sizes > 0, sizes, 1.0)
        _, values, right = np.linalg.svd(finite(shares))
        fixed = np.count_nonzero(values > self._rounding)
        return ~self._vanish(np.diag(self._C), self._null @ right[fixed:].T)

    def _vanish(self, a: Vector, vectors: Vector, sizes: Vector | None = None) -> Mask:
        """Return whether a'v is 0 up to rounding for all columns v of `vectors`, for a
        of shape (k,), or for each row of a of shape (m, k).

        sizes : the magnitudes of the terms of which a is the sum, by default |a|.
        """
        magnitudes = np.abs(a if sizes is None else sizes).sum(axis=-1)
        largest = np.abs(vectors).max(axis=0, initial=0.0)
        limit = self._rounding * np.multiply.outer(magnitudes, largest)
        return np.asarray((np.abs(a @ vectors) <= limit).all(axis=-1))
