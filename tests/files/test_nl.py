"""Models of AMPL: what is read of each feature of the format, by an evaluator that is
not the reader's."""

import struct
from fractions import Fraction

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.sparse import issparse

from lcpcli import read, run
from lcpcli.errors import ProblemError
from lcpcli.files.input_file import InputFile
from lcpcli.linalg.matrices import dense
from lcpcli.model.nonlinear import NonlinearProblem

from ..conftest import problem_of, read_exact
from .nl_writing import UNARY, model, value

FREE, NONNEGATIVE, BOXED = (3,), (2, 0), (0, -1, 2)
EQUATION = (4, 0)
# Arguments in the domains of the functions that are not defined everywhere.
SAFE = {
    **dict.fromkeys(("sqrt", "log10", "log"), lambda a: ("+", 0.5, ("square", a))),
    **dict.fromkeys(("atanh", "asin", "acos"), lambda a: ("*", 0.9, ("sin", a))),
    "acosh": lambda a: ("+", 1.5, ("square", a)),
    **dict.fromkeys(("exp", "sinh", "cosh", "tan"), lambda a: ("sin", a)),
}
RELATIONS = ("<", "<=", "=", ">=", ">", "!=")


def nonlinear(content, path="model.nl"):
    problem = problem_of(content, path)
    assert isinstance(problem, NonlinearProblem)
    return problem


def functions_of(expressions, n, **more):
    """The problem with these expressions for n variables with lower bounds."""
    rows = [
        ((5, 1, i + 1), dict.fromkeys(range(n), 0), expression)
        for i, expression in enumerate(expressions)
    ]
    return nonlinear(model(n, rows, [NONNEGATIVE] * n, **more))


def jacobian(problem, z):
    return np.asarray(dense(problem.jacobian(z)))


def differences(expressions, z, common=()):
    """The Jacobian by differences of fourth order."""
    n, h = len(z), 1e-3

    def at(j, step):
        moved = z.copy()
        moved[j] += step * h
        return values(expressions, moved, common)

    columns = [
        (8 * (at(j, 1) - at(j, -1)) - (at(j, 2) - at(j, -2))) / (12 * h)
        for j in range(n)
    ]
    return np.array(columns).T


def values(expressions, z, common=()):
    known = {f"v{j}": float(component) for j, component in enumerate(z)}
    for k, expression in enumerate(common, len(z)):
        known[f"v{k}"] = value(expression, known)
    return np.array([value(expression, known) for expression in expressions])


def check_enclosures(problem, expressions, z, width):
    """Intervals hold the values and the derivatives at all points of a box, also at its
    ends."""
    found = problem.interval(z - width, z + width)
    J_lower, J_upper = dense(found.J_lower), dense(found.J_upper)
    for share in (-1.0, -0.4, 0.3, 1.0):
        at = z + share * width
        F, J = values(expressions, at), jacobian(problem, at)
        slack = 1e-12 * (1 + np.abs(F))  # of the evaluators in doubles
        rounding = 1e-9 * (1 + np.abs(J))
        assert ((found.F_lower <= F + slack) & (F - slack <= found.F_upper)).all()
        assert ((J_lower <= J + rounding) & (J - rounding <= J_upper)).all()


def check_functions(problem, expressions, z, common=(), smooth=True):
    """Values and derivatives are those of the evaluator of the tests."""
    assert problem.values(z) == pytest.approx(values(expressions, z, common), rel=1e-13)
    if smooth:
        assert jacobian(problem, z) == pytest.approx(
            differences(expressions, z, common), rel=1e-7, abs=1e-9
        )


def safely(operator, argument):
    return (operator, SAFE[operator](argument) if operator in SAFE else argument)


A, B, FAR = "v0", ("*", 2, "v1"), ("+", "v1", 3)
SEVERAL = {
    "arithmetic": ("sum", ("*", A, B), ("/", A, FAR), ("^", FAR, A), ("-", B, A)),
    "choices": (
        "sum",
        ("less", A, B),
        ("min", A, B, 0.5),
        ("max", B, FAR, A),
        ("atan2", A, FAR),
    ),
    "powers": ("sum", ("constant^", 1.7, A), ("^constant", FAR, 2.5), ("^", A, -1)),
    "pieces": ("sum", ("pieces", [-1, 2, 0.5], [-0.25, 1], B), ("abs", A)),
}


@pytest.mark.parametrize("operator", [*sorted(set(UNARY) - {"not"}), *SEVERAL])
def test_values_and_derivatives_of_functions_and_their_enclosures(operator):
    if operator in SEVERAL:
        expressions = [SEVERAL[operator], ("*", A, "v1")]
    else:
        expressions = [
            safely(operator, ("+", "v0", ("*", 0.5, "v1"))),
            ("*", "v0", safely(operator, "v1")),
        ]
    problem = functions_of(expressions, 2)
    for z in np.array([[0.3, 0.7], [0.9, -0.8]]):
        check_functions(problem, expressions, z)
        # Some are not defined in large boxes.
        for width in (0.0, 1e-6, 0.1, *[2.0] * (operator in UNARY)):
            check_enclosures(problem, expressions, z, width)


def test_only_the_branch_that_a_condition_takes_has_to_be_defined():
    conditions = [
        *((relation, "v0", 0.25) for relation in RELATIONS),
        ("and", ("<", 0, "v0"), ("not", ("<", "v1", 0.5))),
        ("or", ("<", "v0", 0), ("<==>", ("<", "v1", 0.5), (">", "v0", 0))),
        ("all", ("<", "v0", 1), ("<", "v1", 1), ("<", "v0", "v1")),
        ("any", ("<", "v0", 0), ("<", "v1", 0)),
    ]
    expressions = [
        ("if", condition, ("exp", "v0"), ("*", "v0", "v1")) for condition in conditions
    ]
    expressions += [("if", ("<", 0, "v0"), ("log", "v0"), ("sqrt", ("neg", "v0")))]
    n = len(expressions)
    problem = functions_of(expressions, n)
    for first in ([0.3, 0.7], [-0.4, 0.2], [0.25, 0.6]):
        z = np.array([*first, *[0.0] * (n - 2)])
        check_functions(problem, expressions, z, smooth=first[0] != 0.25)


@pytest.mark.parametrize(
    ("name", "ends"),
    [
        ("asin", (0.5, 2)),
        ("acos", (0.5, 2)),
        ("atanh", (0.5, 2)),
        ("acosh", (0, 2)),
        ("sqrt", (-1, 1)),
    ],
)
def test_nothing_is_enclosed_where_a_function_is_not_defined_everywhere(name, ends):
    interval = functions_of([(name, "v0")], 1).interval
    assert interval is not None
    found = interval(*np.array([ends]).T)
    assert not np.isfinite([found.F_lower, found.F_upper]).any()


@pytest.mark.parametrize(
    "ends", [(-2.0, 0.0), (-2.0, -1.0), (0.0, 0.0), (-1.0, 2.0), (1.0, 3.0)]
)
def test_an_enclosure_holds_for_conditions_that_are_numbers_or_undefined(ends):
    """An if takes its first branch wherever the condition is not 0, as in AMPL."""
    conditions = [(relation, ("log", "v0"), 0) for relation in RELATIONS]
    expressions = [("if", "v0", ("*", 2, "v1"), ("*", -3, "v1")), ("if", "v0", "v0", 1)]
    expressions += [("if", each, "v0", ("*", -3, "v0")) for each in conditions]
    n = len(expressions) + len(conditions)
    problem = functions_of([*expressions, *conditions], n)
    assert problem.interval is not None
    low, high = np.ones((2, n))
    low[0], high[0] = ends
    found = problem.interval(low, high)
    for low[0] in np.linspace(*ends, 5):
        with np.errstate(all="ignore"):
            F, J = problem.F(low), problem.jacobian(low)
        assert not ((found.F_lower > F) | (found.F_upper < F)).any()
        assert not ((found.J_lower > J) | (found.J_upper < J))[:2].any()


def test_enclosures_take_decimals_as_written():
    problem = functions_of([("-", ("*", "v0", "v0"), ("*", 0.1, "v0"))], 1)
    assert problem.interval is not None
    found = problem.interval(np.array([0.1]), np.array([0.1]))
    tenth = Fraction(0.1)
    exact = tenth * tenth - Fraction(1, 10) * tenth
    assert exact != 0
    assert Fraction(found.F_lower[0]) < exact < Fraction(found.F_upper[0])
    product, exact, z = "v0", Fraction(9, 8), np.array([1.125, 1.1875 + 2.0**-50])
    for k in range(8):
        product, exact = ("*", product, f"v{1 - k % 2}"), exact * Fraction(z[1 - k % 2])
    rounded = functions_of([product, "v0"], 2)
    assert rounded.interval is not None
    assert Fraction(rounded.interval(z, z).F_upper[0]) >= exact


COMMON = [
    ({0: 1.5}, ("sin", "v1")),
    ({}, ("*", "v2", "v2")),
    ({1: -1}, ("exp", ("*", 0.1, "v3"))),
]


@pytest.mark.parametrize("binary", [False, True])
def test_common_expressions_in_text_and_in_binary(binary):
    rows = [
        ((5, 1, 1), {0: 2.5, 1: 0}, ("+", "v3", "v4")),
        ((5, 3, 2), {0: 0, 1: 0}, ("*", "v4", "v2")),
    ]
    problem = nonlinear(
        model(
            2, rows, [NONNEGATIVE, BOXED], common=COMMON, start={1: 0.5}, binary=binary
        )
    )
    common = [
        ("+", ("*", 1.5, "v0"), COMMON[0][1]),
        COMMON[1][1],
        ("-", COMMON[2][1], "v1"),
    ]
    expressions = [("sum", ("*", 2.5, "v0"), "v3", "v4"), ("*", "v4", "v2")]
    z = np.array([0.4, 1.3])
    check_functions(problem, expressions, z, common)
    assert problem.x0.tolist() == [0, 0.5]
    assert problem.lower.tolist() == [0, -1]
    assert problem.upper.tolist() == [np.inf, 2]


def test_free_variables_match_equations_by_size_and_fixed_ones_are_constant():
    rows = [
        (EQUATION, {0: 1, 2: 0.01}, ("sin", "v1")),
        ((5, 1, 2), {1: 1, 3: 2}, 0),
        ((4, 7), {0: 0.1, 2: 5}, ("exp", "v1")),
    ]
    bounds = [FREE, NONNEGATIVE, FREE, (4, 3.5)]
    file = InputFile("model.nl", model(4, rows, bounds, start={2: 1}))
    problem = file.nonlinear
    assert list(problem.names) == ["v0", "v1", "v2"]
    z = np.array([1.0, 0.5, 2.0])
    assert problem.values(z) == pytest.approx(
        [1 + 0.02 + np.sin(0.5), 0.5 + 7, 0.1 + 10 + np.exp(0.5) - 7]
    )
    assert np.abs(jacobian(problem, z).diagonal()).tolist() == [1, 1, 5]
    assert file.data.conditions.values(z).tolist() == [1, 0.5, 2, 3.5]


@pytest.mark.parametrize("number", [50, 250])
def test_equation_that_no_free_variable_occurs_in_is_paired_with_any(number):
    """h(x) = 0 belongs to its multiplier, which does not occur in it; dense and
    sparse."""
    rows = [((5, 1, j + 1), {j: 1, number: -1}, 0) for j in range(number)]
    rows += [((4, 1), dict.fromkeys(range(number), 1), ("*", "v0", "v0"))]
    problem = nonlinear(model(number + 1, rows, [NONNEGATIVE] * number + [FREE]))
    z = np.arange(number + 1.0) / number
    assert problem.values(z)[-1] == pytest.approx(z[:-1].sum() - 1)
    assert problem.jacobian(z).shape == (number + 1, number + 1)


def test_linear_model_is_a_linear_problem_with_its_decimals(tmp_path):
    rows = [
        ((5, 1, 1), {0: 0.1, 1: 1}, ("+", ("*", 0.2, "v0"), -0.3)),
        (EQUATION, {0: -1}, ("neg", ("/", ("-", "v1", 7), 10))),
    ]
    file = tmp_path / "model.nl"
    file.write_bytes(model(2, rows, [NONNEGATIVE, FREE]))
    problem = read(file)
    assert dense(problem.M) == pytest.approx(np.array([[0.3, 1], [-1, -0.1]]))
    assert problem.q.tolist() == [-0.3, 0.7]
    assert list(problem.names) == ["v0", "v1"]
    exact = read_exact(str(file))
    assert [Fraction(row[0], row[1]) for row in exact.rows] == [Fraction(3, 10), 10]


def test_a_name_that_is_missing_in_the_file_beside_is_told(tmp_path):
    file = tmp_path / "model.nl"
    file.write_bytes(model(2, [((5, 1, 2), {1: 1}, -1)], [(4, 1), NONNEGATIVE]))
    (tmp_path / "model.col").write_text("fixed\n")
    with pytest.raises(
        ProblemError,
        match=r"model\.col: has 1 name, but .* has the variable v1; write both again",
    ):
        read(file)


LINEAR = [((5, 1, 1), {0: 1}, -1)]


def test_objective_has_its_decimals_and_its_constant():
    objective = ("+", ("*", 0.1, "v0"), ("-", 0.3, "v1"))
    rows, bounds = [*LINEAR, (EQUATION, {1: 1}, 0)], [NONNEGATIVE, FREE]
    found = InputFile("m.nl", model(2, rows, bounds, objective=objective)).objective
    assert found.costs == [Fraction(1, 10), -1]
    assert found.sense == "min"
    assert found.constant == Fraction(3, 10)
    constant = model(1, LINEAR, [NONNEGATIVE], objective=7)
    assert InputFile("m.nl", constant).objective is None


@pytest.mark.parametrize("binary", [False, True])
def test_file_that_is_cut_off_anywhere_is_refused(binary):
    rows = [
        ((5, 1, 1), {0: 2.5, 1: 0.5}, ("min", "v2", "v1", 3)),
        ((5, 3, 2), {0: 1}, ("*", "v1", "v2")),
    ]
    content = model(
        2, rows, [NONNEGATIVE, BOXED], common=COMMON[:1], start={1: 0.5}, binary=binary
    )
    whole = problem_of(content, "model.nl")
    assert isinstance(whole, NonlinearProblem)
    for end in range(len(content.rstrip())):
        # In a text the last number may lose digits, which nothing shows.
        if binary or end < len(content.rstrip()) - 1:
            with pytest.raises(ProblemError):
                problem_of(content[:end], "model.nl")


def test_start_is_that_of_each_variable_wherever_its_unknown_stands():
    """The first variable is no unknown, as its bounds fix it."""
    rows = [
        ((5, 1, 2), {}, ("+", ("exp", "v1"), -2.0)),
        ((5, 1, 3), {}, ("+", ("exp", "v2"), "v0")),
    ]
    problem = nonlinear(
        model(3, rows, [(4, 1), NONNEGATIVE, NONNEGATIVE], start={1: 5.0, 2: 7.0})
    )
    assert problem.x0.tolist() == [5.0, 7.0]


def test_entries_of_a_large_sparse_jacobian_stand_where_differences_put_them():
    n = 300
    rows = [
        ((5, 1, i + 1), {i: 2.0, (i + 7) % n: -1.0}, ("square", f"v{(i * 13 + 5) % n}"))
        for i in range(n)
    ]
    problem = nonlinear(model(n, rows, [NONNEGATIVE] * n))
    z, steps = default_rng(0).random(n), 1e-6 * np.eye(n)
    by_differences = np.array(
        [(problem.values(z + step) - problem.values(z - step)) / 2e-6 for step in steps]
    ).T
    assert issparse(problem.jacobian(z))
    np.testing.assert_allclose(jacobian(problem, z), by_differences, atol=1e-6)


@pytest.mark.parametrize(
    "constant", [b"s" + struct.pack("<h", 2), b"l" + struct.pack("<i", 2)]
)
def test_constants_of_every_size_in_binary_files_are_read(constant):
    rows = [((5, 1, 1), {0: 1}, ("+", ("^", "v0", 2.0), -3.0))]
    content = model(1, rows, [NONNEGATIVE], binary=True)
    assert content.count(b"n" + struct.pack("<d", 2.0)) == 1
    problem = nonlinear(content.replace(b"n" + struct.pack("<d", 2.0), constant))
    assert problem.values(np.array([3.0])).tolist() == [9.0]


@pytest.mark.parametrize(
    ("kind", "number"), [(0, "1"), (1, "2"), (4, "1.5"), (5, "1.5")]
)
def test_suffixes_of_variables_and_of_constraints_may_be_whole_or_real_numbers(
    kind, number
):
    content = model(1, [((5, 1, 1), {0: 1}, -3.0)], [NONNEGATIVE])
    at = content.index(b"r\n")
    suffixed = content[:at] + f"S{kind} 1 scale\n0 {number}\n".encode() + content[at:]
    assert run(problem_of(suffixed, "model.nl")).z.tolist() == [3.0]


def test_row_that_is_the_constant_0_is_0():
    problem = nonlinear(
        model(
            2,
            [((5, 1, 1), {}, 0.0), ((5, 1, 2), {1: 1.0}, ("square", "v1"))],
            [NONNEGATIVE] * 2,
        )
    )
    assert problem.values(np.array([1.0, 2.0])).tolist() == [0.0, 6.0]


def test_values_and_not_multipliers_of_another_solver_are_its_solution(tmp_path):
    file, written = tmp_path / "model.nl", tmp_path / "model.sol"
    file.write_bytes(
        model(
            2,
            [((5, 1, i + 1), {i: 1.0}, -float(i + 1)) for i in range(2)],
            [NONNEGATIVE] * 2,
        )
    )
    written.write_text(
        "other solver\n\nOptions\n3\n1\n1\n0\n2\n2\n2\n2\n0.5\n0.25\n1\n2\nobjno 0 0\n"
    )
    assert InputFile.read(str(file)).solution_in(str(written)) == [1, 2]
