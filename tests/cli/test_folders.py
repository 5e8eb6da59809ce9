"""A folder stands for its problems, in order, also as steps of a sequence; no output
replaces a file that is read."""

import json
import os
from pathlib import Path

import pytest

from lcpcli.solving import solver

from ..wordings import HOLDS_PROBLEM, NAME_PROBLEM, OTHER_OUTPUT, RESULT
from .conftest import assert_refused

ONE = '{"M": [[2]], "q": [-1]}'
FILES = {
    "b.json": ONE,
    "a.csv": "2,-1\n",
    "c.JSON": ONE.replace("2", "4"),
    "notes.txt": "none",
}
INSIDE = ["inside/a.csv", "inside/b.json", "inside/c.JSON"]


@pytest.fixture(autouse=True)
def folder(in_folder):
    inside = in_folder / "inside"
    inside.mkdir()
    for name, text in FILES.items():
        (inside / name).write_text(text)
    (inside / "deeper.json").mkdir()
    (in_folder / "steps").mkdir()
    for k in range(4):
        (in_folder / "steps" / f"{k}.json").write_text(step(1 + k / 10))
    return inside


def test_the_record_of_a_bench_is_no_problem_and_has_the_files_of_a_folder(lcp):
    assert lcp("bench inside --method newton --budget 0 -o r.json -q").code == 0
    assert_refused(lcp("solve r.json"), f"r.json: {RESULT}; {NAME_PROBLEM}")
    assert [
        case["file"] for case in json.loads(Path("r.json").read_text())["cases"]
    ] == INSIDE
    Path("wrong.json").write_text("{")
    assert (
        lcp(
            "bench wrong.json inside/deeper.json inside -q --method newton --budget 0"
        ).code
        == 2
    )
    assert lcp("bench wrong.json -o none.json").code == 2
    assert not Path("none.json").exists()


PROBLEM = '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}'


@pytest.fixture
def inputs(in_folder):
    (in_folder / "p.json").write_text(PROBLEM)
    (in_folder / "to.json").write_text(PROBLEM.replace("-5", "5"))
    return in_folder


@pytest.mark.parametrize(
    "command",
    ["solve p.json -o", "solve p.json --plot", "path p.json to.json --plot"],
)
def test_an_output_that_is_the_input_under_another_name_is_refused(
    command, lcp, inputs
):
    if "--plot" in command:
        pytest.importorskip("matplotlib")
    os.link(inputs / "p.json", inputs / "other.svg")
    told = f"lcp: other.svg: {HOLDS_PROBLEM}; {OTHER_OUTPUT}\n"
    assert_refused(lcp(f"{command} other.svg --format json"), told)
    assert (inputs / "p.json").read_text() == PROBLEM


# With impulses that are not unique, which Lemke's path finds.
CONTACT = [[2, 2, -1], [2, 2, -1], [1, 1, 0]]


def step(load, size=1.0):
    return json.dumps(
        {"M": [[size * a for a in row] for row in CONTACT], "q": [-load, -load, 0.5]}
    )


def test_interrupted_sequence_goes_on_from_its_log(lcp, monkeypatch):
    def interrupted(self, problem):
        if problem.q[0] < -1.15:
            raise KeyboardInterrupt
        return usual(self, problem)

    usual = solver.Solver.next
    with monkeypatch.context() as patch:
        patch.setattr(solver.Solver, "next", interrupted)
        outcome = lcp("solve steps --sequence -o log.jsonl")
    told = "lcp: 2 problems: 2 solved; interrupted; continue with --resume log.jsonl\n"
    assert outcome.code == 130
    assert outcome.err == told
    assert_refused(
        lcp("solve steps --resume log.jsonl"),
        "sequence True, but here it is none",
    )
    assert (
        lcp("solve steps --sequence --resume log.jsonl").err
        == "lcp: 4 problems: 4 solved\n"
    )
    found = [json.loads(line) for line in Path("log.jsonl").read_text().splitlines()]
    assert [record["number"] for record in found] == [1, 2, 3, 4]
    assert [record["route"] for record in found] == [["lemke"], ["newton"]] * 2
