"""The index arrays of sparse matrices in files: scipy's compiled code trusts them, so that they are checked before."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lcpcli.typing import Indices


def outside(indices: Any, size: int) -> Indices:
    """Return the places of the indices that are not whole numbers from 0 to size - 1."""
    return np.flatnonzero(~((indices >= 0) & (indices < size) & (indices % 1 == 0)))


def are_compressed(ends: Any, indices: Any, lines: int, across: int) -> bool:
    """Return whether some indices, below `across`, belong to this number of compressed rows or columns, each of which
    begins at the end of the previous one."""
    are_ends = ends.size == lines + 1 and ends[0] == 0 and ends[-1] <= indices.size and (ends[1:] >= ends[:-1]).all()
    return bool(are_ends) and not outside(indices[: ends[-1]], across).size


def fit(form: str, places: Sequence[Any], data: Sequence[int], shape: Sequence[int]) -> bool:
    """Return whether the arrays of places in one of scipy's sparse forms fit the matrix that they belong to.

    data, shape : the shapes of the array of values and of the matrix.
    """
    first, last = places[0], places[-1]
    are_integers = all(part.ndim == 1 and part.dtype.kind in "iu" for part in places)
    blocks = data[1:] if form == "bsr" else [2] if form == "dia" else []
    if not are_integers or len(shape) != 2 or min(shape) < 0 or len(data) != 1 + len(blocks) or data[0] != first.size:
        return False
    if form == "coo":
        return last.size == first.size and not outside(first, shape[0]).size and not outside(last, shape[1]).size
    if form == "dia":
        return len(set(first.tolist())) == first.size and bool((first > -shape[0]).all() and (first < shape[1]).all())
    rows, columns = shape
    if form == "bsr":
        if len(blocks) != 2 or min(blocks) < 1 or rows % blocks[0] or columns % blocks[1]:
            return False
        rows, columns = rows // blocks[0], columns // blocks[1]
    return are_compressed(last, first, *((columns, rows) if form == "csc" else (rows, columns)))
