"""Headings of the iterates of a program."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


@pytest.mark.parametrize(("sense", "headings"), [("max", ["-labour", "-wood"]), ("min", ["labour", "wood"])])
def test_multipliers_that_z_has_with_the_other_sign_say_so(
    sense: str, headings: list[str], tmp_path: Path, lcp: Callable[..., Any]
) -> None:
    sign = 1 if sense == "max" else -1
    program = {"c": [3 * sign, 2 * sign], "A": [[1, 1], [1, 3]], "row_upper": [4, 6], "sense": sense}
    program |= {"columns": ["chairs", "tables"], "rows": ["labour", "wood"]}
    (tmp_path / "p.json").write_text(json.dumps(program))
    lines = lcp("solve", str(tmp_path / "p.json")).out.splitlines()
    (heading,) = (line for line in lines if line.startswith("method"))
    assert heading.split()[2:6] == ["chairs", "tables", *headings]
