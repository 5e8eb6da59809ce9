"""The gallery's families are what they say: their numbers, the class of M, the known solutions and verdicts."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from fractions import Fraction
from importlib import import_module
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lcpcli import Problem, Status, gallery, run
from lcpcli.certificate import proves_infeasible
from lcpcli.errors import OptionError
from lcpcli.problem import is_sparse

from . import exact

SPARSE = ("tridiagonal", "dominant", "obstacle", "journal-bearing", "american-put", "diagonal")
FIXED = [name for name in gallery.FAMILIES if gallery.fixed_size(name)]
ANY_SIZE = [name for name in gallery.FAMILIES if name not in FIXED]
IN_FRACTIONS = {"curtis-han-robinson": 19, "kostreva": 3}  # denominators of solutions that are no floats


def dense(problem: Problem) -> np.ndarray:
    return problem.M.toarray() if is_sparse(problem.M) else problem.M


def of_size(name: str, n: int, seed: int = 0, **parameters: object) -> Problem:
    return gallery.make(name, None if name in FIXED else n, seed, **parameters)


def determinant(rows: list[list[Fraction]]) -> Fraction:
    if not rows:
        return Fraction(1)
    pivot = next((i for i, row in enumerate(rows) if row[0]), None)
    if pivot is None:
        return Fraction(0)
    first, rest = rows[pivot], rows[:pivot] + rows[pivot + 1 :]
    below = [[v - row[0] / first[0] * p for v, p in zip(row, first, strict=True)][1:] for row in rest]
    return (-1) ** pivot * first[0] * determinant(below)


def subsets(n: int) -> list[list[int]]:
    return [list(chosen) for size in range(1, n + 1) for chosen in combinations(range(n), size)]


def has_positive_minors(M: np.ndarray) -> bool:
    return all(
        determinant([[Fraction(v) for v in row] for row in M[np.ix_(P, P)].tolist()]) > 0 for P in subsets(len(M))
    )


def is_positive_definite(M: np.ndarray) -> bool:
    """By Sylvester's criterion on M + M', in fractions."""
    S = [
        [Fraction(a) + Fraction(b) for a, b in zip(row, column, strict=True)]
        for row, column in zip(M.tolist(), M.T.tolist(), strict=True)
    ]
    return all(determinant([row[:k] for row in S[:k]]) > 0 for k in range(1, len(M) + 1))


def is_positive_semidefinite(M: np.ndarray) -> bool:
    return bool(np.linalg.eigvalsh(M + M.T)[0] >= -1e-13 * abs(M).max())


def is_symmetric(M: np.ndarray) -> bool:
    return np.array_equal(M, M.T)


def is_copositive(M: np.ndarray) -> bool:
    """No principal submatrix of M + M' has a positive eigenvector to a negative eigenvalue (Kaplan 2000)."""
    for P in subsets(len(M)):
        values, vectors = np.linalg.eigh((M + M.T)[np.ix_(P, P)])
        for value, v in zip(values, vectors.T, strict=True):
            if value < -1e-12 and ((v > 1e-12).all() or (v < -1e-12).all()):
                return False
    return True


def is_m_matrix(M: np.ndarray) -> bool:
    return bool((M - np.diag(np.diag(M)) <= 0).all()) and has_positive_minors(M)


def is_h_plus(M: np.ndarray) -> bool:
    D = np.diag(np.diag(M))
    return bool((np.diag(M) > 0).all()) and is_m_matrix(D - abs(M - D))


HOLDS: dict[str, Callable[[np.ndarray], bool]] = {
    "P": has_positive_minors,
    "M": is_m_matrix,
    "H+": is_h_plus,
    "positive definite": is_positive_definite,
    "not positive definite": lambda M: not is_positive_definite(M),
    "positive semidefinite": is_positive_semidefinite,
    "symmetric positive definite": lambda M: is_symmetric(M) and is_positive_definite(M),
    "skew-symmetric": lambda M: np.array_equal(M, -M.T),
    "copositive": is_copositive,
    "none": lambda M: not has_positive_minors(M),
}


@pytest.mark.parametrize("name", gallery.FAMILIES)
@pytest.mark.parametrize("n", [1, 2, 5, 6])
def test_matrices_are_of_the_class_that_is_told(name: str, n: int) -> None:
    M = dense(of_size(name, n, seed=n))
    for words in gallery.class_of(name).split(", "):
        assert HOLDS[words](M), words


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("ben-gharbia-gilbert", {"alpha": 1.5}),
        ("journal-bearing", {"eccentricity": 0.99}),
        ("contact", {"friction": 0.0, "compliance": 0.5}),
        ("contact", {"friction": 3.0}),
        ("near-singular", {"epsilon": 1e-12}),
        ("near-degenerate", {"epsilon": 1e-12}),
        ("ill-scaled", {"decades": 50}),
        ("diagonal", {"decades": 0}),
        ("hilbert", {"degenerate": True}),
        ("harker-pang", {"symmetric": True}),
    ],
)
def test_class_and_known_solution_hold_for_other_parameters(name: str, parameters: dict[str, object]) -> None:
    problem = gallery.make(name, 8, 1, **parameters)
    for words in gallery.class_of(name).split(", "):
        assert HOLDS[words](dense(problem)), words
    for z in problem.solutions:
        assert exact.solves(problem, [Fraction(v) for v in z.tolist()])


def test_known_counterexamples_fail_the_tests_of_classes() -> None:
    assert not has_positive_minors(np.array([[1.0, 2], [2, 1]]))
    assert not is_positive_definite(np.array([[1.0, 2], [0, 1]]))
    assert not is_positive_semidefinite(np.array([[1.0, 3], [0, 1]]))
    assert not is_copositive(np.array([[1.0, -2], [-2, 1]]))
    assert not is_m_matrix(np.array([[1.0, 0.5], [0, 1]]))
    assert not is_h_plus(np.array([[1.0, 2], [2, 1]]))


@pytest.mark.parametrize("name", gallery.FAMILIES)
@pytest.mark.parametrize("n", [1, 2, 3, 7, 10, 18, 60])
def test_known_solutions_are_exact(name: str, n: int) -> None:
    problem = of_size(name, n, seed=n)
    for z in problem.solutions:
        denominator = IN_FRACTIONS.get(name)
        rational = [Fraction(v).limit_denominator(denominator) if denominator else Fraction(v) for v in z.tolist()]
        assert [float(v) for v in rational] == z.tolist()
        assert exact.solves(problem, rational)


WITH_SOLUTION = (
    *("lp", "qp", "murty", "fathi", "ben-gharbia-gilbert", "curtis-han-robinson", "kostreva", "growth", "hilbert"),
    *("diagonal", "degenerate", "near-degenerate", "ray"),
)


@pytest.mark.parametrize("name", gallery.FAMILIES)
def test_which_families_have_a_known_solution_or_verdict(name: str) -> None:
    problem = gallery.make(name)
    assert len(problem.solutions) == (name in WITH_SOLUTION)
    assert problem.verdict == (name if name in ("infeasible", "unsolvable") else "")


@settings(deadline=None)
@given(n=st.integers(1, 7), seed=st.integers(0, 10**6))
def test_infeasible_problems_are_infeasible_by_the_vector_in_the_note(n: int, seed: int) -> None:
    problem = gallery.make("infeasible", n, seed)
    k = int(problem.note.split("first ")[1].split(" ")[0])
    assert proves_infeasible(problem, (np.arange(n) < k).astype(float))
    assert not exact.feasible(problem)


@settings(deadline=None)
@given(n=st.integers(1, 5), seed=st.integers(0, 10**6))
def test_unsolvable_problems_are_feasible_without_solution(n: int, seed: int) -> None:
    problem = gallery.make("unsolvable", n, seed)
    assert exact.feasible(problem)
    assert exact.solution(problem) is None


@settings(deadline=None)
@given(n=st.integers(1, 12), seed=st.integers(0, 10**6))
def test_lemke_ends_on_a_ray_though_there_is_a_solution(n: int, seed: int) -> None:
    problem = gallery.make("ray", n, seed)
    assert exact.solves(problem, [Fraction(v) for v in problem.solutions[0].tolist()])
    assert run(problem, "lemke").status is Status.RAY


@settings(deadline=None)
@given(n=st.integers(1, 40), seed=st.integers(0, 10**6))
def test_lemke_ends_on_a_ray_at_once_on_games(n: int, seed: int) -> None:
    result = run(gallery.make("bimatrix", n, seed), "lemke")
    assert (result.status, result.iterations) == (Status.RAY, 1)


@pytest.mark.parametrize("n", [4, 8])
def test_lemke_needs_two_to_the_n_pivots_on_fathi(n: int) -> None:
    assert run(gallery.make("fathi", n), "lemke").iterations == 2**n


@settings(deadline=None)
@given(n=st.integers(1, 40), seed=st.integers(0, 10**6), friction=st.floats(0, 10), compliance=st.floats(0, 10))
def test_lemke_solves_contact_problems(n: int, seed: int, friction: float, compliance: float) -> None:
    assert run(gallery.make("contact", n, seed, friction=friction, compliance=compliance), "lemke").solved


@settings(deadline=None)
@given(n=st.integers(1, 40), seed=st.integers(0, 10**6))
def test_programs_have_the_one_solution_that_is_known(n: int, seed: int) -> None:
    """Strictly complementary, with a regular basis: as M is positive semidefinite, there is no other."""
    for name in ("lp", "qp"):
        problem = gallery.make(name, n, seed)
        (z,) = problem.solutions
        w = problem.w(z)
        assert (np.minimum(z, w) == 0).all()
        assert (np.maximum(z, w) > 0).all()
        P = z > 0
        assert np.linalg.matrix_rank(dense(problem)[np.ix_(P, P)]) == P.sum()


def test_linear_programs_are_sparse_when_large_and_keep_their_solution() -> None:
    problem = gallery.make("lp", 2000)
    (z,) = problem.solutions
    assert is_sparse(problem.M)
    assert (np.minimum(z, problem.w(z)) == 0).all()
    assert not is_sparse(gallery.make("lp", 200).M)


@pytest.mark.parametrize("name", gallery.FAMILIES)
def test_same_arguments_give_the_same_numbers_and_other_seeds_others(name: str) -> None:
    one, same, other = (of_size(name, 10, seed) for seed in (3, 3, 4))
    assert np.array_equal(dense(one), dense(same))
    assert np.array_equal(one.q, same.q)
    equal = np.array_equal(dense(one), dense(other)) and np.array_equal(one.q, other.q)
    assert equal is not gallery.is_random(name)


@pytest.mark.parametrize("name", gallery.FAMILIES)
def test_families_say_what_they_are(name: str) -> None:
    family = gallery.load(name)
    module = import_module(family.__module__)
    problem = gallery.make(name)
    assert gallery.FAMILIES[name]
    assert "\n" not in gallery.FAMILIES[name]
    assert module.__doc__
    assert family.__doc__
    assert problem.note or name == "harker-pang"
    assert problem.source == module.SOURCE != ""
    assert problem.name in (name, f"{name}-{problem.n}")
    assert is_sparse(problem.M) is (name in SPARSE)
    for parameter in gallery.parameters_of(name):
        assert parameter in str(inspect.getdoc(family))


@pytest.mark.parametrize("name", ANY_SIZE)
def test_the_size_is_about_the_one_that_is_asked_for(name: str) -> None:
    assert abs(gallery.make(name, 100).n - 100) <= 1
    assert gallery.make(name, 1).n <= 4


@pytest.mark.parametrize("name", gallery.FAMILIES)
def test_auto_comes_to_what_is_known(name: str) -> None:
    problem = gallery.make(name)
    result = run(problem, "auto")
    assert result.status.word == (problem.verdict or "solved")


def newton_without_safeguard(problem: Problem, steps: int) -> list[tuple[int, ...]]:
    """The active sets of steps z_P = -M_PP^-1 q_P, P = {z > w}, from the problem's x0."""
    assert problem.x0 is not None
    P, sets = problem.x0 > 0, []
    for _ in range(steps + 1):
        sets.append(tuple(np.flatnonzero(P)))
        z = np.zeros(problem.n)
        z[P] = np.linalg.solve(dense(problem)[np.ix_(P, P)], -problem.q[P])
        P = z > np.where(P, 0, problem.w(z))
    return sets


@pytest.mark.parametrize("n", [3, 7, 11])
def test_newton_cycles_through_n_sets_from_the_start_of_ben_gharbia_and_gilbert(n: int) -> None:
    sets = newton_without_safeguard(gallery.make("ben-gharbia-gilbert", n), n)
    assert sets[n] == sets[0]
    assert len(set(sets)) == n


def test_newton_cycles_from_the_start_of_curtis_han_and_robinson() -> None:
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


@pytest.mark.parametrize("epsilon", [1e-2, 1e-6, 1e-12])
def test_smallest_eigenvalue_is_epsilon(epsilon: float) -> None:
    M = gallery.make("near-singular", 30, epsilon=epsilon).M
    assert np.linalg.eigvalsh(M)[0] == pytest.approx(epsilon, abs=1e-14)


@pytest.mark.parametrize("epsilon", [0.1, 1e-8])
def test_margin_of_strict_complementarity_is_epsilon(epsilon: float) -> None:
    problem = gallery.make("near-degenerate", 30, epsilon=epsilon)
    (z,) = problem.solutions
    margins = np.maximum(z, problem.w(z))
    assert 0.7 * epsilon <= margins.min() <= 1.5 * epsilon
    assert np.count_nonzero(margins == 1) == 15


def test_half_of_the_places_are_degenerate() -> None:
    problem = gallery.make("degenerate", 30)
    (z,) = problem.solutions
    assert np.count_nonzero((z == 0) & (problem.w(z) == 0)) == 15
    assert 0 < np.count_nonzero(z) < 15


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


def test_american_put_is_exercised_below_some_price_and_worth_more_above() -> None:
    problem = gallery.make("american-put", 199)
    z = run(problem, "auto").z
    held = np.flatnonzero(z > 0)
    assert np.array_equal(held, np.arange(held[0], 199))
    assert 0 < held[0] < 99
    assert 95 <= np.argmax(z) <= 105


def test_american_put_at_the_exercise_price_is_worth_what_the_formula_says() -> None:
    """The European put by Black and Scholes is a little less; one time step, a few per cent off, may hide that."""
    r, s, T = 0.1, 0.4, 0.5
    d = [(r + sign * s * s / 2) * math.sqrt(T) / s for sign in (1, -1)]
    european = math.exp(-r * T) * normal(-d[1]) - normal(-d[0])
    z = run(gallery.make("american-put", 399, rate=r, volatility=s, years=T), "auto").z
    k, t = 2 * r / s**2, s * s * T / 2
    assert math.exp(-((k + 1) ** 2) * t / 4) * z[199] == pytest.approx(european, rel=0.1)


def normal(x: float) -> float:
    """The distribution function of the standard normal distribution."""
    return (1 + math.erf(x / math.sqrt(2))) / 2


@pytest.mark.parametrize(
    ("name", "arguments", "words"),
    [
        ("harker_pang", {}, "did you mean harker-pang"),
        ("nothing", {}, "choose one of harker-pang"),
        ("murty", {"n": 0}, "whole number from 1"),
        ("murty", {"n": 10**30}, "whole number from 1"),
        ("murty", {"seed": -1}, "is negative"),
        ("murty", {"decades": 3}, "murty has no 'decades'; leave it out"),
        ("curtis-han-robinson", {"n": 4}, "has 3 unknowns"),
        ("diagonal", {"decade": 3}, "diagonal has no 'decade'; choose one of decades"),
        ("diagonal", {"decades": 151}, "decades: 151 is out of range"),
        ("diagonal", {"decades": -1}, "0 <= decades <= 150"),
        ("ill-scaled", {"decades": 51}, "0 <= decades <= 50"),
        ("journal-bearing", {"eccentricity": 1.0}, "0 < eccentricity < 1"),
        ("american-put", {"rate": float("nan")}, "rate: nan is out of range"),
        ("american-put", {"volatility": 0.001}, "small beside the square of the volatility"),
        ("ben-gharbia-gilbert", {"alpha": 1.0}, "1 < alpha"),
        ("near-singular", {"epsilon": 0.0}, "1e-12 <= epsilon"),
        ("near-degenerate", {"epsilon": 2.0}, "epsilon <= 1"),
        ("contact", {"friction": -1.0}, "0 <= friction"),
        ("contact", {"compliance": float("inf")}, "0 <= compliance"),
    ],
)
def test_what_cannot_be_made_is_refused(name: str, arguments: dict[str, object], words: str) -> None:
    with pytest.raises(OptionError, match=r".") as refusal:
        gallery.make(name, **arguments)
    assert words in str(refusal.value)
