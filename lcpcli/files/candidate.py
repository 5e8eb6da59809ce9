"""Proposed solutions in files: a z to be verified, or a Farkas vector, with all digits.

Results in JSON or CSV as `lcp solve` writes them, of several the first; lists in JSON; rows and columns of numbers.
Besides decimals, fractions like 15/29 are read, in JSON as strings. Of a result with exact vectors, these are read.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any, Literal, NamedTuple

from lcpcli.errors import ProblemError, count, kind
from lcpcli.files import csv_answer
from lcpcli.files.content import decode
from lcpcli.files.json_format import load_first
from lcpcli.model.arrays import FROM_0
from lcpcli.rational.numbers import fraction, ratio

EXPECTED = "give a list of numbers, or what lcp solve --format json prints"


class Candidate(NamedTuple):
    """A proposed solution or proof of infeasibility, to be verified.

    kind : "solution", a z; "farkas", a vector y meant to prove that there is no solution.
    values : the entries, with all digits.
    exact : whether they come from exact arithmetic, unrounded.
    w : the w given with exact values; else None.
    claim : a claim of the result that the vector cannot verify; "" if there is none.
    """

    kind: Literal["solution", "farkas"]
    values: list[Fraction]
    exact: bool = False
    w: list[Fraction] | None = None
    claim: str = ""


def of_json(content: bytes, n: int) -> Candidate:
    """The candidate, of n entries, in a JSON text."""
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
    claim = "its claimed proof by exhaustion has no certificate to check" * (certificate.get("kind") == "exhaustion")
    return Candidate("solution", _listed("z", held["z"], n), claim=claim)


def of_text(content: bytes, n: int) -> Candidate:
    """The z, of n entries, in a text as `csv_answer` describes it."""
    return Candidate("solution", _of_length("z", csv_answer.parse(content).z, n))


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
        raise ProblemError(field, f"is {kind(value)}", f"give a number, or a fraction as a string {FROM_0}")
    try:
        return ratio(value)
    except ProblemError as error:
        raise error.inside(field) from None


def _of_length(field: str, values: list[Fraction], n: int) -> list[Fraction]:
    if len(values) != n:
        raise ProblemError(field, f"has {count(len(values), 'entry')} for {count(n, 'unknown')}", "make them agree")
    return values
