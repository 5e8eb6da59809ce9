"""Reading problems from files of any format, with errors that name the file."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from lcpcli.errors import ROW_OF_NUMBERS, LCPError, ProblemError, raised
from lcpcli.files.contents import STANDARD_INPUT, content_of, place, within
from lcpcli.files.fields import A_RESULT, BOUNDS, is_whole, kind_of, made
from lcpcli.files.formats import (
    Number,
    form_of,
    is_result,
    kind_in,
    load,
    refuse,
    uncompressed,
)
from lcpcli.model.arrays import as_vector
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

if TYPE_CHECKING:
    from fractions import Fraction

    from lcpcli.rational.exact_problem import ExactParts

# Returns the names of the unknowns, if they are needed.
Names: TypeAlias = "Callable[[], Sequence[str]]"
NOT_SECOND = (
    "leave it out; give a second problem a run of its own, and for an index see lcp "
    "help formats"
)
# Hints for an empty file.
WHOLE, LINE = "give M and q, as JSON or CSV", ROW_OF_NUMBERS


def read(
    path: str | os.PathLike[str],
    q_path: str | os.PathLike[str] | None = None,
    *,
    infinity: float = math.inf,
) -> Problem:
    """Read the problem in one file, or with M in one file and q in another, of any
    formats; "-" is standard input.

    The format is recognized by the suffix of the name (.mtx.gz is compressed .mtx) and
    by the content. Bounds, and sides of a program's rows, whose size is `infinity` or
    more count as infinite; a usual value is 1e20. Raises ProblemError, which says where
    the error is (file, field or line), what is wrong, and how to fix it.

    >>> from lcpcli import Problem, read, write
    >>> write(Problem([[2, 1], [1, 2]], [-5, -6], name="small"), "small.json")
    >>> read("small.json")
    <Problem small: n = 2, dense>
    >>> read("missing.json")
    Traceback (most recent call last):
    lcpcli.errors.ProblemError: missing.json: ...
    """
    paths = [os.fspath(each) for each in (path, q_path) if each is not None]
    problem = problem_of(paths, contents_of(paths))
    if infinity == math.inf:
        return problem
    from lcpcli.model.changes import with_infinity

    return within(place(paths[0]), lambda: with_infinity(problem, infinity))


def read_origin(kind: str, path: str) -> Problem:
    """Read the problem of the program ("qp") or the game of two players ("game") in a
    file."""
    problem = read(path)
    is_other = problem.origin is None or problem.origin.data()["kind"] not in (
        kind,
        "efg" if kind == "game" else kind,
    )
    refuse(
        is_other and kind == "qp",
        place(path),
        "is not a program",
        "give Q and c, or an MPS file",
    )
    refuse(is_other, place(path), "is not a game", "give the payoffs A and B")
    return problem


def read_next(
    paths: Sequence[str], infinity: float = math.inf
) -> tuple[Problem, Sequence[str]]:
    used = paths[
        : 1 if is_whole(fields_in(paths[0], content_of(paths[0], WHOLE))) else 2
    ]
    return read(*used, infinity=infinity), used


def contents_of(paths: Sequence[str]) -> tuple[bytes, ...]:
    return tuple(map(content_of, paths, (WHOLE, LINE)))


def problem_of(
    paths: Sequence[str], contents: Sequence[bytes], number: Number = float
) -> Problem:
    """Return the problem in the contents of one file, or of two. number : converts the
    numbers in texts to doubles."""
    (path, *q_paths), fields = paths, fields_in(paths[0], contents[0], number)
    if q_paths:
        refuse(
            is_whole(fields),
            q_paths[0],
            f"is not needed: {place(path)} contains M and q",
            NOT_SECOND,
        )
        names = partial(names_in, path, contents[0], dict(fields))
        fields["q"] = within(
            place(q_paths[0]),
            lambda: vector_in("q", q_paths[0], contents[1], None, number, names),
        )
    problem = within(place(path), made, fields)
    if not isinstance(problem, Problem):
        shape = " x ".join(map(str, problem.shape)) or "one number"
        raise ProblemError(
            place(path),
            f"contains M, {shape}, but no q",
            "add q, or name the file of q after it",
        )
    return problem if problem.name else problem.named(name_of(path))


def fields_in(path: str, content: bytes, number: Number = float) -> dict[str, Any]:
    refuse(is_result(content), place(path), *A_RESULT)
    form = within(place(path), form_of, path, content)
    fields = within(place(path), _called, form, "fields", content, number)
    if form == "nl_format":
        from lcpcli.files.nl_segments import with_names

        fields = with_names(path, fields)
    if isinstance(fields, dict) and (kind_of(fields) or "M" in fields):
        return fields
    raise ProblemError(
        place(path),
        "has no M by the package of its format",
        "correct the file, or that package",
    )


def _called(form: str, function: str, *given: Any) -> Any:
    """Return what a function of a format returns for a file. A fault of another
    package's module is one of the file."""
    try:
        return getattr(load(form), function)(*given)
    except Exception as error:
        if isinstance(error, LCPError) or "." not in form:
            raise
        fault = (
            f"cannot be read by the package {form.partition('.')[0]}: {raised(error)}"
        )
        raise ProblemError("", fault, "correct the file, or that package") from None


def names_in(path: str, content: bytes, fields: Mapping[str, Any]) -> Sequence[str]:
    if "names" in fields or form_of(path, content) != "csv_format":
        return list(fields.get("names", ()))
    from lcpcli.files.csv_format import table_of

    table = table_of(content)
    return table.header if len(table.header) == len(table.rows) else ()


def require_order(path: str, content: bytes, names: Names) -> None:
    if form_of(path, content) == "csv_format":
        from lcpcli.files import csv_format

        csv_format.require_order(content, names)


def vector_in(
    field: str,
    path: str,
    content: bytes,
    n: int | None = None,
    number: Number = float,
    names: Names = tuple,
) -> Vector:
    """Return the vector in a file's content. n : its length; None for any. names : of
    its entries, as labels may be."""
    require_order(path, content, names)
    form = form_of(path, content)
    refuse(
        fault := kind_in(form).has_no_vector,
        "",
        fault,
        "name a file that holds a vector",
    )
    return as_vector(field, _called(form, "values", field, content, number), n)


def exact_vector_in(
    field: str, path: str, content: bytes, n: int | None = None, names: Names = tuple
) -> list[Fraction]:
    from lcpcli.rational.exact_problem import fractions_of
    from lcpcli.rational.numbers import written

    if kind_in(form_of(path, content)).has_arrays:
        return fractions_of(vector_in(field, path, content, n, names=names))
    found = written(lambda number: vector_in(field, path, content, n, number, names))
    return [found.number(value) for value in found.own.tolist()]


def exact_parts_of(paths: Sequence[str], contents: Sequence[bytes]) -> ExactParts:
    """Return the numbers, as written, of contents that `problem_of` has accepted."""
    form = form_of(paths[0], contents[0])
    M, q, lower, upper = within(
        place(paths[0]), exact_parts_in, form, contents[0], len(paths) == 2
    )
    if len(paths) == 2:
        q = within(place(paths[1]), exact_vector_in, "q", paths[1], contents[1])
    return M, q, lower, upper


def exact_parts_in(form: str, content: bytes, lacks_q: bool = False) -> ExactParts:
    """Return the numbers in the content of a file as written: arrays in their own type,
    texts with all decimals.
    lacks_q : whether q is in another file; zeros then take its place."""
    from lcpcli.rational.exact_problem import (
        bounds_of,
        exact_parts,
        fractions_of,
        parts_of,
        rows_of,
    )

    def parse(number: Number = float) -> dict[str, Any]:
        fields = load(form).fields(content, number)
        return fields | {"q": np.zeros(np.shape(fields["M"])[0])} if lacks_q else fields

    if not kind_in(form).has_arrays:
        return exact_parts(lambda number: made(parse(number)))
    fields = parse()
    if kind_of(fields):
        return parts_of(made(fields))
    rows = rows_of(fields["M"])
    low, high = (
        bounds_of(np.broadcast_to(fields[key], len(rows))) if key in fields else None
        for key in BOUNDS
    )
    return rows, fractions_of(fields["q"]) if "q" in fields else None, low, high


def name_of(path: str) -> str:
    return (
        place(path)
        if path == STANDARD_INPUT
        else os.path.splitext(os.path.basename(uncompressed(path)))[0]
    )
