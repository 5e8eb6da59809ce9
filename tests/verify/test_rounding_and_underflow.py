"""What rounding left of zeros keeps no solution from being one, and products that
underflow hide no violation; numbers that matter always count. What is decided about
solutions in which rounding hides terms of a row, and at what expense.
"""

import json
from fractions import Fraction

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem, check, from_qp, run
from lcpcli.solving import direct_run
from lcpcli.verify import exact_solution
from lcpcli.verify.acceptance import BY_CRITERION, accepted
from lcpcli.verify.final_states import is_doubtful, verified_or_exact
from lcpcli.verify.measure import FEW_UNKNOWNS
from lcpcli.verify.point import Criterion, Point

from .. import exact, exact_measure
from ..seeds import few_of


def chain(n, small=1e-300):
    """z_0 = 1e-30, and small z_i >= small z_(i-1) for those that follow, but z_n = 0
    for the last of n: it only keeps the rows moderate. The only solution is (1e-30,
    ..., 1e-30, 0)."""
    M, q = np.eye(n), np.zeros(n)
    for i in range(1, n - 1):
        M[i, i - 1 : i + 1] = -small, small
        M[i, -1] = 1.0
    q[0], q[-1] = -1e-30, 1.0
    return Problem(M, q)


def solution(n):
    return [1e-30] * (n - 1) + [0.0]


@pytest.mark.parametrize("n", [3, 30, 120])
@pytest.mark.parametrize("as_matrix", [np.asarray, csr_array])
def test_point_with_hidden_violations_does_not_solve(n, as_matrix):
    M, q = as_matrix(chain(n).M), chain(n).q
    z = np.append(1e-30, np.zeros(n - 1))
    for problem in (Problem(M, q), Problem(M, q, upper=np.full(n, 1e-3))):
        assert not Point(Criterion(problem), z).solves()
        assert not check(problem, z).accepted


@pytest.mark.parametrize("module", ["tests.direct_answers", "lcpcli.kernels.compiled"])
def test_small_problems_are_not_solved_at_once_where_a_product_underflows(module):
    found = pytest.importorskip(module).direct(chain(30), 1e-10)
    assert found is None or not found.is_certain or found.z.tolist() == solution(30)


def triangular(random):
    """A lower triangular M with a positive diagonal, numbers of very different sizes,
    and the only solution."""
    n = int(random.integers(2, 9))
    M = np.tril(
        random.integers(-2, 3, (n, n)) * 10.0 ** random.choice([0, -150, -300], (n, n)),
        -1,
    )
    M += np.diag(10.0 ** random.choice([0, -150, -300], n))
    q = -random.integers(0, 3, n) * 10.0 ** random.choice([0, -30, -200], n)
    z = []
    for i in range(n):
        w = Fraction(q[i]) + sum(Fraction(M[i, j]) * value for j, value in enumerate(z))
        z.append(max(-w / Fraction(M[i, i]), Fraction(0)))
    return Problem(M, q), z


@pytest.mark.parametrize("seed", few_of(range(30), 5))
def test_what_is_solved_is_the_only_solution(seed):
    problem, solution = triangular(default_rng(seed))
    M = csr_array(problem.M) if seed % 3 == 0 else problem.M
    result = run(Problem(M, problem.q), time_limit=120.0)
    assert result.solved or any(
        value and not 1e-250 < value < 1e250 for value in solution
    )
    if result.solved:
        last_digits = all(
            abs(Fraction(a) - b) <= b / 2**50
            for a, b in zip(result.z.tolist(), solution, strict=True)
        )
        assert (
            last_digits or exact_measure.relative_residual(problem, result.z) <= 1e-10
        )


def test_bound_that_underflows_in_other_units_is_a_bound_still():
    """z_0 has to rise to u_0 = 1e-100; in units in which the other numbers are
    moderate, u_0 would be 0."""
    M = [
        [0.0, 0.0, 0.0, -2e-300],
        [0.0, 1e-300, 0.0, 1e-150],
        [0.0, 0.0, 0.0, 1.0],
        [2e-300, -1e-150, -1.0, 0.0],
    ]
    problem = Problem(
        M,
        [-1e-200, 1.0, -2e-200, 0.0],
        lower=0.0,
        upper=[1e-100, np.inf, np.inf, np.inf],
    )
    assert not check(problem, [0.0, 0.0, 0.0, 2e-200]).accepted
    result = run(problem, time_limit=120.0)
    assert not result.solved or result.z[0] == 1e-100


UNKNOWNS = 40


def with_noise_in_q(noisy=2, n=UNKNOWNS, size=2.0**-52):
    """A program in whose last rows, equations of variables that are 0, the right-hand
    side is rounding of 0."""
    M = np.eye(n)
    M[0, 1:] = 1.0
    q = -np.arange(3.0, n + 3)
    q[0] = -1000.0
    for i in range(n - noisy, n):
        M[i] = 0.0
        M[i, 1], M[1, i] = -1.0, 1.0
        q[i] = -size
    q[1] = 2.0
    lower = np.zeros(n)
    lower[n - noisy :] = -np.inf
    return Problem(M, q, lower=lower)


@pytest.mark.parametrize("as_matrix", [np.asarray, csr_array])
def test_rounding_of_zero_in_q_is_named_where_it_alone_stands_in_the_way(as_matrix):
    given = with_noise_in_q()
    problem = Problem(as_matrix(given.M), given.q, lower=given.lower)
    result = run(problem, time_limit=120.0)
    assert result.solved
    assert list(result.negligible_q) == [UNKNOWNS - 2, UNKNOWNS - 1]
    assert (
        result.message
        == f"solved: counting q{UNKNOWNS - 1} = -2.2e-16 and q{UNKNOWNS} = "
        "-2.2e-16 as 0"
    )
    assert json.loads(result.to_json())["negligible_q"] == [UNKNOWNS - 2, UNKNOWNS - 1]
    verification = check(problem, result.z)
    assert verification.accepted
    assert (
        f"counting q{UNKNOWNS - 1} = -2.2e-16 and q{UNKNOWNS} = -2.2e-16 as 0"
        in verification.message
    )


@pytest.mark.parametrize("other", [np.inf, 5.0, 1e19])
def test_rounding_of_zero_in_a_side_is_named_where_rows_have_another_side(other):
    """x1 = 0, and -x1 >= 2.2e-16 does not hold as the numbers stand; 1e-6 is more than
    rounding."""
    n = 30
    A, costs = np.zeros((2, n)), -np.arange(3.0, n + 3)
    A[0, 0], A[1], costs[0] = -1.0, 1.0, 500.0
    ends = {"row_upper": [other, np.inf], "lower": 0.0, "upper": np.inf}
    z = run(from_qp(np.eye(n), costs, A, row_lower=[0.0, 1000.0], **ends)).z
    for side in (2.0**-52, 1e-6):
        problem = from_qp(np.eye(n), costs, A, row_lower=[side, 1000.0], **ends)
        found = check(problem, problem.box.project(z))
        assert found.accepted == (side < 1e-6)
        named = f"q31 = -{side:.1e}" if other == np.inf else f"side {side:.1e} of row 1"
        assert (f"counting {named} as 0" in found.message) == found.accepted


def test_message_names_three_entries_and_counts_the_others_if_there_are_any():
    result = run(with_noise_in_q(noisy=6), time_limit=120.0)
    assert len(result.negligible_q) == 6
    assert result.message.endswith("and 3 more of q as 0")
    result = run(Problem([[2.0]], [-1.0]))
    assert result.message == "solved"
    assert list(result.negligible_q) == []


def solution_but_for_noise(problem):
    result = run(
        Problem(
            problem.M,
            np.where(np.abs(problem.q) < 1e-6, 0.0, problem.q),
            lower=problem.lower,
        )
    )
    assert result.solved
    return result.z


def solution_by_criterion(point):
    criterion = point.criterion
    found = accepted(criterion.problem, [point], criterion.tol, BY_CRITERION)
    return None if found is None else found.point


def test_entries_of_q_that_may_matter_count():
    few = with_noise_in_q(n=FEW_UNKNOWNS)  # which exact arithmetic decides
    # Which is not as small as rounding.
    for problem in (few, with_noise_in_q(size=1e-11)):
        point = Point(Criterion(problem), solution_but_for_noise(problem))
        assert point.relative_residual == 1.0
        assert solution_by_criterion(point) is None


def test_entry_of_q_counts_beside_other_terms_of_its_row():
    problem = with_noise_in_q()
    M = problem.M.copy()
    M[UNKNOWNS - 1, 5] = 1e-14
    z = solution_but_for_noise(problem)
    assert z[5] > 1.0
    other = Problem(M, problem.q, lower=problem.lower)
    assert solution_by_criterion(Point(Criterion(other), z)) is None


@pytest.mark.parametrize(("method", "n"), [("auto", 12), ("auto", 21), ("newton", 40)])
def test_no_row_is_solved_by_the_size_of_another(method, n):
    """M_00 asks for a large z_0; two rows, w_1 = z_2 - 1 and w_2 = z_1 + 1, exclude
    each other."""
    M, q = np.eye(n), np.full(n, -5.0)
    M[0, 1:] = 1.0
    M[1:3, 1:3] = [[0.0, 1.0], [1.0, 0.0]]
    q[:3] = -1e16, -1.0, 1.0
    assert not run(Problem(M, q), method).solved
    z = np.full(n, 5.0)
    z[:3] = 1e16, 0.0, 1.0
    assert not check(Problem(M, q), z).accepted


def test_rows_of_noise_are_cleaned_one_by_one():
    """w_2 = -z_1 is violated by a z_1 that is rounding of 0; z_5 is as small, and
    matters."""
    n = 24
    M, q = np.eye(n), -np.full(n, 7.0)
    M[0, 1:], M[1:3] = 1.0, 0.0
    M[2, 1], q[0], q[1], q[2], q[5] = -1.0, -4e4, 0.0, 0.0, -1e-10
    z = np.maximum(-q, 0.0)
    z[0] -= z[3:].sum()
    z[1] = 1e-11
    point = Point(Criterion(Problem(M, q)), z)
    assert not point.solves()
    solution = solution_by_criterion(point)
    assert solution.z[1] == 0.0
    assert solution.z[5] == 1e-10
    assert list(solution.negligible) == []


def test_a_whole_number_in_q_is_no_rounding_however_large_the_others_are():
    """The last rows, equations of variables that are 0 where the other rows hold,
    contradict them."""
    given = with_noise_in_q(size=1.0)
    q = np.where(np.arange(UNKNOWNS) < UNKNOWNS - 2, 1e14 * given.q, given.q)
    q[0] = -3e14
    result = run(Problem(given.M, q, lower=given.lower))
    assert not result.solved
    assert list(result.negligible_q) == []


A = np.array([[1.0, 0, 0], [0, 3.5, -3.5], [0, -3.5, 3.5]])
DISC = np.block([[A, np.array([[0.0], [1], [1]])], [np.array([[0.3, -1, -1, 0]])]])


def on_the_floor(slip):
    """A disc on the floor: normal and tangential impulses, and the speed at which it
    slides."""
    return Problem(DISC, [-0.00981, slip, -slip, 0])


@pytest.fixture
def looks(monkeypatch):
    """The exact basic solutions that were computed."""
    made, at = [], exact_solution.exact_basis

    def counted(data, basis):
        made.append(basis.size)
        return at(data, basis)

    monkeypatch.setattr(exact_solution, "exact_basis", counted)
    return made


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("slip", [1e-6, 1e-10, 1e-15, 1e-17, 1e-30])
def test_a_disc_at_rest_needs_no_exact_arithmetic(slip, compiled, looks):
    if compiled and direct_run.compiled() is None:
        pytest.skip("numba is not installed")
    problem = on_the_floor(slip)
    result = lcpcli.solve(problem.M, problem.q, compiled=compiled)
    assert result.route == ("newton",)
    assert looks == []
    assert result.z == pytest.approx([0.00981, 0, slip / 3.5, 0], rel=1e-14)


def test_what_rounding_hides_is_decided_exactly():
    """w_2 is 1/3 less the double next to it and 1e-17 more, and decides whether z_2 is
    0; with the double above, it is not."""
    M = np.array([[3.0, 0, 0], [1, 1, 1], [0, 0, 1]])
    for own in (-1 / 3, -np.nextafter(1 / 3, 1)):
        problem = Problem(M, [-1.0, own, -1e-17])
        found = verified_or_exact(problem, np.array([1 / 3, 0.0, 1e-17]))
        solution = exact.solution(problem)
        assert found.z.tolist() == [float(value) for value in solution]
        assert (found.z[1] > 0) == (own < -1 / 3)


def test_contradictions_by_less_than_rounding_are_not_confirmed():
    """z_3 - z_4 is at least 1e-17 and at most -1e-17."""
    M = np.array([[0, 0, 1, -1], [0, 0, -1, 1], [0, 0, 1, 0], [0, 0, 0, 1]])
    problem, z = Problem(M, [-1e-17, -1e-17, -1, -1]), np.array([0.0, 0, 1, 1])
    assert exact.solution(problem) is None
    assert is_doubtful(problem, z)
    assert verified_or_exact(problem, z) is None
    assert lcpcli.run(problem).status.has_no_solution


@pytest.mark.parametrize("seed", few_of(range(40), 12))
def test_a_confirmed_solution_of_few_unknowns_is_near_an_exact_one(seed):
    random = default_rng(seed)
    n = int(random.integers(2, 5))
    F = random.integers(-2, 3, (n, n)).astype(float)
    z = random.integers(0, 2, n) * 10.0 ** random.integers(-17, 2, n)
    problem = Problem(
        F @ F.T, -F @ F.T @ z + (z == 0) * random.integers(0, 2, n) * 1e-16
    )
    found = verified_or_exact(problem, z)
    if found is not None and is_doubtful(problem, z):
        states = ["basic" if value > 0 else "lower" for value in found.z]
        near = exact.of_states(*exact.rational(problem), [0] * n, [np.inf] * n, states)
        assert found.z == pytest.approx([float(value) for value in near], rel=1e-11)
