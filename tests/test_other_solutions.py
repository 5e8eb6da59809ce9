"""`lcp solve` says whether a solution is the only one, as far as it is proved for the numbers as written."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import run
from lcpcli.enumeration import others
from lcpcli.gallery import families
from lcpcli.rational.problem import ExactProblem

Lcp = Callable[..., Any]
PROBLEMS = {
    "murty": '{"M": [[1, 2], [2, 1]], "q": [-1, -1]}',
    "faces": '{"M": [[0, 1], [0, 0]], "q": [-1, 0]}',
    "one": '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}',
    "game": '{"A": [[3, 0], [0, 2]], "B": [[2, 0], [0, 3]]}',
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in PROBLEMS.items():
        (tmp_path / f"{name}.json").write_text(text)


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("murty", "; one of several: --all lists them"),
        ("faces", "; one of several: --all lists them"),
        ("one", "; the only solution"),
        ("game", "; one of several: --all lists them"),
    ],
)
def test_single_solve_says_whether_there_are_others(
    name: str, told: str, lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(others, "SECONDS", 60)
    assert lcp("solve", f"{name}.json").out.splitlines()[1].endswith(told)
    assert json.loads(lcp("solve", f"{name}.json", "--format", "json").out)["others"] is told.startswith("; one of")


@pytest.mark.usefixtures("folder")
def test_single_solve_says_nothing_where_nothing_is_known(lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(others, "SECONDS_SMALL", 1e-9)
    assert "solution" not in lcp("solve", "murty.json").out.splitlines()[1]
    assert json.loads(lcp("solve", "murty.json", "--format", "json").out)["others"] is None


def test_no_claim_is_made_about_a_problem_without_a_solution_or_with_many_unknowns(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(others, "SECONDS", 60)
    infeasible, definite = families.make("infeasible", 5, 0), families.make("tridiagonal", 10, 0)
    assert others.search_others(np.zeros(5), lambda: ExactProblem.of_decimals(infeasible)).others is None
    assert not others.is_searched(families.make("tridiagonal", others.MOST + 1, 0), 1000)
    found = others.search_others(run(definite).z, lambda: ExactProblem.of_decimals(definite))
    assert found == others.Findings(others=False, solvable=True)


NEARLY_SINGULAR = '{"M": [[1, 1], [1, 1.00000000000000000001]], "q": [-1, -1]}'
AS_WRITTEN = {  # what is said of the z found in doubles, and what exact arithmetic says of the numbers as written
    "another z": ('{"M": [[4, 2], [2, 1]], "q": [-2.6666666666666665, -1.3333333333333333]}', "", True),
    "a digit beyond doubles": (NEARLY_SINGULAR, "", True),
    "it": (NEARLY_SINGULAR.replace("-1]", "-1.00000000000000000001]"), "; the only solution", True),
    "no z": (
        '{"M": [[0, 1], [0, -1]], "q": [-1, 0.99999999999999999999]}',
        "; with the numbers as written there is no exact solution",
        False,
    ),
}


@pytest.mark.parametrize("name", AS_WRITTEN)
def test_only_solution_is_said_of_the_z_that_is_printed_for_the_numbers_as_written(
    name: str, lcp: Lcp, tmp_path: Path
) -> None:
    text, told, solvable = AS_WRITTEN[name]
    file = tmp_path / "problem.json"
    file.write_text(text)
    line = lcp("solve", str(file)).out.splitlines()[1]
    assert line.endswith(told)
    assert told or "solution" not in line
    record = json.loads(lcp("solve", str(file), "--format", "json").out)
    assert (record["solved"], record["exactly_solvable"]) == (True, solvable)
    assert record["others"] is (False if "only" in told else None)
    every = json.loads(lcp("solve", str(file), "--all", "--format", "json").out)
    assert (every["complete"], len(every["pieces"])) == (True, solvable)
