"""Small problems against exact verdicts: no statement about them is false.

Random mixed problems, singular, degenerate and infeasible ones among them; linear programs whose costs and right-hand
sides are up to 1e16 apart, also in units up to 2^400 apart, and mixed problems with bounds up to 1e17 away. The oracle
of mixed problems knows nothing of the program: it takes each of the at most 3^n choices of states and decides by
elimination in rational numbers whether the linear equations and inequalities of that choice have a solution (Fourier
and Motzkin). LCP_ORACLE=3000 in the environment sets the number of problems.
Nor does the answer depend on units, order, signs, or where the bounds lie.
"""

from __future__ import annotations

import itertools
import math
import os
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem, Result, from_qp, run
from lcpcli.typing import Vector

from .. import exact, exact_measure
from ..mixed_problems import monotone, with_all_bounds

COUNT = int(os.environ.get("LCP_ORACLE", "400"))
UNDECIDED = 1e-3  # of all problems, at most
NEAR = 1e-6  # a solution this close to z, relative to 1 + |z_i|, agrees with it


class Mixed(NamedTuple):
    M: Vector
    q: Vector
    lower: Vector
    upper: Vector


def problem(generator: np.random.Generator, most: int) -> Mixed:
    n, size = int(generator.integers(1, most + 1)), int(generator.integers(1, 4))
    M = generator.integers(-size, size + 1, (n, n)).astype(float)
    kind = generator.integers(6)
    if kind < 3:
        M = (M @ M.T, M - M.T, np.outer(M[0], M[:, 0]))[kind]
    elif kind == 3:
        M = np.where(generator.random((n, n)) < 0.5, M, 0.0)
    lower, upper = np.full(n, -np.inf), np.full(n, np.inf)
    for i, state in enumerate(generator.integers(6, size=n).tolist()):
        low, high = np.sort(generator.integers(-2, 3, 2)).tolist()
        if state in (0, 1, 3, 4):
            lower[i] = 0 if state == 0 else low
        if state in (2, 3, 4):
            upper[i] = low if state == 4 else high
    q = generator.integers(-3, 4, n).astype(float)
    if generator.random() < 0.3:  # decimals, and bounds away from 0
        M, q = M / 3, q / 10
        shift = generator.standard_normal(n).round(3)
        lower, upper = lower + shift, upper + shift
    return Mixed(M, q, lower, upper)


def is_solvable(given: Mixed, near: Vector | None = None) -> bool:
    """Whether the problem has a solution; with `near`, one whose components are close to those of `near`."""
    M = [list(map(Fraction, row)) for row in given.M.tolist()]
    ends = np.column_stack((given.lower, given.upper))
    reach = np.full(given.q.size, np.inf) if near is None else NEAR * (1 + np.abs(near))
    around = np.zeros(given.q.size) if near is None else near
    within = np.clip(ends, (around - reach)[:, np.newaxis], (around + reach)[:, np.newaxis])
    states = [
        ["fixed"] if low == high else ["basic"] + ["lower"] * math.isfinite(low) + ["upper"] * math.isfinite(high)
        for low, high in ends.tolist()
    ]
    for choice in itertools.product(*states):
        own = np.where(np.array(choice)[:, np.newaxis] == "basic", within, ends)
        at = np.where(np.array(choice) == "upper", ends[:, 1], ends[:, 0])
        is_near = all(s == "basic" or abs(z - a) <= r for s, z, a, r in zip(choice, at, around, reach, strict=True))
        if is_near and exact.of_states(M, list(map(Fraction, given.q.tolist())), *own.T.tolist(), choice) is not None:
            return True
    return False


def solves(given: Mixed, z: Vector) -> bool:
    w, sizes = given.M @ z + given.q, 1 + np.abs(given.M) @ np.abs(z) + np.abs(given.q)
    return bool((np.abs(z - np.clip(z - w, given.lower, given.upper)) <= 1e-9 * sizes).all())


def test_what_is_said_of_small_problems_is_true() -> None:
    generator, undecided, solvable = np.random.default_rng(13), [], 0
    for _ in range(COUNT):
        given = problem(generator, 4)
        result = lcpcli.solve(given.M, given.q, lower=given.lower, upper=given.upper)
        truth = is_solvable(given)
        solvable += truth
        if result.solved:
            assert truth, given
            assert solves(given, result.z), given
            assert is_solvable(given, result.z), given
        elif result.status.has_no_solution:
            assert not truth, given
        else:
            undecided.append(given)
    assert 0.2 * COUNT < solvable < 0.9 * COUNT
    assert len(undecided) <= UNDECIDED * COUNT, undecided


def states(given: Mixed, result: lcpcli.Result) -> Vector:
    """-1 at a lower bound with w > 0, 1 at an upper one with w < 0, else 0; up to rounding."""
    return np.sign(np.where(np.abs(result.w) <= 1e-9 * (1 + np.abs(given.q)), 0, -result.w))


def test_what_is_proved_of_mixed_problems_holds_in_exact_arithmetic() -> None:
    generator, found = np.random.default_rng(15), set()
    for _ in range(COUNT // 8):
        given = problem(generator, 3)
        whole = lcpcli.Problem(given.M, given.q, lower=given.lower, upper=given.upper)
        result = lcpcli.exact(whole)
        if result.exact is None:
            continue
        found.add(result.status)
        if result.solved:
            assert exact.solves(whole, result.exact.z), given
        elif result.exact.y is not None:
            assert exact.refutes(whole, result.exact.y), given
        else:
            assert not is_solvable(given), given
    assert {lcpcli.Status.SOLVED, lcpcli.Status.INFEASIBLE} <= found


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
        truth = is_solvable(Mixed(given.M, given.q, lower, upper))
        R, C = np.exp2(np.random.default_rng(seed).integers(-largest, largest + 1, (2, given.n)).astype(float))
        moved = Problem(R[:, None] * given.M * C, R * given.q, lower=lower / C, upper=upper / C)
        problem = moved if largest else given
        assert_true(run(problem, time_limit=120.0), problem, truth)


def mixed(seed: int) -> Mixed:
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
    return Mixed(M, q, lower, np.where(upper < lower, lower + 1, upper))


def assert_true(result: Result, problem: Problem, solvable: bool) -> None:
    if result.solved:
        assert solvable
        assert exact_measure.relative_residual(problem, result.z) <= 1e-10 or "last digits" in result.message
    assert not (result.status.has_no_solution and solvable)
    assert result.solved or result.status.has_no_solution, "it is decided"


def test_mixed_problems_with_far_bounds() -> None:
    for seed in range(COUNT // 2):
        given = mixed(seed)
        problem = Problem(given.M, given.q, lower=given.lower, upper=given.upper)
        assert_true(run(problem, time_limit=120.0), problem, is_solvable(given))


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
