"""Cells of tables in CSV: numbers, fractions, bounds and names."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

from lcpcli.errors import ProblemError, misread, quoted
from lcpcli.rational.numbers import RATIO

NUMERIC = re.compile(r"\s*[-+]?\.?\d")  # begins like a number, so it is not a name in a header
NAME = re.compile(r"[^\W\d]")  # begins like a name


def is_name(entry: str) -> bool:
    """Whether a cell is a name, and neither a number nor an absent bound."""
    return bool(NAME.match(entry.strip())) and not is_number(entry) and not is_absent(entry)


def value(entry: str, line: int, column: int, commas: bool, number_of: Callable[[str], Any]) -> Any:
    if number_of is str and RATIO.fullmatch(own := entry.strip()):
        if not own.rpartition("/")[2].strip("0"):
            raise ProblemError(f"line {line}, column {column}", f"is {quoted(own)}, a division by 0", "give a number")
        return own
    return number_of(_numeric(entry, line, column, commas))


def is_absent(entry: str) -> bool:
    return entry.strip().casefold() in ("", "none", "null")


def bound(entry: str, line: int, column: int, commas: bool, number_of: Callable[[str], Any]) -> Any:
    """A bound, None if the cell is empty or names an absent one."""
    text = entry.strip().casefold()
    if is_absent(entry):
        return None
    if text.lstrip("+-") in ("inf", "infinity"):
        return float(text) if number_of is float else None
    return value(entry, line, column, commas, number_of)


def is_number(entry: str) -> bool:
    try:
        float(entry)
    except ValueError:
        return False
    return "_" not in entry


def _numeric(entry: str, line: int, column: int, commas: bool) -> str:
    """The entry, checked to be a finite number, with a decimal point.

    commas : whether the decimal mark of the file is a comma.
    """
    number = entry.replace(",", ".", 1) if commas else entry
    mixed = commas and "." in entry
    if is_number(number) and math.isfinite(float(number)) and not mixed:
        return number
    place = f"line {line}, column {column}"
    if not entry.strip():
        raise ProblemError(place, "is empty", "give a number")
    if mixed:
        hint = "use one decimal mark and no thousands separators"
        raise ProblemError(place, f"is {quoted(entry)} in a file with decimal commas", hint)
    if is_number(number):
        raise ProblemError(place, f"is {quoted(entry.strip())}", "give a finite number in double precision")
    raise ProblemError(place, *misread(entry, f"is {quoted(entry)}, not a number"))
