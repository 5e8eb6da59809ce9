"""All equilibria of games: pairs of best replies in fractions, known ones, and the solutions of the LCP."""

from __future__ import annotations

from fractions import Fraction
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem
from lcpcli.enumeration.equilibria import Equilibria
from lcpcli.files import contents
from lcpcli.rational.exact_problem import ExactProblem, decimal_parts_of

from . import solution_sets as oracle


def all_of(A: Any, B: Any) -> Equilibria:
    return checked(lcpcli.from_game(A, B))


def checked(problem: Problem) -> Equilibria:
    """The equilibria of a game, all of which are pairs of best replies."""
    found = lcpcli.solutions(problem)
    pieces = list(found)
    assert found.complete
    assert len(pieces) == len(found.equilibria.subsets)
    A, B = problem.origin.payoffs()
    for each in found.equilibria.extreme:
        x, y = each.row, each.column
        assert sum(x) == sum(y) == 1
        assert min(*x, *y) >= 0
        by_row = [oracle.dot(tuple(row), y) for row in A]
        by_column = [oracle.dot(column, x) for column in zip(*B, strict=True)]
        assert each.payoffs == (max(by_row), max(by_column))
        assert {value for value, p in zip(by_row, x, strict=True) if p} == {max(by_row)}
        assert {value for value, p in zip(by_column, y, strict=True) if p} == {max(by_column)}
    return found.equilibria


def texts(found: Equilibria) -> list[tuple[str, str]]:
    return [(" ".join(map(str, each.row)), " ".join(map(str, each.column))) for each in found.extreme]


@pytest.mark.parametrize("n", [2, 3, 6])
def test_coordination_games_have_one_equilibrium_for_each_set_of_strategies(n: int) -> None:
    found = all_of(np.eye(n), np.eye(n))
    assert len({each.row for each in found.extreme}) == len(found.extreme) == 2**n - 1
    assert sum(each.is_pure for each in found.extreme) == n
    assert all(each.index == (1 if np.count_nonzero(each.row) % 2 else -1) for each in found.extreme)


@pytest.mark.parametrize(
    ("name", "extreme", "components"), [("coordination-4", 15, 15), ("winkels", 12, 1), ("von-stengel-75", 75, 75)]
)
def test_shipped_games_have_the_known_number_of_equilibria(name: str, extreme: int, components: int) -> None:
    found = checked(lcpcli.read(contents.shipped_path(f"games/{name}.nfg")))
    assert (len(found.extreme), len(found.components)) == (extreme, components)


def test_indices_of_nondegenerate_games_sum_to_1() -> None:
    generator, counted = np.random.default_rng(6), 0
    for _ in range(24):
        shape = tuple(generator.integers(1, 7, 2))
        found = all_of(*generator.integers(-50, 50, (2, *shape)))
        if not found.is_degenerate:
            counted += 1
            assert sum(each.index or 0 for each in found.extreme) == 1
            assert len(found.subsets) == len(found.components) == len(found.extreme)
    assert counted > 15


def test_a_game_whose_payoffs_sum_to_a_constant_has_one_subset() -> None:
    """The one piece of its LCP, given without its origin."""
    generator, faces = np.random.default_rng(9), 0
    for _ in range(16):
        A = generator.integers(0, 3, tuple(generator.integers(2, 8, 2)))
        game = lcpcli.from_game(A, 5 - A)
        M, q, *_ = decimal_parts_of(game)
        alone = ExactProblem(Problem(game.M, game.q), M, q or [])
        (of_game,), (of_lcp,) = (list(lcpcli.solutions(given)) for given in (game, alone))
        assert set(of_game.vertices) == set(of_lcp.vertices)
        faces += len(of_game.vertices) > 1
    assert faces > 2


@pytest.mark.parametrize("sum_is_constant", [True, False])
def test_a_large_game_has_an_equilibrium_at_once(sum_is_constant: bool) -> None:
    A, B = np.random.default_rng(0).integers(-50, 50, (2, 18, 18))
    found = lcpcli.solutions(lcpcli.from_game(A, -A if sum_is_constant else B), max_solutions=1)
    assert (len(list(found)), found.complete) == (1, sum_is_constant)


def test_payoffs_are_exact_fractions_also_in_files(tmp_path: Path) -> None:
    found = all_of([["1/3", 0], [0, Fraction(2, 3)]], [[0.1, 0], [0, 0.3]])
    assert texts(found)[1] == ("3/4 1/4", "2/3 1/3")
    assert found.extreme[1].payoffs == (Fraction(2, 9), Fraction(3, 40))
    (tmp_path / "game.json").write_text('{"A": [["1/3", 0]], "B": [["2/7", 0.1]]}')
    lcpcli.write(lcpcli.read(tmp_path / "game.json"), tmp_path / "again.json")
    for name in ("game.json", "again.json"):
        assert checked(lcpcli.read(tmp_path / name)).extreme[0].payoffs == (Fraction(1, 3), Fraction(2, 7))


@pytest.mark.parametrize(
    "payoffs",
    [1 - np.eye(24), np.eye(24), np.random.default_rng(1).integers(0, 2, (24, 24)), np.zeros((12, 12))],
    ids=["crown", "identity", "zeros and ones", "zero"],
)
def test_some_equilibria_are_found_where_there_are_too_many_to_be_listed(payoffs: np.ndarray) -> None:
    """The first two have 2^24 - 1 maximal Nash subsets each; of the third some have more vertices than can be listed,
    and come last."""
    found = lcpcli.solutions(lcpcli.from_game(payoffs, payoffs), max_solutions=2)
    pieces = list(found)
    held = found.equilibria
    assert (len(pieces), found.complete, found.others) == ((2, False, True) if payoffs.any() else (1, True, False))
    assert {k for subset in held.subsets for k in subset.extreme} == set(range(len(held.extreme)))
    assert (held.components is None) == payoffs.any()


def test_a_limit_holds_where_there_are_more_subsets_than_can_be_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a clock that goes on by 0.1 ms each time it is read, which is before each step, on any machine."""
    seconds = count(0.0, 1e-4)
    monkeypatch.setattr("time.perf_counter", lambda: next(seconds))
    found = lcpcli.solutions(lcpcli.from_game(*2 * [1 - np.eye(20)]), time_limit=0.5)  # more than 2^20
    pieces = list(found)
    assert (len(pieces) > 1, found.complete) == (True, False)
    assert next(seconds) < 0.75
