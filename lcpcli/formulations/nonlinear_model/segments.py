"""The content of AMPL's .nl files, in text or binary, before it is made into a problem:
tokens in the order in which they are read, operators by number (table 5), segments, and
the names of variables and rows.
"""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from math import inf
from typing import Any, NamedTuple, TypeAlias

from lcpcli.errors import CUT_OFF, ENDS_TOO_EARLY, KEEP_ONE, ProblemError, count, quoted
from lcpcli.files.contents import STANDARD_INPUT, content_of, decode, within
from lcpcli.files.formats import refuse

Constant = Callable[[str], Any]  # returns the value of a numeral
HEADER_LINES = 10
COUNTS = "are the counts before it right?"
WHOLE = re.compile(r"[-+]?[0-9]{1,18}")
# How numbers are stored in a binary file, for `struct`: double precision numbers, and
# integers of two or four bytes.
STORED = {"n": "d", "s": "h", "l": "i"}


def whole(text: str) -> int:
    if not WHOLE.fullmatch(text):
        raise ValueError(text)
    return int(text)


class TextTokens:
    """The tokens of a text: words separated by blanks, without comments. The letter at
    the beginning of a word and what follows it are two tokens.
    """

    def __init__(self, text: str, constant: Constant) -> None:
        self._words: list[str] = []
        self._lines: list[int] = []
        for line, line_words in enumerate(
            (line.partition("#")[0].split() for line in text.split("\n")),
            HEADER_LINES + 1,
        ):
            self._words += line_words
            self._lines += [line] * len(line_words)
        # The index of the next word, and the part of the last one that follows its
        # letter.
        self._next, self._rest = 0, ""
        self._constant = constant

    def error(self, reason: str, hint: str = "") -> ProblemError:
        return ProblemError(
            f"line {self._lines[self._next - 1]}" if self._next else "", reason, hint
        )

    def code(self) -> str:
        """Return the letter with which a segment or a term of an expression begins; ""
        after the last one.
        """
        if self._next == len(self._words):
            return ""
        word = self._word()
        self._rest = word[1:]
        return word[0]

    def _word(self) -> str:
        if word := self._rest:
            self._rest = ""
            return word
        if self._next == len(self._words):
            raise self.error(ENDS_TOO_EARLY, CUT_OFF)
        self._next += 1
        return self._words[self._next - 1]

    def _as(self, convert: Callable[[str], Any], what: str) -> Any:
        word = self._word()
        try:
            return convert(word)
        except ValueError:
            raise self.error(f"has {quoted(word)} instead of {what}", COUNTS) from None

    def integer(self) -> int:
        return int(self._as(whole, "an integer"))

    # `letter` says how a binary file stores the number; in a text all are written
    # alike.
    def number(self, letter: str = "n") -> Any:  # noqa: ARG002
        return self._as(self._constant, "a number")

    kind = name = _word


class BinaryTokens:
    """The tokens of a binary file: letters, integers of four bytes, and double
    precision numbers.

    begin : the position of the first byte after the header.
    constant : returns the value of a numeral; numbers are passed to it as decimals.
    """

    def __init__(
        self, content: bytes, begin: int, order: str, constant: Constant
    ) -> None:
        self._content, self._next = content, begin
        self._order, self._constant = order, constant

    def error(self, reason: str, hint: str = "") -> ProblemError:
        return ProblemError(f"byte {self._next}", reason, hint)

    def _unpack(self, layout: str) -> Any:
        begin, stop = self._next, self._next + struct.calcsize(self._order + layout)
        self._next = min(stop, len(self._content))
        if self._next < stop:
            raise self.error(ENDS_TOO_EARLY, CUT_OFF)
        return struct.unpack_from(self._order + layout, self._content, begin)[0]

    def code(self) -> str:
        return self.kind() if self._next < len(self._content) else ""

    def integer(self) -> int:
        return int(self._unpack("i"))

    def number(self, letter: str = "n") -> Any:
        return self._constant(repr(float(self._unpack(STORED[letter]))))

    def kind(self) -> str:
        return bytes(self._unpack("c")).decode("latin-1")

    def name(self) -> str:
        return bytes(self._unpack(f"{max(self.integer(), 0)}s")).decode(
            "utf-8", "replace"
        )


Tokens: TypeAlias = "TextTokens | BinaryTokens"

PIECEWISE_LINEAR = 64
REFUSED = {
    "mod",
    "floor",
    "ceil",
    "div",
    "precision",
    "round",
    "trunc",
    "count",
    "numberof",
    "atleast",
    "atmost",
    "exactly",
    "not atleast",
    "not atmost",
    "not exactly",
    "alldiff",
    "if of texts",
}

# The name of each operator in AMPL, and its number of arguments; 0 if the file has it.
MEANINGS = {
    0: ("+", 2), 1: ("-", 2), 2: ("*", 2), 3: ("/", 2), 4: ("mod", 2), 5: ("^", 2),
    6: ("less", 2), 11: ("min", 0), 12: ("max", 0), 13: ("floor", 1), 14: ("ceil", 1),
    15: ("abs", 1), 16: ("negative", 1), 20: ("or", 2), 21: ("and", 2), 22: ("<", 2),
    23: ("<=", 2), 24: ("=", 2), 28: (">=", 2), 29: (">", 2), 30: ("!=", 2),
    34: ("not", 1), 35: ("if", 3), 37: ("tanh", 1), 38: ("tan", 1), 39: ("sqrt", 1),
    40: ("sinh", 1), 41: ("sin", 1), 42: ("log10", 1), 43: ("log", 1), 44: ("exp", 1),
    45: ("cosh", 1), 46: ("cos", 1), 47: ("atanh", 1), 48: ("atan2", 2),
    49: ("atan", 1), 50: ("asinh", 1), 51: ("asin", 1), 52: ("acosh", 1),
    53: ("acos", 1), 54: ("sum", 0), 55: ("div", 2), 56: ("precision", 2),
    57: ("round", 2), 58: ("trunc", 2), 59: ("count", 0), 60: ("numberof", 0),
    61: ("numberof", 0), 62: ("atleast", 2), 63: ("atmost", 2),
    PIECEWISE_LINEAR: ("<<>>", 0), 65: ("if of texts", 3), 66: ("exactly", 2),
    67: ("not atleast", 2), 68: ("not atmost", 2), 69: ("not exactly", 2),
    70: ("and", 0), 71: ("or", 0), 72: ("if", 3), 73: ("<==>", 2), 74: ("alldiff", 0),
    75: ("^", 2), 76: ("square", 1), 77: ("^", 2),
}  # fmt: skip


def names_from_sibling(path: str, variables: Sequence[str]) -> Sequence[str]:
    """Return the names of some variables of the model in a file, from the file .col
    with the same stem; their numbers if there is no such file.

    variables : "v" followed by the number of each variable, counted from 0.
    """
    names, numbers = _names(path, ".col"), [int(variable[1:]) for variable in variables]
    last = max(numbers, default=-1)
    reason = f"has {count(len(names), 'name')}, but {path} has the variable v{last}"
    refuse(
        names and last >= len(names),
        _sibling_file(path, ".col"),
        reason,
        "write both again",
    )
    return [names[number] for number in numbers] if names else variables


def with_names(path: str, fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a program with the names in the files .col and .row with the
    same stem, if there are any.
    """
    named = {"columns": list(names_from_sibling(path, fields["columns"]))}
    rows, names = fields.get("rows", []), _names(path, ".row")
    if rows and len(names) >= len(rows):  # names of objectives follow those of rows
        named["rows"] = names[: len(rows)]
    return {**fields, **named}


def named(path: str, error: ProblemError) -> ProblemError:
    return ProblemError(
        in_names(path, error.where), in_names(path, error.fault), error.hint
    )


def in_names(path: str, text: str) -> str:
    def name(match: re.Match[str]) -> str:
        names = _names(path, ".col" if match[1] == "v" else ".row")
        number = int(match[2])
        return names[number] if number < len(names) else match[0]

    return re.sub(r"\b([vC])(\d+)\b", name, text)


def _sibling_file(path: str, suffix: str) -> str:
    return f"{os.path.splitext(path.removesuffix('.gz'))[0]}{suffix}"


def _names(path: str, suffix: str) -> list[str]:
    sibling = _sibling_file(path, suffix)
    if path == STANDARD_INPUT or not os.path.isfile(sibling):
        return []
    text = within(sibling, decode, content_of(sibling, "write it again"))
    return [line.strip() for line in text.removesuffix("\n").split("\n")]


# A term of an expression: its letter, its value or operator, and its number of
# arguments.
Term = tuple[str, Any, int]
Linear = dict[int, Any]  # the coefficients of variables
Side = tuple[Any, Any]  # both bounds of a variable or of a row

OPTIONS = re.compile(r"[gb](\d+)((?:\s+-?\d+)*)(?:\s+([-+.\deE]+))?\s*$")
# How many counts each line of the header has at least, after the first line.
FEWEST = (5, 2, 2, 3, 3, 3, 2, 2, 5)
# Whether a lower and an upper bound are in the file, by the kind of the bounds.
SIDES = {"0": (1, 1), "1": (0, 1), "2": (1, 0), "3": (0, 0), "4": (1, 0)}


class Header(NamedTuple):
    """The header of a file, with the numbers of its variables, rows, entries of the
    Jacobian and common expressions."""

    # The numbers in the first line, which have to be repeated in the solution file.
    options: list[str]
    variables: int
    rows: int
    entries: int
    common: int
    order: str  # of bytes, as in `struct`; "" in a text


def segments_in(content: bytes, constant: Constant) -> Segments:
    *lines, rest = [*content.split(b"\n", HEADER_LINES), *[b""] * HEADER_LINES][
        : HEADER_LINES + 1
    ]
    header = _header(lines)
    if header.order:
        return Segments(
            header,
            BinaryTokens(content, len(content) - len(rest), header.order, constant),
        )
    return Segments(header, TextTokens(rest.decode("utf-8", "replace"), constant))


def _header(lines: list[bytes]) -> Header:
    first = OPTIONS.match(_line(lines[0]))
    if first is None:
        raise ProblemError(
            "line 1", "is not the beginning of an .nl file", "begin it with g3 or b3"
        )
    counts = list[list[int]]()
    for number, line, min_counts in zip(
        range(2, HEADER_LINES + 1), lines[1:], FEWEST, strict=True
    ):
        line_counts = list[int]()
        with suppress(ValueError):
            line_counts = list(map(whole, _line(line).split()))
        reason = f"has not the {min_counts} counts of the header"
        refuse(
            len(line_counts) < min_counts or min(line_counts) < 0,
            f"line {number}",
            reason,
            CUT_OFF,
        )
        counts.append([*line_counts, 0, 0])
    (n, m, *_), (integers, logical) = counts[0], (sum(counts[5]), counts[0][5])
    for number, noun in (
        (integers, "integer variable"),
        (logical, "logical constraint"),
    ):
        reason = f"has {count(number, noun)}"
        hint = "lcp solves complementarity problems of continuous variables"
        refuse(number, "", reason, hint)
    order = ""
    if not lines[0].startswith(b"g"):
        # The order of bytes: 2 means that the most significant one comes first.
        order = ">" if counts[4][2] == 2 else "<"
    options = [first[1], *first[2].split(), *filter(None, [first[3]])]
    return Header(options, n, m, counts[6][0], sum(counts[8]), order)


def _line(line: bytes) -> str:
    return line.decode("utf-8", "replace").partition("#")[0].strip()


class Segments:
    """The content of a file. Expressions are lists of terms, with operators before
    their arguments.
    """

    def __init__(self, header: Header, tokens: Tokens) -> None:
        self.header = header
        self._tokens = tokens
        self._entries = 0
        # The linear part and the nonlinear expression of each common expression.
        self.common = dict[int, tuple[Linear, list[Term]]]()
        # The nonlinear expression and the linear part of each row.
        self.rows, self.linear = dict[int, list[Term]](), dict[int, Linear]()
        # Whether each objective is maximized, and its nonlinear expression.
        self.objectives = dict[int, tuple[int, list[Term]]]()
        self.slopes = dict[int, Linear]()  # the linear parts of the objectives
        self.sides, self.bounds = list[Side](), list[Side]()  # of rows and of variables
        # For each complementing variable its row, and which bounds the condition has.
        self.complements = dict[int, tuple[int, int]]()
        self.start = Linear()  # values of variables
        while code := tokens.code():
            self._read(code)
        self._refuse_incomplete()

    @property
    def has_objective(self) -> bool:
        """Return whether there is an objective that is not constant."""
        expressions = [terms for _, terms in self.objectives.values()]
        return any(self.slopes.values()) or any(
            letter == "v" for terms in expressions for letter, *_ in terms
        )

    @property
    def auxiliary(self) -> set[int]:
        """Return the variables without bounds and without a row that are the whole
        function of a row which complements another variable. A modeling language has
        introduced these for expressions in conditions, as Pyomo's .bv.
        """
        rows = (row for row, _ in self.complements.values())
        single = set[int]()
        for row in rows:
            variables = self.linear.get(row, {}).keys()
            is_linear = all(letter != "v" for letter, *_ in self.rows[row])
            if is_linear and len(variables) == 1:
                single.update(variables)
        return {
            variable
            for variable in single - self.complements.keys()
            if self.bounds[variable] == (None, None)
        }

    def _read(self, code: str) -> None:
        tokens = self._tokens
        header = self.header
        integer = self._tokens.integer
        if code == "C":
            number = self._index(header.rows, "row")
            self.rows[number] = self._expression()
        elif code == "J":
            number = self._index(header.rows, "row")
            self.linear[number] = self._linear(integer())
            self._entries += len(self.linear[number])
        elif code == "O":
            number = self._index(inf, "objective")
            self.objectives[number] = integer(), self._expression()
        elif code == "G":
            number = self._index(inf, "objective")
            self.slopes[number] = self._linear(integer())
        elif code == "V":
            number = self._index(header.common, "common expression", header.variables)
            size, _ = integer(), integer()
            self.common[number] = self._linear(size), self._expression()
        elif code == "x":
            self.start = self._linear(integer())
        elif code == "r":
            self.sides = [self._side(i) for i in range(header.rows)]
        elif code == "b":
            self.bounds = [self._side(None) for _ in range(header.variables)]
        elif code in "dkK":
            for _ in range(integer()):
                integer(), (code == "d" and tokens.number())
        elif code == "S":
            kind = integer()
            size = integer()
            _ = tokens.name()
            for _ in range(size):
                integer(), (tokens.number() if kind & 4 else integer())  # floating
        elif code == "F":
            integer(), integer(), integer()
            reason = f"imports the function {quoted(tokens.name())}"
            raise tokens.error(reason, "write it with the operators of AMPL")
        else:
            raise tokens.error(f"has {quoted(code)} instead of a segment", COUNTS)

    def _index(self, size: float, noun: str, first: int = 0) -> int:
        if not 0 <= (number := self._tokens.integer() - first) < size:
            raise self._tokens.error(
                f"names {noun} {number}, counted from 0, of {size}", COUNTS
            )
        return number

    def _linear(self, size: int) -> Linear:
        tokens, coefficients = self._tokens, Linear()
        for _ in range(size):
            number = self._index(self.header.variables, "variable")
            if number in coefficients:
                raise tokens.error(
                    f"gives variable {number} a second coefficient here", KEEP_ONE
                )
            coefficients[number] = tokens.number()
        return coefficients

    def _side(self, row: int | None) -> Side:
        """Return both bounds of the next variable, or of a row, which may complement a
        variable instead."""
        tokens = self._tokens
        kind = tokens.kind()
        if kind == "5" and row is not None:
            bounds = tokens.integer()
            variable = self._index(self.header.variables, "variable", 1)
            other, _ = self.complements.setdefault(variable, (row, bounds))
            reason = f"complements v{variable}, and so does C{other}"
            refuse(other != row, f"C{row}", reason, "give each row another variable")
            return 0, 0
        if kind not in SIDES:
            raise tokens.error(
                f"has {quoted(kind)} instead of the kind of a bound",
                "the kinds are 0 to 5",
            )
        low, high = (
            tokens.number() if has_number else None for has_number in SIDES[kind]
        )
        return (low, low) if kind == "4" else (low, high)

    def _expression(self) -> list[Term]:
        tokens, n = self._tokens, self.header.variables
        terms, open_terms = list[Term](), 1
        while open_terms:
            letter, size = tokens.code(), 0
            value: Any
            if letter == "o":
                value = tokens.integer()
                size = self._arguments(value)
                if value == PIECEWISE_LINEAR:
                    value = tuple(
                        self._constant(tokens.code()) for _ in range(2 * size - 1)
                    )
                    letter, size = "p", 1
            elif letter == "v":
                value = tokens.integer()
                if not 0 <= value < n and value - n not in self.common:
                    raise tokens.error(
                        f"names v{value}, which is not defined before it", COUNTS
                    )
            elif letter in ("f", "h"):
                raise tokens.error(
                    "has an imported function or a text",
                    "write it with the operators of AMPL",
                )
            else:
                value = self._constant(letter, "an expression")
            terms.append((letter, value, size))
            open_terms += size - 1
        return terms

    def _constant(self, letter: str, what: str = "a number") -> Any:
        if letter not in STORED:
            reason = f"has {quoted(letter)} instead of {what}"
            raise self._tokens.error(reason if letter else ENDS_TOO_EARLY, CUT_OFF)
        return self._tokens.number(letter)

    def _arguments(self, operator: int) -> int:
        if operator not in MEANINGS:
            raise self._tokens.error(f"has the unknown operator o{operator}", COUNTS)
        name, size = MEANINGS[operator]
        if name in REFUSED:
            hint = "functions that jump are not solved; write the model without it"
            raise self._tokens.error(f"has the operator {name} (o{operator})", hint)
        if size:
            return size
        size = self._tokens.integer()
        if size < 1:
            raise self._tokens.error(
                f"gives {name} (o{operator}) {count(size, 'argument')}", COUNTS
            )
        return size

    def _refuse_incomplete(self) -> None:
        header, both = self.header, len(self.slopes.keys() & self.objectives.keys())
        for what, number, declared in (
            ("expressions of rows (C)", len(self.rows), header.rows),
            ("row sides (r)", len(self.sides), header.rows),
            ("bounds of variables (b)", len(self.bounds), header.variables),
            ("entries of rows (J)", self._entries, header.entries),
            ("common expressions (V)", len(self.common), header.common),
            (
                "expressions of objectives (O) with linear parts (G)",
                both,
                len(self.slopes),
            ),
        ):
            refuse(
                number != declared,
                "",
                f"has {number} {what}, but its header says {declared}",
                CUT_OFF,
            )
