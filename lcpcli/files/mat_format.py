"""Problems in MATLAB's MAT files of the versions 5 to 7: variables called M, q and so
on, as the keys in JSON.

Vectors may be rows or columns. solution is one z or has one z per column. Other
variables are ignored, as `save` in MATLAB writes the whole workspace, but bounds under
other names are refused. origin is a JSON string.

The elements of a file are checked before scipy reads them: its readers are compiled,
and wrong sizes in a file make them run beyond their memory. An element has a type and a
size; an array consists of further elements, with its flags, dimensions, name and
values. (The MathWorks, MAT-File Format.)
"""

from __future__ import annotations

import io
import math
import struct
import warnings
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from lcpcli.errors import IS_MISSING, ProblemError
from lcpcli.files.contents import (
    refuse_beyond_memory,
    refuse_mostly_absent,
    uncompressed,
)
from lcpcli.files.fields import KEYS, KNOWN, MATRICES, is_for_bounds, kind_of
from lcpcli.files.formats import Exact, Number, refuse
from lcpcli.files.npy_format import (
    NAME_FIELDS,
    flat,
    named,
    of_arrays,
    texts,
    unless_damaged,
    written,
)
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.patterns import are_compressed

SAVE = "save it again, in MATLAB with -v6 or -v7"
HINT = f"is it cut off? {SAVE}"


# The interface is that of every format.
def fields(
    content: Mapping[str, Any],
    number: Number = float,  # noqa: ARG001
) -> dict[str, Any]:
    variables = dict(content)
    program_fields = {
        name: values for name, values in variables.items() if name in KNOWN
    }
    if "M" not in variables and kind_of(program_fields):
        return of_arrays(program_fields)
    shown = ", ".join([*variables][:6]) or "no variables"
    if len(variables) > 6:
        shown += ", ..."
    refuse(
        "M" not in variables,
        "M",
        IS_MISSING,
        f"call the matrix M and the vector q; the file holds {shown}",
    )
    n = math.prod(variables["q"].shape) if "q" in variables else variables["M"].shape[0]
    # Variables of the size of bounds with a name that bounds have elsewhere.
    for name, values in variables.items():
        is_end = name in ("a", "b") and {"a", "b", "q"} <= variables.keys()
        if (
            name not in KEYS
            and (is_end or is_for_bounds(name))
            and math.prod(values.shape) in (1, n, 2 * n)
        ):
            reason = "may hold bounds of z, which are called lower and upper"
            raise ProblemError(name, reason, "rename it, or leave it out")
    if "names" in variables and len(texts(variables["names"]) or ()) != n:
        del variables["names"]  # they belong to something else in the workspace
    if (
        "solution" in variables
        and variables["solution"].ndim == 2
        and len(variables["solution"]) == n
    ):
        variables["solution"] = variables["solution"].T
    return of_arrays(variables)


def values(field: str, content: Any, number: Number = float) -> Any:  # noqa: ARG001
    return named(field, content)


def render(fields: Mapping[str, Any], exact: Exact) -> dict[str, bytes]:  # noqa: ARG001
    """Return the fields as a MAT file, numbers bit for bit; names are cells, and
    several solutions are columns."""
    from scipy.io import savemat

    variables = dict(fields) | {
        key: np.array(fields[key], dtype=object) for key in NAME_FIELDS if key in fields
    }
    if isinstance(variables.get("solution"), list):
        variables["solution"] = np.array(variables["solution"]).T
    return {"": written(savemat, variables, oned_as="column")}


def parse(content: bytes) -> dict[str, Any]:
    from scipy.io import loadmat

    with (
        unless_damaged("", "is not a MAT file, or is damaged", HINT),
        warnings.catch_warnings(),
    ):
        # The warnings are about variables that cannot be represented and are ignored.
        warnings.simplefilter("ignore")
        variables = loadmat(io.BytesIO(checked(content)))
    return {
        name: _array(name, value)
        for name, value in variables.items()
        if not name.startswith("__")
    }


def _array(name: str, value: Any) -> Any:
    """Return a variable, as a vector if it has one row or one column, unless its name
    is the name of a matrix."""
    is_matrix = name in ("M", *MATRICES)
    if is_sparse(value):
        refuse_mostly_absent(name, value.shape, max(value.shape), value.nnz)
        if is_matrix or 1 not in value.shape:
            return value
        refuse_beyond_memory(name, value.shape)
        value = value.toarray()
    return value if is_matrix else flat(np.asarray(value))


HEADER = 128  # bytes
# Sizes of the types of numbers, in bytes.
SIZES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8}
# The types of texts but for those in one or two bytes.
ENCODINGS = {16: "utf-8", 17: "utf-16", 18: "utf-32"}
INT32, UINT32, MATRIX, COMPRESSED = 5, 6, 14, 15  # types
# Classes of arrays; others, as objects, are skipped.
CELL, CHAR, SPARSE, NUMBERS = 1, 4, 5, range(6, 16)


class Element(NamedTuple):
    kind: int
    data: bytes
    with_header: bytes  # with the type and the size


def _require(condition: Any) -> None:
    if not condition:
        raise ValueError


def checked(content: bytes) -> bytes:
    """Return a MAT file with those arrays that can be read, uncompressed; raise
    ValueError if it is damaged."""
    # As scipy tells the versions apart.
    refuse(0 in content[:4], "", "is a MAT file of version 4, or is damaged", SAVE)
    order = {b"IM": "<", b"MI": ">"}[content[126:128]]
    _require(content[124:126] in (b"\0\1", b"\1\0"))
    arrays = (
        element
        for element in _arrays(content[HEADER:], order)
        if _is_readable(element.data, order)
    )
    return content[:HEADER] + b"".join(element.with_header for element in arrays)


def _elements(content: bytes, order: str) -> Iterator[Element]:
    at = 0
    while at + 8 <= len(content):
        kind, size = struct.unpack_from(f"{order}II", content, at)
        small, kind = kind >> 16, kind & 0xFFFF
        begin, size = (at + 4, small) if small else (at + 8, size)
        _require(begin + size <= len(content) and small <= 4 and 1 <= kind < 19)
        end = begin + size
        if small:
            end = at + 8
        elif kind != COMPRESSED:
            end += -size % 8
        yield Element(kind, content[begin : begin + size], content[at:end])
        at = end
    _require(not content[at:].strip(b"\0"))


def _arrays(content: bytes, order: str) -> Iterator[Element]:
    for element in _elements(content, order):
        if element.kind == COMPRESSED:
            yield from _arrays(uncompressed(element.data, 15)[0], order)
        elif element.kind == MATRIX:
            yield element


def _is_readable(data: bytes, order: str) -> bool:
    """Return whether an array is one of numbers, texts, or a cell of such arrays; raise
    ValueError if its parts are not those that it declares."""
    if not data:
        return False
    parts = list(_elements(data, order))
    _require(
        len(parts) >= 3
        and parts[0].kind == UINT32
        and len(parts[0].data) == 8
        and parts[1].kind == INT32
    )
    flags = struct.unpack(f"{order}I", parts[0].data[:4])[0]
    kind, is_complex = flags & 0xFF, bool(flags >> 11 & 1)
    if kind not in (CELL, CHAR, SPARSE, *NUMBERS):
        return False
    shape = _integers(parts[1], order)
    name = parts[2]
    values = parts[3:]
    _require(2 <= shape.size <= 32 and shape.min() >= 0 and name.kind == 1)
    size = math.prod(shape.tolist())
    if kind == CELL:
        _require(len(values) == size and all(value.kind == MATRIX for value in values))
        # The set has them all checked.
        return {_is_readable(value.data, order) for value in values} <= {True}
    if kind == SPARSE:
        _require(
            len(values) == 3 + is_complex
            and values[0].kind == values[1].kind == INT32
            and shape.size == 2
        )
        rows, column_starts = (_integers(part, order) for part in values[:2])
        n_entries = min(rows.size, *(_count(part, order) for part in values[2:]))
        _require(are_compressed(column_starts, rows[:n_entries], shape[1], shape[0]))
    else:
        _require(
            len(values) == 1 + is_complex
            and all(_count(value, order) == size for value in values)
        )
    return True


def _count(element: Element, order: str) -> int:
    if element.kind in SIZES:
        number, rest = divmod(len(element.data), SIZES[element.kind])
        _require(not rest)
        return number
    _require(element.kind in ENCODINGS)
    ending = "" if element.kind == 16 else {"<": "-le", ">": "-be"}[order]
    return len(element.data.decode(f"{ENCODINGS[element.kind]}{ending}"))


def _integers(
    element: Element, order: str
) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return np.frombuffer(element.data, f"{order}i4").astype(np.int64)
