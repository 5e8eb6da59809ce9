"""A path that is written part by part as it is found is the path that is written as a whole."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from lcpcli import Path, Problem
from lcpcli.parametric import following
from lcpcli.parametric.family import Family
from lcpcli.report.path_formats import KEYS
from lcpcli.report.path_writing import WRITERS

from ..parametric.families import positive
from .path_samples import cornered, frontier, small_in_fractions, written

AT = (0.1, 0.15, 0.25, 0.35, 0.45, 0.55, 0.7)  # some on the pieces that two parts share


def jumping() -> tuple[Problem, Problem]:
    """Two problems between which z_i >= 0 is left at t = k_i, and the solution of a linear program jumps at 1/2."""
    k = np.arange(16) / 20 + 0.02
    M = np.eye(18)
    M[16:, 16:] = [[0, 1], [-1, 0]]
    return Problem(M, [*k, 1, 1]), Problem(M, [*k - 1, -1, 1])


def texts(form: str, ends: tuple[Problem, Problem], monkeypatch: pytest.MonkeyPatch) -> tuple[list[str], list[str]]:
    """The lines of a path that is written as a whole, and of one that is written part by part."""
    parts, taken = list[str](), list[Path]()
    whole = written(form, following.follow(Family(*ends)), *AT)
    writer = WRITERS[form](AT, ("a", "b"), parts.append)

    def take(part: Path) -> Callable[[], None]:
        taken.append(part)
        return writer.part(part)

    monkeypatch.setattr(following, "WRITTEN_AT_ONCE", 1)
    writer.end(following.follow(Family(*ends), take=take))
    assert len(taken) > 2
    return whole.splitlines(), "".join(parts).splitlines()


@pytest.mark.parametrize("ends", [positive(30, 40, 40), jumping()], ids=["many", "jumping"])
@pytest.mark.parametrize("form", ["json", "jsonl"])
def test_json_in_parts_is_the_same(form: str, ends: tuple[Problem, Problem], monkeypatch: pytest.MonkeyPatch) -> None:
    whole, parts = ([{**json.loads(line), "seconds": 0} for line in text] for text in texts(form, ends, monkeypatch))
    assert parts == whole
    assert whole[-1]["jumps"] == ([11] if ends[0].n == 18 else [])


def test_csv_in_parts_has_its_verdict_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, parts = texts("csv", positive(30, 40, 40), monkeypatch)
    assert parts[1] == "# the last line says how the path ends"
    assert [parts[0], parts[-1], *parts[2:-1]] == whole


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
