"""The one exact solver: the same rational numbers by elimination in integers and by FLINT, of systems of any rank."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations, permutations
from math import prod

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lcpcli.interrupts import TimeIsUp, within
from lcpcli.rational import elimination
from lcpcli.rational.elimination import Rows, inverse, particular, solve

ONE, ZERO = Fraction(1), Fraction(0)


def systems(rows: int, columns: int) -> st.SearchStrategy[tuple[Rows, list[int]]]:
    """Small integers, of which many are 0, so that many systems are singular."""
    entry = st.integers(-2, 2)
    row = st.lists(entry, min_size=columns, max_size=columns)
    return st.tuples(st.lists(row, min_size=rows, max_size=rows), st.lists(entry, min_size=rows, max_size=rows))


def product(A: Rows, x: list[Fraction]) -> list[Fraction]:
    return [sum((a * value for a, value in zip(row, x, strict=True)), ZERO) for row in A]


def test_no_equations_have_the_empty_solution() -> None:
    assert solve([], []) == ([], [])


@pytest.mark.parametrize(("m", "n"), [(3, 3), (2, 4), (4, 2)])
@settings(max_examples=40)
@given(data=st.data())
def test_every_solution_is_found(m: int, n: int, data: st.DataObject) -> None:
    A, b = data.draw(systems(m, n))
    x, null_space = solve(A, b)
    rank = int(np.linalg.matrix_rank(np.array(A)))
    assert len(null_space) == n - rank
    assert all(not any(product(A, v)) for v in null_space)
    assert (x is None) == (int(np.linalg.matrix_rank(np.column_stack((A, b)))) > rank)
    assert x is None or product(A, x) == b


@settings(max_examples=60)
@given(systems(4, 4))
def test_flint_gives_the_same_numbers(system: tuple[Rows, list[int]]) -> None:
    pytest.importorskip("flint")
    own = solve(*system), inverse(system[0])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(elimination, "MOST_PLAIN_ROWS", 0)
        assert (solve(*system), inverse(system[0])) == own


@pytest.mark.parametrize(("m", "n"), [(20, 30), (30, 20), (24, 24)])
def test_large_systems_of_any_shape_and_rank_are_solved(m: int, n: int) -> None:
    generator = np.random.default_rng(m)
    A = generator.integers(-9, 10, (m, 18)) @ generator.integers(-9, 10, (18, n))
    b = A @ generator.integers(-9, 10, n)
    x = particular(A.tolist(), b.tolist())
    assert x == solve(A.tolist(), b.tolist()).x
    assert product(A.tolist(), x) == b.tolist()


def test_inverse_times_the_matrix_is_the_identity() -> None:
    A = np.random.default_rng(1).integers(-9, 10, (20, 20)).tolist()
    found = inverse(A)
    columns = [product(A, [row[j] for row in found]) for j in range(20)]
    assert columns == [[Fraction(int(i == j)) for i in range(20)] for j in range(20)]
    assert inverse([[1, 2], [2, 4]]) is None


def test_long_call_of_flint_in_another_process_gives_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("flint")
    A, b = [[int(i == j) * 7 + (i * j) % 5 for j in range(20)] for i in range(20)], list(range(20))
    here = elimination.solve(A, b), elimination.solve(A[:18], b[:18])
    monkeypatch.setattr(elimination, "LONG_CALL_SECONDS", -1.0)
    assert (elimination.solve(A, b), elimination.solve(A[:18], b[:18])) == here
    with pytest.raises(TimeIsUp), within(0.0):
        elimination.solve(A, b)
    monkeypatch.setattr("sys.executable", "/no/such/interpreter")
    assert elimination.solve(A, b) == here[0]


@pytest.mark.parametrize("seed", range(24))
def test_determinants_are_sums_over_all_permutations(seed: int) -> None:
    """Of matrices with many zeros, so that pivots come from any row."""
    generator = np.random.default_rng(seed)
    n = int(generator.integers(1, 6))
    A = generator.integers(-9, 10, (n, n)) * (generator.random((n, n)) < 0.5) + np.eye(n, dtype=int)[::-1]
    total = 0
    for order in permutations(range(n)):
        inversions = sum(i > j for i, j in combinations(order, 2))
        total += (-1) ** inversions * prod(A[range(n), order].tolist())
    assert elimination.determinant(A.tolist()) == total


@pytest.mark.parametrize("seed", range(24))
def test_minors_that_prove_a_symmetric_matrix_indefinite_are_negative_or_zero(seed: int) -> None:
    """Of matrices with many zeros on the diagonal, so that pairs of rows are pivots."""
    generator = np.random.default_rng(seed)
    n = int(generator.integers(1, 7))
    A = np.triu(generator.integers(-2, 3, (n, n)) * (generator.random((n, n)) < 0.4))
    A = A + A.T + np.diag(generator.integers(0, 3, n))
    if seed % 3 == 0:
        A = A @ A
    found = elimination.definiteness(A.tolist(), lambda: None)
    least = float(np.linalg.eigvalsh(A)[0])
    assert (found.negative is None) is (least > -1e-9)
    assert (found.zero is None and found.negative is None) is (least > 1e-9)
    minors = [None if P is None else elimination.determinant(A[np.ix_(P, P)].tolist()) for P in found]
    assert minors[0] in (None, 0)
    assert minors[1] is None or minors[1] < 0
