"""The segments of AMPL's .nl files (D. M. Gay, "Writing .nl files", 2005): the content of a file, not yet a problem."""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import dataclass, field
from math import inf
from typing import Any

from lcpcli.errors import ProblemError, count, quoted
from lcpcli.files.nl_tokens import (
    COUNTS,
    CUT_OFF,
    HEADER_LINES,
    MEANINGS,
    PIECEWISE_LINEAR,
    REFUSED,
    STORED,
    BinaryTokens,
    Constant,
    TextTokens,
    Tokens,
    whole,
)

Term = tuple[str, Any, int]  # of an expression: its letter, its value or operator, and the number of its arguments
Linear = dict[int, Any]  # the coefficients of variables
Side = tuple[Any, Any]  # both bounds of a variable or of a row

OPTIONS = re.compile(r"[gb](\d+)((?:\s+-?\d+)*)(?:\s+([-+.\deE]+))?\s*$")
FEWEST = (5, 2, 2, 3, 3, 3, 2, 2, 5)  # counts in the lines of the header behind the first
BIG_ENDIAN = 2  # the number in the header of files whose integers begin with the highest byte
FLOATING = 4  # in the kind of a suffix: its values are no integers
SIDES = {"0": (1, 1), "1": (0, 1), "2": (1, 0), "3": (0, 0), "4": (1, 0)}  # the bounds in the file, by their kind
ENDS = "ends too early"
SMOOTH = "functions that jump are not solved; write the model without it"
CONTINUOUS = "lcp solves complementarity problems of continuous variables"


@dataclass
class Header:
    """The header of a file.

    options : the numbers in the first line, which belong into the solution file. variables, rows, entries, common : the
    numbers of variables, of rows, of entries of the Jacobian and of common expressions. order : the order of bytes, as
    in `struct`; "" in a text.
    """

    options: list[str]
    variables: int
    rows: int
    entries: int
    common: int
    order: str


@dataclass
class Segments:
    """The content of a file. Expressions are lists of terms, operators before their arguments.

    common : linear part and expression of each common expression, by its number. rows, linear : expression and linear
    part of each row, by its number. objectives, slopes : of each objective, whether it is maximized and its expression,
    and its linear part. sides, bounds : of rows and variables. complements : of a row, the variable, and the number
    that says which bounds it has. start : values of variables.
    """

    header: Header
    common: dict[int, tuple[Linear, list[Term]]] = field(default_factory=dict)
    rows: dict[int, list[Term]] = field(default_factory=dict)
    linear: dict[int, Linear] = field(default_factory=dict)
    objectives: dict[int, tuple[int, list[Term]]] = field(default_factory=dict)
    slopes: dict[int, Linear] = field(default_factory=dict)
    sides: list[Side] = field(default_factory=list)
    bounds: list[Side] = field(default_factory=list)
    complements: dict[int, tuple[int, int]] = field(default_factory=dict)
    start: Linear = field(default_factory=dict)


def segments_in(content: bytes, constant: Constant) -> Segments:
    """Return the content of a file. constant : returns the number that a text stands for."""
    *lines, rest = [*content.split(b"\n", HEADER_LINES), *[b""] * HEADER_LINES][: HEADER_LINES + 1]
    header = _header(lines)
    if header.order:
        return _Reader(BinaryTokens(content, len(content) - len(rest), header.order, constant), header).read()
    return _Reader(TextTokens(rest.decode("utf-8", "replace"), constant), header).read()


def _header(lines: list[bytes]) -> Header:
    first = OPTIONS.match(_line(lines[0]))
    if first is None:
        raise ProblemError("line 1", "is not the beginning of an .nl file", "begin it with g3 or b3")
    counts = [_counts(line, number) for number, line in enumerate(lines[1:], 2)]
    (n, m, *_), (integers, logical) = counts[0], (sum(counts[5]), counts[0][5])
    for number, noun in ((integers, "integer variable"), (logical, "logical constraint")):
        if number:
            raise ProblemError("", f"has {count(number, noun)}", CONTINUOUS)
    order = "" if lines[0].startswith(b"g") else ">" if counts[4][2] == BIG_ENDIAN else "<"
    options = [first[1], *first[2].split(), *filter(None, [first[3]])]
    return Header(options, n, m, counts[6][0], sum(counts[8]), order)


def _counts(line: bytes, number: int) -> list[int]:
    words, fewest = _line(line).split(), FEWEST[number - 2]
    counts: list[int] = []
    with suppress(ValueError):
        counts = list(map(whole, words))
    if len(counts) < fewest or min(counts) < 0:
        raise ProblemError(f"line {number}", f"has not the {fewest} counts of the header", CUT_OFF)
    return [*counts, 0, 0]


def _line(line: bytes) -> str:
    return line.decode("utf-8", "replace").partition("#")[0].strip()


class _Reader:
    """What has been read of the segments of a file."""

    def __init__(self, tokens: Tokens, header: Header) -> None:
        self._tokens, self._header, self._found = tokens, header, Segments(header)
        self._entries = 0

    def read(self) -> Segments:
        """Return the content of the file."""
        found, header, integer = self._found, self._header, self._tokens.integer
        while code := self._tokens.code():
            if code in "CO":
                number = self._index(header.rows if code == "C" else inf, "row" if code == "C" else "objective")
                if code == "C":
                    found.rows[number] = self._expression()
                else:
                    found.objectives[number] = integer(), self._expression()
            elif code == "V":
                number, size, _ = integer() - header.variables, integer(), integer()
                if number in found.common or not 0 <= number < header.common:
                    raise self._tokens.error(f"defines common expression {number} of {header.common}", COUNTS)
                found.common[number] = self._linear(size), self._expression()
            elif code in "JG":
                number = self._index(header.rows if code == "J" else inf, "row" if code == "J" else "objective")
                linear = self._linear(integer())
                (found.linear if code == "J" else found.slopes)[number] = linear
                self._entries += len(linear) * (code == "J")
            else:
                self._read_other(code)
        return self._complete()

    def _read_other(self, code: str) -> None:
        """Read a segment that holds no expression."""
        found, header, tokens = self._found, self._header, self._tokens
        if code == "x":
            found.start = self._linear(tokens.integer())
        elif code == "d":
            for _ in range(tokens.integer()):
                tokens.integer(), tokens.number()
        elif code == "r":
            found.sides = [self._side(i) for i in range(header.rows)]
        elif code == "b":
            found.bounds = [self._side(None) for _ in range(header.variables)]
        elif code in "kK":
            for _ in range(tokens.integer()):
                tokens.integer()
        elif code == "S":
            kind, size, _ = tokens.integer(), tokens.integer(), tokens.name()
            for _ in range(size):
                tokens.integer(), (tokens.number() if kind & FLOATING else tokens.integer())
        elif code == "F":
            tokens.integer(), tokens.integer(), tokens.integer()
            fault = f"imports the function {quoted(tokens.name())}"
            raise tokens.error(fault, "write it with the operators of AMPL")
        else:
            raise tokens.error(f"has {quoted(code)} in place of a segment", COUNTS)

    def _index(self, end: float, noun: str) -> int:
        """Return the number of a row, a variable or the like."""
        number = self._tokens.integer()
        if not 0 <= number < end:
            raise self._tokens.error(f"names {noun} {number}, counted from 0, of {end}", COUNTS)
        return number

    def _linear(self, size: int) -> Linear:
        """Return coefficients, or values, of variables."""
        tokens, n, found = self._tokens, self._header.variables, Linear()
        for _ in range(size):
            number = self._index(n, "variable")
            if number in found:
                raise tokens.error(f"gives variable {number} a second coefficient here", "keep one")
            found[number] = tokens.number()
        return found

    def _side(self, row: int | None) -> Side:
        """Return both bounds of the next variable, or of a row, which may complement a variable instead."""
        tokens = self._tokens
        kind = tokens.kind()
        if kind == "5" and row is not None:
            bounds, variable = tokens.integer(), tokens.integer() - 1
            if not 0 <= variable < self._header.variables:
                raise tokens.error(f"complements variable {variable + 1} of {self._header.variables}", COUNTS)
            self._found.complements[row] = variable, bounds
            return 0, 0
        if kind not in SIDES:
            raise tokens.error(f"has {quoted(kind)} in place of the kind of a bound", "the kinds are 0 to 5")
        low, high = (tokens.number() if given else None for given in SIDES[kind])
        return (low, low) if kind == "4" else (low, high)

    def _expression(self) -> list[Term]:
        """Return the next expression."""
        tokens, n, terms, open_terms = self._tokens, self._header.variables, list[Term](), 1
        while open_terms:
            letter = tokens.code()
            size = 0
            value: Any
            if letter == "o":
                value = tokens.integer()
                size = self._arguments(value)
                if value == PIECEWISE_LINEAR:
                    value = tuple(self._constant(tokens.code()) for _ in range(2 * size - 1))
                    letter, size = "p", 1
            elif letter == "v":
                value = tokens.integer()
                if not 0 <= value < n and value - n not in self._found.common:
                    raise tokens.error(f"names v{value}, which is not defined before it", COUNTS)
            elif letter in ("f", "h"):
                raise tokens.error("has an imported function or a text", "write it with the operators of AMPL")
            else:
                value = self._constant(letter, "an expression")
            terms.append((letter, value, size))
            open_terms += size - 1
        return terms

    def _constant(self, letter: str, what: str = "a number") -> Any:
        """Return the number that follows its letter. what : what may stand here, for messages."""
        if letter not in STORED:
            raise self._tokens.error(f"has {quoted(letter)} in place of {what}" if letter else ENDS, CUT_OFF)
        return self._tokens.number(letter)

    def _arguments(self, operator: int) -> int:
        """Return the number of arguments of an operator, which for some is in the file; of a piecewise linear function
        the number of slopes."""
        if operator not in MEANINGS:
            raise self._tokens.error(f"has the unknown operator o{operator}", COUNTS)
        name, size = MEANINGS[operator]
        if name in REFUSED:
            raise self._tokens.error(f"has the operator {name} (o{operator})", SMOOTH)
        if size:
            return size
        size = self._tokens.integer()
        if size < 1:
            raise self._tokens.error(f"gives {name} (o{operator}) {count(size, 'argument')}", COUNTS)
        return size

    def _complete(self) -> Segments:
        """Return the content, after comparing it with the counts of the header."""
        found, header = self._found, self._header
        complete = {
            "expressions of rows (C)": (len(found.rows), header.rows),
            "sides of rows (r)": (len(found.sides), header.rows),
            "bounds of variables (b)": (len(found.bounds), header.variables),
            "entries of rows (J)": (self._entries, header.entries),
            "common expressions (V)": (len(found.common), header.common),
            "expressions of objectives (O) with linear parts (G)": (
                len(found.slopes.keys() & found.objectives.keys()),
                len(found.slopes),
            ),
        }
        for what, (given, declared) in complete.items():
            if given != declared:
                raise ProblemError("", f"has {given} {what}, but its header says {declared}", CUT_OFF)
        return found
