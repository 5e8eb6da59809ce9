"""The units of rows and columns that a matrix itself suggests, the groups of them that
are coupled, and equilibration.

A. R. Curtis and J. K. Reid, On the automatic scaling of matrices for Gaussian
elimination, IMA Journal of Applied Mathematics 10 (1972) 118-124: R and C with the
least sum of squares of log2 |R_i M_ij C_j| over the nonzero entries. They are unique up
to a constant for each connected component of rows and columns, with an edge where M_ij
is not 0, so that what is measured in them does not depend on the units in which M is
given.

With rho = log2 R and the sign of gamma = log2 C changed, the normal equations are those
of the Laplacian of the bipartite graph of rows and columns. A matrix without zeros
solves them by its means. Few unknowns are solved for directly, those of a narrow band
too, and others by conjugate gradients, which take few steps unless the graph is long,
and else by sparse elimination, which creates few entries if it is.

Equilibration: for positive diagonals R and C the solutions of LCP(R M C, R q) are z / C
with w scaled by R. With R and C computed from the matrix itself, what is measured in
scaled units hardly depends on the units of the data.

Systems with a singular matrix: a solution, what all solutions share, and whether there
is one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import FAR_FROM_ONE, ROW_ROUNDING, generic, largest
from lcpcli.linalg.factors import finite
from lcpcli.linalg.krylov import Operator, conjugate_gradients, identity, norm
from lcpcli.linalg.matrices import (
    Shape,
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

# Each sweep halves the remaining exponents, so that all converge unless M couples them.
MAX_SWEEPS = 30
# Exponent of the ratio of units above which logarithms are balanced first, then the
# largest entries.
UNITS_FAR_APART = 40.0
# Exponent of the ratio of units up to which the exponents of the first sweep limit
# those of the others.
NEAR_UNITS = 4.0
# Binary digits by which exponents may leave the range of those of the first sweep.
EXPONENT_MARGIN = 4.0
# Of two: exponents are limited to it, so that R, C and what they divide stay finite.
LARGEST_POWER = 1000.0
# Of the first step of conjugate gradients, or of 1: the last step; for programs, which
# take few milliseconds.
CONVERGED_ERROR, CONVERGED_ERROR_OF_PROGRAM = 1e-8, 1e-3
FEW_CG_STEPS = 100  # after which elimination is tried
# For so many rows that elimination may take too long, and for few rows that are also
# the columns.
MAX_CG_STEPS = 300
# Entries in a row of few symmetric ones, on average: elimination takes half as long
# then for narrow grids. For networks, as of transport and spatial prices, conjugate
# gradients would take .7 of its time with 400 unknowns, .4 with 2000 and .2 with 8000,
# and leave an error of 1e-3 in the powers for circuits.
THIN = 4
FEW_SYMMETRIC, LARGEST_ELIMINATED = 10_000, 100_000  # rows
# How far entries are from the diagonal in a band whose factors take less time than
# conjugate gradients.
BAND = 5
# Rows up to which dense normal equations take no longer than conjugate gradients.
MAX_DENSE = 48
# Rows of a dense M up to which products with it are attempted, whatever its zeros.
FEW_ROWS = 256
# The share of entries from which products with them are dense, and the steps tried.
DENSE, DENSE_CG_STEPS = 0.2, 30


class Units(NamedTuple):
    """Units R and C. rows, columns : log2 of R and of C, shape (n,). row_part,
    column_part : the numbers of the connected components of rows and columns, 0 to
    parts - 1, shape (n,)."""

    rows: Vector
    columns: Vector
    row_part: Indices
    column_part: Indices
    parts: int

    def diagonals(self) -> tuple[Vector, Vector]:
        """Return R and C, rounded to powers of two, so that scaling by them is
        exact."""
        return np.exp2(np.rint(self.rows)), np.exp2(np.rint(self.columns))

    def largest(self, values: Vector, component_of: Indices) -> Vector:
        """Return the largest value in each component, for values of rows or columns
        with these components, of shape (..., n); minus infinity in an empty
        component."""
        if self.parts == 1:
            return np.asarray(values.max(axis=-1, keepdims=True, initial=-np.inf))
        largest_values = np.full((*values.shape[:-1], self.parts), -np.inf)
        # The first takes a fraction of the time.
        position: Any = component_of if values.ndim == 1 else (..., component_of)
        np.maximum.at(largest_values, position, values)
        return largest_values


def units(M: Matrix, S: Vector | None = None) -> Units:
    """Return the units of M, dense or in compressed sparse rows, with finite entries.
    In each component, the means of log2 R and log2 C over the entries are equal.

    S : 1 for variables and -1 for multipliers, if M is that of a program.
    """
    if is_sparse(M):
        return _sparse(M, S)
    if M.all():
        n, nothing = M.shape[0], np.zeros(M.shape[0], dtype=np.intp)
        rows, columns = _sums(M) / max(n, 1)
        middle = float(rows.sum()) / max(2 * n, 1)
        return Units(middle - rows, middle - columns, nothing, nothing, 1)
    fitted = (
        _dense(M)
        if M.shape[0] <= FEW_ROWS or np.count_nonzero(M) > DENSE * M.size
        else None
    )
    if fitted is not None:
        return fitted
    with imports:
        from scipy.sparse import csr_array
    return _sparse(csr_array(M))


def _sums(M: Vector) -> Vector:
    """Return the sums of log2 |M_ij| in rows and in columns of a matrix without zeros,
    shape (2, n)."""
    sums = np.zeros((2, M.shape[0]))
    for rows in row_parts(*M.shape):
        logarithms = np.log2(np.abs(M[rows]))
        sums[0, rows] = logarithms.sum(axis=1)
        sums[1] += logarithms.sum(axis=0)
    return sums


def _dense(M: Vector) -> Units | None:
    """Return the fit for a dense M; None if it takes conjugate gradients many steps.

    For few rows, the normal equations become regular if the vectors are added that are
    1 in the rows and -1 in the columns of a component.
    """
    n, used = M.shape[0], M != 0
    entries, logarithms = (
        used.astype(np.float64),
        np.log2(np.abs(M), where=used, out=np.zeros(M.shape)),
    )
    sums, counts = (
        np.array([terms_of_sum.sum(axis=1), terms_of_sum.sum(axis=0)])
        for terms_of_sum in (logarithms, entries)
    )
    if n > MAX_DENSE:
        scaled = entries / np.multiply.outer(*map(_roots, counts))
        times = [scaled.__matmul__, scaled.T.__matmul__]
        *fitted, has_converged = _by_gradients(
            [*sums], [*counts], times, DENSE_CG_STEPS
        )
        if not has_converged:
            return None
    row_part, column_part, n_components = _components(used, entries)
    component_of = np.concatenate((row_part, column_part))
    if n <= MAX_DENSE:
        signs = np.repeat((1.0, -1.0), n)
        N = (component_of[:, np.newaxis] == component_of) * np.outer(
            signs, signs
        ) + np.diag(counts.ravel())
        N[:n, n:] += entries
        N[n:, :n] += entries.T
        fitted = [np.linalg.solve(N, -sums.ravel())]
    return Units(
        *_centred(np.concatenate(fitted), counts, component_of, n_components),
        row_part,
        column_part,
        n_components,
    )


def _sparse(M: Matrix, S: Vector | None = None) -> Units:
    with imports:
        from scipy.sparse.csgraph import connected_components

        from lcpcli.linalg.compressed_rows import of_arrays, transposed
    if not M.data.all():
        M = M.copy()
        M.eliminate_zeros()
    n, ones = M.shape[0], np.ones(M.nnz)
    # Of which scipy would look at each.
    index = np.int32 if max(2 * n + 1, M.nnz) < 2**31 else np.int64
    indptr, indices = (each.astype(index, copy=False) for each in (M.indptr, M.indices))
    rows = indptr, indices, np.log2(np.abs(M.data))
    columns = rows if S is not None else transposed(M.shape, *rows)
    is_symmetric = S is not None or all(map(np.array_equal, rows, columns))
    if M.diagonal().all():  # it couples row i and column i: half of the graph will do
        n_components, half = connected_components(
            of_arrays(M.shape, indptr, indices, ones), directed=False
        )
        component_of = np.concatenate((half, half))
    else:
        indptr_of_rows_and_columns = np.concatenate(
            (indptr, np.full(n, M.nnz, dtype=index))
        )
        n_components, component_of = connected_components(
            of_arrays((2 * n, 2 * n), indptr_of_rows_and_columns, indices + n, ones),
            directed=False,
        )
    counts = np.array([np.diff(indptr), np.diff(columns[0])], dtype=np.float64)
    ones = np.ones(n)
    sums = [
        compressed_multiplier(M.shape, *row_arrays)(ones)
        for row_arrays in ((rows,) if is_symmetric else (rows, columns))
    ]
    sums = [sums[0], sums[-1]]
    if counts.max(initial=0.0) <= 2 * BAND + 1 and (farthest := width(M)) <= BAND:
        times = [_product((*each[:2], np.ones(M.nnz)), n) for each in (rows, columns)]
        x = _banded(
            M,
            farthest,
            np.array(sums),
            counts,
            times,
            _first_of_components(component_of, n_components),
        )
    else:
        is_brief, has_converged = (
            n > LARGEST_ELIMINATED or (is_symmetric and n <= FEW_SYMMETRIC),
            False,
        )
        max_steps = MAX_CG_STEPS if is_brief else FEW_CG_STEPS
        if not is_symmetric:
            times = [
                _product(_scaled(*each), n)
                for each in ((rows, *counts), (columns, *counts[::-1]))
            ]
            *both, has_converged = _by_gradients(sums, [*counts], times, max_steps)
            x = np.concatenate(both)
        elif n > FEW_SYMMETRIC or M.nnz > THIN * n:
            is_eliminated = np.zeros(n, dtype=bool) if S is None else S < 0
            error = (
                CONVERGED_ERROR_OF_PROGRAM if is_eliminated.any() else CONVERGED_ERROR
            )
            symmetric_fit, has_converged = _symmetric(
                M.shape, rows, sums[0], counts[0], is_eliminated, max_steps, error
            )
            x = np.concatenate((symmetric_fit, symmetric_fit))
        if not has_converged and n <= LARGEST_ELIMINATED:
            E = of_arrays(M.shape, indptr, indices, np.ones(M.nnz))
            x = _eliminated(E, sums, counts, component_of, n_components, is_symmetric)
    rho, gamma = _centred(x, counts, component_of, n_components)
    if is_symmetric:
        rho = gamma = (rho + gamma) / 2
    return Units(rho, gamma, component_of[:n], component_of[n:], n_components)


# Without it: an obstacle with 40,000 unknowns takes 1.85 times as long.
def _symmetric(
    shape: Shape,
    rows: Arrays,
    sums: Vector,
    counts: Vector,
    is_eliminated: Mask,
    max_steps: int,
    error: float,
) -> tuple[Vector, bool]:
    """Return rho = gamma for a symmetric matrix, and whether conjugate gradients have
    converged. is_eliminated : the rows that are eliminated, if there are no entries
    between them."""
    with imports:
        from lcpcli.linalg.compressed_rows import block, of_arrays, transposed
    first = is_eliminated.nonzero()[0]
    other = (~is_eliminated).nonzero()[0]
    M = of_arrays(shape, *rows)
    off_diagonal_block = block(M, first, other)
    if off_diagonal_block[1].size < counts[first].sum():
        return _symmetric(
            shape, rows, sums, counts, np.zeros_like(is_eliminated), max_steps, error
        )
    of_logarithms, of_entries = ([v[first], v[other]] for v in (sums, counts))
    scaled = _scaled(off_diagonal_block, *of_entries)
    times = [
        _product(scaled, other.size),
        _product(transposed((first.size, other.size), *scaled), first.size),
    ]
    inner = block(M, other, other) if first.size else rows
    if inner[1].size:
        times.append(_product(_scaled(inner, of_entries[1], of_entries[1]), other.size))
    x = np.empty(counts.size)
    x[first], x[other], has_converged = _by_gradients(
        of_logarithms, of_entries, times, max_steps, error
    )
    return x, has_converged


def _scaled(arrays: Arrays, of_rows: Vector, of_columns: Vector) -> Arrays:
    """Return the entries of a matrix as 1 / root(r c), where r and c are the counts of
    their rows and columns."""
    indptr, indices, _ = arrays
    return (
        indptr,
        indices,
        np.repeat(1 / _roots(of_rows), np.diff(indptr)) / _roots(of_columns)[indices],
    )


def _product(matrix: Arrays, columns: int) -> Operator:
    return compressed_multiplier((matrix[0].size - 1, columns), *matrix)


def _centred(
    x: Vector, counts: Vector, component_of: Indices, n_components: int
) -> tuple[Vector, Vector]:
    """Return rho and gamma with equal means in each component, over as many entries as
    rows and columns have."""
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
    """Return rho and gamma by conjugate gradients on the normal equations, with 1 on
    their diagonal, after rho is eliminated, which halves the steps; and whether at most
    so many of these settled them.

    sums, counts : of the logarithms, and the numbers of entries, in rows and in
    columns. times : the product with the matrix that has 1 / root(r c) for each entry,
    where r and c are the counts of its row and column, with its transpose and, if there
    are any, with the same of entries between columns.
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

    gamma, residual_size = conjugate_gradients(
        product, b, np.zeros(b.size), max_error, max_steps, identity, measure
    )
    return (
        -(means + forth(gamma)) / of_rows,
        gamma / of_columns,
        residual_size <= max_error,
    )


def _roots(counts: Vector) -> Vector:
    return np.sqrt(np.maximum(counts, 1.0))


def _first_of_components(component_of: Indices, n_components: int) -> Indices:
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
    """Return rho and gamma, one after another, by elimination and one step of
    refinement, with one of them 0 in each component; the two are equal for a symmetric
    matrix, whose equations are singular only where a row and its column are in
    different components. E : the matrix with ones for the entries."""
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
        factors = systems(E, np.ones(n))
    else:
        E, roots = (
            block_array([[None, E], [E.T, None]], format="csr"),
            _first_of_components(component_of, n_components),
        )
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
    """Return rho and gamma, one after another, of a band by Cholesky factors, with 0 at
    the roots, and one step of refinement. Row i of M has place 2 i, and column j place
    2 j + 1. times : as in `_by_gradients`."""
    with imports:
        from scipy.linalg import cho_solve_banded, cholesky_banded
    n, last = M.shape[0], 2 * farthest + 1
    rows, columns = 2 * np.repeat(np.arange(n), np.diff(M.indptr)), 2 * M.indices + 1
    N = np.zeros((last + 1, 2 * n))
    N[last - np.abs(rows - columns), np.maximum(rows, columns)] = 1.0
    N[last] = counts.T.ravel()
    N[last, 2 * (roots % n) + roots // n] += 1.0
    factors, x = (
        cholesky_banded(N, overwrite_ab=True, check_finite=False),
        np.zeros((2, n)),
    )
    for _ in range(2):
        residual = sums + counts * x + [times[0](x[1]), times[1](x[0])]
        x -= (
            cho_solve_banded((factors, False), residual.T.ravel(), check_finite=False)
            .reshape(n, 2)
            .T
        )
    return x.ravel()


def _components(used: Mask, entries: Vector) -> tuple[Indices, Indices, int]:
    """Return the components of the rows and of the columns that have entries, and their
    number: by breadth-first search or, for few rows, by powers of the matrix of rows
    that share a column; entries : `used` as numbers."""
    n, count = used.shape[0], 0
    rows, columns = np.full((2, n), -1, dtype=np.intp)
    if n <= MAX_DENSE:
        linked, before = entries @ entries.T + np.eye(n) > 0, -1
        while before != (before := int(np.count_nonzero(linked))):
            numbers = linked.astype(np.float64)  # whose product is one by BLAS
            linked = numbers @ numbers > 0
        first = linked.argmax(axis=1)
        roots = first == np.arange(n)
        rows, count = (np.cumsum(roots) - 1)[first], int(np.count_nonzero(roots))
        columns = np.where(used.any(axis=0), rows[used.argmax(axis=0)], -1)
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
    alone = (columns < 0).nonzero()[0]
    columns[alone] = np.arange(count, count + alone.size)
    return rows, columns, count + alone.size


def equilibrate(
    M: Matrix, q: Vector, rows: Vector | None = None
) -> tuple[Vector, Vector]:
    """Return diagonals R, C of shape (n,) for which the rows and columns of R |M| C
    have largest entries near 1.

    Rows and columns are divided simultaneously by the square roots of their largest
    entries (D. Ruiz, A scaling algorithm to equilibrate both rows and columns norms in
    matrices, RAL-TR-2001-034), repeatedly until every largest entry lies between 1/2
    and 2, at most MAX_SWEEPS times. The divisors are powers of two, so that scaling is
    exact, and stay finite. A symmetric M stays symmetric: R = C. A zero row is scaled
    until its entry of q is as large as the largest other one; a zero column, which has
    no scale, is left unscaled. Uncoupled blocks of M keep their common units. No
    exponent ends more than EXPONENT_MARGIN outside the range of the exponents of the
    first sweep.

    rows : the largest |entry| of each row of M, if they are known: M need then not be
        read if its diagonal is nearly as large.
    """
    rows, diagonal = (
        matrices.row_maxima(M) if rows is None else rows,
        np.abs(M.diagonal()),
    )
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
    """Return the exponents of the factors of rows, and then of columns, by which
    `equilibrate` makes these largest entries about 1, shape (2 n,); none where it would
    balance logarithms first. It is compiled as well, for a dense M, as are the
    functions that it calls."""
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
    """Return the exponents after at most MAX_SWEEPS from some with which the largest
    entries have these sizes; limited ones leave the range of those of the first sweep
    by EXPONENT_MARGIN at most, if these are near each other."""
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
    """Return the largest entries of rows, and then of columns, in units with these
    exponents, shape (2 n,)."""
    factors, n = np.exp2(powers), M.shape[0]
    rows, columns = matrices.row_and_column_maxima(M, factors[:n], factors[n:])
    return np.concatenate((rows, columns))


def common_power(least: float, largest: float) -> float:
    """Return the power of two that scales all rows and columns, as their largest
    entries lie between the least |M_ii| and the largest |M_ij|; NaN if these two need
    different powers, or are far from 1."""
    if not (least > 1.0 / FAR_FROM_ONE and largest < FAR_FROM_ONE):
        return np.nan
    first, last = -np.rint(0.5 * np.log2(largest)), -np.rint(0.5 * np.log2(least))
    return float(first) if first == last else np.nan


def are_far_apart(sizes: Vector) -> bool:
    """Return whether sizes differ by more than units in common use do."""
    used = sizes[sizes > 0.0]
    return bool(
        used.size > 0 and np.log2(used.max()) - np.log2(used.min()) > UNITS_FAR_APART
    )


def half_power(sizes: Vector) -> Vector:
    """Return half the binary logarithm of each size, rounded to an integer; 0 where the
    size is 0."""
    found: Vector = np.rint(0.5 * np.log2(sizes + (sizes == 0.0)))
    return found


# The relative change by rounding from which a matrix counts as singular.
MIN_DIGITS = 1e-3
# Relative to the largest: smaller ones count as 0.
MIN_SINGULAR_VALUE = ROW_ROUNDING / MIN_DIGITS


def largest_growth(A: Matrix, solve: Callable[[Vector], Vector]) -> float:
    """Return the largest relative change of a solution, in the units of the columns of
    A, if each row changes by its natural size; a lower bound on the condition that does
    not depend on units. Nan if A has a column of zeros. solve : solves A x = b."""
    known_solution = 1 / column_maxima(A)
    changes = absolute_product(A, known_solution) * generic(known_solution.size)
    return float(np.abs(solve(changes) / known_solution).max())


class PseudoInverse:
    """A generalized inverse of a dense matrix A of shape (k, k), and bases of the null
    spaces of A and of A', so that A G A = A and G A G = G.

    In the units R and C that A suggests, a factorization R A C P = Q T with column
    pivoting (G. H. Golub and C. F. Van Loan, Matrix Computations, 4th ed., Johns
    Hopkins 2013, section 5.4) shows the rank r, the number of pivots that are no
    rounding. With T = (T_11, T_12) in its first r rows, and Q_1 the first r columns of
    Q,

        G = C P (T_11^-1 Q_1', 0) R,

    A x = 0 for x = C v, v = P (-T_11^-1 T_12, I), and A'y = 0 for y = R u, u the other
    columns of Q.

    Rounding makes of a v_i = 0 what is small beside the largest |v_i|. So a_i'v is 0 up
    to rounding if it is small beside |a|_1 max|v|; beside |a|'|v|, which is as small
    where v_i = 0 wherever a_i is not, it never is.

    min_pivot : a pivot counts as 0 if it is below this, relative to the largest.
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
        # The first pivot that counts as 0, relative to the last one that does not.
        self.gap = float(pivots[rank] / pivots[rank - 1]) if 0 < rank < len(A) else 0.0
        # Of the null spaces.
        condition = pivots[0] / pivots[rank - 1] if rank else 1.0
        self._rounding = len(A) * ROW_ROUNDING * condition

    def __call__(self, b: Vector, transposed: bool = False) -> Vector:
        """Return G b or G'b."""
        return np.asarray((self._inverse.T if transposed else self._inverse) @ b)

    def determines(self, J: Vector) -> Mask:
        """Return for which rows of J, shape (m, k), J x is the same for all solutions x
        of A x = b, up to rounding."""
        return self._vanish(J * self._C, self._null)

    def is_consistent(self, b: Vector, magnitudes: Vector) -> bool:
        """Return whether A x = b has a solution, up to rounding of the terms that b is
        the sum of."""
        sizes = self._R * magnitudes
        return bool(self._vanish(self._R * b, self._left_null, sizes).all())

    def contradictions(self, b: Vector) -> Vector:
        """Return by how much A x = b contradicts itself, for columns b of shape (k, m):
        the products with the null vectors of A', shape (j, m), relative to the terms;
        0 where they are rounding."""
        scaled = self._R[:, np.newaxis] * b
        sizes = np.abs(scaled).sum(axis=0)
        products = self._left_null.T @ scaled / np.where(sizes > 0, sizes, 1.0)
        return np.asarray(np.where(np.abs(products) <= self._rounding, 0.0, products))

    def free(self, rows: Vector) -> Mask:
        """Return which components differ among the solutions of A x = b that have the
        same rows x, for rows of shape (m, k)."""
        scaled = rows * self._C
        sizes = np.abs(scaled).sum(axis=1, keepdims=True)
        shares = scaled @ self._null / np.where(sizes > 0, sizes, 1.0)
        _, values, right = np.linalg.svd(finite(shares))
        fixed = np.count_nonzero(values > self._rounding)
        return ~self._vanish(np.diag(self._C), self._null @ right[fixed:].T)

    def _vanish(self, a: Vector, vectors: Vector, sizes: Vector | None = None) -> Mask:
        """Return for which a, of shape (k,) or (m, k), a'v is 0 up to rounding for each
        of the vectors v, the columns. sizes : of the terms of a, by default |a|."""
        magnitudes = np.abs(a if sizes is None else sizes).sum(axis=-1)
        largest = np.abs(vectors).max(axis=0, initial=0.0)
        limit = self._rounding * np.multiply.outer(magnitudes, largest)
        return np.asarray((np.abs(a @ vectors) <= limit).all(axis=-1))
