"""Bounds, starting points, states and solutions given in addition to a problem, as numbers or words, or in files.

Numbers may be typed in place of a file name: 1,0,15/29 or "1 0 2.5" or "[1, 0]".
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from lcpcli.errors import ParameterError, ProblemError, kind, quoted
from lcpcli.files import proposed_solutions
from lcpcli.files.contents import STANDARD_INPUT, Fetch, content_of, decode, parsed, place, within
from lcpcli.files.fields import BOUNDS
from lcpcli.files.formats import form_of, kind_in, load
from lcpcli.files.json_format import load as loaded
from lcpcli.files.proposed_solutions import Candidate, Sought, first_of
from lcpcli.files.reading import LINE, Names, require_order, vector_in
from lcpcli.model.arrays import as_vector
from lcpcli.model.box import WORDS, Box, in_words
from lcpcli.model.problem import Problem
from lcpcli.model.start import basis_of_words
from lcpcli.rational.exact_problem import Bounds, ExactProblem, fractions_of, number_of
from lcpcli.rational.numbers import Doubles, fraction, ratio, rounded
from lcpcli.typing import Vector

NUMBER = r"(?:[-+.eE/]*\d[-+\d.eE/]*|[-+]?inf|nan)"
PARTING = r"(?:\s*[,;]\s*|\s+)"
LIST = re.compile(rf"\s*\[?\s*{NUMBER}(?:{PARTING}{NUMBER})*\s*\]?\s*")
ABSENT = ("none", "null")
EXPECTED = "give a number, none, or one number for each unknown"
STATES_HINT = "give a JSON list of lower, basic and upper, or a result of lcp solve in JSON or CSV"
REFUSALS = {  # of bounds for a problem made from a program or a game: the fault and the hint
    "qp": ("is for problems given by M and q, but this is a program", "give the bounds of its variables in the file"),
    "game": ("is for problems given by M and q, but this is a game", "leave it out"),
}


def with_bounds(
    problem: Problem, given: Mapping[str, Any], fetch: Fetch = content_of, doubles: Doubles | None = None
) -> Problem:
    """Return the problem with the given bounds, lower and upper; a bound that is None stays as it is. Known solutions
    are dropped if bounds change.

    A bound is a number, inf, -inf or none, a list of these, or the name of a file with such a list; fetch(name, hint
    for an empty file) returns the content of the file. A bound of size infinity or more is infinite.
    doubles : makes doubles from the numbers as written, in place of the nearest doubles.
    """
    names = [name for name in BOUNDS if given[name] is not None]
    number = float if doubles is None else doubles.of
    values = {name: _values(name, given[name], fetch, number, lambda: problem.names) for name in names}
    if values:
        problem = _with_bounds(problem, values, given)
    if given["infinity"] is None:
        return problem
    from lcpcli.model.far_bounds import with_infinity

    return within("--infinity", with_infinity, problem, given["infinity"])


def _with_bounds(problem: Problem, values: Mapping[str, Any], given: Mapping[str, Any]) -> Problem:
    kind = "" if problem.origin is None else problem.origin.data()["kind"]
    if kind in REFUSALS:
        raise ProblemError(f"--{next(iter(values))}", *REFUSALS[kind])
    try:
        return replace(problem, solutions=(), verdict="", **values)
    except ProblemError as error:
        own = next((name for name in values if error.where.startswith(name)), "")
        name = own or next(iter(values))
        is_typed = _is_typed(given[name])
        where = error.where if is_typed else f"{place(given[name])}: {error.where}"
        option = "--" if own and is_typed else f"--{name}: "
        raise ProblemError(f"{option}{where}", error.fault, error.hint) from None


def remark(problem: Problem, given: Mapping[str, Any]) -> str:
    """Return the line on bounds that may stand for infinite ones; "" if there are none or if --infinity is given."""
    if given["infinity"] is not None:
        return ""
    from lcpcli.model.far_bounds import remark

    return remark(problem)


def with_exact_bounds(data: ExactProblem, problem: Problem, given: Mapping[str, Any], fetch: Fetch) -> ExactProblem:
    """Return the exact data of the problem that `with_bounds` returned, with the bounds as written."""

    def exact(value: Any) -> Fraction | None:
        return None if value is None or value in (math.inf, -math.inf) else number_of(value)

    if problem.origin is not None and problem is not data.problem:  # whose rows' sides may be in M and q
        return (data.of_floats if data.are_floats() else data.of_decimals)(problem)
    for name in BOUNDS:
        bounds: Bounds = getattr(data, name)
        if given[name] is not None:
            values = _values(name, given[name], fetch, Fraction, lambda: problem.names)
            bounds = list(map(exact, values if isinstance(values, list) else data.n * [values]))
        ends = np.broadcast_to(getattr(problem, name), data.n)
        setattr(data, name, [value if math.isfinite(end) else None for value, end in zip(bounds, ends, strict=True)])
    return data


def _values(name: str, text: str, fetch: Fetch, number: Callable[[Fraction], Any], names: Names) -> Any:
    """Return the value of a bound, or the list of values; None stands for no bound. number : converts a number; `float`
    gives the nearest double."""
    if _is_typed(text):
        words = re.split(PARTING, text.strip().strip("[]").strip())
        values = [None if word.casefold() in ABSENT else _end(name, word, number) for word in words]
        return values[0] if len(values) == 1 else values
    if text != STANDARD_INPUT and not os.path.exists(text):
        fault = f"{quoted(text)} is neither a file nor numbers"
        raise ParameterError(name, fault, "write -1,none,0.5 or name a file")

    def as_written(entry: str) -> Any:
        return float(entry) if "inf" in entry.casefold() else number(fraction(entry))

    def parse(content: bytes) -> Any:
        require_order(text, content, names)
        form = form_of(text, content)
        if form == "matrix_market_format" or kind_in(form).has_no_vector:
            return vector_in(f"--{name}", text, content).tolist()
        held = load(form).values(f"--{name}", content, float if number is float else as_written)
        return held.tolist() if number is not float and kind_in(form).has_arrays else held

    return parsed(text, EXPECTED, parse, fetch)


def _is_typed(text: str) -> bool:
    """Return whether a text consists of numbers and of words for absent numbers, and is not the name of a file."""
    words = re.sub("none|null|infinity", "inf", text.casefold())
    return typed_numbers(words) is not None and not os.path.exists(text)


def _end(name: str, text: str, number: Callable[[Fraction], Any]) -> Any:
    try:
        is_infinite = "inf" in text.casefold() or text.casefold() == "nan"
        return float(text) if is_infinite else number(within(f"--{name}", ratio, text))
    except OverflowError:
        raise ProblemError(f"--{name}", f"has {text}", "give a finite number in double precision, or none") from None


def typed_numbers(text: str, may_be_file: bool = True) -> list[str] | None:
    """Return the numbers in a text, each as typed; None if the text is not a list of numbers or may name a file."""
    is_file = may_be_file and os.path.lexists(text)
    return None if not LIST.fullmatch(text) or is_file else re.findall(NUMBER, text)


def typed_vector(field: str, typed: list[str], n: int) -> Vector:
    """Return typed numbers, fractions allowed, as a vector of length n; a ProblemError names the field."""
    values = [within(f"{field}[{i}]", ratio, number) for i, number in enumerate(typed)]
    return as_vector(field, rounded(values), n)


def read_start(field: str, path: str, n: int, box: Box | None = None, names: Names = tuple) -> Vector:
    """Return a starting point of length n, given in numbers or in a file. The file has the vector itself, or results of
    `lcp solve -o`; then the starting point is the final iterate of the first result: x for the given bounds, or z."""
    if (numbers := typed_numbers(path)) is not None:
        return typed_vector(field, numbers, n)

    def parse(content: bytes) -> Vector:
        form = form_of(path, content)
        if form != "csv_format" and not (form == "json_format" and content.lstrip().startswith(b"{")):
            return vector_in(field, path, content, n, names=names)
        require_order(path, content, names)
        try:
            z, w = _result_in(form, content, n, f"{field}: ")
        except ProblemError as error:
            raise error if error.where else error.inside(field) from None
        return z if box is None or w is None else box.x_of(z, w)

    return parsed(path, LINE, parse)


def read_candidates(path: str, lengths: Mapping[int, str], problem: Sought, names: Names = tuple) -> list[Candidate]:
    """Return the proposed solutions, given in numbers or in a file: a result, all solutions, or a vector in any format,
    fractions allowed.

    lengths : what a vector stands for, by its length: z and, for a program, x and y, or x. problem : the problem
    whose result is chosen of several. names : those of the unknowns, by which a table may be labelled.
    """
    numbers = typed_numbers(path)

    def parse(content: bytes) -> list[Candidate]:
        form = "csv_format" if numbers else form_of(path, content)
        if form == "json_format":
            return proposed_solutions.of_json(content, lengths, problem)
        if form == "csv_format":
            require_order(path, content, names)
            found = [each._replace(w=None) for each in proposed_solutions.of_table(content)]
        else:
            found = [proposed_solutions.Candidate("solution", fractions_of(vector_in("z", path, content)))]
        for each in found:
            if each.rows is None:
                proposed_solutions.of_length("z", each.values, lengths)
        return found

    return parsed(path, LINE, parse, None if numbers is None else lambda *_: " ".join(numbers).encode())


def read_states(given: str, problem: Problem) -> list[str]:
    """Return the states, one for each variable, given in words or in a file; raise ProblemError if some are missing or
    impossible."""
    is_file = os.path.exists(given)
    words = given.replace(",", " ").split()
    if not is_file and not set(words) & set(WORDS.values()):
        fault = f"{given!r} is neither a file nor states"
        raise ParameterError("basis", fault, "write lower,basic,upper or name a file")
    states = parsed(given, STATES_HINT, lambda content: _states_in(given, content, problem)) if is_file else words
    try:
        basis_of_words(problem, states)
    except ProblemError as error:
        where = f"--basis: {given}: {error.where}" if is_file else f"--{error.where}"
        raise ProblemError(where, error.fault, error.hint) from None
    return states


@np.errstate(all="ignore")
def _states_in(path: str, content: bytes, problem: Problem) -> list[str]:
    """Return the states in a file: its list, the list in a result, or, for a result without one, the states of z and
    w."""
    form = form_of(path, content)
    if form not in ("csv_format", "json_format"):
        raise ProblemError("", "has no states", STATES_HINT)
    if form == "json_format":
        data = _first_in(content)
        states: Any = data.get("basis") if isinstance(data, dict) else data
        if isinstance(states, list):
            return states
        if states is not None or not isinstance(data, dict) or not {"z", "w"} <= set(data):
            raise ProblemError("basis", "is missing" if states is None else f"is {kind(states)}", STATES_HINT)
    z, w = _result_in(form, content, problem.n)
    if w is None:
        raise ProblemError("", "has no column headed w", STATES_HINT)
    return in_words(problem.box.basis_at(z, w))


def _result_in(form: str, content: bytes, n: int, before: str = "") -> tuple[Vector, Vector | None]:
    """Return z and w of a result, the first of several; w may be None in CSV. before : the prefix of messages."""
    if form == "csv_format":
        first = proposed_solutions.of_table(content)[0]
        if first.rows is not None:
            raise ProblemError("", "has no column headed z", proposed_solutions.HINT)
        z, w = (None if values is None else rounded(values) for values in (first.values, first.w))
    else:
        data = _first_in(content)
        if not {"z", "w"} <= set(data):
            raise ProblemError("", "is an object without z and w", proposed_solutions.EXPECTED)
        z, w = data["z"], data["w"]
    return as_vector(f"{before}z", z, n), None if w is None else as_vector(f"{before}w", w, n)


def _first_in(content: bytes) -> Any:
    """Return the content of a JSON text: if it has several objects, one per line, the first one; if it is a log, the
    record of the first problem."""
    text = decode(content)
    are_several = text.strip().partition("\n")[2].lstrip().startswith("{")
    return loaded(first_of(text.strip()) if are_several else text)
