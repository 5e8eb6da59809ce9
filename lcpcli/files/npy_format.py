"""An array as numpy.save writes it, M alone, [M | q] or a vector, and the meaning of
named arrays, as in NPZ and MAT. Nothing is ever unpickled.
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy

from lcpcli.errors import GIVE_TEXT, IS_MISSING, ProblemError
from lcpcli.files.contents import within
from lcpcli.files.fields import (
    BOUNDS,
    KEYS,
    MATRICES,
    kind_of,
    of_table,
    without_nulls,
)
from lcpcli.files.formats import Exact, Number, refuse
from lcpcli.linalg import matrices
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.formulations import TEXTS

UNREAD = "of numbers or texts, or is damaged"
# The last bytes of the pickle that numpy writes for an array of objects of shape ():
# its last list, that of its elements, holds None alone (opcodes ], N, a, t, b, with
# those that number objects between them). Reading these bytes runs nothing.
PICKLE_OF_NONE = re.compile(rb"(?s)\](?:\x94|q.|r.{4})?Nat(?:\x94|q.|r.{4})?b\.\Z")
LONGEST_END = 20  # bytes of it
NAME_FIELDS = ("rows", "columns", "players", "names")


# The interface is that of every format.
def fields(content: Any, number: Number = float) -> dict[str, Any]:  # noqa: ARG001
    """Return M and q from an array of n rows and n + 1 columns, or M from an array of
    any other shape."""
    return of_table(content)


def values(field: str, content: Any, number: Number = float) -> Any:  # noqa: ARG001
    return flat(content)


def render(fields: Mapping[str, Any], exact: Exact) -> dict[str, bytes]:  # noqa: ARG001
    return {
        "": written(np.save, matrices.dense(fields["M"])),
        ".q": written(np.save, fields["q"]),
    }


def written(save: Callable[..., object], *arguments: Any, **options: Any) -> bytes:
    save(file := io.BytesIO(), *arguments, **options)
    return file.getvalue()


def flat(array: Any) -> Any:
    """Return an array of one row or one column, or MATLAB's [] of neither, as a vector,
    any other array as it is."""
    return (
        array.ravel()
        if array.ndim == 2 and (1 in array.shape or array.shape == (0, 0))
        else array
    )


def array_in(file: IO[bytes]) -> Any:
    """Return the array in a file; None for `numpy.array(None)`, by which qpsolvers
    writes what a program does not have. Other arrays of objects are refused. An array
    that declares more than the file holds takes no memory before it is refused."""
    with warnings.catch_warnings():
        # The warnings are about files written by Python 2, which are fine.
        warnings.simplefilter("ignore", UserWarning)
        if (content := _single_object(file)) is not None:
            _refuse_objects(content)
            return None
        array = npy.read_array(file, allow_pickle=False)
    # Any number of empty texts would need no memory.
    if file.read(1) or (array.size > 1 and not array.itemsize):
        raise ValueError
    if array.dtype.kind == "U":
        array.tolist()  # which raises ValueError for characters that do not exist
    return array


def _single_object(file: IO[bytes]) -> bytes | None:
    """Return the pickle in a file with an array of objects of shape (), not
    interpreted; None for any other array, which is then still to be read."""
    begin = file.tell()
    if npy.read_magic(file) == (1, 0):  # as numpy writes a short header
        shape, _, dtype = npy.read_array_header_1_0(file)
        if dtype.kind == "O" and shape == ():
            return file.read()
    file.seek(begin)
    return None


def _refuse_objects(content: bytes) -> None:
    """Raise an error unless the pickle of an array of shape () is that of None."""
    reason = "is a sparse matrix as a pickle, which may run any code when it is read"
    refuse(b"scipy.sparse" in content, "", reason, "save it dense, as by toarray()")
    if not PICKLE_OF_NONE.search(content[-LONGEST_END:]):
        raise ValueError


@contextmanager
def unless_damaged(name: str, reason: str, hint: str) -> Iterator[None]:
    """Open a context in which whatever is raised becomes a ProblemError: neither numpy
    nor scipy nor zipfile document what a broken file may raise."""
    try:
        yield
    except (ProblemError, MemoryError):
        raise
    except Exception:
        raise ProblemError(name, reason, hint) from None


def parse(content: bytes) -> Any:
    with unless_damaged(
        "",
        f"is not an NPY file {UNREAD}",
        "save it again with numpy.save, and not as objects",
    ):
        array = array_in(io.BytesIO(content))
        if array is None:
            raise ValueError
        return array


def of_arrays(arrays: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields from arrays by name: all arrays of a program or a game, the
    known fields of a problem, or M with the bounds and names that it has without q.
    Several solutions are rows."""
    if kind_of(arrays):
        return {key: _plain(key, array) for key, array in arrays.items()}
    keys = KEYS if "q" in arrays else ("M", *BOUNDS, "names")
    fields = without_nulls(
        {key: _plain(key, arrays[key]) for key in keys if key in arrays}
    )
    if "solution" in fields:
        fields["solution"] = (
            list(arrays["solution"])
            if arrays["solution"].ndim > 1
            else [arrays["solution"]]
        )
    return fields


def named(field: str, arrays: Mapping[str, Any]) -> Any:
    """Return the array for a field or an option: the one of its name, or the only one;
    a bound may be one number."""
    name = field.lstrip("-")
    refuse(
        name not in arrays and len(arrays) != 1,
        name,
        IS_MISSING,
        f"add the key {name}, or keep a single array",
    )
    array = arrays.get(name, next(iter(arrays.values())))
    refuse(array is None and name not in BOUNDS, name, "is None", "give numbers")
    return _plain(name, array)


def _plain(key: str, array: Any) -> Any:
    if array is None:
        return None
    if key in (*TEXTS, "verdict", "sense"):
        return text(key, array)
    if key == "origin":
        from lcpcli.files.json_format import load

        return within(key, load, text(key, array))
    if is_sparse(array) or key == "M":
        return array
    if key in MATRICES:
        return np.atleast_2d(array)
    if key in NAME_FIELDS and (names := texts(array)) is not None:
        return names
    refuse(key == "names", key, f"is an array of {array.dtype.name}", "give texts")
    if key == "constant" and array.size == 1:
        return array.item()
    vector = flat(array)
    return vector[0] if key in BOUNDS and vector.shape == (1,) else vector


def texts(array: Any) -> list[str] | None:
    """Return the texts in an array of texts, or of cells with one text each; None for
    any other array."""
    if array.dtype.kind != "O":
        return (
            [str(name) for name in array.ravel().tolist()]
            if array.dtype.kind in "US"
            else None
        )
    cells: list[list[Any]] = [
        np.atleast_1d(name).tolist() for name in array.ravel().tolist()
    ]
    return (
        ["".join(cell) for cell in cells]
        if all(isinstance(text, str) for cell in cells for text in cell)
        else None
    )


def text(key: str, array: Any) -> str:
    """Return the text in an array of one text, or of none, as scipy reads an empty
    one."""
    if not array.size and array.dtype.kind in "US":
        return ""
    is_other = array.ndim > 1 or array.size != 1 or array.dtype.kind not in "US"
    refuse(is_other, key, f"is an array of {array.dtype.name}", GIVE_TEXT)
    item = array.item()
    return item.decode("utf-8", "replace") if isinstance(item, bytes) else str(item)
