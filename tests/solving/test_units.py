"""A problem in other units has the same answer, by the same methods in about as many
steps, whatever the powers of two by which its rows, columns, costs and sides are
multiplied; and everything that is said of it is said in the units of the data."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import lcpcli
from lcpcli import Problem, from_qp, run
from lcpcli.model.usual_units import in_usual_units, remark

from ..far_bounds import random_program

SIDES = ("row_lower", "row_upper")
BOUNDS = ("lower", "upper")


def problem_of(program):
    """The problem of the data of a program, Q perhaps None."""
    n = program["c"].size
    Q = np.zeros((n, n)) if program["Q"] is None else program["Q"]
    return from_qp(**(program | {"Q": Q}))


def in_units(program, of_x, of_rows, of_costs, of_sides):
    """The same program with x / 2^of_x, with rows times 2^of_rows, the objective in
    other units, and all sides and bounds times 2^of_sides, exactly."""
    X, R = np.exp2(of_x), np.exp2(of_rows)
    cost, side = 2.0**of_costs, 2.0**of_sides
    Q = program["Q"]
    scaled = {
        "Q": None if Q is None else X[:, np.newaxis] * Q * X * cost / side,
        "c": X * program["c"] * cost,
        "A": R[:, np.newaxis] * program["A"] * X,
    }
    scaled |= {name: R * program[name] * side for name in SIDES}
    return scaled | {name: program[name] / X * side for name in BOUNDS}


def powers(random, count, largest):
    return random.integers(-largest, largest + 1, count).astype(float)


@settings(max_examples=40)
@given(
    st.integers(0, 2**20), st.integers(4, 24), st.sampled_from([0, 40]), st.booleans()
)
def test_a_program_in_other_units_has_the_same_minimum(seed, k, width, is_far):
    program, random = random_program(seed, k), np.random.default_rng(seed)
    m = program["A"].shape[0]
    of_x, of_rows = powers(random, k, width), powers(random, m, width)
    of_costs, of_sides = powers(random, 2, 200 if is_far else 40)
    as_given = run(problem_of(program))
    scaled = in_units(program, of_x, of_rows, of_costs, of_sides)
    other = run(problem_of(scaled))
    assert as_given.solved
    assert other.solved
    minimum = other.answer.objective / 2.0**of_costs / 2.0**of_sides
    assert minimum == pytest.approx(as_given.answer.objective, rel=1e-9, abs=1e-9)
    # No stage that others follow only where they fail.
    assert other.iterations <= as_given.iterations + 40


@settings(max_examples=20)
@given(st.integers(0, 2**20), st.integers(-150, 150), st.integers(-150, 150))
def test_a_program_without_minimum_has_none_in_other_units(seed, of_costs, of_sides):
    program, random = random_program(seed, 12), np.random.default_rng(seed)
    of = powers(random, 12, 20), powers(random, 7, 20), of_costs, of_sides
    row = program["A"][:1] if program["A"][0].any() else np.ones((1, 12))
    # A sum that cannot be reached within the bounds, and its opposite.
    low, high = (
        np.append(program[name], side)
        for name, side in zip(SIDES, (7.0, 8.0), strict=True)
    )
    contradicted = program | {
        "A": np.vstack((program["A"], row)),
        "row_lower": low,
        "row_upper": high,
        "lower": np.zeros(12),
        "upper": np.full(12, 0.01),
    }
    for each in (contradicted, in_units(contradicted, *of)):
        result = run(problem_of(each))
        assert result.status is lcpcli.Status.INFEASIBLE
        assert result.certificate is not None


@pytest.mark.parametrize("size", [2.0**-46, 2.0**33, 2.0**46, 2.0**53])
@pytest.mark.parametrize("is_sparse", [False, True])
def test_sides_of_any_size_leave_the_simple_methods_enough(size, is_sparse):
    """Linear programs of 12 to 60 variables, all of whose sides are of one size: the
    methods that exact arithmetic and reflections follow are not needed."""
    for seed, (k, m) in enumerate(((12, 8), (30, 15), (60, 30))):
        random = np.random.default_rng(seed)
        A = random.standard_normal((m, k))
        if is_sparse:
            A *= random.random((m, k)) < 0.3
        x = random.random(k) * (random.random(k) < 0.5)
        y = random.random(m) * (random.random(m) < 0.5)
        below = np.where(y > 0, 0, random.random(m))
        c = A.T @ y + np.where(x > 0, 0, random.random(k))
        sides = {"row_lower": (A @ x - below) * size, "upper": np.full(k, 3 * size)}
        result = run(from_qp(np.zeros((k, k)), c, A, **sides))
        assert result.solved
        assert result.answer.objective == pytest.approx(c @ x * size, rel=1e-9)
        assert not {"exact", "reflections", "milp"} & set(result.route)


def test_an_lcp_in_other_units_is_solved_by_the_same_steps():
    random = np.random.default_rng(1)
    M = random.standard_normal((12, 12))
    M, q = M @ M.T + np.eye(12), random.standard_normal(12)
    first = run(Problem(M, q))
    for power in (-300, -60, 60, 300):
        other = run(Problem(M, q * 2.0**power))
        assert other.iterations == first.iterations
        assert np.array_equal(other.z, first.z * 2.0**power)


def test_iterates_are_shown_in_the_units_of_the_data():
    program = in_units(random_program(3, 12), np.zeros(12), np.zeros(6), 60.0, -70.0)
    problem = problem_of(program)
    assert not in_usual_units(problem).is_identity
    traced = run(problem, trace=True)
    assert traced.solved
    assert np.array_equal(traced.z, run(problem).z)
    last = traced.trace.rows[-1]
    np.testing.assert_allclose(last.z, traced.z, rtol=1e-12)
    assert last.residual <= 1e-12 * np.abs(problem.q).max()


def test_a_start_is_one_in_the_units_of_the_data():
    problem = problem_of(
        in_units(random_program(5, 12), np.zeros(12), np.zeros(6), 50.0, -60.0)
    )
    solved = run(problem)
    again = run(problem, z0=solved.z)
    assert again.solved
    assert again.iterations <= 1
    from_basis = run(problem, basis=solved.basis)
    assert np.array_equal(from_basis.answer.x, solved.answer.x)


def test_bounds_as_large_as_all_other_sides_are_not_taken_for_infinite_ones():
    c, A = np.ones(3), np.array([[1.0, 2.0, 1.0]])
    sides = {"row_lower": [1e14], "upper": np.full(3, 2e14)}
    assert not remark(from_qp(np.zeros((3, 3)), c, A, **sides))
    far = {"row_lower": [1.0], "upper": np.full(3, 2e14)}
    assert "--infinity" in remark(from_qp(np.zeros((3, 3)), c, A, **far))
