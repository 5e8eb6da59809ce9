"""What is said about the minimizers and the multipliers of a program is true where
numbers of very different sizes meet: by all solutions in fractions."""

from fractions import Fraction

import numpy as np
import pytest
from numpy.random import default_rng

import lcpcli
from lcpcli import from_qp, run

INF = np.inf


def answer_of(program):
    result = run(program)
    assert result.solved
    return result.answer


def test_a_multiplier_that_is_nearly_negative_at_a_vertex_is_not_said_to_be():
    """u = c - y >= 0 for y <= c_1, which is less than c_2 by 1."""
    c = [199999999999.0, 200000000000.0]
    answer = answer_of(from_qp(None, c, [[1, 1]], row_lower=0, row_upper=0))
    down = answer.bound_multipliers_down
    assert down is None or down.tolist() == [0, 1]


def test_a_slack_between_rounding_and_an_error_of_x_is_not_decided():
    """Among so many unknowns, no solution in fractions is looked for."""
    k = 120
    rows = np.zeros((1, k))
    rows[0, :2] = 1, -1
    program = from_qp(None, np.ones(k), rows, row_upper=0.1, lower=1.7e9)
    assert answer_of(program).unique_multipliers is None


def test_multipliers_of_many_dependent_rows_may_be_unique():
    """The only y >= 0 with A'y = 0 is 0, as the first column is positive; with another
    sign there, there are many."""
    A = default_rng(0).integers(-3, 4, (20, 5)).astype(float)
    answers = []
    for first in (1.0, np.where(np.arange(20) < 10, 1.0, -1.0)):
        A[:, 0] = first
        answers.append(answer_of(from_qp(np.eye(5), np.zeros(5), A, row_lower=0)))
    unique, others = (answer.unique_multipliers for answer in answers)
    assert unique is not False
    assert others is False


def test_a_point_that_only_rounding_makes_a_minimizer_is_none():
    c, sides = [1e11, 1e11 + 1, 1e11 + 1], {"row_lower": 1, "row_upper": 1}
    program = from_qp(None, c, [[1, 1, 1]], **sides, upper=[1, 0.5, 0.5])
    assert answer_of(program).statement == "x is a minimizer of the linear program"
    c = [1e11, 1e11, 1e11 + 1]
    program = from_qp(None, c, [[1, 1, 1]], **sides)
    assert "one of several minimizers" in answer_of(program).statement


def number(random, size):
    return float(random.integers(-1, 3) * size + random.choice([0, 0, 0, 1, -1, 2]))


def random_program(seed):
    """A program in whole numbers, exact as doubles, and often with a degenerate
    vertex."""
    random = default_rng(seed)
    k, m = int(random.integers(1, 4)), int(random.integers(1, 3))
    of_c, of_x = random.choice([1, 1, 10, 1e6, 1e9, 1e11, 1e13], 2)
    B = random.integers(-1, 2, (1, k)).astype(float)
    Q = B.T @ B if seed % 3 == 0 else np.zeros((k, k))
    c = [number(random, of_c) for _ in range(k)]
    low = np.array([number(random, of_x) for _ in range(m)])
    high = np.where(random.random(m) < 0.4, low, INF)
    lower = np.array([random.choice([0, 0, number(random, of_x)]) for _ in range(k)])
    upper = lower + random.choice([1, 2, of_x, INF], k)
    A = random.integers(-1, 3, (m, k))
    return from_qp(Q, c, A, row_lower=low, row_upper=high, lower=lower, upper=upper)


def ranges(found, A, b):
    """The least and the greatest of each component of A z + b over all solutions."""
    points = [np.array(z) for piece in found for z in piece.vertices]
    rays = [np.array(v) for piece in found for v in piece.rays]
    lines = [np.array(v) for piece in found for v in piece.lines]
    rays += [sign * v for v in lines for sign in (1, -1)]
    exact = [[Fraction(a) for a in row] for row in np.asarray(A).tolist()]
    rows = np.array(exact, dtype=object)
    values = np.array([rows @ z + [Fraction(v) for v in b] for z in points])
    slopes = np.array([rows @ v for v in rays]).reshape(-1, len(rows))
    lowest, greatest = (
        np.array(each, dtype=float) for each in (values.min(axis=0), values.max(axis=0))
    )
    lowest[(slopes < 0).any(axis=0)] = -INF
    greatest[(slopes > 0).any(axis=0)] = INF
    return [*zip(lowest.tolist(), greatest.tolist(), strict=True)]


def test_what_is_said_of_random_programs_is_true_of_all_their_solutions():
    said = decided = count = 0
    for seed in range(50):
        program = random_program(seed)
        result = run(program)
        if not result.solved:
            continue
        answer, found = result.answer, lcpcli.solutions(program)
        n, k, m = program.n, answer.x.size, answer.y.size
        of_z = ranges(found, np.eye(n), np.zeros(n))
        of_w = ranges(found, program.M, program.q)
        count += 1
        if "one of several" in answer.statement:
            assert any(low < high for low, high in of_z[:k])
            said += 1
        if answer.y_down is None:
            continue
        decided += 1
        is_unique = all(low == high for low, high in of_z[k : k + m] + of_w[:k])
        assert answer.unique_multipliers is is_unique
        downs = answer.y_down, answer.bound_multipliers_down
        ups = answer.y_up, answer.bound_multipliers_up
        claimed = zip(np.concatenate(downs), np.concatenate(ups), strict=True)
        for each, expected in zip(claimed, of_z[k : k + m] + of_w[:k], strict=True):
            assert each == pytest.approx(expected, rel=1e-6, abs=1e-3)
    assert count > 12
    assert decided > 0.95 * count
    assert said > 2
