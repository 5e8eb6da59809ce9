"""Variants and sweeps are compared under names that tell them apart; a
comparison of runs says what is worse or gone."""

import csv
import json
from pathlib import Path

import pytest

from lcpcli.bench import record as records
from lcpcli.errors import OptionError
from lcpcli.files import contents
from lcpcli.methods.registry import parse

from ..benchmarks.compare_runs import changes_between, main
from ..cli.conftest import assert_refused
from ..documents import assert_as_before
from ..wordings import NO_RUNS

FIRST, SECOND = map(contents.shipped_path, contents.PAPER_EXAMPLES)
RESULT = {
    "problem": "p",
    "file": "a/p.json",
    "item": None,
    "label": "shi",
    "method": "shi",
}
RESULT |= {
    "status": "solved",
    "solved": True,
    "iterations": 12,
    "seconds": 1.0,
    "spread": 1.05,
}
STALLED, INFEASIBLE, BROKEN, CUT = (
    {"status": status, "solved": False}
    for status in ("stalled", "infeasible", "breakdown", "iteration_limit")
)


pytestmark = pytest.mark.usefixtures("in_folder")


def results(file, *changes):
    Path(file).write_text(
        "".join(json.dumps(RESULT | change) + "\n" for change in changes)
    )


def verdicts(*files):
    return [
        change.verdict for change in changes_between(files or ["old.json", "new.json"])
    ]


@pytest.mark.parametrize(
    ("old", "new", "verdict"),
    [
        ({}, STALLED, "worse"),
        (STALLED, {}, "better"),
        (STALLED, BROKEN, "other status"),
        (INFEASIBLE, CUT, "worse"),
        ({}, INFEASIBLE, "contradiction"),
        (INFEASIBLE, INFEASIBLE | {"status": "unsolvable"}, "other status"),
        ({"digest": "1"}, INFEASIBLE | {"digest": "2"}, "another problem"),
        (
            {"digest": "1"},
            {"digest": "2", "status": "bad_input", "solved": False},
            "worse",
        ),
        ({}, {"seconds": 1.2}, "slower"),
        ({}, {"seconds": 1.09}, "as before"),
        ({"spread": 1.3}, {"seconds": 1.2}, "as before"),
        ({"spread": None}, {"seconds": 2.1}, "slower"),
        ({"seconds": 2.1}, {"spread": None}, "faster"),
        (STALLED, STALLED | {"seconds": 9}, "as before"),
    ],
)
def test_a_run_changes_by_its_status_and_then_by_its_time_beyond_the_spread(
    old, new, verdict
):
    results("old.json", old)
    results("new.json", new)
    assert verdicts() == [verdict]


def test_the_exit_code_is_1_for_a_worse_run_and_for_a_slower_one_if_that_is_asked(
    capfd,
):
    results(
        "old.json",
        {},
        {"label": "newton"},
        {"label": "lemke"},
        {"label": "auto"},
        {"label": "auto"},
    )
    changed = (
        {"seconds": 1.6},
        {"label": "newton", "seconds": 0.5},
        {"label": "milp"},
        {"label": "auto"},
    )
    results("new.json", *changed, {"label": "auto", "iterations": 13})
    assert main(["old.json", "new.json"]) == 0
    assert_as_before("bench/compared-runs", capfd.readouterr().out)
    assert main(["old.json", "new.json", "--slower", "1.7"]) == 0
    assert main(["old.json", "new.json", "--slower", "1.5"]) == 1
    for worse in (INFEASIBLE, STALLED):
        results("bad.json", worse)
        assert main(["old.json", "bad.json"]) == 1
    assert main(["bad.json", "old.json"]) == 0


def test_records_of_lcp_bench_are_compared_and_logs_of_lcp_solve(lcp, capfd):
    for file, p in (("old.json", "1e15"), ("new.json", "10")):
        given = f"--method newton --method shi:p={p} --budget 0"
        assert lcp(f"bench {FIRST} {given} -o {file} -q").code == 0
    found = {
        change.key[1]: change.verdict
        for change in changes_between(["old.json", "new.json"])
    }
    assert {found["shi:p=1e15"], found["shi:p=10"]} == {"gone", "new"}
    for limit in ("100", "2"):
        lcp(
            f"solve {FIRST} {SECOND} --method fixed-point --max-iterations "
            f"{limit} -o log{limit}.jsonl"
        )
    assert main(["log100.jsonl", "log2.jsonl"]) == 1
    told = capfd.readouterr().out
    assert "paper-example-1.json fixed-point worse" in told
    assert "solved -> iteration limit" in told


def test_a_problem_that_cannot_be_read_any_more_is_worse_for_each_method():
    results("old.json", {}, {"label": "newton"})
    results(
        "new.json",
        dict.fromkeys(RESULT)
        | {"file": "b/p.json", "status": "bad_input", "solved": False},
    )
    changes = changes_between(["old.json", "new.json"])
    assert [change.key for change in changes] == [
        ("p.json", "shi"),
        ("p.json", "newton"),
    ]
    assert verdicts() == ["worse", "worse"]
    assert main(["old.json", "new.json"]) == 1
    assert verdicts("new.json", "old.json") == ["better", "better"]


@pytest.mark.parametrize("content", ["", "1,2\n", "[1]\n"])
def test_a_file_without_runs_is_refused(content, capfd):
    results("old.json", {})
    Path("new.json").write_text(content)
    assert main(["old.json", "new.json"]) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert err.startswith("new.json: ")


def test_files_of_other_runs_are_refused(capfd):
    results("old.json", {})
    results("new.json", {"file": "q.json"})
    assert main(["old.json", "new.json"]) == 2
    assert "has no run in common with old.json" in capfd.readouterr().err


def test_a_last_line_that_was_cut_off_counts_as_not_written():
    results("old.json", {}, {"label": "newton"})
    Path("new.json").write_text(Path("old.json").read_text()[:-30])
    assert verdicts() == ["as before", "gone"]
    Path("new.json").write_text(Path("old.json").read_text()[:30])
    with pytest.raises(OptionError, match=rf"^new\.json: {NO_RUNS}; "):
        verdicts()


def test_a_variant_is_written_as_read_and_its_options_have_their_kinds():
    for text in (
        "shi",
        "shi:p=10",
        "shi:p=1e4,k-star=5,rho=0.1,sigma=0.5",
        "fixed-point:omega=auto,scale",
    ):
        assert str(parse(text)) == text
    assert parse("shi: p = 1e4, k_star = 5").options == {"p": 1e4, "k_star": 5}
    assert isinstance(parse("shi:k-star=5").options["k_star"], int)
    own = {"omega": "auto", "scale": True, "finish": False}
    assert parse("fixed-point:omega=auto,scale,finish=false").options == own


def test_bench_measures_variants_and_resumes_them(lcp, tmp_path):
    output = str(tmp_path / "bench.json")
    given = "--method shi --method newton --sweep p=100,1e4 --budget 0"
    outcome = lcp(f"bench {FIRST} {given} -o {output}")
    assert outcome.code == 0
    assert outcome.err == "lcp: 3 of 3 measurements succeeded\n"
    record = records.read(output)
    assert record.methods == ["shi:p=100", "shi:p=1e4", "newton"]
    assert [row.solver for row in record.measurements] == record.methods
    resumed = lcp(f"bench --resume {output} --format csv")
    lines = list(
        csv.DictReader(
            line for line in resumed.out.splitlines() if not line.startswith("#")
        )
    )
    assert resumed.code == 0
    assert [line["solver"] for line in lines] == record.methods
    assert_refused(lcp(f"bench --resume {output} --sweep p=1,2"))
