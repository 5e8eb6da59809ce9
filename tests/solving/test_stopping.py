"""A stopping rule of another package, by its name on the command line."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

from lcpcli.solving import stopping
from lcpcli.solving.trace import TraceRow

EXAMPLE = ("paper-example-1", "--method", "fixed-point")
Lcp = Callable[..., Any]


@pytest.fixture(autouse=True)
def rules(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rules of a package toys."""

    def third(row: TraceRow) -> bool:
        return row.k == 3

    def done(_: TraceRow) -> bool:
        raise StopIteration

    def wrong(row: TraceRow) -> bool:
        raise KeyError(row.k)

    known = {"third": third, "done": done, "wrong": wrong, "number": 3}
    monkeypatch.setattr(stopping, "addition", lambda _, name: known.get(name))
    monkeypatch.setattr(stopping, "names", lambda _: set(known))
    monkeypatch.setattr(stopping, "package", lambda *_: "toys 1.0")


def test_it_ends_a_run_with_the_best_iterate_and_as_not_solved(lcp: Lcp) -> None:
    outcome = lcp("solve", *EXAMPLE, "--stop", "third", "--format", "json")
    record = json.loads(outcome.out)
    assert outcome.code == 1
    assert (record["status"], record["iterations"]) == ("interrupted", 3)
    assert record["message"].startswith("interrupted: by the stopping rule third of toys 1.0")
    assert json.loads(lcp("solve", *EXAMPLE, "--stop", "done", "--format", "json").out)["iterations"] == 1


def test_it_ends_each_of_many_and_of_those_compared(lcp: Lcp) -> None:
    outcome = lcp("solve", *EXAMPLE, "two-unknowns", "--stop", "third", "--format", "json")
    assert [json.loads(line)["iterations"] for line in outcome.out.splitlines()] == [3, 3]
    assert outcome.code == 1
    compared = lcp("compare", *EXAMPLE, "--method", "shi", "--stop", "third", "--format", "json").out
    assert {json.loads(line)["iterations"] for line in compared.splitlines()} == {3}


def test_an_error_in_it_is_a_breakdown_that_names_the_package(lcp: Lcp) -> None:
    record = json.loads(lcp("solve", *EXAMPLE, "--stop", "wrong", "--format", "json").out)
    assert record["status"] == "breakdown"
    assert "the stopping rule wrong of toys 1.0 raises KeyError: 1" in record["message"]


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--stop", "thrid"], "lcp: --stop: 'thrid' is unknown; did you mean third?"),
        (["--stop", "number"], "lcp: --stop: number of toys 1.0 is not a function"),
        (["--stop", "third", "-o", "log.jsonl"], "lcp: --stop: cannot be used with a log, as --resume would"),
    ],
)
def test_it_is_refused_in_one_line(arguments: list[str], line: str, lcp: Lcp) -> None:
    outcome = lcp("solve", *EXAMPLE, *arguments)
    assert outcome.code == 2
    assert outcome.err.startswith(line)
    assert outcome.err.count("\n") == 1


def test_without_a_package_that_adds_one_the_page_is_named(lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stopping, "names", lambda _: set())
    assert "no installed package adds one; see lcp help development" in lcp("solve", *EXAMPLE, "--stop", "x").err
