"""Proposed solutions in files: a z to be verified, or a Farkas vector, with all digits.

Results in JSON or CSV as `lcp solve` writes them, of several the first; lists in JSON; rows and columns of numbers;
several in what `lcp solve --all` writes in JSON. Of a game they may be strategies, in JSON under row and column.
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

    kind : "solution", a z, or strategies of a game one after the other; "farkas", a vector y meant to prove that there
        is no solution.
    values : the entries, with all digits.
    exact : whether they come from exact arithmetic, unrounded.
    w : the w given with exact values; else None.
    claim : a claim of the result that the vector cannot verify; "" if there is none.
    rows : how many of the values are of the row player's strategy, where it is given as one; else None.
    """

    kind: Literal["solution", "farkas"]
    values: list[Fraction]
    exact: bool = False
    w: list[Fraction] | None = None
    claim: str = ""
    rows: int | None = None


def of_json(content: bytes, n: int) -> list[Candidate]:
    """The candidates, of n entries, in a JSON text: several in what lcp solve --all writes."""
    held = load_first(decode(content), fraction)
    solutions = held.get("solutions") if isinstance(held, dict) and "z" not in held else None
    if not isinstance(solutions, list):
        return [_of_held(held, n)]
    if not solutions:
        raise ProblemError("solutions", "is empty", "give a solution to check")
    return [_of_listed(f"solutions[{i}]", each, n) for i, each in enumerate(solutions)]


def _of_listed(field: str, held: Any, n: int) -> Candidate:
    """The candidate in one of several solutions."""
    strategies = held.get("equilibrium") if isinstance(held, dict) else None
    try:
        return _of_held(held if strategies is None else strategies, n)
    except ProblemError as error:
        raise error.inside(field) from None


def _of_held(held: Any, n: int) -> Candidate:
    """The candidate in the content of a JSON text."""
    if isinstance(held, list):
        return Candidate("solution", _listed("", held, n))
    if isinstance(held, dict) and "z" not in held and {"row", "column"} <= set(held):
        row, column = (_entries(player, held[player]) for player in ("row", "column"))
        return Candidate("solution", [*row, *column], rows=len(row))
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
    return _of_length(field or "z", _entries(field, values), n)


def _entries(field: str, values: Any) -> list[Fraction]:
    if not isinstance(values, list):
        raise ProblemError(field, f"is {kind(values)}", "give a list of numbers")
    return [_entry(f"{field}[{i}]", value) for i, value in enumerate(values)]


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
