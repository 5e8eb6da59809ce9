"""Games as people have them: payoffs of any size and with any digits, and strategies that are checked as such."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli.files import json_format
from lcpcli.files.fields import made
from lcpcli.model.origins import Game
from lcpcli.report import programs_and_games

LARGE = "1e28"
LONG = "0.1234567890123456789012345"


def game_of(text: str) -> Game:
    problem = made(json_format.fields(text.encode()))
    assert isinstance(problem, lcpcli.Problem)
    assert isinstance(problem.origin, Game)
    return problem.origin


@pytest.fixture
def constant(tmp_path: Path) -> str:
    """A game in which the row player gets 1e28 in any case."""
    file = tmp_path / "constant.json"
    file.write_text(f'{{"A": [[{LARGE}, {LARGE}], [{LARGE}, {LARGE}]], "B": [[{LARGE}, 0], [0, {LARGE}]]}}')
    return str(file)


def test_payoffs_of_more_digits_than_decimals_have_by_default_give_an_equilibrium(
    constant: str, lcp: Callable[..., Any]
) -> None:
    assert "an equilibrium: by a best response" in lcp("solve", constant).out
    found = json.loads(lcp("solve", constant, "--all", "--format", "json").out)
    assert found["complete"]
    assert len(found["solutions"]) == 4
    assert lcp("solve", constant, "--exact", "--quiet").code == 0


@pytest.mark.parametrize("size", [1e28, 1e100, 1e300, 1e-300])
def test_costs_of_equal_payoffs_are_one(size: float) -> None:
    game = Game.of([[size, size]], [[size, -size]], (), ())
    M, _ = game.conditions()
    assert M[0, 1:].tolist() == [1, 1]
    assert game.cost_constants()[0] == Fraction(repr(size)) + 1


def test_digits_beyond_doubles_in_json_decide(lcp: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "game.json").write_text(f'{{"A": [[{LONG}6], [{LONG}7]], "B": [[1], [1]]}}')
    found = json.loads(lcp("solve", str(tmp_path / "game.json"), "--all", "--exact", "--format", "json").out)
    (only,) = found["solutions"]
    assert only["equilibrium"]["row"] == ["0", "1"]
    assert Fraction(only["equilibrium"]["payoffs"][0]) == Fraction(f"{LONG}7")
    single = json.loads(lcp("solve", str(tmp_path / "game.json"), "--exact", "--format", "json").out)
    assert single["answer"]["exact"]["row"] == ["0", "1"]


def test_digits_are_kept_in_coordinates_in_csv_and_in_files_written_again(
    lcp: Callable[..., Any], tmp_path: Path
) -> None:
    sparse = f'{{"format": "coo", "shape": [1, 2], "rows": [0], "cols": [1], "values": [{LONG}]}}'
    game = game_of(f'{{"A": {sparse}, "B": [[1e-40, 10000000000000000000000000001]]}}')
    expected = ([[0, Fraction(LONG)]], [[Fraction("1e-40"), Fraction(10**28 + 1)]])
    assert game.payoffs() == expected
    for suffix in (".json", ".npz", ".mat"):
        file = tmp_path / f"game{suffix}"
        lcpcli.write(lcpcli.Problem(*game.conditions(), origin=game), file)
        again = lcpcli.read(file).origin
        assert isinstance(again, Game)
        assert again.payoffs() == expected
    for name, payoffs in zip("AB", expected, strict=True):
        (tmp_path / f"{name}.csv").write_text(",".join(str(value) for value in payoffs[0]) + "\n")
    files = [str(tmp_path / f"{name}.csv") for name in "AB"]
    (only,) = json.loads(lcp("solve", *files, "--game", "--all", "--exact", "--format", "json").out)["solutions"]
    assert only["equilibrium"]["payoffs"] == [str(expected[0][0][1]), str(10**28 + 1)]


def test_payoffs_that_cannot_be_written_out_are_refused(lcp: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "game.json").write_text('{"A": [[1e-4000]], "B": [[1]]}')
    refused = lcp("solve", str(tmp_path / "game.json"))
    assert refused.code == 2
    assert "game.json: has the payoff '1e-4000'; write it with at most 1000 digits" in refused.err


@pytest.fixture
def sexes(tmp_path: Path) -> str:
    """The battle of the sexes."""
    (tmp_path / "sexes.json").write_text('{"A": [[3, 0], [0, 2]], "B": [[2, 0], [0, 3]], "rows": ["opera", "box"]}')
    return str(tmp_path / "sexes.json")


@pytest.mark.parametrize("options", [(), ("--exact",)], ids=["doubles", "exact"])
@pytest.mark.parametrize("pair", ["0.6,0.4,0.4,0.6", "1,0,1,0", "0 1 0 1", "3/5,2/5,2/5,3/5"])
def test_the_strategies_of_an_equilibrium_are_accepted(
    pair: str, options: tuple[str, ...], sexes: str, lcp: Callable[..., Any]
) -> None:
    checked = lcp("check", sexes, pair, *options)
    assert checked.code == 0
    assert "the strategies are an equilibrium: by a best response the row player would gain 0" in checked.out


@pytest.mark.parametrize("options", [(), ("--exact",)], ids=["doubles", "exact"])
def test_other_strategies_are_refused_with_what_each_player_would_gain(
    options: tuple[str, ...], sexes: str, lcp: Callable[..., Any]
) -> None:
    checked = lcp("check", sexes, "0.5,0.5,0.4,0.6", "--format", "json", *options)
    record = json.loads(checked.out)
    assert checked.code == 1
    assert "are not an equilibrium" in record["message"]
    assert [float(Fraction(gain)) for gain in record["strategies"]["gains"]] == pytest.approx([0, 0.2])
    assert record["violated"] == 1  # the column that is played and no best response
    assert record["violations"][0]["index"] == 2


def test_printed_digits_are_divided_by_their_sum(lcp: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "rps.json").write_text(
        '{"A": [[0, -1, 1], [1, 0, -1], [-1, 1, 0]], "B": [[0, 1, -1], [-1, 0, 1], [1, -1, 0]]}'
    )
    checked = lcp("check", str(tmp_path / "rps.json"), ",".join(6 * ["0.3333333"]))
    assert checked.code == 0
    assert "the strategies, divided by their sums, are an equilibrium" in checked.out


@pytest.mark.parametrize("options", [(), ("--exact",)], ids=["doubles", "exact"])
def test_what_solve_has_written_of_a_game_is_checked(
    options: tuple[str, ...], sexes: str, lcp: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "one.json").write_text(lcp("solve", sexes, "--format", "json", *options).out)
    one = lcp("check", sexes, str(tmp_path / "one.json"), *options)
    assert one.code == 0
    assert "as strategies, an equilibrium" in one.out
    (tmp_path / "all.json").write_text(lcp("solve", sexes, "--all", "--format", "json", "--exact").out)
    every = lcp("check", sexes, str(tmp_path / "all.json"), *options)
    assert every.code == 0
    assert [f"solution {k} of 3: the strategies are" in every.out for k in (1, 2, 3)] == [True] * 3
    wrong = json.loads((tmp_path / "all.json").read_text())
    wrong["solutions"][1]["equilibrium"]["row"] = ["1/2", "1/2"]
    (tmp_path / "wrong.json").write_text(json.dumps(wrong))
    refused = lcp("check", sexes, str(tmp_path / "wrong.json"), "--format", "json", *options)
    assert refused.code == 1
    assert [json.loads(line)["accepted"] for line in refused.out.splitlines()] == [True, False, True]


def test_all_solutions_of_any_problem_are_checked(lcp: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "two.json").write_text('{"M": [[-1]], "q": [1]}')
    (tmp_path / "all.json").write_text(lcp("solve", str(tmp_path / "two.json"), "--all", "--format", "json").out)
    checked = lcp("check", str(tmp_path / "two.json"), str(tmp_path / "all.json"), "--exact")
    assert (checked.code, checked.out.count("z is an exact solution")) == (0, 2)


@pytest.mark.parametrize(
    ("given", "fault"),
    [
        ({"row": [0.6, 0.5], "column": [0.4, 0.6]}, "row: has the sum 1.1"),
        ({"row": [0.6, 0.4], "column": [1.4, -0.4]}, "column: has a negative entry"),
        ({"row": [0.6], "column": [0.4, 0.4, 0.6]}, "row: has 1 entry for 2 strategies"),
        ({"row": "0.6", "column": [0.4, 0.6]}, "row: is the text"),
        ({"solutions": []}, "solutions: is empty"),
        ({"solutions": [3]}, "solutions[0]: is a number"),
    ],
)
def test_what_are_no_strategies_gets_a_line(
    given: dict[str, Any], fault: str, sexes: str, lcp: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "s.json").write_text(json.dumps(given))
    refused = lcp("check", sexes, str(tmp_path / "s.json"))
    assert refused.code == 2
    assert f"s.json: {fault}" in refused.err


def test_strategies_need_a_game(lcp: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "p.json").write_text('{"M": [[1, 0], [0, 1]], "q": [-1, -1]}')
    (tmp_path / "s.json").write_text('{"row": [1], "column": [1]}')
    refused = lcp("check", str(tmp_path / "p.json"), str(tmp_path / "s.json"))
    assert refused.code == 2
    assert "s.json: row: is a strategy, but the problem is not a game; give z" in refused.err


def test_strategies_whose_z_is_beyond_doubles_are_verified_in_exact_arithmetic(
    lcp: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "tiny.json").write_text('{"A": [[1e-310, 0], [0, 2e-310]], "B": [[2e-310, 0], [0, 3e-310]]}')
    refused = lcp("check", str(tmp_path / "tiny.json"), "1,0,1,0")
    assert refused.code == 2
    assert "z: of these strategies exceeds the double-precision range; scale the payoffs" in refused.err
    assert lcp("check", str(tmp_path / "tiny.json"), "1,0,1,0", "--exact").code == 0


@pytest.mark.parametrize("seed", range(8))
def test_the_library_accepts_the_strategies_of_its_results_at_any_scale(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scale, offset = 10.0 ** rng.integers(-8, 9), rng.integers(-3, 4)
    A, B = (scale * (rng.normal(size=(3, 4)) + offset) for _ in range(2))
    problem = lcpcli.from_game(A, B)
    answer = lcpcli.run(problem, "auto").answer
    verification = lcpcli.check(problem, np.concatenate((answer.row, answer.column)))
    assert verification
    assert verification.strategies is not None
    assert verification.strategies.payoffs == pytest.approx(answer.payoffs)
    other = lcpcli.check(problem, [1, 0, 0, 0.25, 0.25, 0.25, 0.25])
    assert not other
    assert max(other.strategies.gains) > 0  # type: ignore[union-attr]


def test_iterates_of_a_game_are_strategies_with_payoffs(sexes: str, lcp: Callable[..., Any]) -> None:
    shown = lcp("compare", sexes, "--method", "newton", "--method", "lemke").out.splitlines()
    assert shown[1].split()[:9] == ["method", "k", "opera", "box", "y1", "y2", "row", "gets", "column"]
    rows = "\n".join(" ".join(line.split()) for line in shown)
    assert "0.6000000 0.4000000 0.4000000 0.6000000 1.2 1.2" in rows
    assert "lemke 1 - - - - - -" in rows  # z = 0


def test_iterates_of_a_game_in_latex_have_the_names_of_the_strategies(sexes: str, lcp: Callable[..., Any]) -> None:
    header = "method & $k$ & opera & box & $y_{1}$ & $y_{2}$ & row gets & column gets & "
    assert header in lcp("solve", sexes, "--method", "newton", "--format", "latex").out


def test_iterates_of_a_game_in_csv_are_strategies(sexes: str, lcp: Callable[..., Any], tmp_path: Path) -> None:
    assert lcp("solve", sexes, "--method", "newton", "--quiet", "--trace", str(tmp_path / "t.csv")).code == 0
    lines = (tmp_path / "t.csv").read_text().splitlines()
    header, start, *_, last = csv.reader(line for line in lines if not line.startswith("#"))
    assert header[3:9] == ["opera", "box", "y1", "y2", "row gets", "column gets"]
    assert start[3:9] == [""] * 6
    assert [float(cell) for cell in last[3:9]] == pytest.approx([0.6, 0.4, 0.4, 0.6, 1.2, 1.2])


def test_iterates_of_a_game_beside_another_problem_in_csv_are_components_of_z(
    sexes: str, lcp: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "p.json").write_text('{"M": [[1, 0], [0, 1]], "q": [-1, -1]}')
    written = lcp("compare", sexes, str(tmp_path / "p.json"), "--method", "newton", "--format", "csv", "--trace").out
    assert "problem,method,k,z1,z2,z3,z4,residual" in written


def test_a_wide_game_shows_the_first_strategies_and_the_last(lcp: Callable[..., Any], tmp_path: Path) -> None:
    file = tmp_path / "wide.json"
    file.write_text(json.dumps({"A": np.eye(10).tolist(), "B": np.eye(10).tolist()}))
    shown = lcp("solve", str(file), "--method", "newton", "--format", "latex").out
    assert r"$x_{10}$ & \dots & $y_{10}$ & row gets & column gets" in shown
    assert r"0.1000000 & 0.1000000 & \dots & 0.1000000 & 0.1 & 0.1" in shown


@pytest.mark.parametrize("form", ["latex", "markdown"])
def test_documents_show_all_strategies_of_a_game_of_six(form: str, lcp: Callable[..., Any], tmp_path: Path) -> None:
    file = tmp_path / "six.json"
    file.write_text(json.dumps({"A": np.eye(3).tolist(), "B": np.eye(3).tolist()}))
    shown = lcp("solve", str(file), "--method", "newton", "--format", form).out
    assert " ".join(shown.split()).count("0.3333333") >= 6
    assert "dots" not in shown


def test_headings_of_strategies_with_the_same_names_differ() -> None:
    game = Game.of([[3, 0], [0, 2]], [[2, 0], [0, 3]], ["opera", "x"], ["opera", "y"])
    assert programs_and_games.headings(game) == ["row opera", "x", "column opera", "y", "row gets", "column gets"]


def test_payoff_that_is_not_met_hides_no_gain() -> None:
    """The costs of the column of 1 are rounded beside 1e16, so that the complementarity problem does not know of it."""
    A, B = [[5, 0, 0], [0, 1, 0], [0, 0, 1e16]], [[1, 0, 0], [0, 5, 0], [-1e16, -1e16, -1e16]]
    game = lcpcli.from_game(A, B)
    verification = lcpcli.check(game, [0, 0, 1, 0, 1, 0])
    assert not verification.accepted
    assert verification.strategies is not None
    assert verification.strategies.gains == (1.0, 0.0)
    answer = lcpcli.run(game).answer
    gain = max(np.array(A) @ answer.column) - answer.row @ np.array(A) @ answer.column
    assert answer.statement.startswith("not an equilibrium" if gain > 1e-6 else "an equilibrium")


def test_equilibrium_beside_forbidden_moves_is_one() -> None:
    """Moves that cost 1e9 are never played, and gains are measured by the payoffs that are met."""
    A = [[3, 0, -1e9], [0, 2, -1e9], [-1e9, -1e9, -1e9]]
    B = [[2, 0, -1e9], [0, 3, -1e9], [-1e9, -1e9, -1e9]]
    game = lcpcli.from_game(A, B)
    assert lcpcli.check(game, [0.6, 0.4, 0, 0.4, 0.6, 0]).accepted
    found = lcpcli.check(game, [0.7, 0.3, 0, 0.4, 0.6, 0])
    assert not found.accepted
