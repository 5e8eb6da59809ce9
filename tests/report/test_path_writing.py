"""A path that is written part by part as it is found is the path that is written as a whole."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

from lcpcli import Path, Problem
from lcpcli.parametric import following
from lcpcli.parametric.family import Family
from lcpcli.report.path_formats import KEYS
from lcpcli.report.path_writing import WRITERS

from ..parametric.families import positive
from .path_samples import cornered, frontier, small_in_fractions, written

AT = (0.1, 0.7)


def in_parts(form: str, first: Problem, last: Problem, monkeypatch: pytest.MonkeyPatch) -> tuple[str, int]:
    """Return a text that is written part by part, and the number of parts."""
    texts, taken = list[str](), list[Path]()
    writer = WRITERS[form](AT, ("a", "b"), texts.append)

    def take(part: Path) -> Callable[[], None]:
        taken.append(part)
        return writer.part(part)

    monkeypatch.setattr(following, "WRITTEN_AT_ONCE", 1)
    writer.end(following.follow(Family(first, last), take=take))
    return "".join(texts), len(taken)


def whole(form: str, first: Problem, last: Problem) -> str:
    return written(form, following.follow(Family(first, last)), *AT)


def without_seconds(text: str) -> list[dict[str, Any]]:
    return [{**json.loads(line), "seconds": 0} for line in text.splitlines()]


@pytest.mark.parametrize("form", ["json", "jsonl"])
def test_json_in_parts_is_the_same(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    first, last = positive(30, 40, 40)
    expected = without_seconds(whole(form, first, last))
    text, number = in_parts(form, first, last, monkeypatch)
    assert number > 2
    assert without_seconds(text) == expected


def test_csv_in_parts_has_its_verdict_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    first, last = positive(30, 40, 40)
    expected = whole("csv", first, last).splitlines()
    lines = in_parts("csv", first, last, monkeypatch)[0].splitlines()
    assert lines[1] == "# the last line says how the path ends"
    assert [lines[0], lines[-1], *lines[2:-1]] == expected


@pytest.mark.parametrize("path", [small_in_fractions, frontier, cornered])
def test_lines_have_what_the_object_has(path: Any) -> None:
    own = json.loads(written("json", path()))
    *points, end = (json.loads(line) for line in written("jsonl", path()).splitlines())
    assert [point["breakpoint"] for point in points] == list(range(1, len(own["t"]) + 1))
    assert end["breakpoints"] == len(points)
    for name in ("t", "z", "w", "changes"):
        assert [point[name] for point in points] == own[name]
    assert [point["basis"] for point in points] == [*own["basis"], None]
    assert {*end, *points[0]} - {"breakpoint", "breakpoints"} == set(KEYS.split())
    if own["answer"]:
        assert [point["answer"]["x"] for point in points] == own["answer"]["x"]
        assert end["answer"]["columns"] == own["answer"]["columns"]
    if own["exact"]:
        assert [point["exact"]["z"] for point in points] == own["exact"]["z"]
