"""Small problems against exact verdicts: no statement about them is false.

Random mixed problems, singular, degenerate and infeasible ones among them; linear programs whose costs and right-hand
sides are up to 1e16 apart, also in units up to 2^400 apart, and mixed problems with bounds up to 1e17 away. The number
of problems is LCP_ORACLE, in the environment. Nor does the answer depend on units, order, signs, or where bounds lie.
"""

from __future__ import annotations

import os

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem, from_qp, run
from lcpcli.typing import Vector

from .. import exact, exact_measure
from ..enumeration.solution_sets import random_problem as integers
from ..mixed_problems import monotone, with_all_bounds

COUNT = int(os.environ.get("LCP_ORACLE", "400"))


def random_problem(generator: np.random.Generator, most: int) -> Problem:
    """Small integers with bounds of all kinds, or decimals with bounds away from 0."""
    M, q, lower, upper = integers(generator, most)
    if generator.random() < 0.3:
        shift = generator.standard_normal(q.size).round(3)
        M, q, lower, upper = M / 3, q / 10, lower + shift, upper + shift
    return Problem(M, q, lower=lower, upper=upper)


def is_true(problem: Problem) -> bool:
    """Whether the problem has a solution; it fails if what is said of it is not so, or nothing is decided."""
    solvable, result = exact.solution(problem) is not None, run(problem, time_limit=120.0)
    if result.solved:
        assert solvable
        assert exact_measure.relative_residual(problem, result.z) <= 1e-10 or "last digits" in result.message
    assert not (result.status.has_no_solution and solvable)
    assert result.solved or result.status.has_no_solution, "it is decided"
    return solvable


def test_what_is_said_of_small_problems_is_true() -> None:
    generator = np.random.default_rng(13)
    assert 0.2 * COUNT < sum(is_true(random_problem(generator, 4)) for _ in range(COUNT)) < 0.9 * COUNT


def spread(random: np.random.Generator, values: np.ndarray) -> np.ndarray:
    """Some of the values times 1e9 to 1e16."""
    powers = np.where(random.random(values.size) < 0.5, random.integers(9, 17, values.size), 0)
    return values * 10.0**powers


def linear_program(seed: int) -> Problem:
    """One to three variables and rows, integers from -3 to 3; most of them with a minimizer that was chosen first."""
    random = np.random.default_rng(seed)
    n, m = (int(value) for value in random.integers(1, 4, 2))
    A, kind = random.integers(-3, 4, (m, n)).astype(float), int(random.integers(4))
    lower = np.where(random.random(n) < 0.8, 0.0, -np.inf)
    upper = np.where(random.random(n) < 0.2, 3.0, np.inf)
    sense = random.integers(0, 3, m)
    if random.random() < 0.8:
        x = np.where(random.random(n) < 0.5, 0.0, random.integers(0, 4, n))
        y = np.where(random.random(m) < 0.4, 0.0, random.integers(-3, 4, m))
        y = np.where(sense == 1, np.abs(y), np.where(sense == 2, -np.abs(y), y))
        x, y = spread(random, x) if kind in (0, 2) else x, spread(random, y) if kind in (1, 2) else y
        upper = np.where(np.isfinite(upper), np.maximum(upper, x), upper)
        slack = np.where((y != 0) | (sense == 0), 0, random.integers(0, 4, m)) * np.where(sense == 2, -1, 1)
        reduced = np.where((x == lower), random.integers(0, 4, n), np.where(x == upper, -random.integers(0, 4, n), 0))
        b, c = A @ x - slack, A.T @ y + (spread(random, reduced) if kind == 3 else reduced)
    else:
        b, c = (random.integers(-3, 4, size).astype(float) for size in (m, n))
        b, c = spread(random, b) if kind in (0, 2) else b, spread(random, c) if kind in (1, 2) else c
    low, high = np.where(sense == 2, -np.inf, b), np.where(sense == 1, np.inf, b)
    return from_qp(None, c, A, row_lower=low, row_upper=high, lower=lower, upper=upper)


@pytest.mark.parametrize("largest", [0, 400])
def test_linear_programs_with_numbers_far_apart(largest: int) -> None:
    """And in units up to 2^400 apart."""
    for seed in range(COUNT // 8):
        given = linear_program(seed)
        lower, upper = given.box.vectors(given.n)
        R, C = np.exp2(np.random.default_rng(seed).integers(-largest, largest + 1, (2, given.n)).astype(float))
        is_true(Problem(R[:, None] * given.M * C, R * given.q, lower=lower / C, upper=upper / C) if largest else given)


def mixed(seed: int) -> Problem:
    """One to three unknowns, integers, and bounds 1e6 to 1e17 away from 0."""
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 4))
    M, q = random.integers(-3, 4, (n, n)).astype(float), random.integers(-4, 5, n).astype(float)
    if random.random() < 0.4:
        M = M @ M.T
    far = 10.0 ** random.integers(6, 18, (2, n))
    kinds = random.integers(0, 4, (2, n))
    lower = np.select(
        [kinds[0] == 0, kinds[0] == 1, kinds[0] == 2], [np.zeros(n), -far[0], np.full(n, -np.inf)], far[0]
    )
    upper = np.select([kinds[1] == 0, kinds[1] == 1], [far[1], np.full(n, np.inf)], lower + random.integers(0, 5, n))
    upper = np.where(np.isfinite(upper), upper, np.inf)
    return Problem(M, q, lower=lower, upper=np.where(upper < lower, lower + 1, upper))


def test_mixed_problems_with_far_bounds() -> None:
    for seed in range(COUNT // 2):
        is_true(mixed(seed))


def near(z: Vector, reference: Vector, size: float = 1.0) -> bool:
    return bool(np.abs(z - reference).max() <= 1e-6 * max(size * 1e-6, 1.0) * (1 + np.abs(reference).max()))


@pytest.mark.parametrize("seed", range(10))
def test_units_order_signs_and_shifts_do_not_matter(seed: int) -> None:
    generator = np.random.default_rng(seed)
    n = int(generator.integers(1, 30))
    (M, q), (lower, upper) = monotone(n, generator), with_all_bounds(n, generator)
    own = lcpcli.solve(M, q, lower=lower, upper=upper)
    z = own.z
    R, C = 10.0 ** generator.uniform(-8, 8, (2, n))
    result = lcpcli.solve(R[:, np.newaxis] * M * C, R * q, lower=lower / C, upper=upper / C)
    assert own.solved
    assert near(C * result.z, z)
    t = 10.0 ** generator.uniform(-100, 100)
    for low, high, expected in ((lower, upper, z), (np.zeros(n), np.full(n, np.inf), lcpcli.solve(M, q).z)):
        scaled = lcpcli.solve(M, t * q, lower=t * low, upper=t * high).z / t
        assert np.allclose(scaled, expected, rtol=1e-12, atol=1e-13)
    P = generator.permutation(n)
    assert near(lcpcli.solve(M[np.ix_(P, P)], q[P], lower=lower[P], upper=upper[P]).z, z[P])
    mirrored = lcpcli.solve(M, -q, lower=-upper, upper=-lower)
    assert near(-mirrored.z, z)
    exchanged = {"lower": "upper", "upper": "lower", "basic": "basic"}
    states = zip(own.basis, mirrored.basis, lower < upper, strict=True)
    assert all(one == exchanged[other] for one, other, is_free in states if is_free)
    for size in (1e2, 1e4, 1e6):
        shift = size * generator.standard_normal(n)
        assert near(lcpcli.solve(M, q - M @ shift, lower=lower + shift, upper=upper + shift).z - shift, z, size)
    plain, spelt = lcpcli.solve(M, q), lcpcli.solve(M, q, lower=np.zeros(n), upper=[np.inf] * n)
    assert (plain.z.tobytes(), plain.w.tobytes()) == (spelt.z.tobytes(), spelt.w.tobytes())
    assert plain.relative_residual == spelt.relative_residual
