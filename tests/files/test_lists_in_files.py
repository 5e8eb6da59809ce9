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
    "game": '{"A": [[3, 0], [0, 2]], "B": [[2, 0], [0, 3]]}',
    "both": '{"A": [[2, 2], [2, 1]], "B": [[2, 2], [2, 1]]}',
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


@pytest.mark.parametrize("name", ["murty", "both"])
def test_wrong_solution_among_others_in_csv_is_told_apart(name: str, lcp: Lcp, folder: Path) -> None:
    assert lcp("solve", f"{name}.json", "--all", "--format", "csv", "-o", "all.csv").code == 0
    lines = (folder / "all.csv").read_text().splitlines()
    swapped = {"murty": (2, 3), "both": (12, 13)}[name]  # z_1 and z_2, or the probabilities of two columns
    cell = {"murty": 4, "both": 3}[name]
    rows = [lines[k].split(",") for k in swapped]
    rows[0][cell], rows[1][cell] = rows[1][cell], {"murty": "5", "both": rows[0][cell]}[name]
    for k, row in zip(swapped, rows, strict=True):
        lines[k] = ",".join(row)
    (folder / "all.csv").write_text("\n".join(lines))
    outcome = lcp("check", f"{name}.json", "all.csv", "--format", "json")
    correct = [json.loads(line)["accepted"] for line in outcome.out.splitlines()]
    assert outcome.code == 1
    assert correct.count(False) == 1


@pytest.mark.parametrize("form", ["json", "csv"])
def test_lists_have_the_names_of_unknowns_and_strategies(form: str, lcp: Lcp, folder: Path) -> None:
    (folder / "named.json").write_text('{"M": [[1, 2], [2, 1]], "q": [-1, -1], "names": ["tea, hot", "milk"]}')
    payoffs = '"A": [[1, 0]], "B": [[1, 0]], "rows": ["go"], "columns": ["stay", "leave"]'
    (folder / "players.json").write_text(f"{{{payoffs}}}")
    for name, expected in (("named", ["tea, hot", "milk"]), ("players", ["go", "stay", "leave"])):
        text = lcp("solve", f"{name}.json", "--all", "--format", form).out
        if form == "json":
            assert json.loads(text)["names"] == expected
            continue
        header, *rows = csv.reader(line for line in text.splitlines() if not line.startswith("#"))
        assert header[-1] == "name"
        assert [row[-1] for row in rows] == expected * (len(rows) // len(expected))
    assert json.loads(lcp("solve", "murty.json", "--all", "--format", "json").out)["names"] is None


def test_file_without_solutions_or_of_strategies_is_refused_where_a_z_is_asked_for(lcp: Lcp, folder: Path) -> None:
    assert folder.is_dir()
    lcp("solve", "none.json", "--all", "--format", "csv", "-o", "none.csv")
    assert "none.csv: has no solution" in lcp("check", "none.json", "none.csv").err
    lcp("solve", "game.json", "--all", "--format", "csv", "-o", "game.csv")
    assert "no column headed z" in lcp("solve", "game.json", "--z0", "game.csv").err
