"""Nonlinear models in the commands that check, diagnose and compare, and several models in one call."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import lcpcli
from lcpcli.gallery import nonlinear as gallery
from lcpcli.model.nonlinear import NonlinearProblem

from ..files.nl_writing import model
from .conftest import Lcp, assert_refused, record
from .test_nl_models import HOPELESS, LINEAR, MARKET, UNDEFINED

# Two equations for x, and none for y.
SINGULAR = model(2, [((4, 0), {0: 1}, ("exp", "v0")), ((4, 0), {0: 2}, ("square", "v0"))], [(3,), (3,)])


@pytest.fixture(autouse=True)
def _models(folder: Path) -> None:
    """A folder, entered, with the models."""
    contents = {"market": MARKET, "linear": LINEAR, "undefined": UNDEFINED, "hopeless": HOPELESS, "singular": SINGULAR}
    for name, content in contents.items():
        (folder / f"{name}.nl").write_bytes(content)
    (folder / "market.col").write_text("price\nsupply\nincome\n")


def test_answers_to_a_nonlinear_model_are_verified_by_f_evaluated_again(lcp: Lcp) -> None:
    assert lcp("solve", "market.nl", "-o", "market.json").code == 0
    accepted = record(lcp("check", "market.nl", "market.json", "--format", "json"))
    assert (accepted["accepted"], accepted["problem"]) == (True, "market")
    assert accepted["residual"] < 1e-12
    assert lcp("check", "market.nl", "2,3").code == 0
    wrong = lcp("check", "market.nl", "1,1.25", "--format", "json")
    assert wrong.code == 1
    found = json.loads(wrong.out)
    assert (found["accepted"], found["residual"]) == (False, pytest.approx(9 / 2 - 1.25))
    assert [each["index"] for each in found["violations"]] == [0]
    assert lcp("check", "market.nl", "2.0001,3", "--tol", "1e-3").code == 0
    outside = lcp("check", "market.nl", "-1,-0.75")
    assert outside.code == 1
    assert "F is -inf there, in row price" in outside.out
    assert_refused(lcp("check", "market.nl", "2,3", "--exact"), "--exact: has no effect on a nonlinear model")
    assert_refused(lcp("check", "market.nl", "2"), "z: has 1 entry for 2 unknowns")


def test_answers_in_sol_files_are_verified_for_the_unknowns_of_the_model(lcp: Lcp, folder: Path) -> None:
    for stem in ("market", "linear"):
        assert lcp(stem, "-AMPL").code == 0
        assert lcp("check", f"{stem}.nl", f"{stem}.sol").code == 0
    text = (folder / "market.sol").read_text()
    (folder / "moved.sol").write_text(text.replace("\n2.0\n", "\n2.5\n"))
    assert lcp("check", "market.nl", "moved.sol").code == 1
    (folder / "cut.sol").write_text(text[: text.index("objno")].rstrip().rpartition("\n")[0])
    assert_refused(lcp("check", "market.nl", "cut.sol"), "cut.sol: has 2 values of 3 variables for 3 of the model")
    (folder / "bad.sol").write_text("nothing")
    assert_refused(lcp("check", "market.nl", "bad.sol"), "bad.sol: is no .sol file")
    assert_refused(lcp("check", "market.nl", "linear.sol"), "linear.sol: has 1 value of 1 variable for 3 of the model")


def test_nonlinear_problems_are_verified_in_python() -> None:
    problem = gallery.josephy()
    assert lcpcli.check(problem, problem.solutions[0]).accepted
    assert not lcpcli.check(problem, [0, 0, 0, 1]).accepted
    cancelling = NonlinearProblem(lambda z: np.exp(z) - 1.0000000001, lower=None, x0=[0.0])
    for each in (cancelling, *(family() for family in gallery.FAMILIES.values())):
        assert lcpcli.check(each, lcpcli.solve_mcp(each).z).accepted, each
    assert not lcpcli.check(cancelling, [1e-9]).accepted
    assert not lcpcli.check(NonlinearProblem(lambda z: z - 1, x0=[0.0], upper=0.5), [1.0]).accepted


def test_inspection_tells_rows_operators_and_the_start(lcp: Lcp) -> None:
    found = record(lcp("inspect", "market.nl", "--format", "json"))
    assert found["names"] == ["price", "supply"]
    assert (found["equations"], found["nonlinear_rows"], found["fixed_variables"]) == (1, 2, 1)
    assert found["operators"] == {"quotient": 1, "power": 1}
    assert (found["nonzeros"], found["density"], found["structural_rank"]) == (4, 1.0, 2)
    assert found["residual"] == pytest.approx(3.5)
    assert found["hints"] == []
    assert "operators" in lcp("inspect", "market.nl").out
    assert record(lcp("inspect", "undefined.nl", "--format", "json"))["undefined_rows"] == [0]
    assert "classes" in record(lcp("inspect", "linear.nl", "--format", "json"))


def test_inspection_finds_what_is_singular_by_its_pattern(lcp: Lcp) -> None:
    found = record(lcp("inspect", "singular.nl", "--format", "json"))
    assert (found["structural_rank"], found["structural_rank_of_equations"], found["structural_rank_of_free"]) == (
        1,
    ) * 3
    assert any("the 2 equations can be solved for at most 1" in hint for hint in found["hints"])
    assert any("at most 1 of the 2 unknowns" in hint for hint in found["hints"])
    for problem, hints in ((gallery.josephy(), 1), (gallery.bratu(12), 0)):  # J of the first one is singular at 0
        inspected = lcpcli.inspect(problem)
        assert (inspected.rank, len(inspected.hints)) == (problem.n, hints)
        assert inspected.operators is None
        assert "structural rank" in repr(inspected)


def test_several_models_linear_or_not_are_solved_in_one_call(lcp: Lcp, folder: Path) -> None:
    done = lcp("solve", "market.nl", "linear.nl", "hopeless.nl", "--format", "json")
    results = [json.loads(line) for line in done.out.splitlines()]
    assert [each["status"] for each in results] == ["solved", "solved", "stalled"]
    assert [each["problem"] for each in results] == ["market", "linear", "hopeless"]
    assert results[0]["names"] == ["price", "supply"]
    assert done.code == lcp("solve", "hopeless.nl").code == 1
    done = lcp("solve", "market.nl", "undefined.nl", "linear.nl", "-o", "log.jsonl")
    assert done.code == 2
    assert "undefined.nl: x0: F is nan there, in row v0" in done.err
    words = [json.loads(line).get("status") for line in (folder / "log.jsonl").read_text().splitlines()]
    assert sorted(filter(None, words)) == ["bad_input", "solved", "solved"]
    assert lcp("solve", "market.nl", "linear.nl", "-o", "whole.jsonl").code == 0
    assert "3 solved" not in lcp("solve", "market.nl", "linear.nl", "--resume", "whole.jsonl").err
    refused = lcp("solve", "market.nl", "linear.nl", "--method", "lemke")
    assert refused.code == 2
    assert "market.nl: --method: lemke solves linear problems only" in refused.err


def test_variants_of_the_method_are_compared(lcp: Lcp) -> None:
    done = lcp("compare", "market.nl", "--method", "josephy-newton", "--sweep", "restarts=0,2", "--format", "json")
    results = [json.loads(line) for line in done.out.splitlines()]
    assert [(each["method"], each["status"]) for each in results] == [("josephy-newton", "solved")] * 2
    assert lcp("compare", "market.nl", "good.json", "--method", "auto", "--plot", "errors.svg", "-q").code == 0
    assert_refused(lcp("compare", "market.nl", "good.json"), "--method: fixed-point solves linear problems only")


def test_hints_are_those_for_nonlinear_models(lcp: Lcp, folder: Path) -> None:
    outcome = lcp("compare", "market.nl", "--method", "shi")
    assert_refused(outcome, "this model is nonlinear; give josephy-newton")
    (folder / "empty.nl").write_bytes(b"")
    assert_refused(lcp("solve", "empty.nl"), "empty.nl: is empty; write the model again")
