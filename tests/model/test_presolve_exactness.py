"""Presolve knows whether it may have rounded, so that what holds for the rest holds for the problem."""

from __future__ import annotations

import numpy as np

from lcpcli import Problem
from lcpcli.model.presolve import Presolved, presolved
from lcpcli.model.presolve_rules import repeated_equations
from lcpcli.model.presolve_signs import signs_of_equations
from lcpcli.model.presolve_system import System

INF = np.inf


def test_what_is_exact_is_known() -> None:
    bounds = {"lower": [-INF, 0, 0], "upper": INF}
    whole = presolved(Problem([[2, 1, 0], [-1, 0, 0], [0, 0, 2]], [-6, 2, 1], **bounds), ["rows that are bounds"])
    third = presolved(Problem([[2, 3, 0], [-3, 0, 0], [0, 0, 2]], [-6, 2, 1], **bounds), ["rows that are bounds"])
    assert isinstance(whole, Presolved)
    assert isinstance(third, Presolved)
    assert (whole.is_exact, third.is_exact) == (True, False)


def test_what_counts_as_rounding_is_not_exact() -> None:
    """q_1 = 1 counts as rounding of 2^49."""
    size, most = 2.0**20, 2.0**20 - 1
    M = np.eye(4)
    M[0] = [1, 0, 2**9, -(2**9)]
    M[2:, 1] = -size
    change = presolved(Problem(M, [1, -most, 0, 0], lower=[0, -INF, -INF, -INF]))
    assert isinstance(change, Presolved)
    assert change.problem.q.tolist() == [0]
    assert not change.is_exact


def test_sums_of_large_entries_are_not_exact() -> None:
    for size, is_it in ((3.0, True), (2.0**20, False)):
        system = System(Problem([[1, 0, 1], [-size, 1, 0], [1, -size, 1]], np.ones(3), lower=[0, -INF, -INF]))
        system.pivot(np.array([1]), np.array([1]), np.ones(1))
        assert system.keeps_all is is_it


def test_entries_that_rounding_moved_from_their_mirror_images_are_not_exact() -> None:
    size = 2.0**20
    for entry, is_it in ((size, True), (size + 2.0**-25, False)):
        system = System(Problem([[0, -size], [entry, 0]], [1, 1], lower=[0, -INF]))
        assert list(signs_of_equations(system)) == []
        assert system.keeps_all is is_it


def test_equations_that_are_repeated_but_for_rounding_are_not_exact() -> None:
    for difference, is_it in ((0.0, True), (1e-12, False)):
        M = [[0, 1, 1], [1, 0, 0], [1, 0, 0]]
        system = System(Problem(M, [1, -3, difference - 3], lower=[0, -INF, -INF]))
        assert len(list(repeated_equations(system))) == 1
        assert system.keeps_all is is_it
