"""Models of AMPL in the commands, and lcp in the place of a solver that AMPL calls."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import lcpcli
from lcpcli.cli import ampl
from lcpcli.cli.ampl import NUMBERS
from lcpcli.gallery import nonlinear as gallery
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.solving.result import Status

from ..files.nl_writing import model
from .conftest import Lcp, assert_refused, record

# Supply p + p^2 / 4 = s exceeds the demand 9 / (1 + p) except at the equilibrium price 2; v2 is fixed.
MARKET = model(
    3,
    [
        ((5, 1, 1), {0: 0, 1: 1}, ("neg", ("/", "v2", ("+", 1, "v0")))),
        ((4, 0), {0: 1, 1: -1}, ("/", ("^", "v0", 2), 4)),
    ],
    [(2, 0), (3,), (4, 9)],
    start={0: 1, 1: 1},
)
LINEAR = model(1, [((5, 1, 1), {0: 2}, -3)], [(2, 0)])
UNDEFINED = model(1, [((5, 1, 1), {0: 0}, ("log", ("-", -1, "v0")))], [(2, 0)])
INFEASIBLE = model(1, [((5, 1, 1), {0: -1}, -1)], [(2, 0)])
PLANT = model(1, [((5, 1, 1), {0: 2}, -10)], [(0, 0, 3)])
# Three solutions, (2, 0), (0, 2) and (2/3, 2/3); all (t, 0) with t >= 0.
CHOICE = model(
    2,
    [((5, 1, 1), {0: 1, 1: 2}, -2), ((5, 1, 2), {0: 2, 1: 1}, -2)],
    [(2, 0), (2, 0)],
    objective=("+", ("neg", ("-", "v0", "v1")), -3),
)
UNBOUNDED = model(2, [((5, 1, 1), {1: 1}, 0), ((5, 1, 2), {1: 1}, 0)], [(2, 0), (2, 0)], objective=("neg", "v0"))
HOPELESS = model(1, [((4, 0), {0: 0}, ("+", 1, ("square", "v0")))], [(3,)], start={0: 0.5})


# Two equations for x, and none for y.
SINGULAR = model(2, [((4, 0), {0: 1}, ("exp", "v0")), ((4, 0), {0: 2}, ("square", "v0"))], [(3,), (3,)])


def test_compressed_models_have_their_names(models: Path, lcp: Lcp) -> None:
    (models / "plant.nl.gz").write_bytes(gzip.compress(PLANT))
    assert record(lcp("solve", "plant.nl.gz", "--format", "json"))["names"] == ["plant"]


@pytest.fixture(autouse=True)
def models(folder: Path) -> Path:
    """A folder, entered, with the models."""
    contents = {"market": MARKET, "linear": LINEAR, "undefined": UNDEFINED, "hopeless": HOPELESS}
    contents |= {"infeasible": INFEASIBLE, "choice": CHOICE, "unbounded": UNBOUNDED, "plant": PLANT}
    contents["singular"] = SINGULAR
    for name, content in contents.items():
        (folder / f"{name}.nl").write_bytes(content)
    (folder / "plant.col").write_text("plant\n")
    (folder / "market.col").write_text("price\nsupply\nincome\n")
    return folder


def solution(file: Path) -> tuple[str, list[float], int]:
    """The message, the values and the solve_result_num of a .sol file, as its readers read it."""
    message, _, options, *lines = file.read_text().splitlines()
    assert options == "Options"
    size = int(lines[0])
    assert lines[1 : size + 1] == ["1", "1", "0"]
    rows, duals, variables, values = map(int, lines[size + 1 : size + 5])
    assert (rows, duals) == (int(file.with_suffix(".nl").read_text().splitlines()[1].split()[1]), 0)
    assert values == variables
    *numbers, last = lines[size + 5 :]
    assert last.startswith("objno 0 ")
    assert len(numbers) == values
    return message, list(map(float, numbers)), int(last.split()[2])


def test_nonlinear_model_is_solved_with_its_names_and_on_request_with_a_proof(lcp: Lcp) -> None:
    outcome = lcp("solve", "market.nl", "--bound")
    assert outcome.code == 0
    assert "z = (price 2, supply 3)" in outcome.out
    assert "the only solution at this distance" in outcome.out
    found = record(lcp("solve", "market.nl", "--format", "json"))
    assert (found["status"], found["names"]) == ("solved", ["price", "supply"])
    assert found["z"] == pytest.approx([2, 3], rel=1e-12)


def test_options_for_linear_problems_are_refused(session: Callable[[str], None]) -> None:
    session("refused-models")


def test_options_of_the_method_are_in_force(lcp: Lcp) -> None:
    for words in (["--method", "josephy-newton:restarts=2"], ["--restarts", "2"]):
        assert record(lcp("solve", "market.nl", *words, "--format", "json"))["options"]["restarts"] == 2
    assert_refused(lcp("solve", "linear.nl", "--restarts", "2"), "has no effect with auto; it is for nonlinear models")


def test_start_is_that_of_the_model_or_a_given_one(lcp: Lcp) -> None:
    assert record(lcp("solve", "market.nl", "--z0", "2,3", "--format", "json"))["iterations"] == 0
    assert record(lcp("solve", "market.nl", "--format", "json"))["iterations"] > 0
    assert lcp("solve", "undefined.nl", "--z0", "1").code == 2


def test_model_is_read_by_other_commands_if_it_is_linear(lcp: Lcp) -> None:
    assert record(lcp("solve", "linear.nl", "--format", "json", "--exact"))["exact"]["z"] == ["3/2"]
    assert lcp("check", "linear.nl", "1.5").code == 0
    assert lcp("convert", "linear.nl", "-o", "linear.json").code == 0
    assert_refused(lcp("convert", "market.nl"), "market.nl: is a nonlinear model")


def test_ampl_gets_the_values_of_all_variables_also_fixed_ones(lcp: Lcp, models: Path) -> None:
    for stub in ("market", "market.nl"):
        outcome = lcp(stub, "-AMPL", "tol=1e-9")
        message, values, number = solution(models / "market.sol")
        assert (outcome.code, outcome.out, outcome.err) == (0, f"{message}\n", "")
        assert message.startswith("lcp ")
        assert "solved" in message
        assert number == 0
        assert values == pytest.approx([2, 3, 9])
        (models / "market.sol").unlink()


def test_ampl_is_told_what_is_not_solved(lcp: Lcp, models: Path) -> None:
    for name, option, reason, expected in (
        ("hopeless", "tol=1e-9", "stalled: z is nearly a stationary point", range(403, 500)),
        ("market", "max_iterations=0", "stopped at the iteration limit", (400,)),
        ("infeasible", "tol=1e-9", "has no solution", (200,)),
    ):
        outcome = lcp(name, "-AMPL", option)
        message, values, number = solution(models / f"{name}.sol")
        assert (outcome.code, outcome.out) == (0, f"{message}\n")
        assert reason in message
        assert number in expected
        assert np.isfinite(values).all()


def test_number_for_ampl_says_solved_of_nothing_but_what_is_solved() -> None:
    assert {status for status, number in NUMBERS.items() if number < 200} == {Status.SOLVED}
    assert all(200 <= number < 300 for status, number in NUMBERS.items() if status.has_no_solution)


def test_run_without_a_finite_point_writes_no_values(models: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for number, z, told in ((404, np.array([np.nan, 1.0]), 500), (401, None, 500), (201, None, 201), (300, None, 300)):
        monkeypatch.setattr(ampl, "_answer", lambda *_, own=(number, z): ampl.Answer("a message", *own))
        assert ampl.run(str(models / "market"), []) == 0
        lines = (models / "market.sol").read_text().splitlines()
        assert (lines[-2], lines[-1]) == ("0", f"objno 0 {told}")


def test_objective_of_a_linear_model_chooses_among_its_solutions(lcp: Lcp, models: Path) -> None:
    outcome = lcp("solve", "choice.nl")
    assert outcome.code == 0
    assert "optimal: least value -5 (exact)" in outcome.out
    assert record(lcp("solve", "choice.nl", "--format", "json"))["z"] == [2, 0]
    assert lcp("choice", "-AMPL").code == 0
    message, values, number = solution(models / "choice.sol")
    assert "least value -5 (exact)" in message
    assert (values, number) == ([2, 0], 0)
    assert lcp("choice", "-AMPL", "time_limit=1e-9").code == 0
    assert lcp("unbounded", "-AMPL").code == 0
    assert solution(models / "unbounded.sol")[2] == 300
    assert_refused(lcp("solve", "choice.nl", "--method", "lemke"), "--method: has no effect with the model's objective")
    assert record(lcp("solve", "choice.nl", "--minimize", "z1", "--format", "json"))["value"] == 0
    assert "its objective counts only in lcp solve" in lcp("check", "choice.nl", "2,0").err


def test_bounds_that_count_though_no_condition_states_them_are_told(lcp: Lcp) -> None:
    remark = "0 <= plant <= 3 is complementary to the expression of its condition"
    outcome = lcp("solve", "plant.nl")
    assert "z = (plant 3)" in outcome.out
    assert remark in outcome.err
    assert remark in lcp("plant", "-AMPL").out


def test_comparison_has_by_default_the_methods_that_apply(lcp: Lcp) -> None:
    outcome = lcp("compare", "market.nl")
    assert outcome.code == 0
    assert "josephy-newton" in outcome.out
    assert "shi" in lcp("compare", "linear.nl").out


def test_options_of_ampl_come_from_both_places(lcp: Lcp, models: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("lcp_options", "max_iterations=0 tol=1e-8")
    assert lcp("linear", "-AMPL").code == 0
    assert lcp("market", "-AMPL").code == 0
    assert solution(models / "market.sol")[2] == 400
    assert lcp("market", "-AMPL", "max_iterations=90").code == 0
    assert solution(models / "market.sol")[2] == 0
    assert_refused(lcp("market", "-AMPL", "to=1"), "'to=1': unknown option; did you mean tol=?")
    assert_refused(lcp("market", "-AMPL", "tol=2"), "out of range")
    assert_refused(lcp("market", "-AMPL", "tol=x"), "it must be")
    assert_refused(lcp("none", "-AMPL"), "none.nl: no such file")
    monkeypatch.delenv("lcp_options")
    assert_refused(lcp("linear", "-AMPL", "restarts=2"), "has no effect on a linear model")


def test_errors_have_the_names_of_variables_and_rows(lcp: Lcp, models: Path) -> None:
    rows = [((5, 1, 1), {0: 1}, 0), ((5, 1, 1), {0: 1}, 0)]
    (models / "twice.nl").write_bytes(model(1, rows, [(2, 0)]))
    (models / "twice.col").write_text("price\n")
    (models / "twice.row").write_text("market\nclearing\n")
    assert_refused(lcp("twice", "-AMPL"), "twice.nl: clearing: complements price, and so does market")


def test_terms_that_cancel_keep_their_domain(lcp: Lcp, folder: Path) -> None:
    log = ("log", "v0")
    for name, terms in (("difference", ("-", log, log)), ("product", ("*", 0, log)), ("power", ("^", log, 0))):
        side = 0 if name == "power" else -1  # x = -1, where the logarithm is undefined
        (folder / f"{name}.nl").write_bytes(model(1, [((4, side), {0: 1}, terms)], [(3,)]))
        done = lcp("solve", f"{name}.nl", "--z0", "1", "--restarts", "0", "--quiet")
        assert done.code == 1, done


@pytest.mark.parametrize("row", [((5, 1, 1), {0: 2}, -10), ((5, 1, 1), {0: 0}, ("-", ("exp", "v0"), 40))])
def test_message_in_json_tells_which_bounds_count(lcp: Lcp, folder: Path, row: tuple[object, ...]) -> None:
    (folder / "plant.nl").write_bytes(model(1, [row], [(0, 0, 3)]))
    found = record(lcp("solve", "plant.nl", "--format", "json"))
    assert found["z"] == [3]
    assert found["message"].startswith("solved; 0 <= plant <= 3 is complementary to the expression")


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


def test_inspection_tells_rows_operators_the_start_and_what_is_singular(session: Callable[..., None]) -> None:
    session("inspect-models")


def test_inspection_of_problems_without_an_expression_has_no_operators() -> None:
    for problem, hints in ((gallery.josephy(), 1), (gallery.bratu(12), 0)):  # J of the first one is singular at 0
        inspected = lcpcli.inspect(problem)
        assert (inspected.structural_rank, len(inspected.hints)) == (problem.n, hints)
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
