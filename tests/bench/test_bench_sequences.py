"""lcp bench sequences: what is counted of each step by itself, by a Solver and by another program, and the reports."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

from lcpcli import run
from lcpcli.bench import sequences as bench
from lcpcli.bench.sequences import SequenceCase, measure
from lcpcli.gallery import sequences
from lcpcli.gallery.sequences import SequenceStep, Solve
from lcpcli.model.problem import Problem
from lcpcli.peers import registry

Lcp = Callable[..., Any]
TINY = (
    SequenceCase("tower", partial(sequences.boxes, "tower", 1, 3)),
    SequenceCase("heap", partial(sequences.boxes, "heap", 3, 14)),
    SequenceCase("put", partial(sequences.put, 20, 4)),
    SequenceCase("market", partial(sequences.market, 3)),
    SequenceCase("obstacle", partial(sequences.moving_load, 5, 3)),
)
STEPS = [3, 14, 4, 3, 3]


@pytest.mark.parametrize(
    ("case", "steps"), [*zip(TINY, STEPS, strict=True)], ids=lambda value: getattr(value, "name", "")
)
def test_every_step_is_solved_by_itself_and_by_a_solver(case: SequenceCase, steps: int) -> None:
    row = measure(case, 0.0)
    assert row.steps == steps
    for side in (row.run, row.solver):
        assert (side.solved, len(side.seconds)) == (steps, steps)
    takes = not row.missing and case.name != "market"
    assert len(row.peer.seconds) == (steps if takes else 0)
    assert (row.least_n < row.most_n) == (case.name == "heap")


def test_steps_without_a_solution_are_counted_and_those_proved_to_have_none_named() -> None:
    def follow(solve: Solve) -> None:
        M, answers = np.array([[-1.0]]), []
        for q in (1.0, -1.0, 2.0):
            answers.append(solve(SequenceStep(M, np.array([q]))))
        assert [z is None for z in answers] == [False, True, False]

    row = measure(SequenceCase("one", follow), 0.0)
    assert (row.run.solved, row.solver.solved) == (2, 2)
    (sheet,) = bench.report([row]).tables
    assert "one: 1 step proved to have no solution." in sheet.notes
    assert [cell for title, cell in zip(sheet.header, sheet.groups[0][0], strict=True) if title == "open"][:2] == [
        "1",
        "1",
    ]


def test_a_wrong_answer_of_the_other_program_does_not_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    class Wrong:
        def version(self) -> str:
            return "1.0"

        def excludes(self, _: Problem) -> str:
            return ""

        def solve(self, problem: Problem, *_: float) -> registry.Claim:
            return registry.Claim(run(problem).z + (problem.q.size == 20), True, 1e-3, "solved")

    monkeypatch.setattr(registry, "load", lambda _: Wrong())
    assert measure(TINY[0], 0.0).peer.solved == 3
    row = measure(TINY[2], 0.0)
    assert (row.peer.solved, row.peer.seconds) == (0, 4 * [1e-3])


def test_a_solver_keeps_m_where_it_is_the_same_and_is_another_one_where_n_changes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made, updated = [], []

    class Counted(bench.Solver):
        def __init__(self, M: Any, **given: Any) -> None:
            made.append(len(M))
            super().__init__(M, **given)

        def update(self, M: Any) -> None:
            updated.append(len(M))
            super().update(M)

    monkeypatch.setattr(bench, "Solver", Counted)

    def follow(solve: Solve) -> None:
        M = np.eye(2)
        for matrix in (M, M, 2 * M, np.eye(3), M):
            solve(SequenceStep(matrix, -np.ones(len(matrix))))

    bench._followed(SequenceCase("", follow))
    assert (made, updated) == ([2, 3, 2], [2])


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two cases, beside a program that is not installed."""
    monkeypatch.setattr(bench, "CASES", TINY[2:4])
    monkeypatch.setattr("lcpcli.peers.packages.installed", lambda _: None)


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize(
    ("form", "start"),
    [
        ("table", "lcp bench sequences: 2 sequences"),
        ("csv", "# "),
        ("markdown", "## lcp bench sequences: 2 sequences"),
        ("latex", "% "),
        ("html", "<!DOCTYPE html>"),
    ],
)
def test_the_table_comes_in_the_formats_of_benches(form: str, start: str, lcp: Lcp) -> None:
    outcome = lcp("bench", "sequences", "--budget", "0", "--format", form)
    assert outcome.code == 0
    assert outcome.out.lower().startswith(start.lower())
    assert "market" in outcome.out
    assert "not installed: quantecon" in outcome.out or form == "csv"


@pytest.mark.usefixtures("few")
def test_json_has_all_times_and_csv_their_medians(lcp: Lcp, tmp_path: Any) -> None:
    file = tmp_path / "sequences.json"
    assert lcp("bench", "sequences", "--budget", "0", "-o", str(file), "-q").out == ""
    rows = json.loads(file.read_text())["sequences"]
    assert [row["sequence"] for row in rows] == ["put", "market"]
    assert [len(row["run"]["seconds"]) for row in rows] == [4, 3]
    header = lcp("bench", "sequences", "--budget", "0", "--format", "csv").out.splitlines()[2].split(",")
    assert {"sequence", "least_n", "run_seconds", "solver_solved", "peer_seconds", "ratio"} <= set(header)


def test_what_has_no_effect_on_sequences_is_refused(lcp: Lcp) -> None:
    outcome = lcp("bench", "sequences", "--method", "shi")
    assert outcome.code == 2
    assert "--method: has no effect on lcp bench sequences" in outcome.err
    assert "sequences: is measured alone" in lcp("bench", "sequences", "quick").err
