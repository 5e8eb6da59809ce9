"""Quadratic programs and games become LCPs, and the solutions come back as minima and as equilibria."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import sparse
from scipy.optimize import linprog, minimize

import lcpcli
from lcpcli import Problem, Result, Status, from_game, from_qp, read, run, write
from lcpcli.solving.answer import Equilibrium, Minimum
from lcpcli.verify.point import Criterion, Point

from ..conftest import read_exact

PORTFOLIO_Q = [[0.10, 0.02, 0.01], [0.02, 0.06, 0.00], [0.01, 0.00, 0.03]]
PORTFOLIO_A, PORTFOLIO_B = [[1, 1, 1], [-1, -1, -1], [0.12, 0.08, 0.04]], [1, -1, 0.07]
BATTLE = [[3, 0], [0, 2]], [[2, 0], [0, 3]]


def minimum(result: Result) -> Minimum:
    assert isinstance(result.answer, Minimum)
    return result.answer


def equilibrium(result: Result) -> Equilibrium:
    assert isinstance(result.answer, Equilibrium)
    return result.answer


def entries(*shape: int, least: int = -4) -> st.SearchStrategy[Any]:
    """Arrays of small integers."""
    size = int(np.prod(shape))
    whole = st.lists(st.integers(least, 4), min_size=size, max_size=size)
    return whole.map(lambda values: np.array(values, dtype=float).reshape(shape))


@st.composite
def programs(draw: st.DrawFn) -> dict[str, Any]:
    """Convex programs of a few variables, feasible or not, bounded or not."""
    k, m, rank = draw(st.integers(1, 4)), draw(st.integers(1, 3)), draw(st.integers(0, 4))
    F = draw(entries(k, rank))
    free = draw(st.lists(st.integers(0, k - 1), unique=True))
    return {"Q": F @ F.T, "c": draw(entries(k)), "A": draw(entries(m, k)), "b": draw(entries(m)), "free": free}


@settings(deadline=None, max_examples=150)
@given(programs())
def test_minima_have_multipliers_that_prove_them(program: dict[str, Any]) -> None:
    Q, c, A, b, free = program.values()
    result = run(from_qp(**program), "auto")
    answer = minimum(result)
    bounds = [(None if j in free else 0, None) for j in range(c.size)]
    feasible = linprog(np.zeros(c.size), -A, -b, bounds=bounds).status == 0
    if not result.solved:
        assert result.status is Status.INFEASIBLE
        assert ("infeasible" if not feasible else "unbounded below") in answer.statement
        assert (answer.x, answer.y, answer.objective) == (None, None, None)
        return
    assert feasible
    x, y = answer.x, answer.y
    assert x is not None
    assert y is not None
    bound = np.isin(np.arange(c.size), free, invert=True)
    slope = Q @ x + c - A.T @ y
    assert min(*(A @ x - b), *y, *slope, *x[bound], 0.0) > -1e-7
    assert slope[~bound] == pytest.approx(0, abs=1e-7)
    dual = b @ y - x @ Q @ x / 2
    assert answer.objective == pytest.approx(dual, abs=1e-6, rel=1e-6)
    kind = "of the linear program" if not Q.any() else ", as Q is positive"
    assert answer.statement.startswith("x is ")
    assert kind in answer.statement


@settings(deadline=None, max_examples=30)
@given(programs())
def test_no_point_of_another_solver_is_lower(program: dict[str, Any]) -> None:
    Q, c, A, b, free = program.values()
    Q = program["Q"] = Q + np.eye(c.size)
    result = run(from_qp(**program), "auto")
    assume(result.solved)
    found = minimize(
        lambda x: x @ Q @ x / 2 + c @ x,
        np.ones(c.size),
        jac=lambda x: Q @ x + c,
        bounds=[(None if j in free else 0, None) for j in range(c.size)],
        constraints={"type": "ineq", "fun": lambda x: A @ x - b, "jac": lambda _: A},
        method="SLSQP",
    )
    assume(found.success)
    assert minimum(result).objective == pytest.approx(found.fun, abs=1e-4, rel=1e-4)
    assert minimum(result).x == pytest.approx(found.x, abs=1e-2)
    assert minimum(result).statement == "x is the unique minimizer, as Q is positive definite"


@settings(deadline=None, max_examples=100)
@given(st.data())
def test_strategies_are_best_responses_to_each_other(data: st.DataObject) -> None:
    m, k = data.draw(st.integers(1, 5)), data.draw(st.integers(1, 5))
    scale, offset = data.draw(st.sampled_from([(1, 0), (1e6, 3e6), (1e-3, 0.1), (0.1, -7)]))
    A, B = (scale * data.draw(entries(m, k)) + offset for _ in range(2))
    result = run(from_game(A, B), "auto")
    assert result.solved
    answer = equilibrium(result)
    x, y, payoffs, gains = answer.row, answer.column, answer.payoffs, answer.gains
    assert x is not None
    assert y is not None
    assert payoffs is not None
    assert gains is not None
    assert min(*x, *y) >= 0
    assert (x.sum(), y.sum()) == pytest.approx((1, 1))
    assert payoffs == pytest.approx((x @ A @ y, x @ B @ y))
    best = max(A[i] @ y for i in range(m)), max(x @ B[:, j] for j in range(k))
    assert best == pytest.approx(payoffs, abs=1e-7 * scale, rel=1e-12)
    assert max(gains) <= 1e-7 * scale
    assert answer.statement.startswith("an equilibrium")


def test_strategies_that_are_not_an_equilibrium_are_reported_as_such() -> None:
    result = run(from_game(*BATTLE), "auto")
    point = Point(Criterion(result.problem), np.array([1.0, 0.0, 0.0, 1.0]))
    wrong = equilibrium(replace(result, point=point))
    assert wrong.payoffs == (0, 0)
    assert wrong.gains == (2, 2)
    assert wrong.statement == (
        "not an equilibrium to the tolerance: by a best response the row player would gain 2, the column player 2"
    )


@pytest.mark.parametrize(
    ("Q", "words"),
    [
        ([[2, 0], [0, 1]], "x is the unique minimizer, as Q is positive definite"),
        ([[1, 1], [1, 1]], "x is one of several minimizers, as Q is positive semidefinite"),
        ([[1, 3], [3, 1]], "need not be a minimizer: Q is not positive semidefinite"),
    ],
)
def test_what_a_solution_is_depends_on_convexity(Q: list[list[float]], words: str) -> None:
    answer = minimum(run(from_qp(Q, [-1, -1], [[-1, -1]], [-4]), "auto"))
    assert answer.statement.endswith(words)


@settings(deadline=None, max_examples=60)
@given(st.floats(10, 40), st.integers(0, 2**20))
def test_one_of_several_minimizers_is_said_whatever_the_last_digits_of_x(moved: float, seed: int) -> None:
    """Dantzig's transport program: New York may be served from either plant, at the same cost."""
    result = run(read("problems/programs/transport.json"), "auto")
    x = np.array([moved, 300, 0, 325 - moved, 0, 275, 0, 0, 0.225, 0.153, 0.126])
    z = x * (1 + 2e-16 * np.random.default_rng(seed).integers(0, 4, x.size))
    again = replace(result, point=Point(Criterion(result.problem), z))
    assume(again.solved)
    assert minimum(again).statement == "x is one of several minimizers of the linear program"


@pytest.mark.parametrize(
    ("c", "A", "b", "statement"),
    [
        ([-1], [[1], [-1]], [2, -1], "the program is infeasible: no x satisfies its constraints"),
        ([-1], [[1]], [-2], "the program is unbounded below"),
        ([-1], [[1]], [2], "the program is unbounded below"),
        (
            [0, -1],
            [[0.1, 0], [-0.1, 0]],
            [0.3, -0.3],
            "the program is unbounded below",
        ),
    ],
)
def test_an_lcp_without_solution_says_why_there_is_no_minimum(c: Any, A: Any, b: Any, statement: str) -> None:
    result = run(from_qp(None, c, A, b), "auto")
    assert result.status is Status.INFEASIBLE
    assert minimum(result).statement == statement
    slim = run(from_qp(None, c, sparse.csr_array(np.array(A, dtype=float)), b), "auto")
    assert minimum(slim).statement == statement


@pytest.mark.parametrize("sense", ["min", "max"])
@pytest.mark.parametrize("options", [{"max_iterations": 1}, {"max_iterations": 3}, {"time_limit": 1e-9}])
def test_at_a_limit_the_best_x_of_a_program_is_given_with_its_residual(options: dict[str, Any], sense: str) -> None:
    sign = 1 if sense == "min" else -1
    Q, A, c = sign * np.array(PORTFOLIO_Q), np.array(PORTFOLIO_A), np.array([1.0, 2.0, 3.0])
    result = run(from_qp(Q, c, A, PORTFOLIO_B, sense=sense, constant=7), "shi", **options)
    answer = minimum(result)
    assert not result.solved
    assert not result.status.has_no_solution
    assert answer.x is not None
    assert answer.y is not None
    assert answer.bound_multipliers is not None
    assert np.array_equal(answer.x, result.z[:3])
    assert np.array_equal(answer.y, sign * result.z[3:])
    assert answer.bound_multipliers.shape == (3,)
    assert answer.objective == pytest.approx(answer.x @ Q @ answer.x / 2 + c @ answer.x + 7)
    assert (answer.proved, answer.exact, answer.ray, answer.certificate) == (None, None, None, None)
    size = f"{result.relative_residual:.1e}"
    assert (
        answer.statement == f"x does not solve the program: it is the best iterate, with a relative residual of {size}"
    )
    record = json.loads(result.to_json())["answer"]
    assert (record["x"], record["objective"], record["proved"]) == (answer.x.tolist(), answer.objective, None)


def test_a_run_that_has_not_solved_a_game_has_no_strategies() -> None:
    game = equilibrium(run(from_game(*BATTLE), "shi", max_iterations=1))
    assert (game.row, game.payoffs, game.statement) == (None, None, "not solved, so there are no strategies")


def test_matrices_of_the_lcp_are_those_of_the_program() -> None:
    problem = from_qp([[2, 1], [1, 3]], [4, 5], [[6, 7]], [8])
    assert problem.M.tolist() == [[2, 1, -6], [1, 3, -7], [6, 7, 0]]
    assert problem.q.tolist() == [4, 5, -8]
    assert from_qp([[2, 1], [1, 3]], [4, 5]).M.tolist() == [[2, 1], [1, 3]]
    free = from_qp([[2, 1], [1, 3]], [4, 5], free=[1])
    assert (free.M.tolist(), free.lower.tolist()) == ([[2, 1], [1, 3]], [0, -np.inf])


@pytest.mark.parametrize("free", [(), range(0, 3, 2)])
def test_sparse_programs_stay_sparse_and_agree(free: Sequence[int]) -> None:
    dense = from_qp(PORTFOLIO_Q, [1, -1, 0], PORTFOLIO_A, PORTFOLIO_B, free=free)
    slim = from_qp(sparse.csc_array(PORTFOLIO_Q), [1, -1, 0], sparse.coo_array(PORTFOLIO_A), PORTFOLIO_B, free=free)
    assert sparse.issparse(slim.M)
    assert np.array_equal(slim.M.toarray(), dense.M)
    assert np.array_equal(slim.q, dense.q)
    x, expected = (minimum(run(problem, "auto")).x for problem in (slim, dense))
    assert x == pytest.approx(expected, abs=1e-9)


def test_costs_are_exact_decimals_within_a_factor_of_two() -> None:
    problem = from_game([[0.1, 0.3], [0.2, 0.7]], [[5, 5], [5, 5]])
    assert problem.M[:2, 2:].tolist() == [[1.2, 1.0], [1.1, 0.6]]
    assert problem.M[2:, :2].tolist() == [[1, 1], [1, 1]]
    assert problem.q.tolist() == [-1] * 4


PROBLEMS = {
    "qp": lambda: from_qp(PORTFOLIO_Q, [0, 0, 0], PORTFOLIO_A, PORTFOLIO_B, name="own"),
    "free": lambda: from_qp(PORTFOLIO_Q, [1, -1, 0], free=[2, 0], name="own"),
    "sparse": lambda: from_qp(sparse.csr_array(PORTFOLIO_Q), [1, -1, 0], PORTFOLIO_A, PORTFOLIO_B, name="own"),
    "game": lambda: from_game([[0.1, 1 / 3]], [[2, -7]], rows=["ä"], columns=["", '"'], name="own"),
}


@pytest.mark.parametrize("ending", ["json", "npz"])
@pytest.mark.parametrize("kind", PROBLEMS)
def test_files_keep_the_origin(kind: str, ending: str, tmp_path: Path) -> None:
    problem: Problem = PROBLEMS[kind]()
    write(problem, tmp_path / f"own.{ending}")
    again = read(tmp_path / f"own.{ending}")
    assert problem.origin is not None
    assert again.origin is not None
    assert again.origin.data() == problem.origin.data()
    assert not (again.M != problem.M).sum()
    first, second = (lcpcli.run(each, "auto").answer for each in (problem, again))
    assert first is not None
    assert second is not None
    assert isinstance(second, Equilibrium if kind == "game" else Minimum)
    assert second.statement == first.statement


def test_csv_loses_the_origin(tmp_path: Path) -> None:
    write(from_game(*BATTLE), tmp_path / "own.csv")
    assert run(read(tmp_path / "own.csv"), "auto").answer is None


def test_exact_minimum_meets_the_conditions_of_the_decimals_as_written(tmp_path: Path) -> None:
    pytest.importorskip("flint")
    from lcpcli.solving.proof import prove

    write(PROBLEMS["qp"](), tmp_path / "own.json")
    data = read_exact(str(tmp_path / "own.json"))
    exact = minimum(prove(lambda: data, run(data.problem, "auto"))).exact
    assert exact is not None
    x, y = exact["x"], exact["y"]
    Q, A, b = (decimals(values) for values in (PORTFOLIO_Q, PORTFOLIO_A, [PORTFOLIO_B]))
    assert sum(x) == 1
    assert [sum(a * v for a, v in zip(row, x, strict=True)) for row in A] == b[0]
    for j in range(3):
        assert sum(a * v for a, v in zip(Q[j], x, strict=True)) == sum(A[i][j] * y[i] for i in range(3))
    assert min(*x, *y) >= 0


def decimals(rows: list[list[float]]) -> list[list[Fraction]]:
    return [[Fraction(repr(value)) for value in row] for row in rows]


@pytest.mark.parametrize("variables", ["1e999", "NaN", "Infinity", "1.5", "0", "true", "null"])
def test_number_of_variables_of_a_program_is_a_whole_number(variables: str, lcp: Any, tmp_path: Any) -> None:
    file = tmp_path / "p.json"
    file.write_text(f'{{"M": [[1]], "q": [-1], "origin": {{"kind": "qp", "variables": {variables}}}}}')
    outcome = lcp("solve", str(file))
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
