"""Problems as arrays by name, as in NPZ and MAT: M, q and, if known, the bounds, x0, x1, solution, origin and texts."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.files import origins
from lcpcli.files.json_format import MATRICES, load
from lcpcli.files.keys import BOUNDS, TEXTS
from lcpcli.files.npy_format import flat
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.arrays import as_vector
from lcpcli.model.origins import OwnNames
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector

if TYPE_CHECKING:
    from fractions import Fraction

    from lcpcli.rational.problem import ExactParts

VECTORS = ("x0", "x1")


def program(arrays: Mapping[str, Any]) -> Problem | None:
    """The problem of the program or the game that the arrays hold; None if their names tell of none."""
    if not origins.kind_of(arrays):
        return None
    return origins.made({key: _plain(key, values) for key, values in arrays.items()})


def _plain(key: str, values: Any) -> Any:
    """A text, a number, a vector or a matrix of a program or a game."""
    if key in (*TEXTS, "sense"):
        return text(key, values)
    if is_sparse(values) or key in MATRICES:
        return values if is_sparse(values) or values.ndim == 2 else np.atleast_2d(values)
    if key in ("rows", "columns") and (names := _texts(values)) is not None:
        return names
    return values.item() if values.size == 1 and key == "constant" else flat(values)


def _texts(values: Any) -> list[str] | None:
    """The texts in an array of texts, or of cells with one each; None if it is another."""
    if values.dtype.kind in "US":
        return [str(name) for name in values.ravel().tolist()]
    if values.dtype.kind != "O":
        return None
    cells: list[list[Any]] = [np.atleast_1d(name).tolist() for name in values.ravel().tolist()]
    return ["".join(cell) for cell in cells] if all(isinstance(text, str) for cell in cells for text in cell) else None


def problem(M: Any, arrays: Mapping[str, Any], by_columns: bool = False) -> Problem | Matrix:
    """The problem of M and the other arrays, or M alone if there is no q; other names are ignored.

    by_columns : whether several solutions are the columns of an array, and not its rows.
    """
    if "q" not in arrays:
        if given := [key for key in BOUNDS if key in arrays]:
            raise ProblemError(given[0], "is given without q", f"add q to the file, or give --{given[0]} instead")
        return M
    fields: dict[str, Any] = {key: text(key, arrays[key]) for key in TEXTS if key in arrays}
    fields |= {key: flat(arrays[key]) for key in VECTORS if key in arrays}
    fields |= {key: bound(key, arrays) for key in BOUNDS if key in arrays}
    if "origin" in arrays:
        fields["origin"] = _origin(text("origin", arrays["origin"]))
    if "names" in arrays:
        fields["names"] = _own_names(arrays, by_columns)
    q, solution = flat(arrays["q"]), arrays.get("solution", np.empty((0, 0)))
    if by_columns and solution.ndim == 2:
        solution = solution.T if solution.shape[0] == q.size else solution
    return Problem(M, q, solutions=[solution] if solution.ndim < 2 else list(solution), **fields)


def _own_names(arrays: Mapping[str, Any], workspace: bool) -> list[str]:
    """The names of the unknowns; of a whole workspace only what can be these."""
    names = _texts(arrays["names"])
    if workspace and (names is None or len(names) != arrays["q"].size):
        return []
    if names is None:
        raise ProblemError("names", f"is an array of {arrays['names'].dtype.name}", "give texts")
    return names


def exact_parts(M: Any, arrays: Mapping[str, Any]) -> ExactParts:
    """What `problem` makes of these arrays, with their own numbers, integers of any size among them."""
    from lcpcli.rational.problem import ExactParts, bounds_of, fractions_of, rows_of

    rows = rows_of(M)
    if "q" not in arrays:
        return ExactParts(rows)
    bounds = {key: bounds_of(np.broadcast_to(bound(key, arrays), len(rows))) for key in BOUNDS if key in arrays}
    return ExactParts(rows, fractions_of(flat(arrays["q"])), **bounds)


def exact_vector(field: str, arrays: Mapping[str, Any]) -> list[Fraction]:
    """A vector that `vector` has accepted, with its own numbers."""
    from lcpcli.rational.problem import fractions_of

    return fractions_of(_named(field.lstrip("-"), arrays))


def bound(name: str, arrays: Mapping[str, Any]) -> Any:
    """A bound, one number or one for each unknown: the array of that name, or the only one."""
    values = _named(name, arrays)
    return values[0] if values.shape == (1,) else values


def vector(field: str, arrays: Mapping[str, Any], n: int | None) -> Vector:
    """A vector of length n, any length if None: the array of that name, or the only one."""
    return as_vector(field, _named(field.lstrip("-"), arrays), n)


def _named(name: str, arrays: Mapping[str, Any]) -> Any:
    """The array of a name, or the only one; one row or one column as a vector."""
    if name not in arrays and len(arrays) != 1:
        raise ProblemError(name, "is missing", f"add the key {name}, or keep a single array")
    return flat(arrays.get(name, next(iter(arrays.values()))))


def arrays_of(problem: Problem) -> dict[str, Any]:
    """All that a problem holds but M, texts as texts, several solutions as rows."""
    arrays: dict[str, Any] = {key: getattr(problem, key) for key in TEXTS if getattr(problem, key)}
    arrays["q"] = problem.q
    if problem.is_mixed:
        arrays |= {key: getattr(problem, key) for key in BOUNDS}
    arrays |= {key: getattr(problem, key) for key in VECTORS if getattr(problem, key) is not None}
    if problem.solutions:
        arrays["solution"] = np.array(problem.solutions) if len(problem.solutions) > 1 else problem.solutions[0]
    if isinstance(problem.origin, OwnNames):
        arrays["names"] = list(problem.names)
    elif problem.origin is not None:
        arrays["origin"] = json.dumps(problem.origin.data())
    return arrays


def text(key: str, array: Any) -> str:
    """The text in an array of one text."""
    if array.ndim > 1 or array.size != 1 or array.dtype.kind not in "US":
        raise ProblemError(key, f"is an array of {array.dtype.name}", "give a text")
    held = array.item()
    return held.decode("utf-8", "replace") if isinstance(held, bytes) else str(held)


def _origin(text: str) -> Any:
    try:
        return load(text)
    except ProblemError as error:
        raise error.inside("origin") from None
