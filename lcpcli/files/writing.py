"""Writing problems, programs and games to files, in the format of the suffix."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from lcpcli.errors import File, ProblemError, listed
from lcpcli.files import formats
from lcpcli.files.atomic_write import write_together
from lcpcli.files.fields import STARTS
from lcpcli.files.formats import refuse
from lcpcli.model import formulations
from lcpcli.model.formulations import TEXTS
from lcpcli.model.problem import Problem
from lcpcli.rational.numbers import (
    SCALE,
    Doubles,
    Written,
    brief,
    places,
    rounded,
    written,
)


def write(
    problem: Problem, path: str | os.PathLike[str], *, as_program: bool = False
) -> None:
    """Write a problem in the format of the suffix of the file, completely or not at
    all.

    .json, .npz and .mat keep everything, .csv keeps M, q and the bounds, the other
    formats only M and q: p.mtx or p.npy has M, and p.q.mtx or p.q.npy next to it has q.
    .mps is for problems made from programs, and has the program.
    as_program : whether .json, .npz and .mat also get the program that the problem was
        made from (Q, c, A and so on), instead of M and q, unless the problem has a
        field for which a program has no key, such as x0.
    Raises ProblemError if the suffix is unknown or the file cannot be written.

    >>> from lcpcli import Problem, read, write
    >>> write(Problem([[2, 1], [1, 2]], [-5, -6]), "small.mtx")
    >>> read("small.mtx", "small.q.mtx").q.tolist()
    [-5.0, -6.0]
    """
    write_as(Written(problem, problem, {}), os.fspath(path), as_program)


def write_as(as_written: Written[Problem], path: str, as_program: bool) -> None:
    ending = ending_of(path)
    if as_written.rounded.bounds and kind_to_write(path).keeps == formats.M_AND_Q:
        raise ProblemError(
            File(path),
            "cannot hold the bounds of z",
            f"use {', '.join(formats.COMPLETE)} or .csv",
        )
    contents = contents_of(as_written, path, ending, as_program)
    write_together(
        {
            path.removesuffix(ending) + part + ending: content
            for part, content in contents.items()
        }
    )


def contents_of(
    as_written: Written[Problem], path: str, ending: str, as_program: bool
) -> dict[str, bytes]:
    kind = formats.FORMATS[ending.casefold()]
    in_text = kind.in_decimals
    _refuse_underflow(as_written, path, kind)
    problem, exact = (
        (as_written.distinct, as_written.exact) if in_text else (as_written.rounded, {})
    )
    if kind.of and problem.formulation.kind != kind.of:
        noun = formulations.row_of(kind.of).word
        reason = f"is for {noun}s, and the problem is not made from one"
        hint = f"use {listed(formats.COMPLETE, 'or')}"
        raise ProblemError(File(path), reason, hint)
    others = (
        problem.solutions
        or problem.verdict
        or problem.x0 is not None
        or problem.x1 is not None
    )
    # The origin has a key for each of its parts.
    is_whole = as_program and kind.keeps == formats.ALL and not others
    origin_fields = None
    if kind.of or is_whole:
        origin_fields = problem.formulation.fields(problem, in_text=in_text)
    fields: dict[str, Any] = {
        key: getattr(problem, key) for key in TEXTS if getattr(problem, key)
    }
    fields |= _fields(problem, in_text) if origin_fields is None else origin_fields
    if kind.is_table:  # for its header
        fields["names"] = list(as_written.rounded.names)
    try:
        return formats.load(kind.form).render(fields, exact)
    except AttributeError as error:
        package = formats.package_of(kind.form)
        if not package:
            raise
        reason = f"cannot be written by the package {package}: {error}"
        raise ProblemError(File(path), reason, hint) from None
    except UnicodeEncodeError:
        reason = "cannot hold half a character, which a text of the problem has"
        raise ProblemError(File(path), reason, "write .json") from None
    except ProblemError as error:
        raise error.inside(File(path)) from None


def _refuse_underflow(
    as_written: Written[Problem], path: str, kind: formats.Kind
) -> None:
    """Raise ProblemError if a number that the format rounds is 0 in double precision
    without being 0, as the file would have another problem."""
    if kind.has_fractions:
        return
    values = [
        value
        for value in as_written.exact.values()
        if not kind.in_decimals or places(value) is None
    ]
    for value, double in zip(values, rounded(values).tolist(), strict=True):
        if not double:
            reason = f"cannot hold {brief(value)}, which is 0 in double precision"
            hint = f"use {listed(exact_endings(as_written), 'or')}, or {SCALE}"
            raise ProblemError(File(path), reason, hint)


def _fields(problem: Problem, in_text: bool) -> dict[str, Any]:
    """Return all fields of a problem but the texts. An origin is an object in a format
    of text, else JSON."""
    fields: dict[str, Any] = {"M": problem.M, "q": problem.q, **problem.bounds}
    fields |= {
        key: getattr(problem, key)
        for key in STARTS
        if getattr(problem, key) is not None
    }
    if problem.solutions:
        fields["solution"] = (
            list(problem.solutions)
            if len(problem.solutions) > 1
            else problem.solutions[0]
        )
    if problem.verdict:
        fields["verdict"] = problem.verdict
    if problem.formulation.is_names_alone:
        fields["names"] = list(problem.names)
    elif problem.origin is not None:
        data = problem.origin.data()
        fields["origin"] = data if in_text else json.dumps(data)
    return fields


def with_exact_conditions(as_written: Written[Problem], path: str) -> Written[Problem]:
    """Return the problem of a formulation for a file with M and q, where these are
    known exactly. The problem stays as it is if some numbers are not decimals, if it
    has bounds, and for any other file."""
    problem = as_written.rounded
    # Only a format in decimals that does not keep everything is concerned.
    kind = kind_to_write(path) if path else formats.JSON_FILE
    is_brief = kind.in_decimals and kind.keeps != formats.ALL
    parts = problem.formulation.exact_conditions() if is_brief else None
    if (
        parts is None
        or problem.bounds
        or any(places(value) is None for row in parts[0] for value in row.values())
    ):
        return as_written

    def parse(doubles: Doubles) -> Problem:
        M = np.zeros(problem.M.shape)
        for i, row in enumerate(parts[0]):
            M[i, list(row)] = [doubles.of(value) for value in row.values()]
        return Problem(M, problem.q, problem.name)

    exactly_written = written(parse)
    return Written(problem, exactly_written.distinct, exactly_written.exact)


def is_rounded(as_written: Written[Problem], path: str) -> bool:
    """Return whether a file with the problem of `with_exact_conditions` would have
    rounded numbers where the exact ones are known."""
    problem, kind = as_written.distinct, kind_to_write(path)
    parts = problem.formulation.exact_conditions()
    if parts is not None:
        is_kept = kind.keeps == formats.ALL and (
            kind.in_decimals
            or problem.formulation.fields(problem, in_text=False) is None
        )
        return not is_kept and not _are_doubles(parts[0])
    if kind.in_decimals:
        return not kind.has_fractions and not _are_decimals(as_written)
    return bool(as_written.exact)


def _are_doubles(rows: Sequence[Mapping[int, Fraction]]) -> bool:
    """Return whether all numbers are floats, or shortest decimals of floats."""
    values = chain.from_iterable(row.values() for row in rows)
    return all(
        value in (Fraction(double), Fraction(repr(double)))
        for value, double in ((value, float(value)) for value in values)
    )


def _are_decimals(as_written: Written[Problem]) -> bool:
    return all(places(value) is not None for value in as_written.exact.values())


def exact_endings(as_written: Written[Problem]) -> list[str]:
    """Return the suffixes of the formats that keep all numbers of a problem."""
    problem = as_written.rounded
    holding = formats.WITH_BOUNDS if problem.bounds else formats.GENERAL_SUFFIXES
    endings = [ending for ending in holding if formats.FORMATS[ending].in_decimals]
    if problem.origin is not None and not problem.origin.is_names_alone:
        endings = [".json", *formats.suffixes_of(problem.formulation.kind)]
    return [
        ending
        for ending in endings
        if formats.FORMATS[ending].has_fractions or _are_decimals(as_written)
    ]


def ending_of(path: str) -> str:
    ending = Path(path).suffix
    kind = formats.kind_with(ending.casefold())
    if kind is not None and kind.keeps:
        return ending
    hint = f"use {listed(formats.COMPLETE, 'or')}{formats.FOR_SOME}"
    refuse(kind is not None, File(path), "is of a format that is only read", hint)
    reason = f"has the unknown suffix {ending}" if ending else "has no suffix"
    raise ProblemError(File(path), reason, f"use {formats.WRITTEN}")


def kind_to_write(path: str) -> formats.Kind:
    return formats.FORMATS[ending_of(path).casefold()]


def file_of_q(path: str) -> str | None:
    """Return the second file, for q, of a format whose files hold M alone; None for
    other formats."""
    ending, is_beside = ending_of(path), kind_to_write(path).keeps == formats.M_AND_Q
    return f"{path.removesuffix(ending)}.q{ending}" if is_beside else None
