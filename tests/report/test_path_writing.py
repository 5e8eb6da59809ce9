"""A path that is written part by part as it is found is the path that is written as a whole."""

from __future__ import annotations

import json
from typing import Any

import pytest

from lcpcli import Path, Problem
from lcpcli.parametric import following
from lcpcli.parametric.family import Family
from lcpcli.report.path_formats import KEYS
from lcpcli.report.path_writing import WRITERS, ObjectWriter

from ..parametric.families import positive
from .path_samples import cornered, frontier, small_in_fractions

AT = (0.1, 0.7)


def in_parts(form: str, first: Problem, last: Problem, monkeypatch: pytest.MonkeyPatch) -> tuple[str, Path, int]:
    """Return a text that is written part by part, the last part, and the number of parts."""
    writer, texts = WRITERS[form](AT, ("a", "b")), list[str]()
    monkeypatch.setattr(following, "MOST_AT_ONCE", 1)
    monkeypatch.setattr(following, "LEAST_AT_ONCE", 4)
    end = following.follow(Family(first, last), take=lambda part: texts.append(writer.part(part)))
    return "".join([*texts, *writer.end(end)]), end, len(texts)


def whole(form: str, first: Problem, last: Problem) -> str:
    return "".join(WRITERS[form](AT, ("a", "b")).end(following.follow(Family(first, last))))


def without_seconds(text: str) -> list[dict[str, Any]]:
    return [{**json.loads(line), "seconds": 0} for line in text.splitlines()]


@pytest.mark.parametrize("form", ["json", "jsonl"])
def test_json_in_parts_is_the_same(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    first, last = positive(30, 40, 40)
    expected = without_seconds(whole(form, first, last))
    text, _, parts = in_parts(form, first, last, monkeypatch)
    assert parts > 2
    assert without_seconds(text) == expected


def test_csv_in_parts_has_its_verdict_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    first, last = positive(30, 40, 40)
    expected = whole("csv", first, last).splitlines()
    lines = in_parts("csv", first, last, monkeypatch)[0].splitlines()
    assert lines[1] == "# the last line says how the path ends"
    assert [lines[0], lines[-1], *lines[2:-1]] == expected


@pytest.mark.parametrize("path", [small_in_fractions, frontier, cornered])
def test_lines_have_what_the_object_has(path: Any) -> None:
    own = json.loads("".join(ObjectWriter((), ()).end(path())))
    *points, end = (json.loads(line) for line in "".join(WRITERS["jsonl"]((), ()).end(path())).splitlines())
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
