"""Bounds of z from the command line: one number for all, numbers typed, or a file with one for each unknown; and the
size from which on bounds are none.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.errors import OptionError, ProblemError, quoted
from lcpcli.files import csv_format, json_format, mat_format, npy_format, npz_format, reading, typed
from lcpcli.files.content import decode
from lcpcli.files.keys import BOUNDS
from lcpcli.model import far_bounds
from lcpcli.model.problem import Problem
from lcpcli.rational.numbers import fraction, ratio

if TYPE_CHECKING:
    from lcpcli.rational.numbers import Doubles
    from lcpcli.rational.problem import Bounds, ExactProblem

ABSENT = ("none", "null")
EXPECTED = "give a number, none, or one number for each unknown"
REFUSALS = {  # of bounds of what comes from a program or a game: the fault and the hint
    "qp": ("is for problems M and q, and this is a program", "give the bounds of its variables in the file"),
    "game": ("is for problems M and q, and this is a game", "leave it out"),
}


def bounded(
    problem: Problem,
    given: Mapping[str, Any],
    fetch: reading.Fetch = reading.content_of,
    doubles: Doubles | None = None,
) -> Problem:
    """The problem with the bounds given by name, lower and upper; those that are None stay as they are. What is known
    of the solutions for other bounds is dropped.

    A bound is a number, inf, -inf or none, a list of these, or the name of a file with such a list, whose content is
    what fetch(name, hint for an empty one) gives. From the size infinity on it is none.
    doubles : makes the doubles of the numbers as they are written, in place of the nearest ones.
    """
    problem = _with_bounds(problem, {name: given[name] for name in BOUNDS if given[name] is not None}, fetch, doubles)
    if given["infinity"] is None:
        return problem
    try:
        return far_bounds.with_infinity(problem, given["infinity"])
    except ProblemError as error:
        raise error.inside("--infinity") from None


def remark(problem: Problem, given: Mapping[str, Any]) -> str:
    """Return the line that tells users of bounds which may stand for none; "" where there are no such bounds, or where
    --infinity says what they mean."""
    return far_bounds.remark(problem) if given["infinity"] is None else ""


def _with_bounds(problem: Problem, given: Mapping[str, str], fetch: reading.Fetch, doubles: Doubles | None) -> Problem:
    values = {name: _values(name, text, fetch, exact=doubles is not None) for name, text in given.items()}
    if doubles is not None:
        values = {name: _doubles_of(value, doubles) for name, value in values.items()}
    if not values:
        return problem
    kind = "" if problem.origin is None else problem.origin.data()["kind"]
    if kind in REFUSALS:
        raise ProblemError(f"--{next(iter(values))}", *REFUSALS[kind])
    try:
        return replace(problem, solutions=(), verdict="", **values)
    except ProblemError as error:
        name = next((name for name in values if error.where.startswith(name)), next(iter(values)))
        text = given[name]
        typed_here = _is_typed(text) and error.where.startswith(name)
        file = "" if _is_typed(text) else f"{reading.place(text)}: "
        where = f"--{error.where}" if typed_here else f"--{name}: {file}{error.where}"
        raise ProblemError(where, error.fault, error.hint) from None


def _doubles_of(values: Any, doubles: Doubles) -> Any:
    """A bound with the doubles of its fractions."""
    if isinstance(values, list):
        return [_doubles_of(value, doubles) for value in values]
    return doubles.of(values) if isinstance(values, Fraction) else values


def exactly_bounded(
    data: ExactProblem, problem: Problem, given: Mapping[str, Any], fetch: reading.Fetch
) -> ExactProblem:
    """The exact data of the problem that `bounded` has made of theirs, with the bounds as written."""
    if problem.origin is not None and problem is not data.problem:  # without sides of rows, which may be in M and q
        return (data.of_floats if data.are_floats() else data.of_decimals)(problem)
    for name in BOUNDS:
        bounds: Bounds = getattr(data, name)
        if given[name] is not None:
            values = _values(name, given[name], fetch, exact=True)
            bounds = [_exact(value) for value in (values if isinstance(values, list) else data.n * [values])]
        ends = np.broadcast_to(getattr(problem, name), data.n)
        setattr(data, name, [value if math.isfinite(end) else None for value, end in zip(bounds, ends, strict=True)])
    return data


def _values(name: str, text: str, fetch: reading.Fetch, exact: bool) -> Any:
    """What is given for a bound: one value or a list of them, None for no bound."""
    if not _is_typed(text):
        if text != reading.STANDARD_INPUT and not _is_there(text):
            fault = f"{quoted(text)} is neither a file nor numbers"
            raise OptionError(f"--{name}", fault, "write -1,none,0.5 or name a file")
        return _held(name, text, fetch, exact)
    words = re.split(typed.PARTING, text.strip().strip("[]").strip())
    values = [None if word.casefold() in ABSENT else _typed(name, word, exact) for word in words]
    return values[0] if len(values) == 1 else values


def _is_typed(text: str) -> bool:
    """Whether it is numbers and words for absent ones, and no file has that name."""
    words = re.sub("none|null|infinity", "inf", text.casefold())
    return typed.numbers(words) is not None and not _is_there(text)


def _is_there(path: str) -> bool:
    return os.path.exists(path)  # noqa: PTH110 (Path.exists raises an error for a long text)


def _typed(name: str, number: str, exact: bool) -> Any:
    try:
        if "inf" in number.casefold() or number.casefold() == "nan":
            return float(number)
        value = ratio(number)
        return value if exact else float(value)
    except ProblemError as error:
        raise error.inside(f"--{name}") from None
    except OverflowError:
        raise ProblemError(f"--{name}", f"has {number}", "give a finite number in double precision, or none") from None


def _held(name: str, path: str, fetch: reading.Fetch, exact: bool) -> Any:
    """The values in a file."""

    def parse(content: bytes) -> Any:
        form = reading.format_of(path, content)
        if form is json_format:
            return json_format.load(decode(content), json_format.fraction_or_none if exact else float)
        if form is csv_format:
            return csv_format.parse_bound(f"--{name}", content, fraction if exact else float)
        if form is npy_format:
            values = npy_format.held(content)
        elif form is npz_format or form is mat_format:
            values = (npz_format if form is npz_format else mat_format).parse_bound(name, content)
        else:
            values = form.parse_vector(f"--{name}", content)
        return values.tolist() if exact else values

    return reading.parsed(path, EXPECTED, parse, fetch)


def _exact(value: Any) -> Fraction | None:
    if value is None or (isinstance(value, float) and value in (float("inf"), -float("inf"))):
        return None
    from lcpcli.rational.problem import number_of

    return number_of(value)
