"""lcp compare at a glance: what it took to each level of error, from afar and from near, and whether claims hold."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from lcpcli import Problem, read, run, write
from lcpcli.files import contents
from lcpcli.report import outcome
from lcpcli.report.wording import LEVELS
from lcpcli.solving.driver import verified
from lcpcli.verify.point import Criterion, Point

from .conftest import EXAMPLE, Lcp, assert_refused, records


@pytest.fixture
def unsolved(folder: Path) -> str:
    """A problem that brings no solution; it has one."""
    write(Problem([[4.0, -1.0], [-1.0, 4.0]], [-3.0, 2.0], name="own"), folder / "own.json")
    return "own.json"


def compared(lcp: Lcp, *words: str) -> list[dict[str, Any]]:
    return records(lcp("compare", *words, "--format", "json"))


def test_milestones_are_those_of_the_trace(lcp: Lcp) -> None:
    for record in compared(lcp, EXAMPLE, "--trace", "--method", "fixed-point"):
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
    (record,) = compared(lcp, unsolved, "--method", "newton")
    assert (record["reference"], record["error"] <= 1e-9) == ("exact", True)
    assert "exact solution (0.75, 0)" in lcp("compare", unsolved, "--method", "newton").out
    assert {record["reference"] for record in compared(lcp, EXAMPLE)} == {"known"}


def test_an_option_of_earlier_versions_is_refused_with_what_to_do_instead(lcp: Lcp) -> None:
    told = "lcp: --warm: is no option of lcp compare; it has gone: give a start near the solution by --z0"
    assert_refused(lcp("compare", EXAMPLE, "--warm", "0.1"), f"{told}\n")


def test_problem_without_solution_is_compared_by_residuals(lcp: Lcp, folder: Path) -> None:
    assert (folder / "none.json").exists()
    methods = ("--method", "shi", "--method", "fixed-point", "--method", "newton")
    outcome = lcp("compare", "none.json", *methods, "--max-iterations", "300")
    assert (outcome.code, "to 1e-3" in outcome.out, "residual" in outcome.out) == (1, False, True)


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


@pytest.mark.parametrize("form", ["table", "json"])
def test_files_none_of_which_can_be_read_are_told_in_lines(form: str, lcp: Lcp, folder: Path) -> None:
    (folder / "bad.json").write_text("[")
    outcome = lcp("compare", "bad.json", "bad.json", "--format", form)
    assert [line.split(":")[0] for line in outcome.err.splitlines()] == ["lcp", "lcp"]
    assert (outcome.code, len(outcome.out.splitlines())) == (2, 2 * (form == "json"))


def test_auto_runs_too_where_neither_published_method_solves_and_the_exit_code_is_theirs(
    lcp: Lcp, tmp_path: Path
) -> None:
    file = tmp_path / "infeasible.json"
    file.write_text('{"M": [[-1]], "q": [-1]}')
    outcome = lcp("compare", str(file), "--format", "json")
    found = [json.loads(line) for line in outcome.out.splitlines()]
    assert [(record["label"], record["status"]) for record in found][2:] == [("auto", "infeasible")]
    assert outcome.code == 1
    shown = lcp("compare", str(file)).out
    assert "try --method auto" not in shown
    named = lcp("compare", str(file), "--method", "shi", "--method", "fixed-point", "--format", "json").out
    assert len(named.splitlines()) == 2
    solved = lcp("compare", EXAMPLE, "--format", "json").out
    assert len(solved.splitlines()) == 2
