"""Tables of refusals: what goes in, and the line that comes out.

A table is a text with rows INPUT => PLACE: FAULT; HINT. A row goes on in lines that are
indented, and an input in the next line after a backslash. A wording that several rows
have stands in `wordings`, and in the rows by its name in braces, with its values, as in
{ENTRIES:1 entry|2 unknowns}.

Inputs have the escapes of printf %b, such as \\n and \\xff. Before a command stand
lines CONTENT > FILE with the files that it meets, and CONTENT | before it in its line
is its standard input.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.sparse import csr_array

import lcpcli
from lcpcli.errors import EmptyIntervalError

from . import wordings

# What is in a folder: a file with its content, a folder (None), or a link to a path.
Files = Mapping[str, "str | bytes | Path | None"]


class Refusal(NamedTuple):
    """A command line, the files that it meets, "-" for standard input, and the line
    with which it is refused; or a call and its error."""

    command: str
    files: Files
    line: str

    def __str__(self):
        content = [held for held in self.files.values() if isinstance(held, str)][-1:]
        return " < ".join([self.command, *content])[:60]


def commands(table, files=None):
    """The refusals of command lines. files : that all of them meet."""
    made = []
    for given, line in rows(table):
        *others, command = given
        pairs = (each.rsplit(" > ", 1) for each in others)
        own = {name: decoded(content) for content, name in pairs}
        before, bar, behind = command.rpartition(" | ")
        own |= {"-": decoded(before)} if bar else {}
        made.append(Refusal(behind, {**(files or {}), **own}, line))
    return made


def contents(name, table, made=lambda content: content, command="solve {}", files=None):
    """The refusals of a command for contents of the file of that name, in which the
    places are. made : makes a content of the input of a row. files : that are there
    too."""
    return [
        Refusal(
            command.format(name),
            {**(files or {}), name: made(decoded("\n".join(given)))},
            f"{name}: {line}",
        )
        for given, line in rows(table)
    ]


def calls(error, table, *forms):
    """The refusals of calls, which raise this error. forms : with a brace in the place
    of what a row has, each of which is a call; the row itself without them."""
    return [
        Refusal(form.format(given[0]), {}, f"{error}: {line}")
        for given, line in rows(table)
        for form in forms or ("{}",)
    ]


def raised(call, names):
    """The error that a call raises, in which these names may stand, those of the
    package, and a few more."""
    known = {name: getattr(lcpcli, name) for name in lcpcli.__all__}
    known |= {"np": np, "inf": np.inf, "nan": np.nan, "csr_array": csr_array}
    with pytest.raises(Exception) as error:  # noqa: PT011
        eval(call, {**known, **names})
    is_empty = error.type is EmptyIntervalError  # a ProblemError to those who catch it
    return f"{'ProblemError' if is_empty else error.type.__name__}: {error.value}"


def rows(table):
    """Yield the lines of the input of each row, and what is said of it."""
    given = []
    whole = re.sub(r"\n {4}", " ", table.strip("\n").replace("\\\n", ""))
    for row in whole.split("\n"):
        own, sign, said = row.partition("=> ")
        given.append(own.removesuffix(" ") if sign else row)
        if sign:
            yield given, whole_wordings(said)
            given = []


# A name in braces, with values, which may have names among them, or braces in quotes.
NAMED = re.compile(r"\{([A-Z]\w*)(?::((?:\{\w+(?::[^{}]*)?\}|'[^'|]*'|[^{}])*))?\}")


def whole_wordings(text):
    """A text with its wordings written out."""

    def whole(named):
        name, values = named.groups()
        wording = getattr(wordings, name)
        if values is None:
            return wording
        return wording.format(*whole_wordings(values).split("|"))

    return NAMED.sub(whole, text)


def decoded(text):
    """What printf %b makes of a text: a text, or bytes where it is none."""
    content = text.encode().decode("unicode_escape").encode("latin-1")
    try:
        return content.decode()
    except UnicodeDecodeError:
        return content


def changed(text, changes):
    """A text with changes, each OLD -> NEW, one after the other."""
    for change in changes.split(" and "):
        old, new = change.split(" -> ")
        assert text.count(old) >= 1, old
        text = text.replace(old, new, 1)
    return text
