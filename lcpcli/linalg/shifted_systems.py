"""Linear systems with M + diag(d) for one d after another; the pattern is analysed only
once.

If signs S make S M symmetric, no pivoting is needed (see `patterns.signs`): the factors
are LDL' by QDLDL, if it is installed and faster, or those of SuperLU with diagonal
pivots in an order for symmetric patterns, after dense rows and columns are split off. A
dense M has LU factors with partial pivoting.
"""

from __future__ import annotations

import math
from functools import partial
from importlib.util import find_spec
from typing import Any, TypeAlias

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg import factors, matrices
from lcpcli.linalg.factors import SingularMatrix, Solve
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.patterns import order_of
from lcpcli.typing import Indices, Matrix, Vector

DENSE_FACTOR = 10.0  # a row with more than this times sqrt(n) entries is dense
# The largest number of dense rows and columns that are split off as a border: more
# would cost more than they save.
MAX_SPLIT_OFF = 30
# Orders up to which a single system is solved with dense factors, which take a fifth to
# a half of the time: any, and one at most half of whose entries are 0, for which they
# take a tenth to a sixth. Beyond, blocks of rank one save more.
MAX_ONCE_AS_DENSE, MAX_FILLED_ONCE_AS_DENSE = 150, 400
# Operations per entry of M up to which the variables with a diagonal block are
# eliminated first.
MAX_AT_ONCE = 100.0
# Numbers of a dense border per entry of M up to which it takes less time than sparse
# factors.
MAX_FILLED = 5.0
# Operations per entry of the factors beyond which SuperLU's dense blocks (supernodes)
# take less time than QDLDL.
MAX_PER_ENTRY = 300.0
Systems: TypeAlias = "SuperLU | LDL | Bordered | _Dense"
"""Systems with M + diag(d) for one M: factorize(d) computes factors, or raises
SingularMatrix; solve(b) solves with the last factors."""


def systems(M: Matrix, S: Vector | None, once: bool = False) -> Systems:
    """Return a solver of systems with M + diag(d), for M dense or in compressed sparse
    rows, and S the signs of `patterns.signs` or None.

    once : whether a single d is expected: QDLDL's search for an order may then take
    longer than it saves.
    """
    if not is_sparse(M):
        return _Dense(M)
    n = M.shape[0]
    is_filled = 2 * M.nnz >= n**2
    if once and n <= (MAX_FILLED_ONCE_AS_DENSE if is_filled else MAX_ONCE_AS_DENSE):
        return _Dense(M.toarray())
    if S is None or not has_qdldl():
        dense = dense_places(M)
        return Bordered(M, dense) if dense.size else SuperLU(M)
    if once and M.nnz > factors.MAX_QUICK_ENTRIES:
        counts, owners = np.diff(M.indptr), np.repeat(S, np.diff(M.indptr))
        is_last = (S < 0) | (
            np.bincount(M.indices[owners > 0], minlength=S.size) > (M.diagonal() != 0)
        )
        last = is_last.nonzero()[0]
        if np.square(counts[~is_last]).sum() + last.size**3 <= MAX_AT_ONCE * M.nnz:
            if last.size * (S.size - last.size) <= MAX_FILLED * M.nnz:
                return Bordered(M, last, is_diagonal=True)
            return SuperLU(M, np.argsort(np.argsort(is_last, kind="stable")))
    return LDL(M, S)


def operations(systems: Systems) -> float:
    """Return the number of operations of a factorization of M + I by QDLDL, infinite if
    another library is used; raise SingularMatrix if M + I has no such factors.
    """
    if not isinstance(systems, LDL):
        return math.inf
    systems.factorize(np.ones(systems.S.size))
    return systems.operations()[0]


def has_qdldl() -> bool:
    with imports:
        return find_spec("qdldl") is not None


class _Dense:
    """Systems with M + diag(d) for a dense M, by LU factors with partial pivoting."""

    solve: Solve

    def __init__(self, M: Matrix) -> None:
        self._M = M

    def factorize(self, d: Vector) -> None:
        self.solve = factors.dense_factors().lu(
            matrices.plus_diagonal(self._M, d, order="F")
        )


class SuperLU:
    """Systems by scipy's SuperLU with diagonal pivots, in the order of the unknowns
    passed to it or that of the first factorization: SuperLU's search for an order may
    take longer than all factorizations.
    """

    def __init__(self, M: Matrix, order: Indices | None = None) -> None:
        self._M, self._diagonal = M, M.diagonal()
        self._keep(
            np.arange(M.shape[0]) if order is None else order,
            "NATURAL" if order is not None else order_of(M),
        )

    @property
    def order(self) -> Indices | None:
        """The position of each unknown in the order of elimination; None before the
        first factorization has chosen one.
        """
        return self._order if self._search == "NATURAL" else None

    def factorize(self, d: Vector) -> None:
        with imports:
            from scipy.sparse.linalg import splu
        self._columns.data[self._diagonal_positions] = (self._diagonal + d)[
            self._inverse
        ]
        how: dict[str, Any] = {
            "diag_pivot_thresh": 0.0,
            "options": {"SymmetricMode": True, "Equil": False},
        }
        factorize = partial(splu, self._columns, permc_spec=self._search, **how)
        self._lu = factors.factorized(factorize, self._columns.nnz)
        self._solving = self._order
        if self._search != "NATURAL":
            self._keep(self._lu.perm_c, "NATURAL")

    def solve(self, b: Vector) -> Vector:
        permuted = np.empty_like(b)
        permuted[self._solving] = b
        return np.asarray(self._lu.solve(permuted)[self._solving])

    def _keep(self, order: Indices, search: str) -> None:
        """Permute rows and columns to these positions, and store the whole diagonal
        explicitly. `search` names the order that SuperLU computes from there.
        """
        with imports:
            from scipy.sparse import csc_array
        coo = self._M.tocoo()
        n = order.size
        self._order = order
        self._search = search
        self._inverse = np.argsort(order)
        off = coo.row != coo.col
        rows, columns = (
            order[np.concatenate((numbers[off], np.arange(n)))]
            for numbers in (coo.row, coo.col)
        )
        values = np.concatenate((coo.data[off], np.zeros(n)))
        self._columns = csc_array((values, (rows, columns)), shape=(n, n))
        self._columns.sort_indices()
        self._diagonal_positions = np.flatnonzero(
            self._columns.indices
            == np.repeat(np.arange(n), np.diff(self._columns.indptr))
        )


# Without it: programs of portfolios in 200 unknowns take 1.65 times as long.
class LDL:
    """Systems by QDLDL's factors of S (M + diag(d)). SuperLU takes over if the first
    factors need so many operations per entry that its dense blocks save more than it
    costs to compute both triangular factors. Blocks of rank one have additional
    unknowns y = D U'x.
    """

    def __init__(self, M: Matrix, S: Vector) -> None:
        with imports:
            from scipy.sparse import csc_matrix

            from lcpcli.linalg.compressed_rows import of_arrays
            from lcpcli.linalg.rank_one_blocks import rank_one_blocks
        self.S = S
        self._added = np.zeros(0)
        blocks = rank_one_blocks(M, S)
        if blocks is not None:
            with imports:
                from scipy.sparse import diags_array
            self._added = np.zeros(blocks.D.size)
            M = matrices.stack(
                [[blocks.rest, blocks.U], [-blocks.U.T, diags_array(1 / blocks.D)]]
            )
            M.sort_indices()
            S = np.concatenate((S, np.full(blocks.D.size, -1.0)))
        owners = np.repeat(np.arange(S.size), np.diff(M.indptr))
        # S M is symmetric: its rows left of the diagonal are the columns of its upper
        # triangle, which QDLDL takes.
        below = M.indices < owners
        column_ends = np.cumsum(np.bincount(owners[below], minlength=S.size) + 1)
        self._diagonal_positions = column_ends - 1
        data = np.empty(column_ends[-1])
        indices = np.empty(column_ends[-1], M.indices.dtype)
        is_off = np.ones(column_ends[-1], dtype=bool)
        is_off[self._diagonal_positions] = False
        indices[self._diagonal_positions] = np.arange(S.size)
        indices[is_off] = M.indices[below]
        data[is_off] = (S[owners] * M.data)[below]
        indptr = np.concatenate(([0], column_ends)).astype(indices.dtype)
        self._upper = of_arrays(M.shape, indptr, indices, data, csc_matrix)
        self._signs = S
        self._M = M
        self._diagonal = M.diagonal()
        self._solver: Any = None
        self._in_blocks: SuperLU | None = None
        self._are_first = True

    def factorize(self, d: Vector) -> None:
        with imports:
            import qdldl
        d = np.concatenate((d, self._added)) if self._added.size else d
        if self._solver is not None and self._are_first:
            self._are_first = False
            if self.operations()[1] > MAX_PER_ENTRY:
                self._in_blocks = SuperLU(
                    self._M, order=np.argsort(self._solver.factors()[2])
                )
        if self._in_blocks is not None:
            self._in_blocks.factorize(d)
            return
        self._upper.data[self._diagonal_positions] = self._signs * (self._diagonal + d)
        again = qdldl.Solver if self._solver is None else self._solver.update
        new_solver = factors.factorized(
            partial(again, self._upper, upper=True), self._upper.nnz, owns=False
        )
        self._solver = self._solver or new_solver

    def solve(self, b: Vector) -> Vector:
        n = b.size
        b = np.concatenate((b, self._added)) if self._added.size else b
        if self._in_blocks is not None:
            return self._in_blocks.solve(b)[:n]
        return np.asarray(self._solver.solve(self._signs * b))[:n]

    def operations(self) -> tuple[float, float]:
        """Return the number of operations for the factors, and its mean per entry
        of L.
        """
        lengths = np.diff(self._solver.factors()[0].indptr).astype(np.float64)
        total = float((lengths * (lengths + 3)).sum())
        return total, total / max(float(lengths.sum()), 1.0)


def dense_places(M: Matrix) -> Indices:
    """Return the indices of dense rows and columns; an empty array if there are too
    many to split off.
    """
    n = M.shape[0]
    counts = np.maximum(np.diff(M.indptr), np.bincount(M.indices, minlength=n))
    dense_indices = np.flatnonzero(counts > DENSE_FACTOR * np.sqrt(n))
    return dense_indices if dense_indices.size <= MAX_SPLIT_OFF else dense_indices[:0]


class _Diagonal:
    """Systems with a diagonal matrix plus diag(d)."""

    def __init__(self, diagonal: Vector) -> None:
        self._diagonal = diagonal

    def factorize(self, d: Vector) -> None:
        self._pivots = self._diagonal + d
        if not self._pivots.all():
            raise SingularMatrix

    def solve(self, b: Vector) -> Vector:
        return np.asarray((b.T / self._pivots).T)


class Bordered:
    """Systems in which some rows and columns are split off as a border: [A B; C E] is
    solved by factors of A and the inverse of the Schur complement E - C A^-1 B.

    is_diagonal : whether A, the matrix without the border, is diagonal.
    """

    def __init__(self, M: Matrix, border: Indices, is_diagonal: bool = False) -> None:
        with imports:
            from lcpcli.linalg.compressed_rows import block, of_arrays
        rest = np.delete(np.arange(M.shape[0]), border)
        self._border, self._rest = border, rest

        def submatrix(rows: Indices, columns: Indices) -> Matrix:
            return of_arrays((rows.size, columns.size), *block(M, rows, columns))

        self._inner = (
            _Diagonal(M.diagonal()[rest])
            if is_diagonal
            else SuperLU(submatrix(rest, rest))
        )
        # With a diagonal A, `systems` splits off a border only if it has few numbers
        # (MAX_FILLED) although it is dense: then dense products take less time.
        self._C = (
            submatrix(border, rest).toarray()
            if is_diagonal
            else submatrix(border, rest)
        )
        self._B = submatrix(rest, border).toarray()
        self._E = submatrix(border, border).toarray()

    def factorize(self, d: Vector) -> None:
        self._inner.factorize(d[self._rest])
        # SuperLU solves for one column at a time.
        columns = [self._B] if isinstance(self._inner, _Diagonal) else self._B.T
        self._W = np.column_stack([self._inner.solve(column) for column in columns])
        self._inverse = np.linalg.inv(
            self._E + np.diag(d[self._border]) - self._C @ self._W
        )

    def solve(self, b: Vector) -> Vector:
        y = self._inner.solve(b[self._rest])
        x = np.empty_like(b)
        x[self._border] = self._inverse @ (b[self._border] - self._C @ y)
        x[self._rest] = y - self._W @ x[self._border]
        return x
