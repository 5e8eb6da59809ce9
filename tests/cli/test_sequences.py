"""lcp solve --sequence: files, folders and streams as steps, each solved from the states of the last one."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli.solving import solver

from .conftest import Lcp, assert_refused, records

CONTACT = [[2, 2, -1], [2, 2, -1], [1, 1, 0]]  # with impulses that are not unique, which Lemke's path finds


def step(load: float, size: float = 1.0) -> str:
    return json.dumps({"M": [[size * a for a in row] for row in CONTACT], "q": [-load, -load, 0.5]})


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "steps").mkdir()
    for k in range(4):
        (tmp_path / "steps" / f"{k}.json").write_text(step(1 + k / 10))
    return tmp_path


def test_folder_has_the_same_verdicts_and_keys_in_fewer_pivots_and_columns_are_steps_too(lcp: Lcp) -> None:
    alone, found = (records(lcp("solve", "steps", "--format", "json", *own)) for own in ((), ("--sequence",)))
    for one, other in zip(alone, found, strict=True):
        assert list(one) == list(other)
        for key in ("file", "item", "problem", "n", "status", "solved", "method", "options", "tol"):
            assert one[key] == other[key]
        assert other["relative_residual"] <= 1e-10
    assert [record["route"] for record in alone] == [["lemke"]] * 4
    assert [record["route"] for record in found] == [["lemke"], ["newton"], ["newton"], ["newton"]]
    np.savetxt("M.csv", CONTACT, delimiter=",")
    np.savetxt("q.csv", [[-1, -1.1, -1.2]] * 2 + [[0.5] * 3], delimiter=",")
    columns = records(lcp("solve", "M.csv", "q.csv", "--sequence", "--format", "json"))
    assert [record["item"] for record in columns] == [1, 2, 3]
    assert [record["route"] for record in columns] == [["lemke"], ["newton"], ["newton"]]


def test_stream_may_change_in_size_and_have_lines_that_cannot_be_read(
    lcp: Lcp, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = [step(1.0), step(1.1), '{"M": [[2]], "q": [-1]}', "{}", step(1.2), step(1.3, 1.01)]
    (folder / "lines").write_text("\n".join(lines))
    with (folder / "lines").open("rb") as stream:
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(stream))
        outcome = lcp("solve", "-", "--sequence", "--format", "json")
    found = records(outcome)
    assert [record["status"] for record in found] == ["solved"] * 3 + ["bad_input"] + ["solved"] * 2
    routes = [record["route"] for record in found if record["route"]]
    assert routes == [["lemke"], ["newton"], ["newton"], ["lemke"], ["newton"]]
    assert (outcome.code, outcome.err.splitlines()[-1]) == (2, "lcp: 6 problems: 5 solved, 1 bad input")


def test_options_without_effect_are_refused_in_a_line(lcp: Lcp) -> None:
    for line in (
        "--method lemke",
        "--jobs 1",
        "--cluster tcp://localhost:1",
        "--trace",
        "--z0 1,1,1",
        "--scale",
        "--p 2",
    ):
        told = f"lcp: {line.split()[0]}: has no effect with --sequence"
        assert_refused(lcp("solve", "steps", "--sequence", "--format", "json", *line.split()), told)
    assert_refused(lcp("solve", "steps/0.json", "--sequence", "--all"), "lcp: --sequence: has no effect with --all")


def test_single_problem_has_the_record_of_one_of_many(lcp: Lcp) -> None:
    outcome = lcp("solve", "steps/0.json", "--sequence")
    assert (outcome.code, outcome.out.splitlines()[1].split()[:3]) == (0, ["steps/0.json", "3", "solved"])


def test_interrupted_sequence_goes_on_from_its_log(lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(self: solver.Solver, problem: Any) -> Any:
        if problem.q[0] < -1.15:
            raise KeyboardInterrupt
        return usual(self, problem)

    usual = solver.Solver.next
    with monkeypatch.context() as patch:
        patch.setattr(solver.Solver, "next", interrupted)
        outcome = lcp("solve", "steps", "--sequence", "-o", "log.jsonl")
    told = "lcp: 2 of 4 problems: 2 solved; interrupted; go on with --resume log.jsonl\n"
    assert (outcome.code, outcome.err) == (130, told)
    assert_refused(lcp("solve", "steps", "--resume", "log.jsonl"), "was written with sequence True")
    assert lcp("solve", "steps", "--sequence", "--resume", "log.jsonl").err == "lcp: 4 problems: 4 solved\n"
    found = [json.loads(line) for line in Path("log.jsonl").read_text().splitlines()]
    assert [record["number"] for record in found] == [1, 2, 3, 4]
    assert [record["route"] for record in found] == [["lemke"], ["newton"]] * 2


def test_sequence_of_programs_has_answers_and_proofs(lcp: Lcp) -> None:
    pytest.importorskip("flint")
    program = {"Q": [[2, 0], [0, 2]], "A": [[1, 1]], "b": [1]}
    lines = [json.dumps({**program, "c": [-2.0 - k, -3.0]}) for k in range(3)]
    Path("programs.jsonl").write_text("\n".join(lines))
    found = records(lcp("solve", "programs.jsonl", "--sequence", "--exact", "--format", "json"))
    alone = records(lcp("solve", "programs.jsonl", "--exact", "--format", "json"))
    assert [record["answer"]["x"] for record in found] == [record["answer"]["x"] for record in alone]
    assert [record["exact"]["z"] for record in found] == [record["exact"]["z"] for record in alone]
