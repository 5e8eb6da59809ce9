"""Problems, starting points and proposed solutions read from files of any format, with errors that name the file."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import IO, TYPE_CHECKING, TypeVar, cast

from lcpcli.errors import ProblemError
from lcpcli.files import shipped
from lcpcli.files.content import without_mark
from lcpcli.files.formats import TEXT_FORMS, Format, load
from lcpcli.files.recognition import form_of, is_result, uncompressed
from lcpcli.model.box import Box
from lcpcli.model.far_bounds import with_infinity
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector

if TYPE_CHECKING:
    from lcpcli.files.candidate import Candidate
    from lcpcli.files.formats import Number
    from lcpcli.rational.problem import ExactParts, ExactProblem

STANDARD_INPUT = "-"
ORIGINS = {"qp": ("a program", "give Q and c, or an MPS file"), "game": ("a game", "give the payoffs A and B")}
WHOLE, LINE = "give M and q, as JSON or CSV", "give one row or one column of numbers"  # hints for an empty file

T = TypeVar("T")
Fetch = Callable[[str, str], bytes]


def read(
    path: str | os.PathLike[str], q_path: str | os.PathLike[str] | None = None, *, infinity: float = math.inf
) -> Problem:
    """The problem in one file, or with M in one file and q in another, of any formats; "-" is standard input.

    The format is recognized by the suffix of the name (.mtx.gz is compressed .mtx) and by the content. From the size
    infinity on, often 1e20, bounds are none, and sides of the rows of a program. Raises ProblemError, which says where
    (file, field or line), what is wrong, and how to fix it.

    >>> from lcpcli import Problem, read, write
    >>> write(Problem([[2, 1], [1, 2]], [-5, -6], name="small"), "small.json")
    >>> read("small.json")
    <Problem small: n = 2, dense>
    >>> read("missing.json")
    Traceback (most recent call last):
    lcpcli.errors.ProblemError: missing.json: ...
    """
    name = os.fspath(path)
    problem = problem_of(name, None if q_path is None else os.fspath(q_path), content_of)
    return _blaming(name, lambda: with_infinity(problem, infinity))


def read_origin(kind: str, path: str) -> Problem:
    """The problem in a file that holds what it comes from: a program ("qp") or a game of two players ("game").

    Raises ProblemError as `read` does.
    """
    problem = problem_of(path, None, content_of)
    if problem.origin is None or problem.origin.data()["kind"] != kind:
        what, hint = ORIGINS[kind]
        raise ProblemError(place(path), f"is not {what}", hint)
    return problem


def read_exact(path: str, q_path: str | None = None) -> ExactProblem:
    """As `read`, with the numbers of the files as they are there: decimals as exact rationals, in arrays also integers
    beyond those that are doubles.

    Raises ProblemError as `read` does, also for a number beyond the range of doubles.
    """
    from lcpcli.rational.problem import ExactProblem

    fetch = cache(content_of)  # standard input can be read only once
    return ExactProblem(problem_of(path, q_path, fetch), *exact_parts_of(path, q_path, fetch))


def read_next(paths: Sequence[str], infinity: float = math.inf) -> tuple[Problem, Sequence[str]]:
    """The problem in the first of some files, with q from the second if it holds M alone; and the files that it is in.

    Raises ProblemError as `read` does.
    """
    held = held_in(paths[0], content_of)
    used = paths[: 1 if isinstance(held, Problem) else 2]
    problem = _completed(held, paths[0], used[1] if len(used) > 1 else None, content_of)
    return _blaming(paths[0], lambda: with_infinity(problem, infinity)), used


def problem_of(path: str, q_path: str | None, fetch: Fetch, number: Number = float) -> Problem:
    """The problem in the contents that fetch(path, hint for an empty one) gives, of one file or of two.

    number : makes the doubles of the numbers in texts.
    """
    return _completed(held_in(path, fetch, number), path, q_path, fetch, number)


def exact_parts_of(path: str, q_path: str | None, fetch: Fetch) -> ExactParts:
    """The numbers of contents that `problem_of` has accepted, as they are there."""
    content = fetch(path, WHOLE)
    parts = _blaming(path, lambda: format_of(path, content).parse_exact(content))
    if parts.q is not None:
        return parts
    q_place = cast(str, q_path)
    vector = fetch(q_place, LINE)
    return parts._replace(q=_blaming(q_place, lambda: format_of(q_place, vector).parse_exact_vector("q", vector)))


def held_in(path: str, fetch: Fetch, number: Number = float) -> Problem | Matrix:
    """The problem in a file, or M alone."""
    content = fetch(path, WHOLE)
    if is_result(content):
        raise ProblemError(place(path), "is a result, not a problem", "name the file of the problem")
    return _blaming(path, lambda: format_of(path, content).parse(content, *_of_text(path, content, number)))


def _of_text(path: str, content: bytes, number: Number) -> list[Number]:
    """What makes the doubles, if the content is a text in which it makes others than float does."""
    return [number] if number is not float and form_of(path, content) in TEXT_FORMS else []


def _completed(held: Problem | Matrix, path: str, q_path: str | None, fetch: Fetch, number: Number = float) -> Problem:
    """What a file holds, with q from the other file if that is M alone."""
    if isinstance(held, Problem):
        if q_path is not None:
            hint = "leave it out; has the table an index or a second problem? see lcp help formats"
            raise ProblemError(q_path, f"is not needed: {place(path)} contains M and q", hint)
        problem = held
    else:
        if q_path is None:
            shape = " x ".join(map(str, held.shape)) or "one number"
            raise ProblemError(place(path), f"contains M, {shape}, but no q", "add q, or name the file of q after it")
        line = fetch(q_path, LINE)
        own = _of_text(q_path, line, number)
        q = _blaming(q_path, lambda: format_of(q_path, line).parse_vector("q", line, None, *own))
        problem = _blaming(path, lambda: Problem(held, q))
    return problem if problem.name else problem.named(name_of(path))


def read_start(field: str, path: str, n: int, box: Box | None = None) -> Vector:
    """A starting point of length n from a file with it or a result that `lcp solve -o` wrote: x for these bounds, or z.

    path : a file, or the numbers themselves, as in `typed`.

    A result gives its final iterate; of several results the first is taken.
    """
    from lcpcli.files import csv_answer, csv_format, json_format, typed
    from lcpcli.model.arrays import as_vector
    from lcpcli.rational.numbers import rounded

    numbers = typed.numbers(path)
    if numbers is not None:
        return typed.vector(field, numbers, n)
    content = content_of(path, LINE)

    def parse() -> Vector:
        form = format_of(path, content)
        if form is csv_format:
            try:
                given = csv_answer.parse(content)
            except ProblemError as error:
                raise error if error.where else error.inside(field) from None
            first = as_vector(field, rounded(given.z), n)
            return first if given.w is None or box is None else box.x_of(first, as_vector(field, rounded(given.w), n))
        if form is not json_format or not content.lstrip().startswith(b"{"):
            return form.parse_vector(field, content, n)
        z, w = json_format.parse_result(field, content, n)
        return z if box is None else box.x_of(z, w)

    return _blaming(path, parse)


def read_candidates(path: str, lengths: Mapping[int, str], name: str = "") -> list[Candidate]:
    """Proposed solutions, from a result, all solutions or a vector in any format, fractions allowed.

    path : a file, or the numbers themselves, as in `typed`.
    lengths : what it may be, by its length: z and, of a program, x and y, or x. name : of the problem, for which one of
        several results is taken.
    """
    from lcpcli.files import candidate, csv_format, json_format, typed
    from lcpcli.rational.problem import fractions_of

    numbers = typed.numbers(path)
    content = content_of(path, LINE) if numbers is None else " ".join(numbers).encode()

    def parse() -> list[Candidate]:
        form = csv_format if numbers else format_of(path, content)
        if form is json_format:
            return candidate.of_json(content, lengths, name)
        if form is csv_format:
            return candidate.of_text(content, lengths)
        values = fractions_of(form.parse_vector("z", content))
        return [candidate.Candidate("solution", candidate.of_length("z", values, lengths))]

    return _blaming(path, parse)


def format_of(path: str, content: bytes) -> Format:
    """The module of a file's format."""
    return load(form_of(path, content))


def name_of(path: str) -> str:
    """The name of a problem that has none of its own, from its file."""
    return place(path) if path == STANDARD_INPUT else Path(uncompressed(path)).stem


def _blaming(path: str, parse: Callable[[], T]) -> T:
    """The result of parse; a ProblemError raised by it is made to name the file."""
    try:
        return parse()
    except ProblemError as error:
        raise error.inside(place(path)) from None


def parsed(path: str, expected: str, parse: Callable[[bytes], T], fetch: Fetch | None = None) -> T:
    """What parse makes of a file's content, with errors that name the file; `expected` is the hint for an empty one."""
    content = (fetch or content_of)(path, expected)
    return _blaming(path, lambda: parse(content))


def place(path: str) -> str:
    """The name of a file in messages."""
    return "standard input" if path == STANDARD_INPUT else path


def content_of(path: str, expected: str) -> bytes:
    """The content of a file, without a byte order mark; `expected` is the hint for an empty one."""
    with opened(path) as file:
        return checked(path, file.read(), expected)


def checked(path: str, content: bytes, expected: str) -> bytes:
    """What was read from a file, without a byte order mark; ProblemError if it is empty."""
    content = without_mark(content)
    if not content or content.isspace():
        raise ProblemError(place(path), "is empty", expected)
    return content


@contextmanager
def opened(path: str) -> Iterator[IO[bytes]]:
    """A file to read from, or standard input; a name that is no file may be that of a shipped problem.

    Raises ProblemError if it cannot be read.
    """
    name = place(path)
    if not path:
        raise ProblemError("", "the name of a file is empty", "name a file")
    try:
        if path == STANDARD_INPUT:
            if sys.stdin is None:
                raise ProblemError(name, "is closed", "name a file")
            yield sys.stdin.buffer
        else:
            with (shipped.file_of(path) or Path(path)).open("rb") as file:
                yield file
    except FileNotFoundError:
        raise ProblemError(name, "no such file", _likely_file(path)) from None
    except IsADirectoryError:
        raise ProblemError(name, "is a directory", "name a file in it") from None
    except OSError as error:
        raise ProblemError(name, f"cannot be read ({error.strerror})", "make it readable") from None


def _likely_file(path: str) -> str:
    from difflib import get_close_matches

    folder, name = Path(path).parent, Path(path)
    try:
        names = [entry.name for entry in folder.iterdir()]
    except OSError:
        names = []
    if close := get_close_matches(name.name, names, n=1, cutoff=0.75):
        return f"did you mean {folder / close[0]}?"
    if close := get_close_matches(name.stem, shipped.problems(), n=1, cutoff=0.75):
        return f"did you mean {close[0]}, which is shipped?"
    return "check the path" if folder.is_dir() else f"there is no folder {folder}"
