"""What a log of many problems says when it is written, or gone on with, where something is wrong."""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lcpcli.files import log
from lcpcli.solving import proof

from ..solving.test_exact_solve import FACE

Lcp = Callable[..., Any]
GOOD, INFEASIBLE = '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}', '{"M": [[0, -1], [1, 0]], "q": [-1, -1]}'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "good.json").write_text(GOOD)
    (tmp_path / "none.json").write_text(INFEASIBLE)
    return tmp_path


@pytest.mark.parametrize(
    ("was", "becomes"),
    [
        ('"status": "solved"', '"status": "fine"'),
        ('"status": "solved"', '"status": null'),
        ('"exact": null', '"exact": {}'),
        ('"options": {"presolve": true}, ', ""),
        ('"number": 1,', '"number": 0,'),
        ('"number": 1,', '"number": -1,'),
    ],
)
def test_a_log_that_was_edited_is_refused_in_a_line_and_kept(was: str, becomes: str, lcp: Lcp, folder: Path) -> None:
    lcp("solve", "good.json", "none.json", "-o", "log.jsonl")
    path = folder / "log.jsonl"
    path.write_text(path.read_text().replace(was, becomes, 1))
    before = path.read_text()
    outcome = lcp("solve", "good.json", "none.json", "--resume", "log.jsonl")
    assert (outcome.code, len(outcome.err.splitlines())) == (2, 1)
    assert "good.json that is damaged" in outcome.err
    assert path.read_text() == before


def test_a_record_with_another_number_is_refused_before_anything_is_solved(lcp: Lcp, folder: Path) -> None:
    path = folder / "log.jsonl"
    (folder / "more.json").write_text(GOOD)
    lcp("solve", "good.json", "none.json", "-o", "log.jsonl")
    path.write_text(path.read_text().replace('"number": 1,', '"number": 4,').replace(', "complete": true', ""))
    before = path.read_text()
    outcome = lcp("solve", "good.json", "none.json", "more.json", "--resume", "log.jsonl")
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err == "lcp: --resume: has good.json as another problem than number 1; give the same files\n"
    assert path.read_text() == before


def test_a_log_of_version_0_1_0_is_none_to_go_on_with(lcp: Lcp, folder: Path) -> None:
    lcp("solve", "good.json", "none.json", "-o", "log.jsonl")
    path = folder / "log.jsonl"
    path.write_text(re.sub(r', "number": .*}', "}", path.read_text()))
    outcome = lcp("solve", "good.json", "none.json", "--resume", "log.jsonl")
    assert outcome.code == 2
    assert "log.jsonl: is not a log of results (line 1)" in outcome.err


def test_a_log_has_files_of_any_name_and_goes_on_after_them(lcp: Lcp, folder: Path) -> None:
    name = os.fsdecode(b"odd\xff.json")
    try:
        (folder / name).write_text(GOOD)
    except OSError:
        pytest.skip("no such names on this system")
    assert lcp("solve", name, "good.json", "-o", "log.jsonl").code == 0
    assert lcp("solve", name, "good.json", "none.json", "--resume", "log.jsonl").code == 3
    files = [json.loads(line)["file"] for line in (folder / "log.jsonl").read_text().splitlines()]
    assert files == [name, "good.json", "none.json"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the full disk of Linux")
def test_a_full_disk_is_told_of_the_log(lcp: Lcp, folder: Path) -> None:
    (folder / "log.jsonl").symlink_to("/dev/full")
    outcome = lcp("solve", "good.json", "none.json", "-o", "log.jsonl")
    assert (outcome.code, len(outcome.err.splitlines())) == (2, 1)
    assert outcome.err.startswith("lcp: log.jsonl: cannot be written (No space left on device)")


def test_only_json_is_a_log(lcp: Lcp, folder: Path) -> None:
    assert lcp("solve", "good.json", "none.json", "-o", "out.jsonl", "--format", "csv").code == 3
    assert (folder / "out.jsonl").read_text().startswith("problem,component,")


def test_each_problem_that_an_option_does_not_fit_is_named(lcp: Lcp, folder: Path) -> None:
    (folder / "one.jsonl").write_text('{"M": [[2]], "q": [-5]}\n')
    outcome = lcp("solve", "good.json", "one.jsonl", "--z0", "1,2", "-q")
    assert (outcome.code, outcome.err) == (
        2,
        "lcp: one.jsonl:1: --z0: has 2 entries for 1 unknown; make them agree\n",
    )


@pytest.mark.skipif(sys.platform == "win32", reason="no such locks")
@pytest.mark.parametrize("option", ["--output", "--resume"])
def test_a_log_that_another_run_writes_is_left_to_it(option: str, lcp: Lcp, folder: Path) -> None:
    lcp("solve", "good.json", "none.json", "-o", "log.jsonl")
    before = (folder / "log.jsonl").read_text()
    with log.open_log("log.jsonl", anew=False):
        outcome = lcp("solve", "good.json", "none.json", option, "log.jsonl")
    assert (outcome.code, len(outcome.err.splitlines())) == (2, 1)
    assert "log.jsonl: is being written by another run" in outcome.err
    assert (folder / "log.jsonl").read_text() == before


def test_programs_without_an_optimum_are_counted_by_what_is_proved_of_them(lcp: Lcp, folder: Path) -> None:
    unbounded, infeasible = '{"c": [-1, -1], "A": [[1, -1]], "b": [-2]}', '{"c": [1], "A": [[1]], "b": [2], "upper": 1}'
    (folder / "lps.jsonl").write_text(f"{unbounded}\n{infeasible}\n{GOOD}\n")
    table = lcp("solve", "lps.jsonl")
    assert [line.split()[2] for line in table.out.splitlines()[1:]] == ["unbounded", "infeasible", "solved"]
    summary = "lcp: 3 problems: 1 unbounded, 1 infeasible, 1 solved\n"
    assert table.err == summary
    assert lcp("solve", "lps.jsonl", "-o", "log.jsonl").err == summary
    assert lcp("solve", "lps.jsonl", "--resume", "log.jsonl").err == summary
    statuses = [json.loads(line)["status"] for line in (folder / "log.jsonl").read_text().splitlines()]
    assert statuses == ["infeasible", "infeasible", "solved"]


def test_a_log_that_is_made_has_the_suffix_of_one_and_no_other_output(lcp: Lcp, folder: Path) -> None:
    outcome = lcp("solve", "good.json", "none.json", "--resume", "l6.csv")
    assert (outcome.code, outcome.err) == (2, "lcp: --resume: there is no log l6.csv; name a log or a new FILE.jsonl\n")
    assert not (folder / "l6.csv").exists()
    assert lcp("solve", "good.json", "none.json", "-q", "--resume", "l6.ndjson").code == 3
    (folder / "l6.ndjson").rename(folder / "l6.csv")
    assert lcp("solve", "good.json", "none.json", "-q", "--resume", "l6.csv").code == 3
    both = lcp("solve", "good.json", "none.json", "-o", "log.jsonl", "--resume", "log.jsonl")
    told = "lcp: --output: has no effect with --resume, which goes on with its file; leave it out\n"
    assert (both.code, both.err) == (2, told)


def test_a_run_without_a_proof_that_is_gone_on_with_has_the_exit_code_of_one(
    lcp: Lcp, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(proof, "EXACT_SEARCH_EFFORT", 0.0)
    (folder / "face.json").write_text(FACE)
    assert lcp("solve", "good.json", "face.json", "--exact", "-o", "log.jsonl").code == 1
    assert json.loads((folder / "log.jsonl").read_text().splitlines()[1])["exact"]["status"] is None
    assert lcp("solve", "good.json", "face.json", "--exact", "--resume", "log.jsonl").code == 1
