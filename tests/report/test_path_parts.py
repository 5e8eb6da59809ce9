"""A path that is written part by part says the same as one that is written as a whole."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from lcpcli import Problem
from lcpcli.parametric import following
from lcpcli.parametric.family import Family
from lcpcli.parametric.path import Path
from lcpcli.report.path_writing import WRITERS


def ends() -> tuple[Problem, Problem]:
    """Two problems between which z_i >= 0 is left at t = k_i, and the solution of a linear program jumps at 1/2."""
    k = np.arange(16) / 20 + 0.02
    M = np.eye(18)
    M[16:, 16:] = [[0, 1], [-1, 0]]
    return Problem(M, [*k, 1, 1]), Problem(M, [*k - 1, -1, 1])


def lines(at: tuple[float, ...], once: int, monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """The lines of the path, in parts of about this size."""
    texts: list[str] = []
    writer = WRITERS["jsonl"](at, ("a", "b"), texts.append)
    monkeypatch.setattr(following, "WRITTEN_AT_ONCE", once)
    parts = []

    def take(part: Path) -> Any:
        parts.append(part)
        return writer.part(part)

    writer.end(following.follow(Family(*ends()), take=take))
    assert (len(parts) > 3) == (once == 1)
    return [{**json.loads(line), "seconds": 0} for line in "".join(texts).splitlines()]


def test_jumps_are_numbered_along_the_whole_path(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = lines((), 10**9, monkeypatch)
    assert whole[-1]["jumps"] == [11]
    assert lines((), 1, monkeypatch) == whole


def test_points_between_two_parts_are_given_once(monkeypatch: pytest.MonkeyPatch) -> None:
    at = (0.15, 0.25, 0.35, 0.45, 0.55)  # some on the pieces that two parts share
    assert lines(at, 1, monkeypatch)[-1]["at"] == lines(at, 10**9, monkeypatch)[-1]["at"]
