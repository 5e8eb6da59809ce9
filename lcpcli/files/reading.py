"""Problems, starting points and proposed solutions read from files of any format, with errors that name the file."""

from __future__ import annotations

import codecs
import os
import re
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar, cast

from lcpcli.errors import ProblemError
from lcpcli.files.formats import COMPRESSED, FORMATS, Format, load
from lcpcli.model.modulus import x_of
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

if TYPE_CHECKING:
    from lcpcli.files.candidate import Candidate
    from lcpcli.rational.problem import ExactProblem

STANDARD_INPUT = "-"
WHOLE, LINE = "give M and q, as JSON or CSV", "give one row or one column of numbers"  # hints for an empty file

NUMBERS = re.compile(r"(?=.*\d)[-+\d.eE/]+([,; ]+[-+\d.eE/]+)*")
T = TypeVar("T")


def read(path: str | os.PathLike[str], q_path: str | os.PathLike[str] | None = None) -> Problem:
    """The problem in one file, or with M in one file and q in another, of any formats; "-" is standard input.

    The format is given by the suffix of the name (.mtx.gz is compressed .mtx). With other suffixes and .csv, a text
    that opens with a brace or a bracket is JSON, everything else CSV. Raises ProblemError, which says where (file,
    field or line), what is wrong, and how to fix it.

    >>> from lcpcli import Problem, read, write
    >>> write(Problem([[2, 1], [1, 2]], [-5, -6], name="small"), "small.json")
    >>> read("small.json")
    <Problem small: n = 2, dense>
    >>> read("missing.json")
    Traceback (most recent call last):
    lcpcli.errors.ProblemError: missing.json: ...
    """
    return _problem(os.fspath(path), None if q_path is None else os.fspath(q_path), _read)


def read_converted(kind: str, path: str) -> Problem:
    """The LCP of the object in a JSON file, by its kind: "qp", a quadratic program, or "game", a bimatrix game.

    Raises ProblemError as `read` does.
    """
    from lcpcli.files import converted

    content = _read(path, "give a program or a game as a JSON object")
    problem = _blaming(path, lambda: converted.KINDS[kind](content))
    return problem if problem.name else replace(problem, name=_name(path))


def read_exact(path: str, q_path: str | None = None) -> ExactProblem:
    """As `read`, with the decimal numbers of the files as exact rationals; those of NPZ are doubles.

    Raises ProblemError as `read` does, also for a number beyond the range of doubles.
    """
    from lcpcli.rational.problem import ExactProblem

    fetch = cache(_read)  # standard input can be read only once
    problem = _problem(path, q_path, fetch)
    content = fetch(path, WHOLE)
    M, q = _blaming(path, lambda: _format(path, content).parse_exact(content))
    if q is None:
        q_place = cast(str, q_path)
        vector = fetch(q_place, LINE)
        q = _blaming(q_place, lambda: _format(q_place, vector).parse_exact_vector("q", vector))
    return ExactProblem(problem, M, q)


def _problem(path: str, q_path: str | None, fetch: Callable[[str, str], bytes]) -> Problem:
    content = fetch(path, WHOLE)
    held = _blaming(path, lambda: _format(path, content).parse(content))
    if isinstance(held, Problem):
        if q_path is not None:
            raise ProblemError(q_path, f"is not needed: {_place(path)} contains M and q", "leave it out")
        problem = held
    else:
        if q_path is None:
            shape = " x ".join(map(str, held.shape))
            raise ProblemError(_place(path), f"contains M, {shape}, but no q", "add q to it, or name a file for q")
        line = fetch(q_path, LINE)
        q = _blaming(q_path, lambda: _format(q_path, line).parse_vector("q", line))
        problem = _blaming(path, lambda: Problem(held, q))
    return problem if problem.name else replace(problem, name=_name(path))


def read_start(field: str, path: str, n: int, as_x: bool = True) -> Vector:
    """A starting point of length n, x or else z, from a file with it or a result that `lcp solve -o` wrote.

    A result gives its final iterate; of several results the first is taken.
    """
    content = _read(path, LINE)
    from lcpcli.files import csv_answer, csv_format, json_format
    from lcpcli.model.arrays import as_vector
    from lcpcli.rational.numbers import rounded

    def parse() -> Vector:
        form = _format(path, content)
        if form is csv_format:
            try:
                given = csv_answer.parse(content)
            except ProblemError as error:
                raise error if error.where else error.inside(field) from None
            first = as_vector(field, rounded(given.z), n)
            return first if given.w is None or not as_x else x_of(first, as_vector(field, rounded(given.w), n))
        if form is not json_format or not content.lstrip().startswith(b"{"):
            return form.parse_vector(field, content, n)
        z, w = json_format.parse_result(field, content, n)
        return x_of(z, w) if as_x else z

    return _blaming(path, parse)


def read_candidate(path: str, n: int) -> Candidate:
    """A proposed solution of n entries, from a result or a vector in any format, fractions allowed.

    path : a file, or the numbers themselves: "1.5,0,15/29".
    """
    from lcpcli.files import candidate, csv_format, json_format
    from lcpcli.rational.problem import fractions_of

    given = NUMBERS.fullmatch(path) and not os.path.lexists(path)
    content = path.encode() if given else _read(path, LINE)

    def parse() -> Candidate:
        form = _format(path, content)
        if form is json_format:
            return candidate.of_json(content, n)
        if form is csv_format:
            return candidate.of_text(content, n)
        return candidate.Candidate("solution", fractions_of(form.parse_vector("z", content, n)))

    return _blaming(path, parse)


def _format(path: str, content: bytes) -> Format:
    name = FORMATS.get(Path(_uncompressed(path)).suffix.casefold(), "csv")
    return load("json" if name == "csv" and content.lstrip()[:1] in (b"{", b"[") else name)


def _uncompressed(path: str) -> str:
    return path[:-3] if path.casefold().endswith(COMPRESSED) else path


def _name(path: str) -> str:
    """The name of a problem that has none of its own, from its file."""
    return _place(path) if path == STANDARD_INPUT else Path(_uncompressed(path)).stem


def _blaming(path: str, parse: Callable[[], T]) -> T:
    """The result of parse; a ProblemError raised by it is made to name the file."""
    try:
        return parse()
    except ProblemError as error:
        raise error.inside(_place(path)) from None


def _place(path: str) -> str:
    """The name of a path in messages."""
    return "standard input" if path == STANDARD_INPUT else path


def _read(path: str, expected: str) -> bytes:
    """The content of a file, without a byte order mark; `expected` is the hint for an empty one."""
    place = _place(path)
    try:
        content = _read_bytes(path).removeprefix(codecs.BOM_UTF8)
    except FileNotFoundError:
        raise ProblemError(place, "no such file", _likely_file(path)) from None
    except IsADirectoryError:
        raise ProblemError(place, "is a directory", "name a file in it") from None
    except OSError as error:
        raise ProblemError(place, f"cannot be read ({error.strerror})", "make it readable") from None
    if not content or content.isspace():
        raise ProblemError(place, "is empty", expected)
    return content


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
    from difflib import get_close_matches

    close = get_close_matches(Path(path).name, names, n=1, cutoff=0.75)
    return f"did you mean {folder / close[0]}?" if close else "check the path"
