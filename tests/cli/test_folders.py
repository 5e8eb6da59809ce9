"""A folder stands for the files of problems in it, in order, in every command that takes several problems."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from .conftest import Lcp, assert_refused, records

ONE = '{"M": [[2]], "q": [-1]}'
FILES = {"b.json": ONE, "a.csv": "2,-1\n", "c.JSON": ONE.replace("2", "4"), "notes.txt": "none"}
INSIDE = ["inside/a.csv", "inside/b.json", "inside/c.JSON"]

OTHERS = "lcp: inside: 2 entries left out (folders, or without the suffix of a problem): deeper.json, notes.txt\n"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    inside = tmp_path / "inside"
    inside.mkdir()
    for name, text in FILES.items():
        (inside / name).write_text(text)
    (inside / "deeper.json").mkdir()
    monkeypatch.chdir(tmp_path)
    return inside


def test_solve_takes_its_files_in_the_order_of_their_names(folder: Path, lcp: Lcp) -> None:
    outcome = lcp("solve", "inside", str(folder / "b.json"), "--format", "json")
    assert (outcome.code, outcome.err) == (0, f"{OTHERS}lcp: 4 problems: 4 solved\n")
    assert [record["file"] for record in records(outcome)] == [*INSIDE, str(folder / "b.json")]


def test_bench_and_compare_take_the_same_files(lcp: Lcp) -> None:
    assert lcp("bench", "inside", "--method", "newton", "--budget", "0", "-o", "r.json", "-q").code == 0
    assert [case["file"] for case in json.loads(Path("r.json").read_text())["cases"]] == INSIDE
    outcome = lcp("compare", "inside", "--method", "newton", "--format", "json")
    assert [record["file"] for record in records(outcome)] == INSIDE


def test_a_single_file_in_it_is_solved_as_by_its_own_name(folder: Path, lcp: Lcp) -> None:
    for name in ("a.csv", "c.JSON"):
        (folder / name).unlink()
    assert lcp("solve", "inside", "--all").code == 0
    assert lcp("solve", "inside").out.startswith("b: n = 1\n")


@pytest.mark.parametrize("command", ["solve", "compare", "bench"])
def test_one_without_problems_is_refused_and_costs_the_others_nothing(command: str, folder: Path, lcp: Lcp) -> None:
    empty = folder / "deeper.json"
    assert_refused(lcp(command, str(empty)), f"{empty}: is a folder without problem files; they end in .json")
    Path("wrong.json").write_text("{")
    options = {"bench": ["--method", "newton", "--budget", "0"]}.get(command, [])
    outcome = lcp(command, "inside/a.csv", str(empty), "wrong.json", "inside/b.json", *options, "--format", "csv")
    assert outcome.code == 2
    solved = {line.split(",")[0].removeprefix("# ").split(".")[0] for line in outcome.out.splitlines()}
    assert {"a", "b"} <= solved
    lines = outcome.err.splitlines()
    assert lines[0].startswith(f"lcp: {empty}: is a folder without problem files")
    assert lines[1].startswith("lcp: wrong.json: line 1")
    outcome = lcp(command, "wrong.json", "wrong.json", "-o", "r.json")
    assert (outcome.code, outcome.out, Path("r.json").exists()) == (2, "", command != "bench")
    assert [line.split(": line")[0] for line in outcome.err.splitlines()][:2] == ["lcp: wrong.json"] * 2


def test_results_in_a_folder_are_left_out_with_a_remark(folder: Path, lcp: Lcp) -> None:
    written = {
        "y.csv": "solve inside/b.json",
        "y1.csv": "solve inside/b.json inside/a.csv",
        "y2.csv": "solve inside/b.json --all",
        "y3.csv": "compare inside/b.json --method newton",
        "y.json": "solve inside/b.json",
        "y1.json": "solve inside/b.json --all",
        "y2.json": "bench inside/b.json --method newton --budget 0 -q",
    }
    for name, command in written.items():
        assert lcp(*command.split(), "-o", name).code == 0
    assert lcp("solve", "inside/b.json", "--method", "newton", "--trace", "y4.csv", "-q").code == 0
    for kind, command in (("check", "check inside/b.json 0.5"), ("inspect", "inspect inside/b.json")):
        Path(f"y-{kind}.json").write_text(lcp(*command.split(), "--format", "json").out)
    results = sorted(file.name for file in Path().glob("y*"))
    for name in results:
        told = f"lcp: {name}: is a result, not a problem; name the file of the problem\n"
        assert_refused(lcp("solve", name), told)
        Path(name).rename(folder / name)
    outcome = lcp("solve", "inside")
    remark = f"lcp: inside: 10 files left out (results of lcp, not problems): {', '.join(results[:3])}, ...\n"
    assert (outcome.code, outcome.err) == (0, f"{OTHERS}{remark}lcp: 3 problems: 3 solved\n")
    assert lcp("solve", "inside", "-q").err == ""
    for file in folder.iterdir():
        if file.name[0] != "y" and file.is_file():
            file.unlink()
    assert "inside: is a folder without problem files" in lcp("solve", "inside").err


ALONE = "lcp: {}: contains M, 2 x 2, but no q; add q, or name the file of q after it\n"
PAIRS = {
    "another-M": ("2,0\n0,2\n", 2, [], ["a.csv", "b.csv"]),
    "another-M-with-a-header": ("x,y\n2,0\n0,2\n", 2, [], ["a.csv", "b.csv"]),
    "M-and-q": ("2,1,-1\n1,2,-1\n", 2, ["b.csv"], ["a.csv"]),
    "JSON": (ONE, 2, ["b.csv"], ["a.csv"]),
    "row": ("-5,-6\n", 0, ["a.csv"], []),
    "list": ("[-5, -6]", 0, ["a.csv"], []),
    "several-q": ("a,b,c,d\n-5,1,2,3\n-6,1,2,3\n", 0, ["b.csv"] * 4, []),
}


@pytest.mark.parametrize("case", PAIRS)
def test_a_file_after_an_M_alone_is_its_q_only_if_it_is_nothing_else(case: str, folder: Path, lcp: Lcp) -> None:
    text, code, solved, alone = PAIRS[case]
    for name in FILES:
        (folder / name).unlink()
    (folder / "a.csv").write_text("2,1\n1,2\n")
    (folder / "b.csv").write_text(text)
    outcome = lcp("solve", "inside", "--jobs", "1", "--format", "json")
    assert outcome.code == code
    assert [Path(each["file"]).name for each in records(outcome) if each["status"] == "solved"] == solved
    faults = [line for line in outcome.err.splitlines(keepends=True) if "contains M" in line]
    assert faults == [ALONE.format(f"inside/{name}") for name in alone]


def test_a_vector_after_a_problem_does_not_take_it_away_and_named_files_go_together(folder: Path, lcp: Lcp) -> None:
    (folder / "b1.csv").write_text("1\n2\n3\n")
    outcome = lcp("solve", "inside")
    assert outcome.code == 2
    assert outcome.err.removeprefix(OTHERS).startswith("lcp: inside/b1.csv: has 3 rows of 1 column;")
    assert outcome.err.endswith("lcp: 4 problems: 3 solved, 1 bad input\n")
    for name, text in {"a": "2,1\n1,2\n", "b": "-5,-6\n-1,1\n"}.items():
        (folder / f"{name}.csv").write_text(text)
    assert lcp("solve", "inside/a.csv", "inside/b.csv").err.endswith("lcp: 2 problems: 2 solved\n")


def test_hidden_files_of_a_folder_are_skipped(tmp_path: Path, lcp: Lcp) -> None:
    for name in (".hidden.json", "p1.json"):
        (tmp_path / name).write_text('{"M": [[2]], "q": [-1]}')
    assert ".hidden" not in lcp("solve", str(tmp_path)).err
