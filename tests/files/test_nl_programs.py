"""Programs in .nl files: what is read is what an evaluator of its own finds in their
expressions, and files with no program that is solved are refused in a line."""

import random

import numpy as np
import pytest

import lcpcli
from lcpcli import read
from lcpcli.errors import ProblemError
from lcpcli.formulations.nonlinear_model import program
from lcpcli.formulations.quadratic_program.program import Program
from lcpcli.linalg.matrices import dense, is_sparse
from lcpcli.model.problem import conditions_of

from ..conftest import read_exact
from .nl_writing import model, value

FREE, NONNEGATIVE, BOXED, FIXED = (3,), (2, 0), (0, -1, 2), (4, 0.5)
INF = np.inf
# The sides of rows in the format, and what they are.
SIDES = {
    (2, 1): (1, INF),
    (1, 3): (-INF, 3),
    (0, -1, 4): (-1, 4),
    (4, 0.5): (0.5, 0.5),
    (3,): (-INF, INF),
}
N = 4


def linear(rng, depth=2):
    if not depth:
        return rng.choice([f"v{rng.randrange(N)}", rng.randint(-4, 4) / 4])
    a, b = linear(rng, depth - 1), linear(rng, depth - 1)
    number = rng.choice([-2, 0.5, 3])
    return rng.choice(
        [
            ("+", a, b),
            ("-", a, b),
            ("*", number, a),
            ("*", a, number),
            ("/", a, number),
            ("neg", a),
            ("sum", a, b, linear(rng, 0)),
            ("^constant", a, 1),
        ]
    )


def quadratic(rng, depth=2):
    if not depth:
        a, b = linear(rng), linear(rng)
        return rng.choice([("*", a, b), ("square", a), ("^constant", a, 2), a])
    a, b = quadratic(rng, depth - 1), quadratic(rng, depth - 1)
    number = rng.choice([-2, 0.5, 3])
    choices = [("+", a, b), ("-", a, b), ("*", number, a), ("/", b, number)]
    return rng.choice([*choices, ("neg", a), ("sum", a, b, linear(rng, 1))])


def program_of(problem):
    assert isinstance(problem.origin, Program)
    data = problem.origin.blocks(conditions_of(problem))
    assert data is not None
    return problem.origin, data


def of_linear_part(factors, x):
    return sum(factor * x[j] for j, factor in factors.items())


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("binary", [False, True], ids=["text", "binary"])
def test_objective_and_rows_are_those_of_the_expressions(
    binary, seed, tmp_path, monkeypatch
):
    """Dense, or as sparse matrices."""
    monkeypatch.setattr(program, "LARGEST_DENSE", 200 * (seed % 2))
    rng = random.Random(seed)
    common = [({0: 1.5}, linear(rng)), ({}, ("+", "v1", f"v{N}"))]
    objective = ("+", quadratic(rng), ("*", f"v{N + 1}", "v0"))
    rows = [
        (
            side,
            {j: rng.randint(-3, 3) for j in range(N)},
            ("+", linear(rng), ("*", f"v{N}", 2)),
        )
        for side in SIDES
    ]
    bounds = [FREE, NONNEGATIVE, BOXED, FIXED]
    file = tmp_path / "program.nl"
    options = {"common": common, "objective": objective, "binary": binary}
    file.write_bytes(model(N, rows, bounds, **options))
    problem = read(file)
    origin, data = program_of(problem)
    assert is_sparse(problem.M) == (seed % 2 == 0)
    assert data.lower.tolist() == [-INF, 0, -1, 0.5]
    assert data.upper.tolist() == [INF, INF, 2, 0.5]
    low, high = np.array([*SIDES.values()]).T
    for _ in range(5):
        x = np.array([rng.uniform(-2, 2) for _ in range(N)])
        variables = {f"v{j}": x[j] for j in range(N)}
        for k, (own, expression) in enumerate(common, N):
            variables[f"v{k}"] = of_linear_part(own, x) + value(expression, variables)
        found = x @ dense(data.Q) @ x / 2 + data.c @ x + origin.constant
        assert found == pytest.approx(value(objective, variables), abs=1e-9)
        activities = [
            of_linear_part(own, x) + value(e, variables) for _, own, e in rows
        ]
        for found, side in ((data.row_lower, low), (data.row_upper, high)):
            assert found - dense(data.A) @ x == pytest.approx(side - activities)
    assert read_exact(str(file)).w([0] * problem.n) is not None


def test_program_is_solved_checked_and_written_with_its_names(tmp_path):
    objective = ("+", ("square", ("-", "v0", 0.1)), ("*", 2, ("square", "v1")))
    content = model(
        2, [((4, 1), {0: 1, 1: 1}, 0)], [NONNEGATIVE] * 2, objective=objective
    )
    file = tmp_path / "share.nl"
    file.write_bytes(content)
    (tmp_path / "share.col").write_text("stock\nbond\n")
    (tmp_path / "share.row").write_text("budget\ncost\n")
    problem = read(file)
    assert problem.names == ["stock", "bond", "budget"]
    answer = lcpcli.run(problem).answer
    assert answer.x == pytest.approx([0.7, 0.3])
    assert answer.objective == pytest.approx(0.54)
    assert answer.y == pytest.approx([1.2])
    assert answer.proved == "unique_optimum"
    lcpcli.write(problem, tmp_path / "share.mps")
    assert lcpcli.run(read(tmp_path / "share.mps")).answer.x == pytest.approx(
        [0.7, 0.3]
    )
    with pytest.raises(ProblemError, match="is a program"):
        lcpcli.read_nl(file)


def test_equations_that_determine_all_variables_keep_the_objective(tmp_path):
    file = tmp_path / "square.nl"
    rows = [((4, 2), {0: 1, 1: 1}, 0), ((4, 4), {0: 2, 1: 2}, 0)]
    objective = ("+", ("square", "v0"), ("*", 2, ("square", "v1")))
    file.write_bytes(model(2, rows, [FREE] * 2, objective=objective))
    result = lcpcli.run(read(file))
    assert result.solved
    assert result.answer.x == pytest.approx([4 / 3, 2 / 3])


def test_constant_objective_asks_for_a_feasible_point(tmp_path):
    file = tmp_path / "feasible.nl"
    rows = [((4, 2), {0: 1, 1: 1}, 0), ((4, 1), {0: 1, 1: -1}, 0)]
    file.write_bytes(model(2, rows, [NONNEGATIVE] * 2, objective=0))
    result = lcpcli.run(read(file))
    assert result.solved
    assert result.answer.x == pytest.approx([1.5, 0.5])


def test_constant_objective_leaves_a_square_system_a_system(tmp_path):
    file = tmp_path / "system.nl"
    rows = [((4, 1), {0: 2}, 0), ((4, 2), {0: 1, 1: 1}, 0)]
    file.write_bytes(model(2, rows, [FREE] * 2, objective=0))
    problem = read(file)
    assert not isinstance(problem.origin, Program)
    assert lcpcli.run(problem).z == pytest.approx([0.5, 1.5])
