"""Affine variational inequalities: what is found, and what is proved about it."""

import json
from fractions import Fraction

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.optimize import linprog

import lcpcli
from lcpcli import from_avi
from lcpcli.model.problem import Problem

from ..refusals import contents
from ..seeds import few_of

TURN = [[0, 1], [-1, 0]]  # H + H' = 0
INDEFINITE = [[-1, 0], [0, -1]]


def claims(problem):
    proved = lcpcli.run(problem).answer.proved
    return proved.solves.holds, proved.monotone.holds, proved.only.holds


@pytest.mark.parametrize("seed", few_of(range(12), 5))
def test_no_other_point_of_c_is_better_by_the_gradient_at_x(seed):
    random = default_rng(seed)
    n, m = 6, 4
    B, skew = random.integers(-2, 3, (2, n, n)).astype(float)
    H, h, A = B @ B.T + skew - skew.T, random.integers(-9, 9, n), random.random((m, n))
    sides = A @ np.ones(n) - 1.0, A @ np.ones(n) + random.integers(0, 2, m)
    problem = from_avi(H, h, A, row_lower=sides[0], row_upper=sides[1], upper=2.0)
    result = lcpcli.run(problem)
    x = result.answer.x
    gradient = H @ x + h
    rows, ends = np.vstack((A, -A)), np.concatenate((sides[1], -sides[0]))
    best = linprog(gradient, rows, ends, bounds=(0, 2))
    assert result.solved
    assert gradient @ x <= best.fun + 1e-7
    assert result.answer.proved.solves.holds


@pytest.mark.parametrize("seed", few_of(range(8), 4))
def test_an_active_set_reaches_what_the_conditions_alone_say(seed):
    """With equations, ranges, rows twice and fixed variables."""
    random = default_rng(seed)
    n = int(random.integers(2, 9))
    B, skew = random.integers(-2, 3, (2, n, n)).astype(float)
    A = random.integers(1, 4, (4, n)).astype(float)
    A[3] = A[2]
    inside = random.integers(0, 2, n).astype(float)
    sides = {
        "row_lower": A @ inside - [0, 1, 1, 1],
        "row_upper": A @ inside + [0, 1, 0, 0],
    }
    room = np.arange(n) > 0
    bounds = {"lower": inside - room, "upper": inside + room}
    H, h = B @ B.T + np.eye(n) + skew - skew.T, 9 * random.normal(size=n)
    problem = from_avi(H, h, A, **sides, **bounds)
    result = lcpcli.run(problem)
    plain = Problem(problem.M, problem.q, lower=problem.lower, upper=problem.upper)
    assert result.solved
    assert result.route == ("active set",)
    assert np.allclose(result.answer.x, lcpcli.run(plain).z[:n], atol=1e-9)


@pytest.mark.parametrize(
    ("problem", "expected"),
    [
        (from_avi([[2, 1], [-1, 2]], [-4, -4]), (True, True, True)),
        (from_avi(TURN, [0, 0], upper=1), (True, True, False)),
        (from_avi(TURN, [-1, 1], upper=3), (True, True, True)),
        (from_avi(INDEFINITE, [1, 1], upper=2), (True, False, False)),
        (
            from_avi(INDEFINITE, [1, 1], [[1, 1]], row_lower=0, upper=2),
            (True, False, False),
        ),
        # On x1 + x2 = 1 alone H is monotone, and so it is where two sides say that.
        (
            from_avi([[1, 3], [3, 1]], [0, 0], [[1, 1]], row_lower=1),
            (True, False, False),
        ),
        (
            from_avi([[3, 4], [4, 3]], [0, 0], [[1, 1]], [1], row_upper=1),
            (True, False, False),
        ),
        (
            from_avi(
                [[1, -3], [-3, 1]], [0, 0], [[1, 1], [1, 1]], [1, -9], row_upper=[9, 1]
            ),
            (True, True, True),
        ),
        (from_avi(INDEFINITE, [0, 0], lower=1, upper=1), (True, True, True)),
        # Every point of a line.
        (from_avi([[0]], [0], lower=-np.inf), (True, True, False)),
        (from_avi([[1]], [0], [[1]], [5], upper=2), (False, True, None)),
        (from_avi([[0]], [-1]), (False, True, None)),
        (from_avi([[-1]], [-1]), (False, False, None)),
    ],
)
def test_what_is_proved(problem, expected):
    assert claims(problem) == expected


def test_other_solutions_that_differ_in_multipliers_alone_do_not_count():
    # x1 <= 1 twice.
    problem = from_avi([[1]], [-3], [[1], [1]], row_upper=1)
    assert not lcpcli.solutions(problem).equilibria
    assert claims(problem) == (True, True, True)


def test_large_ones_that_are_not_definite_are_not_decided():
    n = 201
    H = np.triu(np.ones((n, n)), 1)
    H -= H.T
    assert claims(from_avi(H, np.ones(n))) == (None, True, None)


def test_a_symmetric_h_gives_the_minimizer():
    data = [[2, 1], [1, 2]], [-4, -1], [[1, 1]]
    avi = lcpcli.run(from_avi(*data, row_upper=1))
    program = lcpcli.run(lcpcli.from_qp(*data, row_upper=1))
    assert avi.answer.x.tolist() == program.answer.x.tolist()
    assert avi.answer.y.tolist() == program.answer.y.tolist()


@pytest.mark.parametrize(
    ("values", "accepted"),
    [
        ([Fraction(1, 2), Fraction(3, 2)], True),
        ([0.5, 1.5], True),
        ([0.5, 1.5, -1.5], True),
        ([0.5, 1.5, 1.5], False),
        ([1.0, 1.0], False),
        ([Fraction(1), Fraction(1)], False),
    ],
)
def test_check_takes_x_and_finds_multipliers(values, accepted):
    problem = from_avi([[2, 1], [-1, 2]], [-4, -4], [[1, 1]], row_upper=2)
    found = lcpcli.check(problem, values)
    assert found.accepted == accepted
    assert (found.multipliers is None) == (len(values) == 3)


def test_check_completes_slacks_of_rows_between_two_sides():
    problem = from_avi([[2, 1], [-1, 2]], [-4, -4], [[1, 1]], row_lower=0, row_upper=2)
    assert lcpcli.check(problem, [0.5, 1.5])
    assert lcpcli.check(problem, [Fraction(1, 2), Fraction(3, 2)]).exact


DATA = {"H": [[2, 1], [-1, 2]], "h": [-4, -4], "A": [[1, 1]], "row_upper": 2}


WRONG = contents(
    "avi.json",
    r"""
"H": null => H: {IS:null}; give its numbers
"H": [[1, 2]] => H: {SHAPE:1|2}; {SQUARE}
"H": [[1]] => H: {SHAPE_BESIDE:1 x 1|h|2 entries}; {AGREE}
"h": [] => h: {EMPTY}; {ONE_VARIABLE}
"h": ["x", 1] => h[0]: {IS:the text 'x'}; {REAL}{FROM_0}
"A": [[1]] => A: {ENTRIES:1 column|2 variables}; {AGREE}
"A": null => A: {MISSING}; {LEAVE_BOTH_OUT:row_upper}
"row_upper": null => row_lower: {MISSING}; {LEAVE_BOTH_OUT:A}
"row_lower": 3 => row_lower[0]: {ABOVE:3|row_upper[0]|2}; {IN_ORDER}{FROM_0}
"b": 1, "row_lower": 0
    => b: is short for row_lower, which is passed too; {LEAVE_ONE_OUT}
"upper": [1] => upper: {ENTRIES:1 entry|2 variables}; {AGREE}
"upper": -1 => lower[0]: {ABOVE:0|upper[0]|-1}; {IN_ORDER}{FROM_0}
"rows": ["a", "b"] => rows: {ENTRIES:2 names|1 row}; {AGREE}
"columns": ["a"] => columns: {ENTRIES:1 name|2 variables}; {AGREE}
"sense": "max"
    => sense: {NO_KEY:a variational inequality}; the keys are H, h, A, b, row_lower,
    row_upper, lower, upper, rows, columns, name, source, note
"Q": [[1]]
    => Q: {NO_KEY:a variational inequality}; the keys are H, h, A, b, row_lower,
    row_upper, lower, upper, rows, columns, name, source, note
""",
    made=lambda keys: json.dumps(DATA | json.loads(f"{{{keys}}}")),
)


@pytest.mark.parametrize("refusal", WRONG, ids=str)
def test_what_is_wrong_is_named(refusal, refused):
    assert refused(refusal.command, refusal.files) == refusal.line
