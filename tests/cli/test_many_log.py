"""A log of many problems: it goes on where it was cut off or interrupted, and refuses what is not its own."""

from __future__ import annotations

import json
import os
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli.cli.request import Request
from lcpcli.files import log
from lcpcli.solving import proof

from ..solving.test_exact_solve import FACE
from .conftest import GOOD, Lcp, assert_refused, interrupt

BOTH = ("solve", "good.json", "none.json")


def records_of(text: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in text.splitlines()]


@pytest.fixture
def written(lcp: Lcp, folder: Path) -> Path:
    """A log of good.json and none.json."""
    lcp(*BOTH, "-o", "log.jsonl")
    return folder / "log.jsonl"


def test_a_log_goes_on_where_it_was_cut_off_and_counts_what_it_had(lcp: Lcp, folder: Path) -> None:
    (folder / "two.jsonl").write_text(f"{GOOD}\n{GOOD.replace('5', '4')}\n")
    np.savetxt("Q.csv", np.arange(8.0).reshape(2, 4) - 3, delimiter=",", header="a,b,c,d", comments="")
    files = ("good.json", "two.jsonl", "M.csv", "Q.csv")
    assert lcp("solve", *files, "-o", "log.jsonl").code == 0
    path = folder / "log.jsonl"
    whole = path.read_text().splitlines(keepends=True)
    unfinished = whole[4].replace('"solved"', '"interrupted"')
    cuts = ["", "".join(whole[:1]), "".join(whole[:4]) + whole[4][:50], "".join(whole[:4]) + unfinished, "".join(whole)]
    for cut in cuts:
        path.write_text(cut)
        outcome = lcp("solve", *files, "--resume", "log.jsonl")
        assert (outcome.code, outcome.out, outcome.err) == (0, "", "lcp: 7 problems: 7 solved\n")
        places, expected = (
            [tuple(each[key] for key in ("file", "item", "problem", "z")) for each in records_of(text)]
            for text in (path.read_text(), "".join(whole))
        )
        assert places == expected
    (folder / "bad.json").write_text(GOOD[:-1])
    lcp("solve", "bad.json", "good.json", "-o", "log.jsonl")
    outcome = lcp("solve", "bad.json", "good.json", "none.json", "--resume", "log.jsonl")
    assert (outcome.code, outcome.err) == (2, "lcp: 3 problems: 1 bad input, 1 solved, 1 infeasible\n")
    assert len(path.read_text().splitlines()) == 3


DAMAGED = "good.json that is damaged"
OTHER = "has good.json as another problem than number 1; give the same files, or begin a new log"


@pytest.mark.parametrize(
    ("was", "becomes", "line", "words"),
    [
        ("", "", "none.json good.json", "a problem other than none.json as number 1"),
        ("", "", "good.json", "a result of problem 2, but the last problem is number 1"),
        ("", "", "good.json none.json --tol 1e-8", "tol 1e-10"),
        ("", "", "good.json none.json --method lemke", "method auto"),
        ("", "", "good.json none.json --exact", "exact False"),
        ('"status": "solved"', '"status": "fine"', "good.json none.json", DAMAGED),
        ('"status": "solved"', '"status": null', "good.json none.json", DAMAGED),
        ('"exact": null', '"exact": {}', "good.json none.json", DAMAGED),
        ('"options": {"presolve": true}, ', "", "good.json none.json", DAMAGED),
        ('"number": 1,', '"number": 0,', "good.json none.json", DAMAGED),
        ('"number": 1,', '"number": -1,', "good.json none.json", DAMAGED),
        ('"number": 1,', '"number": 4,', "good.json none.json M.csv q.csv", OTHER),
        (', "number": .*}', "}", "good.json none.json", "log.jsonl: is not a log of results (line 1)"),
    ],
)
def test_a_log_of_something_else_or_that_was_edited_is_refused_and_kept(
    was: str, becomes: str, line: str, words: str, lcp: Lcp, written: Path
) -> None:
    text = written.read_text()
    if was:
        text = re.sub(re.escape(was) if ".*" not in was else was, becomes, text, count=1)
        text = text.replace(', "complete": true', "") if "4" in becomes else text
    written.write_text(text)
    assert_refused(lcp("solve", *line.split(), "--resume", "log.jsonl"), words)
    assert written.read_text() == text


def test_a_log_has_files_of_any_name_and_goes_on_after_them(lcp: Lcp, folder: Path) -> None:
    name = os.fsdecode(b"odd\xff.json")
    try:
        (folder / name).write_text(GOOD)
    except OSError:
        pytest.skip("no such names on this system")
    assert lcp("solve", name, "good.json", "-o", "log.jsonl").code == 0
    assert lcp("solve", name, "good.json", "none.json", "--resume", "log.jsonl").code == 3
    files = [each["file"] for each in records_of((folder / "log.jsonl").read_text())]
    assert files == [name, "good.json", "none.json"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the full disk of Linux")
def test_a_full_disk_is_told_of_the_log(lcp: Lcp, folder: Path) -> None:
    (folder / "log.jsonl").symlink_to("/dev/full")
    told = "lcp: log.jsonl: cannot be written (No space left on device)"
    assert_refused(lcp(*BOTH, "-o", "log.jsonl"), told)


def test_each_problem_that_an_option_does_not_fit_is_named(lcp: Lcp, folder: Path) -> None:
    (folder / "one.jsonl").write_text('{"M": [[2]], "q": [-5]}\n')
    told = "lcp: one.jsonl:1: --z0: has 2 entries for 1 unknown; make them agree\n"
    assert_refused(lcp("solve", "good.json", "one.jsonl", "--z0", "1,2", "-q"), told)


@pytest.mark.skipif(sys.platform == "win32", reason="no such locks")
@pytest.mark.parametrize("option", ["--output", "--resume"])
def test_a_log_that_another_run_writes_is_left_to_it(option: str, lcp: Lcp, written: Path) -> None:
    before = written.read_text()
    with log.open_log("log.jsonl", anew=False):
        assert_refused(lcp(*BOTH, option, "log.jsonl"), "log.jsonl: is being written by another run")
    assert written.read_text() == before


def test_programs_without_an_optimum_are_counted_by_what_is_proved_of_them(lcp: Lcp, folder: Path) -> None:
    unbounded, infeasible = '{"c": [-1, -1], "A": [[1, -1]], "b": [-2]}', '{"c": [1], "A": [[1]], "b": [2], "upper": 1}'
    (folder / "lps.jsonl").write_text(f"{unbounded}\n{infeasible}\n{GOOD}\n")
    table = lcp("solve", "lps.jsonl")
    assert [line.split()[2] for line in table.out.splitlines()[1:]] == ["unbounded", "infeasible", "solved"]
    summary = "lcp: 3 problems: 1 unbounded, 1 infeasible, 1 solved\n"
    resumed = (lcp("solve", "lps.jsonl", option, "log.jsonl").err for option in ("-o", "--resume"))
    assert [table.err, *resumed] == [summary] * 3
    statuses = [each["status"] for each in records_of((folder / "log.jsonl").read_text())]
    assert statuses == ["infeasible", "infeasible", "solved"]


def test_a_log_that_is_made_has_the_suffix_of_one(lcp: Lcp, folder: Path) -> None:
    told = "lcp: --resume: there is no log l6.csv; name a log or a new FILE.jsonl\n"
    assert_refused(lcp(*BOTH, "--resume", "l6.csv"), told)
    assert not (folder / "l6.csv").exists()
    assert lcp(*BOTH, "-q", "--resume", "l6.ndjson").code == 3
    (folder / "l6.ndjson").rename(folder / "l6.csv")
    assert lcp(*BOTH, "-q", "--resume", "l6.csv").code == 3
    assert lcp(*BOTH, "-o", "out.jsonl", "--format", "csv").code == 3
    assert (folder / "out.jsonl").read_text().startswith("problem,component,")  # only JSON is a log


def test_a_run_without_a_proof_that_is_gone_on_with_has_the_exit_code_of_one(
    lcp: Lcp, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(proof, "EXACT_SEARCH_EFFORT", 0.0)
    (folder / "face.json").write_text(FACE)
    assert lcp("solve", "good.json", "face.json", "--exact", "-o", "log.jsonl").code == 1
    assert records_of((folder / "log.jsonl").read_text())[1]["exact"]["status"] is None
    assert lcp("solve", "good.json", "face.json", "--exact", "--resume", "log.jsonl").code == 1


def test_log_of_problems_that_have_changed_is_not_complete_once_one_of_them_is_interrupted(
    lcp: Lcp, monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    files = [f"p{i}.json" for i in range(4)]
    for name in files:
        Path(name).write_text('{"M": [[2]], "q": [-1]}')
    assert lcp("solve", *files, "-o", "log.jsonl").code == 0
    for name in files[1:3]:
        Path(name).write_text('{"M": [[2]], "q": [-3]}')
    with monkeypatch.context() as patch:
        patch.setattr(Request, "run", interrupt)
        outcome = lcp("solve", *files, "--resume", "log.jsonl")
    told = "lcp: 2 of 4 problems: 2 solved; interrupted; go on with --resume log.jsonl\n"
    assert (outcome.code, outcome.err) == (130, told)
    assert "complete" not in (folder / "log.jsonl").read_text()
    assert lcp("solve", *files, "-o", "log.jsonl").code == 2
    assert lcp("solve", *files, "--resume", "log.jsonl").err == "lcp: 4 problems: 4 solved\n"
    lines = (folder / "log.jsonl").read_text().splitlines()
    found = sorted((json.loads(line)["file"], json.loads(line)["z"][0]) for line in lines)
    assert found == [*zip(files, (0.5, 1.5, 1.5, 0.5), strict=True)]
    assert [line.endswith('"complete": true}') for line in lines] == [False, False, False, True]


@pytest.mark.parametrize("problem", ["good.json", "-"])
def test_summary_of_an_interrupted_run_says_of_how_many_unless_it_would_have_to_wait(
    problem: str, lcp: Lcp, monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    (folder / "Q.csv").write_text("a,b,c\n-1,-2,-3\n-1,1,2\n")
    run, left = Request.run, iter([1])
    monkeypatch.setattr(Request, "run", lambda *given, **named: run(*given, **named) if any(left) else interrupt())
    outcome = lcp("solve", "good.json", "good.json", problem, "M.csv", "Q.csv")
    number = "1 problem" if problem == "-" else "1 of 6 problems"
    told = f"lcp: {number}: 1 solved; interrupted; with -o FILE.jsonl it could be resumed\n"
    assert (outcome.code, outcome.err) == (130, told)
