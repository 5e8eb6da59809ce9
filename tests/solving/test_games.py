"""Games as people have them: payoffs of any size and with any digits, strategies that are checked as such, and the ways
to equilibria: pure ones by a look at the payoffs, others by Lemke and Howson's paths.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import lcpcli
from lcpcli.methods.bimatrix import LABELS, PIVOTS, costs, lemke_howson
from lcpcli.methods.stages import Finished
from lcpcli.model.origins import Game
from lcpcli.solving.result import Result
from lcpcli.typing import Vector

from ..methods.stages import through

Lcp, File = Callable[..., Any], Callable[..., str]

LONG = "0.1234567890123456789012345"
SEXES = {"A": [[3, 0], [0, 2]], "B": [[2, 0], [0, 3]], "rows": ["opera", "box"]}
OPTIONS = pytest.mark.parametrize("options", [(), ("--exact",)], ids=["doubles", "exact"])


@pytest.fixture
def file(tmp_path: Path) -> Callable[..., str]:
    """Write a file, an object as JSON, and return where it is."""

    def write(given: Any, name: str = "game.json") -> str:
        (tmp_path / name).write_text(given if isinstance(given, str) else json.dumps(given))
        return str(tmp_path / name)

    return write


@pytest.fixture
def sexes(file: File) -> str:
    """The battle of the sexes."""
    return file(SEXES, "sexes.json")


def test_payoffs_of_more_digits_than_decimals_have_by_default_give_an_equilibrium(file: File, lcp: Lcp) -> None:
    constant = file('{"A": [[1e28, 1e28], [1e28, 1e28]], "B": [[1e28, 0], [0, 1e28]]}')
    assert "an equilibrium: by a best response" in lcp("solve", constant).out
    found = json.loads(lcp("solve", constant, "--all", "--format", "json").out)
    assert (found["complete"], len(found["solutions"])) == (True, 4)
    assert lcp("solve", constant, "--exact", "--quiet").code == 0


@pytest.mark.parametrize("size", [1e28, 1e300, 1e-300])
def test_costs_of_equal_payoffs_are_one(size: float) -> None:
    game = Game.of([[size, size]], [[size, -size]], (), ())
    M, _ = game.conditions()
    assert M[0, 1:].tolist() == [1, 1]
    assert game.cost_constants()[0] == Fraction(repr(size)) + 1


def test_digits_beyond_doubles_in_json_decide(lcp: Lcp, file: File) -> None:
    game = file(f'{{"A": [[{LONG}6], [{LONG}7]], "B": [[1], [1]]}}')
    (only,) = json.loads(lcp("solve", game, "--all", "--exact", "--format", "json").out)["solutions"]
    assert only["equilibrium"]["row"] == ["0", "1"]
    assert Fraction(only["equilibrium"]["payoffs"][0]) == Fraction(f"{LONG}7")
    single = json.loads(lcp("solve", game, "--exact", "--format", "json").out)
    assert single["answer"]["exact"]["row"] == ["0", "1"]


@OPTIONS
def test_the_strategies_of_an_equilibrium_are_accepted_and_others_with_what_each_player_would_gain_refused(
    options: tuple[str, ...], sexes: str, lcp: Lcp
) -> None:
    for pair in ("0.6,0.4,0.4,0.6", "0 1 0 1", "3/5,2/5,2/5,3/5"):
        checked = lcp("check", sexes, pair, *options)
        assert checked.code == 0
        assert "the strategies are an equilibrium: by a best response the row player would gain 0" in checked.out
    refused = lcp("check", sexes, "0.5,0.5,0.4,0.6", "--format", "json", *options)
    record = json.loads(refused.out)
    assert refused.code == 1
    assert "are not an equilibrium" in record["message"]
    assert [float(Fraction(gain)) for gain in record["strategies"]["gains"]] == pytest.approx([0, 0.2])
    assert record["violated"] == 1  # the column that is played and no best response
    assert record["violations"][0]["index"] == 2


def test_printed_digits_are_divided_by_their_sum(lcp: Lcp, file: File) -> None:
    A = np.array([[0, -1, 1], [1, 0, -1], [-1, 1, 0]])
    checked = lcp("check", file({"A": A.tolist(), "B": (-A).tolist()}), ",".join(6 * ["0.3333333"]))
    assert checked.code == 0
    assert "the strategies, divided by their sums, are an equilibrium" in checked.out


@OPTIONS
def test_what_solve_has_written_of_a_game_is_checked(
    options: tuple[str, ...], sexes: str, lcp: Lcp, file: File
) -> None:
    one = lcp("check", sexes, file(lcp("solve", sexes, "--format", "json", *options).out, "one.json"), *options)
    assert one.code == 0
    assert "as strategies, an equilibrium" in one.out
    written = lcp("solve", sexes, "--all", "--format", "json", "--exact").out
    every = lcp("check", sexes, file(written, "all.json"), *options)
    assert every.code == 0
    assert all(f"solution {k} of 3: the strategies are" in every.out for k in (1, 2, 3))
    wrong = json.loads(written)
    wrong["solutions"][1]["equilibrium"]["row"] = ["1/2", "1/2"]
    refused = lcp("check", sexes, file(wrong, "wrong.json"), "--format", "json", *options)
    assert refused.code == 1
    assert [json.loads(line)["accepted"] for line in refused.out.splitlines()] == [True, False, True]


FAULTS: list[tuple[Any, Any, str]] = [
    (SEXES, {"row": [0.6, 0.5], "column": [0.4, 0.6]}, "s.json: row: has the sum 1.1"),
    (SEXES, {"row": [0.6, 0.4], "column": [1.4, -0.4]}, "s.json: column: has a negative entry"),
    (SEXES, {"row": [0.6], "column": [0.4, 0.4, 0.6]}, "s.json: row: has 1 entry for 2 strategies"),
    (SEXES, {"row": "0.6", "column": [0.4, 0.6]}, "s.json: row: is the text"),
    (SEXES, {"solutions": []}, "s.json: solutions: is empty"),
    (SEXES, {"solutions": [3]}, "s.json: solutions[0]: is a number"),
    ({"M": [[1]], "q": [-1]}, {"row": [1], "column": [1]}, "row: is a strategy, but the problem is not a game; give z"),
    ('{"A": [[1e-4000]], "B": [[1]]}', [1, 1], "has the payoff '1e-4000'; write it with at most 1000 digits"),
]


@pytest.mark.parametrize(("game", "given", "fault"), FAULTS, ids=[fault for *_, fault in FAULTS])
def test_what_are_no_strategies_gets_a_line(game: Any, given: Any, fault: str, lcp: Lcp, file: File) -> None:
    refused = lcp("check", file(game), file(given, "s.json"))
    assert refused.code == 2
    assert fault in refused.err


def test_strategies_whose_z_is_beyond_doubles_are_verified_in_exact_arithmetic(lcp: Lcp, file: File) -> None:
    tiny = file('{"A": [[1e-310, 0], [0, 2e-310]], "B": [[2e-310, 0], [0, 3e-310]]}')
    refused = lcp("check", tiny, "1,0,1,0")
    assert refused.code == 2
    assert "z: of these strategies exceeds the double-precision range; scale the payoffs" in refused.err
    assert lcp("check", tiny, "1,0,1,0", "--exact").code == 0


def test_payoff_that_is_not_met_hides_no_gain() -> None:
    """The costs of the column of 1 are rounded beside 1e16, so that the complementarity problem does not know of it."""
    A, B = [[5, 0, 0], [0, 1, 0], [0, 0, 1e16]], [[1, 0, 0], [0, 5, 0], [-1e16, -1e16, -1e16]]
    game = lcpcli.from_game(A, B)
    verification = lcpcli.check(game, [0, 0, 1, 0, 1, 0])
    assert not verification.accepted
    assert verification.strategies.gains == (1.0, 0.0)
    answer = lcpcli.run(game).answer
    gain = max(np.array(A) @ answer.column) - answer.row @ np.array(A) @ answer.column
    assert answer.statement.startswith("not an equilibrium" if gain > 1e-6 else "an equilibrium")


def assert_equilibrium(A: Vector, B: Vector, result: Result) -> None:
    """No strategy gains more than rounding against the other player's, in fractions."""
    x, y = ([Fraction(value) for value in part] for part in (result.answer.row, result.answer.column))
    rows = [sum(Fraction(a) * p for a, p in zip(row, y, strict=True)) for row in A.tolist()]
    columns = [sum(Fraction(b) * p for b, p in zip(column, x, strict=True)) for column in B.T.tolist()]
    for payoffs, plan in ((rows, x), (columns, y)):
        reached = sum(p * value for p, value in zip(plan, payoffs, strict=True))
        assert max(payoffs) - reached <= 1e-9 * (1 + max(map(abs, payoffs)))


def pure_equilibria(A: Vector, B: Vector) -> set[tuple[int, int]]:
    m, k = A.shape
    places = ((i, j) for i in range(m) for j in range(k))
    return {(i, j) for i, j in places if A[i, j] == max(A[:, j]) and B[i, j] == max(B[i])}


@settings(max_examples=60)
@given(
    st.integers(0, 10**6),
    st.integers(1, 7),
    st.integers(1, 7),
    st.sampled_from([2, 50, 10**6]),
    st.sampled_from([(1, 0), (1e6, 3e6), (1e-3, 0.1), (0.1, -7)]),
)
def test_a_pure_equilibrium_is_found_where_there_is_one_and_else_a_mixed_one(
    seed: int, m: int, k: int, largest: int, units: tuple[float, float]
) -> None:
    A, B = units[0] * np.random.default_rng(seed).integers(-largest, largest + 1, (2, m, k)) + units[1]
    result = lcpcli.run(lcpcli.from_game(A, B))
    assert result.solved
    assert_equilibrium(A, B, result)
    x, y, size = result.answer.row, result.answer.column, units[0] * largest
    assert (x.sum(), y.sum(), *result.answer.payoffs) == pytest.approx((1, 1, x @ A @ y, x @ B @ y))
    assert max(result.answer.gains) <= 1e-7 * size
    verification = lcpcli.check(result.problem, np.concatenate((x, y)))
    assert (verification.accepted, *verification.strategies.payoffs) == (
        True,
        *map(pytest.approx, result.answer.payoffs),
    )
    even = lcpcli.check(result.problem, np.repeat((1 / m, 1 / k), (m, k))).strategies
    regret = A.mean(axis=1).max() - A.mean(), B.mean(axis=0).max() - B.mean()
    assert even.gains == pytest.approx(regret, abs=1e-9 * size)
    pure = pure_equilibria(A, B)
    if pure:
        supports = (np.flatnonzero(result.answer.row), np.flatnonzero(result.answer.column))
        assert tuple(int(support[0]) for support in supports if support.size == 1) in pure
        assert result.route == ("pure",)


def test_the_same_pure_equilibrium_is_found_with_and_without_kernels() -> None:
    pytest.importorskip("numba")
    rng = np.random.default_rng(3)
    for n in (4, 40, 160):
        A, B = rng.integers(-5, 6, (2, n, n)).astype(float)
        answers = [lcpcli.run(lcpcli.from_game(A, B), compiled=compiled).answer for compiled in (False, True)]
        found = {(int(answer.row.argmax()), int(answer.column.argmax())) for answer in answers}
        assert found == {min(pure_equilibria(A, B))}


def test_paths_of_degenerate_games_without_pure_equilibria_end_at_an_equilibrium() -> None:
    """Payoffs of -1, 0 and 1 tie everywhere; a path that took ties by the first index would cycle."""
    rng, tried = np.random.default_rng(0), 0
    while tried < 20:
        A, B = rng.integers(-1, 2, (2, 6, 5)).astype(float)
        if pure_equilibria(A, B):
            continue
        tried += 1
        problem = lcpcli.from_game(A, B)
        iterates, ending = through(lemke_howson(problem, costs(problem)))
        assert isinstance(ending, Finished)
        assert_equilibrium(A, B, lcpcli.run(problem, z0=problem.box.z_of(iterates[-1].x)))


def test_each_pivot_counts_once() -> None:
    """Paths take turns, of PIVOTS at first, and then half of them of twice as many."""
    rng = np.random.default_rng(2)
    A, noise = rng.standard_normal((2, 100, 110))
    problem = lcpcli.from_game(A, 0.3 * noise - A)
    iterates, _ = through(lemke_howson(problem, costs(problem)))
    rises = np.diff([0, *(step.evaluations for step in iterates)])
    assert (rises[:LABELS] == PIVOTS).all()
    assert (rises[LABELS : LABELS + LABELS // 2] == 2 * PIVOTS).all()


def test_other_matrices_are_no_games() -> None:
    others = (([[0, 1], [1, 1]], -1), ([[0, 1], [1, 0]], 1), ([[0, -1], [1, 0]], -1), ([[0, 0], [1, 0]], -1))
    assert all(costs(lcpcli.Problem(M, [-1, q])) is None for M, q in others)


def test_a_game_that_is_nearly_one_of_zero_sum_is_solved_although_all_of_its_paths_are_long() -> None:
    rng = np.random.default_rng(2)
    A, noise = rng.standard_normal((2, 60, 66))
    B = 0.3 * noise - A
    assert not pure_equilibria(A, B)
    result = lcpcli.run(lcpcli.from_game(A, B))
    assert (result.solved, result.route) == (True, ("lemke-howson",))
    assert 600 < result.evaluations < 20_000
    assert_equilibrium(A, B, result)
