"""Small problems with numbers at scales far apart, against exact verdicts: no statement about them is false.

Linear programs whose costs and right-hand sides are up to 1e16 apart, mixed problems with bounds up to 1e17 away, and
linear programs and LCPs with rows and columns in units up to 2^400 apart. LCP_ORACLE sets the number of each.
"""

from __future__ import annotations

import os
from collections import Counter
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import pytest

from lcpcli import Problem, Result, from_qp, run
from lcpcli.typing import Vector

from .. import exact, exact_measure
from .test_mixed_oracle import Mixed, is_solvable

Row = list[Fraction]


class LinearProgram(NamedTuple):
    """min c'x with row_lower <= A x <= row_upper and lower <= x <= upper, in doubles that count as they are."""

    c: Vector
    A: Vector
    row_lower: Vector
    row_upper: Vector
    lower: Vector
    upper: Vector

    def ends(self) -> list[tuple[Row, Fraction]]:
        """Rows g and numbers h for which the conditions are g'x >= h."""
        G = np.vstack((self.A, np.eye(self.c.size)))
        low, high = np.append(self.row_lower, self.lower), np.append(self.row_upper, self.upper)
        rows = [*zip(G.tolist(), low.tolist(), strict=True), *zip((-G).tolist(), (-high).tolist(), strict=True)]
        return [(list(map(Fraction, row)), Fraction(end)) for row, end in rows if np.isfinite(end)]


class Verdict(NamedTuple):
    """optimal, infeasible or unbounded; the minimum if there is one."""

    word: str
    minimum: Fraction | None = None


def verdict(program: LinearProgram) -> Verdict:
    """By x = x+ - x- and a slack for each condition, and beside it a y >= 0 with G'y = c and h'y = c'x."""
    ends, n = program.ends(), program.c.size
    m, c = len(ends), [Fraction(value) for value in program.c.tolist()]
    h, none = [end for _, end in ends], [Fraction(0)] * len(ends)
    primal = [[*row, *(-a for a in row), *(Fraction(-(i == k)) for k in range(m))] for i, (row, _) in enumerate(ends)]
    if not m:
        return Verdict("unbounded") if any(c) else Verdict("optimal", Fraction(0))
    if exact.nonnegative(primal, h) is None:
        return Verdict("infeasible")
    dual = [[*([Fraction(0)] * 2 * n), *none, *(row[j] for row, _ in ends)] for j in range(n)]
    gap = [*c, *(-value for value in c), *none, *(-end for end in h)]
    x = exact.nonnegative([*([*row, *none] for row in primal), *dual, gap], [*h, *c, Fraction(0)])
    if x is None:
        return Verdict("unbounded")
    return Verdict("optimal", sum((value * (a - b) for value, a, b in zip(c, x[:n], x[n:], strict=False)), Fraction(0)))


def fault(program: LinearProgram, x: Vector, minimum: Fraction, tol: Fraction) -> str:
    """What is wrong with x as a minimizer, relative to the terms of each row and of the objective; "" if nothing is."""
    point = [Fraction(value) for value in x.tolist()]
    if not ((program.lower <= x) & (x <= program.upper)).all():
        return "a bound is violated"
    for row, end in program.ends():
        terms = [a * value for a, value in zip(row, point, strict=True)]
        if end - sum(terms) > tol * max(sum(map(abs, terms), Fraction(0)), abs(end)):
            return "a row is violated"
    terms = [Fraction(a) * value for a, value in zip(program.c.tolist(), point, strict=True)]
    wrong = abs(sum(terms, Fraction(0)) - minimum) > tol * max(sum(map(abs, terms), Fraction(0)), abs(minimum))
    return "the objective is not the minimum" if wrong else ""


COUNT = int(os.environ.get("LCP_ORACLE", "150"))
ROUNDED_AWAY = 6761  # has solutions with thirds that rounding destroys, and others in integers
TOL = Fraction(1, 10**8)


def spread(random: np.random.Generator, values: np.ndarray) -> np.ndarray:
    """Some of the values times 1e9 to 1e16."""
    powers = np.where(random.random(values.size) < 0.5, random.integers(9, 17, values.size), 0)
    return values * 10.0**powers


def program(seed: int) -> LinearProgram:
    """One to four variables and rows, integers from -3 to 3; most of them with a minimizer that was chosen first."""
    random = np.random.default_rng(seed)
    n, m = (int(value) for value in random.integers(1, 5, 2))
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
    return LinearProgram(c, A, np.where(sense == 2, -np.inf, b), np.where(sense == 1, np.inf, b), lower, upper)


def in_other_units(given: LinearProgram, random: np.random.Generator) -> LinearProgram:
    m, n = given.A.shape
    R, C = (np.exp2(random.integers(-400, 401, size).astype(float)) for size in (m, n))
    rows = given.row_lower * R, given.row_upper * R
    return LinearProgram(given.c * C, R[:, None] * given.A * C, *rows, given.lower / C, given.upper / C)


def judged(given: LinearProgram) -> str:
    """What is said of a program, after it has been found to be true."""
    c, A, *ends = given
    low, high, lower, upper = ends
    result = run(from_qp(None, c, A, row_lower=low, row_upper=high, lower=lower, upper=upper), time_limit=120.0)
    true, answer = verdict(given), result.answer
    if result.solved:
        assert true.word == "optimal"
        assert fault(given, answer.x, true.minimum, TOL) == ""
        return "solved"
    if result.status.has_no_solution:
        assert true.word != "optimal"
        assert answer.proved in ("no_optimum", true.word)
        return "none"
    return "undecided"


@pytest.mark.slow("many programs, each against exact arithmetic")
@pytest.mark.parametrize("units", ["given", "other"])
def test_linear_programs(units: str) -> None:
    said: Counter[str] = Counter()
    for seed in (*range(COUNT), ROUNDED_AWAY):
        given = program(seed)
        said[judged(given if units == "given" else in_other_units(given, np.random.default_rng(seed)))] += 1
    assert said["undecided"] == 0
    assert min(said["solved"], said["none"]) > COUNT / 10


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
    for seed in range(COUNT):
        given = mixed(seed)
        problem = Problem(given.M, given.q, lower=given.lower, upper=given.upper)
        assert_true(run(problem, time_limit=120.0), problem, is_solvable(given))


def test_lcps_in_units_far_apart() -> None:
    for seed in range(COUNT):
        random = np.random.default_rng(seed)
        n = int(random.integers(1, 5))
        M, q = random.integers(-3, 4, (n, n)).astype(float), random.integers(-4, 5, n).astype(float)
        R, C = np.exp2(random.integers(-400, 401, (2, n)).astype(float))
        problem = Problem(R[:, None] * M * C, R * q)
        assert_true(run(problem, time_limit=120.0), problem, exact.solution(Problem(M, q)) is not None)
