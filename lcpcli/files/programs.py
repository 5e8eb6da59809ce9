"""Programs written in their own keys, those of `origins.NATIVE`: in JSON, NPZ, MAT and, by `mps_writing`, MPS."""

from __future__ import annotations

import io
import json
import math
from typing import Any

import numpy as np

from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.model.reductions.program import SENSES, Program

NAMES = ("rows", "columns")
WHOLE = 1e15  # whole numbers below it are written without a point


def is_whole(problem: Problem) -> bool:
    """Whether a problem was made from a program and holds nothing for which a program has no key."""
    others = problem.solutions or problem.verdict or problem.x0 is not None or problem.x1 is not None
    return isinstance(problem.origin, Program) and not others


def fields_of(problem: Problem) -> dict[str, Any]:
    """The program that a problem was made from, in its own sense: arrays, texts, a number and lists of names, without
    what is as by default."""
    origin = problem.origin
    assert isinstance(origin, Program)
    data = origin.program(conditions_of(problem))
    assert data is not None
    sign = SENSES[origin.sense]
    held: dict[str, Any] = {key: getattr(problem, key) for key in ("name", "source", "note") if getattr(problem, key)}
    held |= {"sense": origin.sense} if sign < 0 else {}
    held |= {"Q": _without_minus_zero(sign * data.Q)} if (data.Q != 0).sum() else {}
    held["c"] = sign * data.c + 0.0
    if data.row_lower.size:
        held |= {"A": data.A, "row_lower": data.row_lower, "row_upper": data.row_upper}
    held |= {"lower": data.lower} if data.lower.any() else {}
    held |= {"upper": data.upper} if np.isfinite(data.upper).any() else {}
    held |= {"constant": origin.constant} if origin.constant else {}
    return held | {key: list(getattr(origin, key)) for key in NAMES if getattr(origin, key)}


def json_of(problem: Problem) -> bytes:
    """The program as a JSON text; one row of a dense matrix per line."""
    lines = [f'"{key}": {_text(value)}' for key, value in fields_of(problem).items()]
    body = ",\n  ".join(lines)
    return f"{{\n  {body}\n}}\n".encode()


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


def _text(value: Any) -> str:
    """A value as JSON: null for an infinite number."""
    if is_sparse(value):
        coo = value.tocoo()
        parts = {"rows": coo.row.tolist(), "cols": coo.col.tolist(), "values": _plain(coo.data)}
        return json.dumps({"format": "coo", "shape": list(coo.shape), **parts})
    if isinstance(value, np.ndarray) and value.ndim == 2:
        return "[\n    " + ",\n    ".join(json.dumps(_plain(row)) for row in value) + "\n  ]"
    return json.dumps(_plain(value) if isinstance(value, np.ndarray) else value, ensure_ascii=False)


def _plain(values: Any) -> list[Any]:
    return [None if math.isinf(x) else int(x) if x == int(x) and abs(x) < WHOLE else x for x in values.tolist()]
