"""Stiff problems, whose M is positive definite but no M-matrix: beams, plates and
frames over obstacles are solved to the last digits with the states of the exact
solution, however large the condition number is; methods that are not made for them say
why they fail, and end early."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.sparse import csr_array, diags_array

import lcpcli
from lcpcli import Problem, Status, run
from lcpcli.gallery.families import make
from lcpcli.methods.definite import definite, stiffness

from .bands import basic_solution
from .stages import through

EPS = float(np.finfo(float).eps)
STRUCTURES = [
    ("beam", {"support": "hinged", "contrast": 1e8, "load": 20.0}),
    ("beam", {"support": "cantilever", "contrast": 1e4}),
    ("beam", {"support": "springs", "contrast": 1e6, "load": 100.0}),
    ("beam", {"mass": 1e6}),
    ("plate", {"support": "clamped", "contrast": 1e6, "load": 1e3}),
    ("frame", {"support": "clamped", "contrast": 1e8, "load": 30.0}),
]
BOTH = ("interior", "auto")


@pytest.mark.parametrize(("family", "parameters"), STRUCTURES)
def test_structures_are_solved_to_the_last_digits(family, parameters):
    problem = make(family, 121, **parameters)
    # Small plates need no factors in auto.
    methods = BOTH if family != "plate" else ["interior"]
    are_solved_to_the_last_digits(problem, methods)


def test_beams_with_convection_are_solved_to_the_last_digits():
    """With differences of first order, which are not symmetric, M is still positive
    definite."""
    beam = make("beam", 121, contrast=1e4, load=30.0)
    D = diags_array([1.0, -1.0], offsets=[1, -1], shape=(beam.n, beam.n))
    problem = Problem(csr_array(beam.M + 1e-3 * D), beam.q)
    are_solved_to_the_last_digits(problem, BOTH)


def test_beams_between_two_obstacles_are_solved_to_the_last_digits():
    below = make("beam", 121, contrast=1e6, load=10.0)
    problem = Problem(below.M, below.q, upper=np.full(below.n, 1e-3))
    are_solved_to_the_last_digits(problem, BOTH)


def are_solved_to_the_last_digits(problem, methods):
    """Or, by the quick methods for few unknowns, to what rounding of M and q leaves."""
    results = [run(problem, method) for method in methods]
    z, w = basic_solution(problem, results[0].z)
    lower, upper = problem.box.vectors(problem.n)
    for result in results:
        assert result.solved
        at_lower, at_upper = result.z == lower, result.z == upper
        assert 0 < (at_lower | at_upper).sum() < problem.n
        for i in range(problem.n):
            assert not at_lower[i] or w[i] > 0
            assert not at_upper[i] or w[i] < 0
            if not (at_lower[i] or at_upper[i]):
                assert w[i] == 0
                assert lower[i] < z[i] < upper[i]
        errors = [abs(float(_exact(a) - b)) for a, b in zip(result.z, z, strict=True)]
        is_accurate = result.route in (("interior",), ("piqp",))
        loss = 1.0 if is_accurate else stiffness(problem.M)
        assert max(errors) <= 4 * EPS * loss * float(max(map(abs, z)))


def _exact(value):
    return Fraction(float(value))


@pytest.mark.parametrize(
    "n", [4000, pytest.param(20_000, marks=pytest.mark.slow("a second"))]
)
def test_long_beams_are_solved_where_doubles_of_z_are_too_coarse(n):
    """At n = 20,000 the condition number is 5e15: M z + q of any z in doubles differs
    from that of the solution by more than w."""
    problem = make("beam", n)
    result = run(problem)
    assert result.solved
    assert result.route == ("interior",)
    # It touches two of the three humps, and is symmetric.
    assert np.count_nonzero(result.z == 0) == 2
    np.testing.assert_allclose(result.z, result.z[::-1], rtol=1e-12)


@pytest.mark.parametrize(
    ("method", "reason"),
    [
        ("fixed-point", "an iteration reduces the error by one part in 1e+04 at best"),
        ("shi", "a step along gradients reduces the error by one part in"),
        ("newton", "pivots on infeasibilities advance by a few unknowns or cycle"),
    ],
)
def test_methods_that_are_not_made_for_stiff_problems_say_why_they_fail(method, reason):
    result = run(make("beam", 250), method, max_iterations=300)
    assert result.status is Status.ITERATION_LIMIT
    assert "M is stiff: its condition number is about 1e+08" in result.message
    assert reason in result.message
    assert "interior is made for such M" in result.message


def test_a_published_method_ends_once_it_gains_nothing_on_a_stiff_problem():
    problem = make("beam", 1500)
    result = run(problem, "fixed-point")
    assert result.status is Status.STALLED
    assert "has not lost a digit in the last" in result.message
    # The user who sets another limit knows better.
    more = result.iterations + 1
    longer = run(problem, "fixed-point", max_iterations=more)
    assert longer.status == Status.ITERATION_LIMIT


def free_beam(n, random):
    """The matrix of a beam without any support, which moves freely: it is singular, and
    definite or not by its rounded entries."""
    ones, units = np.ones(n), diags_array(random.uniform(0.5, 2, n))
    B = diags_array([ones, -2 * ones, ones], offsets=[0, 1, 2], shape=(n - 2, n))
    return csr_array(units @ (B.T @ B) @ units), csr_array(B.T @ B)


def test_rounding_of_m_that_decides_whether_it_is_definite_is_said_to_do_so():
    rounded, whole = free_beam(120, np.random.default_rng(3))
    _, ending = through(definite(Problem(rounded, -np.ones(120))))
    assert "rounding of its entries" in ending.reason
    assert run(Problem(whole, -np.ones(120))).status is Status.INFEASIBLE


@pytest.mark.slow("six seconds")
def test_auto_ends_where_rounding_of_m_decides_whether_it_is_definite():
    """Other methods would only take time."""
    random = np.random.default_rng(3)
    rounded, _ = free_beam(1000, random)
    result = run(Problem(rounded, -random.random(1000)))
    assert result.status is Status.STALLED
    assert result.route == ("interior",)
    assert "rounding of its entries" in result.message


def test_inspect_says_how_stiff_a_problem_is_and_what_follows():
    problem = make("beam", 300)
    found = lcpcli.inspect(problem)
    D = 1 / np.sqrt(problem.M.diagonal())
    scaled = D[:, np.newaxis] * problem.M.toarray() * D
    assert found.stiffness == pytest.approx(np.linalg.cond(scaled), rel=0.5)
    (hint,) = [each for each in found.hints if "stiff" in each]
    assert "about 7 digits" in hint
    assert "interior, which auto uses, is made for such M" in hint
    assert lcpcli.inspect(make("obstacle", 400)).stiffness is None
