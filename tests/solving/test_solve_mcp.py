"""Nonlinear complementarity problems: what is claimed, and what F and J may be. Claims
rest on terms that differences of F show: nothing is claimed because of Jacobians that
are wrong, and what is wrong is told; noise of F is told, and matched by the steps.
"""

import math
import pickle
from importlib.util import find_spec

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng
from scipy.sparse import (
    csr_array,
    diags_array,
)

import lcpcli
from lcpcli import Problem, run
from lcpcli.errors import OptionError
from lcpcli.methods import josephy_newton
from lcpcli.model.box import BASIC
from lcpcli.model.evaluations import Evaluations
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.solving.result import Status
from lcpcli.solving.solve_mcp import run_nonlinear, solution_of_linearization
from lcpcli.verify.nonlinear_point import NonlinearCriterion

from .. import literature
from ..nonlinear_problems import KINDS, MONOTONE, natural_residual, planted

FREE = -math.inf
SOLVED_FROM_THEIR_STARTS = [
    literature.kojima_shindo(),
    literature.josephy(),
    literature.mathiesen(),
    literature.nash_cournot(5),
    literature.nash_cournot(10),
    literature.scarf(),
    literature.bratu(20),
    literature.elastohydrodynamic(40),
]


def solved(problem, **options):
    """The result of a run that has solved the problem, by the definition of a
    solution."""
    result = run_nonlinear(problem, **options)
    assert result.solved
    assert natural_residual(problem, result.z) <= 1e-8
    return result


@pytest.mark.parametrize(
    "problem", SOLVED_FROM_THEIR_STARTS, ids=lambda problem: problem.name
)
def test_problems_of_the_literature_are_solved_from_their_starts(problem):
    result = solved(problem)
    assert result.error is None or result.error <= 1e-8
    assert np.array_equal(result.w, problem.values(result.z))


def test_a_stationary_point_of_the_merit_function_proves_nothing():
    result = run_nonlinear(literature.billups(), restarts=0)
    assert result.status is lcpcli.Status.STALLED
    assert (
        result.message
        == "stalled: z is almost a stationary point of the merit function, but no "
        "solution"
    )
    assert result.certificate is None
    assert run_nonlinear(literature.billups()).solved  # from another start


@pytest.mark.parametrize("kind", KINDS)
def test_random_problems_are_solved_or_said_not_to_be(kind):
    solved = 0
    for seed in range(1, 7 if kind in MONOTONE else 3):
        problem = planted(kind, seed)
        result = run_nonlinear(problem, restarts=0)
        solved += result.solved
        claim = natural_residual(problem, result.z) <= 1e-8 * (
            1 + float(np.abs(result.z).max())
        )
        assert claim or not result.solved
        assert (problem.lower <= result.z).all()
        assert (result.z <= problem.upper).all()
    assert solved >= (6 if kind in MONOTONE else 2)


@pytest.mark.parametrize(
    ("F", "lower", "x0"),
    [
        (lambda z: np.exp(-z), None, [300.0]),
        (lambda z: [z[0] - z[1] - 1, z[1] - z[0] - 1], 0, [1.0, 1.0]),
    ],
    ids=["only tends to zero", "runs off"],
)
def test_what_has_no_solution_is_not_solved(F, lower, x0):
    assert not lcpcli.solve_mcp(F, lower=lower, x0=x0, restarts=0).solved


def test_steps_are_cut_back_to_the_domain_and_the_message_names_the_row():
    def F(z):
        return [math.log(z[0]) + 2 - z[1], z[1] - 1 + math.sqrt(z[0])]

    assert lcpcli.solve_mcp(F, lower=None, x0=[20.0, 5.0]).solved
    undefined = lcpcli.solve_mcp(
        lambda z: np.sqrt(z) + 1, lower=None, x0=[1.0], names=["p"], restarts=0
    )
    assert not undefined.solved
    assert "undefined, in row p" in undefined.message


def test_roots_of_negative_numbers_in_python_count_as_undefined():
    problem = NonlinearProblem(
        lambda z: [float(z[0]) ** 0.5, 1 / float(z[1])], lower=None, x0=[1.0, 1.0]
    )
    assert problem.values(np.array([-1.0, 1.0])).tolist()[1] == 1.0
    assert np.isnan(problem.values(np.array([-1.0, 1.0]))[0])
    assert np.isnan(problem.values(np.array([1.0, 0.0]))).all()


def test_jacobians_by_differences_dense_and_sparse_are_those_given():
    given = literature.bratu(11)
    J = given.jacobian(given.x0).toarray()
    pattern = csr_array(J != 0)
    for chosen in (None, pattern):
        evaluations = Evaluations(
            NonlinearProblem(given.F, lower=given.lower, upper=given.upper), chosen
        )
        found = evaluations.jacobian(given.x0)
        assert np.abs(found.toarray() - J).max() <= 1e-6
        assert evaluations.functions < 20 + (chosen is None) * (2 * given.n + 1)


def test_jax_computes_in_doubles_or_it_is_said_how_to_install_it():
    def F(z):
        import jax.numpy as jnp

        return jnp.exp(z) - jnp.array([2.0, 0.5, 3.0]) * (1 + z[::-1])

    if find_spec("jax") is None:
        with pytest.raises(OptionError, match="jax: needs jax; pip install"):
            lcpcli.solve_mcp(F, x0=np.zeros(3), jax=True)
    else:
        result = lcpcli.solve_mcp(F, x0=np.zeros(3), jax=True)
        assert result.solved
        assert result.residual <= 1e-12


def test_derivatives_are_those_of_the_nonlinear_problem():
    result = lcpcli.solve_mcp(lambda z: z**2 - 4, x0=[1.0])
    assert result.derivative(dq=[-1.0]).z == pytest.approx([0.25])


def test_traces_name_the_steps_and_callbacks_end_the_run():
    problem = literature.kojima_shindo()
    result = run_nonlinear(problem, trace=True)
    steps = {row.step for row in result.trace.rows}
    assert "full" in steps
    assert result.trace.rows[-1].residual == result.residual
    assert (
        run_nonlinear(problem, callback=lambda row: row.k == 2).status
        is lcpcli.Status.INTERRUPTED
    )
    limited = lcpcli.solve_mcp(problem.F, problem.J, x0=problem.x0, max_iterations=1)
    assert limited.status is lcpcli.Status.ITERATION_LIMIT


def test_results_can_be_pickled_although_F_cannot():
    result = run_nonlinear(literature.josephy(), trace=True)
    copy = pickle.loads(pickle.dumps(result))
    assert np.array_equal(copy.z, result.z)
    assert np.array_equal(copy.w, result.w)
    assert copy.residual == result.residual
    assert (
        copy.derivative(dq=np.ones(4)).z.tolist()
        == result.derivative(dq=np.ones(4)).z.tolist()
    )


def test_errors_of_F_itself_are_not_hidden():
    def F(z):
        # Shapes that do not fit: a ValueError, but no domain.
        return z @ np.ones((3, 3))

    with pytest.raises(ValueError, match="matmul"):
        lcpcli.solve_mcp(F, x0=[1.0, 2.0])


@pytest.mark.parametrize("seed", [2, 3])
def test_linearizations_without_a_solution_are_perturbed(seed):
    result = solved(planted("nonmonotone", seed), restarts=0, trace=True)
    assert "proximal" in {row.step for row in result.trace.rows}


@pytest.mark.parametrize("share", [1.0, 1e-3])
def test_the_active_step_solves_equations_with_a_singular_jacobian(share):
    def F(z):
        return np.array([np.exp(z[0] + z[1]) - 1, share * (z[0] + z[1]), z[2] - 1])

    problem = NonlinearProblem(F, lower=[FREE, FREE, 0.0], x0=[1e-3, 1e-3, 1.0])
    assert natural_residual(problem, solved(problem).z) <= 1e-10


def test_functions_are_never_called_outside_of_the_bounds():
    """Where steps of differences are longer than the distances of both bounds."""
    seen = []

    def F(z):
        seen.append(z.copy())
        return np.sqrt(z) - 1e-6 * np.array([1.0, 2.0])

    result = lcpcli.solve_mcp(F, lower=0.0, upper=1e-11, x0=[1e-12, 9.9e-12])
    assert result.solved
    np.testing.assert_allclose(result.z, [1e-12, 4e-12], rtol=1e-6)
    assert np.min(seen) == 0.0
    assert np.max(seen) <= 1e-11


def test_differences_step_towards_the_farther_of_two_close_bounds():
    problem = NonlinearProblem(lambda z: 3 * z, lower=0.0, upper=1e-11, x0=[0, 1e-11])
    J = Evaluations(problem).jacobian(problem.x0)
    np.testing.assert_allclose(J, 3 * np.eye(2))


def test_differences_of_a_sparse_jacobian_are_by_the_step_of_each_component():
    """Components of very different sizes are moved at a time."""
    sizes = np.where(np.arange(120) % 4 < 2, 1e6, 1e-1)

    def F(z):
        return z**2 / sizes - sizes + 0.1 * np.roll(z, 1) / np.roll(sizes, 1)

    J = Evaluations(NonlinearProblem(F, x0=3 * sizes)).jacobian(3 * sizes)
    np.testing.assert_allclose(J.diagonal(), 6.0, rtol=1e-5)


def test_a_pattern_may_repeat_an_entry():
    repeated = csr_array((np.ones(3), [0, 0, 1], [0, 2, 3]))
    problem = NonlinearProblem(lambda z: 3 * z - 1, x0=np.ones(2))
    J = Evaluations(problem, repeated).jacobian(problem.x0)
    assert J.toarray() == pytest.approx(3 * np.eye(2))


def test_a_run_that_gets_stuck_is_given_up_unless_restarts_are_asked_for(monkeypatch):
    monkeypatch.setattr(josephy_newton, "MAX_LINEARIZATIONS", 20)
    n, random = 10, default_rng(0)
    M, q = random.standard_normal((n, n)) / n**0.5, random.standard_normal(n)

    def F(z):
        return np.append(-1 - z @ z / n, (M @ z + q + np.sin(z))[1:])

    def J(z):
        return np.vstack([-2 * z / n, (M + np.diag(np.cos(z)))[1:]])

    x0 = random.random(n)
    brief = lcpcli.solve_mcp(F, J, x0=x0)
    long = lcpcli.solve_mcp(F, J, x0=x0, restarts=0)
    stopped = ["work limit" in result.message for result in (brief, long)]
    assert stopped == [True, False]


def test_another_attempt_is_made_where_the_first_one_is_stuck_and_shown():
    result = lcpcli.solve_mcp(
        lambda z: z**2 + 1, lower=None, x0=[3.0], restarts=1, trace=True
    )
    assert not result.solved
    steps = [row.step for row in result.trace.rows]
    assert steps.count("restart") == 1
    assert steps[steps.index("restart") + 1] == "smoothed"
    assert result.residual == min(row.residual for row in result.trace.rows)


def F(z):
    return np.array([z[0] ** 2 + z[1] - 2, z[0] + z[1] ** 3 - 3])


def J(z):
    return np.array([[2 * z[0], 1.0], [1.0, 3 * z[1] ** 2]])


def jump(z):
    """1e-3 short of 0 below 5, and 1 from there on."""
    return np.where(z < 5, 1e-3 * (z - 6), z - 4)


def test_differences_over_a_jump_or_over_far_more_than_z_make_no_solution():
    assert not lcpcli.solve_mcp(jump, x0=[4], restarts=0).solved
    tiny = lcpcli.solve_mcp(lambda z: (z / 1e-20) ** 2 - 3, x0=[1e-20], restarts=0)
    assert not tiny.solved or abs(tiny.z[0] / 1e-20 - 3**0.5) < 1e-8


def test_stalls_do_not_blame_a_right_jacobian():
    result = lcpcli.solve_mcp(
        lambda z: 1 + z**2,
        lambda z: np.diag(2 * z),
        lower=None,
        x0=[0.5, 3.0],
        restarts=0,
    )
    assert not result.solved
    assert "J[" not in result.message
    assert "another J" not in result.advice


def test_double_zeros_are_reached_faster_than_by_halving_the_error():
    result = lcpcli.solve_mcp(
        lambda z: (z - 1) ** 2 * (z + 5),
        lambda z: np.diag((z - 1) * (3 * z + 9)),
        lower=None,
        x0=[9.0, 7.0],
    )
    assert result.solved
    assert result.iterations <= 12


MULTIPLE = np.array([[2.0, 1.0], [-1.0, 3.0]])


@pytest.mark.parametrize(
    ("F", "J", "z0"),
    [
        (lambda z: (z - 1) ** 3, None, [5.0]),
        (lambda z: (z - 1) ** 5, lambda z: np.diag(5 * (z - 1) ** 4), [5.0, 2.0]),
        (
            lambda z: (MULTIPLE @ (z - 1)) ** 3,
            lambda z: 3 * ((MULTIPLE @ (z - 1)) ** 2)[:, np.newaxis] * MULTIPLE,
            [100.0, 20.0],
        ),
    ],
)
def test_multiple_zeros_are_solved_without_another_start(F, J, z0):
    """The residual is far below 1e-12 before z has ten digits."""
    result = lcpcli.solve_mcp(F, J, z0=z0, restarts=0)
    assert result.solved
    assert np.abs(result.z - 1).max() <= 1e-3


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_derivatives_that_are_not_finite_are_the_reason_of_a_stall(value):
    result = lcpcli.solve_mcp(
        lambda z: z**2 - 2, lambda _: np.full((2, 2), value), lower=0, z0=[1.0, 1.0]
    )
    assert not result.solved
    assert "the derivatives of F are not finite at z" in result.message
    assert "stationary" not in result.message


def test_differences_where_F_is_infinite_are_undefined_and_no_breakdown():
    unit = 1e-10  # far less than the steps of differences
    result = lcpcli.solve_mcp(
        lambda z: np.log(z / unit) + np.array([0.0, 1.0]),
        x0=[unit, unit],
        restarts=0,
    )
    assert result.status is not Status.BREAKDOWN
    J = Evaluations(NonlinearProblem(np.log, x0=[0, 1])).jacobian(np.array([0.0, 1.0]))
    assert not np.isfinite(J[0, 0])
    assert J[1, 1] == pytest.approx(1)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda z: J(z) * [[1, 100], [1, 1]], "J[0, 1] is 100 there, but by diff"),
        (lambda _: np.full((2, 2), np.nan), "J[0, 0] is nan there, but by diff"),
        (lambda z: 1j * J(z), "is nan there, but by differences of F "),
        (lambda z: csr_array(1e30 * J(z)), "J[0, 0] is "),
    ],
)
def test_a_wrong_jacobian_makes_no_solution_and_is_named(wrong, words):
    result = lcpcli.solve_mcp(F, wrong, x0=[5, 5], restarts=0)
    assert result.status is Status.STALLED
    assert words in result.message
    assert "another J" in result.advice
    assert result.relative_residual > result.tol


def test_a_wrong_jacobian_makes_no_solution_of_small_numbers_where_there_is_none():
    result = lcpcli.solve_mcp(
        lambda z: 1e-7 * (1 + z**2), lambda _: [[1e5]], x0=[1.0], lower=None, restarts=0
    )
    assert not result.solved
    assert "J[0, 0] is " in result.message


@settings(max_examples=6)
@given(
    st.integers(-12, 12), st.integers(-12, 12), st.sampled_from([1e-8, 1e-3, 1e3, 1e8])
)
def test_no_claim_hangs_on_a_factor_of_the_jacobian(unit, scale, factor):
    u, s = 10.0**unit, 10.0**scale

    def F(z):
        return np.asarray(u * ((z / s) ** 3 + z / s - 10))

    def J(z):
        return np.asarray([[factor * u * (3 * (z[0] / s) ** 2 + 1) / s]])

    result = lcpcli.solve_mcp(F, J, x0=[s], restarts=0, max_iterations=50)
    assert not result.solved or abs(result.z[0] / s - 2) < 1e-9


@pytest.mark.parametrize(("F", "x0", "z"), [
    (lambda z: np.exp(z / 1e-10) - 5, 2e-10, 1e-10 * np.log(5)),
    (lambda z: (z / 1e-12) ** 4 - 16, 3e-12, 2e-12),
    (lambda z: np.log(z / 1e8) - 2.5, 1e8, 1e8 * np.exp(2.5)),
    (lambda z: 1e-50 * (z - 1), 1.5, 1),
])  # fmt: skip
def test_unknowns_may_be_of_any_size_and_far_larger_than_values(F, x0, z):
    result = lcpcli.solve_mcp(F, x0=[x0])
    assert result.solved
    assert result.z[0] == pytest.approx(z, rel=1e-9)


@pytest.mark.parametrize("level", [1e-9, 1e-5])
def test_noise_is_told_and_solved_up_to_it_with_few_evaluations(level):
    calls, random = [0], default_rng(1)

    def F(z):
        calls[0] += 1
        return np.asarray(z**3 + z - [2, 10] + level * random.uniform(-1, 1, 2))

    result = lcpcli.solve_mcp(F, x0=[2.0, 3.0], tol=100 * level)
    assert result.solved
    assert "F is noisy at about " in result.message
    assert np.abs(result.z - [1, 2]).max() < 10 * level
    assert calls[0] <= 300
    calls[0] = 0
    assert not lcpcli.solve_mcp(F, x0=[2.0, 3.0], tol=1e-14).solved
    assert calls[0] <= 600


def test_noise_that_no_difference_shows_is_told_where_the_tolerance_is_loose():
    """By bisection of [-1, 2 + z] to 1e-6, F has slopes that are not those of its
    limit, and jumps."""

    def F(z):
        low, high = -np.ones(2), 2 + z
        while (high - low).max() > 2e-6:
            y = (low + high) / 2
            low, high = np.where(y**3 + y > z, low, y), np.where(y**3 + y > z, y, high)
        return (low + high) / 2 - [0.5, 0.8]

    result = lcpcli.solve_mcp(F, x0=[2.0, 3.0], tol=1e-4)
    assert result.solved
    assert "F is noisy at about " in result.message


@pytest.mark.parametrize(("lower", "is_told"), [(2.0, False), (0.0, True)])
def test_a_kink_is_told_between_bounds_but_not_at_a_bound(lower, is_told):
    slope = lambda z: np.diag(np.where(z > 2, 1.0, 0.0))  # noqa: E731
    problem = NonlinearProblem(
        lambda z: np.maximum(z - 2, 0) - 1e-9, slope, x0=[2.0], lower=lower
    )
    assert (
        "F has a kink there, in row 1" in str(lcpcli.check(problem, [2.0]))
    ) == is_told


@pytest.mark.parametrize(("shift", "scale"), [(3e6, 1.0), (1e7, 100.0)])
def test_oscillation_that_finer_differences_resolve_is_no_noise(shift, scale):
    A = np.array([[0.8, 0.6], [-0.5, 0.4]])

    def F(z):
        return scale * (A @ (z - shift) + 2 * np.sin(z - shift) - 1)

    result = lcpcli.solve_mcp(F, x0=shift + np.array([1.4, 2.6]))
    assert result.solved
    assert "noisy" not in result.message
    assert np.abs(F(result.z)).max() <= 1e-6 * scale


def test_a_given_step_is_taken():
    seen = []

    def F(z):
        seen.append(float(z[0]))
        return z**2 - 4

    assert lcpcli.solve_mcp(F, z0=[3.0], difference_step=1e-3).solved
    assert min(abs(each - 3.003) for each in seen) < 1e-12


def test_z0_is_the_start_also_of_a_problem():
    problem = NonlinearProblem(lambda z: z**2 - 4, lower=None, x0=[1.0])
    assert lcpcli.solve_mcp(problem, z0=[-1.0]).z[0] == pytest.approx(-2)
    assert lcpcli.solve_mcp(problem.F, lower=None, z0=[-1.0]).z[0] == pytest.approx(-2)


def test_names_say_how_many_unknowns_there_are():
    result = lcpcli.solve_mcp(lambda z: z - [1.0, 2.0], names={"a": 1, "b": 2}.keys())
    assert result.z.tolist() == [1.0, 2.0]
    assert tuple(result.problem.names) == ("a", "b")


@pytest.mark.parametrize("is_compiled", [False, True])
@pytest.mark.parametrize(("n", "upper"), [(40, 1e15), (400, 1.0)])
def test_a_linearization_has_its_step_with_kernels_and_without(n, upper, is_compiled):
    """Also one beyond what the kernels take."""
    if is_compiled:
        pytest.importorskip("numba")
    M = diags_array([-1.0, 3.0, -1.0], offsets=[-1, 0, 1], shape=(n, n)).tocsr()
    box, basis = Problem(M, np.zeros(n), upper=upper).box, np.full(n, BASIC, np.int8)
    evaluations = Evaluations(NonlinearProblem(lambda z: z, x0=np.zeros(n)))
    found = solution_of_linearization(
        M, np.full(n, -1.0), box, basis, False, evaluations, is_compiled
    )
    assert run(Problem(M, np.full(n, -1.0), upper=upper)).z == pytest.approx(found[0])


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_equations_take_one_step_in_any_unit_also_if_one_follows_from_others(scale):
    random = default_rng(0)
    A = scale * random.standard_normal((60, 60))
    A[-1] = A[:-1].sum(axis=0)
    b = A @ random.random(60)
    result = lcpcli.solve_mcp(
        lambda z: A @ z - b, lambda _: A, lower=None, x0=np.zeros(60)
    )
    assert result.solved
    assert result.iterations == 1


@pytest.mark.parametrize(
    ("second", "measured"),
    [(0.0, [[1.0, 0.0]]), (1e-25, [[1.0, 0.0], [1.0, 1e-25]])],
)
def test_rounding_of_zeros_is_removed_first_but_not_what_a_row_determines(
    second, measured
):
    points = list[list[float]]()

    def J(z):
        points.append(z.tolist())
        return np.eye(2)

    start, z = [3.0, 3.0], np.array([1.0, 1e-25])
    problem = NonlinearProblem(lambda z: z - [1.0, second], J, lower=-np.inf, x0=start)
    point = NonlinearCriterion(Evaluations(problem), 1e-10).point(z)
    assert point.solves()
    assert point.z.tolist() == measured[-1]
    assert points == [start, *measured]


@pytest.mark.parametrize(
    ("power", "form"), [(1, csr_array), (1, np.array), (2, np.array)]
)
def test_linearizations_of_an_affine_F_share_what_is_known_of_their_matrix(power, form):
    M, q = np.array([[2.0, 1], [0, 3]]), np.array([-3.0, -6])

    def J(z):
        return form(M + np.diag(power * z ** (power - 1)))

    problem = NonlinearProblem(lambda z: M @ z + q + z**power, J, names=["a", "b"])
    criterion = NonlinearCriterion(Evaluations(problem), 1e-10)
    z = np.array([0.5, 2])
    linear = criterion.linearization(z, problem.values(z))
    assert (linear.facts is criterion.problem.facts) == (power == 1)
    assert np.allclose(linear.w(z), problem.values(z), rtol=1e-14)
    assert list(linear.names) == ["a", "b"]
