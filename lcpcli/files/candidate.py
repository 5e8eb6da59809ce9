"""Proposed solutions in files: a z to be verified, or a Farkas vector, with all digits.

Results in JSON or CSV as `lcp solve` writes them, of several in JSON lines that of the problem, else the first; lists
in JSON; rows and columns of numbers; several in what `lcp solve --all` writes. Of a game they may be strategies, in
JSON under row and column.
Besides decimals, fractions like 15/29 are read, in JSON as strings. Of a result with exact vectors, these are read.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any, Literal, NamedTuple

from lcpcli.errors import ProblemError, count, kind
from lcpcli.files import csv_answer
from lcpcli.files.content import decode
from lcpcli.files.json_format import load
from lcpcli.files.log import record_of
from lcpcli.model.arrays import FROM_0
from lcpcli.rational.numbers import fraction, ratio

Lengths = Mapping[int, str]  # what may be given, by its length
EXPECTED = "give a list of numbers, or what lcp solve --format json prints"


class Candidate(NamedTuple):
    """A proposed solution or proof of infeasibility, to be verified.

    kind : "solution", a z, strategies of a game one after the other, or what else may be given by its length; "answer",
        x or x and y of a program, in its own sense; "farkas", a vector y meant to prove that there is no solution.
    values : the entries, with all digits.
    exact : whether they come from exact arithmetic, unrounded.
    w : the w given with exact values; else None.
    claim : a claim of the result that the vector cannot verify; "" if there is none.
    rows : how many of the values are of the row player's strategy, where it is given as one; else None.
    remark : which of several results it is, where that may not be the one that was meant; else "".
    """

    kind: Literal["solution", "answer", "farkas"]
    values: list[Fraction]
    exact: bool = False
    w: list[Fraction] | None = None
    claim: str = ""
    rows: int | None = None
    remark: str = ""


def of_json(content: bytes, lengths: Lengths, name: str) -> list[Candidate]:
    """The candidates, of one of these lengths, the first of which is n, in a JSON text: several in what lcp solve --all
    writes. name : of the problem."""
    text, remark = record_of(decode(content), name)
    held = load(text, fraction)
    solutions = held.get("solutions") if isinstance(held, dict) and "z" not in held else None
    if not isinstance(solutions, list):
        return [_of_held(held, lengths)._replace(remark=remark)]
    if not solutions:
        raise ProblemError("solutions", "is empty", "give a solution to check")
    return [_of_listed(f"solutions[{i}]", each, lengths) for i, each in enumerate(solutions)]


def _of_listed(field: str, held: Any, lengths: Lengths) -> Candidate:
    """The candidate in one of several solutions."""
    strategies = held.get("equilibrium") if isinstance(held, dict) else None
    try:
        return _of_held(held if strategies is None else strategies, lengths)
    except ProblemError as error:
        raise error.inside(field) from None


def _of_held(held: Any, lengths: Lengths) -> Candidate:
    """The candidate in the content of a JSON text."""
    n = next(iter(lengths))
    if isinstance(held, list):
        return Candidate("solution", _listed("", held, lengths))
    if isinstance(held, dict) and "z" not in held and {"row", "column"} <= set(held):
        row, column = (_entries(player, held[player]) for player in ("row", "column"))
        return Candidate("solution", [*row, *column], rows=len(row))
    if isinstance(held, dict) and "x" in lengths.values() and (answer := _answer(held, n)):
        return Candidate("answer", _of_program(*answer, lengths))
    return _of_result(held, {n: "z"})


def _answer(held: dict[str, Any], n: int) -> tuple[str, dict[str, Any]] | None:
    """Where an object has x, and y, of a program, and these; None if it has none, or a z of n entries."""
    if isinstance(held.get("z"), list) and len(held["z"]) == n:
        return None
    inner = _part(held, "answer")
    return next(((at, part) for at, part in (("", held), ("answer.", inner)) if part.get("x") is not None), None)


def _of_program(at: str, held: dict[str, Any], lengths: Lengths) -> list[Fraction]:
    """x, and y if it is there."""
    both, k = [*lengths, *lengths][-2:]
    if held.get("y") is None:
        return _listed(f"{at}x", held["x"], {k: "x"})
    return [*_listed(f"{at}x", held["x"], {k: "x"}), *_listed(f"{at}y", held["y"], {both - k: "y"})]


def _of_result(held: Any, n: Lengths) -> Candidate:
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


def of_text(content: bytes, lengths: Lengths) -> list[Candidate]:
    """Each z, of one of these lengths, or each pair of strategies in a text as `csv_answer` describes it."""
    return [
        Candidate("solution", of_length("z", each.z, lengths) if each.rows is None else each.z, rows=each.rows)
        for each in csv_answer.answers(content)
    ]


def _part(held: dict[str, Any], key: str) -> dict[str, Any]:
    part = held.get(key)
    return part if isinstance(part, dict) else {}


def _listed(field: str, values: Any, lengths: Lengths) -> list[Fraction]:
    return of_length(field or "z", _entries(field, values), lengths)


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


def of_length(field: str, values: list[Fraction], lengths: Lengths) -> list[Fraction]:
    """The values, or a ProblemError if their number is none of the lengths."""
    if len(values) in lengths:
        return values
    n, own = next(iter(lengths.items()))
    fault = f"has {count(len(values), 'entry')} for {own if own.endswith('strategies') else count(n, 'unknown')}"
    if len(lengths) == 1:
        raise ProblemError(field, fault, "make them agree")
    allowed = [f"{size} for {what}" for size, what in sorted(lengths.items())]
    raise ProblemError(field, fault, f"give {', '.join(allowed[:-1])} or {allowed[-1]}")
