"""Programs written as free MPS.

QUADOBJ has one triangle of Q; the right-hand side of the objective is minus its constant.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from lcpcli.errors import ProblemError, visible
from lcpcli.files.formats import Exact
from lcpcli.files.json_format import number_text
from lcpcli.model.box import NO_BOUND
from lcpcli.model.problem import Problem
from lcpcli.rational.numbers import decimal, shortest_decimal

NO_SIDE = -1e30  # the right-hand side of a row without bounds: far beyond NO_BOUND, for every reader of MPS
WORDS = ("NAME", "ROWS", "COLUMNS", "RHS", "RANGES", "BOUNDS", "QUADOBJ", "QMATRIX", "OBJSENSE", "MAX", "MIN", "ENDATA")


def render(fields: Mapping[str, Any], exact: Exact) -> dict[str, bytes]:
    """Return the program in free MPS; raise ProblemError for finite bounds that MPS takes for infinite ones."""
    number = partial(number_text, exact)
    k, m = fields["c"].size, fields["row_lower"].size if "A" in fields else 0
    low, high = fields.get("lower", np.zeros(k)), fields.get("upper", np.full(k, np.inf))
    ends = fields.get("row_lower", np.zeros(0)), fields.get("row_upper", np.zeros(0))
    for field, values in zip(("lower", "upper", "row_lower", "row_upper"), (low, high, *ends), strict=True):
        if ((np.abs(values) >= NO_BOUND) & np.isfinite(values)).any():
            fault = f"has a bound of {NO_BOUND:g} or more, which means no bound in MPS"
            raise ProblemError(field, fault, "give --infinity 1e20 if it means that here too, or write .json")
    columns, rows = names(fields.get("columns", [""] * k), "x"), names(fields.get("rows", [""] * m), "r")
    objective = _free("obj", rows)
    sides = [_side(exact, *each) for each in zip(*(end.tolist() for end in ends), strict=True)]
    ranges = [f" RNG {row} {size}" for row, (*_, size) in zip(rows, sides, strict=True) if size]
    bounds = [
        line for each in zip(columns, low.tolist(), high.tolist(), strict=True) for line in _bounds(number, *each)
    ]
    lines = [f"NAME {_word(fields.get('name', ''))}".rstrip()]
    lines += ["OBJSENSE", "    MAX"] if "sense" in fields else []
    lines += ["ROWS", f" N {objective}", *(f" {kind} {row}" for row, (kind, *_) in zip(rows, sides, strict=True))]
    lines += ["COLUMNS", *_columns(fields, columns, rows, objective, number)]
    lines += ["RHS"] + ([f" RHS {objective} {number(-fields['constant'])}"] if "constant" in fields else [])
    lines += [f" RHS {row} {number(side)}" for row, (_, side, _) in zip(rows, sides, strict=True) if side]
    lines += ["RANGES", *ranges] if ranges else []
    lines += ["BOUNDS", *bounds] if bounds else []
    if "Q" in fields:
        from scipy.sparse import coo_array

        upper = coo_array(fields["Q"])
        entries = zip(upper.row.tolist(), upper.col.tolist(), upper.data.tolist(), strict=True)
        triangle = (f" {columns[j]} {columns[i]} {number(value)}" for i, j, value in entries if i <= j and value)
        lines += ["QUADOBJ", *triangle]
    return {"": "\n".join([*lines, "ENDATA", ""]).encode()}


def new_names(problem: Problem) -> dict[str, str]:
    """Return the names of rows and columns that differ in MPS, each with its name in MPS."""
    given = ((getattr(problem.origin, key), letter) for key, letter in (("columns", "x"), ("rows", "r")))
    both = [pair for own, letter in given for pair in zip(own, names(own, letter), strict=True)]
    return {name: other for name, other in both if name and name != other}


def names(given: Sequence[str], letter: str) -> list[str]:
    """Return names without spaces, all different and none of them a word of the format; a missing name becomes the
    letter and the number of its place."""
    found: dict[str, None] = {}
    for i, name in enumerate(given, 1):
        found[_free(_word(name) or f"{letter}{i}", WORDS, found)] = None
    return list(found)


def _word(name: str) -> str:
    """Return a name without spaces and line breaks, in characters that every reader takes."""
    return visible("_".join(name.split()))


def _free(name: str, *others: Any) -> str:
    while any(name in some for some in others):
        name += "_"
    return name


def _side(exact: Exact, low: float, high: float) -> tuple[str, float, str]:
    """Return the kind of a row, its right-hand side, and its range, "" for none."""
    if low == high:
        return "E", low, ""
    if math.isinf(low) or math.isinf(high):
        return ("G", low, "") if math.isfinite(low) else ("L", high, "") if math.isfinite(high) else ("G", NO_SIDE, "")
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


def _columns(
    held: Mapping[str, Any], columns: list[str], rows: list[str], objective: str, number: Callable[[float], str]
) -> Iterator[str]:
    """Yield the lines of COLUMNS, at least one for each variable."""
    from scipy.sparse import csc_array

    A = csc_array(held["A"] if rows else (0, len(columns)))
    for j, (name, cost) in enumerate(zip(columns, held["c"].tolist(), strict=True)):
        own = range(A.indptr[j], A.indptr[j + 1])
        if cost or not len(own):
            yield f" {name} {objective} {number(cost)}"
        for place in own:
            yield f" {name} {rows[A.indices[place]]} {number(A.data[place].item())}"
