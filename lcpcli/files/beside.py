"""What is given beside a problem: bounds, starting points, states and solutions, as numbers or words, or in files.

Numbers are typed in place of the name of a file: 1,0,15/29 or "1 0 2.5" or "[1, 0]".
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

from lcpcli.errors import OptionError, ProblemError, kind, quoted
from lcpcli.files.contents import STANDARD_INPUT, Fetch, content_of, decode, parsed, place, within
from lcpcli.files.fields import BOUNDS
from lcpcli.files.formats import OF_ARRAYS, form_of, load
from lcpcli.files.reading import LINE, vector_in
from lcpcli.model.arrays import as_vector
from lcpcli.model.start import STATES, states_of, x_of_states
from lcpcli.rational.numbers import fraction, ratio, rounded
from lcpcli.typing import Vector

if TYPE_CHECKING:
    from lcpcli.files.answers import Candidate
    from lcpcli.model.box import Box
    from lcpcli.model.problem import Problem
    from lcpcli.rational.numbers import Doubles
    from lcpcli.rational.problem import Bounds, ExactProblem

NUMBER = r"(?:[-+.eE/]*\d[-+\d.eE/]*|[-+]?inf|nan)"
PARTING = r"(?:\s*[,;]\s*|\s+)"
LIST = re.compile(rf"\s*\[?\s*{NUMBER}(?:{PARTING}{NUMBER})*\s*\]?\s*")
ABSENT = ("none", "null")
EXPECTED = "give a number, none, or one number for each unknown"
OF_STATES = "give a JSON list of lower, basic and upper, or a result of lcp solve in JSON or CSV"
REFUSALS = {  # of bounds of what comes from a program or a game: the fault and the hint
    "qp": ("is for problems M and q, and this is a program", "give the bounds of its variables in the file"),
    "game": ("is for problems M and q, and this is a game", "leave it out"),
}


def bounded(
    problem: Problem,
    given: Mapping[str, Any],
    fetch: Fetch = content_of,
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
    from lcpcli.model.far_bounds import with_infinity

    return within("--infinity", with_infinity, problem, given["infinity"])


def remark(problem: Problem, given: Mapping[str, Any]) -> str:
    """Return the line that tells users of bounds which may stand for none; "" where there are no such bounds, or where
    --infinity says what they mean."""
    if given["infinity"] is not None or not problem.may_have_far_bounds:
        return ""
    from lcpcli.model.far_bounds import remark

    return remark(problem)


def _with_bounds(problem: Problem, given: Mapping[str, str], fetch: Fetch, doubles: Doubles | None) -> Problem:
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
        is_typed = _is_typed(given[name])
        file = "" if is_typed else f"{place(given[name])}: "
        is_own = is_typed and error.where.startswith(name)
        where = f"--{error.where}" if is_own else f"--{name}: {file}{error.where}"
        raise ProblemError(where, error.fault, error.hint) from None


def _doubles_of(values: Any, doubles: Doubles) -> Any:
    """A bound with the doubles of its fractions."""
    if isinstance(values, list):
        return [_doubles_of(value, doubles) for value in values]
    return doubles.of(values) if isinstance(values, Fraction) else values


def exactly_bounded(data: ExactProblem, problem: Problem, given: Mapping[str, Any], fetch: Fetch) -> ExactProblem:
    """The exact data of the problem that `bounded` has made of theirs, with the bounds as written."""
    from lcpcli.rational.problem import number_of

    def exact(value: Any) -> Fraction | None:
        return None if value is None or value in (math.inf, -math.inf) else number_of(value)

    if problem.origin is not None and problem is not data.problem:  # without sides of rows, which may be in M and q
        return (data.of_floats if data.are_floats() else data.of_decimals)(problem)
    for name in BOUNDS:
        bounds: Bounds = getattr(data, name)
        if given[name] is not None:
            values = _values(name, given[name], fetch, exact=True)
            bounds = list(map(exact, values if isinstance(values, list) else data.n * [values]))
        ends = np.broadcast_to(getattr(problem, name), data.n)
        setattr(data, name, [value if math.isfinite(end) else None for value, end in zip(bounds, ends, strict=True)])
    return data


def _values(name: str, text: str, fetch: Fetch, exact: bool) -> Any:
    """What is given for a bound: one value or a list of them, None for no bound."""
    if _is_typed(text):
        words = re.split(PARTING, text.strip().strip("[]").strip())
        values = [None if word.casefold() in ABSENT else _end(name, word, exact) for word in words]
        return values[0] if len(values) == 1 else values
    if text != STANDARD_INPUT and not is_there(text):
        raise OptionError(
            f"--{name}", f"{quoted(text)} is neither a file nor numbers", "write -1,none,0.5 or name a file"
        )

    def parse(content: bytes) -> Any:
        form = form_of(text, content)
        if form not in (*OF_ARRAYS, "json_format", "csv_format"):
            return vector_in(f"--{name}", text, content).tolist()
        held = load(form).values(f"--{name}", content, _exact_number if exact else float)
        return held.tolist() if exact and form in OF_ARRAYS else held

    return parsed(text, EXPECTED, parse, fetch)


def _exact_number(text: str) -> Any:
    """A number with all its digits, which may be infinite."""
    return float(text) if "inf" in text.casefold() else fraction(text)


def _is_typed(text: str) -> bool:
    """Whether it is numbers and words for absent ones, and no file has that name."""
    words = re.sub("none|null|infinity", "inf", text.casefold())
    return typed_numbers(words) is not None and not is_there(text)


def is_there(path: str) -> bool:
    """Whether there is a file of that name, which may be no name but a long text."""
    return os.path.exists(path)  # noqa: PTH110 (Path.exists raises an error for a long text)


def _end(name: str, number: str, exact: bool) -> Any:
    """A bound that is typed."""
    try:
        if "inf" in number.casefold() or number.casefold() == "nan":
            return float(number)
        value = within(f"--{name}", ratio, number)
        return value if exact else float(value)
    except OverflowError:
        raise ProblemError(f"--{name}", f"has {number}", "give a finite number in double precision, or none") from None


def typed_numbers(text: str) -> list[str] | None:
    """The numbers in a text, each as typed; None if it is not a list of numbers, or a file has that name."""
    return None if not LIST.fullmatch(text) or os.path.lexists(text) else re.findall(NUMBER, text)


def typed_vector(field: str, typed: list[str], n: int) -> Vector:
    """Typed numbers, fractions allowed, as a vector of length n, or a ProblemError for the field."""
    return as_vector(field, [_value(field, number) for number in typed], n)


def _value(field: str, number: str) -> float:
    if "/" in number:
        return float(rounded([within(field, ratio, number)])[0])
    try:
        return float(number)
    except ValueError:
        raise ProblemError(field, f"has {quoted(number)}, not a number", "write 1,-2,0.5") from None


def read_start(field: str, path: str, n: int, box: Box | None = None) -> Vector:
    """A starting point of length n from a file with it or a result that `lcp solve -o` wrote: x for these bounds, or z.

    path : a file, or the numbers themselves.

    A result gives its final iterate; of several results the first is taken.
    """
    if (numbers := typed_numbers(path)) is not None:
        return typed_vector(field, numbers, n)

    def parse(content: bytes) -> Vector:
        form = form_of(path, content)
        if form != "csv_format" and not (form == "json_format" and content.lstrip().startswith(b"{")):
            return vector_in(field, path, content, n)
        z, w = _result_in(field, form, content, n)
        return z if box is None or w is None else box.x_of(z, w)

    return parsed(path, LINE, parse)


def read_candidates(path: str, lengths: Mapping[int, str], name: str = "") -> list[Candidate]:
    """Proposed solutions, from a result, all solutions or a vector in any format, fractions allowed.

    path : a file, or the numbers themselves.
    lengths : what it may be, by its length: z and, of a program, x and y, or x. name : of the problem, for which one of
        several results is taken.
    """
    from lcpcli.files import answers
    from lcpcli.rational.problem import fractions_of

    numbers = typed_numbers(path)

    def parse(content: bytes) -> list[Candidate]:
        form = "csv_format" if numbers else form_of(path, content)
        if form == "json_format":
            return answers.of_json(content, lengths, name)
        if form == "csv_format":
            return [each._replace(w=None) for each in answers.of_table(content, lengths)]
        values = fractions_of(vector_in("z", path, content))
        return [answers.Candidate("solution", answers.of_length("z", values, lengths))]

    return parsed(path, LINE, parse, None if numbers is None else lambda *_: " ".join(numbers).encode())


def read_states(given: str, problem: Problem) -> list[str]:
    """The states, one for each variable, in words or in a file; ProblemError if some are missing, or not possible for
    the bounds."""
    is_file = bool(given) and is_there(given)
    words = given.replace(",", " ").split()
    if not is_file and not set(words) & set(STATES):
        raise OptionError(
            "--basis", f"{given!r} is neither a file nor states", "write lower,basic,upper or name a file"
        )
    states = parsed(given, OF_STATES, lambda content: _states_in(given, content, problem)) if is_file else words
    try:
        x_of_states(problem, states)
    except ProblemError as error:
        where = f"--basis: {given}: {error.where}" if is_file else f"--{error.where}"
        raise ProblemError(where, error.fault, error.hint) from None
    return states


def _states_in(path: str, content: bytes, problem: Problem) -> list[str]:
    """The list that a file holds, or that of a result; of one without such a list by its z and w."""
    form = form_of(path, content)
    if form not in ("csv_format", "json_format"):
        raise ProblemError("", "has no states", OF_STATES)
    if form == "json_format":
        held = _first_in(content)
        states: Any = held.get("basis") if isinstance(held, dict) else held
        if isinstance(states, list):
            return states
        if states is not None or not isinstance(held, dict) or not {"z", "w"} <= set(held):
            raise ProblemError("basis", "is missing" if states is None else f"is {kind(states)}", OF_STATES)
    z, w = _result_in("", form, content, problem.n)
    if w is None:
        raise ProblemError("", "has no column headed w", OF_STATES)
    return states_of(problem, z, w)


def _result_in(field: str, form: str, content: bytes, n: int) -> tuple[Vector, Vector | None]:
    """z and, but in CSV perhaps, w of a result, of the first of several. Errors name the field, if there is one."""
    if form == "csv_format":
        from lcpcli.files import answers

        try:
            answer = answers.first_in(content)
        except ProblemError as error:
            raise error if error.where or not field else error.inside(field) from None
        z = as_vector(field or "z", rounded(answer.values), n)
        return z, None if answer.w is None else as_vector(field or "w", rounded(answer.w), n)
    held = _first_in(content)
    try:
        if not {"z", "w"} <= set(held):
            hint = "give a list of numbers, or what lcp solve --format json prints"
            raise ProblemError("", "is an object without z and w", hint)
        return as_vector("z", held["z"], n), as_vector("w", held["w"], n)
    except ProblemError as error:
        raise error.inside(field) if field else error from None


def _first_in(content: bytes) -> Any:
    """What a JSON text holds; of several objects, one per line, the first, in a log that of the first problem."""
    from lcpcli.files.json_format import load as loaded
    from lcpcli.files.log import first_of

    text = decode(content)
    are_several = text.strip().partition("\n")[2].lstrip().startswith("{")
    return loaded(first_of(text.strip()) if are_several else text)
