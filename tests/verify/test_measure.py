"""What is measured is what is said: the exact backward error with its cap, in all
units, never fooled by large numbers; bounds that decide before it is computed never
accept what it rejects."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng
from scipy.sparse import csr_array

from lcpcli import Problem, Status, check, from_qp, run
from lcpcli.gallery import families
from lcpcli.model.right_hand_sides import Columns
from lcpcli.verify.measure import NEGLIGIBLE_ROUNDING, Measure, least_cap
from lcpcli.verify.nearby_solutions import is_run_off
from lcpcli.verify.point import Criterion, Point

from .. import exact_measure, mixed_problems
from ..exact_measure import ROUNDING
from ..seeds import few_of

FAR = 1e16


def relative_residual(problem, z):
    return Point(
        Criterion(problem), np.asarray(z, dtype=float), is_admissible=False
    ).relative_residual


def small_problem(random):
    """Integers, with bounds of all kinds and sizes, some rows and columns in other
    units."""
    n = int(random.integers(1, 5))
    M = random.integers(-3, 4, (n, n)).astype(float)
    q = random.integers(-4, 5, n).astype(float)
    q *= 10.0 ** random.choice([0, 0, 9, 16], n)
    if random.random() < 0.5:
        return Problem(M * np.exp2(random.integers(-30, 31, n)), q)
    low, high = (10.0 ** random.choice([0, 0, 6, 16], n) for _ in range(2))
    lower = np.choose(
        random.integers(4, size=n), [np.zeros(n), -low, low, np.full(n, -np.inf)]
    )
    upper = np.where(
        random.random(n) < 0.5, np.inf, np.where(np.isfinite(lower), lower, 0) + high
    )
    return Problem(M, q, lower=lower, upper=upper)


@pytest.mark.parametrize("seed", few_of(range(20), 6))
def test_extreme_entries_bound_the_caps_of_all_rows(seed):
    random = default_rng(seed)
    M, q = random.standard_normal((6, 6)), random.standard_normal(6)
    q[random.integers(6, size=3)] = 0.0
    problem = Problem(M * np.exp2(random.integers(-9, 10, 6)), q - np.eye(6)[0])
    cap = least_cap(problem, np.abs(problem.M))
    assert 0 < cap <= Measure(problem).caps(np.zeros(6)).min()


@pytest.mark.parametrize("seed", few_of(range(80), 30))
def test_relative_residual_is_what_its_definition_says_in_rational_arithmetic(seed):
    random = default_rng(seed)
    problem = small_problem(random)
    solution = run(problem, time_limit=120.0).z
    for size in (0.0, 1e-17, 1e-15, 1e-12, 1e-9, 1e-3, 1.0):
        z = problem.box.project(
            solution * (1 + size * random.standard_normal(problem.n))
        )
        measured = relative_residual(problem, z)
        true = exact_measure.relative_residual(problem, z)
        assert measured == pytest.approx(true, rel=NEGLIGIBLE_ROUNDING, abs=ROUNDING)


WRONG = {
    "inactive bound": (Problem([[2.0, 1.0], [-1.0, 0.0]], [-5.0, 1e12]), [0.0, 0.0]),
    "infeasible row": (Problem([[0.0, 0.0], [0.0, 1.0]], [-1.0, -1e11]), [0.0, 1e11]),
    "two scales": (Problem([[1.0, 0.0], [0.0, 3.0]], [-1e12, -6.0]), [1e12, 12.0]),
    "extreme": (
        Problem([[1e250, 1e200, 1e-200], [0, 1, 0], [0, 0, 0]], [-1.0, -1.0, -1.0]),
        [1e-250, 1.0, 0.0],
    ),
    "large costs": (from_qp(None, [6e16, -6e16], [[3, -3]], [6]), [0.0, 0.0, 2e16]),
    "tiny curvature": (
        from_qp([[0.5, 0], [0, 1e-22]], [0, 1], lower=-1, upper=1),
        [0.0, 0.0],
    ),
    "far bound": (Problem([[-1.0]], [-1.0], lower=-FAR), [1.0]),
    "cancelled w": (
        Problem([[1e20, 0.0], [-1e20, 1e20]], [1e3, -2e3], lower=[-1, 0]),
        [0.0, 0.0],
    ),
    "small beside one": (Problem(np.eye(2), [-1.0, -1e-14]), [1.0, 0.0]),
    # no z has M z + q >= 0, but the terms |M| |z| grow without bound
    "z that tends to infinity in a difference": (
        Problem([[1.0, -1.0], [-1.0, 1.0]], [-1.0, 0.5]),
        [1e8 + 0.75, 1e8],
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_large_number_does_not_hide_an_error_elsewhere(name):
    problem, z = WRONG[name]
    assert relative_residual(problem, z) > 1e-8
    assert not check(problem, z).accepted


RIGHT = {
    "a third": (Problem([[-3.0]], [1.0], lower=-1.0), [1 / 3]),
    "small beside one": (Problem(np.eye(2), [-1.0, -1e-14]), [1.0, 1e-14]),
    "growth": (families.make("growth", 60), np.exp2(np.arange(60.0)).tolist()),
}


@pytest.mark.parametrize("name", RIGHT)
def test_right_answers_are_right_at_every_scale(name):
    problem, z = RIGHT[name]
    assert relative_residual(problem, z) <= ROUNDING
    assert check(problem, z).accepted


def test_relative_residual_of_a_homogeneous_problem_is_zero_only_at_a_solution():
    problem = Problem(np.eye(2), np.zeros(2))
    assert relative_residual(problem, np.zeros(2)) == 0
    for size in (1e-300, 1e-17, 1.0):
        assert relative_residual(problem, [size, size]) == 1
        assert not check(problem, [size, size]).accepted


def test_nan_infinity_and_bounds_that_are_violated_are_infinitely_wrong():
    problem = Problem(np.eye(2), -np.ones(2), solutions=[np.ones(2)])
    for z in (np.array([np.nan, 1.0]), np.array([np.inf, 1.0])):
        point = Point(Criterion(problem), z, is_admissible=False)
        with np.errstate(all="ignore"):
            assert (point.residual, point.relative_residual, problem.error(z)) == (
                math.inf,
            ) * 3
    assert relative_residual(problem, [-1e-3, 1.0]) == math.inf


def test_point_within_the_tolerance_of_its_bounds_is_accepted_as_such():
    problem = Problem([[1.0, 0.0], [0.0, 1.0]], [-1.0, 1.0])
    for noise in (1e-17, -1e-17, 1e-11, -1e-11):
        verification = check(problem, [1.0, noise])
        assert verification.accepted, noise
        assert verification.residual == pytest.approx(abs(noise))
    for far in (1e-9, 0.3):
        assert not check(problem, [1.0, far]).accepted


@pytest.mark.parametrize(("z", "q"), [(-1.0, 1.0), (3.0, -3.0)])
def test_a_point_beyond_its_bounds_is_not_taken_for_a_large_solution(z, q):
    problem = Problem([[1]], [q], upper=2)
    assert not is_run_off(problem, np.array([z]), 1e-10)
    assert is_run_off(problem, np.array([max(-q, 0.0) / 1.5]), 1.0)


@pytest.mark.parametrize("n", [1, 30])
def test_a_w_at_the_bounds_that_is_only_rounding_gives_no_size(n):
    """z = 0.1 is at its bound, with w = 3 z + q = -8e-17 for this q near -0.3."""
    q = -np.nextafter(np.nextafter(0.3, 1), 1)
    problem = Problem(3 * np.eye(n), np.full(n, q), lower=0.1)
    assert problem.q_ref.max() < 0
    assert Point(Criterion(problem), np.full(n, 0.1)).solves()


def test_scaled_residual_counts_how_far_z_is_beyond_a_bound():
    """q1 = -2, and the geometric mean of each row is 2^(1/2)."""
    criterion = Criterion(Problem([[2, 1], [1, 2]], [-2, 3]))
    point = Point(criterion, np.array([1, -0.5]), is_admissible=False)
    assert point.scaled_residual == pytest.approx(0.5**1.5)


@settings(deadline=None, max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.sampled_from([1, 2, 5, 20, 120]),
    spread=st.integers(0, 4),
    size=st.integers(-17, -2),
    sparse=st.booleans(),
)
def test_bounds_never_call_a_solution_what_is_none(seed, n, spread, size, sparse):
    """Perturbed solutions, with a tolerance just below and well above the relative
    residual; nor do other judges."""
    generator = np.random.default_rng(seed)
    scales = np.exp2(generator.integers(-spread, spread + 1, (2, n)).astype(float))
    A = generator.standard_normal((n, n))
    M = scales[0][:, None] * (A @ A.T + np.eye(n)) * scales[1]
    z = np.maximum(generator.standard_normal(n), 0) / scales[1]
    q = scales[0] * np.maximum(generator.standard_normal(n), 0) * (z == 0) - M @ z
    z = np.maximum(z * (1 + 10.0**size * generator.standard_normal(n)), 0)
    problem = Problem(csr_array(M) if sparse else M, q)
    if not z.any():
        return
    residual = Point(Criterion(problem, 1e-15), z).relative_residual
    if ROUNDING < residual < 0.1:
        assert not Point(Criterion(problem, 0.9 * residual), z).solves()
        assert Point(Criterion(problem, 1.1 * residual), z).solves()
        measure = Measure(problem)
        assert measure.largest_ratio(z, measure.rows(z)) >= 0.999 * residual
        assert is_run_off(problem, z, 1.1 * residual)


def around(z, generator):
    """Points near z at all distances, some so near that rounding decides."""
    sizes = 10.0 ** generator.uniform(-17, 0, (60, 1))
    return z + sizes * generator.standard_normal((60, z.size)) * (
        np.abs(z) + generator.integers(2)
    )


@pytest.mark.parametrize(
    ("bounds", "condition"),
    [("orthant", 1e8), ("box", 1e1), ("far", 1e1), ("far", 1e14)],
)
def test_many_points_together_pass_where_each_does(bounds, condition):
    """What surely solves among many points solves alone, and nearly all of what solves
    alone surely does."""
    generator = default_rng(3)
    n = 8
    orthogonal = np.linalg.qr(generator.standard_normal((n, n)))[0]
    M = orthogonal * np.geomspace(1, condition, n) @ orthogonal.T
    low, high = (
        mixed_problems.with_all_bounds(n, generator)
        if bounds != "orthant"
        else (0.0, np.inf)
    )
    shift = 1e6 if bounds == "far" else 0.0
    q = condition**0.5 * generator.standard_normal(n)
    result = run(Problem(M, q, lower=low + shift, upper=high + shift))
    z = np.clip(around(result.z, generator), low + shift, high + shift)
    Q = np.repeat(q[:, np.newaxis], z.shape[0], axis=1)
    block = Columns(M, Q, low + shift, high + shift).block(0, len(z))
    measure, together, alone = Measure(block), 0, 0
    for tol in (1e-4, 1e-10, 1e-13):
        surely = measure.surely_solves(z, measure.rows(z), tol)
        for i, is_sure in enumerate(surely):
            solves = Point(Criterion(block.problem(i), tol), z[i]).solves()
            assert solves >= is_sure
            together, alone = together + is_sure, alone + solves
    assert together > 0.6 * alone > 0


@pytest.mark.parametrize("size", [1.0, 1e15])
@pytest.mark.parametrize("method", ["auto", "interior", "newton", "lemke"])
def test_a_bound_that_solves_a_problem_is_found_whatever_the_size_of_q(size, method):
    """At the bound w = size, so that relative to size every z is a solution."""
    result = run(Problem([[1.0]], [size + 1], lower=-1.0), method)
    assert result.z.tolist() == [-1.0]
    assert result.residual == 0.0
    assert run(
        Problem([[1.0]], [-size - 1], lower=-np.inf, upper=1.0), method
    ).z.tolist() == [1.0]


def test_z_may_be_rounded_to_the_grid_near_zero_but_products_may_not():
    n = 120
    problem = Problem(np.eye(n) - 1e-3 * np.eye(n, k=-1), -np.eye(n)[0])
    z = 1e-3 ** np.arange(float(n))
    assert 0 < z[z > 0].min() < 1e-320
    assert check(problem, z).accepted
    underflow = Problem([[1.0, 0.0], [-1e-30, 1.0]], [-1e-55, 0.0])
    tail = Problem([[1.0, 0.0], [-1.0, 1.0]], [-1e-300, 0.0])
    cut = check(underflow, [1e-55, 0.0])
    assert cut.relative_residual == 1
    assert "1.0e-30 of its largest entry" in cut.message
    assert not check(tail, [1e-300, 1e-310]).accepted
    assert not check(Problem([[1.0]], [0.0]), [1e-310]).accepted


@pytest.mark.parametrize("tol", [1e-10, 1e-3])
def test_fixed_variable_may_be_off_by_the_tolerance_and_no_more(tol):
    fixed = 0.3333333333333333
    problem = Problem(
        [[1.0, 0.0], [0.0, 2.0]],
        [0.0, -1.0],
        lower=[fixed, 0.0],
        upper=[fixed, math.inf],
    )
    found = check(problem, [fixed * (1 + tol / 2), 0.5], tol=tol)
    assert found.accepted
    assert (
        found.relative_residual
        == found.backward_error
        == pytest.approx(tol / 2, rel=1e-4)
    )
    assert "is at most" in found.message
    assert not check(problem, [fixed * (1 + 3 * tol), 0.5], tol=tol).accepted
    for z in (fixed, math.nextafter(fixed, 0.0), math.nextafter(fixed, 1.0)):
        assert relative_residual(problem, [z, 0.5]) == 0, "rounding"
    assert math.isinf(relative_residual(problem, [math.inf, 0.5]))


@pytest.mark.parametrize("move", [1e-13, -1e-13])
def test_variable_fixed_at_0_is_measured_in_the_units_of_its_column(move):
    for factor in (2.0**-60, 1.0, 2.0**60):
        problem = Problem(
            [[1.0, factor], [factor, 2 * factor**2]],
            [-1.0, -factor],
            lower=0.0,
            upper=[math.inf, 0.0],
        )
        assert 0.1 < relative_residual(problem, [1.0, move / factor]) / abs(move) < 10
        assert check(problem, [1.0, move / factor]).accepted


def ring(n, excess, sparse=False):
    """A Z-matrix whose diagonal exceeds the other entry of each row by little, so that
    z is large."""
    M = (1 + excess) * np.eye(n) - np.roll(np.eye(n), 1, axis=1)
    return Problem(csr_array(M) if sparse else M, -np.linspace(1, 2, n))


@pytest.mark.parametrize("sparse", [False, True])
def test_a_large_solution_is_solved_if_enclosed_but_not_against_a_proof(sparse):
    problem = ring(60, 1e-10, sparse)
    z = np.linalg.solve(ring(60, 1e-10).M, -problem.q)
    assert relative_residual(problem, z) > 1e-8, "by the cap"
    assert check(problem, z).accepted
    crushed = Problem([[1.0, -1.0], [-1.0, 1.0]], [-1.0, 0.5])
    assert not check(crushed, [6e14, 6e14]).accepted


@pytest.mark.parametrize("n", [60, 1100])
def test_doubt_about_a_large_solution_is_settled_before_other_methods_are_tried(n):
    result = run(ring(n, 1e-10, sparse=True))
    assert result.solved
    assert result.relative_residual > result.tol
    assert result.iterations <= 5
    assert len(result.route) <= 2


@pytest.mark.parametrize("seed", [0, 1])
def test_multipliers_of_rows_strictly_between_two_sides_may_be_noise(seed):
    random, k, m = default_rng(seed), 200, 100
    A = random.standard_normal((m, k)) * (random.random((m, k)) < 0.04)
    x = random.random(k)
    low, high = A @ x - random.choice([0, 1], m), A @ x + 1 + random.random(m)
    c = random.standard_normal(k)
    problem = from_qp(np.eye(k), c, A, row_lower=low, row_upper=high)
    z = run(problem).z.copy()
    y = z[k : k + m]
    y += np.where(y == 0, 1e-10 * random.standard_normal(m), 0.0)
    assert check(problem, z).accepted


def test_large_solutions_have_the_digits_of_the_tolerance_or_of_rounding():
    problem = ring(60, 1e-8)
    z = np.linalg.solve(problem.M, -problem.q)
    found = check(problem, z)
    assert found.accepted
    assert "but it differs by" in found.message
    for error in (1e-5, -1e-5):
        moved = check(problem, z * (1 + error))
        assert not moved.accepted, "although each row is satisfied by its own terms"
        assert f"it differs by {abs(error):.1e}" in moved.message


def test_numbers_near_zero_are_allowed_no_more_than_their_own_distance():
    infeasible = Problem([[-2.0]], [-1.5e-323], lower=[4.4437906e-316])
    assert Point(
        Criterion(infeasible), np.array([4.44379065e-316])
    ).relative_residual == pytest.approx(1.0)
    rounded = Problem([[1.11e304]], [-1.3e-14])
    assert Point(Criterion(rounded), np.array([1.3e-14 / 1.11e304])).solves()
    assert not Point(Criterion(rounded), np.array([2 * 1.3e-14 / 1.11e304])).solves()


def test_a_fixed_variable_is_measured_by_its_bound_where_its_unit_is_far_smaller():
    sides = {"lower": [0.0, 1e8], "upper": [math.inf, 1e8]}
    problem = Problem([[2.0, 0.0], [1.0, 2.0]], [-1.0, 0.0], **sides)
    assert check(problem, [0.5, 1e8 * (1 + 5e-11)]).accepted
    assert not check(problem, [0.5, 1e8 * (1 + 5e-10)]).accepted


def test_an_enclosed_solution_is_doubtful_if_entries_nearby_have_none():
    # Its rows are so short that its system has bounds on rounding.
    problem = ring(60, 60 * 2.0**-52, sparse=True)
    result = run(problem)
    assert result.status is Status.ILL_POSED
    assert result.certificate.is_rounded
    assert not check(problem, result.z).accepted
