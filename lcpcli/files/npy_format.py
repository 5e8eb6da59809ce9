"""One array, as numpy.save writes it: M alone, n x n; [M | q], n x (n + 1); or a vector. Nothing is ever unpickled."""

from __future__ import annotations

import io
import math
import warnings
from collections.abc import Callable
from typing import IO, TYPE_CHECKING, Any

import numpy as np
from numpy.lib import format as npy

from lcpcli.errors import ProblemError
from lcpcli.files.content import refuse_beyond_memory
from lcpcli.linalg import matrices
from lcpcli.model.arrays import as_vector
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector

if TYPE_CHECKING:
    from fractions import Fraction

    from lcpcli.rational.problem import ExactParts


def parse(content: bytes) -> Problem | Matrix:
    """The problem in an array of n rows and n + 1 columns, or M in one of any other shape."""
    table = _array(content)
    if table.ndim != 2 or table.shape[1] != table.shape[0] + 1:
        return table
    return Problem(np.ascontiguousarray(table[:, :-1]), np.ascontiguousarray(table[:, -1]))


def parse_vector(field: str, content: bytes, n: int | None = None) -> Vector:
    """A vector of length n, any length if None, from an array of one row or one column."""
    return as_vector(field, held(content), n)


def parse_exact(content: bytes) -> ExactParts:
    """M and, if the array has it, q, with the numbers as they are."""
    from lcpcli.rational.problem import ExactParts, fractions_of, rows_of

    table = _array(content)
    if table.shape[1] != table.shape[0] + 1:
        return ExactParts(rows_of(table))
    return ExactParts(rows_of(table[:, :-1]), fractions_of(table[:, -1]))


def parse_exact_vector(field: str, content: bytes) -> list[Fraction]:  # noqa: ARG001 (as in every format)
    """A vector that `parse_vector` has accepted, with the numbers as they are."""
    from lcpcli.rational.problem import fractions_of

    return fractions_of(held(content))


def render(problem: Problem) -> dict[str, bytes]:
    """M, dense, and q, bit for bit."""
    return {"": _written(matrices.dense(problem.M)), ".q": _written(problem.q)}


def held(content: bytes) -> Any:
    """The array in a file, one row or one column as a vector."""
    return flat(_array(content))


def flat(array: Any) -> Any:
    """One row or one column as a vector."""
    return array.ravel() if array.ndim == 2 and 1 in array.shape else array


def checked(name: str, opened: Callable[[], IO[bytes]], size: int) -> Any:
    """The array in a file of that size, refused before memory is allocated if its header is false.

    opened : opens the file; called twice, as parts of archives cannot be rewound.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # about files written by Python 2, which are fine
        with opened() as file:
            _refuse_false_header(name, file, size)
        with opened() as file:
            return npy.read_array(file, allow_pickle=False)


def _array(content: bytes) -> Any:
    try:
        return checked("", lambda: io.BytesIO(content), len(content))
    except (ProblemError, MemoryError):
        raise
    except Exception:  # numpy does not document what a broken file may raise
        raise ProblemError("", "is no NPY file, or a damaged one", "save it again with numpy.save") from None


def _refuse_false_header(name: str, file: IO[bytes], size: int) -> None:
    """Refuse an array of objects, or one larger than its file of that size."""
    version = npy.read_magic(file)
    shape, _, dtype = (npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0)(file)
    if dtype.hasobject:
        raise ProblemError(name, "is an array of objects", "save it as an array of numbers or a text")
    held = size - file.tell()
    if math.prod(shape) * dtype.itemsize != held:
        declared = " x ".join(map(str, shape)) or "one number"
        hint = "save it again with numpy.savez" if name else "save it again with numpy.save"
        raise ProblemError(name, f"is declared as {declared} of {dtype.name} but has {held} bytes", hint)
    refuse_beyond_memory(name, shape, dtype.itemsize)


def _written(array: Any) -> bytes:
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()
