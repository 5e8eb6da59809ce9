"""lcp compare-runs: what is worse, slower or gone is said, and a script can stop at it."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from lcpcli.bench.comparison import Comparison
from lcpcli.files import contents

FIRST, SECOND = map(contents.shipped_path, contents.PAPER_EXAMPLES)
RESULT: dict[str, Any] = {"problem": "p", "file": "a/p.json", "item": None, "label": "shi", "method": "shi"}
RESULT |= {"status": "solved", "solved": True, "iterations": 12, "seconds": 1.0, "spread": 1.05}
STALLED, INFEASIBLE, BROKEN, CUT = (
    {"status": status, "solved": False} for status in ("stalled", "infeasible", "breakdown", "iteration_limit")
)

Lcp = Callable[..., Any]


@pytest.fixture(autouse=True)
def _in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def results(file: str, *changes: Mapping[str, Any]) -> None:
    Path(file).write_text("".join(json.dumps(RESULT | dict(change)) + "\n" for change in changes))


def verdicts(*files: str) -> list[str]:
    return [change.verdict for change in Comparison(files or ["old.json", "new.json"]).changes]


@pytest.mark.parametrize(
    ("old", "new", "verdict"),
    [
        ({}, {"iterations": 13}, "as before"),
        ({}, STALLED, "worse"),
        (STALLED, {}, "better"),
        (STALLED, BROKEN, "other status"),
        (INFEASIBLE, CUT, "worse"),
        ({}, INFEASIBLE, "contradiction"),
        (INFEASIBLE, {}, "contradiction"),
        (INFEASIBLE, INFEASIBLE | {"status": "unsolvable"}, "other status"),
        ({"digest": "1"}, INFEASIBLE | {"digest": "2"}, "another problem"),
        ({"digest": "1"}, {"digest": "2", "status": "bad_input", "solved": False}, "worse"),
        ({}, {"seconds": 1.2}, "slower"),
        ({"seconds": 1.2}, {}, "faster"),
        ({}, {"seconds": 1.09}, "as before"),
        ({"spread": 1.3}, {"seconds": 1.2}, "as before"),
        ({"spread": None}, {"seconds": 1.9}, "as before"),
        ({"spread": None}, {"seconds": 2.1}, "slower"),
        ({"seconds": 2.1}, {"spread": None}, "faster"),
        (STALLED, STALLED | {"seconds": 9}, "as before"),
    ],
)
def test_a_run_changes_by_its_status_and_then_by_its_time_beyond_the_spread(
    old: dict[str, Any], new: dict[str, Any], verdict: str
) -> None:
    results("old.json", old)
    results("new.json", new)
    assert verdicts() == [verdict]


def test_a_script_stops_at_a_contradiction(lcp: Lcp) -> None:
    results("old.json", {})
    results("new.json", INFEASIBLE)
    assert lcp("compare-runs", "old.json", "new.json", "-q").code == 1


def test_the_exit_code_is_1_for_a_worse_run_and_for_a_slower_one_if_that_is_asked(lcp: Lcp) -> None:
    results("old.json", {}, {"label": "newton"}, {"label": "lemke"})
    results("new.json", {"seconds": 1.6}, {"label": "newton", "seconds": 0.5}, {"label": "milp"})
    outcome = lcp("compare-runs", "old.json", "new.json")
    assert (outcome.code, outcome.err) == (0, "")
    title, verdict, blank, _, _, *rows = outcome.out.splitlines()
    assert (title, blank) == ("new.json against old.json", "")
    assert verdict.startswith(
        "4 runs: 1 slower, 1 faster, 1 gone, 1 new; geometric mean of the ratios of times, new over old: 0.894"
    )
    assert [row.split()[:3] for row in rows] == [
        *(["p.json", "shi", "slower"], ["p.json", "newton", "faster"], ["p.json", "lemke", "gone"]),
        ["p.json", "milp", "new"],
    ]
    assert lcp("compare-runs", "old.json", "new.json", "--slower", "1.7", "-q").code == 0
    assert lcp("compare-runs", "old.json", "new.json", "--slower", "1.5", "-q").code == 1
    results("bad.json", STALLED)
    assert lcp("compare-runs", "old.json", "bad.json", "-q").code == 1
    assert lcp("compare-runs", "bad.json", "old.json", "-q").code == 0


def test_json_and_csv_have_the_runs_that_are_as_before_too(lcp: Lcp) -> None:
    results("old.json", {}, {})
    results("new.json", {}, {"seconds": 3})
    arguments = ("compare-runs", "old.json", "new.json", "--format")
    first, second = map(json.loads, lcp(*arguments, "json").out.splitlines())
    whole = {"problem": "p.json", "method": "shi", "verdict": "as before", "status": ["solved", "solved"]}
    assert first == whole | {"iterations": [12, 12], "seconds": [1.0, 1.0], "ratio": 1.0}
    assert (second["problem"], second["verdict"], second["ratio"]) == ("p.json (2)", "slower", 3)
    rows = list(csv.DictReader(lcp(*arguments, "csv").out.splitlines()))
    assert [(row["verdict"], row["old_seconds"], row["new_seconds"]) for row in rows] == [
        ("as before", "1.0", "1.0"),
        ("slower", "1.0", "3"),
    ]


def test_records_of_lcp_bench_are_compared_and_logs_of_lcp_solve(lcp: Lcp) -> None:
    for file, p in (("old.json", "1e15"), ("new.json", "10")):
        given = ("--method", "newton", "--method", f"shi:p={p}", "--budget", "0")
        assert lcp("bench", FIRST, *given, "-o", file, "-q").code == 0
    found = {change.key[1]: change.verdict for change in Comparison(["old.json", "new.json"]).changes}
    assert {found["shi:p=1e15"], found["shi:p=10"]} == {"gone", "new"}
    for limit in ("100", "2"):
        lcp("solve", FIRST, SECOND, "--method", "fixed-point", "--max-iterations", limit, "-o", f"log{limit}.jsonl")
    outcome = lcp("compare-runs", "log100.jsonl", "log2.jsonl")
    assert outcome.code == 1
    assert "paper-example-1.json fixed-point worse" in outcome.out
    assert "solved -> iteration limit" in outcome.out


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("1,2\n", "new.json: has neither a bench nor results; name a file of lcp bench -o FILE.json"),
        ("{}\n", "new.json: has neither a bench nor results"),
        ("[1]\n", "new.json: has neither a bench nor results"),
        ("", "new.json: is empty"),
        (json.dumps(RESULT | {"file": "q"}), "new.json: has no run in common with old.json"),
    ],
)
def test_a_file_of_something_else_is_refused_in_one_line(content: str, words: str, lcp: Lcp) -> None:
    results("old.json", {})
    Path("new.json").write_text(content)
    outcome = lcp("compare-runs", "old.json", "new.json")
    assert (outcome.code, outcome.err.count("\n"), outcome.out) == (2, 1, "")
    assert words in outcome.err
    assert lcp("compare-runs", "old.json", "old.json", "--slower", "1").code == 2


def test_a_problem_that_cannot_be_read_any_more_is_worse_for_each_method(lcp: Lcp) -> None:
    results("old.json", {}, {"label": "newton"})
    results("new.json", dict.fromkeys(RESULT) | {"file": "b/p.json", "status": "bad_input", "solved": False})
    changes = Comparison(["old.json", "new.json"]).changes
    assert [change.key for change in changes] == [("p.json", "shi"), ("p.json", "newton")]
    assert verdicts() == ["worse", "worse"]
    assert lcp("compare-runs", "old.json", "new.json", "-q").code == 1
    assert verdicts("new.json", "old.json") == ["better", "better"]


def test_runs_on_a_problem_that_has_changed_are_not_compared() -> None:
    results("old.json", STALLED | {"digest": "1"}, {"file": "q", "digest": "2"})
    results("new.json", {"digest": "3"}, {"file": "q", "digest": "2"})
    assert verdicts() == ["another problem", "as before"]


def test_a_last_line_that_was_cut_off_counts_as_not_written() -> None:
    results("old.json", {}, {"label": "newton"})
    Path("new.json").write_text(Path("old.json").read_text()[:-30])
    assert verdicts() == ["as before", "gone"]
