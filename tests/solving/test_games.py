"""Games as people have them: payoffs of any size and with any digits, strategies that
are checked as such, and the ways to equilibria: pure ones by a look at the payoffs,
those of games of constant sum by a linear program, others by Lemke and Howson's paths.
"""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng

import lcpcli
from lcpcli.formulations.bimatrix_game import game as of_game
from lcpcli.formulations.bimatrix_game.game import Game
from lcpcli.linalg import programs
from lcpcli.methods.bimatrix import (
    LABELS,
    PIVOTS,
    costs,
    is_constant_sum,
    lemke_howson,
)
from lcpcli.methods.stages import Finished

from ..methods.stages import through


def test_payoff_that_is_not_met_hides_no_gain():
    """The costs of the column of 1 are rounded beside 1e16, so that the complementarity
    problem does not know of it."""
    A = [[5, 0, 0], [0, 1, 0], [0, 0, 1e16]]
    B = [[1, 0, 0], [0, 5, 0], [-1e16, -1e16, -1e16]]
    game = lcpcli.from_game(A, B)
    verification = lcpcli.check(game, [0, 0, 1, 0, 1, 0])
    assert not verification.accepted
    assert verification.strategies.gains == (1.0, 0.0)
    answer = lcpcli.run(game).answer
    gain = max(np.array(A) @ answer.column) - answer.row @ np.array(A) @ answer.column
    assert answer.statement.startswith(
        "not an equilibrium" if gain > 1e-6 else "an equilibrium"
    )


def assert_equilibrium(A, B, result):
    """No strategy gains more than rounding against the other player's, in fractions."""
    x, y = (
        [Fraction(value) for value in part]
        for part in (result.answer.row, result.answer.column)
    )
    rows = [
        sum(Fraction(a) * p for a, p in zip(row, y, strict=True)) for row in A.tolist()
    ]
    columns = [
        sum(Fraction(b) * p for b, p in zip(column, x, strict=True))
        for column in B.T.tolist()
    ]
    for payoffs, plan in ((rows, x), (columns, y)):
        reached = sum(p * value for p, value in zip(plan, payoffs, strict=True))
        assert max(payoffs) - reached <= 1e-9 * (1 + max(map(abs, payoffs)))


def pure_equilibria(A, B):
    m, k = A.shape
    places = ((i, j) for i in range(m) for j in range(k))
    return {
        (i, j) for i, j in places if A[i, j] == max(A[:, j]) and B[i, j] == max(B[i])
    }


@settings(max_examples=20)
@given(
    st.integers(0, 10**6),
    st.integers(1, 7),
    st.integers(1, 7),
    st.sampled_from([2, 50, 10**6]),
    st.sampled_from([(1, 0), (1e6, 3e6), (1e-3, 0.1), (0.1, -7)]),
)
def test_a_pure_equilibrium_is_found_where_there_is_one_and_else_a_mixed_one(
    seed, m, k, largest, units
):
    A, B = (
        units[0]
        * np.random.default_rng(seed).integers(-largest, largest + 1, (2, m, k))
        + units[1]
    )
    result = lcpcli.run(lcpcli.from_game(A, B))
    assert result.solved
    assert_equilibrium(A, B, result)
    x, y, size = result.answer.row, result.answer.column, units[0] * largest
    assert (x.sum(), y.sum(), *result.answer.payoffs) == pytest.approx(
        (1, 1, x @ A @ y, x @ B @ y)
    )
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
        supports = (
            np.flatnonzero(result.answer.row),
            np.flatnonzero(result.answer.column),
        )
        assert (
            tuple(int(support[0]) for support in supports if support.size == 1) in pure
        )
        assert result.route == ("pure",)
        assert lcpcli.plan(result.problem)[0].method == "pure"


def test_the_same_pure_equilibrium_is_found_with_and_without_kernels():
    pytest.importorskip("numba")
    rng = default_rng(3)
    for n in (4, 40, 160):
        A, B = rng.integers(-5, 6, (2, n, n)).astype(float)
        answers = [
            lcpcli.run(lcpcli.from_game(A, B), compiled=compiled).answer
            for compiled in (False, True)
        ]
        found = {
            (int(answer.row.argmax()), int(answer.column.argmax()))
            for answer in answers
        }
        assert found == {min(pure_equilibria(A, B))}


def test_paths_of_degenerate_games_without_pure_equilibria_end_at_an_equilibrium():
    """Payoffs of -1, 0 and 1 tie everywhere; a path that took ties by the first index
    would cycle."""
    rng, tried = default_rng(0), 0
    while tried < 6:
        A, B = rng.integers(-1, 2, (2, 6, 5)).astype(float)
        if pure_equilibria(A, B):
            continue
        tried += 1
        problem = lcpcli.from_game(A, B)
        iterates, ending = through(lemke_howson(problem, costs(problem)))
        assert isinstance(ending, Finished)
        assert_equilibrium(
            A, B, lcpcli.run(problem, z0=problem.box.z_of(iterates[-1].x))
        )


def test_each_pivot_counts_once():
    """Paths take turns, of PIVOTS at first, and then half of them of twice as many."""
    rng = default_rng(2)
    A, noise = rng.standard_normal((2, 100, 110))
    problem = lcpcli.from_game(A, 0.3 * noise - A)
    iterates, _ = through(lemke_howson(problem, costs(problem)))
    rises = np.diff([0, *(step.evaluations for step in iterates)])
    assert (rises[:LABELS] == PIVOTS).all()
    assert (rises[LABELS : LABELS + LABELS // 2] == 2 * PIVOTS).all()


def test_other_matrices_are_no_games():
    others = (
        ([[0, 1], [1, 1]], -1),
        ([[0, 1], [1, 0]], 1),
        ([[0, -1], [1, 0]], -1),
        ([[0, 0], [1, 0]], -1),
    )
    assert all(costs(lcpcli.Problem(M, [-1, q])) is None for M, q in others)


def test_a_game_of_nearly_zero_sum_is_solved_although_its_paths_are_long():
    rng = default_rng(2)
    A, noise = rng.standard_normal((2, 60, 66))
    B = 0.3 * noise - A
    assert not pure_equilibria(A, B)
    result = lcpcli.run(lcpcli.from_game(A, B))
    assert result.solved
    assert result.route == ("lemke-howson",)
    assert 600 < result.evaluations < 20_000
    assert_equilibrium(A, B, result)


@pytest.mark.parametrize(
    "payoffs",
    ["real", "whole", "degenerate", "in other units", "two rows", "two columns"],
)
@pytest.mark.parametrize("package", ["piqp", "none"])
def test_a_game_of_constant_sum_is_solved_as_a_linear_program(
    payoffs, package, monkeypatch
):
    if package == "none":
        monkeypatch.setattr(programs, "has_piqp", lambda: False)
    rng = default_rng(5)
    A = rng.standard_normal((30, 40))
    B = -A
    if payoffs == "whole":
        A = rng.integers(-5, 6, (30, 40)).astype(float)
        B = 7.0 - A
    if payoffs == "degenerate":
        A = np.kron(np.eye(3), np.ones((8, 9)))
        B = -A
    if payoffs == "in other units":
        B = 100.0 - 3.0 * A
    if payoffs.startswith("two"):
        A = rng.standard_normal((2, 40))
        A = A if payoffs == "two rows" else A.T
        B = -A
    assert not pure_equilibria(A, B)
    result = lcpcli.run(lcpcli.from_game(A, B))
    assert result.solved
    # One program, and no path.
    assert set(result.route) <= {"piqp", "linear"}
    assert package == "piqp" or result.route == ("linear",)
    assert result.evaluations <= 2
    assert_equilibrium(A, B, result)


def test_a_game_that_is_not_quite_of_constant_sum_is_no_program():
    rng = default_rng(5)
    A = rng.standard_normal((30, 40))
    B = -A
    B[3, 4] += 1e-6
    game = costs(lcpcli.from_game(A, -A)), costs(lcpcli.from_game(A, B))
    assert [each is not None and is_constant_sum(each) for each in game] == [
        True,
        False,
    ]


SHORT = st.builds(
    lambda number, digits: number / 10**digits,
    st.integers(-(10**15), 10**15),
    st.integers(0, 15),
)
# Whose costs do not overflow.
FINITE = st.floats(-(2.0**1013), 2.0**1013)


@settings(max_examples=40)
@given(
    st.lists(SHORT, min_size=2, max_size=6) | st.lists(FINITE, min_size=2, max_size=6)
)
def test_costs_of_doubles_are_those_of_their_shortest_decimals(payoffs):
    given_payoffs = np.array([payoffs])
    M, _ = Game.of(given_payoffs, given_payoffs, (), ()).conditions()
    exact = [Fraction(repr(each)) for each in given_payoffs[0].tolist()]
    constant = 2 * max(exact) - min(exact) if len(set(exact)) > 1 else exact[0] + 1
    assert M[0, 1:].tolist() == [float(constant - each) for each in exact]


def test_few_payoffs_are_written_as_decimals(monkeypatch):
    written, decimal = [], of_game.Decimal
    monkeypatch.setattr(
        of_game, "Decimal", lambda value: written.append(value) or decimal(value)
    )
    rng = default_rng(0)
    for A, most in (
        (rng.integers(-99, 100, (50, 60)) / 100, 0),
        (rng.standard_normal((50, 60)), 0.15 * 3000),
        (rng.random((50, 60)), 0.4 * 3000),
    ):
        written.clear()
        lcpcli.from_game(A, np.zeros(A.shape))
        assert len(written) <= most
