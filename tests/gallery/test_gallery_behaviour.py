"""What is remarkable about the gallery's families, seen: cycles, exponential pivoting, margins, free boundaries."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lcpcli import Problem, run
from lcpcli.gallery import families as gallery

from .matrix_classes import dense


def newton_without_safeguard(problem: Problem, steps: int) -> list[tuple[int, ...]]:
    """The active sets of steps z_P = -M_PP^-1 q_P, P = {z > w}, from the problem's x0."""
    P, sets = problem.x0 > 0, []
    for _ in range(steps + 1):
        sets.append(tuple(np.flatnonzero(P)))
        z = np.zeros(problem.n)
        z[P] = np.linalg.solve(dense(problem)[np.ix_(P, P)], -problem.q[P])
        P = z > np.where(P, 0, problem.w(z))
    return sets


def test_newton_cycles_from_the_starts_of_ben_gharbia_and_gilbert_and_curtis_han_and_robinson() -> None:
    for n in (3, 7, 11):
        sets = newton_without_safeguard(gallery.make("ben-gharbia-gilbert", n), n)
        assert sets[n] == sets[0]
        assert len(set(sets)) == n
    sets = newton_without_safeguard(gallery.make("curtis-han-robinson"), 20)
    assert sets[0] in sets[1:]
    assert (1, 2) not in sets


def test_murty_takes_exponentially_many_steps_of_least_index_pivoting() -> None:
    problem = gallery.make("murty", 6)
    P, steps = np.zeros(6, dtype=bool), 0
    while True:
        z = np.zeros(6)
        z[P] = np.linalg.solve(problem.M[np.ix_(P, P)], -problem.q[P])
        wrong = np.flatnonzero(np.where(P, z, problem.w(z)) < 0)
        if not wrong.size:
            break
        P[wrong[0]] ^= True
        steps += 1
    assert np.array_equal(z, problem.solutions[0])
    assert f"{steps + 1} - 1" in problem.note.replace("2^6", "64")


def test_half_of_the_places_are_degenerate_or_have_a_margin_of_epsilon_and_so_has_an_eigenvalue() -> None:
    problem = gallery.make("degenerate", 30)
    (z,) = problem.solutions
    assert np.count_nonzero((z == 0) & (problem.w(z) == 0)) == 15
    assert 0 < np.count_nonzero(z) < 15
    for epsilon in (0.1, 1e-8):
        problem = gallery.make("near-degenerate", 30, epsilon=epsilon)
        (z,) = problem.solutions
        margins = np.maximum(z, problem.w(z))
        assert 0.7 * epsilon <= margins.min() <= 1.5 * epsilon
        assert np.count_nonzero(margins == 1) == 15
    for epsilon in (1e-2, 1e-6, 1e-12):
        M = gallery.make("near-singular", 30, epsilon=epsilon).M
        assert np.linalg.eigvalsh(M)[0] == pytest.approx(epsilon, abs=1e-14)


@pytest.mark.parametrize("symmetric", [False, True])
def test_indefinite_problems_have_w_0_everywhere_unless_complementarity_is_to_be_strict(symmetric: bool) -> None:
    for strict in (False, True):
        problem = gallery.make("indefinite", 30, symmetric=symmetric, strict=strict)
        (z,) = problem.solutions
        assert np.count_nonzero(z) == 12
        assert np.array_equal(problem.w(z) > 0, (z == 0) & strict)
        assert np.array_equal(problem.M, problem.M.T) is symmetric
        least, *_, largest = np.linalg.eigvalsh(problem.M + problem.M.T)
        assert least < 0 < largest


@pytest.mark.parametrize("entries", [0, 10])
def test_planted_solutions_are_strictly_complementary(entries: int) -> None:
    problem = gallery.make("planted", 200, 1, entries=entries)
    (z,) = problem.solutions
    assert 70 < np.count_nonzero(z) < 130
    assert np.maximum(z, problem.w(z)).min() >= 0.1
    assert np.minimum(z, problem.w(z)).max() == 0
    assert np.count_nonzero(dense(problem)) <= 200 * (entries or 200)


def test_ill_scaled_is_harker_pang_in_other_units() -> None:
    plain, scaled = (run(gallery.make(name, 6, 5), "auto") for name in ("harker-pang", "ill-scaled"))
    assert np.array_equal(plain.z > 0, scaled.z > 0)
    entries = abs(gallery.make("ill-scaled", 20).M)
    assert entries.max() / entries.min() > 1e12


def test_pressure_of_the_infinite_bearing_vanishes_where_the_film_opens() -> None:
    """It rises while the film narrows, up to t = pi, and the film breaks at some t in (pi, 2 pi) (Cryer 1971)."""
    z = run(gallery.make("journal-bearing", 200), "auto").z
    wet = np.flatnonzero(z > 0)
    assert np.array_equal(wet, np.arange(wet.size))
    assert 100 < wet.size < 200
    assert 50 < np.argmax(z) < 100


def test_american_put_at_the_exercise_price_is_worth_what_the_formula_says_and_exercised_below_some_price() -> None:
    """The European put by Black and Scholes; one time step is eight per cent below it, the American put a bit above."""
    r, s, T = 0.1, 0.4, 0.5
    normal = [(1 + math.erf(-(r + sign * s * s / 2) * math.sqrt(T / 2) / s)) / 2 for sign in (1, -1)]
    european = math.exp(-r * T) * normal[1] - normal[0]
    z = run(gallery.make("american-put", 399, rate=r, volatility=s, years=T), "auto").z
    k, t = 2 * r / s**2, s * s * T / 2
    assert math.exp(-((k + 1) ** 2) * t / 4) * z[199] == pytest.approx(european, rel=0.1)
    held = np.flatnonzero(z > 0)
    assert np.array_equal(held, np.arange(held[0], 399))
    assert 0 < held[0] < 199
    assert 190 <= np.argmax(z) <= 210


def test_unknowns_of_spatial_prices_have_names_in_the_order_of_z() -> None:
    problem = gallery.make("spatial-prices", 8)
    assert list(problem.names[:5]) == ["supply1", "supply2", "demand1", "demand2", "flow1-1"]
    assert list(problem.names[5:]) == ["flow1-2", "flow2-1", "flow2-2"]
    flow = problem.names.index("flow1-2")
    column = problem.M.toarray()[:, flow]
    assert {problem.names[i]: column[i] for i in column.nonzero()[0]} == {"supply1": -1, "demand2": 1}
