"""Programs as free MPS: QUADOBJ has a triangle of Q; minus the right-hand side of the objective is its constant."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.files.programs import WHOLE, fields_of
from lcpcli.model.arrays import NO_BOUND
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

NONE = -1e30  # the right-hand side of a row without bounds
WORDS = ("NAME", "ROWS", "COLUMNS", "RHS", "RANGES", "BOUNDS", "QUADOBJ", "QMATRIX", "OBJSENSE", "MAX", "MIN", "ENDATA")


def render(problem: Problem) -> bytes:
    """The program that a problem was made from, or a ProblemError for bounds that MPS takes for none."""
    held = fields_of(problem)
    k, m = held["c"].size, held["row_lower"].size if "A" in held else 0
    low, high = held.get("lower", np.zeros(k)), held.get("upper", np.full(k, np.inf))
    ends = held.get("row_lower", np.zeros(0)), held.get("row_upper", np.zeros(0))
    _refuse_far(lower=low, upper=high, row_lower=ends[0], row_upper=ends[1])
    columns, rows = names(held.get("columns", [""] * k), "x"), names(held.get("rows", [""] * m), "r")
    objective = _free("obj", rows)
    kinds, sides, ranges = zip(*map(_side, *(end.tolist() for end in ends)), strict=True) if m else ((), (), ())
    lines = [f"NAME {'_'.join(held.get('name', '').split())}".rstrip()]
    lines += ["OBJSENSE", "    MAX"] if "sense" in held else []
    lines += ["ROWS", f" N {objective}", *(f" {kind} {row}" for kind, row in zip(kinds, rows, strict=True)), "COLUMNS"]
    lines += _entries(held, columns, rows, objective)
    lines += ["RHS"] + ([f" RHS {objective} {_number(-held['constant'])}"] if "constant" in held else [])
    lines += [f" RHS {row} {_number(side)}" for row, side in zip(rows, sides, strict=True) if side]
    lines += ["RANGES"] * any(ranges)
    lines += [f" RNG {row} {_number(size)}" for row, size in zip(rows, ranges, strict=True) if size]
    bounds = [line for each in zip(columns, low.tolist(), high.tolist(), strict=True) for line in _bounds(*each)]
    lines += ["BOUNDS", *bounds] if bounds else []
    lines += ["QUADOBJ", *_triangle(held["Q"], columns)] if "Q" in held else []
    return "\n".join([*lines, "ENDATA", ""]).encode()


def names(given: Sequence[str], letter: str) -> list[str]:
    """Names without spaces, all different and none a word of the format; a letter and the place where there is none."""
    found: dict[str, None] = {}
    for i, name in enumerate(given, 1):
        found[_free("_".join(name.split()) or f"{letter}{i}", WORDS, found)] = None
    return list(found)


def _free(name: str, *taken: Any) -> str:
    while any(name in some for some in taken):
        name += "_"
    return name


def _refuse_far(**bounds: Vector) -> None:
    for field, values in bounds.items():
        if ((np.abs(values) >= NO_BOUND) & np.isfinite(values)).any():
            fault = f"has a bound of {NO_BOUND:g} or more, which means none in MPS"
            raise ProblemError(field, fault, "give --infinity 1e20 if it means none here too, or write .json")


def _side(low: float, high: float) -> tuple[str, float, float]:
    """The kind of a row, its right-hand side, and its range, 0 for none."""
    if low == high:
        return "E", low, 0.0
    if math.isinf(low) or math.isinf(high):
        return ("G", low, 0.0) if math.isfinite(low) else ("L", high, 0.0) if math.isfinite(high) else ("G", NONE, 0.0)
    size = high - low
    sizes = (size, math.nextafter(size, 0.0), math.nextafter(size, math.inf))
    if abs(low) >= abs(high):
        return "L", high, next((each for each in sizes if high - each == low), size)
    return "G", low, next((each for each in sizes if low + each == high), size)


def _bounds(name: str, low: float, high: float) -> Iterator[str]:
    if low == high:
        yield f" FX BND {name} {_number(low)}"
    elif low == -math.inf and high == math.inf:
        yield f" FR BND {name}"
    else:
        if low:
            yield f" MI BND {name}" if low == -math.inf else f" LO BND {name} {_number(low)}"
        if high < math.inf:
            yield f" UP BND {name} {_number(high)}"


def _entries(held: dict[str, Any], columns: list[str], rows: list[str], objective: str) -> Iterator[str]:
    """The lines of COLUMNS: at least one for each variable."""
    from scipy.sparse import csc_array

    A = csc_array(held["A"] if rows else (0, len(columns)))
    for j, (name, cost) in enumerate(zip(columns, held["c"].tolist(), strict=True)):
        own = range(A.indptr[j], A.indptr[j + 1])
        if cost or not len(own):
            yield f" {name} {objective} {_number(cost)}"
        for place in own:
            yield f" {name} {rows[A.indices[place]]} {_number(A.data[place].item())}"


def _triangle(Q: Any, columns: list[str]) -> Iterator[str]:
    from scipy.sparse import coo_array

    upper = coo_array(Q)
    for i, j, value in zip(upper.row.tolist(), upper.col.tolist(), upper.data.tolist(), strict=True):
        if i <= j and value:
            yield f" {columns[j]} {columns[i]} {_number(value)}"


def _number(x: float) -> str:
    return f"{x:.0f}" if x == int(x) and abs(x) < WHOLE else repr(x)
