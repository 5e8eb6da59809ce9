"""Mixed problems as users see them: their bounds are named, states are told, and sentences do not speak of z >= 0."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import Problem, plot, run, solve
from lcpcli.methods import shi
from lcpcli.report import notebook

Lcp = Callable[..., Any]

MIXED = {
    "M": [[2, 1, 0], [1, 2, 1], [0, 1, 3]],
    "q": [-5, -6, 4],
    "lower": [None, 0, -1],
    "upper": [None, 2, None],
    "name": "mixed",
}
SIZE = "n = 3 (1 free, 1 lower bound, 1 boxed)"
BASIS = ["basic", "upper", "lower"]


@pytest.fixture
def file(tmp_path: Path) -> str:
    path = tmp_path / "mixed.json"
    path.write_text(json.dumps(MIXED))
    return str(path)


def test_basis_has_the_state_of_each_variable_of_every_problem() -> None:
    assert run(Problem(**MIXED)).basis == BASIS
    assert solve([[2, 1], [1, 2]], [-5, 1]).basis == ["basic", "lower"]
    assert solve([[2.0]], [-5.0], lower=1, upper=1).basis == ["lower"]
    assert solve([[1.0]], [-1.0], upper=5e-324).basis == ["upper"], "although half of this bound underflows"
    assert solve([[0]], [-5]).to_dict()["basis"] is None
    assert solve([[1e300]], [-1e300], lower=-1, x0=[1e300], max_iterations=0).basis == ["lower"]


def test_next_step_begins_with_the_basis_in_json(lcp: Lcp, tmp_path: Path) -> None:
    contact = {"M": [[2, 2, -1], [2, 2, -1], [1, 1, 0]], "q": [-1, -1, 0.5]}  # the impulses are not unique
    for name, q in (("first", [-1, -1, 0.5]), ("next", [-1.1, -1.1, 0.5])):
        (tmp_path / f"{name}.json").write_text(json.dumps(contact | {"q": q}))
    result = tmp_path / "result.jsonl"
    assert lcp("solve", str(tmp_path / "first.json"), "-o", str(result)).code == 0
    assert json.loads(result.read_text())["basis"] == run(Problem(**contact)).basis
    found = json.loads(lcp("solve", str(tmp_path / "next.json"), "--basis", str(result), "--format", "json").out)
    assert (found["solved"], found["iterations"]) == (True, 1)


def test_every_command_and_format_says_which_bounds_there_are(lcp: Lcp, file: str) -> None:
    for form in ("markdown", "latex", "csv"):
        assert SIZE in lcp("solve", file, "--format", form).out
    for command in (("solve", file), ("check", file, "1.5,2,-1"), ("inspect", file)):
        outcome = lcp(*command)
        assert outcome.code == 0
        assert outcome.out.startswith(f"mixed: {SIZE}")


def test_csv_has_a_column_of_states_and_is_read_back(lcp: Lcp, file: str, tmp_path: Path) -> None:
    answer = str(tmp_path / "answer.csv")
    lcp("solve", file, "-o", answer)
    table = [line for line in Path(answer).read_text().splitlines() if not line.startswith("#")]
    assert table == ["component,z,w,state", "1,1.5,0.0,basic", "2,2.0,-1.5,upper", "3,-1.0,3.0,lower"]
    assert lcp("check", file, answer).code == 0


def test_long_basis_is_counted_in_the_table(lcp: Lcp, tmp_path: Path) -> None:
    path = tmp_path / "long.json"
    path.write_text(json.dumps({"M": np.eye(30).tolist(), "q": [-3] * 10 + [0] * 20, "lower": -1, "upper": 2}))
    assert "basis: 20 basic, 10 upper\n" in lcp("solve", str(path)).out
    path.write_text(json.dumps(MIXED))
    assert "basis = (basic, upper, lower)\n" in lcp("solve", str(path)).out


def test_sentence_on_an_infeasible_problem_speaks_of_its_bounds() -> None:
    found = solve([[1, 1], [1, 1]], [1, -2], lower=None)
    assert found.status.word == "infeasible"
    assert "no z within the bounds has w with the signs that they ask for" in found.message
    assert "z >= 0" not in found.message
    assert "no z >= 0 has Mz + q >= 0" in solve([[-1]], [-1]).message


def test_notebook_shows_bounds() -> None:
    problem = Problem(**MIXED)
    assert SIZE in repr(run(problem))
    assert "<td>-inf</td><td>inf</td>" in notebook.problem_html(problem)
    assert "<th>l</th>" not in notebook.problem_html(Problem([[1]], [1]))


def test_runs_on_different_bounds_do_not_share_a_panel() -> None:
    runs = [solve([[2]], [-5], lower=lower, trace=True) for lower in (0, 0, 1)]
    assert repr(plot(runs)) == "<Picture: 3 runs on 2 problems>"


@pytest.mark.parametrize("shift", [0.0, 1e6])
def test_every_advice_is_accepted_and_solves_the_problem_wherever_its_bounds_lie(shift: float) -> None:
    problem = Problem([[2, 1], [1, 3]], [-5 - 3 * shift, -6 - 4 * shift], lower=shift, upper=shift + 2)
    failed = run(problem, "shi", p=10)
    less_smoothing, automatic, *_ = failed.suggestions.ways
    without_bounds = shi.default_p(Problem([[2, 1], [1, 3]], [-5, -6]))
    assert 0 <= less_smoothing["p"] / without_bounds - 1 < 1
    assert automatic == {"method": "auto"}
    for options in failed.suggestions.ways:
        assert run(problem, **{"method": "shi", **options}).solved
