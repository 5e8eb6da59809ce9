"""Bounds of variables that their complementarity conditions in a model do not state."""

import math

import pytest

import lcpcli
from lcpcli.errors import ProblemError
from lcpcli.files.input_file import InputFile
from lcpcli.formulations.nonlinear_model.nl_format import problem_of as nonlinear

from ..conftest import problem_of, read_exact
from .nl_writing import model

FREE, NONNEGATIVE, CAPACITY = (3,), (2, 0), (0, 0, 3)
EQUATION, LOWER, UPPER, BOTH = (4, 0), 1, 2, 3
STATED = "which has fewer bounds than the variable has"


def at(kinds, variable):
    """The side of a row that complements a variable, with these bounds stated."""
    return (5, kinds, variable + 1)


def solved(n, rows, bounds):
    """The values of all variables, and the remark."""
    file = InputFile("model.nl", model(n, rows, bounds))
    problem = file.problem()
    result = lcpcli.solve(
        problem.M, problem.q, lower=problem.lower, upper=problem.upper
    )
    assert result.solved, result.message
    assert lcpcli.solve_mcp(nonlinear(file.data, "")).z == pytest.approx(result.z)
    return file.data.conditions.values(result.z).tolist(), problem.note


@pytest.mark.parametrize(
    ("kinds", "bounds", "constant", "value", "is_remarked"),
    [
        (LOWER, CAPACITY, -10, 3, True),  # at the bound that is not stated, where F < 0
        (LOWER, CAPACITY, -4, 2, True),
        (UPPER, CAPACITY, 1, 0, True),
        (0, CAPACITY, -10, 3, True),
        (BOTH, NONNEGATIVE, 1, 0, False),
        (LOWER, (2, 0), -4, 2, False),
        (BOTH, FREE, 1, -0.5, False),
        (BOTH, (4, 2), -10, 2, False),
    ],
)
def test_all_bounds_of_a_variable_count(kinds, bounds, constant, value, is_remarked):
    values, remark = solved(1, [(at(kinds, 0), {0: 2}, constant)], [bounds])
    assert values == [value]
    assert (STATED in remark) == is_remarked


def test_remark_has_names_and_a_number_and_goes_with_the_problem(tmp_path):
    rows = [(at(LOWER, 0), {0: 2}, -10), (at(LOWER, 1), {1: 2}, -10)]
    file = tmp_path / "model.nl"
    file.write_bytes(model(2, rows, [CAPACITY, CAPACITY]))
    file.with_suffix(".col").write_text("gas plant\nwind\n")
    note = lcpcli.read(file).note
    assert note.startswith("0 <= gas plant <= 3 is complementary to")
    assert note.endswith(f"{STATED}, and likewise for 1 other variable")
    assert list(lcpcli.read(file).upper) == [3, 3]


@pytest.mark.parametrize("cap", [3, 2, 4])
def test_bound_is_that_of_its_multiplier_if_there_is_one(cap):
    """0 <= x complements 2 x - 10 + mu >= 0, and 0 <= mu complements cap - x >= 0, for
    x with the bounds 0 and 3."""
    rows = [(at(LOWER, 0), {0: 2, 1: 1}, -10), (at(LOWER, 1), {0: -1}, cap)]
    values, remark = solved(2, rows, [CAPACITY, NONNEGATIVE])
    if cap <= 3:  # the multiplier is determined
        assert values == [cap, 10 - 2 * cap]
    else:
        assert values[0] == 3
    assert (STATED in remark) == (cap > 3)


@pytest.mark.parametrize("sign", [1, -1])
def test_bounds_of_a_variable_belong_to_the_condition_of_one_that_stands_for_it(sign):
    """0 <= v complements 2 x - 10 >= 0, where v = x; or v = 3 - x, and 10 - 2 x."""
    tie = {0: 1, 1: -1} if sign > 0 else {0: 1, 1: 1}
    rows = [
        (at(LOWER, 0), {1: 2 * sign}, -10 * sign),
        (EQUATION, tie, 0 if sign > 0 else -3),
    ]
    values, remark = solved(2, rows, [NONNEGATIVE, CAPACITY])
    assert values == ([3, 3] if sign > 0 else [0, 3])
    assert "0 <= v1 <= 3 is complementary to" in remark


def test_bounds_of_what_no_condition_is_about_are_refused():
    # v1 is no variable of the condition.
    rows = [(at(LOWER, 0), {0: 1, 1: 1}, 0), (EQUATION, {0: 1, 1: -2}, 1)]
    with pytest.raises(
        ProblemError, match="v1: has bounds but no row that it complements"
    ):
        problem_of(model(2, rows, [NONNEGATIVE, CAPACITY]), "model.nl")


@pytest.mark.parametrize(
    ("cap", "slack", "tie"),
    [
        (0.2, ({2: 1}, 0), ({2: -1, 0: -1}, ("-", 0.3, 0.1))),
        (0.3, ({2: -1}, 0.2), ({2: -1, 0: 1}, -0.1)),
    ],
)
def test_bounds_are_compared_as_decimals(cap, slack, tie, tmp_path):
    """In doubles 0.3 - 0.1 is less than 0.2, and the multiplier's bound would seem to
    be the tighter one; 0.1 + 0.2 is more than 0.3, and it would seem to imply none."""
    rows = [(at(LOWER, 0), {0: 1, 1: 1}, -10), (at(LOWER, 1), *slack), (EQUATION, *tie)]
    file = tmp_path / "model.nl"
    file.write_bytes(model(3, rows, [(0, 0, cap), NONNEGATIVE, FREE]))
    exact = read_exact(str(file))
    assert (
        [end is None for end in exact.upper]
        == [math.isinf(end) for end in lcpcli.read(file).upper]
        == [True] * 3
    )


@pytest.mark.parametrize("side", [{0: -1}, {0: -2}, {0: -1, 3: -2}])
def test_condition_that_has_lost_the_bounds_of_an_expression_is_refused(side):
    """As Pyomo writes 0 <= e <= 3 complements F: v1 and v2 are the two sides, here of
    v0 and perhaps v3."""
    rows = [
        (at(0, 1), {2: 1}, 0),
        (EQUATION, {0: 1, 2: 1, 3: -1}, -1),
        (EQUATION, {**side, 1: 1}, 10),
    ]
    rows += [(at(LOWER, 3), {3: 1, 0: 1}, -2)]
    with pytest.raises(
        ProblemError,
        match=r"v1: is complementary to v2, and neither has bounds; .*Var\(bounds",
    ):
        problem_of(model(4, rows, [FREE, FREE, FREE, NONNEGATIVE]), "model.nl")


V1_COUNTS = (
    f"0 <= v1 <= 3 is complementary to the expression of its condition, {STATED}"
)
SOLVED = {  # rows and bounds, the values of all variables, and the remark
    "multiplier of a bound by a slack variable, as Pyomo writes it: slack = 3 - x": (
        [
            (at(LOWER, 0), {0: 2, 1: 1}, -10),
            (at(LOWER, 1), {2: 1}, 0),
            (EQUATION, {0: 1, 2: 1}, -3),
        ],
        *([CAPACITY, NONNEGATIVE, FREE], [3, 4, 0], ""),
    ),
    "of two variables that of the one with both bounds: 0 <= w complements x >= "
    "0, where w = 2 x - 10": (
        [
            (at(LOWER, 0), {2: 1}, 0),
            (EQUATION, {2: 1, 1: -1}, 0),
            (EQUATION, {0: 1, 1: -2}, 10),
        ],
        *([NONNEGATIVE, CAPACITY, FREE], [-4, 3, 3], V1_COUNTS),
    ),
    "of the variable with both bounds, where the other one has an upper bound: "
    "w <= 4 complements x - 3 <= 0": (
        [
            (at(UPPER, 0), {2: 1}, 0),
            (EQUATION, {2: 1, 1: -1}, 3),
            (EQUATION, {0: 1, 1: -2}, 0),
        ],
        *([(1, 4), CAPACITY, FREE], [4, 2, -1], V1_COUNTS),
    ),
    "bounds that conditions imply: w = 2 x - 5 complements x, through a "
    "variable that equals x": (
        [
            (at(LOWER, 0), {2: 1}, 0),
            (EQUATION, {2: 1, 1: -1}, 0),
            (EQUATION, {0: 1, 1: -2}, 5),
        ],
        *([NONNEGATIVE, NONNEGATIVE, FREE], [0, 2.5, 2.5], ""),
    ),
    "a function of the free variable that complements it: v1 = v0 - 10": (
        *(
            [(at(0, 0), {1: 1}, 0), (EQUATION, {1: -1, 0: 1}, -10)],
            [FREE, FREE],
            [10, 0],
            "",
        ),
    ),
    "a condition without bounds is an equation": (
        *(
            [(at(0, 0), {0: 2, 1: 1}, -4), (EQUATION, {0: 1, 1: -1}, -1)],
            [FREE, FREE],
            [5 / 3, 2 / 3],
            "",
        ),
    ),
}


@pytest.mark.parametrize("name", SOLVED)
def test_bounds_count_where_a_condition_is_about_them(name):
    rows, bounds, values, remark = SOLVED[name]
    assert solved(len(bounds), rows, bounds) == (values, remark)
