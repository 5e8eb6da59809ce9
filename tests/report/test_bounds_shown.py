"""A bound is shown where it is asked for, rounded upwards, and refused where nobody would see it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import Problem, error_bound, read
from lcpcli.files import contents, writing
from lcpcli.report import wording


def test_printed_bound_is_rounded_upwards() -> None:
    assert [wording.above(v) for v in (0.0, 9.91e-10, 1.25, 3.0)] == ["0", "1.0e-09", "1.3e+00", "3.0e+00"]


def test_json_holds_the_bound_where_it_is_asked_for(lcp: Callable[..., Any], tmp_path: Path) -> None:
    file = str(tmp_path / "problem.json")
    writing.write(Problem([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0]), file)
    plain, bounded = (json.loads(lcp("solve", file, "--format", "json", *o).out) for o in ([], ["--bound"]))
    assert (plain["error_bound"], plain["error_bound_source"]) == (None, None)
    expected = error_bound(read(file), np.array(bounded["z"]))
    assert expected is not None
    assert (bounded["error_bound"], bounded["error_bound_source"]) == (expected.value, expected.source)


def test_table_shows_the_bound_or_that_there_is_none(lcp: Callable[..., Any]) -> None:
    lines = lcp("compare", contents.shipped_path("paper-example-2.json"), "--bound").out.splitlines()
    lines = [line for line in lines if "|z - z*|" in line]
    for line, method in zip(lines, ("fixed-point", "shi"), strict=True):
        assert line.startswith(f"{method}: |z - z*| <= ")
        assert 0 < float(line.split("<= ")[1].split()[0]) < 1e-8
    none = lcp("solve", contents.shipped_path("bimatrix.json"), "--bound").out
    assert "\nno bound: M is not known to be H+ or positive definite\n" in none
    record = json.loads(lcp("solve", contents.shipped_path("bimatrix.json"), "--bound", "--format", "json").out)
    assert (record["error_bound"], record["error_bound_source"]) == (None, None)


@pytest.mark.parametrize("option", [["--quiet"], ["--format", "csv"]])
def test_bound_that_nobody_would_see_is_refused(option: list[str], lcp: Callable[..., Any]) -> None:
    outcome = lcp("solve", contents.shipped_path("paper-example-1.json"), "--bound", *option)
    assert outcome.code == 2
    assert outcome.err.count("\n") == 1
