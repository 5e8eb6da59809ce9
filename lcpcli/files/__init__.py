"""Problems in files: which format a file has, and how its bytes become text. One format, one module."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import TypeVar

from lcpcli.errors import ProblemError
from lcpcli.files import csv_format, json_format
from lcpcli.files.whole import refuse_unwritable as refuse_unwritable
from lcpcli.files.whole import write_whole as write_whole
from lcpcli.problem import Problem
from lcpcli.typing import Vector

STANDARD_INPUT = "-"
FORMATS = {".json": json_format, ".csv": csv_format}

T = TypeVar("T")


def read(path: str | os.PathLike[str], q_path: str | os.PathLike[str] | None = None) -> Problem:
    """The problem in a JSON or CSV file, or M and q in two CSV files; "-" is standard input.

    A file called .json and any text that opens a brace or a bracket is JSON, everything else CSV. Raises ProblemError,
    which names the file, the field or line, and the mend.
    """
    path, q_path = os.fspath(path), None if q_path is None else os.fspath(q_path)
    text = _read_text(path, "give M and q, as JSON or CSV")
    if path.endswith(".json") or text.lstrip().startswith(("{", "[")):
        if q_path is not None:
            raise ProblemError(q_path, f"is not needed: {_place(path)} is JSON and holds q", "leave it out")
        problem = _blaming(path, lambda: json_format.parse(text))
    else:
        M, q = _blaming(path, lambda: csv_format.parse(text, alone=q_path is None))
        if q_path is not None:
            q = read_vector("q", q_path)
        problem = _blaming(path, lambda: Problem(M, q))
    return (
        problem if problem.name else replace(problem, name=Path(path).stem if path != STANDARD_INPUT else _place(path))
    )


def read_vector(field: str, path: str, n: int | None = None) -> Vector:
    """A vector of length n, any length if None, from a CSV file of one row or one column, or from a JSON list."""
    text = _read_text(path, "give one row or one column of numbers")
    parse = json_format.parse_vector if text.lstrip().startswith(("[", "{")) else csv_format.parse_vector
    return _blaming(path, lambda: parse(field, text, n))


def write(problem: Problem, path: str | os.PathLike[str]) -> None:
    """Write a problem in the format that the file's name ends with, whole or not at all."""
    form = FORMATS.get(Path(path).suffix)
    if form is None:
        raise ProblemError(str(path), "has no format by its name", f"let it end with {' or '.join(FORMATS)}")
    write_whole(os.fspath(path), form.render(problem))


def _blaming(path: str, parse: Callable[[], T]) -> T:
    """What parse returns; a ProblemError that comes out of it is made to name the file."""
    try:
        return parse()
    except ProblemError as error:
        raise error.inside(_place(path)) from None


def _place(path: str) -> str:
    """What a path is called in messages."""
    return "standard input" if path == STANDARD_INPUT else path


def _read_text(path: str, expected: str) -> str:
    """The text of a file; `expected` is the mend for an empty one."""
    place = _place(path)
    try:
        text = _read_bytes(path).decode("utf-8-sig")
    except FileNotFoundError:
        raise ProblemError(place, "no such file", _likely_file(path)) from None
    except IsADirectoryError:
        raise ProblemError(place, "is a directory", "name a file in it") from None
    except OSError as error:
        raise ProblemError(place, f"cannot be read ({error.strerror})", "make it readable") from None
    except UnicodeDecodeError:
        raise ProblemError(place, "is not UTF-8 text", "save it as UTF-8") from None
    if "\0" in text:
        raise ProblemError(place, "is not UTF-8 text", "save it as UTF-8")
    if not text.strip():
        raise ProblemError(place, "is empty", expected)
    return text


def _read_bytes(path: str) -> bytes:
    if not path:
        raise ProblemError("", "the name of a file is empty", "name a file")
    if path != STANDARD_INPUT:
        return Path(path).read_bytes()
    if sys.stdin is None:
        raise ProblemError(_place(path), "is closed", "name a file")
    return sys.stdin.buffer.read()


def _likely_file(path: str) -> str:
    folder = Path(path).parent
    if not folder.is_dir():
        return f"there is no folder {folder}"
    try:
        names = [entry.name for entry in folder.iterdir()]
    except OSError:
        names = []
    close = get_close_matches(Path(path).name, names, n=1, cutoff=0.75)
    return f"did you mean {folder / close[0]}?" if close else "check the path"
