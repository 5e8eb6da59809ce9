"""Proofs of infeasibility, with bounds too: never believed about a feasible problem, found for infeasible ones in any
units, also where rounding, or one wrong sign, would turn them into false ones.
"""

from __future__ import annotations

from fractions import Fraction
from functools import partial

import numpy as np
import pytest
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem, from_qp
from lcpcli.model.problem import conditions_of
from lcpcli.rational import elimination, numbers
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.solving.no_minimum import Constraints
from lcpcli.verify.alternative import FarkasSystem
from lcpcli.verify.certificate import farkas_certificate, is_clear, proves_infeasible
from lcpcli.verify.enclosure import enclosure
from lcpcli.verify.farkas import exact_proof, refutes

from .. import exact
from ..methods.programs import random_program

INF = np.inf
farkas = partial(farkas_certificate, exactly=True)
INFEASIBLE = Problem([[0, -1], [1, 0]], [-1, -1])
ULP = 2.0**-52


def nearly_infeasible(seed: int) -> tuple[Problem, np.ndarray]:
    """A problem with y for which M'y = 0 and q'y = -1 but for a few units in the last place, and this y."""
    random = np.random.default_rng(seed)
    n = int(random.integers(2, 6))
    y = random.integers(0, 4, size=n).astype(float)
    i = int(random.integers(n))
    y[i] = 1.0
    M, q = random.integers(-3, 4, size=(n, n)).astype(float), random.integers(-2, 3, size=n).astype(float)
    M[i], q[i] = 0.0, 0.0
    M[i], q[i] = -(y @ M), -1 - y @ q
    return Problem(M * (1 + ULP * random.integers(-2, 3, size=(n, n))), q), y


def test_length_of_a_proof_does_not_matter_nor_whether_rounding_leaves_it_much_room() -> None:
    assert all(proves_infeasible(INFEASIBLE, np.array([size, 0.0])) for size in (1.0, 1e-300, 1e300, 5e-324))
    assert proves_infeasible(Problem([[1, -1], [-1, 1]], [-1, 0]), np.ones(2))
    assert proves_infeasible(Problem([[1, -1], [-1, 1 - ULP]], [-1, 0]), np.ones(2))


NEARLY = 2.0**-29  # both free columns vanish for y = (1, 1.9, -1) alone, and nearly for (1, 1.9, 1)
PAIR = np.array([[1, -1 / 1.9 + NEARLY], [1, -1 / 1.9 - NEARLY]])
FAR = np.zeros((4, 4))  # (M'y)_1 is 2^-60 for y = (0, 1, 1, 1), 0 in doubles, and z1 goes up to 2^66
FAR[1:, 0], FAR[1:, 1], FAR[1:, 2] = (1, 2.0**-60, -1), (1, -1, 0), (-1, 0, 1)
FEASIBLE = {
    "solutions as large as 1 / eps": (Problem([[1, -1], [-1, 1 + ULP]], [-1, 0]), [1, 1]),
    "M'y of 1e-400": (Problem([[0, -1], [1e-200, 0]], [0, -1]), [1, 1e-200]),
    "M'y of 1e-400 of one unknown": (Problem([[1e-200]], [-1]), [1e-200]),
    "columns of free variables that nearly vanish": (
        Problem(
            np.column_stack((np.vstack((PAIR.T, PAIR.T[0] + 1.9 * PAIR.T[1])), [-1, -1, 0])),
            [-1, -1, 0],
            lower=[-INF, -INF, 0],
        ),
        [1, 1.9, 1],
    ),
    "the least deviation of the column of a free variable": (
        Problem([[1, 1], [-1 - ULP, -1]], [-1, 0], lower=[-INF, 0]),
        [1, 1],
    ),
    "a far bound beside what doubles lose": (Problem(FAR, [0, -1, 0, 0], upper=[2.0**66, INF, INF, INF]), [0, 1, 1, 1]),
}


@pytest.mark.parametrize("name", FEASIBLE)
def test_what_rounding_hides_of_a_feasible_problem_makes_no_proof(name: str) -> None:
    problem, y = FEASIBLE[name]
    assert not exact.refutes(problem, list(map(Fraction, y)))
    assert not proves_infeasible(problem, np.array(y, dtype=float))
    assert not refutes(problem.M, problem.q, np.array(y, dtype=float), problem.box)


def test_proof_whose_products_underflow_or_overflow_is_checked_all_the_same() -> None:
    tiny = Problem([[1e-200, 0], [0, 1]], [-1e-200, 0])
    assert not proves_infeasible(tiny, np.array([1e-200, 0.0]))
    assert proves_infeasible(Problem([[-1e-200, 0], [0, 1]], [-1e-200, 0]), np.array([1e-200, 0.0]))
    assert proves_infeasible(Problem([[-1e300, 0], [0, 1]], [-1e300, 0]), np.array([1e300, 0.0]))


def test_nearly_infeasible_problems_are_distinguished_from_infeasible_ones() -> None:
    for seed in range(120):
        problem, y = nearly_infeasible(seed)
        if exact.feasible(problem):
            assert not proves_infeasible(problem, y), seed
            assert farkas(problem) is None, seed
        elif not (problem.M.T @ y).any():
            assert proves_infeasible(problem, y), seed


def chain(excess: float, largest: float) -> Problem:
    """x_0 = 1, x_i = r_i x_{i-1} and x_59 <= (1 - excess) r_1 ... r_59, with |x_i| <= largest."""
    ratios = np.random.default_rng(0).integers(5, 12, 59) / 8
    rows = csr_array(np.vstack((np.eye(60) - np.diag(ratios, -1), np.eye(60)[-1])))
    values, end = np.eye(60)[0], (1 - excess) * float(np.prod(ratios))
    low, high = np.append(values, -np.inf), np.append(values, end)
    return from_qp(None, np.zeros(60), rows, row_lower=low, row_upper=high, lower=-largest, upper=largest)


@pytest.mark.parametrize("largest", [np.inf, 100.0])
def test_program_infeasible_by_a_millionth_is_proved_so(largest: float) -> None:
    """Without bounds, y has to vanish exactly in 60 columns, where it is corrected by FLINT."""
    if largest == np.inf:
        pytest.importorskip("flint")
    assert farkas(chain(1e-6, largest)) is not None
    assert farkas(chain(-1e-6, largest)) is None


def test_proofs_are_found_where_the_first_linear_program_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FarkasSystem, "least_total", lambda _: None)
    found = (farkas(problem) is not None for problem in (INFEASIBLE, chain(1e-6, 100.0), chain(-1e-6, 100.0)))
    assert list(found) == [True, True, False]


def test_every_infeasible_random_problem_is_proved_so_and_no_feasible_one() -> None:
    """In any units, dense and sparse."""
    for seed in range(160):
        problem = exact.random_problem(seed)
        given = Problem(csr_array(problem.M), problem.q) if seed % 3 == 0 else problem
        assert (farkas(given) is None) == exact.feasible(problem), problem.name


def test_contradictions_among_many_rows_are_found() -> None:
    """Row 0 is minus a positive combination of the others with a margin; and sparse rows without positive entries."""
    random, n = np.random.default_rng(2), 100
    M, weights = random.normal(size=(n, n)), random.random(n) + 0.1
    q = random.normal(size=n)
    M[0] = -(weights[1:] @ M[1:]) - 1e-3
    q[0] = -(weights[1:] @ q[1:]) - 1.0
    assert farkas(Problem(M, q)) is not None
    negative = -np.abs(random.normal(size=(300, 300))) * (random.random((300, 300)) < 0.02)
    assert farkas(Problem(csr_array(negative), -np.ones(300))) is not None


def test_problem_beyond_the_range_of_floats_when_equilibrated_has_no_proof() -> None:
    assert farkas(Problem([[0, 1e-308], [1e308, 0]], [-1e308, 1e-308])) is None


def test_a_contradiction_by_less_than_rounding_is_not_clear() -> None:
    problem = Problem([[0, 0], [1, 0]], [0, -2 - 1e-12], lower=[0, 0], upper=[2, INF])  # z1 >= 2 + 1e-12
    assert not is_clear(problem, np.array([0.0, 1.0]))


@pytest.mark.parametrize("seed", range(8))
def test_enclosure_holds_an_exact_solution(seed: int) -> None:
    random = np.random.default_rng(seed)
    k, n = int(random.integers(1, 6)), int(random.integers(6, 12))
    G = random.integers(-9, 10, (k, n)) * np.exp2(random.integers(-30, 30, n))
    y = np.linalg.svd(G)[2][-1]
    d = enclosure(G, y)
    changed = np.flatnonzero(d)
    exact = [[Fraction(value) for value in row] for row in G.tolist()]
    residual = [sum(value * Fraction(other) for value, other in zip(row, y.tolist(), strict=True)) for row in exact]
    rows = [[*(row[j] for j in changed), -r] for row, r in zip(exact, residual, strict=True)]
    whole = [numbers.over_one_denominator(row)[0] for row in rows]
    found = elimination.solve([row[:-1] for row in whole], [row[-1] for row in whole]).x
    assert all(abs(change) <= Fraction(d[j]) for change, j in zip(found, changed.tolist(), strict=True))


def test_dependent_equations_and_too_many_have_no_enclosure() -> None:
    assert enclosure(np.array([[1.0, -1.0, 0.0], [2.0, -2.0, 0.0]]), np.array([1.0, 1.0, 1.0])) is None
    assert enclosure(np.ones((3, 2)), np.ones(2)) is None


@pytest.mark.parametrize("seed", range(6))
def test_no_infeasible_program_is_said_to_have_a_point(seed: int) -> None:
    """Not even near points that violate one constraint by little."""
    problem = random_program(2 * seed, 30, "infeasible").problem()
    sides = Constraints.of(problem.origin.program(conditions_of(problem)))
    low = np.nan_to_num(sides.low, neginf=0.0)
    x = np.linalg.lstsq(np.asarray(sides.A @ np.eye(sides.A.shape[1])), low, rcond=None)[0]
    assert sides.central_point() is None
    assert not sides.hold_near(x)


def test_farkas_vector_is_corrected_where_no_double_fits() -> None:
    """3 y1 = y2 is asked for with a y1 that is no multiple: only the corrected vector has M'y = 0."""
    y = np.array([np.pi, 3 * np.pi * (1 + 1e-12)])
    assert exact_proof(ExactProblem.of_floats(Problem([[3, -3], [-1, 1]], [-1, 1])), y) is None  # q'y = 2 y1 > 0
    data = ExactProblem.of_floats(Problem([[3, -3], [-1, 1]], [-1, 0.25]))
    found = exact_proof(data, y)
    assert data.refuted_by(found)
    assert found[1] == 3 * found[0]


def test_farkas_vector_is_found_where_rounding_has_made_columns_independent() -> None:
    """10 y1 = y2 in decimals, but as doubles 0.1 and 0.3 make M nonsingular: M'y = 0 has no solution, M'y < 0 has."""
    problem, y = Problem([[1, 3], [-0.1, -0.3]], [-1, 0]), np.array([0.1, 1.0])
    assert exact_proof(ExactProblem.of_decimals(problem), y) == [1, 10]
    data = ExactProblem.of_floats(problem)
    found = exact_proof(data, y)
    assert data.refuted_by(found)


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_an_enclosure_is_as_wide_as_the_solution_is_far_in_the_units_of_y(size: float) -> None:
    """y1 = y2 takes a change of at least |y1 - y2|."""
    y = size * np.array([1.0, 1.25, 3.0])
    change = enclosure(np.array([[1.0, -1.0, 0.0]]), y)
    assert 0.25 * size <= change[:2].sum() <= 0.6 * size
    assert change[2] == 0


def test_each_violation_is_named() -> None:
    problem = Problem(np.eye(4), [-1, -1, 1, 0], lower=[0, None, -2, 1], upper=[2, 0.5, 2, 1])
    verified = lcpcli.check(problem, [-1, 1, 0, 5])
    found = [(violation.index, violation.kind) for violation in verified.violations]
    assert sorted(found) == [(0, "z < lower"), (1, "z > upper"), (2, "w > 0"), (3, "z > upper")]
    assert verified.backward_error == np.inf
    assert lcpcli.check(problem, [1, 0.5, -1, 1]).accepted
