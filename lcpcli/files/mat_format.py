"""Problems in MATLAB's MAT files up to version 7: variables called M, q and, if known, lower, upper, x0, x1,
solution and the texts.

Vectors may be rows or columns. solution is one z or has one z per column. Other variables are ignored, as `save` in
MATLAB writes the whole workspace, but not what are likely bounds by another name. origin is a JSON string.
"""

from __future__ import annotations

import io
import math
import struct
import warnings
import zlib
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.files import named_arrays, origins
from lcpcli.files.content import refuse_beyond_memory
from lcpcli.files.json_format import MATRICES
from lcpcli.files.keys import KEYS, is_for_bounds
from lcpcli.files.npy_format import flat
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector

if TYPE_CHECKING:
    from fractions import Fraction

    from lcpcli.rational.problem import ExactParts

MARKS = {b"IM": "<", b"MI": ">"}  # the byte order of version 5 and later, at its offset
TYPES = {*range(1, 8), 9, *range(12, 19)}  # of the elements that version 5 has
MATRIX, COMPRESSED = 14, 15  # those that consist of others
MOST_NAMED = 6  # variables that a message names


def parse(content: bytes) -> Problem | Matrix:
    """The problem in a file, or M alone if there is no q."""
    variables = _variables(content)
    program = None if "M" in variables else named_arrays.program(_without_others(variables))
    if program is not None:
        return program
    if "M" not in variables:
        raise ProblemError("M", "is missing", f"call the matrix M and the vector q; the file holds {_names(variables)}")
    _refuse_misnamed_bounds(variables)
    return named_arrays.problem(variables["M"], variables, by_columns=True)


def _without_others(variables: dict[str, Any]) -> dict[str, Any]:
    """The variables of a program or a game."""
    return {name: values for name, values in variables.items() if name in origins.KNOWN}


def _refuse_misnamed_bounds(variables: dict[str, Any]) -> None:
    """Refuse a variable next to M and q that has the size of bounds, and a name that others give them."""
    n = math.prod(variables["q"].shape) if "q" in variables else -1
    for name, values in variables.items():
        if name not in KEYS and is_for_bounds(name) and math.prod(values.shape) in (1, n, 2 * n):
            fault = "may hold bounds of z, which are called lower and upper"
            raise ProblemError(name, fault, "rename it, or leave it out")


def parse_vector(field: str, content: bytes, n: int | None = None) -> Vector:
    """A vector of length n, any length if None: the variable of that name, or the only one."""
    return named_arrays.vector(field, _variables(content), n)


def parse_bound(name: str, content: bytes) -> Any:
    """A bound, one number or one for each unknown: the variable of that name, or the only one."""
    return named_arrays.bound(name, _variables(content))


def parse_exact(content: bytes) -> ExactParts:
    """M and, if the file has it, q, with the numbers as they are; of a program or a game with its doubles."""
    from lcpcli.rational.problem import parts_of

    variables = _variables(content)
    if "M" in variables:
        return named_arrays.exact_parts(variables["M"], variables)
    return parts_of(parse(content))


def parse_exact_vector(field: str, content: bytes) -> list[Fraction]:
    """A vector that `parse_vector` has accepted, with the numbers as they are."""
    return named_arrays.exact_vector(field, _variables(content))


def render(problem: Problem) -> dict[str, bytes]:
    """Everything that the problem holds, numbers bit for bit; M sparse if it is sparse."""
    from scipy.io import savemat

    arrays = named_arrays.arrays_of(problem)
    if len(problem.solutions) > 1:
        arrays["solution"] = arrays["solution"].T
    if "names" in arrays:
        arrays["names"] = np.array(arrays["names"], dtype=object)
    file = io.BytesIO()
    savemat(file, {"M": problem.M, **arrays}, oned_as="column")
    return {"": file.getvalue()}


def _variables(content: bytes) -> dict[str, Any]:
    """The arrays in a file by name."""
    from scipy.io import loadmat

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about variables that cannot be represented, which are ignored
            order = MARKS.get(content[126:128])
            if order and content.startswith(b"MATLAB 5.0"):
                _refuse_broken(content[128:], order)
            held = loadmat(io.BytesIO(content))
    except (ProblemError, MemoryError):
        raise
    except Exception:  # scipy does not document what a broken file may raise
        raise _broken("its contents cannot be decoded") from None
    return {name: _array(name, value) for name, value in held.items() if not name.startswith("__")}


def _refuse_broken(content: bytes, order: str) -> list[int]:
    """The types of the elements in a part of a file; ProblemError for a part on which scipy would crash."""
    at, kinds = 0, list[int]()
    while at + 8 <= len(content):
        kind, size = struct.unpack_from(f"{order}II", content, at)
        small, kind = kind >> 16, kind & 0xFFFF
        if kind not in TYPES:
            raise _broken(f"it has an element of type {kind}")
        kinds.append(kind)
        inner = b"" if small else content[at + 8 : at + 8 + size]
        if kind == COMPRESSED:
            _refuse_broken(zlib.decompress(inner), order)
        elif kind == MATRIX and inner:
            _refuse_inconsistent(_refuse_broken(inner, order), inner, order)
        at += 8 if small else 8 + size + (0 if kind == COMPRESSED else -size % 8)
    return kinds


def _refuse_inconsistent(kinds: list[int], array: bytes, order: str) -> None:
    """Raise ProblemError for an array of numbers whose elements are not those that its flags declare."""
    if len(array) < 16:
        raise _broken("it has an array without flags")
    (flags,) = struct.unpack_from(f"{order}I", array, 8)
    number = flags & 0xFF
    parts = {4: 4, 5: 6}.get(number, 4 if 6 <= number <= 15 else 0)  # of characters, sparse numbers, numbers
    if parts and (len(kinds) != parts + (flags >> 11 & 1) or {MATRIX, COMPRESSED} & set(kinds)):
        raise _broken("it has an array with other parts than it declares")


def _broken(fault: str) -> ProblemError:
    hint = "is it cut off? save it again, in MATLAB with -v7"
    return ProblemError("", f"is not a MAT file ({fault})", hint)


def _array(name: str, value: Any) -> Any:
    """A variable; as a vector if it has one row or one column, unless it is a matrix by its name."""
    is_matrix = name in ("M", *MATRICES)
    if is_sparse(value) and 1 in value.shape and not is_matrix:
        refuse_beyond_memory(name, value.shape)
        value = value.toarray()
    return value if is_sparse(value) or is_matrix else flat(np.asarray(value))


def _names(variables: dict[str, Any]) -> str:
    shown = [*variables][:MOST_NAMED]
    return ", ".join(shown) + ", ..." * (len(variables) > len(shown)) or "no variables"
