"""lcp bench sequences: what is counted of each step by itself, by a Solver and by another program, and the reports."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
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
TINY = {  # with their numbers of steps
    SequenceCase("tower", partial(sequences.boxes, "tower", 1, 3)): 3,
    SequenceCase("heap", partial(sequences.boxes, "heap", 3, 14)): 14,
    SequenceCase("put", partial(sequences.put, 20, 4)): 4,
    SequenceCase("market", partial(sequences.market, 3)): 3,
    SequenceCase("obstacle", partial(sequences.moving_load, 5, 3)): 3,
}
TOWER, _, PUT, MARKET, _ = TINY


@pytest.mark.parametrize("case", TINY, ids=lambda case: case.name)
def test_every_step_is_solved_by_itself_and_by_a_solver(case: SequenceCase) -> None:
    row, steps = measure(case, 0.0), TINY[case]
    assert row.steps == steps
    assert [(side.solved, len(side.seconds)) for side in (row.run, row.solver)] == 2 * [(steps, steps)]
    takes = not row.missing and case is not MARKET
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
    shown = [cell for title, cell in zip(sheet.header, sheet.groups[0][0], strict=True) if title == "open"]
    assert shown[:2] == ["1", "1"]


def test_a_wrong_answer_of_the_other_program_does_not_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    def solve(problem: Problem, *_: float) -> registry.Claim:
        return registry.Claim(run(problem).z + (problem.q.size == 20), True, 1e-3, "solved")

    wrong = SimpleNamespace(version=lambda: "1.0", excludes=lambda _: "", solve=solve)
    monkeypatch.setattr(registry, "load", lambda _: wrong)
    assert measure(TOWER, 0.0).peer.solved == 3
    row = measure(PUT, 0.0)
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

    measure(SequenceCase("", follow), 0.0)
    assert (made, updated) == (2 * [2, 3, 2], 2 * [2])  # the first time without a clock


def test_the_report_comes_in_the_formats_of_benches(lcp: Lcp, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two sequences, beside a program that is not installed."""
    monkeypatch.setattr(bench, "CASES", (PUT, MARKET))
    monkeypatch.setattr("lcpcli.peers.packages.installed", lambda _: None)
    starts = {"table": "lcp bench", "csv": "# ", "markdown": "## lcp bench", "latex": "% ", "html": "<!doctype"}
    for form, start in starts.items():
        outcome = lcp("bench", "sequences", "--budget", "0", "--format", form)
        assert (outcome.code, outcome.out[: len(start)].lower()) == (0, start)
        assert "market" in outcome.out
        assert form == "csv" or "not installed: quantecon" in outcome.out
        if form == "csv":
            header = outcome.out.splitlines()[2].split(",")
            assert {"sequence", "least_n", "run_seconds", "solver_solved", "peer_seconds", "ratio"} <= {*header}
        if form in ("table", "markdown"):
            assert "lcp bench sequences: 2 sequences" in outcome.out
    file = tmp_path / "sequences.json"
    assert lcp("bench", "sequences", "--budget", "0", "-o", str(file), "-q").out == ""
    rows = json.loads(file.read_text())["sequences"]
    assert [(row["sequence"], len(row["run"]["seconds"])) for row in rows] == [("put", 4), ("market", 3)]
