"""Krylov methods reach their target, and smoothed aggregation makes their number of steps independent of the grid."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array, eye_array

from lcpcli import Problem
from lcpcli.linalg.krylov import bicgstab, conjugate_gradients, identity
from lcpcli.linalg.matrices import is_symmetric
from lcpcli.methods.active_set import multilevel
from lcpcli.methods.multilevel import COARSEST, Hierarchy
from lcpcli.methods.stages import Breakdown
from lcpcli.typing import Mask

from .grids import plane
from .stages import through


def disc(m: int) -> Mask:
    X, Y = np.meshgrid(*2 * [np.linspace(-1, 1, m)])
    return (X**2 + Y**2 < 0.6).ravel()


@pytest.mark.parametrize("method", [conjugate_gradients, bicgstab])
def test_krylov_methods_reach_their_target_from_any_start(method: type) -> None:
    generator = np.random.default_rng(0)
    factor = generator.standard_normal((30, 30))
    A = factor @ factor.T + 30 * np.eye(30)
    if method is bicgstab:
        A += 5 * np.triu(factor, 1)
    solution, start = generator.standard_normal(30), generator.standard_normal(30)
    b = A @ solution
    given = start.copy()
    x, size = method(lambda v: A @ v, b, start, 1e-9, 200, identity)
    assert size <= 1e-9
    assert np.linalg.norm(b - A @ x) <= 2e-9
    assert np.array_equal(start, given)
    x, size = method(lambda v: A @ v, b, solution, 1e-9, 200, identity)
    assert np.array_equal(x, solution)


@pytest.mark.parametrize("method", [conjugate_gradients, bicgstab])
def test_krylov_methods_stop_on_singular_matrices(method: type) -> None:
    b = np.ones(3)
    x, size = method(lambda v: np.zeros(3) * v, b, np.zeros(3), 1e-9, 50, identity)
    assert np.isfinite(x).all()
    assert size == pytest.approx(np.sqrt(3))


@pytest.mark.parametrize("masked", [False, True])
@pytest.mark.parametrize("m", [40, 160])
def test_number_of_steps_does_not_grow_with_the_grid(m: int, masked: bool) -> None:
    M = plane(m) / 4
    basic = disc(m) if masked else np.ones(m * m, dtype=bool)
    steps = []

    def product(v: np.ndarray) -> np.ndarray:
        steps.append(v)
        return (M @ v) * basic

    b = np.random.default_rng(m).standard_normal(basic.size) * basic
    cycle, target = Hierarchy(M).preconditioner(basic), 1e-8 * np.linalg.norm(b)
    x, _ = conjugate_gradients(product, b, np.zeros(b.size), target, 100, cycle)
    assert not x[~basic].any()
    assert np.linalg.norm(b - (M @ x) * basic) <= 1e-7 * np.linalg.norm(b)
    assert len(steps) <= 22


def test_v_cycle_is_symmetric_and_positive() -> None:
    m, generator = 35, np.random.default_rng(1)
    cycle = Hierarchy(plane(m)).preconditioner(disc(m))
    for _ in range(10):
        u, v = generator.standard_normal((2, m * m)) * disc(m)
        assert u @ cycle(v) == pytest.approx(v @ cycle(u), rel=1e-9, abs=1e-9)
        assert u @ cycle(u) > 0


def test_coarse_versions_are_galerkin_products_of_falling_size() -> None:
    hierarchy = Hierarchy(plane(60) / 4)
    sizes = [A.shape[0] for A in hierarchy.matrices]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[-1] <= COARSEST
    for fine, P, coarse in zip(hierarchy.matrices, hierarchy.prolongations, hierarchy.matrices[1:], strict=False):
        assert np.allclose((P.T @ fine @ P - coarse).data, 0, atol=1e-14)
        assert np.all(np.diff(P.indptr) > 0)
    assert all(is_symmetric(A) or abs(A - A.T).max() < 1e-15 for A in hierarchy.matrices)


@pytest.mark.slow("a large matrix")
def test_matrices_without_coarse_versions_are_refused() -> None:
    places = np.random.default_rng(2).integers(0, 3000, (2, 90_000))
    A = csr_array((np.ones(90_000), tuple(places)), shape=(3000, 3000))
    dense_soon = csr_array(A + A.T + 100 * eye_array(3000))
    for M, word in ((dense_soon, "coarse"), (csr_array((900, 900)), "diagonal")):
        iterates, ending = through(multilevel(Problem(M, -np.ones(M.shape[0]))))
        assert iterates == []
        assert isinstance(ending, Breakdown)
        assert word in ending.reason
