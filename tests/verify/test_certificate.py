"""Proofs of infeasibility: never believed about a feasible problem, and found for infeasible ones in any units."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from scipy.sparse import csr_array

from lcpcli import Problem, from_qp
from lcpcli.rational import numbers
from lcpcli.verify.alternative import FarkasSystem
from lcpcli.verify.certificate import farkas, is_ray, proves_infeasible
from lcpcli.verify.farkas import refutes

from .. import exact

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


def test_textbook_problem_is_proved_infeasible_by_its_first_row() -> None:
    y = farkas(INFEASIBLE)
    assert np.array_equal(y, [1.0, 0.0])


def test_feasible_problem_has_no_proof() -> None:
    for M, q in (([[0, 1], [1, 0]], [-1, 1]), ([[0, 1], [0, 0]], [-1, 0]), ([[1]], [-1]), ([[0]], [0])):
        assert farkas(Problem(M, q)) is None


@pytest.mark.parametrize(
    "y", [[0, 0], [-1, 0], [0, 1], [1, 1], [1, 1e-300], [np.nan, 0], [np.inf, 0], [1, np.nan]], ids=str
)
def test_vector_that_proves_nothing_is_refused(y: list[float]) -> None:
    assert not proves_infeasible(INFEASIBLE, np.array(y))


def test_length_of_a_proof_does_not_matter() -> None:
    assert all(proves_infeasible(INFEASIBLE, np.array([size, 0.0])) for size in (1.0, 1e-300, 1e300, 5e-324))


def test_feasible_problem_with_solutions_as_large_as_1_over_eps_is_not_called_infeasible() -> None:
    """z_1 - z_2 >= 1 and (1 + eps) z_2 >= z_1 for z_2 = 1 / eps; for y = e, M'y is within rounding of 0."""
    y = np.ones(2)
    assert not proves_infeasible(Problem([[1, -1], [-1, 1 + ULP]], [-1, 0]), y)
    assert proves_infeasible(Problem([[1, -1], [-1, 1]], [-1, 0]), y)
    assert proves_infeasible(Problem([[1, -1], [-1, 1 - ULP]], [-1, 0]), y)


def test_proof_whose_products_underflow_or_overflow_is_checked_all_the_same() -> None:
    tiny = Problem([[1e-200, 0], [0, 1]], [-1e-200, 0])
    assert not proves_infeasible(tiny, np.array([1e-200, 0.0]))
    assert proves_infeasible(Problem([[-1e-200, 0], [0, 1]], [-1e-200, 0]), np.array([1e-200, 0.0]))
    assert proves_infeasible(Problem([[-1e300, 0], [0, 1]], [-1e300, 0]), np.array([1e300, 0.0]))


def test_proof_that_no_floats_can_write_is_corrected_and_found_valid() -> None:
    """M'y = 0 forces y_1 = 3 y_2 / 0.1, where 0.1 and so the quotient are no short fractions."""
    problem = Problem([[0.1, -0.1], [-3, 3]], [-1, 0])
    rounded = np.array([3 / 0.1, 1.0]) / 7
    product = [numbers.product(column, [Fraction(value) for value in rounded]) for column in problem.M.T]
    assert any(product)
    assert proves_infeasible(problem, rounded)
    assert farkas(problem) is not None


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
    assert farkas(INFEASIBLE) is not None
    assert farkas(chain(1e-6, 100.0)) is not None
    assert farkas(chain(-1e-6, 100.0)) is None


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


def test_sign_of_a_product_is_exact_where_floats_cancel() -> None:
    a, y = np.array([1e200, 1.0, -1e200]), np.array([1e200, 1e-200, 1e200])
    assert numbers.sign_of_product(a, y) > 0
    assert numbers.sign_of_product(-a, y) < 0
    assert numbers.sign_of_product(a, y * [1, 0, 1]) == 0
    assert numbers.sign_of_product(np.array([5e-324, -5e-324]), np.array([5e-324, 1e-323])) < 0


def test_a_ray_ends_at_no_bound_and_leaves_no_component_and_its_w_positive_together() -> None:
    direction = np.ones(1)
    assert is_ray(Problem([[0]], [-1]), direction)
    assert is_ray(Problem([[-1]], [-1]), direction)
    assert not is_ray(Problem([[0]], [-1], upper=[1]), direction)
    assert not is_ray(Problem([[1]], [-1]), direction)
    assert not any(is_ray(Problem([[0]], [-1]), other) for other in (-direction, 0 * direction))


def test_products_that_underflow_prove_nothing() -> None:
    """A'y has a positive component, of 1e-400: z = 1e200 e is feasible."""
    assert not refutes(np.array([[0.0, -1.0], [1e-200, 0.0]]), np.array([0.0, -1.0]), np.array([1.0, 1e-200]))
    assert not refutes(np.array([[1e-200]]), np.array([-1.0]), np.array([1e-200]))
