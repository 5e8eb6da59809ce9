"""lcp why: what it says, in the names of the input and as JSON, its exit codes, and
what is known at a limit and after Ctrl-C."""

import json
import signal
from pathlib import Path

import numpy as np
import pytest

import lcpcli
from lcpcli.explanation import conflicts, ranges, repair
from lcpcli.files import writing
from lcpcli.files.input_file import InputFile
from lcpcli.files.inputs import Input

from ..conftest import save_json
from ..refusals import commands

pytestmark = pytest.mark.usefixtures("folder")
INFEASIBLE = {
    "c": [0.6, 1.5, 2],
    "A": [[0.1, 0.2, 0.3], [1, 1, 1], [0, 2.5, 1]],
    "row_lower": [3, None, None],
    "row_upper": [None, 8, 2],
    "rows": ["protein", "weight", "fat"],
    "columns": ["bread", "cheese", "eggs"],
}
UNSOLVABLE = {"M": [[0, 1], [0, 1]], "q": [-1, 0], "names": ["pump", "valve"]}
PLAN = {"c": [-1], "A": [[1]], "row_upper": [4], "columns": ["x"]}
SOLVABLE = {"M": [[2, 1], [1, 2]], "q": [-5, -6]}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    own = {"diet": INFEASIBLE, "pipes": UNSOLVABLE, "two": SOLVABLE, "plan": PLAN}
    for name, data in own.items():
        save_json(tmp_path / f"{name}.json", data)
    M = np.array([[0.0, 1.0], [0.0, 0.0]])
    writing.write(lcpcli.Problem(M, [-1.0, -1.0]), "rows.csv")
    return tmp_path


WRONG = commands(
    r"""
why diet.json --keep oil
    => --keep: 'oil' names nothing in this problem; write a name, or a name and what it
    is, as in 'bread lower bound'
why diet.json --change 'fat lower side'
    => --change: 'fat lower side' names nothing in this problem; {DID_YOU_MEAN:fat}
why diet.json --weights fat=0 => --weights: {IS:0 for 'fat'}; give a positive number
why diet.json --weights fat => --weights: 'fat' is not NAME=NUMBER; write z1=2
why diet.json --weights fat=much => --weights: {HAS_NO_NUMBER:'much'}; {A_NUMBER}
why diet.json --json => --json: {NO_OPTION:lcp why}; {DID_YOU_MEAN:--format json}
why diet.json --time-limit 0
    => --time-limit: {OUT_OF_RANGE:0.0}; {IT_MUST_BE:seconds > 0}
why diet.json none.csv => none.csv: {NO_SUCH_FILE}; {CHECK_PATH}
""",
    {"diet.json": json.dumps(INFEASIBLE)},
)


@pytest.mark.parametrize("refusal", WRONG, ids=str)
def test_wrong_options_are_told_in_one_line(refusal, refused):
    assert refused(refusal.command, refusal.files) == refusal.line


@pytest.mark.parametrize("name", ["pipes", "two"])
def test_the_record_of_a_call_is_that_of_the_command(name, lcp):
    ours = lcpcli.why(lcpcli.read(f"{name}.json")).to_dict()
    theirs = lcp(f"why {name}.json --format json").record
    assert {**ours, "seconds": 0, "file": 0} == {**theirs, "seconds": 0, "file": 0}


def test_a_hint_names_no_input_that_another_command_cannot_read():
    # Another command cannot read standard input again, or name a line.
    piped, line = InputFile("-"), InputFile("many.jsonl", line=3)
    assert [*Input((piped,)).paths, *Input((line,)).paths] == []
    assert lcpcli.run(lcpcli.read("rows.csv")).advice == "try lcpcli.why(problem)"


def _raising(number):
    """A function that gets a signal."""

    def run(*_):
        signal.raise_signal(number)
        lcpcli.interrupts.raise_if_timed_out()
        pytest.fail("nothing ended the search")

    return run


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)]
)
def test_an_interrupt_shows_what_is_known(number, code, lcp):
    def shown(name):
        outcome = lcp(f"why {name} --format json")
        assert outcome.code == code
        assert outcome.err == ""
        found = outcome.record
        assert found["complete"] is False
        return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(conflicts.Finder, "run", _raising(number))
        found = shown("diet.json")
    assert found["status"] == "unsolvable"
    assert found["repair"]["least"] is True
    assert found["conflict"] == []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ranges._Basis, "range", _raising(number))
        found = shown("plan.json")
    assert found["status"] == "solved"
    assert found["z"] == ["4", "-1"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(repair.Repairs, "run", _raising(number))
        found = shown("pipes.json")
    assert found["status"] == "unsolvable"
    assert found["conflict"] == []
    assert found["repair"] is None


def test_at_the_time_limit_nothing_else_is_said(lcp):
    outcome = lcp("why pipes.json --time-limit 1e-9")
    assert outcome.code == 1
    message = "time limit: neither a conflict nor a solution is known"
    assert message in outcome.out
    late = lcpcli.why(lcpcli.read("pipes.json"), time_limit=1e-9)
    assert (late.complete, late.conflict, late.message) == (False, (), message)


def test_a_conflict_that_is_not_reduced_is_told_as_such(monkeypatch, lcp):
    def late(*_):
        raise lcpcli.interrupts.TimeIsUp

    monkeypatch.setattr(conflicts.Finder, "_reduce", late)
    outcome = lcp("why pipes.json")
    assert outcome.code == 1
    assert "it is not proved that all of them are necessary" in outcome.out
    assert "the cheapest change" in outcome.out


def test_the_repair_is_printed_before_the_conflict_is_known(lcp, monkeypatch, capfd):
    printed = []

    def late(*_):
        printed.append(capfd.readouterr().out)
        raise lcpcli.interrupts.TimeIsUp

    monkeypatch.setattr(conflicts.Finder, "run", late)
    rest = lcp("why diet.json").out
    assert "the cheapest change: decrease the lower bound of row protein" in printed[0]
    assert "conflict" not in printed[0]
    assert rest.startswith("\nconflict\n")


def test_names_have_a_star_as_their_only_wildcard(lcp, refused):
    assert lcp("why diet.json --change 'f*t' --change 'w*' --format json").code == 0
    line = refused(
        "why diet.json --change 'f?t'", {"diet.json": json.dumps(INFEASIBLE)}
    )
    assert line.startswith("--change: 'f?t' names nothing in this problem")


def test_many_similar_conditions_are_counted_in_one_line(lcp):
    n = 30
    names = [f"part_{i}" for i in range(n)]
    data = {"c": [1] * n, "A": [[1] * n], "row_upper": [-1], "columns": names}
    Path("parts.json").write_text(json.dumps(data))
    outcome = lcp("why parts.json")
    assert "these 31 conditions cannot hold together" in outcome.out
    assert "30 of them, the first: part_0 >= 0" in outcome.out
    assert len(outcome.out.splitlines()) < 20


@pytest.mark.parametrize("name", ["diet.json", "pipes.json"])
def test_the_repaired_problem_is_a_file_with_a_solution_and_the_names(name, lcp):
    lcp(f"why {name} --repaired solvable.json")
    repaired = lcpcli.read("solvable.json")
    assert lcpcli.run(repaired).solved
    assert [*repaired.names] == [*lcpcli.read(name).names]


def test_the_repaired_program_is_an_mps_file_in_the_signs_of_its_rows(lcp):
    lcp("why diet.json --repaired solvable.mps")
    assert "1.2" in Path("solvable.mps").read_text()
    assert lcp("why two.json --repaired none.json").err.endswith(
        "none.json is not written: no change is known\n"
    )
