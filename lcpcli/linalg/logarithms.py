"""The least squares of logarithms that define the units of a matrix: rho and gamma with the least sum of
(log2 |M_ij| + rho_i + gamma_j)^2 over the entries that are not 0.

With the sign of gamma changed, the normal equations are those of the Laplacian of the bipartite graph of rows and
columns. A matrix without zeros solves them by its means. If the graph is a forest, all squares become 0, and each
unknown follows from the one above it. Few unknowns are solved for directly, those of a narrow band too, and others by
conjugate gradients, which take few steps unless the graph is long, and else by sparse elimination, which creates few
entries if it is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.doubles import largest
from lcpcli.linalg.krylov import conjugate_gradients, identity, norm
from lcpcli.linalg.matrices import Shape, compressed_multiplier, is_sparse, row_parts, width
from lcpcli.typing import Indices, Mask, Matrix, Vector

# rho, gamma, the components of rows and columns, each of shape (n,), and the number of components
Fitted: TypeAlias = tuple[Vector, Vector, Indices, Indices, int]
Arrays: TypeAlias = tuple[Indices, Indices, Vector]  # where each row begins, the columns and the values of the entries
SETTLED_ERROR = 1e-8  # of the first step of conjugate gradients, or of 1: the last step
FEW_CG_STEPS = 100  # after which elimination is tried
MOST_CG_STEPS = 300  # for so many rows that elimination may take too long, and for few rows that are also the columns
THIN = 4  # entries in a row of few symmetric ones, on average: elimination takes less then
FEW_SYMMETRIC, LARGEST_ELIMINATED = 10_000, 100_000  # rows
BAND = 5  # how far entries are from the diagonal in a band whose factors take less time than conjugate gradients
MOST_DENSE = 48  # rows up to which dense normal equations take no longer than conjugate gradients
FEW_ROWS = 256  # of a dense M, for which products with it are tried without a look at its zeros
DENSE, DENSE_CG_STEPS = 0.2, 30  # the share of entries from which products with them are dense, and the steps tried


def least_squares(M: Matrix, S: Vector | None = None) -> Fitted:
    """Return rho and gamma for M, dense or in compressed sparse rows, and the connected components of its rows and
    columns. In each component, the means of rho and gamma over the entries are equal.

    S : 1 for variables and -1 for multipliers, if M is that of a program.
    """
    if is_sparse(M):
        return _sparse(M, S)
    if M.all():
        n, nothing = M.shape[0], np.zeros(M.shape[0], dtype=np.intp)
        rows, columns = _sums(M) / max(n, 1)
        middle = float(rows.sum()) / max(2 * n, 1)
        return middle - rows, middle - columns, nothing, nothing, 1
    fitted = _dense(M) if M.shape[0] <= FEW_ROWS or np.count_nonzero(M) > DENSE * M.size else None
    if fitted is not None:
        return fitted
    with imports:
        from scipy.sparse import csr_array
    return _sparse(csr_array(M))


def mean_logarithms(rows: Vector) -> Vector:
    """Return the means of log2 |M_ij| in rows of a matrix: if it has no entry 0, their differences are those of
    `Units.rows` with the opposite sign."""
    return np.asarray(np.log2(np.abs(rows)).mean(axis=1))


def _sums(M: Vector) -> Vector:
    """Return the sums of log2 |M_ij| in rows and in columns of a matrix without zeros, shape (2, n)."""
    sums = np.zeros((2, M.shape[0]))
    for part in row_parts(*M.shape):
        logarithms = np.log2(np.abs(M[part]))
        sums[0, part] = logarithms.sum(axis=1)
        sums[1] += logarithms.sum(axis=0)
    return sums


def _dense(M: Vector) -> Fitted | None:
    """Return the fit for a dense M; None if it takes conjugate gradients many steps.

    For few rows, the normal equations become regular if the vectors are added that are 1 in the rows and -1 in the
    columns of a component.
    """
    n, used = M.shape[0], M != 0
    entries, logarithms = used.astype(np.float64), np.log2(np.abs(M), where=used, out=np.zeros(M.shape))
    sums, counts = (np.array([each.sum(axis=1), each.sum(axis=0)]) for each in (logarithms, entries))
    if n > MOST_DENSE:
        scaled = entries / np.multiply.outer(*map(_roots, counts))
        times = [scaled.__matmul__, scaled.T.__matmul__]
        *found, is_settled = _by_gradients([*sums], [*counts], times, DENSE_CG_STEPS)
        if not is_settled:
            return None
    row_part, column_part, parts = _components(used, entries)
    part = np.concatenate((row_part, column_part))
    if n <= MOST_DENSE:
        signs = np.repeat((1.0, -1.0), n)
        N = (part[:, np.newaxis] == part) * np.outer(signs, signs) + np.diag(counts.ravel())
        N[:n, n:] += entries
        N[n:, :n] += entries.T
        found = [np.linalg.solve(N, -sums.ravel())]
    return (*_centred(np.concatenate(found), counts, part, parts), row_part, column_part, parts)


def _sparse(M: Matrix, S: Vector | None = None) -> Fitted:
    with imports:
        from scipy.sparse.csgraph import connected_components

        from lcpcli.linalg.compressed_rows import of_arrays, transposed
    if not M.data.all():
        M = M.copy()
        M.eliminate_zeros()
    n, ones = M.shape[0], np.ones(M.nnz)
    index = np.int32 if max(2 * n + 1, M.nnz) < 2**31 else np.int64  # of which scipy would look at each
    indptr, indices = (each.astype(index, copy=False) for each in (M.indptr, M.indices))
    rows = indptr, indices, np.log2(np.abs(M.data))
    columns = rows if S is not None else transposed(M.shape, *rows)
    is_symmetric = S is not None or all(map(np.array_equal, rows, columns))
    if M.diagonal().all():  # it couples row i and column i: half of the graph will do
        parts, half = connected_components(of_arrays(M.shape, indptr, indices, ones), directed=False)
        part = np.concatenate((half, half))
    else:
        whole = np.concatenate((indptr, np.full(n, M.nnz, dtype=index)))
        parts, part = connected_components(of_arrays((2 * n, 2 * n), whole, indices + n, ones), directed=False)
    counts = np.array([np.diff(indptr), np.diff(columns[0])], dtype=np.float64)
    ones = np.ones(n)
    sums = [compressed_multiplier(M.shape, *places)(ones) for places in ((rows,) if is_symmetric else (rows, columns))]
    sums = [sums[0], sums[-1]]
    if M.nnz == 2 * n - parts:
        x = _forest(*rows, part, parts)
    elif (farthest := width(M)) <= BAND:
        times = [_product((*each[:2], np.ones(M.nnz)), n) for each in (rows, columns)]
        x = _banded(M, farthest, np.array(sums), counts, times, _first_of_parts(part, parts))
    else:
        is_brief, is_settled = n > LARGEST_ELIMINATED or (is_symmetric and n <= FEW_SYMMETRIC), False
        most = MOST_CG_STEPS if is_brief else FEW_CG_STEPS
        if not is_symmetric:
            times = [_product(_scaled(*each), n) for each in ((rows, *counts), (columns, *counts[::-1]))]
            *both, is_settled = _by_gradients(sums, [*counts], times, most)
            x = np.concatenate(both)
        elif n > FEW_SYMMETRIC or M.nnz > THIN * n:
            chosen = np.zeros(n, dtype=bool) if S is None else S < 0
            found, is_settled = _symmetric(M.shape, rows, sums[0], counts[0], chosen, most)
            x = np.concatenate((found, found))
        if not is_settled and n <= LARGEST_ELIMINATED:
            E = of_arrays(M.shape, indptr, indices, np.ones(M.nnz))
            x = _eliminated(E, sums, counts, part, parts, is_symmetric)
    rho, gamma = _centred(x, counts, part, parts)
    if is_symmetric:
        rho = gamma = (rho + gamma) / 2
    return rho, gamma, part[:n], part[n:], parts


def _symmetric(
    shape: Shape, rows: Arrays, sums: Vector, counts: Vector, chosen: Mask, most: int
) -> tuple[Vector, bool]:
    """Return rho = gamma for a symmetric matrix, and whether conjugate gradients have settled them. chosen : the rows
    that are eliminated, if there are no entries between them."""
    with imports:
        from lcpcli.linalg.compressed_rows import block, of_arrays, transposed
    first, other, M = chosen.nonzero()[0], (~chosen).nonzero()[0], of_arrays(shape, *rows)
    places = block(M, first, other)
    if places[1].size < counts[first].sum():
        return _symmetric(shape, rows, sums, counts, np.zeros_like(chosen), most)
    of_logarithms, of_entries = ([v[first], v[other]] for v in (sums, counts))
    scaled = _scaled(places, *of_entries)
    times = [_product(scaled, other.size), _product(transposed((first.size, other.size), *scaled), first.size)]
    inner = block(M, other, other) if first.size else rows
    if inner[1].size:
        times.append(_product(_scaled(inner, of_entries[1], of_entries[1]), other.size))
    x = np.empty(counts.size)
    x[first], x[other], is_settled = _by_gradients(of_logarithms, of_entries, times, most)
    return x, is_settled


def _scaled(places: Arrays, of_rows: Vector, of_columns: Vector) -> Arrays:
    """Return the entries of a matrix as 1 / root(r c), where r and c are the counts of their rows and columns."""
    indptr, indices, _ = places
    return indptr, indices, np.repeat(1 / _roots(of_rows), np.diff(indptr)) / _roots(of_columns)[indices]


def _product(matrix: Arrays, columns: int) -> Callable[[Vector], Vector]:
    return compressed_multiplier((matrix[0].size - 1, columns), *matrix)


def _centred(x: Vector, counts: Vector, part: Indices, parts: int) -> tuple[Vector, Vector]:
    """Return rho and gamma with equal means in each component, over as many entries as rows and columns have."""
    (rows, columns), n = counts, counts.shape[1]
    entries = np.maximum(np.bincount(part[:n], rows, parts), 1.0)
    totals = np.bincount(part[:n], rows * x[:n], parts) - np.bincount(part[n:], columns * x[n:], parts)
    change = totals / (2 * entries)
    return x[:n] - change[part[:n]], x[n:] + change[part[n:]]


def _by_gradients(
    sums: Sequence[Vector], counts: Sequence[Vector], times: Sequence[Callable[[Vector], Vector]], most: int
) -> tuple[Vector, Vector, bool]:
    """Return rho and gamma by conjugate gradients on the normal equations, with 1 on their diagonal, after rho is
    eliminated, which halves the steps; and whether at most so many of these settled them.

    sums, counts : of the logarithms, and the numbers of entries, in rows and in columns. times : the product with the
    matrix that has 1 / root(r c) for each entry, where r and c are the counts of its row and column, with its transpose
    and, if there are any, with the same of entries between columns.
    """
    (forth, back, *among), (of_rows, of_columns) = times, map(_roots, counts)
    means = sums[0] / of_rows
    b = back(means) - sums[1] / of_columns

    def product(v: Vector) -> Vector:
        image = v - back(forth(v)) if of_rows.size else v.copy()
        for other in among:
            image += other(v)
        return image

    settled, root = SETTLED_ERROR * max(largest(b / of_columns), 1.0), max(b.size, 1) ** 0.5

    def measure(r: Vector) -> float:
        mean = norm(r) / root
        return mean if mean > settled else largest(r / of_columns)

    gamma, left = conjugate_gradients(product, b, np.zeros(b.size), settled, most, identity, measure)
    return -(means + forth(gamma)) / of_rows, gamma / of_columns, left <= settled


def _roots(counts: Vector) -> Vector:
    return np.sqrt(np.maximum(counts, 1.0))


def _forest(indptr: Indices, indices: Indices, logarithms: Vector, part: Indices, parts: int) -> Vector:
    """Return rho and gamma, one after another, of a forest: 0 at the root of each tree, and else x_v = a_v - x_above.
    Each step of the loop puts twice as many steps up the tree in one."""
    with imports:
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import breadth_first_order
    n = indptr.size - 1
    roots = _first_of_parts(part, parts)
    places = np.concatenate((indices + n, roots.astype(indices.dtype)))
    begins = np.concatenate((indptr, np.full(n, indices.size), [places.size])).astype(indptr.dtype)
    graph = csr_array((np.ones(places.size), places, begins), shape=(2 * n + 1, 2 * n + 1))
    above = breadth_first_order(graph, 2 * n, directed=False)[1]
    above[2 * n] = 2 * n
    owners = np.repeat(np.arange(n), np.diff(indptr))
    is_up = above[owners] == indices + n
    x, signs = np.zeros(2 * n + 1), np.full(2 * n + 1, -1.0)
    x[owners[is_up]] = -logarithms[is_up]
    x[indices[~is_up] + n] = -logarithms[~is_up]
    signs[2 * n] = 0.0
    while (above != 2 * n).any():
        x += signs * x[above]
        signs, above = signs * signs[above], above[above]
    return x[: 2 * n]


def _first_of_parts(part: Indices, parts: int) -> Indices:
    first = np.empty(parts, dtype=np.intp)
    first[part[::-1]] = np.arange(part.size - 1, -1, -1)
    return first


def _eliminated(
    E: Matrix, sums: Sequence[Vector], counts: Vector, part: Indices, parts: int, is_symmetric: bool
) -> Vector:
    """Return rho and gamma, one after another, by elimination and one step of refinement, with one of them 0 in each
    component; the two are equal for a symmetric matrix, whose equations are singular only where a row and its column
    are in different components. E : the matrix with ones for the entries."""
    with imports:
        from scipy.sparse import block_array

        from lcpcli.linalg.shifted_systems import systems
    n = E.shape[0]
    if is_symmetric:
        roots = np.unique(np.minimum(part[:n], part[n:]), return_index=True)[1]
        roots = roots[part[roots] != part[n + roots]]
        b, d, factors = -sums[0], counts[0].copy(), systems(E, np.ones(n))
    else:
        E, roots = block_array([[None, E], [E.T, None]], format="csr"), _first_of_parts(part, parts)
        b, d, factors = -np.concatenate(sums), counts.flatten(), systems(E, None)
    d[roots] += 1.0
    factors.factorize(d)
    x = factors.solve(b)
    x += factors.solve(b - d * x - E @ x)
    return np.tile(x, 2) if is_symmetric else x


def _banded(
    M: Matrix, farthest: int, sums: Vector, counts: Vector, times: list[Callable[[Vector], Vector]], roots: Indices
) -> Vector:
    """Return rho and gamma, one after another, of a band by Cholesky factors, with 0 at the roots, and one step of
    refinement. Row i of M has place 2 i, and column j place 2 j + 1. times : as in `_by_gradients`."""
    with imports:
        from scipy.linalg import cho_solve_banded, cholesky_banded
    n, last = M.shape[0], 2 * farthest + 1
    rows, columns = 2 * np.repeat(np.arange(n), np.diff(M.indptr)), 2 * M.indices + 1
    N = np.zeros((last + 1, 2 * n))
    N[last - np.abs(rows - columns), np.maximum(rows, columns)] = 1.0
    N[last] = counts.T.ravel()
    N[last, 2 * (roots % n) + roots // n] += 1.0
    factors, x = cholesky_banded(N, overwrite_ab=True, check_finite=False), np.zeros((2, n))
    for _ in range(2):
        residual = sums + counts * x + [times[0](x[1]), times[1](x[0])]
        x -= cho_solve_banded((factors, False), residual.T.ravel(), check_finite=False).reshape(n, 2).T
    return x.ravel()


def _components(used: Mask, entries: Vector) -> tuple[Indices, Indices, int]:
    """Return the components of the rows and of the columns that have entries, and their number: by breadth-first search
    or, for few rows, by powers of the matrix of rows that share a column; entries : `used` as numbers."""
    n, count = used.shape[0], 0
    rows, columns = np.full((2, n), -1, dtype=np.intp)
    if n <= MOST_DENSE:
        linked, before = entries @ entries.T + np.eye(n) > 0, -1
        while before != (before := int(np.count_nonzero(linked))):
            linked = linked @ linked
        first = linked.argmax(axis=1)
        roots = first == np.arange(n)
        rows, count = (np.cumsum(roots) - 1)[first], int(np.count_nonzero(roots))
        columns = np.where(used.any(axis=0), rows[used.argmax(axis=0)], -1)
    for i in range(n if n > MOST_DENSE else 0):
        if rows[i] >= 0:
            continue
        front: Indices = np.array([i])
        while front.size:
            rows[front] = count
            reached = (used[front].any(axis=0) & (columns < 0)).nonzero()[0]
            columns[reached] = count
            front = (used[:, reached].any(axis=1) & (rows < 0)).nonzero()[0]
        count += 1
    alone = (columns < 0).nonzero()[0]
    columns[alone] = np.arange(count, count + alone.size)
    return rows, columns, count + alone.size
