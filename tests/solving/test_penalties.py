"""Games with a payoff far larger than all that are reached, as for a forbidden move: best responses decide."""

from __future__ import annotations

import json
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli.options import Limits
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem, parts_of_game
from lcpcli.rational.pivoting import equilibrium
from lcpcli.solving import driver
from lcpcli.verify.strategies import point_of_game

from . import random_trees

Lcp = Callable[..., Any]
FORBIDDEN = """EFG 2 R "forbidden move" { "Ann" "Bob" }
p "" 1 1 "first" { "go" "forbidden" } 0
p "" 2 1 "second" { "x" "y" } 0
t "" 1 "" { 1 -3 }
t "" 2 "" { -3 -1 }
t "" 3 "" { -1e15 -1e15 }"""


class Penalties(random_trees.Maker):
    """A random tree whose payoffs are small integers but for penalties."""

    def outcome(self) -> str:
        self.outcomes += 1
        one, two = (
            f"-1e{self.random.randint(8, 17)}" if self.random.random() < 0.2 else str(self.random.randint(-3, 4))
            for _ in range(2)
        )
        return f'{self.outcomes} "" {{ {one}, {two} }}'


def penalized(random: Random, rows: int, columns: int) -> list[list[Fraction]]:
    """Payoffs of a player."""
    entries = range(rows * columns)
    values = [-(10 ** random.randint(8, 17)) if random.random() < 0.25 else random.randint(-3, 4) for _ in entries]
    return [list(map(Fraction, values[i * columns : (i + 1) * columns])) for i in range(rows)]


def shares(probabilities: Any) -> list[Fraction]:
    exact = list(map(Fraction, map(float, probabilities)))
    return [value / sum(exact) for value in exact]


def gains_little(gains: list[Fraction], reached: list[Fraction]) -> bool:
    return all(gain <= (1 + size) / 10**6 for gain, size in zip(gains, reached, strict=True))


def test_solved_trees_are_equilibria_by_fractions_and_check_agrees() -> None:
    for seed in range(30):
        problem = lcpcli.from_efg("\n".join(Penalties(seed, 3).lines))
        result = lcpcli.run(problem)
        assert result.solved == lcpcli.check(problem, result.z).accepted
        assert result.solved or problem.n > 20
        if result.solved:
            tree = problem.origin.tree
            own: list[list[list[Fraction]]] = [[], []]
            for each in result.answer.information_sets:
                own[tree.names().index(each.player)].append(shares(each.probabilities))
            assert gains_little(random_trees.gains(tree, own), list(map(abs, random_trees.payoffs(tree, own))))


def test_solved_bimatrix_games_are_equilibria_by_fractions_and_check_agrees() -> None:
    for seed in range(30):
        random = Random(seed)
        m, k = random.randint(2, 8), random.randint(2, 8)
        A, B = penalized(random, m, k), penalized(random, m, k)
        game = lcpcli.from_game([list(map(float, row)) for row in A], [list(map(float, row)) for row in B])
        result = lcpcli.run(game)
        assert result.solved
        assert lcpcli.check(game, result.z).accepted
        x, y = shares(result.answer.row), shares(result.answer.column)
        by_row = [sum(a * v for a, v in zip(row, y, strict=True)) for row in A]
        by_column = [sum(B[i][j] * x[i] for i in range(m)) for j in range(k)]
        now = [sum(map(Fraction.__mul__, x, by_row)), sum(map(Fraction.__mul__, y, by_column))]
        assert gains_little([max(by_row) - now[0], max(by_column) - now[1]], list(map(abs, now)))


@pytest.mark.parametrize("zero_sum", [False, True])
@pytest.mark.parametrize("size", [3, 9, 20])
def test_lemke_and_howson_in_integers_end_at_an_exact_equilibrium(size: int, zero_sum: bool) -> None:
    """In zero-sum games of these sizes, strategies are mixed."""
    mixed = 0
    for seed in range(5):
        random = Random(seed)
        A = penalized(random, size, size + 1)
        B = [[-value for value in row] for row in A] if zero_sum else penalized(random, size, size + 1)
        game = lcpcli.from_game([list(map(float, row)) for row in A], [list(map(float, row)) for row in B])
        data = ExactProblem(game, *parts_of_game(game.origin))
        found = equilibrium(data, size, Effort(60.0))
        assert found is not None
        assert data.is_solution(point_of_game(game, np.array(found), data).tolist())
        mixed += sum(value > 0 for value in found) > 2
    assert mixed or not zero_sum


def test_games_with_more_unknowns_are_decided_in_integers() -> None:
    random = Random(5)
    A, B = penalized(random, 40, 45), penalized(random, 40, 45)
    game = lcpcli.from_game([list(map(float, row)) for row in A], [list(map(float, row)) for row in B])
    result = lcpcli.run(game)
    assert (result.solved, result.route[-1]) == (True, "exact")
    assert lcpcli.check(game, result.z).accepted


@pytest.mark.parametrize("options", [(), ("--exact",)], ids=["doubles", "exact"])
def test_a_forbidden_move_is_solved_by_exact_arithmetic(options: tuple[str, ...], lcp: Lcp, tmp_path: Path) -> None:
    (tmp_path / "tree.efg").write_text(FORBIDDEN)
    solved = lcp("solve", str(tmp_path / "tree.efg"), *options, "--format", "json")
    record = json.loads(solved.out)
    assert (solved.code, record["route"], record["answer"]["payoffs"]) == (0, ["lemke", "exact"], [-3, -1])
    (tmp_path / "result.json").write_text(solved.out)
    assert lcp("check", str(tmp_path / "tree.efg"), str(tmp_path / "result.json")).code == 0


def test_a_method_by_name_is_stalled_there_and_check_refuses_its_z(lcp: Lcp, tmp_path: Path) -> None:
    (tmp_path / "tree.efg").write_text(FORBIDDEN)
    solved = lcp("solve", str(tmp_path / "tree.efg"), "--method", "lemke", "--format", "json")
    record = json.loads(solved.out)
    assert (solved.code, record["status"], record["solved"]) == (1, "stalled", False)
    assert record["message"].endswith("by a best response Ann would gain 0, Bob 2")
    z = ",".join(map(repr, record["z"]))
    checked = lcp("check", str(tmp_path / "tree.efg"), z)
    assert checked.code == 1
    assert "but as strategies, not an equilibrium" in checked.out


def test_without_time_for_exact_arithmetic_the_run_is_stalled() -> None:
    result = driver.run(lcpcli.from_efg(FORBIDDEN), "auto", limits=Limits(time_limit=1e-9))
    assert not result.solved
