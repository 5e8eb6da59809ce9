"""Problems in JSON: an object with M, q and, if known, other keys (see `lcp help
formats`), or a program or a game.

M is a list of rows, or {"format": "coo", "shape": [n, n], "rows": [...], "cols": [...],
"values": [...]} with indices from 0. origin is as in `lcpcli.Problem`. Numbers
are decimals, or texts such as "1/3", "1e-3" and "inf"; each key occurs only once.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from copy import copy
from functools import cache, cached_property, partial
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.errors import (
    CORRECT_THERE,
    ENDS_TOO_EARLY,
    IS_MISSING,
    KEEP_ONE,
    MAKE_AGREE,
    ProblemError,
    count,
    kind,
    quoted,
    visible_json,
)
from lcpcli.files.contents import decode, refuse_mostly_absent, within
from lcpcli.files.fields import (
    BOUNDS,
    KEYS,
    MATRICES,
    STARTS,
    kind_of,
    refuse_unknown,
    without_nulls,
)
from lcpcli.files.formats import Exact, Number, refuse
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model import formulations
from lcpcli.model.arrays import as_vector
from lcpcli.model.formulations import TEXTS
from lcpcli.typing import Matrix, Vector

if TYPE_CHECKING:
    from fractions import Fraction

# The keys whose values have no numbers, or are read by themselves.
WITHOUT_NUMBERS = {*TEXTS, "rows", "columns", "names", "sense", "verdict"}
WITHOUT_NUMBERS |= {"origin", *formulations.WORDED}
# The names in messages of numbers that are not rounded.
LOSSLESS = " or ".join(
    row.unrounded for row in formulations.TABLE.values() if row.unrounded
)
# The matrices that have such numbers, by the formulation.
KEPT_AS_WRITTEN = {
    kind: row.matrices for kind, row in formulations.TABLE.items() if row.unrounded
}
# Keys whose numbers may be rounded to 0: no answer depends on them.
ROUNDED = (*STARTS, "solution")
OF_COORDINATES = ("format", "shape", "rows", "cols", "values")
# A decimal of at most so many digits is the shortest decimal of the number that it is
# rounded to: double precision has at least 15 decimal digits.
DIGITS = 15
SHOWN = 12  # characters that a message shows of what is not JSON
SEVERAL = (
    "lcp solve takes a problem in each line; give other commands one line, as by "
    "sed -n 1p FILE | lcp inspect -"
)


class NumberText(str):
    """A number as written."""


class JsonText:
    """The value in a JSON text, parsed at most once in double precision and once as
    written."""

    def __init__(self, content: bytes) -> None:
        self.text = decode(content)

    @cached_property
    def _of_doubles(self) -> Any:
        return load(self.text)

    @cached_property
    def _as_written(self) -> Any:
        return load(self.text, NumberText)

    @cached_property
    def lossless(self) -> Any:
        return load(self.text, lossless)

    def value(self, number: Callable[[str], Any]) -> Any:
        if number is float:
            return self._of_doubles
        data = self._as_written
        if not isinstance(data, dict):
            return _converted(data, number)
        return {
            key: within(key, _converted, part, number) for key, part in data.items()
        }

    def without(self, keys: Collection[str]) -> JsonText:
        """Return the text with the value as written without these keys."""
        other = copy(self)
        if isinstance(self._as_written, dict):
            parts = self._as_written.items()
            other._as_written = {key: part for key, part in parts if key not in keys}
        return other

    def is_lossless(self) -> bool:
        """Return whether it has tables whose numbers are not rounded. The numbers of a
        text with other keys are not parsed for that."""
        if '"M"' in self.text:
            return False
        for of, matrices in KEPT_AS_WRITTEN.items():
            if not all(f'"{key}"' in self.text for key in matrices):
                continue
            data = self.lossless
            if isinstance(data, dict) and kind_of(data) == of:
                return all(_is_table(data.get(key)) for key in matrices)
        return False


def _converted(value: Any, number: Callable[[str], Any]) -> Any:
    """Return a value with its numbers, which are as written, converted."""
    if isinstance(value, NumberText):
        return number(value)
    if isinstance(value, list):
        return [_converted(part, number) for part in value]
    if isinstance(value, dict):
        return {key: _converted(part, number) for key, part in value.items()}
    return value


def parse(content: bytes) -> JsonText:
    return JsonText(content)


def fields(content: JsonText, number: Number = float) -> dict[str, Any]:
    """Return the fields of the object in a JSON text; a ProblemError names the field,
    or the line and column."""
    if content.is_lossless():
        return _with_numbers(content.lossless, lossless)
    data = content.value(number)
    if not isinstance(data, dict):
        raise ProblemError(
            "",
            f"is {kind(data)}",
            "give an object with the keys M and q, or one in each line",
        )
    if of := kind_of(data):
        data = _with_numbers(data, number)
        data |= {
            key: sparse_matrix(key, value)
            for key, value in data.items()
            if isinstance(value, dict) and key in MATRICES
        }
        if of not in KEPT_AS_WRITTEN:
            return data
        tables = _with_numbers(content.lossless, lossless)
        return data | _tables(tables, KEPT_AS_WRITTEN[of])
    refuse_unknown("", data, KEYS)
    data = without_nulls(_with_numbers(data, number))
    refuse("M" not in data, "M", IS_MISSING, "add the key M")
    data |= {key: as_vector(key, data[key]) for key in STARTS if key in data}
    if isinstance(data["M"], dict):
        data["M"] = sparse_matrix(
            "M", data["M"], as_vector("q", data["q"]).size if "q" in data else None
        )
    if "solution" in data:
        solutions = data["solution"]
        hint = "give a list of numbers, or a list of such lists"
        refuse(
            not isinstance(solutions, list), "solution", f"is {kind(solutions)}", hint
        )
        data["solution"] = (
            solutions if solutions and isinstance(solutions[0], list) else [solutions]
        )
    return data


def without_rounded(content: JsonText) -> JsonText:
    """Return the content without the keys whose numbers may be rounded to 0."""
    return content.without(ROUNDED)


def values(field: str, content: JsonText, number: Number = float) -> Any:
    """Return the numbers in a JSON list, or in the list of an object with this field
    alone."""
    data = content.value(number)
    is_field = isinstance(data, dict) and list(data) == [field]
    return numbers_in(data[field] if is_field else data, number)


def numbers_in(value: Any, number: Callable[[str], Any] = float) -> Any:
    """Return a value in which texts that represent numbers, such as "1/3", are replaced
    by these; other texts stay, and are refused where numbers are needed."""
    if isinstance(value, dict):
        return {key: numbers_in(part, number) for key, part in value.items()}
    if isinstance(value, list):
        # Lists and rows of numbers alone, which are usual, stay as they are.
        types = {*map(type, value)}
        if types == {list}:
            types = {*map(type, chain.from_iterable(value))}
        has_others = not types.isdisjoint((str, list))
        return [numbers_in(part, number) for part in value] if has_others else value
    if not isinstance(value, str):
        return value
    from lcpcli.rational import numbers

    to_double = numbers.double if number is float else number
    return to_double(value.strip()) if numbers.NUMBER.fullmatch(value) else value


def _with_numbers(
    data: Mapping[str, Any], number: Callable[[str], Any]
) -> dict[str, Any]:
    return {
        key: value if key in WITHOUT_NUMBERS else within(key, numbers_in, value, number)
        for key, value in data.items()
    }


def lossless(text: str) -> float | Fraction:
    """Return a number as written: a float, or a fraction if the shortest decimal of the
    float differs from it."""
    if "/" in text:
        from lcpcli.rational.numbers import ratio

        return _of_moderate_size(ratio(text), text)
    double = float(text)
    if (len(text) <= DIGITS and "e" not in text.casefold()) or not math.isfinite(
        double
    ):
        return double
    from lcpcli.rational.numbers import fraction

    return _of_moderate_size(fraction(text), text)


def _of_moderate_size(value: Fraction, text: str) -> float | Fraction:
    from fractions import Fraction

    exact = lossless_of(value)
    if (
        isinstance(exact, Fraction)
        and max(abs(exact.numerator), exact.denominator) >= 10**1000
    ):  # as that is slow
        raise ProblemError(
            "",
            f"has the {LOSSLESS} {quoted(text)}",
            "write it with at most 1000 digits",
        )
    return exact


def lossless_of(value: Fraction) -> Fraction | float:
    """Return a number as a float if it is the shortest decimal of this float, else as a
    fraction."""
    from fractions import Fraction

    with suppress(OverflowError):
        double = float(value)
        return double if Fraction(repr(double)) == value else value
    return value


def _is_table(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(row, list) for row in value)


def _tables(data: dict[str, Any], keys: Sequence[str]) -> dict[str, list[Any]]:
    tables: dict[str, list[Any]] = {}
    for key in keys:
        table = data.get(key)
        if isinstance(table, dict):
            m, k = map(int, table["shape"])
            refuse_mostly_absent(key, (m, k), m * k, len(table["values"]))
            tables[key] = np.zeros((m, k)).tolist()
            for i, j, value in zip(
                table["rows"], table["cols"], table["values"], strict=True
            ):
                tables[key][int(i)][int(j)] = value
        elif isinstance(table, list) and _is_table(table):
            tables[key] = table
    return tables


def load(text: str, number: Callable[[str], Any] = float) -> Any:
    try:
        return _decoder(number).decode(text)
    except json.JSONDecodeError as error:
        if (
            error.msg.startswith("Extra data")
            and text[error.pos] == "{"
            and error.lineno > 1
        ):
            raise ProblemError(
                f"line {error.lineno}",
                "has another object below the first one",
                SEVERAL,
            ) from None
        raise _syntax_error(text, error) from None
    except RecursionError:
        raise ProblemError(
            "", "is nested too deeply", "M needs two levels of brackets"
        ) from None


def _syntax_error(text: str, error: json.JSONDecodeError) -> ProblemError:
    """Return the error for the position at which json has stopped. Its messages, and
    where it reports an extra comma, differ between versions of Python."""
    position = f"line {error.lineno}, column {error.colno}"
    rest = text[error.pos :].lstrip()
    if rest in ("", "-") or error.msg.startswith("Unterminated string"):
        return ProblemError(position, ENDS_TOO_EARLY, "is the file cut off?")
    # From Python 3.13 on it stops at the comma, earlier behind it.
    at = error.pos if rest[0] == "," else len(text[: error.pos].rstrip()) - 1
    bracket = text[at + 1 :].lstrip()[:1]
    if text[at : at + 1] == "," and bracket in ("]", "}"):
        column = at - text.rfind("\n", 0, at)
        position = f"line {text.count(chr(10), 0, at) + 1}, column {column}"
        return ProblemError(position, f"has a comma before {bracket}", "remove it")
    seen = quoted(text[error.pos : error.pos + SHOWN])
    return ProblemError(position, f"is not JSON from {seen} on", CORRECT_THERE)


def objects_in(text: str) -> list[str]:
    """Return the texts of the objects in a JSON list, as several results are in a .json
    file; else the lines of a text that are not blank, as in JSON lines."""
    stripped, objects = text.strip(), list[str]()
    decode, end = json.JSONDecoder().raw_decode, 1
    with suppress(ValueError, RecursionError):
        while stripped.startswith("[") and stripped.endswith("]"):
            while stripped[end] in " \t\r\n,":
                end += 1
            if end == len(stripped) - 1 and objects:
                return objects
            begin = end
            value, end = decode(stripped, begin)
            if not isinstance(value, dict):
                break
            objects.append(stripped[begin:end])
    return [line for line in text.split("\n") if line.strip()]


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    data = dict(pairs)
    if len(data) < len(pairs):
        twice = Counter(name for name, _ in pairs).most_common(1)[0][0]
        raise ProblemError(twice, "occurs twice", KEEP_ONE)
    return data


@cache
def _decoder(number: Callable[[str], Any]) -> json.JSONDecoder:
    return json.JSONDecoder(
        parse_int=number,
        parse_float=number,
        parse_constant=number,
        object_pairs_hook=_object,
    )


def sparse_matrix(
    field: str, coordinates: dict[str, Any], n: int | None = None
) -> Matrix:
    """Return the sparse matrix, after checking that its indices fit its shape, which is
    n x n unless n is None."""
    from lcpcli.linalg.patterns import invalid_indices

    refuse_unknown(field, coordinates, OF_COORDINATES)
    for key in OF_COORDINATES:
        refuse(
            key not in coordinates, f"{field}.{key}", IS_MISSING, f"add the key {key}"
        )
    refuse(
        coordinates["format"] != "coo",
        f"{field}.format",
        f"is {kind(coordinates['format'])}",
        'the only format is "coo"',
    )
    shape, values = (
        as_vector(f"{field}.{key}", coordinates[key]) for key in ("shape", "values")
    )
    rows, cols = (
        as_vector(f"{field}.{key}", coordinates[key], values.size, "value")
        for key in ("rows", "cols")
    )
    where = f"{field}.shape"
    declared = " x ".join(f"{side:g}" for side in shape) or "empty"
    is_other = n is not None and (shape.size != 2 or (shape != n).any())
    refuse(
        is_other,
        where,
        f"is {declared} but q has {count(n or 0, 'entry')}",
        MAKE_AGREE,
    )
    refuse(
        shape.size != 2 or invalid_indices(shape, 2**31 - 1).size,
        where,
        f"is {declared}",
        "give two integers from 0",
    )
    m, k = map(int, shape)
    refuse_mostly_absent(field, (m, k), max(m, k), values.size)
    return of_coordinates(field, values, rows, cols, (m, k), 0).tocsr()


def of_coordinates(
    field: str, values: Vector, rows: Any, cols: Any, shape: tuple[int, int], first: int
) -> Matrix:
    """Return the sparse matrix in scipy's coordinate form; raise ProblemError for an
    index out of range, or for an entry that occurs twice.
    rows, cols : the indices of the values, counted from `first`."""
    from scipy.sparse import coo_array

    from lcpcli.linalg.patterns import invalid_indices

    def refuse_entry(key: str, at: int, reason: str, hint: str) -> None:
        # Matrix Market has no such keys.
        where = field if first else f"{field}.{key}[{at}]"
        raise ProblemError(
            where, f"has the entry ({rows[at]:.15g}, {cols[at]:.15g}) {reason}", hint
        )

    for key, indices, size in (("rows", rows, shape[0]), ("cols", cols, shape[1])):
        hint = (
            f"give integers from {first} to {size - 1 + first}"
            if size
            else "leave it empty"
        )
        for at in invalid_indices(indices - first, size)[:1]:
            refuse_entry(key, at, f"and is {shape[0]} x {shape[1]}", hint)
    order = np.lexsort((cols, rows))
    again = np.flatnonzero((np.diff(rows[order]) == 0) & (np.diff(cols[order]) == 0))
    for at in order[again[:1] + 1]:
        refuse_entry(
            "rows", at, "again", f"give every entry once (indices count from {first})"
        )
    return coo_array(
        (values, (rows.astype(np.intp) - first, cols.astype(np.intp) - first)),
        shape=shape,
    )


def render(fields: Mapping[str, Any], exact: Exact) -> dict[str, bytes]:
    number = partial(number_text, exact)
    lines = []
    for key, value in fields.items():
        is_same = key in BOUNDS and "M" in fields and (value == value[0]).all()
        lines.append(
            f'  "{key}": {_text(value[0].item() if is_same else value, number)}'
        )
    return {
        "": "\n".join(["{", ",\n".join(lines), "}", ""]).encode(
            errors="backslashreplace"
        )
    }


def _text(value: Any, number: Callable[[float], str]) -> str:
    if isinstance(value, float):
        return number(value)
    if isinstance(value, list) and isinstance(value[0], np.ndarray):
        return f"[{', '.join(_text(each, number) for each in value)}]"
    if is_sparse(value):
        coo = value.tocoo()
        parts = {"rows": coo.row, "cols": coo.col, "values": coo.data}
        lists = ",\n    ".join(
            f'"{key}": {_text(part, number)}' for key, part in parts.items()
        )
        return (
            f'{{\n    "format": "coo", "shape": [{value.shape[0]}, '
            f"{value.shape[1]}],\n    {lists}\n  }}"
        )
    if not isinstance(value, np.ndarray):
        return visible_json(json.dumps(value, ensure_ascii=False))
    if value.ndim == 2:
        return "[\n    " + ",\n    ".join(_text(row, number) for row in value) + "\n  ]"
    if value.dtype != object:
        return "[" + ", ".join(map(number, value.tolist())) + "]"
    return f"[{', '.join(map(_exact_text, value))}]"


def _exact_text(value: Fraction) -> str:
    """Return a rational number in JSON, a text such as "1/3" if it is no decimal."""
    from lcpcli.rational.numbers import decimal, places, text

    return json.dumps(text(value)) if places(value) is None else decimal(value)


def number_text(
    exact: Exact, x: float, exactly: Callable[[Fraction], str] = _exact_text
) -> str:
    """Return a number as a text. exactly : writes a number that x represents."""
    if x in exact:
        return exactly(exact[x])
    if math.isinf(x):
        return "null"
    return f"{x:.0f}" if x == int(x) and abs(x) < 1e15 else repr(x)
