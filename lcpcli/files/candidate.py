"""What a file offers as an answer: a z to be judged, or a Farkas vector, with all its digits.

Results in JSON as `lcp solve` writes them, of several the first; lists in JSON; one row or one column of numbers. Next
to decimals, fractions like 15/29 are read, in JSON as texts. A result that holds exact vectors stands for these.
"""

from __future__ import annotations

import re
from fractions import Fraction
from typing import Any, Literal, NamedTuple

from lcpcli.errors import ProblemError, count, kind
from lcpcli.files.csv_format import NUMERIC, is_number
from lcpcli.files.json_format import load_first
from lcpcli.files.text import decode
from lcpcli.rational.numbers import fraction, ratio

EXPECTED = "give a list of numbers, or what lcp solve --format json prints"
PARTING = re.compile(r"[\s,;]+")


class Candidate(NamedTuple):
    """An answer to be judged.

    kind : "solution", a z; "farkas", a vector y that is to prove that there is none.
    values : the entries, with all digits.
    exact : whether they are rational numbers from exact arithmetic, and not rounded ones.
    w : where exact values come with their w, these; else None.
    claim : what the result says of itself that cannot be judged by the vector; "" if nothing.
    """

    kind: Literal["solution", "farkas"]
    values: list[Fraction]
    exact: bool = False
    w: list[Fraction] | None = None
    claim: str = ""


def of_json(content: bytes, n: int) -> Candidate:
    """The answer, of n entries, in a JSON text."""
    held = load_first(decode(content), fraction)
    if isinstance(held, list):
        return Candidate("solution", _listed("", held, n))
    if not isinstance(held, dict) or "z" not in held:
        raise ProblemError("", "is an object without z" if isinstance(held, dict) else f"is {kind(held)}", EXPECTED)
    exact, certificate = _part(held, "exact"), _part(held, "certificate")
    if exact.get("y") is not None:
        return Candidate("farkas", _listed("exact.y", exact["y"], n), exact=True)
    if exact.get("z") is not None:
        w = None if exact.get("w") is None else _listed("exact.w", exact["w"], n)
        return Candidate("solution", _listed("exact.z", exact["z"], n), exact=True, w=w)
    if certificate.get("kind") == "farkas":
        return Candidate("farkas", _listed("certificate.vector", certificate.get("vector"), n))
    claim = "the proof by exhaustion that it claims holds nothing to check" * (certificate.get("kind") == "exhaustion")
    return Candidate("solution", _listed("z", held["z"], n), claim=claim)


def of_text(content: bytes, n: int) -> Candidate:
    """The z, of n entries, in a text of one row or one column of decimals and fractions."""
    lines = [(k, line.strip()) for k, line in enumerate(decode(content).splitlines(), 1)]
    rows = [(k, PARTING.split(line.strip(",;"))) for k, line in lines if line and line[0] != "#"]
    if rows and not any(is_number(entry) or NUMERIC.match(entry) for entry in rows[0][1]):
        del rows[0]
    if len(rows) > 1 and any(len(row) > 1 for _, row in rows):
        raise ProblemError(
            "", f"has {len(rows)} rows of several columns", "give one row or one column, or a result in JSON"
        )
    values = []
    for k, row in rows:
        for entry in row:
            try:
                values.append(ratio(entry))
            except ProblemError as error:
                raise error.inside(f"line {k}") from None
    return Candidate("solution", _of_length("z", values, n))


def _part(held: dict[str, Any], key: str) -> dict[str, Any]:
    part = held.get(key)
    return part if isinstance(part, dict) else {}


def _listed(field: str, values: Any, n: int) -> list[Fraction]:
    if not isinstance(values, list):
        raise ProblemError(field, f"is {kind(values)}", "give a list of numbers")
    return _of_length(field or "z", [_entry(f"{field}[{i}]", value) for i, value in enumerate(values)], n)


def _entry(field: str, value: Any) -> Fraction:
    if isinstance(value, Fraction):
        return value
    if not isinstance(value, str):
        raise ProblemError(field, f"is {kind(value)}", "give a number, or a fraction as a text")
    try:
        return ratio(value)
    except ProblemError as error:
        raise error.inside(field) from None


def _of_length(field: str, values: list[Fraction], n: int) -> list[Fraction]:
    if len(values) != n:
        raise ProblemError(field, f"has {count(len(values), 'entry')} for {count(n, 'unknown')}", "make them agree")
    return values
