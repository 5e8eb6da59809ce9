"""Kernels beside what they stand for: what they answer is a solution by the measure of
the rest of the package, for few unknowns with any bounds, sparse problems, and blocks
of many; and at the limits of numbers.
"""

from fractions import Fraction
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng
from scipy.sparse import csr_array

pytest.importorskip("numba")

import lcpcli
from lcpcli import Problem, run
from lcpcli.basis import tableau
from lcpcli.formulations.contact import states
from lcpcli.gallery import families
from lcpcli.kernels import compiled
from lcpcli.kernels.compiled import (
    NUMBERS_AT_ONCE,
    direct_many,
    lemke,
    mixed,
    rows_of,
    solves,
    surely_solves,
)
from lcpcli.kernels.kernels import solve_one
from lcpcli.methods.direct import CANDIDATE, CERTAIN, DOUBTFUL, NOTHING
from lcpcli.methods.lemke import LemkePath, reduced
from lcpcli.verify.point import Criterion, Point

from .. import kernels_together  # noqa: F401


def with_bounds_of_all_kinds(seed, n, density=1.0):
    """Return a problem with free, fixed, boxed and mirrored variables, far and narrow
    bounds, degenerate or not."""
    generator = default_rng(seed)
    A = generator.standard_normal((n, n))
    M = (A @ A.T / n + A - A.T, A, np.rint(A), np.diag(np.abs(A[0])))[seed % 4]
    M = M * (default_rng(n).random((n, n)) < density)
    far = generator.standard_normal(n) * 10.0 ** generator.integers(-8, 8, n)
    beyond = far + 10.0 ** generator.integers(-9, 3, n)
    kinds = generator.integers(0, 7, n)
    lower = np.choose(kinds, (0, -np.inf, -np.inf, -1, 1, far, far))
    upper = np.choose(kinds, (np.inf, np.inf, far, 1, 1, np.inf, beyond))
    z = np.clip(2 * generator.standard_normal(n), lower, upper)
    w = np.where(z == lower, 1.0, np.where(z == upper, -1.0, 0.0)) * (
        generator.random(n) < 0.7
    )
    q = w - M @ z if seed % 3 else np.rint(generator.standard_normal(n))
    R, C = (
        10.0 ** generator.uniform(-6, 6, (2, n)) if seed % 5 == 0 else np.ones((2, n))
    )
    return Problem(R[:, np.newaxis] * M * C, R * q, lower=lower / C, upper=upper / C)


@settings(max_examples=60)
@given(seed=st.integers(0, 10**6), n=st.integers(1, 40))
def test_an_answer_of_the_kernels_is_a_solution(seed: int, n: int) -> None:
    problem = with_bounds_of_all_kinds(seed, n)
    if not problem.is_mixed:
        return
    answer = mixed(problem, 1e-10)
    assert (
        answer is None
        or Point(Criterion(problem), answer.z, is_admissible=False).solves()
    )


def test_most_monotone_problems_are_answered_by_the_kernels():
    problems = [with_bounds_of_all_kinds(4 * seed, 24) for seed in range(1, 30)]
    assert sum(mixed(problem, 1e-10) is not None for problem in problems) >= 20


@settings(max_examples=30)
@given(
    seed=st.integers(0, 10**6),
    n=st.integers(1, 10),
    size=st.integers(-16, 0),
    density=st.sampled_from([0.2, 1.0]),
)
def test_the_compiled_checks_say_nothing_else_than_the_measure(
    seed: int, n: int, size: int, density: float
) -> None:
    problem, random = (
        with_bounds_of_all_kinds(seed, n, density),
        np.random.default_rng(seed),
    )
    z = problem.box.project(
        lcpcli.run(problem).z * (1 + 10.0**size * random.standard_normal(n))
    )
    if problem.is_mixed and surely_solves(
        rows_of(problem), problem.q, *problem.box.vectors(n), 1e-10, z
    ):
        assert Point(Criterion(problem), z).solves()
    sparse = Problem(
        csr_array(problem.M), problem.q, lower=problem.lower, upper=problem.upper
    )
    point = Point(Criterion(sparse), z)
    if sparse.is_moderate:
        surely, rows = compiled.test_sparse(sparse, z, 1e-10)
        assert surely in (None, point.solves())
        if rows is not None:
            usual = point.criterion.measure.rows(z)
            assert np.all(np.abs(rows.w - usual.w) <= rows.error + usual.error)
            assert all(map(partial(np.allclose, atol=0), rows[1:3], usual[1:3]))
            assert np.all(rows.error >= (1 - 1e-12) * usual.error)
    assert (
        Point(Criterion(sparse, acceptance_test=compiled.test_sparse), z).solves()
        == point.solves()
    )


@pytest.mark.parametrize("seed", range(4))
def test_the_kernels_take_the_steps_of_the_program_where_variables_are_fixed(seed):
    random = default_rng(seed)
    A, B = random.normal(size=(2, 14, 14))
    lower = np.where(random.random(14) < 0.3, -1.0, 0.0)
    upper = np.where(
        random.random(14) < 0.4, lower, np.where(random.random(14) < 0.3, 1.0, np.inf)
    )
    problem = Problem(
        A @ A.T + B - B.T + np.eye(14),
        3 * random.normal(size=14),
        lower=lower,
        upper=upper,
    )
    kernels, plain = (
        lcpcli.run(problem, compiled=compiled) for compiled in (True, False)
    )
    assert kernels.route == plain.route
    assert kernels.iterations == plain.iterations
    np.testing.assert_allclose(kernels.z, plain.z, rtol=1e-9, atol=1e-12)


def test_stored_zeros_tie_no_components_together():
    """x1 - x2 = 0 and x1 - x2 = 1 are nearly satisfied beside x near 1e12, which is
    small only in the last row."""
    M = np.zeros((5, 5))
    M[:2, 2:4], M[2:4, :2], M[4, 4] = [[-1, -1], [1, 1]], [[1, -1], [1, -1]], 1.0
    z = np.array([1e12 + 0.5, 1e12, 0, 0, 1e12])
    free = np.array([False, False, True, True, False])
    full = csr_array(np.where(M == 0, 7.0, M))
    full.data[full.data == 7.0] = 0.0
    for stored in (csr_array(M), full):
        problem = Problem(
            stored, [0, 0, 0, -1, -1e12], lower=np.where(free, -np.inf, 0.0)
        )
        assert not compiled.solves(problem, z, 1e-10)
        assert compiled.solves(
            Problem(stored, [0, 0, 0, 0, -1e12], lower=problem.lower),
            z * [0, 0, 0, 0, 1],
            1e-10,
        )


def test_no_component_of_a_degenerate_solution_is_negative():
    # More than those whose small numbers exact arithmetic decides.
    rng, n = default_rng(0), 24
    for _ in range(100):
        M = rng.standard_normal((n, n))
        M = M @ M.T + 0.1 * np.eye(n)
        z = np.where(rng.random(n) < 0.5, rng.random(n), 0.0)
        z[0] = 0.0
        q = -M @ z
        found, _, z = solve_one(M, q, q < 0, False, np.abs(M).max(), 1e-10)
        assert not found or (z >= 0).all()


def test_only_small_numbers_that_may_decide_a_state_are_left_to_fractions():
    """Of the last one, w_2 is 1/3 less the double next to it."""
    q = np.array([-1.0, 1e-9])
    assert solve_one(np.eye(2), q, q < 0, False, 1.0, 1e-10)[0] == CERTAIN
    M = np.array([[3.0, 0, 0], [1, 1, 0], [0, 0, 1]])
    q = np.array([-1.0, -1 / 3, 1e-17])
    assert solve_one(M, q, q < 0, False, 3.0, 1e-10)[0] == DOUBTFUL
    assert lemke(Problem(M, q), 1e-10).z.tolist() == [1 / 3, 0, 0]


def test_no_solution_is_certain_where_a_product_underflows():
    """w_2 is 0 as computed, and -0.4 times the smallest double in fact."""
    least = np.nextafter(0, 1)
    M, q = np.array([[1e-200, 0], [-4.9424e-201, 1e-200]]), np.array([-1e-320, 0])
    q[1] = 1000 * least
    verdict_code, _, z = solve_one(M, q, q < 0, False, 1e-200, 1e-10)
    w = Fraction(q[1]) + Fraction(M[1, 0]) * Fraction(z[0])
    assert verdict_code == CANDIDATE
    assert w / Fraction(least) < -0.1
    assert q[1] + M[1, 0] * z[0] == 0.0


@pytest.mark.parametrize("lower", [[1e-200, 0, 0], [-1e-200, 0, -1]])
def test_no_solution_is_certain_where_q_at_the_reference_point_underflows(lower):
    """There w_1 is 1e-400, beside which w_1 = -1e-209 of this z is not small."""
    M, q = np.array([[1e-200, -1e-200, 0], [-1e-200, 1e-200, 0], [0, 0, 1]]), [0, 0, 1]
    problem, z = Problem(M, q, lower=lower), np.array([1, 1 + 1e-9, lower[2]])
    given = rows_of(problem), problem.q, *problem.box.vectors(3), 1e-8, z
    assert not surely_solves(*given)
    assert not Point(Criterion(problem, 1e-8), z).solves()


def test_each_matrix_of_many_is_measured_by_itself():
    M, Q = np.array([[[2.0**49]], [[2.0**51]]]), np.array([[-(2.0**49)], [-(2.0**49)]])
    found = direct_many(M, Q, np.abs(M).max(axis=(1, 2)), 1e-10)[1]
    # An entry of M from 2^50 on is too long a number.
    assert found[:, 0].tolist() == [CERTAIN, NOTHING]


def test_one_matrix_of_many_q_is_that_of_each_block():
    Q = -np.ones((NUMBERS_AT_ONCE // 4 + 2, 2))  # more than are solved at once
    assert (
        direct_many(2 * np.eye(2)[np.newaxis], Q, np.array([2.0]), 1e-10)[0] == 0.5
    ).all()


def test_rounding_at_the_reference_point_is_no_size_of_q_when_compiled():
    """Row 1 at the lower bounds is 4e-12, and -1.5e-11 as doubles sum it up; the last
    two rows are infeasible."""
    M, lower = np.zeros((5, 5)), np.zeros(5)
    M[0, :4] = 0.42717905926330113, 0.5768579307407304, 0.8747103493618308, 1.0
    M[1, 1] = M[2, 2] = 1.0
    M[3:, 3:] = [[1, -1], [-1, 1]]
    lower[:3] = 84718.05368988577, 79721.55013113268, 92199.35749096583
    problem = Problem(
        M, [-162825.5191238109, 1 - lower[1], 1 - lower[2], -1e-22, -1e-22], lower=lower
    )
    z = lower + np.array([0, 0, 0, 1e-8, 1e-8])
    assert not Point(Criterion(problem), z).solves()
    assert not solves(problem, z, 1e-10)


def test_a_ray_is_believed_only_of_a_tableau_that_is_made_again():
    def spoiled(tableau_, *how):
        end, pivots, entering, way = tableau.follow(tableau_, *how[:-1], 1)
        return (
            (tableau.RAY, pivots, entering, way)
            if end == tableau.PAUSED
            else (end, pivots, entering, way)
        )

    M = 2 * np.eye(4) + np.ones((4, 4))
    problem = Problem(M, -np.arange(1.0, 5.0))
    path = LemkePath(reduced(problem), problem.q, 0, False, spoiled)
    path.advance(100)
    assert path.end == tableau.SOLVED


@pytest.mark.parametrize("family", ["harker-pang", "near-singular"])
def test_projected_gradients_find_the_states_with_and_without_kernels(family):
    problem = families.make(family, 250, 1)
    one, other = (run(problem, compiled=compiled) for compiled in (False, True))
    assert one.solved
    assert one.route[0] == "gradient"
    assert one.route == other.route
    assert one.basis == other.basis
    np.testing.assert_allclose(one.z, other.z, rtol=1e-9, atol=1e-12)


def test_a_violation_is_not_small_in_the_units_of_another_row():
    R, z = np.array([2.0**-30, 2.0**30]), np.array([2.0**20, 2.0**20 + 1])
    problem = Problem(
        csr_array(R[:, np.newaxis] * [[1.0, -1.0], [-1.0, 1.0]]), R * [-1.0, -1.0]
    )
    assert not solves(problem, z, 1e-4)
    assert not surely_solves(
        rows_of(problem), problem.q, *map(np.array, problem.box.vectors(2)), 1e-4, z
    )


def test_a_step_of_contacts_is_that_without_kernels_and_certain_where_it_solves():
    numbers = set()
    for seed in range(40):
        random = default_rng(seed)
        k = int(random.integers(1, 9))
        J = random.standard_normal((2 * k, 2 * k + 2))
        q = J @ random.standard_normal(2 * k + 2)
        mu = random.choice([0.0, 0.3, 1.2], k)
        problem, other = (
            lcpcli.from_contact(J @ J.T, each, mu) for each in (q, q * (1 + 1e-6))
        )
        assert problem.units.parts
        basis = random.integers(-1, 1, 3 * k).astype(np.int8)
        plain, fast, far = (
            states.followed(each.origin, problem, basis, 1e-10, kernels)
            for each, kernels in (
                (problem, None),
                (problem, compiled),
                (other, compiled),
            )
        )
        assert (plain is None) == (fast is None)
        if plain is None or fast is None:
            continue
        assert fast.steps == plain.steps
        assert np.allclose(fast.z, plain.z, rtol=1e-9, atol=1e-12)
        for each in filter(None, (fast, far)):
            assert each.is_certain == Point(Criterion(problem), each.z).solves()
            numbers.add((each.steps, each.is_certain))
    assert numbers >= {(1, True), (2, True), (3, True), (2, False)}
