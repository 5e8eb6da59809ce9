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
from lcpcli.methods.definite import stiffness

from .bands import basic_solution

EPS = float(np.finfo(float).eps)
STRUCTURES = [
    ("beam", 150, {"support": "clamped"}),
    ("beam", 150, {"support": "hinged", "contrast": 1e8, "load": 20.0}),
    ("beam", 150, {"support": "cantilever", "contrast": 1e4}),
    ("beam", 150, {"support": "springs", "contrast": 1e6, "load": 100.0}),
    ("beam", 150, {"mass": 1e6}),
    ("plate", 121, {"support": "clamped", "contrast": 1e6, "load": 1e3}),
    ("plate", 121, {"support": "hinged", "load": 30.0}),
    ("frame", 150, {"support": "clamped", "contrast": 1e8, "load": 30.0}),
    ("frame", 150, {"support": "cantilever"}),
    ("frame", 150, {"support": "springs", "contrast": 1e4, "load": 10.0}),
]


def with_convection(problem):
    """The same with differences of first order, which are not symmetric, for which M is
    still positive definite."""
    n = problem.n
    D = diags_array([np.ones(n - 1), -np.ones(n - 1)], offsets=[1, -1])
    return Problem(csr_array(problem.M + 1e-3 * D), problem.q)


@pytest.mark.parametrize(("family", "n", "parameters"), STRUCTURES)
def test_structures_are_solved_to_the_last_digits(family, n, parameters):
    problem = make(family, n, **parameters)
    is_solved_to_the_last_digits(problem, "interior")
    if family != "plate":  # of which small ones need no factors
        is_solved_to_the_last_digits(problem, "auto")


@pytest.mark.parametrize("method", ["auto", "interior"])
def test_beams_with_convection_are_solved_to_the_last_digits(method):
    problem = with_convection(make("beam", 150, contrast=1e4, load=30.0))
    is_solved_to_the_last_digits(problem, method)


@pytest.mark.parametrize("method", ["auto", "interior"])
@pytest.mark.parametrize(("contrast", "load"), [(1.0, 0.5), (1e6, 10.0)])
def test_beams_between_two_obstacles_are_solved_to_the_last_digits(
    method, contrast, load
):
    below = make("beam", 150, contrast=contrast, load=load)
    upper = np.full(150, 1e-3)
    is_solved_to_the_last_digits(Problem(below.M, below.q, upper=upper), method)


def is_solved_to_the_last_digits(problem, method):
    """Or, by the quick methods for few unknowns, to what rounding of M and q leaves."""
    result = run(problem, method)
    assert result.solved
    z, w = basic_solution(problem, result.z)
    lower, upper = problem.box.vectors(problem.n)
    at_lower, at_upper = result.z == lower, result.z == upper
    assert 0 < (at_lower | at_upper).sum() < problem.n
    for i in range(problem.n):
        assert not at_lower[i] or w[i] > 0
        assert not at_upper[i] or w[i] < 0
        if not (at_lower[i] or at_upper[i]):
            assert w[i] == 0
            assert lower[i] < z[i] < upper[i]
    errors = [abs(float(a - b)) for a, b in zip(map(_exact, result.z), z, strict=True)]
    loss = 1.0 if result.route in (("interior",), ("piqp",)) else stiffness(problem.M)
    assert max(errors) <= 4 * EPS * loss * float(max(map(abs, z)))


def _exact(value):
    return Fraction(float(value))


@pytest.mark.parametrize("n", [4000, 20_000])
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
    problem = make("beam", 1000)
    result = run(problem, "fixed-point")
    assert result.status is Status.STALLED
    assert result.iterations < 10_000
    assert "has not lost a digit in the last" in result.message
    # The user who sets another limit knows better.
    longer = run(problem, "fixed-point", max_iterations=9000)
    assert longer.status == Status.ITERATION_LIMIT
    assert longer.iterations == 9000


def test_other_problems_are_not_called_stiff():
    result = run(make("obstacle", 400), "fixed-point", max_iterations=2)
    assert result.status is Status.ITERATION_LIMIT
    assert "stiff" not in result.message


def test_auto_ends_where_rounding_of_m_decides_whether_it_is_definite():
    """A beam without any support moves freely: M is singular, and definite or not by
    its rounded entries. Other methods would only take time."""
    n = 1000
    ones, random = np.ones(n), np.random.default_rng(3)
    B = diags_array([ones, -2 * ones, ones], offsets=[0, 1, 2], shape=(n - 2, n))
    units = diags_array(random.uniform(0.5, 2, n))
    M = csr_array(units @ (B.T @ B) @ units)
    result = run(Problem(M, -random.random(n)))
    assert result.status is Status.STALLED
    assert result.route == ("interior",)
    assert "rounding of its entries" in result.message
    # Without rounding there is a proof.
    proved = run(Problem(csr_array(B.T @ B), -random.random(n)))
    assert proved.status is Status.INFEASIBLE


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
