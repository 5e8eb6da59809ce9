"""Matrices in coordinate form in JSON: {"format": "coo", "shape": [m, n], "rows": [], "cols": [], "values": []}."""

from __future__ import annotations

from typing import Any

import numpy as np

from lcpcli.errors import ProblemError, count, kind
from lcpcli.files.keys import refuse_unknown
from lcpcli.model.arrays import as_vector
from lcpcli.typing import Indices, Matrix

KEYS = ("format", "shape", "rows", "cols", "values")


def matrix(field: str, given: dict[str, Any], n: int | None = None) -> Matrix:
    """The matrix, sparse, after checking that its indices fit its shape, n x n to fit q unless n is None."""
    refuse_unknown(field, given, KEYS)
    for key in KEYS:
        if key not in given:
            raise ProblemError(f"{field}.{key}", "is missing", f"add the key {key}")
    if given["format"] != "coo":
        raise ProblemError(f"{field}.format", f"is {kind(given['format'])}", 'the only format is "coo"')
    m, k = _shape(field, given["shape"], n)
    values = as_vector(f"{field}.values", given["values"])
    rows, cols = (_indices(field, key, given[key], values.size, size) for key, size in (("rows", m), ("cols", k)))
    order = np.lexsort((cols, rows))
    again = np.flatnonzero((np.diff(rows[order]) == 0) & (np.diff(cols[order]) == 0))
    if again.size:
        i = order[again[0] + 1]
        fault = f"and {field}.cols[{i}] name entry ({rows[i]}, {cols[i]}) again"
        raise ProblemError(f"{field}.rows[{i}]", fault, "give every entry once (indices count from 0)")
    from scipy.sparse import csr_array

    return csr_array((values, (rows, cols)), shape=(m, k))


def _shape(field: str, given: Any, n: int | None) -> tuple[int, int]:
    shape = as_vector(f"{field}.shape", given)
    declared = " x ".join(f"{side:g}" for side in shape) or "empty"
    if n is not None and (shape.size != 2 or (shape != n).any()):
        raise ProblemError(f"{field}.shape", f"is {declared} but q has {count(n, 'entry')}", "make them agree")
    if shape.size != 2 or (shape < 1).any() or (shape % 1 != 0).any() or (shape > np.iinfo(np.int32).max).any():
        raise ProblemError(f"{field}.shape", f"is {declared}", "give two whole numbers from 1")
    return int(shape[0]), int(shape[1])


def _indices(matrix: str, key: str, given: Any, size: int, n: int) -> Indices:
    field = f"{matrix}.{key}"
    numbers = as_vector(field, given)
    if numbers.size != size:
        fault = f"has {count(numbers.size, 'entry')} where {matrix}.values has {size}"
        raise ProblemError(field, fault, "make them agree")
    wrong = np.flatnonzero((numbers < 0) | (numbers >= n) | (numbers != np.floor(numbers)))
    if wrong.size:
        i = int(wrong[0])
        raise ProblemError(f"{field}[{i}]", f"is {numbers[i]:g}", f"indices are whole numbers from 0 to {n - 1}")
    return numbers.astype(np.intp)
