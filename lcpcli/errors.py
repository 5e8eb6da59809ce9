"""The exit codes of runs, and the errors for invalid input: one line that says where
the error is, what is wrong, and how to fix it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from enum import IntEnum
from typing import Any, TypeAlias


class Exit(IntEnum):
    """The result of a run: its exit code, and what that means in help, unless a command
    has another meaning for it."""

    meaning: str

    def __new__(cls, code: int, meaning: str) -> Exit:
        made = int.__new__(cls, code)
        made._value_, made.meaning = code, meaning
        return made

    SOLVED = 0, "solved"
    NOT_SOLVED = 1, "not solved"
    BAD_INPUT = 2, "usage or input error (one-line message)"
    NO_SOLUTION = 3, "proved to have no solution"
    INTERRUPTED = (
        130,
        "interrupted; partial results are reported",
    )  # as shells do SIGINT
    TERMINATED = 143, "the same after SIGTERM"
    CLOSED_PIPE = 141, "the reader of a pipe has closed it"  # SIGPIPE


# The exit codes of the commands that solve problems, with their meanings.
EXITS: dict[Exit, str] = {
    code: code.meaning for code in Exit if code is not Exit.CLOSED_PIPE
}
# A longer text is cut off after this many characters in a message, which has one line.
LONGEST_QUOTE = 40
LONGEST_LOCATION = 200  # characters of a path that is repeated whole
UMLAUTS = {
    ord(letter): ascii
    for letter, ascii in {"ä": "ae", "ö": "oe", "ü": "ue", "é": "e", "ú": "u"}.items()
}
SHORTEST_WORD = 5  # letters that a word must have to be searched for in meanings
# What version 2.0.0 has removed, as users write it, with what to write instead.
GONE = {
    "--vary": "use --sweep, with -o table.csv or --plot figure.svg",
}
HAS_GONE = "has been removed in version 2.0.0"
# Faults and hints that several modules word in the same way.
NO_SUCH_FILE = "no such file"
IS_DIRECTORY = "is a directory"
IS_MISSING = "is missing"
IS_EMPTY = "is empty"
ENDS_TOO_EARLY = "ends too early"
CUT_OFF = "is it cut off?"
LEAVE_OUT = "leave it out"
LEAVE_ONE_OUT = "leave one out"
KEEP_ONE = "keep one"
CORRECT_THERE = "correct it there"
MAKE_AGREE = "make them agree"
NAME_FILE = "name a file"
OTHER_OUTPUT = "choose another file for the output"
GIVE_NUMBER = "give a number"
GIVE_FINITE = "give a finite number"
GIVE_TEXT = "give a text"
ONE_ROW = "give one row or one column"
ROW_OF_NUMBERS = "give one row or one column of numbers"
ONE_VARIABLE = "give a program with at least one variable"
REAL = "give real numbers; lcp solves real problems only"
SCALE_PAYOFFS = "scale the payoffs"
# The fault and the hint for an empty entry of a list with commas.
EMPTY_ENTRY = (
    "lacks an entry before or behind a comma",
    "write the entry, or remove the comma",
)
# Characters that control a terminal, that terminate a line or change its direction, and
# that occur in no text: surrogates and noncharacters.
_LAST = "".join(
    map(
        chr,
        (
            plane + last
            for plane in range(0, 0x110000, 0x10000)
            for last in (0xFFFE, 0xFFFF)
        ),
    )
)
UNSEEN = re.compile(
    f"[\0-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufdd0-\ufdef{_LAST}]"
)
# The distributions of modules that have other names.
DISTRIBUTIONS = {"flint": "python-flint"}
# Words with at least this similarity, by difflib, differ by a letter or two. They are
# suggested before words with a common beginning.
VERY_CLOSE = 0.85
# Characters of a known word with which an unknown word begins; fewer match by chance.
SHORTEST_BEGINNING = 3
# Between the lengths of words of which one may be a slip for the other: cost is none
# for constant.
LARGEST_DIFFERENCE = 2


def visible(text: str) -> str:
    r"""Return a text for people as one line: characters that control a terminal, that
    break lines or change their direction, or that occur in no text, become escapes as
    in Python, such as \x1b or \n. All others stay, including the backslash.
    """
    if text.isprintable():  # most texts are, and this is faster than the search
        return text
    return UNSEEN.sub(lambda match: repr(match[0])[1:-1], text)


def visible_json(text: str) -> str:
    """Return a line of JSON with escapes, as JSON has them, for the same characters."""
    from json import dumps

    if text.isprintable():
        return text
    return UNSEEN.sub(lambda match: dumps(match[0])[1:-1], text)


def quoted(text: str) -> str:
    """Return a text in quotes for a message: on one line, truncated if it is long."""
    return repr(text if len(text) <= LONGEST_QUOTE else text[:LONGEST_QUOTE] + "...")


def shortened(location: str) -> str:
    """Return a location for a message: its beginning and its end if it is longer than
    paths of files usually are."""
    if len(location) <= LONGEST_LOCATION:
        return location
    return f"{location[:LONGEST_QUOTE]}...{location[-LONGEST_QUOTE:]}"


def unknown(value: object) -> str:
    """Return the fault of a word, or of another value, that is none of the valid
    ones.
    """
    return f"{quoted(value) if isinstance(value, str) else repr(value)} is unknown"


def out_of_range(value: object) -> str:
    """Return the fault of a value that is not in its range."""
    return f"{value} is out of range"


def numbers_for(n: int, noun: str, m: int, other: str) -> str:
    """Return the fault of n things where m others need one each, such as "has 1 entry
    for 2 unknowns".
    """
    return f"has {count(n, noun)} for {count(m, other)}"


def likely(user_word: str, valid_names: Iterable[str], otherwise: str = "") -> str:
    """Return the hint for an unknown word: the valid name that was probably meant; if
    none resembles it, `otherwise` or all valid names.
    """
    valid_names = tuple(valid_names)
    close = nearest(user_word, valid_names)
    return (
        f"did you mean {close}?"
        if close
        else otherwise or f"choose one of {', '.join(valid_names)}"
    )


def folded(text: str) -> str:
    return text.casefold().translate(UMLAUTS)


def meant(user_word: str, meanings: Mapping[str, str]) -> str:
    """Return the hint for an unknown word that occurs in the meaning of just one name,
    such as the name of an author; "" if there is no such name.
    """
    folded_word = folded(user_word).replace("-", " ")
    matches = [
        name for name, meaning in meanings.items() if folded_word in folded(meaning)
    ]
    return (
        f"did you mean {matches[0]}?"
        if len(folded_word) >= SHORTEST_WORD and len(matches) == 1
        else ""
    )


def nearest(user_word: str, valid_names: tuple[str, ...]) -> str | None:
    """Return the valid name that begins with the unknown word, or with which the word
    begins, or which resembles it; None if there is none.
    """
    from difflib import get_close_matches

    folded_word = user_word.casefold()
    # A single letter begins many names, and tells nothing unless it is one of them.
    if len(folded_word) < 2:
        return folded_word if folded_word and folded_word in valid_names else None
    begun = [word for word in valid_names if word.startswith(folded_word)]
    begun += get_close_matches(folded_word, valid_names, n=1, cutoff=VERY_CLOSE)
    begun += [word for word in valid_names if _is_stem(word, folded_word)]
    if begun:
        return begun[0]
    similar = (
        word
        for word in get_close_matches(folded_word, valid_names)
        if abs(len(word) - len(folded_word)) <= LARGEST_DIFFERENCE
    )
    return next(similar, None)


def _is_stem(word: str, longer: str) -> bool:
    """Return whether a longer word begins with this one, as tolerance with tol; min and
    max, which mean bounds, are no beginnings of minimize or maximum."""
    return (
        longer.startswith(word)
        and len(word.lstrip("-")) >= SHORTEST_BEGINNING
        and word not in ("min", "max")
    )


def refuse_unknown(
    field: str,
    keys: Iterable[str],
    valid_names: Sequence[str],
    subject: str = "a problem",
) -> None:
    """Raise ProblemError for the first unknown key, with a likely one."""
    fault = unknown_key(field, keys, valid_names, subject, {})
    if fault is not None:
        raise ProblemError(*fault)


def unknown_key(
    field: str,
    keys: Iterable[str],
    valid_names: Sequence[str],
    subject: str,
    meant: Mapping[str, str],
) -> tuple[str, str, str] | None:
    """Return the arguments of the error for the first unknown key, as `refuse_unknown`
    raises it; None if all keys are known. meant : other words for known ones."""
    key = next((key for key in keys if key not in valid_names), None)
    if key is None:
        return None
    folded = {name.casefold(): name for name in valid_names} | dict(meant)
    shown = key if len(key) <= LONGEST_QUOTE else f"{key[:LONGEST_QUOTE]}..."
    close = nearest(key, tuple(folded))
    hint = (
        f"did you mean {folded[close]}?"
        if close
        else f"the keys are {', '.join(valid_names)}"
    )
    where = f"{field}.{shown}" if field else shown
    return where, f"is not a key of {subject}", hint


class File(str):
    """The name of a file as the location of an error. Records contain it separately."""


Where: TypeAlias = "str | tuple[str, ...]"


class LCPError(ValueError):
    """Base class of all errors that this package raises deliberately.

    where : the field, option or `File` at fault, as the user wrote it, or several of
        these, such as the file and the field in it; "" if there is none.
    fault : what is wrong, as a clause without a full stop.
    hint : how to fix it, as an imperative clause without a full stop; "" if the fault
        makes it obvious.
    """

    code = Exit.BAD_INPUT  # of the run that it stops

    def __init__(self, where: Where, fault: str, hint: str = "") -> None:
        self.parts = (where,) if isinstance(where, str) else where
        self.fault, self.hint = fault, hint
        super().__init__(self.parts, fault, hint)

    def __str__(self) -> str:
        clauses = "; ".join(filter(None, (self.fault, self.hint)))
        shown = map(shortened, self.parts)
        return visible(": ".join(filter(None, (*shown, clauses))))

    @property
    def where(self) -> str:
        return ": ".join(filter(None, self.parts))

    @property
    def file(self) -> str | None:
        for part in self.parts:
            if isinstance(part, File):
                return part
        return None

    def inside(self, outer_place: Where) -> LCPError:
        """Return this error with its location described from one level further out,
        such as the file with the field."""
        outer = (outer_place,) if isinstance(outer_place, str) else outer_place
        return type(self)((*outer, *self.parts), self.fault, self.hint)


class ProblemError(LCPError):
    """The problem, or the file that holds it, cannot be used."""


class MissingFolderError(ProblemError, ImportError):
    """The folder of a formulation, which a file or a name of the package needs, is
    missing in this installation."""


class EmptyIntervalError(ProblemError):
    """No number lies between a lower and an upper bound of the problem."""


class DerivativeError(LCPError):
    """A result has no derivative, or no known one: its problem is not solved, or its
    solution is singular."""


class OptionError(LCPError):
    """The value of an option is out of range, or the option has no effect on the
    request."""


class ResourceError(LCPError):
    """The machine has not enough space, processes or open files for the work, which is
    sound: it may succeed elsewhere or later."""

    code = Exit.NOT_SOLVED


class ParameterError(OptionError):
    """An OptionError whose `where` is a name as in Python; the command line shows it as
    its flag."""


def count(n: int, noun: str) -> str:
    """Return a number with its noun: "1 entry", "3 entries"."""
    plural = noun[:-1] + "ies" if noun.endswith("y") else noun + "s"
    return f"{n} {noun if n == 1 else plural}"


def listed(words: Iterable[str], joint: str = "and") -> str:
    """Return words in a sentence: "a", "a and b", "a, b and c"."""
    *others, last = words
    return f"{', '.join(others)} {joint} {last}" if others else last


def kind(value: Any) -> str:
    """Return the type of a value in words that authors of files know: a list, an
    object.
    """
    if type(value).__name__ in ("bool", "bool_"):  # also numpy's
        return str(value).lower()
    if isinstance(value, str):
        return f"the text {quoted(value)}"
    if hasattr(value, "numerator"):
        return "a number"
    names = {
        type(None): "null",
        dict: "an object",
        list: "a list",
        tuple: "a list",
        float: "a number",
    }
    return names.get(type(value), f"of type {type(value).__name__}")


def missing(*modules: str) -> tuple[str, str]:
    """Return the fault and the hint for modules that are not installed. The hint names
    packages of the index, not an extra of this package, which is not on the index.
    """
    packages = dict.fromkeys(module.partition(".")[0] for module in modules)
    names = [DISTRIBUTIONS.get(package, package) for package in packages]
    return f"needs {listed(names)}", f"pip install {' '.join(names)}"


def raised(error: BaseException) -> str:
    """Return an exception of another package's code in words, with the file and the
    line that have raised it."""
    from traceback import extract_tb

    position = "".join(
        f" ({frame.filename}, line {frame.lineno})"
        for frame in extract_tb(error.__traceback__)[-1:]
    )
    return f"{type(error).__name__}: {error}{position}"
