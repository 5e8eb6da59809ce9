"""Products of a sparse matrix with vectors by blocks of rows, without reading the
entries of rows that repeat.

Difference formulas on a grid have the same few numbers in almost every row, at the same
distances from the diagonal: the stencil. Such rows are compared with the stencil once;
products then read only the vector, once if a block of it fits in the processor's cache.
The other rows, at the boundary of the grid, are multiplied as usual.
"""

from __future__ import annotations

from copy import copy
from typing import Any, NamedTuple

import numpy as np

from lcpcli.linalg.matrices import row_multiplier, row_parts, with_data
from lcpcli.typing import Indices, Matrix

MIN_ROWS = 1 << 13  # rows from which products repay the search for a stencil
MAX_ENTRIES = 30  # entries of a stencil
MAX_OTHERS = 0.3  # the largest fraction of rows that differ from the stencil


class Operator:
    """Products of a sparse matrix of shape (n, n) with contiguous vectors of the type
    of its entries, by blocks of rows.

    parts : the blocks, as slices of rows.
    """

    def __init__(self, M: Matrix) -> None:
        n = M.shape[0]
        self.parts = list(row_parts(n))
        self._stencil = (
            _stencil(M) if n >= MIN_ROWS and M.nnz <= MAX_ENTRIES * n else None
        )
        self._use(M if self._stencil is None else M[self._stencil.others])

    def _use(self, entries: Matrix) -> None:
        """Multiply by these rows of M entry by entry: the rows that differ from the
        stencil, or all rows if there is none.
        """
        self._entries, self.dtype = entries, entries.dtype
        self._rows = row_multiplier(
            entries.shape, entries.indptr, entries.indices, entries.data
        )

    def in_single_precision(self) -> Operator:
        """Return an operator for vectors in single precision."""
        single = copy(self)
        single._use(with_data(self._entries, self._entries.data.astype(np.float32)))
        return single

    def block(self, k: int, v: Any) -> Any:
        """Return block k of M v, as a new array."""
        rows = self.parts[k]
        if self._stencil is None:
            return self._rows(rows, v)
        others = slice(*self._stencil.starts[k : k + 2])
        block = self._stencil.block(rows, v)
        if others.start < others.stop:
            block[self._stencil.others[others] - rows.start] = self._rows(others, v)
        return block

    def __call__(self, v: Any, factors: Any = None, out: Any = None) -> Any:
        """Return M v, multiplied by `factors` of shape (n,) unless they are None; it is
        written to `out` unless that is None.
        """
        image = np.empty_like(v) if out is None else out
        for k, rows in enumerate(self.parts):
            if factors is None:
                image[rows] = self.block(k, v)
            else:
                np.multiply(self.block(k, v), factors[rows], out=image[rows])
        return image

    def residual(self, x: Any, b: Any, factors: Any, out: Any) -> Any:
        """Return factors * (b - M x), which is written to `out`."""
        for k, rows in enumerate(self.parts):
            np.subtract(b[rows], self.block(k, x), out=out[rows])
            out[rows] *= factors[rows]
        return out

    def relaxed(
        self, x: Any, b: Any, weights: Any, factor: float = 1.0, out: Any = None
    ) -> Any:
        """Return x + factor * weights * (b - M x), a step of a weighted Jacobi
        iteration; it is written to `out` unless that is None.
        """
        better = np.empty_like(x) if out is None else out
        for k, rows in enumerate(self.parts):
            step = self.block(k, x)
            np.subtract(b[rows], step, out=step)
            step *= weights[rows]
            step *= factor
            np.add(x[rows], step, out=better[rows])
        return better


# Without it: an obstacle with 250,000 unknowns takes 1.12 times as long, torsion 1.2.
class _Stencil(NamedTuple):
    """The stencil: the entries and their distances from the diagonal that almost all
    rows share.

    terms : each value with the distances at which it occurs. first, last : the rows
        between which all distances stay within the matrix.
    others : the indices of the rows that differ, in order. starts : the position in
        `others` of the first row of each block, and their number.
    """

    terms: list[tuple[float, list[int]]]
    first: int
    last: int
    others: Indices
    starts: list[int]

    def block(self, rows: slice, v: Any) -> Any:
        """Return a block of M v; the components of rows that differ from the stencil
        are arbitrary numbers.
        """
        top, bottom = max(rows.start, self.first), min(rows.stop, self.last)
        if top >= bottom:
            return np.zeros(rows.stop - rows.start, dtype=v.dtype)
        total = None
        for value, shifts in self.terms:
            first, *more = (v[top + shift : bottom + shift] for shift in shifts)
            term = first * value if not more else first + more[0]
            for other in more[1:]:
                term += other
            if more:
                term *= value
            total = term if total is None else np.add(total, term, out=total)
        if bottom - top == rows.stop - rows.start:
            return total
        block = np.zeros(rows.stop - rows.start, dtype=v.dtype)
        block[top - rows.start : bottom - rows.start] = total
        return block


def _stencil(M: Matrix) -> _Stencil | None:
    """Return the stencil, the entries of the first row of median length, if all but
    MAX_OTHERS of the rows of M have exactly these; otherwise None.
    """
    n, degrees = M.shape[0], np.diff(M.indptr)
    typical = int((degrees == int(np.median(degrees))).argmax())
    typical_entries = slice(*M.indptr[typical : typical + 2])
    shifts, values = M.indices[typical_entries] - typical, M.data[typical_entries]
    if not values.size:
        return None
    others, starts = [], [0]
    for rows in row_parts(n):
        differs = np.ones(rows.stop - rows.start, dtype=bool)
        full = (degrees[rows] == values.size).nonzero()[0]
        positions = M.indptr[rows][full, np.newaxis] + np.arange(values.size)
        same = M.indices[positions] - full[:, np.newaxis] == shifts + rows.start
        differs[full] = ~(same & (M.data[positions] == values)).all(axis=1)
        others.append(differs.nonzero()[0] + rows.start)
        starts.append(starts[-1] + others[-1].size)
        if starts[-1] > MAX_OTHERS * n:
            return None
    terms = {
        value: [int(shift) for shift in shifts[values == value]]
        for value in dict.fromkeys(values.tolist())
    }
    first, last = max(0, -int(shifts.min())), n - max(0, int(shifts.max()))
    return _Stencil(list(terms.items()), first, last, np.concatenate(others), starts)
