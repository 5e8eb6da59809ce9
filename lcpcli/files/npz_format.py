"""Problems in NPZ, as numpy.savez writes it: arrays called M, q and, if known, x0, x1, solution and the texts.

A sparse M is in parts as scipy.sparse.save_npz writes them: data, indices, indptr and shape (compressed sparse rows),
or those of another form with its name as format. solution is one z or has one z per row. origin is a JSON string.
Nothing is ever unpickled.
"""

from __future__ import annotations

import io
import json
import math
import warnings
import zipfile
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.lib import format as npy

from lcpcli.errors import ProblemError, quoted
from lcpcli.files.content import refuse_beyond_memory
from lcpcli.files.json_format import load
from lcpcli.files.keys import KEYS, TEXTS, refuse_unknown
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.arrays import as_vector
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector

if TYPE_CHECKING:
    from fractions import Fraction

    from lcpcli.rational.problem import Rows

VECTORS = ("x0", "x1")
LONGEST_FAULT = 80  # characters: numpy quotes whole headers
COMPRESSED = ("data", "indices", "indptr")
PARTS = {
    "csr": COMPRESSED,
    "csc": COMPRESSED,
    "bsr": COMPRESSED,
    "coo": ("data", "row", "col"),
    "dia": ("data", "offsets"),
}
OF_SPARSE = ("data", "indices", "indptr", "row", "col", "offsets", "shape", "format", "_is_array")


def parse(content: bytes) -> Problem | Matrix:
    """The problem in an archive, or M alone if there is no q."""
    arrays = _arrays(content)
    refuse_unknown("", arrays, (*KEYS, *OF_SPARSE))
    M = _matrix(arrays)
    if "q" not in arrays:
        return M
    fields: dict[str, Any] = {key: _text(key, arrays[key]) for key in TEXTS if key in arrays}
    fields |= {key: _flat(arrays[key]) for key in VECTORS if key in arrays}
    if "origin" in arrays:
        fields["origin"] = _origin(_text("origin", arrays["origin"]))
    solution = arrays.get("solution", np.empty((0, 0)))
    return Problem(M, _flat(arrays["q"]), solutions=[solution] if solution.ndim < 2 else list(solution), **fields)


def parse_vector(field: str, content: bytes, n: int | None = None) -> Vector:
    """A vector of length n, any length if None: the array of that name, or the only one."""
    arrays = _arrays(content)
    name = field.lstrip("-")
    if name not in arrays and len(arrays) != 1:
        raise ProblemError(name, "is missing", f"add the key {name}, or keep a single array")
    return as_vector(field, _flat(arrays.get(name, next(iter(arrays.values())))), n)


def parse_exact(content: bytes) -> tuple[Rows, list[Fraction] | None]:
    """M and, if the archive has it, q, with their doubles as exact rationals."""
    from lcpcli.rational.problem import fractions_of, rows_of

    held = parse(content)
    return (rows_of(held.M), fractions_of(held.q)) if isinstance(held, Problem) else (rows_of(held), None)


def parse_exact_vector(field: str, content: bytes) -> list[Fraction]:
    """A vector with its doubles as exact rationals."""
    from lcpcli.rational.problem import fractions_of

    return fractions_of(parse_vector(field, content))


def render(problem: Problem) -> dict[str, bytes]:
    """Everything that the problem holds, bit for bit, except NULs at the end of a text."""
    arrays: dict[str, Any] = {key: getattr(problem, key) for key in TEXTS if getattr(problem, key)}
    M = problem.M
    if is_sparse(M):
        arrays |= {"data": M.data, "indices": M.indices, "indptr": M.indptr, "shape": M.shape}
        arrays |= {"format": M.format.encode(), "_is_array": True}
    else:
        arrays["M"] = M
    arrays["q"] = problem.q
    arrays |= {key: getattr(problem, key) for key in VECTORS if getattr(problem, key) is not None}
    if problem.solutions:
        arrays["solution"] = np.array(problem.solutions) if len(problem.solutions) > 1 else problem.solutions[0]
    if problem.origin is not None:
        arrays["origin"] = json.dumps(problem.origin.data())
    file = io.BytesIO()
    np.savez(file, **arrays)
    return {"": file.getvalue()}


def _arrays(content: bytes) -> dict[str, Any]:
    """The arrays of an archive by name, none of them larger than the data stored for it."""
    if content.startswith(npy.MAGIC_PREFIX):
        raise ProblemError("", "is a single array (.npy)", "save M and q with numpy.savez")
    arrays: dict[str, Any] = {}
    name = ""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            for member in archive.infolist():
                name = member.filename.removesuffix(".npy")
                if name in arrays:
                    raise ProblemError(name, "occurs twice", "keep one")
                arrays[name] = _array(name, archive, member)
    except (ProblemError, MemoryError):
        raise
    except Exception as error:  # zipfile, its decompressors and numpy do not document what a broken file may raise
        fault = " ".join(str(error).split())[:LONGEST_FAULT].rstrip(".") or type(error).__name__
        if not name:
            raise ProblemError("", f"is not NPZ ({fault})", "is it cut off? save it with numpy.savez") from None
        raise ProblemError(name, f"cannot be read ({fault})", "save it again with numpy.savez") from None
    return arrays


def _array(name: str, archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # about files written by Python 2, which are fine
        with archive.open(member) as file:
            _refuse_false_header(name, file, member.file_size)
        with archive.open(member) as file:
            return npy.read_array(file, allow_pickle=False)


def _refuse_false_header(name: str, file: Any, size: int) -> None:
    """Refuse an array of objects, or one larger than its file of that size, before memory is allocated for it."""
    version = npy.read_magic(file)
    shape, _, dtype = (npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0)(file)
    if dtype.hasobject:
        raise ProblemError(name, "is an array of objects", "save it as an array of numbers or a text")
    held = size - file.tell()
    if math.prod(shape) * dtype.itemsize != held:
        declared = " x ".join(map(str, shape)) or "one number"
        raise ProblemError(
            name, f"is declared as {declared} of {dtype.name} but has {held} bytes", "save it again with numpy.savez"
        )
    refuse_beyond_memory(name, shape, dtype.itemsize)


def _matrix(arrays: dict[str, Any]) -> Matrix:
    parts = [key for key in OF_SPARSE if key in arrays]
    if "M" in arrays:
        if parts:
            raise ProblemError(parts[0], "is part of a sparse M next to a dense M", "keep one of them")
        return arrays["M"]
    if not parts:
        raise ProblemError("M", "is missing", "add the key M, or data, indices, indptr and shape of a sparse M")
    form = _text("format", arrays["format"]) if "format" in arrays else "csr"
    if form not in PARTS:
        raise ProblemError("format", f"{quoted(form)} is unknown", f"use one of {', '.join(PARTS)}")
    for key in (*PARTS[form], "shape"):
        if key not in arrays:
            raise ProblemError(key, "is missing", f"add the key {key} of the sparse M")
        if key != "data" and arrays[key].dtype.kind not in "iu":
            raise ProblemError(key, f"contains {arrays[key].dtype.name} values", "give whole numbers")
    shape = arrays["shape"].tolist()
    if not isinstance(shape, list) or len(shape) != 2:
        raise ProblemError("shape", f"is {shape}", "give two numbers")
    return _assembled(form, [arrays[key] for key in PARTS[form]], (shape[0], shape[1]))


def _assembled(form: str, parts: list[Any], shape: tuple[int, int]) -> Matrix:
    from scipy import sparse

    data, *places = parts
    try:
        M = getattr(sparse, f"{form}_array")((data, tuple(places)) if form == "coo" else (data, *places), shape=shape)
        if PARTS[form] == COMPRESSED:
            M.check_format(full_check=True)
    except (ValueError, TypeError, IndexError) as error:
        fault = " ".join(str(error).split())
        raise ProblemError("M", f"has inconsistent parts ({fault})", "save it with scipy.sparse.save_npz") from None
    return M


def _flat(array: Any) -> Any:
    """One row or one column as a vector."""
    return array.ravel() if array.ndim == 2 and 1 in array.shape else array


def _text(key: str, array: Any) -> str:
    if array.ndim or array.dtype.kind not in "US":
        raise ProblemError(key, f"is an array of {array.dtype.name}", "give a text")
    text = array.item()
    return text.decode("utf-8", "replace") if isinstance(text, bytes) else str(text)


def _origin(text: str) -> Any:
    try:
        return load(text)
    except ProblemError as error:
        raise error.inside("origin") from None
