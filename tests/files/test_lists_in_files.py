"""Lists of all solutions in JSON and CSV: lcp check reads them again, and they carry names."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Lcp = Callable[..., Any]
PROBLEMS = {
    "murty": '{"M": [[1, 2], [2, 1]], "q": [-1, -1]}',
    "faces": '{"M": [[0, 1], [0, 0]], "q": [-1, 0]}',
    "none": '{"M": [[0, -1], [1, 0]], "q": [-1, -1]}',
    "line": '{"M": [[0, 0], [0, 1]], "q": [0, -0.1], "lower": [null, 0]}',
    "both": '{"A": [[2, 2], [2, 1]], "B": [[2, 2], [2, 1]], "rows": ["go", "stay"], "columns": ["left, or", "right"]}',
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, text in PROBLEMS.items():
        (tmp_path / f"{name}.json").write_text(text)
    return tmp_path


@pytest.mark.parametrize("exact", [[], ["--exact"]], ids=["rounded", "exact"])
@pytest.mark.parametrize("form", ["json", "csv"])
@pytest.mark.parametrize("name", ["murty", "faces", "line", "both", "transport"])
def test_each_solution_of_a_list_is_checked(name: str, form: str, exact: list[str], lcp: Lcp, folder: Path) -> None:
    """The lists are of an LCP, a mixed problem, a game and a program."""
    problem = f"{name}.json" if (folder / f"{name}.json").exists() else name
    assert lcp("solve", problem, "--all", *exact, "--format", form, "-o", f"all.{form}").code == 0
    outcome = lcp("check", problem, f"all.{form}", *exact, "--format", "json")
    vertices = {"murty": 3, "faces": 1 + (form == "csv"), "line": 1, "both": 3, "transport": 2}[name]
    assert (outcome.code, outcome.err, len(outcome.out.splitlines())) == (0, "", vertices)


@pytest.mark.parametrize(
    ("name", "swapped", "cell", "other"),
    [("murty", (2, 3), 4, "5"), ("both", (12, 13), 3, "")],
    ids=["z1-and-z2", "probabilities-of-two-columns"],
)
def test_wrong_solution_among_others_in_csv_is_told_apart(
    name: str, swapped: tuple[int, int], cell: int, other: str, lcp: Lcp, folder: Path
) -> None:
    assert lcp("solve", f"{name}.json", "--all", "--format", "csv", "-o", "all.csv").code == 0
    lines = (folder / "all.csv").read_text().splitlines()
    first, second = (next(csv.reader([lines[k]])) for k in swapped)
    first[cell], second[cell] = second[cell], other or first[cell]
    for k, row in zip(swapped, (first, second), strict=True):
        lines[k] = ",".join(f'"{text}"' for text in row)
    (folder / "all.csv").write_text("\n".join(lines))
    outcome = lcp("check", f"{name}.json", "all.csv", "--format", "json")
    correct = [json.loads(line)["accepted"] for line in outcome.out.splitlines()]
    assert (outcome.code, correct.count(False)) == (1, 1)


def test_lists_have_the_names_of_strategies_and_of_unknowns_if_there_are_any(lcp: Lcp, folder: Path) -> None:
    assert folder.is_dir()
    names = ["go", "stay", "left, or", "right"]
    assert json.loads(lcp("solve", "both.json", "--all", "--format", "json").out)["names"] == names
    assert json.loads(lcp("solve", "murty.json", "--all", "--format", "json").out)["names"] is None
    text = lcp("solve", "both.json", "--all", "--format", "csv").out
    header, *rows = csv.reader(line for line in text.splitlines() if not line.startswith("#"))
    assert [header[-1], *(row[-1] for row in rows)] == ["name", *names * (len(rows) // 4)]


def test_file_without_solutions_or_of_strategies_is_refused_where_a_z_is_asked_for(lcp: Lcp, folder: Path) -> None:
    assert folder.is_dir()
    lcp("solve", "none.json", "--all", "--format", "csv", "-o", "none.csv")
    assert "none.csv: has no solution" in lcp("check", "none.json", "none.csv").err
    lcp("solve", "both.json", "--all", "--format", "csv", "-o", "game.csv")
    assert "no column headed z" in lcp("solve", "both.json", "--z0", "game.csv").err
