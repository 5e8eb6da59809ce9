"""Kernels at their limits: degenerate pivots, sizes of numbers, bounds, and blocks of many problems."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import Problem
from lcpcli.basis import tableau
from lcpcli.basis.tableau import begin, follow, lexicographic_minimum, tableau_of
from lcpcli.methods.lemke import reduced
from lcpcli.methods.lemke_path import LemkePath
from lcpcli.verify.point import Criterion, Point

from .. import kernels_together  # noqa: F401

pytest.importorskip("numba")

from lcpcli.kernels import announcement, compiled
from lcpcli.kernels.compiled import NUMBERS_AT_ONCE, direct_many, lemke, solves
from lcpcli.kernels.kernels import solve_one
from lcpcli.methods.direct import CERTAIN, NOTHING


def test_no_component_of_a_degenerate_solution_is_negative() -> None:
    rng = np.random.default_rng(0)
    for _ in range(300):
        n = 24  # more than those whose small numbers exact arithmetic decides
        M = rng.standard_normal((n, n))
        M = M @ M.T + 0.1 * np.eye(n)
        z = np.where(rng.random(n) < 0.5, rng.random(n), 0.0)
        z[0] = 0.0
        q = -M @ z
        found, _, z = solve_one(M, q, q < 0, False, np.abs(M).max(), 1e-10)
        assert not found or (z >= 0).all()


def test_small_numbers_beside_large_ones_are_left_to_exact_arithmetic_only_where_they_may_decide_a_state() -> None:
    """Of the last one, w_2 is 1/3 less the double next to it."""
    q = np.array([-1.0, 1e-9])
    assert solve_one(np.eye(2), q, q < 0, False, 1.0, 1e-10)[0] == CERTAIN
    M, q = np.array([[3.0, 0, 0], [1, 1, 0], [0, 0, 1]]), np.array([-1.0, -1 / 3, 1e-17])
    assert solve_one(M, q, q < 0, False, 3.0, 1e-10)[0] == NOTHING
    assert lemke(Problem(M, q), 1e-10).z.tolist() == [1 / 3, 0, 0]


def test_each_matrix_of_many_is_measured_by_itself() -> None:
    M, Q = np.array([[[2.0**49]], [[2.0**51]]]), np.array([[-(2.0**49)], [-(2.0**49)]])
    found = direct_many(M, Q, np.abs(M).max(axis=(1, 2)), 1e-10)[1]
    assert found[:, 0].tolist() == [CERTAIN, NOTHING]  # an entry of M from 2^50 on is too long a number


def test_one_matrix_of_many_q_is_that_of_each_block() -> None:
    Q = -np.ones((NUMBERS_AT_ONCE // 4 + 2, 2))  # more than are solved at once
    Z, _ = direct_many(2 * np.eye(2)[np.newaxis], Q, np.array([2.0]), 1e-10)
    assert (Z == 0.5).all()


def test_the_compiled_check_has_the_caps_of_the_one_in_numpy() -> None:
    z = np.array([2.0**20 + 1 + 2.0**-20, 2.0**20])  # w = (2^-20, 0), and the cap of the first row is 1
    problem = Problem([[1, -1], [-(2.0**20), 0]], [-1, 2.0**20 * z[0]])
    assert problem.w(z).tolist() == [2.0**-20, 0]
    assert not Point(Criterion(problem), z).solves()
    assert not solves(problem, z, 1e-10)


def test_a_product_that_underflows_to_zero_decides_nothing() -> None:
    """In exact arithmetic w_1 = -1e-330 at z = (0, 1e-160), which the doubles do not hold."""
    q = np.array([0.0, -1e-160])
    assert solve_one(np.array([[1.0, -1e-170], [0, 1]]), q, q < 0, False, 1.0, 1e-10)[0] != CERTAIN


def test_the_compiled_check_takes_rounding_at_the_reference_point_for_no_size_of_q() -> None:
    """Row 1 at the lower bounds is 4e-12, and -1.5e-11 as doubles sum it up; the last two rows are infeasible."""
    M, lower = np.zeros((5, 5)), np.zeros(5)
    M[0, :4] = 0.42717905926330113, 0.5768579307407304, 0.8747103493618308, 1.0
    M[1, 1] = M[2, 2] = 1.0
    M[3:, 3:] = [[1, -1], [-1, 1]]
    lower[:3] = 84718.05368988577, 79721.55013113268, 92199.35749096583
    problem = Problem(M, [-162825.5191238109, 1 - lower[1], 1 - lower[2], -1e-22, -1e-22], lower=lower)
    z = lower + np.array([0, 0, 0, 1e-8, 1e-8])
    assert not Point(Criterion(problem), z).solves()
    assert not solves(problem, z, 1e-10)


def test_the_compiled_check_refuses_a_positive_w_beside_a_positive_z() -> None:
    assert not solves(Problem([[1]], [-1]), np.array([3.0]), 1e-10)  # z = 3 and w = 2


def test_a_variable_that_blocks_itself_at_its_upper_bound_changes_its_end() -> None:
    problem = Problem([[1, 0], [0, 1]], [-5, -1], lower=[0, 0], upper=[2, 9])
    for follows in (tableau.follow, compiled.follow):
        path = LemkePath(reduced(problem), problem.q, 0, False, follows)
        path.advance(10)
        assert path.end == tableau.SOLVED
        assert np.allclose(path.point()[0], [2, 1])


def test_a_tableau_that_is_made_again_has_its_values_with_variables_at_upper_bounds() -> None:
    problem = Problem([[2, 1], [1, 2]], [-9, -5], lower=[0, 0], upper=[1, 9])
    path = LemkePath(reduced(problem), problem.q, 0, False)
    path.advance(10)
    before = path.tableau.values.copy()
    assert path.tableau.at_upper.tolist() == [True, False]
    path._refresh()
    assert np.allclose(path.tableau.values, before)


def test_a_tableau_that_is_made_again_has_all_digits_of_a_variable_that_has_left_a_far_bound() -> None:
    problem = Problem([[2, 1], [1, 2]], [-9, -5], lower=[0, 0], upper=[2.0**52, 2.0**52])
    path = LemkePath(reduced(problem), problem.q, 0, False)
    path.advance(10)
    path.tableau.at_upper[:] = True  # where basic variables have last been
    path._refresh()
    assert np.allclose(path.point()[0], [13 / 3, 1 / 3], rtol=1e-14)


def test_a_ray_is_believed_only_of_a_tableau_that_is_made_again() -> None:
    def spoiled(tableau_: tableau.Tableau, *how: Any) -> tuple[int, int, int, float]:
        end, pivots, entering, way = tableau.follow(tableau_, *how[:-1], 1)
        return (tableau.RAY, pivots, entering, way) if end == tableau.PAUSED else (end, pivots, entering, way)

    M = 2 * np.eye(4) + np.ones((4, 4))
    problem = Problem(M, -np.arange(1.0, 5.0))
    path = LemkePath(reduced(problem), problem.q, 0, False, spoiled)
    path.advance(100)
    assert path.end == tableau.SOLVED


def test_w_on_a_path_is_that_of_the_problem_in_its_units() -> None:
    R = np.array([1e-6, 1e6, 1.0])
    problem = Problem(
        R[:, np.newaxis] * [[4, 1, 0], [1, 3, 2], [0, 2, 5]], R * [-4, 1, 6], lower=0, upper=[9, 9, np.inf]
    )
    path = LemkePath(reduced(problem), problem.q, 0, False)
    path.advance(10)
    z, w, _ = path.point()
    np.testing.assert_allclose(w, np.where(z > 0, 0.0, problem.w(z)), rtol=1e-9)
    assert w.tolist() != [0, 0, 0]


@pytest.mark.parametrize("follows", [tableau.follow, compiled.follow])
def test_the_noise_of_a_variable_that_leaves_is_not_that_of_the_one_that_enters(follows: Any) -> None:
    M, q, cover, d = np.eye(2), np.array([-2.0, -1]), np.ones(2), np.full(2, np.inf)
    own = tableau_of(M, q, cover)
    row, entering, way = begin(own, d, cover, False)
    own.noise[:] = 1e-3
    follows(own, d, entering, way, row, False, 1)
    (entered,) = (own.basic == 2).nonzero()[0]
    assert own.noise[entered] < 1e-9


def test_the_lexicographic_minimum_is_the_row_that_blocks_first_after_a_perturbation() -> None:
    M, q = np.array([[-1.0, 2, -1], [0, 1, 1], [-2, -2, 3]]), np.array([0.0, 1, -1])
    cover, d = np.ones(3), np.full(3, np.inf)
    own, other = (tableau_of(M, each, cover) for each in (q, q + 0.01 ** np.arange(1, 4)))
    for each in (own, other):
        row, entering, way = begin(each, d, cover, True)
        follow(each, d, entering, way, row, True, 1)
    first = int(np.argmin(other.values - own.values))  # it blocks first if e, e^2, e^3 are added to q
    assert lexicographic_minimum(own, np.arange(3), -np.ones(3)) == first


def test_kernels_are_forgotten_that_are_older_than_the_files_they_use(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(announcement, "PACKAGE", tmp_path)
    for name in announcement.USED:
        (tmp_path / f"{name}.py").parent.mkdir(exist_ok=True)
        (tmp_path / f"{name}.py").touch()
    cache = tmp_path / "basis" / "__pycache__"
    cache.mkdir()
    for name, seconds in (("old.nbi", 0), ("new.nbi", 2**32), ("old.nbc", 0)):
        (cache / name).touch()
        os.utime(cache / name, (seconds, seconds))
    with announcement.announced():
        pass
    assert sorted(path.name for path in cache.iterdir()) == ["new.nbi", "old.nbc"]
