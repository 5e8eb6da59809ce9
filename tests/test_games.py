"""Games as people have them: payoffs count as they are written, however large and with however many digits."""

from __future__ import annotations

import json
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

import lcpcli
from lcpcli.files import json_format
from lcpcli.model.reductions.game import Game

LARGE = "1e28"
LONG = "0.1234567890123456789012345"


def game_of(text: str) -> Game:
    problem = json_format.parse(text.encode())
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
