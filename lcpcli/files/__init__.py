"""Problems in files: which format a file has, and how its bytes become text. One format, one module."""

from __future__ import annotations

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


def read(path: str, q_path: str | None = None) -> Problem:
    """The problem in a JSON or CSV file, or M and q in two CSV files; "-" is standard input.

    A file called .json and any text that opens a brace is JSON, everything else CSV. Raises ProblemError, which names
    the file, the field or line, and the mend.
    """
    text = _read_text(path)
    if path.endswith(".json") or text.lstrip().startswith("{"):
        if q_path is not None:
            raise ProblemError(q_path, f"is not needed: {path} is JSON and holds q", "leave it out")
        problem = _blaming(path, lambda: json_format.parse(text))
    else:
        M, q = _blaming(path, lambda: csv_format.parse(text, alone=q_path is None))
        if q_path is not None:
            q = read_vector("q", q_path)
        problem = _blaming(path, lambda: Problem(M, q))
    return (
        problem
        if problem.name
        else replace(problem, name=Path(path).stem if path != STANDARD_INPUT else "standard input")
    )


def read_vector(field: str, path: str) -> Vector:
    """A vector from a CSV file of one row or one column, or from a JSON list."""
    text = _read_text(path)
    parse = json_format.parse_vector if text.lstrip().startswith("[") else csv_format.parse_vector
    return _blaming(path, lambda: parse(field, text))


def write(problem: Problem, path: str) -> None:
    """Write a problem in the format that the file's name ends with, whole or not at all."""
    form = FORMATS.get(Path(path).suffix)
    if form is None:
        raise ProblemError(path, "has no format by its name", f"let it end with {' or '.join(FORMATS)}")
    write_whole(path, form.render(problem))


def _blaming(path: str, parse: Callable[[], T]) -> T:
    """What parse returns; a ProblemError that comes out of it is made to name the file."""
    try:
        return parse()
    except ProblemError as error:
        raise error.inside("standard input" if path == STANDARD_INPUT else path) from None


def _read_text(path: str) -> str:
    try:
        raw = sys.stdin.buffer.read() if path == STANDARD_INPUT else Path(path).read_bytes()
        text = raw.decode("utf-8-sig")
    except FileNotFoundError:
        raise ProblemError(path, "no such file", _likely_file(path)) from None
    except IsADirectoryError:
        raise ProblemError(path, "is a directory", "name a file in it") from None
    except OSError as error:
        raise ProblemError(path, f"cannot be read ({error.strerror})", "make it readable") from None
    except UnicodeDecodeError:
        raise ProblemError(path, "is not UTF-8 text", "save it as UTF-8") from None
    if not text.strip():
        raise ProblemError(
            "standard input" if path == STANDARD_INPUT else path, "is empty", "give M and q, as JSON or CSV"
        )
    return text


def _likely_file(path: str) -> str:
    folder = Path(path).parent
    if not folder.is_dir():
        return f"there is no folder {folder}"
    close = get_close_matches(Path(path).name, [entry.name for entry in folder.iterdir()], n=1)
    return f"did you mean {folder / close[0]}?" if close else "check the path"
