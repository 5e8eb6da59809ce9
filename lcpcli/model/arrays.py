"""Validation of vectors and matrices: every number is finite and every length right, or
a ProblemError says where. Data frames and series are put into a common order by their
labels; pandas is not imported."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from copy import copy
from itertools import chain
from numbers import Rational
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import (
    GIVE_FINITE,
    IS_EMPTY,
    MAKE_AGREE,
    REAL,
    ProblemError,
    count,
    kind,
    numbers_for,
)
from lcpcli.linalg.doubles import (
    FAR_FROM_ONE,
    MAX_LOOPED_ENTRIES,
    is_finite,
    largest,
    sizes,
)
from lcpcli.linalg.matrices import compressed, is_sparse, row_maxima
from lcpcli.typing import Matrix, Vector

FROM_0 = "(indices count from 0)"  # for the index of a field in a message
FROM_1 = "(counted from 1)"  # for the number of a component or row in a sentence
NUMBERS = "a list of numbers"
ROWS = "a list of rows of numbers"
ROW = "a row, a list of numbers"
SOLUTIONS = "a list of solutions, each a list of numbers"
NOT_FINITE = (
    "is not a finite number in double precision",
    f"{GIVE_FINITE} {FROM_0}",
)
UNDERFLOWS = ("is 0 in double precision, but not 0", f"scale the data {FROM_0}")
DENSE_HINT = "give a dense array, as by toarray()"
UNLABELLED = "give them the same labels, or arrays, as by to_numpy()"
TEXTS = (str, bytes, bytearray)
# From here on a number is closer to the next power of two than to the largest
# floating-point number.
BEYOND_DOUBLES = 2**1024 - 2**970


def plain(field: str, values: Any, expected: str) -> Any:
    """Return the array or the list in an array-like object, without labels, and an
    array of objects as lists; anything else unchanged. Raise ProblemError for an
    operator that represents a matrix without having its entries."""
    if isinstance(values, np.ndarray):
        as_list = values.dtype == object and values.ndim and not _may_be_masked(values)
        return values.tolist() if as_list else values
    if isinstance(values, (list, tuple, *TEXTS)) or is_sparse(values):
        return values
    if hasattr(values, "matvec"):
        hint = (
            "give its matrix, dense or sparse, since entries are needed; M @ "
            "numpy.eye(n) has those of M"
        )
        raise ProblemError(field, f"is {kind(values)}, a linear operator", hint)
    try:
        if hasattr(values, "to_numpy"):
            return plain(field, np.asarray(values.to_numpy()), expected)
        if (
            hasattr(values, "__array__")
            or isinstance(values, memoryview)
            or type(values).__name__ == "array"
        ):
            return plain(field, np.asarray(values), expected)
        return list(values) if isinstance(values, Sequence) else values
    except Exception:
        raise ProblemError(
            field, f"is {kind(values)}, and gives no array", f"give {expected}"
        ) from None


def as_vector(
    field: str, values: Any, n: int | None = None, of: str = "unknown"
) -> Vector:
    """Return values as a float64 vector in separate memory, one entry for each of n
    things of a kind (of any length if n is None), or raise ProblemError. An array of a
    single row or column is treated as a vector."""
    return as_sized_vector(field, values, n, of)[0]


def as_sized_vector(
    field: str, values: Any, n: int | None = None, of: str = "unknown"
) -> tuple[Vector, tuple[float, float]]:
    """Return `as_vector` of values, with the `sizes` of its entries."""
    if (
        type(values) is np.ndarray
        and values.ndim == 1
        and values.dtype == np.float64
        and n in (None, values.size)
    ):
        v = readonly_copy(values)  # in a fraction of the time
    else:
        values = plain(field, values, NUMBERS)
        v = readonly_copy(as_flat(field, values, n, of), values)
    smallest_largest = sizes(v)
    if not smallest_largest[1] < math.inf:
        refuse_infinite(field, v)
    return v, smallest_largest


def as_flat(
    field: str,
    values: Any,
    n: int | None,
    of: str,
    expected: str = NUMBERS,
    either: str = "",
) -> Vector:
    """Return `plain` values as a vector as `as_vector` does, though not in separate
    memory, and with any numbers."""
    v = _of_plain_numbers(values)
    if v is None:
        if isinstance(values, (list, tuple)):
            refuse_other_than_numbers(field, values)
        v = as_floats(field, values, expected)
    v = v.reshape(-1) if v.ndim == 2 and 1 in v.shape else v
    if v.ndim != 1:
        raise ProblemError(
            field,
            f"has {count(v.ndim, 'dimension')}",
            f"give {either}a flat list of numbers",
        )
    if n is not None and v.size != n:
        raise ProblemError(field, numbers_for(v.size, "entry", n, of), MAKE_AGREE)
    return v


def readonly_copy(array: Vector, raw_value: Any = None) -> Vector:
    """Return the array, made of `raw_value`, in separate read-only memory; arrays made
    of lists, and read-only arrays, need no copy, but vectors are contiguous."""
    array = np.ascontiguousarray(array) if array.ndim == 1 else array
    seen = None if isinstance(raw_value, (list, tuple)) else array
    # The numbers may be changed through the array behind this view, or another view.
    while isinstance(seen, np.ndarray):
        if seen.flags.writeable:
            array = array.copy(order="K")
            break
        seen = seen.base
    array.setflags(write=False)
    return array


def readonly_matrix(M: Matrix, raw_value: Any = None) -> Matrix:
    """Return a matrix as `readonly_copy` does; of a sparse one the values and indices
    are copied."""
    if not is_sparse(M):
        return readonly_copy(M, raw_value)
    if (data := readonly_copy(M.data)) is not M.data:
        M.data = data
        M.indices = M.indices.copy()
        M.indptr = M.indptr.copy()
    return M


def as_columns(field: str, values: Any, finite: bool = True) -> Vector:
    """Return values as an array of shape (n, k) of real numbers, a vector in each
    column, or raise ProblemError."""
    per_column = "give one vector in each column, shape (n, k)"
    columns = as_nested(field, values, 2, ROWS)
    if columns.ndim != 2:
        hint = per_column
        if columns.ndim == 1:
            hint += f"; for a single one, np.reshape({field}, (-1, 1))"
        raise ProblemError(field, f"has {count(columns.ndim, 'dimension')}", hint)
    if finite:
        refuse_infinite(field, columns)
    return columns


def as_square(
    field: str, values: Any, n: int, other: str = "q"
) -> tuple[Matrix, tuple[float, float]]:
    """Return `as_matrix` of values, of shape (n, n) to fit a vector called `other`, and
    bounds as of `_as_finite`."""
    M = values
    if type(M) is not np.ndarray or M.ndim != 2 or M.dtype != np.float64:
        M = _as_two_dimensional(field, values)
    if M.shape != (n, n):
        shape, is_square = f"is {M.shape[0]} x {M.shape[1]}", M.shape[0] == M.shape[1]
        reason = f"{shape} but {other} has {count(n, 'entry')}" if is_square else shape
        raise ProblemError(field, reason, MAKE_AGREE if is_square else "make it square")
    return _as_finite(field, M)


def as_matrix(field: str, values: Any, *, may_be_empty: bool = False) -> Matrix:
    """Return values as a float64 matrix, dense or in compressed sparse rows, or raise
    ProblemError. may_be_empty : whether it may have no rows or no columns."""
    M = _as_two_dimensional(field, values)
    if may_be_empty and 0 in M.shape:
        return np.zeros(M.shape)
    for size, reason in zip(M.shape, (IS_EMPTY, "has empty rows"), strict=True):
        if not size:
            raise ProblemError(field, reason, f"give {ROWS}")
    return _as_finite(field, M)[0]


def as_rows(field: str, values: Any, k: int, of: str) -> Matrix:
    """Return `as_matrix` of values with an entry for each of k things of a kind in each
    row. A list or an array of numbers is a single row; there may be no rows."""
    is_array = isinstance(values, np.ndarray) and values.ndim == 1 and values.size > 0
    is_row = is_array or (
        isinstance(values, (list, tuple))
        and len(values) > 0
        and not has_rows(values[:1])
    )
    matrix = as_matrix(field, [values] if is_row else values, may_be_empty=True)
    if matrix.shape == (0, 0):  # a list without rows
        return np.zeros((0, k))
    if matrix.shape[1] != k:
        reason = numbers_for(matrix.shape[1], "column", k, of)
        raise ProblemError(field, reason, MAKE_AGREE)
    return matrix


def _as_two_dimensional(field: str, values: Any) -> Matrix:
    """Return values as a two-dimensional dense array, or unchanged if they are a sparse
    matrix."""
    M: Matrix = (
        values if is_sparse(values) else as_nested(field, values, 2, ROWS, exactly=True)
    )
    if M.shape == (0,):  # of a list without rows
        M = M.reshape(0, 0)
    if M.ndim != 2:
        raise ProblemError(field, f"has {count(M.ndim, 'dimension')}", f"give {ROWS}")
    return M


def _as_finite(field: str, M: Matrix) -> tuple[Matrix, tuple[float, float]]:
    """Return M, in compressed sparse rows if it is sparse, and bounds on the largest
    |entry| of its rows: one that is at most the smallest nonzero row maximum, infinite
    if there is none, and exactly the largest entry.

    They are the `sizes` of the row maxima or, where that is faster, of all entries, or
    of the diagonal and the largest.
    """
    if type(M) is not np.ndarray and is_sparse(M):
        M = _as_sparse(field, M)
        smallest, greatest = sizes(M.data)
    elif M.size <= 2 * MAX_LOOPED_ENTRIES:
        smallest, greatest = sizes(M)
    else:
        smallest, greatest = float(np.abs(M.diagonal()).min()), math.inf
        if smallest >= 1 / FAR_FROM_ONE:
            greatest = float(max(M.max(), -M.min()))
    if smallest >= 1 / FAR_FROM_ONE and greatest <= FAR_FROM_ONE:
        return M, (smallest, greatest)
    maxima = row_maxima(M)
    if not largest(maxima) < math.inf:
        if is_sparse(M):
            refuse_infinite(
                field, M.data, lambda: np.column_stack((M.tocoo().row, M.tocoo().col))
            )
        else:
            refuse_infinite(field, M)
    return M, sizes(maxima)


def _as_sparse(field: str, M: Any) -> Matrix:
    _refuse_other_types(field, M)
    if type(M).__name__ == "csr_array" and M.dtype == np.float64:
        by_rows = copy(M)  # it shares its arrays, but is faster
    elif M.format == "csc" and M.dtype == np.float64:
        by_rows = compressed(M.tocsr())
        by_rows.data.setflags(write=False)  # so that it is not copied again
    else:
        with imports:
            from scipy.sparse import csr_array
        with np.errstate(over="ignore"):
            by_rows = csr_array(M, dtype=np.float64)
        entries = M.tocoo()
        _refuse_underflow(
            field, entries.data, lambda: np.column_stack((entries.row, entries.col))
        )
    if not by_rows.has_canonical_format:
        by_rows = by_rows.copy()
        by_rows.sum_duplicates()
    return by_rows


def as_solutions(solutions: Any, n: int) -> tuple[Vector, ...]:
    """Return known solutions as vectors of shape (n,), or raise ProblemError."""
    raw_value = plain("solutions", solutions, SOLUTIONS)
    if not isinstance(raw_value, (list, tuple)) and not (
        isinstance(raw_value, np.ndarray) and raw_value.ndim
    ):
        raise ProblemError("solutions", f"is {kind(raw_value)}", f"give {SOLUTIONS}")
    names = (
        ("solution",)
        if len(raw_value) == 1
        else (f"solution[{i}]" for i in range(len(raw_value)))
    )
    return tuple(
        as_vector(name, z, n) for name, z in zip(names, raw_value, strict=False)
    )


def _may_be_masked(values: Any) -> bool:
    """Return whether values are a masked array; numpy loads what they need when the
    first one is made."""
    return "numpy.ma" in sys.modules and isinstance(values, np.ma.MaskedArray)


def refuse_masked(field: str, values: Any) -> None:
    """Raise ProblemError for an array with masked entries."""
    if _may_be_masked(values) and np.ma.is_masked(values):
        raise ProblemError(field, "has masked entries", "fill them, or leave them out")


def _of_plain_numbers(values: Any) -> Vector | None:
    """Return the numbers of a list without other types than int and float, which numpy
    converts at once; None for anything else."""
    if type(values) is not list or not {*map(type, values)} <= {int, float}:
        return None
    try:
        return np.asarray(values, dtype=np.float64)
    except OverflowError:  # the caller reports the position
        return None


def as_floats(field: str, values: Any, expected: str = NUMBERS) -> Vector:
    """Return the numbers of an array, or of a list that has been checked, as
    float64."""
    refuse_masked(field, values)
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
            doubles = np.asarray(values, dtype=np.float64)
    except OverflowError:
        position = next(
            i
            for i, value in enumerate(values)
            if BEYOND_DOUBLES <= abs(value) < math.inf
        )
        raise ProblemError(f"{field}[{position}]", *NOT_FINITE) from None
    if isinstance(values, (list, tuple)) and doubles.ndim == 1 and not doubles.all():
        for i in np.flatnonzero(doubles == 0).tolist():
            if values[i]:  # a Fraction
                raise ProblemError(f"{field}[{i}]", *UNDERFLOWS)
    if isinstance(values, np.ndarray):
        _refuse_underflow(field, values)
    return doubles


def _refuse_underflow(
    field: str, values: Any, positions: Callable[[], Any] | None = None
) -> None:
    """Refuse an array of numbers, such as longdouble, of which one is 0 as a double,
    but not 0. positions : as for `refuse_infinite`."""
    if values.dtype.itemsize <= np.float64().itemsize:
        return
    with np.errstate(over="ignore"):
        lost = (values.astype(np.float64) == 0) & (values != 0)
    if lost.any():
        raise ProblemError(_first(field, lost, positions), *UNDERFLOWS)


def _refuse_other_types(field: str, values: Any) -> None:
    """Refuse an array, dense or sparse, of a type other than real numbers."""
    if values.dtype.kind == "c":
        raise ProblemError(field, f"is complex ({values.dtype.name})", REAL)
    if values.dtype.kind not in "fiu":
        raise ProblemError(
            field, f"contains {values.dtype.name} values", "give real numbers"
        )


def has_rows(values: Sequence[Any]) -> bool:
    """Return whether some of the values are lists or arrays."""
    # numpy comes last, as it raises an error for rows of different lengths.
    return any(isinstance(part, (list, tuple)) or np.ndim(part) for part in values)


def as_nested(
    field: str,
    values: Any,
    max_dimensions: int,
    expected: str = NUMBERS,
    exactly: bool = False,
) -> Vector:
    """Return an array, or lists of up to `max_dimensions` dimensions, or of exactly so
    many, as floats; else raise ProblemError. A row in a list may be an array of shape
    (1, n)."""
    values = plain(field, values, expected)
    if not isinstance(values, (list, tuple)):
        return as_floats(field, values, expected)
    if max_dimensions == 1 or not (exactly or has_rows(values)):
        refuse_other_than_numbers(field, values)
        return as_floats(field, values)
    are_lists = (
        max_dimensions == 2
        and {*map(type, values)} <= {list, tuple}
        and len({*map(len, values)}) == 1
    )
    if are_lists:
        entries = _of_plain_numbers([*chain.from_iterable(values)])
        if entries is not None:
            return entries.reshape(len(values), len(values[0]))
    parts = list[Vector]()
    for i, part in enumerate(values):
        row = as_nested(
            f"{field}[{i}]", part, max_dimensions - 1, f"{ROW} {FROM_0}", exactly
        )
        parts.append(
            row[0] if row.ndim == max_dimensions == 2 and len(row) == 1 else row
        )
        if parts[i].ndim == max_dimensions:
            raise ProblemError(
                f"{field}[{i}]",
                f"has {count(max_dimensions, 'dimension')}",
                f"give {ROW} {FROM_0}",
            )
        have, first = parts[i].shape, parts[0].shape
        if have != first:
            are_rows = len(have) == len(first) == 1
            size, other = (
                (count(have[0], "entry"), first[0])
                if are_rows
                else (f"shape {have}", first)
            )
            same = "rows the same length" if are_rows else "of them the same"
            raise ProblemError(
                f"{field}[{i}]",
                f"has {size} where {field}[0] has {other}",
                f"make all {same} {FROM_0}",
            )
    return np.array(parts)


def is_number_in_array(value: Any) -> bool:
    """Return whether a value is an array without dimensions that holds a real
    number."""
    return (
        isinstance(value, np.ndarray) and not value.ndim and value.dtype.kind in "fiu"
    )


def refuse_other_than_numbers(field: str, values: Sequence[Any]) -> None:
    if {type(v) for v in values} <= {int, float}:
        return
    for i, v in enumerate(values):
        if isinstance(
            v, (int, float, np.integer, np.floating, Rational)
        ) and not isinstance(v, bool):
            continue
        if not is_number_in_array(v):
            named = f"of type {type(v).__name__}" if kind(v) == "a number" else kind(v)
            raise ProblemError(f"{field}[{i}]", f"is {named}", f"{REAL} {FROM_0}")


def refuse_infinite(
    field: str, values: Vector, positions: Callable[[], Any] | None = None
) -> None:
    """Raise ProblemError for an entry that is not finite. positions : returns the
    positions of the values in a matrix."""
    if is_finite(values.ravel(order="K")):
        return
    infinite = ~np.isfinite(values)
    raise ProblemError(_first(field, infinite, positions), *NOT_FINITE)


def _first(field: str, chosen: Any, positions: Callable[[], Any] | None) -> str:
    """Return the name of the first entry that is chosen, such as M[0][1]. positions :
    as for `refuse_infinite`."""
    first = np.argwhere(chosen)[0]
    indices = first if positions is None else positions()[first[0]]
    return field + "".join(f"[{i}]" for i in indices)


def by_label(
    table: Any, /, of: str = "the columns of M", axis: str = "index", **fields: Any
) -> list[Any]:
    """Return the values of fields with their rows, or columns, in the order of the
    columns, or the rows, of a table, if both have labels; else return the values
    unchanged."""
    is_table = hasattr(table, "columns") and _has_index(table)
    labels = []
    if is_table:
        labels = list(table.index if of.startswith("the rows") else table.columns)
    if not labels:
        return list(fields.values())
    return [
        _in_order(field, values, labels, of, axis) for field, values in fields.items()
    ]


def by_names(
    names: Callable[[], Sequence[str]], /, axis: str = "index", **fields: Any
) -> list[Any]:
    """Return the values of fields with their entries, rows or columns in the order of
    the names of the unknowns, if both have labels; else return the values unchanged.
    names : returns the names, and is called only if a value has labels."""
    labels = list(names()) if any(map(_has_index, fields.values())) else []
    labels = labels if all(labels) else []
    return [
        _in_order(field, values, labels, "the names of the unknowns", axis)
        for field, values in fields.items()
    ]


def texts(labels: Any) -> tuple[str, ...]:
    """Return the labels if all of them are texts and all are different; else an empty
    tuple."""
    names = list(labels)
    return (
        tuple(names)
        if all(isinstance(label, str) for label in names)
        and len(set(names)) == len(names)
        else ()
    )


def _in_order(
    field: str, values: Any, labels: list[Any], of: str, axis: str = "index"
) -> Any:
    """Return values with rows, or columns, in the order of these labels, if they have
    the same in another order; the values, in the order of their positions, if one of
    the two has no labels, or only counts from 0; or raise ProblemError."""
    value_labels = (
        list(getattr(values, axis))
        if labels and _has_index(values) and hasattr(values, axis)
        else labels
    )
    if value_labels == labels:
        return values
    if len(value_labels) == len(labels) == len(set(value_labels)) and set(
        value_labels
    ) == set(labels):
        positions = {label: i for i, label in enumerate(value_labels)}
        return values.take([positions[label] for label in labels], axis=axis)
    if len(value_labels) != len(labels) or list(range(len(value_labels))) in (
        value_labels,
        labels,
    ):
        return values
    raise ProblemError(field, f"has an index with labels other than {of}", UNLABELLED)


def _has_index(values: Any) -> bool:
    return hasattr(values, "to_numpy") and hasattr(values, "index")
