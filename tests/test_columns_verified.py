"""Bounds for many columns at once pass no z that `Point` does not; and the systems that they share are solved."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli.linalg import principal_many
from lcpcli.model.columns import Block, Columns
from lcpcli.typing import Vector
from lcpcli.verify.accuracy import Accuracy
from lcpcli.verify.columns import bounds, scales, surely_solve
from lcpcli.verify.point import Point

from . import extremes, mixed_problems

TOLERANCES = (1e-4, 1e-10, 1e-15)


def passes_where_points_do(block: Block, z: Vector) -> tuple[int, int]:
    """How many rows pass by the bounds, and by `Point`; it is an error if one passes by the bounds alone."""
    by_bounds = by_point = 0
    with np.errstate(over="ignore", invalid="ignore"):
        residuals = bounds(block, scales(block), z, block.w(z))
    for tol in TOLERANCES:
        surely = surely_solve(residuals, tol)
        alone = [Point(Accuracy(block.problem(i), tol), z[i]).solves() for i in range(len(z))]
        assert not (surely & ~np.array(alone)).any()
        by_bounds, by_point = by_bounds + np.count_nonzero(surely), by_point + sum(alone)
    return by_bounds, by_point


def around(z: Vector, generator: np.random.Generator) -> Vector:
    """z and points near it at all distances, some so near that rounding decides."""
    steps = 10.0 ** generator.uniform(-17, 0, (60, 1)) * generator.standard_normal((60, z.size))
    steps[0] = 0.0
    with np.errstate(over="ignore"):
        return np.nan_to_num(z + steps * (np.abs(z) + float(generator.integers(2))), posinf=1e300, neginf=-1e300)


@pytest.mark.parametrize("seed", range(60))
def test_bounds_pass_what_points_pass_for_numbers_anywhere_in_range(seed: int) -> None:
    M, q, _ = extremes.data(seed)
    generator = np.random.default_rng(seed)
    z = np.maximum(around(lcpcli.solve(M, q, time_limit=1.0).z, generator), 0.0)
    Q = np.repeat(q[:, np.newaxis], z.shape[0], axis=1)
    passes_where_points_do(Columns(M, Q, 0.0, np.inf).block(0, z.shape[0]), z)


@pytest.mark.parametrize("bounds", ["orthant", "box", "far"])
@pytest.mark.parametrize("condition", [1e1, 1e8, 1e14])
def test_bounds_pass_most_of_what_points_pass(bounds: str, condition: float) -> None:
    generator = np.random.default_rng(3)
    n = 8
    orthogonal = np.linalg.qr(generator.standard_normal((n, n)))[0]
    M = orthogonal * np.geomspace(1, condition, n) @ orthogonal.T
    low, high = mixed_problems.with_all_bounds(n, generator) if bounds != "orthant" else (0.0, np.inf)
    shift = 1e6 if bounds == "far" else 0.0
    q = condition**0.5 * generator.standard_normal(n)
    result = lcpcli.solve(M, q, lower=low + shift, upper=high + shift)
    z = np.clip(around(result.z, generator), low + shift, high + shift)
    Q = np.repeat(q[:, np.newaxis], z.shape[0], axis=1)
    by_bounds, by_point = passes_where_points_do(Columns(M, Q, low + shift, high + shift).block(0, len(z)), z)
    assert by_bounds > 0.75 * by_point > 0


def test_each_submatrix_is_factorized_once(monkeypatch: pytest.MonkeyPatch) -> None:
    generator = np.random.default_rng(0)
    n, m = 70, 90
    M = generator.standard_normal((n, n)) + 3 * np.sqrt(n) * np.eye(n)
    sets = generator.random((5, n))[generator.integers(5, size=m)] < 0.5
    sets[7] = False
    B = generator.standard_normal((m, n))
    factorized: list[int] = []
    real = np.linalg.solve

    def counted(A: Any, b: Any) -> Any:
        factorized.append(A.shape[0])
        return real(A, b)

    monkeypatch.setattr(np.linalg, "solve", counted)
    X = principal_many.solve_principal(M, sets, B)
    assert sum(factorized) == 5
    for x, P, b in zip(X, sets, B, strict=True):
        assert np.allclose(M[np.ix_(P, P)] @ x[P], b[P], rtol=0, atol=1e-12)
        assert not x[~P].any()


def test_sets_of_most_indices_are_solved_for_by_their_complements() -> None:
    generator = np.random.default_rng(0)
    n, m = 30, 40
    M = generator.standard_normal((n, n)) + 3 * np.sqrt(n) * np.eye(n)
    sets = generator.random((m, n)) < np.linspace(0, 1.1, m)[:, np.newaxis]
    assert sets[-1].all()
    B = generator.standard_normal((m, n))
    inverse = principal_many.well_conditioned_inverse(M)
    assert inverse is not None
    ours, plain = principal_many.solve_principal(M, sets, B, inverse), principal_many.solve_principal(M, sets, B)
    assert np.allclose(ours, plain, rtol=0, atol=1e-12)
    assert np.array_equal(ours != 0, sets)
    assert principal_many.well_conditioned_inverse(M * np.geomspace(1, 1e9, n)) is None
    assert principal_many.well_conditioned_inverse(np.zeros((2, 2))) is None


def test_singular_submatrices_spoil_no_others() -> None:
    M = np.diag([1.0, 0.0, 2.0, 4.0])
    sets = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1], [1, 1, 0, 0]], dtype=bool)
    X = principal_many.solve_principal(M, sets, np.full((5, 4), 4.0))
    assert np.isnan(X).any(axis=1).tolist() == [False, True, False, False, True]
    assert X[[0, 2, 3]].tolist() == [[4, 0, 0, 0], [0, 0, 2, 0], [0, 0, 2, 1]]
