"""Random small mixed problems, singular, degenerate and infeasible ones among them, against an exact oracle.

The oracle knows nothing of the program: it takes each of the at most 3^n choices of states and decides by elimination
in rational numbers whether the linear equations and inequalities of that choice have a solution (Fourier and Motzkin).
LCP_ORACLE=3000 in the environment sets the number of problems.
"""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import pytest

import lcpcli
from lcpcli.typing import Vector

from .. import exact as oracle

COUNT = int(os.environ.get("LCP_ORACLE", "400"))
UNDECIDED = 1e-3  # of all problems, at most
NEAR = 1e-6  # a solution this close to z, relative to 1 + |z_i|, agrees with it

Row = tuple[tuple[Fraction, ...], Fraction, bool]  # a'x + b = 0 or >= 0, and whether it is an equation


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


def has_point(rows: Sequence[Row], unknowns: int) -> bool:
    for k in range(unknowns):
        pivot = next((row for row in rows if row[2] and row[0][k]), None)
        if pivot is not None:
            rows = [combined(row, pivot, -row[0][k] / pivot[0][k]) for row in rows if row is not pivot]
            continue
        above, below = [row for row in rows if row[0][k] > 0], [row for row in rows if row[0][k] < 0]
        pairs = (combined(low, high, -low[0][k] / high[0][k]) for low in below for high in above)
        rows = list({*(row for row in rows if not row[0][k]), *pairs})
    return all(value == 0 if equation else value >= 0 for _, value, equation in rows)


def combined(row: Row, other: Row, factor: Fraction) -> Row:
    return tuple(a + factor * b for a, b in zip(row[0], other[0], strict=True)), row[1] + factor * other[1], row[2]


def is_solvable(given: Mixed, near: Vector | None = None) -> bool:
    """Whether the problem has a solution; with `near`, one whose components are close to those of `near`."""
    if near is not None:
        reach = NEAR * (1 + np.abs(near))
        low, high = np.maximum(given.lower, near - reach), np.minimum(given.upper, near + reach)
    M = [list(map(Fraction, row)) for row in given.M.tolist()]
    q, n = list(map(Fraction, given.q.tolist())), given.q.size
    bounds = list(zip(given.lower.tolist(), given.upper.tolist(), strict=True))
    states = [
        ["fixed"] if low == high else ["basic"] + ["lower"] * math.isfinite(low) + ["upper"] * math.isfinite(high)
        for low, high in bounds
    ]
    for choice in itertools.product(*states):
        basic = [i for i in range(n) if choice[i] == "basic"]
        z = [Fraction(0) if s == "basic" else Fraction(bounds[i][s == "upper"]) for i, s in enumerate(choice)]
        if near is not None and any(
            s != "basic" and abs(value - Fraction(at)) > room
            for s, value, at, room in zip(choice, z, near.tolist(), reach.tolist(), strict=True)
        ):
            continue
        rows: list[Row] = []
        for i, state in enumerate(choice):
            a, b = tuple(M[i][j] for j in basic), q[i] + sum(M[i][j] * z[j] for j in range(n))
            sign = {"upper": -1, "lower": 1, "basic": 1}.get(state)
            if sign is not None:
                rows.append((tuple(sign * value for value in a), sign * b, state == "basic"))
        for k, i in enumerate(basic):
            unit = tuple(Fraction(int(j == k)) for j in range(len(basic)))
            least, most = bounds[i] if near is None else (float(low[i]), float(high[i]))
            if math.isfinite(least):
                rows.append((unit, -Fraction(least), False))
            if math.isfinite(most):
                rows.append((tuple(-value for value in unit), Fraction(most), False))
        if has_point(rows, len(basic)):
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


def test_the_compiled_route_agrees_with_numpy_in_status_and_where_z_is_unique_in_states() -> None:
    pytest.importorskip("numba")
    generator, compared, count = np.random.default_rng(14), 0, COUNT // 2
    for _ in range(count):
        given = problem(generator, 4)
        results = [
            lcpcli.solve(given.M, given.q, lower=given.lower, upper=given.upper, compiled=compiled)
            for compiled in (False, True)
        ]
        assert results[0].status is results[1].status, given
        if results[0].solved and np.linalg.eigvalsh(given.M + given.M.T)[0] > 1e-6:
            compared += 1
            assert np.array_equal(*(states(given, result) for result in results)), given
    assert compared >= 0.02 * count


def states(given: Mixed, result: lcpcli.Result) -> Vector:
    """-1 at a lower bound with w > 0, 1 at an upper one with w < 0, else 0; up to rounding."""
    return np.sign(np.where(np.abs(result.w) <= 1e-9 * (1 + np.abs(given.q)), 0, -result.w))


def test_what_is_proved_of_mixed_problems_holds_in_exact_arithmetic() -> None:
    generator, found = np.random.default_rng(15), set()
    for _ in range(COUNT // 4):
        given = problem(generator, 3)
        whole = lcpcli.Problem(given.M, given.q, lower=given.lower, upper=given.upper)
        result = lcpcli.exact(whole)
        if result.exact is None:
            continue
        found.add(result.status)
        if result.solved:
            assert oracle.solves(whole, result.exact.z), given
        elif result.exact.y is not None:
            assert oracle.refutes(whole, result.exact.y), given
        else:
            assert not is_solvable(given), given
    assert {lcpcli.Status.SOLVED, lcpcli.Status.INFEASIBLE} <= found
