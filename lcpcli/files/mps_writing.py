"""Programs as free MPS: QUADOBJ has a triangle of Q; minus the right-hand side of the objective is its constant."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.files.formats import NEAREST
from lcpcli.files.json_format import number_text
from lcpcli.files.programs import fields_of
from lcpcli.model.arrays import NO_BOUND
from lcpcli.model.problem import Problem
from lcpcli.rational.numbers import decimal, shortest_decimal
from lcpcli.typing import Vector

if TYPE_CHECKING:
    from lcpcli.files.formats import Exact

NONE = -1e30  # the right-hand side of a row without bounds
WORDS = ("NAME", "ROWS", "COLUMNS", "RHS", "RANGES", "BOUNDS", "QUADOBJ", "QMATRIX", "OBJSENSE", "MAX", "MIN", "ENDATA")


def render(problem: Problem, exact: Exact = NEAREST) -> bytes:
    """The program that a problem was made from, or a ProblemError for bounds that MPS takes for none."""
    held, number = fields_of(problem), partial(number_text, exact)
    k, m = held["c"].size, held["row_lower"].size if "A" in held else 0
    low, high = held.get("lower", np.zeros(k)), held.get("upper", np.full(k, np.inf))
    ends = held.get("row_lower", np.zeros(0)), held.get("row_upper", np.zeros(0))
    _refuse_far(lower=low, upper=high, row_lower=ends[0], row_upper=ends[1])
    columns, rows = names(held.get("columns", [""] * k), "x"), names(held.get("rows", [""] * m), "r")
    objective = _free("obj", rows)
    kinds, sides, ranges = (
        zip(*map(partial(_side, exact), *(end.tolist() for end in ends)), strict=True) if m else ((), (), ())
    )
    lines = [f"NAME {'_'.join(held.get('name', '').split())}".rstrip()]
    lines += ["OBJSENSE", "    MAX"] if "sense" in held else []
    lines += ["ROWS", f" N {objective}", *(f" {kind} {row}" for kind, row in zip(kinds, rows, strict=True)), "COLUMNS"]
    lines += _entries(held, columns, rows, objective, number)
    lines += ["RHS"] + ([f" RHS {objective} {number(-held['constant'])}"] if "constant" in held else [])
    lines += [f" RHS {row} {number(side)}" for row, side in zip(rows, sides, strict=True) if side]
    lines += ["RANGES"] * any(ranges)
    lines += [f" RNG {row} {size}" for row, size in zip(rows, ranges, strict=True) if size]
    bounds = [
        line for each in zip(columns, low.tolist(), high.tolist(), strict=True) for line in _bounds(number, *each)
    ]
    lines += ["BOUNDS", *bounds] if bounds else []
    lines += ["QUADOBJ", *_triangle(held["Q"], columns, number)] if "Q" in held else []
    return "\n".join([*lines, "ENDATA", ""]).encode()


def changed(problem: Problem) -> dict[str, str]:
    """The names of rows and columns that are others in MPS, with these."""
    held = fields_of(problem)
    pairs = [(own, names(own, letter)) for own, letter in ((held.get("columns", []), "x"), (held.get("rows", []), "r"))]
    both = [pair for own, written in pairs for pair in zip(own, written, strict=True)]
    return {name: other for name, other in both if name and name != other}


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


def _side(exact: Exact, low: float, high: float) -> tuple[str, float, str]:
    """The kind of a row, its right-hand side, and its range, "" for none."""
    if low == high:
        return "E", low, ""
    if math.isinf(low) or math.isinf(high):
        return ("G", low, "") if math.isfinite(low) else ("L", high, "") if math.isfinite(high) else ("G", NONE, "")
    ends = [exact[end] if end in exact else shortest_decimal(end) for end in (low, high)]
    return *(("L", high) if abs(low) >= abs(high) else ("G", low)), decimal(ends[1] - ends[0])


def _bounds(number: Callable[[float], str], name: str, low: float, high: float) -> Iterator[str]:
    if low == high:
        yield f" FX BND {name} {number(low)}"
    elif low == -math.inf and high == math.inf:
        yield f" FR BND {name}"
    else:
        if low:
            yield f" MI BND {name}" if low == -math.inf else f" LO BND {name} {number(low)}"
        if high < math.inf:
            yield f" UP BND {name} {number(high)}"


def _entries(
    held: dict[str, Any], columns: list[str], rows: list[str], objective: str, number: Callable[[float], str]
) -> Iterator[str]:
    """The lines of COLUMNS: at least one for each variable."""
    from scipy.sparse import csc_array

    A = csc_array(held["A"] if rows else (0, len(columns)))
    for j, (name, cost) in enumerate(zip(columns, held["c"].tolist(), strict=True)):
        own = range(A.indptr[j], A.indptr[j + 1])
        if cost or not len(own):
            yield f" {name} {objective} {number(cost)}"
        for place in own:
            yield f" {name} {rows[A.indices[place]]} {number(A.data[place].item())}"


def _triangle(Q: Any, columns: list[str], number: Callable[[float], str]) -> Iterator[str]:
    from scipy.sparse import coo_array

    upper = coo_array(Q)
    for i, j, value in zip(upper.row.tolist(), upper.col.tolist(), upper.data.tolist(), strict=True):
        if i <= j and value:
            yield f" {columns[j]} {columns[i]} {number(value)}"
