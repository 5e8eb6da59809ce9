"""Matrices and vectors in Matrix Market files: "array" if dense, "coordinate" if
sparse.

Every line is checked, because scipy's reader silently reads "1,5" as 1, truncates
fractions in an integer file, and crashes on some broken files. All digits are kept.
"""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from lcpcli.errors import (
    CUT_OFF,
    MAKE_AGREE,
    ONE_ROW,
    REAL,
    ProblemError,
    count,
    quoted,
)
from lcpcli.files.contents import refuse_beyond_memory, refuse_mostly_absent
from lcpcli.files.formats import Exact, Number, refuse
from lcpcli.files.json_format import of_coordinates
from lcpcli.files.npy_format import written
from lcpcli.linalg.matrices import is_sparse
from lcpcli.rational.numbers import in_decimals
from lcpcli.typing import Matrix, Vector

BANNER = (
    "%%MatrixMarket matrix array|coordinate real|integer "
    "general|symmetric|skew-symmetric"
)
SIGNS = {"general": 0, "symmetric": 1, "skew-symmetric": -1}  # of the mirrored entries
CHOICES = (("array", "coordinate"), ("real", "double", "integer"), tuple(SIGNS))
# The pattern is unambiguous, so that matching does not backtrack.
DECIMAL = rb"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"


class Entries(NamedTuple):
    layout: str  # "array" or "coordinate"
    sign: int  # of the mirrored entries, 0 if there are none
    shape: tuple[int, int]
    numbers: list[bytes]  # the values, of coordinates with their rows and columns


def parse(content: bytes) -> Entries:
    (layout, kind, symmetry), shape, entries, end = _header(content)
    width, sign = (1 if layout == "array" else 3), SIGNS[symmetry]  # numbers per entry
    reason = f"is {symmetry} but {shape[0]} x {shape[1]}"
    refuse(sign and shape[0] != shape[1], "", reason, "make it square or general")
    if layout == "array":
        refuse_beyond_memory("", shape)
    reason = f"is declared with {count(entries, 'entry')}, more than the file holds"
    refuse(entries * 2 * width > len(content) - end + 1, "", reason, CUT_OFF)
    _refuse_other_lines(layout, kind, content, end)
    numbers = content[end:].split()
    n_given = count(len(numbers) // width, "entry")
    reason = f"is declared with {count(entries, 'entry')} but has {n_given}"
    refuse(len(numbers) != entries * width, "", reason, MAKE_AGREE)
    return Entries(layout, sign, shape, numbers)


def fields(content: Entries, number: Number = float) -> dict[str, Any]:
    """Return M, dense or in scipy's coordinate form. The format cannot hold q."""
    return {"M": _matrix("M", content, number)}


def values(field: str, content: Entries, number: Number = float) -> Any:
    matrix = _matrix(field, content, number)
    rows, columns = matrix.shape
    is_table = rows and 1 not in (rows, columns)
    refuse(is_table, field, f"has {rows} rows and {columns} columns", ONE_ROW)
    if is_sparse(matrix):
        refuse_beyond_memory(field, (rows, columns))
        refuse_mostly_absent(field, (rows, columns), rows * columns, matrix.nnz)
        matrix = matrix.toarray()
    return matrix.ravel()


def render(fields: Mapping[str, Any], exact: Exact) -> dict[str, bytes]:
    """Return M as an array or, if it is sparse, by coordinates, and q as an array of
    one column, with all digits."""
    # An array of shape (0, 1) is avoided, as scipy 1.15 never returns from writing
    # that.
    q = fields["q"][:, np.newaxis][:, : fields["q"].size]
    return {"": _text(fields["M"], exact), ".q": _text(q, exact)}


def _text(matrix: Matrix, exact: Exact) -> bytes:
    from scipy.io import mmwrite

    text = written(mmwrite, matrix, symmetry="general")
    if not exact:
        return text
    lines = [line.split() for line in text.decode().strip().split("\n")]
    for numbers in lines[
        next(i for i, line in enumerate(lines, 1) if not line[0].startswith("%")) :
    ]:
        double = float(numbers[-1])
        numbers[-1] = in_decimals(exact[double]) if double in exact else numbers[-1]
    return "".join(f"{' '.join(numbers)}\n" for numbers in lines).encode()


def _matrix(field: str, content: Entries, number: Number) -> Any:
    layout, sign, shape, numbers = content
    width = 1 if layout == "array" else 3
    texts = numbers[width - 1 :: width]
    entries = len(texts)
    doubles = (
        map(float, texts)
        if number is float
        else (number(text.decode("ascii")) for text in texts)
    )
    values = np.fromiter(doubles, np.float64, entries)
    if layout == "array":
        return _dense(sign, shape, values)
    rows, cols = (
        np.fromiter(map(int, numbers[i::width]), np.int64, entries) for i in range(2)
    )
    if sign:
        mirrored = rows != cols
        reason = "is skew-symmetric with entries on its diagonal"
        refuse(sign < 0 and not mirrored.all(), field, reason, "leave them out")
        values = np.concatenate((values, sign * values[mirrored]))
        rows, cols = (
            np.concatenate((rows, cols[mirrored])),
            np.concatenate((cols, rows[mirrored])),
        )
    return of_coordinates(field, values, rows, cols, shape, 1)


def _dense(sign: int, shape: tuple[int, int], values: Vector) -> Matrix:
    """Return the matrix from its values by columns, which are only the lower triangle
    if it is mirrored with a sign."""
    if not sign:
        return np.ascontiguousarray(values.reshape(shape, order="F"))
    matrix, upper = np.zeros(shape), np.triu_indices(shape[0], int(sign < 0))
    matrix[upper] = sign * values
    matrix.T[upper] = values
    return matrix


def _header(content: bytes) -> tuple[list[str], tuple[int, int], int, int]:
    file = io.BytesIO(content)
    fields = file.readline().decode("latin-1").lower().split()
    is_other = len(fields) != 5 or fields[:2] != ["%%matrixmarket", "matrix"]
    refuse(is_other, "line 1", "is not a Matrix Market header", f"begin with {BANNER}")
    refuse("complex" in fields, "line 1", "is the header of a complex matrix", REAL)
    for field, choices in zip(fields[2:], CHOICES, strict=True):
        refuse(
            field not in choices,
            "line 1",
            f"{quoted(field)} cannot be read",
            f"use {' or '.join(choices)}",
        )
    of_size = (
        each
        for each in enumerate(map(bytes.strip, file), 2)
        if each[1] and not each[1].startswith(b"%")
    )
    number, line = next(of_size, (0, b""))
    refuse(
        not line,
        "",
        "is cut off before its size",
        "give the numbers of rows and columns below the header",
    )
    sizes = line.split()
    names = ("rows", "columns", "entries")[: 2 if fields[2] == "array" else 3]
    if len(sizes) != len(names) or not all(
        re.fullmatch(rb"\d{1,18}", size) for size in sizes
    ):
        shown = quoted(line.decode("latin-1"))
        raise ProblemError(
            f"line {number}", f"is {shown}", f"give the numbers of {', '.join(names)}"
        )
    rows, columns, *entries = map(int, sizes)
    sign = SIGNS[fields[4]]
    # The number of entries of an array, which it does not specify.
    entries += [rows * columns - abs(sign) * rows * (rows - sign) // 2]
    return fields[2:], (rows, columns), entries[0], file.tell()


def _refuse_other_lines(layout: str, kind: str, content: bytes, end: int) -> None:
    number, noun = (
        (rb"[-+]?\d+", "integer") if kind == "integer" else (DECIMAL, "number")
    )
    entry = number if layout == "array" else rb"\d{1,18}[ \t]+\d{1,18}[ \t]+" + number
    other = re.compile(rb"^(?![ \t]*(?:%b[ \t]*)?\r?$)[^\n]*" % entry, re.MULTILINE)
    if match := other.search(content, end):
        line = content.count(b"\n", 0, match.start()) + 1
        expected = (
            f"give one {noun}"
            if layout == "array"
            else f"give a row, a column and a {noun}"
        )
        raise ProblemError(
            f"line {line}",
            f"is {quoted(match.group().decode('latin-1').strip())}",
            expected,
        )
