"""The lines of an MPS file: checks for what HiGHS misreads, the lines that errors name, and programs written as free
MPS.

QUADOBJ has a triangle of Q; the right-hand side of the objective is minus its constant.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from lcpcli.errors import ProblemError, quoted
from lcpcli.files.formats import Exact
from lcpcli.files.json_format import number_text
from lcpcli.model.box import NO_BOUND
from lcpcli.model.problem import Problem
from lcpcli.rational.numbers import decimal, fraction, shortest_decimal

MPS = re.compile(rb"^ROWS\b", re.MULTILINE)  # tells it from the LP format
NUMBER = rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
INFINITE = rb"[-+]?[iI][nN][fF](?:[iI][nN][iI][tT][yY])?"
SENSES = (b"MIN", b"MAX", b"MINIMIZE", b"MAXIMIZE")
OF_ENTRIES = (b"COLUMNS", b"RHS", b"RANGES", b"QUADOBJ", b"QMATRIX")  # sections of names followed by numbers
HEADING = re.compile(rb"\n([A-Z]+)[^\n]*")
USUAL = rb"[ \t]+\S+[ \t]+\S+[ \t]+%b(?:[ \t]+\S+[ \t]+%b)?[ \t]*\r?\n" % (NUMBER, NUMBER)  # a line of entries
OTHERS = re.compile(rb"\n(?!%b|\*|\s*\n)([^\n]*)" % USUAL)
VALUE = re.compile(rb"(?<=\S)([ \t]+)(%b)(?=[ \t]+\S+[ \t]+%b[ \t]*$|[ \t]*$)" % (NUMBER, NUMBER))  # in such a line
WITH_NUMBER = (b"UP", b"LO", b"FX")  # bounds
BOUNDS = re.compile(
    rb"\n[ \t]+(?:%b)[ \t][^\n]*[ \t](?!(?:%b|%b)[ \t]*\r?\n)(\S+)[ \t]*\r?(?=\n)"
    % (b"|".join(WITH_NUMBER), NUMBER, INFINITE)
)


def refuse_misread(text: bytes) -> None:
    """Refuse a file that is cut off, and an entry or a bound with a malformed number, which HiGHS reads as 0."""
    spans = _sections(text)
    if b"ENDATA" not in spans:
        raise ProblemError("", "has no ENDATA", "is it cut off?")
    if b"OBJSENSE" in spans:
        start = text.rfind(b"\n", 0, spans[b"OBJSENSE"][0] - 1) + 1
        words = text[start : spans[b"OBJSENSE"][1]].split()[1:]
        if len(words) != 1 or words[0].upper() not in SENSES:
            raise _misread(text, start, b" ".join(words), "as the sense of the objective", "give MIN or MAX")
    rows: set[bytes] = set()
    for section in filter(spans.__contains__, OF_ENTRIES):
        for match in OTHERS.finditer(text, *spans[section]):
            rows = rows or {words[-1] for words in _words(text, spans[b"ROWS"])}
            for word in _numbers(match[1].split(), rows):
                if not re.fullmatch(NUMBER, word):
                    raise _misread(text, match.start(1), word)
    if wrong := BOUNDS.search(text, *spans.get(b"BOUNDS", (0, 0))):
        raise _misread(text, wrong.start(1), wrong[1])


def _misread(
    text: bytes, at: int, word: bytes, role: str = "in place of a number", hint: str = "give a number"
) -> ProblemError:
    line = text.count(b"\n", 0, at) + 1
    return ProblemError(f"line {line}", f"has {quoted(word.decode('utf-8', 'replace'))} {role}", hint)


def _sections(text: bytes) -> dict[bytes, tuple[int, int]]:
    """Return the spans of the sections: each begins at the end of the section's heading."""
    found = [*HEADING.finditer(text)]
    ends = [match.start() + 1 for match in found[1:]] + [len(text)]
    return {match[1]: (match.end(), end) for match, end in zip(found, ends, strict=True)}


def _words(text: bytes, span: tuple[int, int]) -> list[list[bytes]]:
    """Return the words of the lines of a section."""
    return [words for line in text[slice(*span)].splitlines() if not line.startswith(b"*") and (words := line.split())]


def _numbers(words: list[bytes], rows: set[bytes]) -> list[bytes]:
    """Return the words of an entry that must be numbers; names in fixed format may consist of several words."""
    if b"'MARKER'" in words:
        return []
    return [words[2], words[4]] if len(words) == 5 and words[1] in rows and words[3] in rows else words[-1:]


def unknown_row(text: bytes) -> str:
    """Return the first name in COLUMNS, RHS or RANGES that is not in ROWS; "" if all are."""
    rows, unknown = set[bytes](), list[bytes]()
    for _, section, line in lines(text):
        words = line.split()
        if section == b"ROWS":
            rows |= set(words[1:])
        elif section in (b"COLUMNS", b"RHS", b"RANGES") and len(words) in (3, 5) and line[:1].isspace():
            unknown += [word for word in words[1::2] if word not in rows]
    return unknown[0].decode("utf-8", "replace") if unknown else ""


def spaced_row(text: bytes) -> str:
    """Return the first line of ROWS with more than a kind and a name; "" if there is none."""
    found = (number for number, section, line in lines(text) if section == b"ROWS" and len(line.split()) > 2)
    return next((f"line {number}" for number in found), "")


def as_written(text: bytes, number: Callable[[str], float]) -> bytes:
    """Return the text with each number replaced by the double that `number` makes of it, unless that is the nearest
    one."""

    def own(match: re.Match[bytes]) -> bytes:
        written = match[2].decode("ascii")
        double = number(written)
        return match[0] if double == float(written) else match[1] + repr(double).encode()

    found = []
    for _, section, line in lines(text):
        is_bound = section == b"BOUNDS" and line.split()[:1] in ([kind] for kind in WITH_NUMBER)
        has_numbers = is_bound or (section in OF_ENTRIES and line[:1].isspace())
        found.append(VALUE.sub(own, line) if has_numbers else line)
    return b"\n".join([*found, b""])


def range_sides(text: bytes) -> dict[str, tuple[Fraction | float, Fraction | float]]:
    """Return the two sides of each row with a range, as written; a range of NO_BOUND or more leaves only one side."""
    spans = _sections(text)
    if b"RANGES" not in spans:
        return {}
    kinds = {words[-1]: words[0].upper() for words in _words(text, spans[b"ROWS"])}
    given: list[dict[bytes, Fraction]] = []
    for section in (b"RHS", b"RANGES"):
        lines = [words[len(words) % 2 :] for words in _words(text, spans.get(section, (0, 0)))]
        pairs = [pair for words in lines for pair in zip(words[::2], words[1::2], strict=True)]
        given.append({row: fraction(value.decode()) for row, value in pairs if re.fullmatch(NUMBER, value)})
    found: dict[str, tuple[Fraction | float, Fraction | float]] = {}
    for row, size in given[1].items():
        side, kind = given[0].get(row, Fraction(0)), kinds.get(row, b"")
        width = abs(size) if abs(size) < NO_BOUND else math.inf
        goes_up = kind == b"G" or (kind == b"E" and size > 0)
        found[row.decode("utf-8", "replace")] = (side, side + width) if goes_up else (side - width, side)
    return found


def line_of(text: bytes, complaint: str) -> str:
    """Return the place of the last line with all names that a complaint quotes, in the section that it names, or ""."""
    names = {name.encode() for name in re.findall(r'"([^"]*)"', complaint)}
    named = re.search(r"(\w+) section", complaint)
    found = [
        number
        for number, section, line in lines(text)
        if names and (named is None or named[1].encode() == section) and names <= set(line.split())
    ]
    return f"line {found[-1]}" if found else ""


def lines(text: bytes) -> Iterator[tuple[int, bytes, bytes]]:
    """Yield the lines with their numbers and sections."""
    section = b""
    for number, line in enumerate(text.splitlines(), 1):
        if line[:1].strip() and not line.startswith(b"*"):
            section = line.split()[0]
        yield number, section, line


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
    lines = [f"NAME {'_'.join(fields.get('name', '').split())}".rstrip()]
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
    """Return names without spaces, all different and none a word of the format; a missing name becomes the letter and
    the number of its place."""
    found: dict[str, None] = {}
    for i, name in enumerate(given, 1):
        found[_free("_".join(name.split()) or f"{letter}{i}", WORDS, found)] = None
    return list(found)


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
    fields: Mapping[str, Any], columns: list[str], rows: list[str], objective: str, number: Callable[[float], str]
) -> Iterator[str]:
    """Yield the lines of COLUMNS, at least one for each variable."""
    from scipy.sparse import csc_array

    A = csc_array(fields["A"] if rows else (0, len(columns)))
    for j, (name, cost) in enumerate(zip(columns, fields["c"].tolist(), strict=True)):
        own = range(A.indptr[j], A.indptr[j + 1])
        if cost or not len(own):
            yield f" {name} {objective} {number(cost)}"
        for place in own:
            yield f" {name} {rows[A.indices[place]]} {number(A.data[place].item())}"
