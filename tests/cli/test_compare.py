"""lcp compare at a glance: what it took to each level of error, from afar and from near, and whether claims hold."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import Problem, read, run, write
from lcpcli.files import contents
from lcpcli.report import outcome
from lcpcli.report.formats import FORMATS
from lcpcli.report.wording import LEVELS
from lcpcli.solving.driver import verified
from lcpcli.verify.point import Criterion, Point

EXAMPLE = contents.shipped_path("paper-example-1.json")

Lcp = Callable[..., Any]


def records(lcp: Lcp, *arguments: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in lcp("compare", *arguments, "--format", "json").out.splitlines()]


@pytest.fixture
def unsolved(tmp_path: Path) -> str:
    """A problem that brings no solution; it has one."""
    file = str(tmp_path / "own.json")
    write(Problem([[4.0, -1.0], [-1.0, 4.0]], [-3.0, 2.0], name="own"), file)
    return file


def test_milestones_are_those_of_the_trace(lcp: Lcp) -> None:
    for record in records(lcp, EXAMPLE, "--trace"):
        assert [milestone["level"] for milestone in record["milestones"]] == list(LEVELS)
        for milestone in record["milestones"]:
            first = next(row for row in record["trace"] if row["error"] <= milestone["level"])
            assert (milestone["k"], milestone["seconds"]) == (first["k"], first["seconds"])


def test_table_shows_iterations_and_time_to_each_level(lcp: Lcp) -> None:
    lines = lcp("compare", EXAMPLE, "--method", "fixed-point").out.splitlines()
    *_, cells = [line.split() for line in lines if line.startswith("fixed-point")]
    assert cells[1:9:2] == ["16", "30", "42", "46"]
    assert sorted(map(float, cells[2:9:2])) == list(map(float, cells[2:9:2]))


def test_solution_is_computed_where_none_is_known(lcp: Lcp, unsolved: str) -> None:
    for record in records(lcp, unsolved):
        assert record["reference"] == "exact"
        assert record["error"] <= 1e-9
    assert "exact solution (0.75, 0)" in lcp("compare", unsolved).out
    assert {record["reference"] for record in records(lcp, EXAMPLE)} == {"known"}


def test_warm_runs_start_near_the_solution(lcp: Lcp, unsolved: str) -> None:
    found = records(lcp, unsolved, "--warm", "1e-4", "--method", "fixed-point", "--method", "lemke", "--trace")
    assert [(record["method"], record["warm"]) for record in found] == [
        ("fixed-point", False),
        ("fixed-point", True),
        ("lemke", False),
    ]
    cold, warm = found[:2]
    assert 0 < warm["trace"][0]["error"] < 1e-3 < cold["trace"][0]["error"]
    assert warm["iterations"] < cold["iterations"]
    assert "fixed-point warm" in lcp("compare", unsolved, "--warm", "1e-4").out


def test_warm_needs_a_solution(lcp: Lcp, tmp_path: Path) -> None:
    file = str(tmp_path / "infeasible.json")
    write(Problem([[0.0, -1.0], [1.0, 0.0]], [-1.0, -1.0]), file)
    outcome = lcp("compare", file, "--warm", "0.1")
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err == "lcp: --warm: infeasible: no solution was found to start near; leave it out\n"


def test_problem_without_solution_is_compared_by_residuals(lcp: Lcp, tmp_path: Path) -> None:
    file = str(tmp_path / "infeasible.json")
    write(Problem([[0.0, -1.0], [1.0, 0.0]], [-1.0, -1.0]), file)
    outcome = lcp("compare", file)
    assert outcome.code == 1
    assert "to 1e-3" not in outcome.out
    assert "residual" in outcome.out


def test_claim_is_checked_anew_and_not_believed() -> None:
    honest = run(read(EXAMPLE), "fixed-point")
    assert verified(honest).verified is True
    for wrong in (honest.z + 1e-3, -honest.z):
        assert verified(replace(honest, point=Point(Criterion(honest.problem), wrong))).verified is False
    assert verified(run(read(EXAMPLE), "fixed-point", max_iterations=1)).verified is None


def test_small_residual_far_from_the_solution_is_remarked() -> None:
    problem = read(contents.shipped_path("bimatrix.json"))
    one, other = problem.solutions[:2]
    only_one = replace(problem, solutions=(one,))
    found = run(only_one, "auto", z0=other)
    assert found.solved
    assert "either it is another solution" in outcome.doubt(found)
    assert outcome.doubt(run(only_one, "auto", z0=one)) == ""
    assert outcome.doubt(run(problem, "auto", z0=other)) == ""


@pytest.mark.parametrize("size", ["0", "-1", "nan", "inf"])
def test_size_of_the_disturbance_is_checked(size: str, lcp: Lcp) -> None:
    outcome = lcp("compare", EXAMPLE, f"--warm={size}")
    assert outcome.code == 2
    assert "--warm" in outcome.err


def test_disturbance_is_the_same_each_time_and_of_the_size_asked_for() -> None:
    from lcpcli.solving.reference import near

    problem = read(EXAMPLE)
    start, again = near(problem, 1e-3), near(problem, 1e-3)
    assert np.array_equal(start, again)
    z = problem.solutions[0]
    distance = np.abs(start - (z - problem.w(z)) / 2).max()
    assert 1e-4 < distance < 1e-2


@pytest.mark.parametrize("form", FORMATS)
def test_files_none_of_which_can_be_read_are_told_in_lines_in_every_format(form: str, lcp: Lcp, tmp_path: Path) -> None:
    file = tmp_path / "bad.json"
    file.write_text("[")
    outcome = lcp("compare", str(file), str(file), "--format", form)
    assert outcome.code == 2
    assert [line.split(":")[0] for line in outcome.err.splitlines()] == ["lcp", "lcp"]
    assert len(outcome.out.splitlines()) == 2 * (form == "json")
