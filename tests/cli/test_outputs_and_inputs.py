"""No output replaces a file that the same run reads, whatever option names either of them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from .conftest import Lcp, assert_refused

PROBLEM = '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}'
GAME = '{"A": [[1, 0], [0, 1]], "B": [[0, 1], [1, 0]]}'
FILES = {"p.json": PROBLEM, "to.json": PROBLEM.replace("-5", "5"), "v.json": "[1, 1]", "g.json": GAME}
TABLES = {"M.csv": "2,1\n1,2\n", "q.csv": "-5\n-6\n"}
OF_Q = "%%MatrixMarket matrix array real general\n2 1\n-5\n-6\n"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, text in {**FILES, **TABLES, "p.q.mtx": OF_Q}.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.json").write_text(PROBLEM)
    return tmp_path


@pytest.mark.parametrize(
    "words",
    [
        "solve p.json -o p.json",
        "solve p.json -o in/../p.json",
        "solve M.csv q.csv -o q.csv",
        "solve in -o in/a.json",
        "solve p.json --x0 v.json -o v.json",
        "solve p.json --lower v.json -o v.json",
        "solve p.json --basis v.json -o v.json",
        "solve p.json --all -o p.json",
        "solve p.json -o hard.json",
        "solve p.json -o soft.json",
        "compare p.json -o p.json",
        "convert p.json -o p.json",
        "convert M.csv p.q.mtx -o p.mtx",
        "make --from-game g.json -o g.json",
        "bench p.json -o p.json",
        "bench in -o in/a.json",
        "path p.json to.json -o to.json",
    ],
)
def test_an_output_that_is_read_is_refused(words: str, lcp: Lcp, folder: Path) -> None:
    os.link(folder / "p.json", folder / "hard.json")
    os.symlink("p.json", folder / "soft.json")
    before = {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}
    outcome = lcp(*words.split())
    assert_refused(outcome)
    faults = ("holds the problem", "is an input of this run")
    assert any(f"{fault}; choose another file" in outcome.err for fault in faults)
    assert {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()} == before


@pytest.mark.parametrize("command", ["solve p.json", "path p.json to.json"])
def test_a_picture_that_is_read_is_refused(command: str, lcp: Lcp, folder: Path) -> None:
    pytest.importorskip("matplotlib")
    os.link(folder / "p.json", folder / "picture.svg")
    told = "lcp: picture.svg: holds the problem; choose another file for the output\n"
    assert_refused(lcp(*command.split(), "--plot", "picture.svg"), told)
    assert (folder / "p.json").read_text() == PROBLEM
