"""Corners of paths: starts among several solutions, missing breakpoints, and proofs at an end."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem
from lcpcli.parametric.family import Family
from lcpcli.parametric.sparse_system import SparseSystem
from lcpcli.parametric.start import basic_states
from lcpcli.parametric.verified import verify


@pytest.mark.parametrize(("z", "states"), [([0.25, 0.75], [-1, 0]), ([0.75, 0.25], [0, -1])])
def test_of_a_segment_of_solutions_the_nearer_end_is_the_start(z: list[float], states: list[int]) -> None:
    problem = Problem([[1, 1], [1, 1]], [-1, -1])
    assert basic_states(problem, np.array(z), np.zeros(2), np.zeros(2, bool)).tolist() == states


def test_a_path_without_one_of_its_breakpoints_is_not_verified() -> None:
    family = Family(Problem([[2]], [-1]), Problem([[2]], [1]))
    states = np.zeros((1, 1), np.int8)  # basic throughout, although w is 1 at the end: the breakpoint at 1/2 is missing
    found = verify(family, np.array([0.0, 1.0]), np.array([[0.5], [0.0]]), states, 1e-10)
    assert not found.is_verified


def test_exchanges_of_a_sparse_system_are_undone_in_the_opposite_order() -> None:
    M = np.array([[4.0, 1, 2], [1, 5, 1], [3, 1, 6]])
    system = SparseSystem(csr_array(M), np.ones(3))
    system.begin(np.array([0]))
    system.add(1, 1)
    system.add(2, 2)
    assert np.allclose(system.multipliers(2) @ M, [0, 0, 1])


def test_multipliers_of_a_ray_prove_that_the_second_problem_has_no_solution() -> None:
    M = [[0, -2], [0, 1]]  # the ray in z1 is no proof, the multipliers of the rows are: z2 >= 4 and 2 - 2 z2 >= 0
    path = lcpcli.path(Problem(M, [2, 2]), Problem(M, [2, -4]))
    assert path.end == "ray"
    assert path.certificate is not None
    assert path.message.endswith("the second problem is proved to have no solution")


def test_a_path_of_one_point_has_that_point() -> None:
    path = lcpcli.path(Problem([[0]], [0]), Problem([[0]], [-1]))  # w is 0 at once, and no z helps
    assert path.t.tolist() == [0.0]
    assert path(0.0).tolist() == [0.0]
