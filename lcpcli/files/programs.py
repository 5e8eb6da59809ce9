"""Programs and games written in their own keys, those of `origins`: in JSON, NPZ, MAT and, by `mps_writing`, MPS."""

from __future__ import annotations

import io
import json
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.files.formats import NEAREST
from lcpcli.files.json_format import list_text, matrix_text, number_text, object_text
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.origins import Game
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.model.program import SENSES, Program
from lcpcli.rational.numbers import decimal, places, text

if TYPE_CHECKING:
    from lcpcli.files.formats import Exact

NAMES = ("rows", "columns")


def is_whole(problem: Problem) -> bool:
    """Whether a problem was made from a program or a game and holds nothing for which that has no key."""
    others = problem.solutions or problem.verdict or problem.x0 is not None or problem.x1 is not None
    return isinstance(problem.origin, (Program, Game)) and not others


def fields_of(problem: Problem) -> dict[str, Any]:
    """The program or the game that a problem was made from, a program in its own sense: arrays, texts, a number and
    lists of names, without what is as by default."""
    origin = problem.origin
    assert isinstance(origin, (Program, Game))
    held: dict[str, Any] = {key: getattr(problem, key) for key in ("name", "source", "note") if getattr(problem, key)}
    held |= {"A": origin.A, "B": origin.B} if isinstance(origin, Game) else _fields_of_program(problem, origin)
    return held | {key: list(getattr(origin, key)) for key in NAMES if getattr(origin, key)}


def _fields_of_program(problem: Problem, origin: Program) -> dict[str, Any]:
    data = origin.program(conditions_of(problem))
    assert data is not None
    sign = SENSES[origin.sense]
    held: dict[str, Any] = {"sense": origin.sense} if sign < 0 else {}
    held |= {"Q": _without_minus_zero(sign * data.Q)} if (data.Q != 0).sum() else {}
    held["c"] = sign * data.c + 0.0
    if data.row_lower.size:
        held |= {"A": data.A, "row_lower": data.row_lower, "row_upper": data.row_upper}
    held |= {"lower": data.lower} if data.lower.any() else {}
    held |= {"upper": data.upper} if np.isfinite(data.upper).any() else {}
    return held | ({"constant": origin.constant} if origin.constant else {})


def json_of(problem: Problem, exact: Exact = NEAREST) -> bytes:
    """The program or the game as a JSON text; one row of a dense matrix per line."""
    fields = fields_of(problem)
    if isinstance(problem.origin, Game) and problem.origin.written is not None:
        fields |= zip("AB", (np.array(payoffs, dtype=object) for payoffs in problem.origin.written), strict=True)
    return object_text([f'"{key}": {_text(value, exact)}' for key, value in fields.items()])


def npz_of(problem: Problem) -> bytes:
    """The program as NPZ; a sparse matrix in the parts data, indices, indptr and shape, after its name and a point."""
    arrays: dict[str, Any] = {}
    for key, value in fields_of(problem).items():
        parts = ("data", "indices", "indptr", "shape") if is_sparse(value) else ()
        arrays |= {f"{key}.{part}": getattr(value, part) for part in parts} or {key: value}
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


def mat_of(problem: Problem) -> bytes:
    """The program as MAT, names as cells."""
    from scipy.io import savemat

    fields = fields_of(problem)
    fields |= {key: np.array(fields[key], dtype=object) for key in NAMES if key in fields}
    file = io.BytesIO()
    savemat(file, fields, oned_as="column")
    return file.getvalue()


WRITERS = {".json": json_of, ".npz": npz_of, ".mat": mat_of}


def _without_minus_zero(A: Any) -> Any:
    if not is_sparse(A):
        return A + 0.0
    A.data += 0.0
    return A


def _text(value: Any, exact: Exact) -> str:
    """A value as JSON: null for an infinite number."""
    number = partial(_number_text, exact)
    if isinstance(value, float):
        return number(value)
    if is_sparse(value) or isinstance(value, np.ndarray):
        return matrix_text(value, number) if value.ndim == 2 else list_text(value, number)
    return json.dumps(value, ensure_ascii=False)


def _number_text(exact: Exact, value: float | Fraction) -> str:
    """What a double stands for, or a payoff: one that is no decimal as a text."""
    if not isinstance(value, Fraction):
        return number_text(exact, value)
    return decimal(value) if places(value) is not None else json.dumps(text(value))
