"""Changes of variables, one after another, and the way back in reverse."""

from __future__ import annotations

import numpy as np

from lcpcli.linalg.doubles import in_range
from lcpcli.model.changes import composed, scale, shifted
from lcpcli.model.far_bounds import relaxed
from lcpcli.model.problem import Problem
from lcpcli.verify.certificate import proves_infeasible

INF = np.inf


def test_changes_are_made_in_turn_and_undone_in_reverse() -> None:
    """Numbers that doubles have exactly: nothing is rounded on either way."""
    problem = Problem([[256.0, 1], [-1, 64]], [3.0, -5], lower=[-4, 2], upper=[INF, 8])
    change = composed(problem, shifted, scale)
    first, second = change.changes
    assert second.original is first.problem
    assert change.problem is second.problem
    assert not change.is_identity
    x = np.array([-3.0, 3.5])
    assert np.array_equal(change.start(x), second.start(first.start(x)))
    assert np.array_equal(change.back(change.start(x)), x)
    F = np.array([0.25, -3.0])
    assert np.array_equal(change.residual(second.problem.q), first.residual(first.problem.q))
    assert np.array_equal(change.residual(F), first.residual(second.residual(F)))
    assert change.is_exact


def test_a_change_that_loses_a_bound_makes_the_whole_inexact() -> None:
    problem = Problem([[2.0, 1], [1, 2]], [-5, -6], lower=-1, upper=1e30)
    assert shifted(relaxed(problem).problem).is_exact
    assert not composed(problem, relaxed, shifted).is_exact


def test_a_proof_comes_out_of_several_changes() -> None:
    """w_1 = -2^40 z_1 - 2^-30 is negative for z >= 0, and z_2 has a lower bound of 1."""
    problem = Problem([[-(2.0**40), 0], [0, 1]], [-(2.0**-30), 1], lower=[0, 1], upper=INF)
    change = composed(problem, shifted, scale)
    y = np.array([1.0, 0])
    assert proves_infeasible(change.problem, y)
    assert proves_infeasible(problem, change.multipliers(y))


def test_no_entry_of_a_proof_is_lost_by_its_power_of_two() -> None:
    y = np.array([2.0**-1000, 0, -3.0 * 2.0**20])
    assert in_range(y[1:]).tolist() == [0, -1.5]
    assert np.array_equal(np.ldexp(in_range(y), -489), y)
    R = np.array([2.0**-70, 1, 2.0**1000])
    assert in_range(y[1:], R[1:]).tolist() == [0, -1.5]
    assert np.array_equal(in_range(np.array([3.0, 5]), np.array([0.3, 0.7])), np.array([3 * 0.3, 5 * 0.7]) / 2)
    assert not in_range(np.zeros(2)).any()
