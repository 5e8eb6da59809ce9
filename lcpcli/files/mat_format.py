"""Problems in MATLAB's MAT files up to version 7: variables called M, q and, if known, lower, upper, x0, x1,
solution and the text fields.

Vectors may be rows or columns. solution is one z or has one z per column. Other variables are ignored, as `save` in
MATLAB writes the whole workspace, but bounds under other names are refused. origin is a JSON string.
"""

from __future__ import annotations

import io
import math
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.files.contents import refuse_beyond_memory, refuse_mostly_absent
from lcpcli.files.fields import KEYS, KNOWN, MATRICES, is_for_bounds, kind_of
from lcpcli.files.formats import Exact, Number
from lcpcli.files.mat_elements import checked, damaged
from lcpcli.files.npy_format import NAME_FIELDS, flat, named, of_arrays, texts, written
from lcpcli.linalg.matrices import is_sparse

MOST_VARIABLES = 6  # that a message names, to keep it on one line


def fields(content: bytes, number: Number = float) -> dict[str, Any]:  # noqa: ARG001 (as in every format)
    """Return the fields of a problem among the variables of a file."""
    variables = _variables(content)
    known = {name: values for name, values in variables.items() if name in KNOWN}
    if "M" not in variables and kind_of(known):
        return of_arrays(known)
    if "M" not in variables:
        shown = ", ".join([*variables][:MOST_VARIABLES]) + ", ..." * (len(variables) > MOST_VARIABLES) or "no variables"
        raise ProblemError("M", "is missing", f"call the matrix M and the vector q; the file holds {shown}")
    n = math.prod(variables["q"].shape) if "q" in variables else variables["M"].shape[0]
    for name, values in variables.items():  # variables of the size of bounds with a name that others give bounds
        is_end = name in ("a", "b") and {"a", "b", "q"} <= variables.keys()
        if name not in KEYS and (is_end or is_for_bounds(name)) and math.prod(values.shape) in (1, n, 2 * n):
            fault = "may hold bounds of z, which are called lower and upper"
            raise ProblemError(name, fault, "rename it, or leave it out")
    if "names" in variables and len(texts(variables["names"]) or ()) != n:
        del variables["names"]  # of something else in the workspace
    several = variables.get("solution")
    if several is not None and several.ndim == 2 and several.shape[0] == n:
        variables["solution"] = several.T
    return of_arrays(variables)


def values(field: str, content: bytes, number: Number = float) -> Any:  # noqa: ARG001
    """Return the variable named `field`, or the only variable."""
    return named(field, _variables(content))


def render(fields: Mapping[str, Any], exact: Exact) -> dict[str, bytes]:  # noqa: ARG001
    """Return the fields as a MAT file, numbers bit for bit; sparse matrices stay sparse, names are cells, and several
    solutions are columns."""
    from scipy.io import savemat

    variables = dict(fields) | {key: np.array(fields[key], dtype=object) for key in NAME_FIELDS if key in fields}
    if isinstance(variables.get("solution"), list):
        variables["solution"] = np.array(variables["solution"]).T
    return {"": written(savemat, variables, oned_as="column")}


def _variables(content: bytes) -> dict[str, Any]:
    from scipy.io import loadmat

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about variables that cannot be represented, which are ignored
            variables = loadmat(io.BytesIO(checked(content)))
    except (ProblemError, MemoryError):
        raise
    except Exception:  # scipy does not document what a broken file may raise
        damaged("its contents cannot be decoded")
    return {name: _array(name, value) for name, value in variables.items() if not name.startswith("__")}


def _array(name: str, value: Any) -> Any:
    """Return a variable, as a vector if it has one row or one column, unless its name is the name of a matrix."""
    is_matrix = name in ("M", *MATRICES)
    if is_sparse(value):
        refuse_mostly_absent(name, value.shape, max(value.shape), value.nnz)
    if is_sparse(value) and 1 in value.shape and not is_matrix:
        refuse_beyond_memory(name, value.shape)
        value = value.toarray()
    return value if is_sparse(value) or is_matrix else flat(np.asarray(value))
