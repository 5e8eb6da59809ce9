"""The cells of a table in CSV: numbers, absent bounds, names and labels."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

from lcpcli.errors import REAL, ProblemError, quoted
from lcpcli.rational.numbers import RATIO

NAME = re.compile(r"[^\W\d]")  # begins like a name


def cells_of(number: int, line: str, delimiter: str, strict: bool = True) -> list[str]:
    """Return the cells of a line with this number. strict : whether quotation marks must match, and blanks before a
    cell do not belong to it."""
    if not delimiter:
        line, delimiter = " ".join(line.split()), " "
    if '"' not in line:
        return line.split(delimiter)
    try:
        return next(csv.reader([line], delimiter=delimiter, skipinitialspace=strict, strict=strict))
    except csv.Error:
        most, fault = csv.field_size_limit(), "its quotation marks do not match"
        if len(line) > most:
            fault = f"it may have an entry of more than {most} characters"
        raise ProblemError(f"line {number}", f"is not CSV ({fault})", "correct it there") from None


def is_name(entry: str) -> bool:
    return bool(NAME.match(entry.strip())) and not is_number(entry) and not is_absent(entry)


def is_absent(entry: str) -> bool:
    return entry.strip().casefold() in ("", "none", "null")


def is_number(entry: str) -> bool:
    with suppress(ValueError):
        float(entry)
        return "_" not in entry
    return False


def value_of(entry: str, line: int, column: int, commas: bool, number_of: Callable[[str], Any], is_bound: bool) -> Any:
    """Return the number in a cell, which may be written as a fraction; a bound may be absent (None) or infinite.

    commas : whether the decimal mark of the file is a comma.
    """
    if is_bound and is_absent(entry):
        return None
    if is_bound and entry.strip().casefold().lstrip("+-") in ("inf", "infinity"):
        return float(entry)
    is_ratio = number_of is str and RATIO.fullmatch(entry.strip())
    if is_ratio and entry.rpartition("/")[2].strip(" \t0"):
        return entry.strip()
    number, is_mixed = entry.replace(",", ".", 1) if commas else entry, commas and "." in entry
    if is_number(number) and math.isfinite(float(number)) and not is_mixed:
        return number_of(number)
    text = quoted(entry.strip())
    if is_ratio:
        fault, hint = f"is {text}, a division by 0", "give a number"
    elif not entry.strip():
        fault, hint = "is empty", "give a number"
    elif is_mixed:
        fault, hint = f"is {quoted(entry)} in a file with decimal commas", "use one decimal mark, none for thousands"
    elif is_number(number):
        fault, hint = f"is {text}", "give a finite number in double precision"
    else:
        fault, hint = f"is {quoted(entry)}, not a number", REAL
        if "\u2212" in entry:
            hint = "write the minus sign as -"
        elif RATIO.fullmatch(entry.strip()):
            hint = "write the fraction as a decimal"
    raise ProblemError(f"line {line}, column {column}", fault, hint)


def places_of(labels: Sequence[str], names: Sequence[str]) -> list[int] | None:
    """Return where each name is among the labels. Return None, so that positions count, if the labels are in this order
    or have nothing to do with the names; raise ProblemError if only some of them are names."""
    own = [label.strip() for label in labels]
    if own == list(names) or not set(own) & set(names) or len(set(names)) < len(names):
        return None
    if sorted(own) == sorted(names):
        return [own.index(name) for name in names]
    other = next((label for label in own if label not in names), own[0])
    fault = f"has the label {quoted(other)}, which is not the name of an unknown"
    if other in names:
        fault = f"has {len(own)} labels for {len(names)} unknowns"
    raise ProblemError("", fault, "give each unknown once, by its name, or leave the labels out")
