"""The tokens of AMPL's .nl files, in text or in binary, in the order in which they are read (D. M. Gay, "Writing .nl
files", 2005).

The operators in expressions of AMPL's .nl files, by number (D. M. Gay, "Writing .nl files", 2005, table 5).

The names of the variables and rows of an .nl model, from the files .col and .row beside it.
"""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from lcpcli.errors import ProblemError, count, quoted
from lcpcli.files.contents import STANDARD_INPUT, content_of, decode, within

Constant = Callable[[str], Any]  # returns the number that a text stands for
HEADER_LINES = 10
CUT_OFF, COUNTS = "is it cut off?", "are the counts before it right?"
WHOLE = re.compile(r"[-+]?[0-9]{1,18}")
STORED = {"n": "d", "s": "h", "l": "i"}  # the numbers in a binary file: doubles, and integers of two or four bytes


def whole(text: str) -> int:
    """Return the integer that a text of at most 18 digits stands for, more than any count or index has; raise
    ValueError for another text."""
    if not WHOLE.fullmatch(text):
        raise ValueError(text)
    return int(text)


class TextTokens:
    """The tokens of a text: words between blanks, without comments. A letter and what follows it are two tokens."""

    def __init__(self, text: str, constant: Constant) -> None:
        self._words: list[str] = []
        self._lines: list[int] = []
        for line, words in enumerate((line.partition("#")[0].split() for line in text.split("\n")), HEADER_LINES + 1):
            self._words += words
            self._lines += [line] * len(words)
        self._next, self._rest = 0, ""  # the next word, and what is left of the last one behind its letter
        self._constant = constant

    def error(self, fault: str, hint: str = "") -> ProblemError:
        """Return the error at the token that was read last."""
        return ProblemError(f"line {self._lines[self._next - 1]}" if self._next else "", fault, hint)

    def code(self) -> str:
        """Return the letter with which a segment or a term of an expression begins; "" at the end of the file."""
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
            raise self.error("ends too early", CUT_OFF)
        self._next += 1
        return self._words[self._next - 1]

    def integer(self) -> int:
        word = self._word()
        try:
            return whole(word)
        except ValueError:
            raise self.error(f"has {quoted(word)} in place of a whole number", COUNTS) from None

    def number(self, letter: str = "n") -> Any:  # noqa: ARG002 (all are written alike)
        """Return a number; `letter` says how a binary file stores it where it is a term of an expression."""
        word = self._word()
        try:
            return self._constant(word)
        except ValueError:
            raise self.error(f"has {quoted(word)} in place of a number", COUNTS) from None

    def kind(self) -> str:
        """Return the digit for the kind of a bound."""
        return self._word()

    def name(self) -> str:
        return self._word()


class BinaryTokens:
    """The tokens of a binary file: letters, integers of four bytes, and doubles.

    begin : the first byte behind the header. constant : returns the number for the decimals of a double.
    """

    def __init__(self, content: bytes, begin: int, order: str, constant: Constant) -> None:
        self._content, self._next, self._order, self._constant = content, begin, order, constant

    def error(self, fault: str, hint: str = "") -> ProblemError:
        return ProblemError(f"byte {self._next}", fault, hint)

    def _unpack(self, form: str) -> Any:
        begin, self._next = self._next, self._next + struct.calcsize(self._order + form)
        if self._next > len(self._content):
            self._next = len(self._content)
            raise self.error("ends too early", CUT_OFF)
        return struct.unpack_from(self._order + form, self._content, begin)[0]

    def code(self) -> str:
        return self.kind() if self._next < len(self._content) else ""

    def integer(self) -> int:
        return int(self._unpack("i"))

    def number(self, letter: str = "n") -> Any:
        return self._constant(repr(float(self._unpack(STORED[letter]))))

    def kind(self) -> str:
        return bytes(self._unpack("c")).decode("latin-1")

    def name(self) -> str:
        return bytes(self._unpack(f"{max(self.integer(), 0)}s")).decode("utf-8", "replace")


Tokens: TypeAlias = "TextTokens | BinaryTokens"

PIECEWISE_LINEAR = 64
REFUSED = {"mod", "floor", "ceil", "div", "precision", "round", "trunc", "count", "numberof", "atleast", "atmost"}
REFUSED |= {"exactly", "not atleast", "not atmost", "not exactly", "alldiff", "if of texts"}

# The name in AMPL, and the number of arguments, 0 if it is in the file.
MEANINGS = {
    0: ("+", 2), 1: ("-", 2), 2: ("*", 2), 3: ("/", 2), 4: ("mod", 2), 5: ("^", 2), 6: ("less", 2), 11: ("min", 0),
    12: ("max", 0), 13: ("floor", 1), 14: ("ceil", 1), 15: ("abs", 1), 16: ("negative", 1), 20: ("or", 2),
    21: ("and", 2), 22: ("<", 2), 23: ("<=", 2), 24: ("=", 2), 28: (">=", 2), 29: (">", 2), 30: ("!=", 2),
    34: ("not", 1), 35: ("if", 3), 37: ("tanh", 1), 38: ("tan", 1), 39: ("sqrt", 1), 40: ("sinh", 1), 41: ("sin", 1),
    42: ("log10", 1), 43: ("log", 1), 44: ("exp", 1), 45: ("cosh", 1), 46: ("cos", 1), 47: ("atanh", 1),
    48: ("atan2", 2), 49: ("atan", 1), 50: ("asinh", 1), 51: ("asin", 1), 52: ("acosh", 1), 53: ("acos", 1),
    54: ("sum", 0), 55: ("div", 2), 56: ("precision", 2), 57: ("round", 2), 58: ("trunc", 2), 59: ("count", 0),
    60: ("numberof", 0), 61: ("numberof", 0), 62: ("atleast", 2), 63: ("atmost", 2), PIECEWISE_LINEAR: ("<<>>", 0),
    65: ("if of texts", 3), 66: ("exactly", 2), 67: ("not atleast", 2), 68: ("not atmost", 2), 69: ("not exactly", 2),
    70: ("and", 0), 71: ("or", 0), 72: ("if", 3), 73: ("<==>", 2), 74: ("alldiff", 0), 75: ("^", 2), 76: ("square", 1),
    77: ("^", 2),
}  # fmt: skip


def names_beside(path: str, variables: Sequence[str]) -> Sequence[str]:
    """Return the names of some variables of the model in a file, which are given by v and their numbers from 0."""
    names, numbers = _names(path, ".col"), [int(variable[1:]) for variable in variables]
    if names and max(numbers, default=-1) >= len(names):
        fault = f"has {count(len(names), 'name')}, but {path} has the variable v{max(numbers)}"
        raise ProblemError(_beside(path, ".col"), fault, "write both again")
    return [names[number] for number in numbers] if names else variables


def named(path: str, error: ProblemError) -> ProblemError:
    """Return an error with the names of the variables and the rows in it, where there are names."""
    return ProblemError(in_names(path, error.where), in_names(path, error.fault), error.hint)


def in_names(path: str, text: str) -> str:
    """Return a text with the names of the variables and the rows in it, where there are names."""

    def name(found: re.Match[str]) -> str:
        names, number = _names(path, ".col" if found[1] == "v" else ".row"), int(found[2])
        return names[number] if number < len(names) else found[0]

    return re.sub(r"\b([vC])(\d+)\b", name, text)


def _beside(path: str, suffix: str) -> str:
    return f"{os.path.splitext(path.removesuffix('.gz'))[0]}{suffix}"


def _names(path: str, suffix: str) -> list[str]:
    beside = _beside(path, suffix)
    if path == STANDARD_INPUT or not os.path.isfile(beside):
        return []
    text = within(beside, decode, content_of(beside, "write it again"))
    return [line.strip() for line in text.removesuffix("\n").split("\n")]
