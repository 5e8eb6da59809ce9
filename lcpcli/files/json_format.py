"""Problems in JSON: an object with M, q and, if known, lower, upper, name, x0, x1, solution, verdict, source, note and
origin; or one that holds a program or a game, as in `origins`.

M is a list of rows, or {"format": "coo", "shape": [n, n], "rows": [...], "cols": [...], "values": [...]} with
indices from 0. lower and upper are numbers, null for no bound, or lists of these. solution is one z or a list of them;
origin is as in `lcpcli.model.origins`. Numbers are decimal; each key occurs once.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Callable
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any

from lcpcli.errors import ProblemError, kind, quoted
from lcpcli.files import coordinates, origins
from lcpcli.files.content import decode
from lcpcli.files.formats import NEAREST
from lcpcli.files.keys import BOUNDS, KEYS, TEXTS, refuse_unknown
from lcpcli.files.log import first_of
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.arrays import as_vector
from lcpcli.model.origins import OwnNames
from lcpcli.model.problem import Problem
from lcpcli.model.program import names_of
from lcpcli.typing import Matrix, Vector

MATRICES = ("Q", "P", "A", "G", "B")  # of programs and games
SHORTEST = 15  # digits that every double has
LARGEST = 10**1000  # what payoffs and their denominators stay below
SEVERAL = (
    "lcp solve takes a problem in each line; give other commands one of them, as by sed -n 1p FILE | lcp inspect -"
)
FAULTS = {  # by how Python's message about a text that is not JSON begins
    "Expecting value": "a value is expected there",
    "Expecting ','": "a comma or a closing bracket is expected there",
    "Expecting ':'": "a colon is expected there",
    "Expecting property name": "a key in double quotes is expected there",
    "Illegal trailing comma": "nothing follows the comma there",
    "Extra data": "more text follows its end",
    "Unterminated string": "a text that begins there has no end",
    "Invalid control character": "a text has a tab or the end of a line in it",
    "Invalid \\": "a backslash is followed by what JSON does not allow",
}

if TYPE_CHECKING:
    from lcpcli.files.formats import Exact, Number
    from lcpcli.rational.problem import ExactParts


def parse(content: bytes, number: Number = float) -> Problem:
    """The problem in a JSON text, or a ProblemError that names the field or the line and column.

    number : makes the doubles of its numbers.
    """
    data = load(decode(content), number)
    if not isinstance(data, dict):
        raise ProblemError("", f"is {kind(data)}", "give an object with the keys M and q, or one in each line")
    if told := origins.kind_of(data):
        for key in [key for key in MATRICES if isinstance(data.get(key), dict)]:
            data[key] = coordinates.matrix(key, data[key])
        return origins.made(data if told == "program" else data | _payoffs(load(decode(content), payoff)))
    refuse_unknown("", data, KEYS)
    for key in ("M", "q"):
        if key not in data:
            raise ProblemError(key, "is missing", f"add the key {key}")
    fields = {key: data[key] for key in (*TEXTS, *BOUNDS, "x0", "x1", "origin") if key in data}
    if "names" in data:
        fields["names"] = names_of("names", data["names"])
    for key in ("x0", "x1"):
        if key in fields and not isinstance(fields[key], list):
            raise ProblemError(key, f"is {kind(fields[key])}", "give a list of numbers")
    M = data["M"]
    if isinstance(M, dict):
        M = coordinates.matrix("M", M, as_vector("q", data["q"]).size)
    return Problem(M, data["q"], solutions=_solutions(data), **fields)


def parse_vector(field: str, content: bytes, n: int | None = None, number: Number = float) -> Vector:
    """A vector of length n, any length if None, written as a JSON list."""
    return as_vector(field, load(decode(content), number), n)


def parse_exact(content: bytes) -> ExactParts:
    """A problem that `parse` has accepted, with all decimals."""
    from lcpcli.rational.problem import exact_parts

    return exact_parts(lambda number: parse(content, number))


def payoff(text: str) -> float | Fraction:
    """A payoff as it is written: the nearest double, or a fraction where that has another shortest decimal."""
    double = float(text)
    if (len(text) <= SHORTEST and "e" not in text.casefold()) or not math.isfinite(double):
        return double
    from lcpcli.rational.numbers import fraction

    exact = fraction(text)
    if exact == Fraction(repr(double)):
        return double
    if max(abs(exact.numerator), exact.denominator) >= LARGEST:
        raise ProblemError("", f"has the payoff {quoted(text)}", "write it with at most 1000 digits")
    return exact


def _payoffs(data: dict[str, Any]) -> dict[str, list[Any]]:
    """The payoffs that are tables, entries in coordinates put in their places."""
    tables: dict[str, list[Any]] = {}
    for key in ("A", "B"):
        held = data.get(key)
        if isinstance(held, dict):
            m, k = map(int, held["shape"])
            tables[key] = [[0.0] * k for _ in range(m)]
            for i, j, value in zip(held["rows"], held["cols"], held["values"], strict=True):
                tables[key][int(i)][int(j)] = value
        elif isinstance(held, list) and all(isinstance(row, list) for row in held):
            tables[key] = held
    return tables


def fraction_or_none(text: str) -> Fraction | None:
    """A number with all decimals; None if it is infinite, as bounds may be."""
    from lcpcli.rational.numbers import fraction

    return None if "Infinity" in text else fraction(text)


def parse_exact_vector(field: str, content: bytes) -> list[Fraction]:
    """A JSON list that `parse_vector` has accepted, with all decimals."""
    from lcpcli.rational.numbers import exact_vector

    return exact_vector(lambda number: parse_vector(field, content, None, number))


def parse_result(field: str, content: bytes, n: int) -> tuple[Vector, Vector]:
    """z and w, of length n, of a result as `lcp solve --format json` has it; the first of several lines."""
    result = load_first(decode(content))
    if not {"z", "w"} <= set(result):
        raise ProblemError(
            field, "is an object without z and w", "give a list of numbers, or what lcp solve --format json prints"
        )
    try:
        return as_vector("z", result["z"], n), as_vector("w", result["w"], n)
    except ProblemError as error:
        raise error.inside(field) from None


def load_first(text: str, number: Callable[[str], Any] = float) -> Any:
    """The content of a JSON text, its numbers read by `number`; of several objects, one per line, the first, in a log
    that of the first problem."""
    _, _, rest = text.strip().partition("\n")
    return load(first_of(text.strip()) if rest.lstrip().startswith("{") else text, number)


def load(text: str, number: Callable[[str], Any] = float) -> Any:
    """The content of a JSON text, its numbers read by `number`."""
    try:
        return json.loads(text, parse_int=number, parse_float=number, parse_constant=number, object_pairs_hook=_object)
    except json.JSONDecodeError as error:
        if error.msg.startswith("Extra data") and text[error.pos] == "{" and error.lineno > 1:
            raise ProblemError(f"line {error.lineno}", "has another object below the first one", SEVERAL) from None
        place = f"line {error.lineno}, column {error.colno}"
        faults = (f" ({fault})" for message, fault in FAULTS.items() if error.msg.startswith(message))
        raise ProblemError(place, f"is not JSON{next(faults, '')}", "correct it there") from None
    except RecursionError:
        raise ProblemError("", "is nested too deeply", "M needs two levels of brackets") from None


def render(problem: Problem, exact: Exact = NEAREST) -> dict[str, bytes]:
    """The problem as a JSON text that `parse` reads back to the same numbers; one row of a dense M per line.

    exact : what doubles stand for.
    """
    number = partial(number_text, exact)
    lines = [
        f'"{key}": {json.dumps(getattr(problem, key))}' for key in ("name", "source", "note") if getattr(problem, key)
    ]
    lines.append(f'"M": {matrix_text(problem.M, number)}')
    lines.append(f'"q": {list_text(problem.q, number)}')
    if problem.is_mixed:
        lines += [f'"{key}": {_bound_text(getattr(problem, key), number)}' for key in BOUNDS]
    starts = {key: getattr(problem, key) for key in ("x0", "x1")}
    lines += [f'"{key}": {list_text(start, number)}' for key, start in starts.items() if start is not None]
    if problem.solutions:
        rendered = ", ".join(list_text(z, number) for z in problem.solutions)
        lines.append(f'"solution": {rendered if len(problem.solutions) == 1 else f"[{rendered}]"}')
    if problem.verdict:
        lines.append(f'"verdict": "{problem.verdict}"')
    if isinstance(problem.origin, OwnNames):
        lines.append(f'"names": {json.dumps(problem.names)}')
    elif problem.origin is not None:
        lines.append(f'"origin": {json.dumps(problem.origin.data())}')
    return {"": object_text(lines)}


def object_text(lines: list[str]) -> bytes:
    """An object of lines with a key and a value each."""
    body = ",\n  ".join(lines)
    return f"{{\n  {body}\n}}\n".encode()


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    data = dict(pairs)
    if len(data) < len(pairs):
        twice = next(name for name, times in Counter(name for name, _ in pairs).items() if times > 1)
        raise ProblemError(twice, "occurs twice", "keep one")
    return data


def _solutions(data: dict[str, Any]) -> list[Any]:
    if "solution" not in data:
        return []
    solution = data["solution"]
    if not isinstance(solution, list):
        raise ProblemError("solution", f"is {kind(solution)}", "give a list of numbers, or a list of such lists")
    return solution if solution and isinstance(solution[0], list) else [solution]


def list_text(v: Any, number: Callable[[float], str]) -> str:
    """A vector as a list."""
    return "[" + ", ".join(map(number, v.tolist())) + "]"


def _bound_text(bound: Vector, number: Callable[[float], str]) -> str:
    """One number if all bounds are the same, null for none."""
    values = list(map(number, bound.tolist()))
    return values[0] if len(set(values)) == 1 else f"[{', '.join(values)}]"


def number_text(exact: Exact, x: float) -> str:
    """What a double stands for; null if it is infinite."""
    if x in exact:
        from lcpcli.rational.numbers import decimal

        return decimal(exact[x])
    return "null" if math.isinf(x) else f"{x:.0f}" if x == int(x) and abs(x) < 1e15 else repr(x)


def matrix_text(M: Matrix, number: Callable[[float], str]) -> str:
    """A matrix as a list of rows, or by coordinates."""
    if not is_sparse(M):
        return "[\n    " + ",\n    ".join(list_text(row, number) for row in M) + "\n  ]"
    coo = M.tocoo()
    parts = {"rows": coo.row, "cols": coo.col, "values": coo.data}
    lists = ",\n    ".join(f'"{key}": {list_text(values, number)}' for key, values in parts.items())
    return f'{{\n    "format": "coo", "shape": [{M.shape[0]}, {M.shape[1]}],\n    {lists}\n  }}'
