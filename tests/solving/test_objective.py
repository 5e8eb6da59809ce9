"""How far the objective of a solved program may be from its minimum."""

from functools import cache
from math import comb

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import lcpcli
from lcpcli import Status, from_qp
from lcpcli.report import outcome
from lcpcli.verify.objective import NEGLIGIBLE, objective_error, statement

pytest.importorskip("piqp")


@cache
def smoothed(n, kind):
    """The nearest values to given ones with third differences that are not negative,
    whose multipliers are 1e11, as in LISWET1 to LISWET12 of I. Maros and C. Mészáros,
    A repository of convex quadratic programming problems (1999)."""
    t, order = np.arange(n + 3) / (n + 2), 3
    c = [1 / (0.1 + 0.9 * t), np.exp(t)][kind] + 0.1 * np.sin(np.arange(1, n + 4))
    rows = [(-1.0) ** j * comb(order, j) * np.ones(n) for j in range(order + 1)]
    A = sp.diags_array(rows, offsets=range(order, -1, -1), shape=(n, n + order))
    Q, constant = sp.eye_array(n + order).tocsr(), float(c @ c) / 2
    bounds = {"row_lower": np.zeros(n), "lower": -np.inf, "constant": constant}
    return from_qp(Q, -c, A.tocsr(), **bounds)


def test_a_large_error_of_the_objective_is_told_and_may_be_refused():
    problem = smoothed(1000, 0)
    result = lcpcli.run(problem, "interior")
    assert result.solved
    assert result.relative_residual < 1e-10
    assert 1e-6 < result.objective_error < 1e-2
    assert "objective known to 3 digits" in outcome.verdict(result)
    assert result.to_dict()["objective_error"] == result.objective_error
    refused = lcpcli.run(problem, "interior", gap=1e-6)
    assert refused.status is Status.STALLED
    assert "objective known to 3 digits, and gap = 1e-06" in refused.message
    assert refused.objective_error is None


def test_auto_goes_on_until_the_objective_is_known():
    trace = lcpcli.Trace()
    result = lcpcli.run(smoothed(1000, 0), gap=1e-6, trace=trace)
    assert result.solved
    assert result.objective_error < 1e-6
    assert abs(result.answer.objective - 144.5370163) < 1e-6
    last = result.trace.rows[-1]
    assert last.k == result.iterations
    assert (last.z == result.z).all()
    assert result.verified is not False


def test_problems_without_an_objective_have_no_error_of_it():
    result = lcpcli.solve([[2, 1], [1, 2]], [-5, -6])
    assert result.objective_error is None
    assert lcpcli.solve([[2, 1], [1, 2]], [-5, -6], gap=1e-15).solved


@settings(max_examples=30)
@given(seed=st.integers(0, 2**32 - 1), size=st.integers(-9, -2))
def test_the_error_bounds_that_of_a_feasible_point(seed, size):
    """min x'Qx / 2 + c'x, x >= 0, A x >= b, with x >= x* near the minimizer x*: both
    are feasible, as A >= 0, and y* is."""
    generator = np.random.default_rng(seed)
    n, m = int(generator.integers(1, 8)), int(generator.integers(1, 6))
    A, B = generator.uniform(0, 1, (m, n)), generator.standard_normal((n, n))
    x = np.where(generator.random(n) < 0.5, generator.uniform(0, 2, n), 0.0)
    y = np.where(generator.random(m) < 0.5, generator.uniform(0, 2, m), 0.0)
    Q, bounds = B @ B.T, np.where(x > 0, 0.0, generator.uniform(0, 1, n))
    c = A.T @ y + bounds - Q @ x
    b = A @ x - np.where(y > 0, 0.0, generator.uniform(0, 1, m))
    problem = from_qp(Q, c, A, row_lower=b)
    least = x @ Q @ x / 2 + c @ x
    other = x + 10.0**size * generator.uniform(0, 1, n)
    excess = other @ Q @ other / 2 + c @ other - least
    z = np.concatenate((other, y))
    error = objective_error(problem, z, problem.w(z))
    whole = abs(other @ Q @ other / 2 + c @ other)
    # Its dual point is not feasible, by an error of the second order.
    curved = (other - x) @ Q @ (other - x)
    assert excess <= error * whole * (1 + 1e-9) + curved + 1e-12 * (1 + whole)


def test_digits_are_counted_down():
    assert statement(0.0) == statement(NEGLIGIBLE) == ""
    assert statement(3e-9) == "objective known to 8 digits"
    assert statement(3.5e-3) == "objective known to 2 digits"
    assert statement(0.2) == statement(np.inf) == "objective known to no digit"


def test_far_bounds_that_are_not_met_make_no_error():
    """Rounding of w = 0 times 1e20 would be an error of 1e4."""
    sides = {"row_upper": [1.0, 1e19], "upper": [1e20, 1e20, 1e20]}
    A = [[0.1, 0.2, 0.3], [0.7, 0.1, 0.9]]
    Q = [[2.1, 0.3, 0.1], [0.3, 1.7, 0.2], [0.1, 0.2, 1.3]]
    result = lcpcli.run(from_qp(Q, [-0.1, -3.3, -0.7], A, **sides))
    assert result.solved
    assert result.objective_error < 1e-14
