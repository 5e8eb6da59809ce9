"""The ways back from presolve keep the signs of rows and both bounds."""

from __future__ import annotations

import numpy as np

from lcpcli import Problem
from lcpcli.model.presolve import Presolved, Refuted, presolved
from lcpcli.verify.certificate import proves_infeasible


def test_a_proof_is_of_the_rows_as_they_were_where_presolve_has_turned_one() -> None:
    """z1 + z2 + 1 = 0 for a free z1 with z1 >= 0 as a row: the sign of the equation is turned before it is refuted."""
    problem = Problem([[1, 1], [1, 0]], [1, 0], lower=[-np.inf, 0], upper=[np.inf, np.inf])
    found = presolved(problem)
    assert isinstance(found, Refuted)
    assert found.y.tolist() == [-1, 1]
    assert proves_infeasible(problem, found.y)


def test_a_row_of_its_own_variable_is_solved_within_both_bounds() -> None:
    problem = Problem([[1, 0], [1, 1]], [-5, -4], lower=[0, 0], upper=[2, 9])
    change = presolved(problem, ("rows of their own variable",))
    assert isinstance(change, Presolved)
    nothing = np.zeros(change.problem.n)
    z = problem.box.z_of(change.back(change.problem.box.x_of(nothing, nothing)))
    assert z.tolist() == [2, 2]
