"""Validation of vectors and matrices: every number is finite and every length right, or a ProblemError says where."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from copy import copy
from numbers import Rational
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import REAL, ProblemError, count, kind
from lcpcli.linalg.doubles import FAR_FROM_ONE, MOST_COPIED_ENTRIES, MOST_LOOPED_ENTRIES, is_finite, largest, sizes
from lcpcli.linalg.matrices import is_sparse, row_maxima
from lcpcli.typing import Matrix, Vector

FROM_0 = "(indices count from 0)"  # what the index of a field in a message is
NUMBERS, ROWS, ROW = "a list of numbers", "a list of rows of numbers", "a row, a list of numbers"
SOLUTIONS = "a list of solutions, each a list of numbers"
DENSE_HINT = "give a dense array, as by toarray()"
TEXTS = (str, bytes, bytearray)


def plain(field: str, values: Any, expected: str) -> Any:
    """Return the array or the list in an array-like object, without labels, and an array of objects as lists; anything
    else unchanged. Raise ProblemError for an operator that represents a matrix without having its entries."""
    if isinstance(values, np.ndarray):
        as_list = values.dtype == object and values.ndim and not _may_be_masked(values)
        return values.tolist() if as_list else values
    if isinstance(values, (list, tuple, *TEXTS)) or is_sparse(values):
        return values
    if hasattr(values, "matvec"):
        hint = "give its matrix, dense or sparse, since entries are needed; M @ numpy.eye(n) has those of M"
        raise ProblemError(field, f"is {kind(values)}, a linear operator", hint)
    try:
        if hasattr(values, "to_numpy"):
            return plain(field, np.asarray(values.to_numpy()), expected)
        if hasattr(values, "__array__") or isinstance(values, memoryview) or type(values).__name__ == "array":
            return plain(field, np.asarray(values), expected)
        return list(values) if isinstance(values, Sequence) else values
    except Exception:
        raise ProblemError(field, f"is {kind(values)}, and gives no array", f"give {expected}") from None


def as_vector(field: str, values: Any, n: int | None = None, of: str = "unknown") -> Vector:
    """Return values as a float64 vector in memory of its `own`, one entry for each of n things of a kind (of any length
    if n is None), or raise ProblemError. An array of a single row or column counts as a vector."""
    values = plain(field, values, NUMBERS)
    if isinstance(values, (list, tuple)):
        refuse_other_than_numbers(field, values)
    v = flat(as_floats(field, values))
    if v.ndim != 1:
        raise ProblemError(field, f"has {count(v.ndim, 'dimension')}", "give a flat list of numbers")
    if n is not None and v.size != n:
        raise ProblemError(field, f"has {count(v.size, 'entry')} for {count(n, of)}", "make them agree")
    v = own(v, values)
    refuse_infinite(field, v)
    return v


def own(array: Vector, given: Any = None) -> Vector:
    """Return the array, made of `given`, in read-only memory of its own; lists and read-only arrays need no copy."""
    if not isinstance(given, (list, tuple)) and _is_writeable(array):
        array = array.copy(order="K")
    array.setflags(write=False)
    return array


def own_matrix(M: Matrix, given: Any = None) -> Matrix:
    """Return a matrix in memory of its own, as `own` does; of a sparse one the values and indices are copied."""
    if not is_sparse(M):
        return own(M, given)
    if _is_writeable(M.data):
        M.data, M.indices, M.indptr = own(M.data), M.indices.copy(), M.indptr.copy()
    return M


def _is_writeable(array: Any) -> bool:
    """Return whether the numbers can be changed, through the array behind this view or through another view."""
    while isinstance(array, np.ndarray):
        if array.flags.writeable:
            return True
        array = array.base
    return False


def as_columns(field: str, values: Any, finite: bool = True) -> Vector:
    """Return values as an array of shape (n, k) of real numbers, a vector in each column, or raise ProblemError."""
    per_column = "give one vector in each column, shape (n, k)"
    values = plain(field, values, ROWS)
    if isinstance(values, (list, tuple)) and values:
        if any(isinstance(row, (list, tuple)) or np.ndim(row) for row in values):
            values = _listed_rows(field, values)
        else:
            refuse_other_than_numbers(field, values)
    known = isinstance(values, np.ndarray) and not _is_masked(values) and values.dtype.kind in "fiu"
    columns: Vector = np.asarray(values) if known else as_floats(field, values, ROWS)
    if columns.ndim == 1:
        raise ProblemError(field, "has 1 dimension", f"{per_column}; for a single one, np.reshape({field}, (-1, 1))")
    if columns.ndim != 2:
        raise ProblemError(field, f"has {count(columns.ndim, 'dimension')}", per_column)
    if finite and columns.size and not (math.isfinite(columns.max()) and math.isfinite(columns.min())):
        refuse_infinite(field, columns)
    return columns


def as_square(field: str, values: Any, n: int, other: str = "q") -> tuple[Matrix, tuple[float, float]]:
    """Return `as_matrix` of values, of shape (n, n) to fit a vector called `other`, and bounds as of `_as_finite`."""
    M = _as_rows(field, values)
    if M.shape[0] != M.shape[1]:
        raise ProblemError(field, f"is {M.shape[0]} x {M.shape[1]}", "make it square")
    if M.shape[0] != n:
        shapes = f"is {M.shape[0]} x {M.shape[1]} but {other} has {count(n, 'entry')}"
        raise ProblemError(field, shapes, "make them agree")
    return _as_finite(field, M)


def as_matrix(field: str, values: Any) -> Matrix:
    """Return values as a float64 matrix, dense or in compressed sparse rows, or raise ProblemError."""
    M = _as_rows(field, values)
    if not M.shape[0]:
        raise ProblemError(field, "is empty", f"give {ROWS}")
    if not M.shape[1]:
        raise ProblemError(field, "has empty rows", f"give {ROWS}")
    return _as_finite(field, M)[0]


def _as_rows(field: str, values: Any) -> Matrix:
    """Return values as a two-dimensional dense array, or unchanged if they are a sparse matrix."""
    values = plain(field, values, ROWS)
    if isinstance(values, (list, tuple)):
        values = _listed_rows(field, values)
    M: Matrix = values if is_sparse(values) else as_floats(field, values, ROWS)
    if M.shape == (0,):  # of a list without rows
        M = M.reshape(0, 0)
    if M.ndim != 2:
        raise ProblemError(field, f"has {count(M.ndim, 'dimension')}", f"give {ROWS}")
    return M


def _as_finite(field: str, M: Matrix) -> tuple[Matrix, tuple[float, float]]:
    """Return M, in compressed sparse rows if it is sparse, and bounds on the largest |entry| of its rows: one that is
    at most the least nonzero row maximum, infinite if there is none, and exactly the largest entry.

    They are the `sizes` of the row maxima or, where that is faster, of the diagonal and the largest entry, or of all
    entries.
    """
    given = None
    if is_sparse(M):
        M = _as_sparse(field, M)
        given = M.data
    elif M.size > MOST_COPIED_ENTRIES:
        given = np.append(np.abs(M.diagonal()), max(M.max(), -M.min()))
        given = given if given.min() > 0.0 else None
    elif M.size <= 2 * MOST_LOOPED_ENTRIES:
        given = M
    if given is not None:
        least, most = sizes(given)
        if least >= 1 / FAR_FROM_ONE and most <= FAR_FROM_ONE:
            return M, (least, most)
    maxima = row_maxima(M)
    if not largest(maxima) < math.inf:
        if is_sparse(M):
            refuse_infinite(field, M.data, lambda: np.column_stack((M.tocoo().row, M.tocoo().col)))
        else:
            refuse_infinite(field, M)
    return M, sizes(maxima)


def _as_sparse(field: str, M: Any) -> Matrix:
    _refuse_other_types(field, M)
    if type(M).__name__ == "csr_array" and M.dtype == np.float64:
        compressed = copy(M)  # it shares its arrays, but is faster
    elif M.format == "csc" and M.dtype == np.float64:
        with imports:
            from lcpcli.linalg.compressed_rows import of_columns
        compressed = of_columns(M)
    else:
        with imports:
            from scipy.sparse import csr_array
        compressed = csr_array(M, dtype=np.float64)
    if not compressed.has_canonical_format:
        compressed = compressed.copy()
        compressed.sum_duplicates()
    return compressed


def flat(v: Vector) -> Vector:
    """Return a single row or column as a vector, and anything else unchanged."""
    return v.reshape(-1) if v.ndim == 2 and 1 in v.shape else v


def as_solutions(solutions: Any, n: int) -> tuple[Vector, ...]:
    """Return known solutions as vectors of shape (n,), or raise ProblemError."""
    given = plain("solutions", solutions, SOLUTIONS)
    if not isinstance(given, (list, tuple)) and not (isinstance(given, np.ndarray) and given.ndim):
        raise ProblemError("solutions", f"is {kind(given)}", f"give {SOLUTIONS}")
    names = ("solution",) if len(given) == 1 else (f"solution[{i}]" for i in range(len(given)))
    return tuple(as_vector(name, z, n) for name, z in zip(names, given, strict=False))


def _may_be_masked(values: Any) -> bool:
    """Return whether values are a masked array; numpy loads what they need when the first one is made."""
    return "numpy.ma" in sys.modules and isinstance(values, np.ma.MaskedArray)


def _is_masked(values: Any) -> bool:
    return _may_be_masked(values) and bool(np.ma.is_masked(values))


def as_floats(field: str, values: Any, expected: str = NUMBERS) -> Vector:
    """Return the numbers of an array, or of a list that has been checked, as float64."""
    if _is_masked(values):
        raise ProblemError(field, "has masked entries", "fill them, or leave them out")
    if isinstance(values, np.ndarray) and values.dtype == np.float64:
        return np.asarray(values)
    if is_sparse(values):
        raise ProblemError(field, "is sparse", DENSE_HINT)
    if not isinstance(values, (list, tuple, np.ndarray)):
        raise ProblemError(field, f"is {kind(values)}", f"give {expected}")
    if isinstance(values, np.ndarray):
        _refuse_other_types(field, values)
    try:
        with np.errstate(over="ignore"):
            return np.asarray(values, dtype=np.float64)
    except OverflowError:
        fault = "contains a number beyond the range of double precision"
        raise ProblemError(field, fault, "scale the problem") from None


def _refuse_other_types(field: str, values: Any) -> None:
    """Refuse an array, dense or sparse, of a type other than real numbers."""
    if values.dtype.kind == "c":
        raise ProblemError(field, f"is complex ({values.dtype.name})", REAL)
    if values.dtype.kind not in "fiu":
        raise ProblemError(field, f"contains {values.dtype.name} values", "give real numbers")


def _listed_rows(field: str, rows: Sequence[Any]) -> list[Any]:
    """Return the rows, each a list or an array of as many numbers as the first, or raise ProblemError."""
    listed = [row if isinstance(row, (list, tuple)) else _row(f"{field}[{i}]", row) for i, row in enumerate(rows)]
    for i, row in enumerate(listed):
        if len(row) != len(listed[0]):
            lengths = f"has {count(len(row), 'entry')} where {field}[0] has {len(listed[0])}"
            raise ProblemError(f"{field}[{i}]", lengths, f"make all rows the same length {FROM_0}")
        if not isinstance(row, np.ndarray):
            refuse_other_than_numbers(f"{field}[{i}]", row)
    return listed


def _row(field: str, values: Any) -> Any:
    """Return a list as it is, and anything else, such as an array of one row but not of one column, as a vector."""
    row = plain(field, values, ROW)
    if isinstance(row, (list, tuple)):
        return row
    if not isinstance(row, np.ndarray) or not row.ndim:
        raise ProblemError(field, f"is {kind(values)}", f"give {ROW} {FROM_0}")
    if row.ndim > 1 and row.shape[0] != 1:
        raise ProblemError(field, f"has {count(row.ndim, 'dimension')}", f"give {ROW} {FROM_0}")
    return as_vector(field, row)


def is_number_in_array(value: Any) -> bool:
    """Return whether a value is an array without dimensions that holds a real number."""
    return isinstance(value, np.ndarray) and not value.ndim and value.dtype.kind in "fiu"


def refuse_other_than_numbers(field: str, values: Sequence[Any]) -> None:
    if {type(v) for v in values} <= {int, float}:
        return
    for i, v in enumerate(values):
        if isinstance(v, (int, float, np.integer, np.floating, Rational)) and not isinstance(v, bool):
            continue
        if not is_number_in_array(v):
            named = f"of type {type(v).__name__}" if kind(v) == "a number" else kind(v)
            raise ProblemError(f"{field}[{i}]", f"is {named}", f"{REAL} {FROM_0}")


def refuse_infinite(field: str, values: Vector, places: Callable[[], Any] | None = None) -> None:
    """Raise ProblemError for an entry that is not finite. places : returns the places of the values in a matrix."""
    if is_finite(values.reshape(-1)):
        return
    wrong = np.argwhere(~np.isfinite(values))[0]
    place = "".join(f"[{i}]" for i in (wrong if places is None else places()[wrong[0]]))
    raise ProblemError(
        f"{field}{place}", "is not a finite number in double precision", f"give a finite number {FROM_0}"
    )
