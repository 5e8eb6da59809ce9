"""Games in extensive form: equilibria against all pure strategies, and strategies that are given to be checked."""

from __future__ import annotations

import json
from collections.abc import Callable
from fractions import Fraction
from math import prod
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli.gallery.families import make
from lcpcli.games.behavior import Behavior, Strategy, plan_of, point_of, strategy_of
from lcpcli.model.extensive import ExtensiveGame
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.solving.proof import prove

from . import random_trees

Lcp = Callable[..., Any]
MOST_PURE = 200  # strategies of a player that are tried one after another

ENTRY = """EFG 2 R "entry" { "entrant" "incumbent" }
p "" 1 1 "" { "in" "out" } 0
p "" 2 1 "" { "fight" "share" } 0
t "" 1 "" { -1 -1 }
t "" 2 "" { 1 1 }
t "" 3 "" { 0 2 }
"""
# Kuhn's poker has the value -1/18: H. W. Kuhn, A simplified two-person poker (1950)
KUHN = Fraction(-1, 18)


def game_of(problem: lcpcli.Problem) -> ExtensiveGame:
    assert isinstance(problem.origin, ExtensiveGame)
    return problem.origin


def exactly(problem: lcpcli.Problem) -> lcpcli.Result:
    return prove(lambda: ExactProblem.of_decimals(problem), lcpcli.run(problem))


def small_games() -> list[lcpcli.Problem]:
    """Random trees whose pure strategies can all be tried."""
    problems = (lcpcli.from_efg(random_trees.text_of(seed)) for seed in range(60))
    return [
        problem
        for problem in problems
        if all(prod(len(own.actions) for own in player.sets) <= MOST_PURE for player in game_of(problem).tree.players)
    ]


def test_no_pure_strategy_gains_in_an_equilibrium_in_fractions() -> None:
    problems = small_games()
    assert len(problems) > 30
    for problem in problems:
        found = exactly(problem).answer.exact
        game = game_of(problem)
        x, y = found.plans
        strategies = [strategy_of(player, plan) for player, plan in zip(game.tree.players, (x, y), strict=True)]
        assert random_trees.gains(game.tree, strategies) == [0, 0]
        assert list(found.payoffs) == random_trees.payoffs(game.tree, strategies)
        assert tuple(found.gains) == (0, 0)


def test_lemke_solves_every_tree_as_its_theorem_says() -> None:
    assert {lcpcli.run(problem, "lemke").status.word for problem in small_games()} == {"solved"}


def test_best_responses_on_the_tree_are_the_best_of_all_pure_strategies() -> None:
    random, gainers = Random(0), 0
    for problem in small_games():
        game = game_of(problem)
        strategies = [[_mixture(random, len(own.actions)) for own in each.sets] for each in game.tree.players]
        own = Behavior.of(game, strategies)
        assert list(own.gains) == random_trees.gains(game.tree, strategies)
        assert list(own.payoffs) == random_trees.payoffs(game.tree, strategies)
        gainers += any(own.gains)
        assert all(
            plan_of(player, strategy_of(player, plan)) == plan
            for player, plan in zip(game.tree.players, own.plans, strict=True)
        )
    assert gainers > 20


def _mixture(random: Random, size: int) -> list[Fraction]:
    weights = [random.randint(0, 3) for _ in range(size)]
    weights[random.randrange(size)] += 1
    return [Fraction(weight, sum(weights)) for weight in weights]


def test_costs_of_best_responses_by_the_sequence_form_are_the_payoffs_on_the_tree() -> None:
    for problem in small_games():
        game = game_of(problem)
        strategies: list[Strategy] = [
            [[Fraction(1, len(own.actions))] * len(own.actions) for own in each.sets] for each in game.tree.players
        ]
        own = Behavior.of(game, strategies)
        _, _, u, v = game.parts(point_of(game, *own.plans))
        best = [payoff + gain for payoff, gain in zip(own.payoffs, own.gains, strict=True)]
        assert [c.constant - value[0] / c.factor for c, value in zip(game.costs, (u, v), strict=True)] == best


def test_kuhns_poker_has_its_value_and_degenerate_equilibria_are_proved() -> None:
    for n in (40, 76):
        problem = make("poker", n, perturbation=0)
        assert problem.n == n
        one, two = exactly(problem).answer.exact.payoffs
        assert one == -two
        assert one == KUHN or n > 40


@pytest.mark.parametrize(("family", "n"), [("poker", 160), ("bargaining", 142), ("poker", 244)])
def test_games_of_the_gallery_are_solved_in_fractions(family: str, n: int) -> None:
    problem = make(family, n, seed=3 * (family == "poker"))
    assert (problem.M + problem.M.T).min() >= 0  # so that M is copositive
    answer = exactly(problem).answer
    assert (problem.n, tuple(answer.exact.gains)) == (n, (0, 0))
    assert answer.statement.startswith("an equilibrium")
    assert np.allclose(answer.payoffs, [float(value) for value in answer.exact.payoffs])


def test_every_equilibrium_of_a_small_tree_is_among_all_solutions(lcp: Lcp, tmp_path: Path) -> None:
    (tmp_path / "entry.efg").write_text(ENTRY)
    found = json.loads(lcp("solve", str(tmp_path / "entry.efg"), "--all", "--exact", "--format", "json").out)
    plans = {tuple(each["z"][:6]) for each in found["solutions"]}
    assert ("1", "1", "0", "1", "0", "1") in plans  # in, share
    assert ("1", "0", "1", "1", "1", "0") in plans  # out, fight: a threat, no equilibrium of the subgame
    assert found["complete"]


def test_strategies_are_checked_by_best_responses(lcp: Lcp, tmp_path: Path) -> None:
    file = str(tmp_path / "entry.efg")
    Path(file).write_text(ENTRY)
    threat = lcp("check", file, "0,1,1/2,1/2", "--exact")
    assert threat.code == 0
    assert "the strategies are an equilibrium: by a best response entrant would gain 0, incumbent 0" in threat.out
    wrong = lcp("check", file, "1,0,1,0")
    assert wrong.code == 1
    assert "not an equilibrium to the tolerance: by a best response entrant would gain 1, incumbent 2" in wrong.out
    refused = lcp("check", file, "1,0,1,1")
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert "information set 1 of incumbent: has 1, 1 as the probabilities of its actions" in refused.err


def test_a_result_is_checked_and_its_strategies_alone(lcp: Lcp, tmp_path: Path) -> None:
    game, result, own = (str(tmp_path / name) for name in ("entry.efg", "result.json", "own.json"))
    Path(game).write_text(ENTRY)
    assert lcp("solve", game, "--exact", "-o", result).code == 0
    assert lcp("check", game, result, "--exact").code == 0
    answer = json.loads(Path(result).read_text())["answer"]
    Path(own).write_text(json.dumps(answer["exact"]))
    assert "the strategies are an equilibrium" in lcp("check", game, own, "--exact").out
    Path(own).write_text(json.dumps({"information_sets": answer["information_sets"][:1]}))
    assert "has 2 entries" in lcp("check", game, own).err


def test_tables_have_a_row_for_each_information_set_and_csv_the_probabilities(lcp: Lcp, tmp_path: Path) -> None:
    game, table = str(tmp_path / "entry.efg"), str(tmp_path / "entry.csv")
    Path(game).write_text(ENTRY.replace('2 1 ""', '2 1 "after entry"'))
    out = lcp("solve", game, "--exact").out
    assert "payoffs entrant 1, incumbent 1" in out
    assert [line.split() for line in out.splitlines() if line.startswith("incumbent ")] == [
        ["incumbent", "after", "entry", "1", "share", "1"]
    ]
    assert lcp("solve", game, "--exact", "-o", table).code == 0
    assert "6,1,0,basic,incumbent: after entry: share,incumbent,1,1" in Path(table).read_text()
    assert lcp("check", game, table, "--exact").code == 0


def test_an_unsolved_game_has_no_strategies() -> None:
    problem = lcpcli.from_efg(ENTRY)
    result = lcpcli.run(problem, "shi", max_iterations=1)
    assert not result.solved
    assert (result.answer.information_sets, result.answer.payoffs) == (None, None)


def test_strategies_at_sets_that_the_strategies_of_their_player_exclude_are_probabilities() -> None:
    """A player who stays out has a strategy for later, each action with the same probability."""
    game = """EFG 2 R "out" { "A" "B" }
p "" 1 1 "" { "out" "in" } 0
t "" 1 "" { 2, 2 }
p "" 1 2 "later" { "l" "r" } 0
t "" 2 "" { 0, 0 }
p "" 2 1 "" { "a" "b" } 0
t "" 3 "" { 1, 0 }
t "" 4 "" { 0, 3 }
"""
    sets = lcpcli.run(lcpcli.from_efg(game)).answer.information_sets
    assert [(each.label, each.probabilities, each.reached) for each in sets[:2]] == [
        ("1", [1.0, 0.0], 1.0),
        ("later", [0.5, 0.5], 0.0),
    ]
