"""Equilibria of bimatrix games by `auto`: pure ones by a look at the payoffs, others by Lemke and Howson's paths."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import lcpcli
from lcpcli.methods.bimatrix import LABELS, PIVOTS, costs, lemke_howson
from lcpcli.methods.stages import Finished, Iterate, advance
from lcpcli.solving.result import Result
from lcpcli.typing import Vector


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
@given(st.integers(0, 10**6), st.integers(1, 7), st.integers(1, 7), st.sampled_from([2, 50, 10**6]))
def test_a_pure_equilibrium_is_found_where_there_is_one_and_else_a_mixed_one(
    seed: int, m: int, k: int, largest: int
) -> None:
    A, B = np.random.default_rng(seed).integers(-largest, largest + 1, (2, m, k)).astype(float)
    result = lcpcli.run(lcpcli.from_game(A, B))
    assert result.solved
    assert_equilibrium(A, B, result)
    pure = pure_equilibria(A, B)
    if pure:
        supports = (np.flatnonzero(result.answer.row), np.flatnonzero(result.answer.column))
        assert tuple(int(support[0]) for support in supports if support.size == 1) in pure
        assert result.route == ("pure",)


@pytest.mark.parametrize("compiled", [False, True])
def test_the_same_pure_equilibrium_is_found_with_and_without_kernels(compiled: bool) -> None:
    if compiled:
        pytest.importorskip("numba")
    rng = np.random.default_rng(3)
    for n in (4, 40, 160):
        A, B = rng.integers(-5, 6, (2, n, n)).astype(float)
        first = min(pure_equilibria(A, B))
        answer = lcpcli.run(lcpcli.from_game(A, B), compiled=compiled).answer
        assert (int(answer.row.argmax()), int(answer.column.argmax())) == first


def test_paths_of_degenerate_games_without_pure_equilibria_end_at_an_equilibrium() -> None:
    """Payoffs of -1, 0 and 1 tie everywhere; a path that took ties by the first index would cycle."""
    rng, tried = np.random.default_rng(0), 0
    while tried < 20:
        A, B = rng.integers(-1, 2, (2, 6, 5)).astype(float)
        if pure_equilibria(A, B):
            continue
        tried += 1
        problem = lcpcli.from_game(A, B)
        game = costs(problem)
        assert game is not None
        stage, last = lemke_howson(problem, game), None
        while isinstance(step := advance(stage), Iterate):
            last = step
        assert isinstance(step, Finished)
        assert last is not None
        assert_equilibrium(A, B, lcpcli.run(problem, z0=problem.box.z_of(last.x)))


def test_a_large_game_is_solved_in_few_pivots() -> None:
    rng = np.random.default_rng(1)
    A, B = rng.standard_normal((2, 120, 120))
    while pure_equilibria(A, B):
        A, B = rng.standard_normal((2, 120, 120))
    result = lcpcli.run(lcpcli.from_game(A, B))
    assert result.route[-1] == "lemke-howson"
    assert result.evaluations < 10_000
    assert_equilibrium(A, B, result)


def test_each_pivot_counts_once() -> None:
    """Paths take turns, of PIVOTS at first, and then half of them of twice as many."""
    rng = np.random.default_rng(2)
    A, noise = rng.standard_normal((2, 100, 110))
    problem = lcpcli.from_game(A, 0.3 * noise - A)
    game = costs(problem)
    assert game is not None
    stage, evaluations = lemke_howson(problem, game), [0]
    while isinstance(step := advance(stage), Iterate):
        evaluations.append(step.evaluations)
    rises = np.diff(evaluations)
    assert (rises[:LABELS] == PIVOTS).all()
    assert (rises[LABELS : LABELS + LABELS // 2] == 2 * PIVOTS).all()


def test_other_matrices_are_no_games() -> None:
    for M, q in (
        ([[0, 1], [1, 1]], [-1, -1]),
        ([[0, 1], [1, 0]], [-1, 1]),
        ([[0, -1], [1, 0]], [-1, -1]),
        ([[0, 0], [1, 0]], [-1, -1]),
    ):
        assert costs(lcpcli.Problem(M, q)) is None


def test_a_game_that_is_nearly_one_of_zero_sum_is_solved_although_all_of_its_paths_are_long() -> None:
    rng = np.random.default_rng(2)
    A, noise = rng.standard_normal((2, 100, 110))
    B = 0.3 * noise - A
    assert not pure_equilibria(A, B)
    result = lcpcli.run(lcpcli.from_game(A, B))
    assert (result.solved, result.route) == (True, ("lemke-howson",))
    assert 600 < result.evaluations < 20_000
    assert_equilibrium(A, B, result)
