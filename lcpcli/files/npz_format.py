"""Problems in NPZ, as numpy.savez writes it: arrays called M, q and so on, as the keys
in JSON.

A sparse M is stored in parts, as scipy.sparse.save_npz writes them: data, indices,
indptr and shape (compressed sparse rows), or the parts of another form, with its name
as format; or called M.data etc., as for programs A.data etc. solution is one z or has
one z per row. origin is a JSON string. `numpy.array(None)`, as qpsolvers writes it,
means that a part is absent. Nothing is ever unpickled.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from typing import Any

import numpy as np

from lcpcli.errors import IS_MISSING, KEEP_ONE, ProblemError, unknown
from lcpcli.files.contents import refuse_beyond_memory, refuse_mostly_absent, within
from lcpcli.files.fields import (
    KEYS,
    MATRICES,
    kind_of,
    refuse_unknown,
    without_nulls,
)
from lcpcli.files.formats import Exact, Number, refuse
from lcpcli.files.npy_format import (
    UNREAD,
    array_in,
    named,
    of_arrays,
    text,
    unless_damaged,
    written,
)
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.patterns import fit
from lcpcli.typing import Matrix

COMPRESSED = ("data", "indices", "indptr")
PARTS = dict.fromkeys(("csr", "csc", "bsr"), COMPRESSED) | {
    "coo": ("data", "row", "col"),
    "dia": ("data", "offsets"),
}
SPARSE_FIELDS = (
    "data",
    "indices",
    "indptr",
    "row",
    "col",
    "offsets",
    "shape",
    "format",
    "_is_array",
)


# The interface is that of every format.
def fields(
    content: Mapping[str, Any],
    number: Number = float,  # noqa: ARG001
) -> dict[str, Any]:
    data = dict(content)
    for key in ("M", *MATRICES):  # such as A.data
        names = {
            part: f"{key}.{part}"
            for part in (*COMPRESSED, "shape")
            if f"{key}.{part}" in data
        }
        if parts := {part: data.pop(name) for part, name in names.items()}:
            data[key] = within(key, _matrix, parts)
    if not kind_of(data):
        refuse_unknown("", data, (*KEYS, *SPARSE_FIELDS))
        data = without_nulls(data)
        data["M"] = _matrix(data)
    elif "data" in data:
        hint = "call the parts of A A.data, A.indices, A.indptr and A.shape"
        raise ProblemError("data", "is part of a sparse matrix that has no name", hint)
    return of_arrays(data)


def values(field: str, content: Any, number: Number = float) -> Any:  # noqa: ARG001
    return named(field, content)


def render(fields: Mapping[str, Any], exact: Exact) -> dict[str, bytes]:  # noqa: ARG001
    """Return the file with the fields, bit for bit except trailing NULs of a text;
    sparse matrices by their parts."""
    arrays: dict[str, Any] = {}
    for key, value in fields.items():
        if not is_sparse(value):
            arrays[key] = value
            continue
        prefix = "" if key == "M" else f"{key}."
        arrays |= {
            f"{prefix}{part}": getattr(value, part) for part in (*COMPRESSED, "shape")
        }
        arrays |= (
            {"format": value.format.encode(), "_is_array": True} if key == "M" else {}
        )
    return {"": written(np.savez, **arrays)}


def parse(content: bytes) -> dict[str, Any]:
    """Return the arrays of an archive by name; an array larger than the data stored for
    it is refused."""
    arrays = dict[str, Any]()
    hint = "is it cut off? save it again with numpy.savez, and not as objects"
    with (
        unless_damaged("", "is not NPZ", hint),
        zipfile.ZipFile(io.BytesIO(content)) as archive,
    ):
        for member in archive.infolist():
            name = member.filename.removesuffix(".npy")
            refuse(name in arrays, name, "occurs twice", KEEP_ONE)
            refuse_beyond_memory(name, (member.file_size,), 1)
            with (
                unless_damaged(name, f"is not an array {UNREAD}", hint),
                archive.open(member) as file,
            ):
                arrays[name] = within(name, array_in, file)
    return arrays


def _matrix(arrays: dict[str, Any]) -> Matrix:
    stored = [key for key in SPARSE_FIELDS if key in arrays]
    if "M" in arrays:
        refuse(
            stored,
            "".join(stored[:1]),
            "is part of a sparse M next to a dense M",
            "keep one of them",
        )
        return arrays["M"]
    refuse(
        not stored,
        "M",
        IS_MISSING,
        "add the key M, or data, indices, indptr and shape of a sparse M",
    )
    matrix_format = text("format", arrays["format"]) if "format" in arrays else "csr"
    refuse(
        matrix_format not in PARTS,
        "format",
        unknown(matrix_format),
        f"use one of {', '.join(PARTS)}",
    )
    from scipy import sparse

    parts = (
        f"{', '.join(PARTS[matrix_format])} (integers but for data) and shape, of "
        "two numbers"
    )
    hint = "give all, as scipy.sparse.save_npz writes them"
    with unless_damaged("M", f"has inconsistent parts: {parts}", hint):
        data, *indices = (arrays[key] for key in PARTS[matrix_format])
        shape = tuple(map(int, arrays["shape"].tolist()))
        refuse_mostly_absent("M", shape, max(shape), data.size)
        if not fit(matrix_format, indices, data.shape, shape):
            raise ValueError
        parts_of_matrix = (
            (data, tuple(indices)) if matrix_format == "coo" else (data, *indices)
        )
        return getattr(sparse, f"{matrix_format}_array")(parts_of_matrix, shape=shape)
