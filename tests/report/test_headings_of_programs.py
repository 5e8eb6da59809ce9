"""The signs of multipliers in every report on a program: those of its own sense, under the names of its rows."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Lcp = Callable[..., Any]
PRODUCTION = {"A": [[1, 1], [1, 3]], "row_upper": [4, 6], "columns": ["chairs", "tables"], "rows": ["labour", "wood"]}
SENSES = pytest.mark.parametrize(("sense", "labour"), [("max", 3.0), ("min", -3.0)])


def program(tmp_path: Path, sense: str) -> str:
    """A production whose profit is the largest, or whose costs are the least; labour is scarce."""
    sign = 1 if sense == "max" else -1
    (tmp_path / "p.json").write_text(json.dumps(PRODUCTION | {"c": [3 * sign, 2 * sign], "sense": sense}))
    return str(tmp_path / "p.json")


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


@SENSES
@pytest.mark.parametrize("form", ["table", "markdown", "latex", "html"])
def test_iterates_show_multipliers_in_the_sense_of_the_program(
    sense: str, labour: float, form: str, tmp_path: Path, lcp: Lcp
) -> None:
    text = lcp("solve", program(tmp_path, sense), "--format", form).out
    assert "-labour" not in text
    assert f"{labour:.7f}" in text
    assert f"{-labour:.7f}" not in text.replace(f"{labour:.7f}", "") or labour < 0


@SENSES
def test_the_answer_the_best_and_all_solutions_agree_on_multipliers(
    sense: str, labour: float, tmp_path: Path, lcp: Lcp
) -> None:
    file = program(tmp_path, sense)
    answer = json.loads(lcp("solve", file, "--format", "json").out)["answer"]
    best = json.loads(lcp("solve", file, f"--{sense}imize", "labour", "--format", "json").out)
    (only,) = json.loads(lcp("solve", file, "--all", "--format", "json").out)["solutions"]
    assert answer["y"] == best["y"] == only["y"] == [labour, 0.0]
    assert (best["value"], best["bound"], best["x"]) == (labour, labour, only["x"])
    for options in ([], ["--all"], ["--minimize", "wood"]):
        table = str(tmp_path / "solutions.csv")
        assert lcp("solve", file, *options, "--format", "csv", "-o", table).code == 0
        own = {row["name"]: (row["part"], float(row["value"])) for row in rows(Path(table).read_text())}
        assert (own["labour"], own["wood"]) == (("y", labour), ("y", 0.0))
        assert lcp("check", file, table).code == 0
    for options in (["--all"], ["--minimize", "wood"], ["--show", "labour"]):
        words = lcp("solve", file, *options).out.replace(")", " ").split()
        assert f"{labour:g}" in words
        assert f"{-labour:g}" not in words or sense == "min"
