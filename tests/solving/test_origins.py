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
from hypothesis.extra.numpy import arrays
from scipy import sparse

from lcpcli import Problem, Status, check, from_game, from_qp, read, run, write
from lcpcli.verify.point import Criterion, Point

from ..conftest import read_exact

PORTFOLIO_Q = [[0.10, 0.02, 0.01], [0.02, 0.06, 0.00], [0.01, 0.00, 0.03]]
PORTFOLIO_ROWS = [[1, 1, 1], [-1, -1, -1], [0.12, 0.08, 0.04]], [1, -1, 0.07]
BATTLE = [[3, 0], [0, 2]], [[2, 0], [0, 3]]


@settings(max_examples=60)
@given(st.data())
def test_strategies_are_best_responses_to_each_other(data: st.DataObject) -> None:
    m, k = data.draw(st.integers(1, 5)), data.draw(st.integers(1, 5))
    scale, offset = data.draw(st.sampled_from([(1, 0), (1e6, 3e6), (1e-3, 0.1), (0.1, -7)]))
    A, B = (scale * data.draw(arrays(float, (m, k), elements=st.integers(-4, 4))) + offset for _ in range(2))
    result = run(from_game(A, B), "auto")
    assert result.solved
    answer = result.answer
    x, y, payoffs, gains = answer.row, answer.column, answer.payoffs, answer.gains
    assert min(*x, *y) >= 0
    assert (x.sum(), y.sum()) == pytest.approx((1, 1))
    assert payoffs == pytest.approx((x @ A @ y, x @ B @ y))
    best = max(A[i] @ y for i in range(m)), max(x @ B[:, j] for j in range(k))
    assert best == pytest.approx(payoffs, abs=1e-7 * scale, rel=1e-12)
    assert max(gains) <= 1e-7 * scale
    assert answer.statement.startswith("an equilibrium")
    verification = check(result.problem, np.concatenate((x, y)))
    assert verification.accepted
    assert verification.strategies.payoffs == pytest.approx(payoffs)
    even = check(result.problem, np.repeat((1 / m, 1 / k), (m, k))).strategies
    regret = A.mean(axis=1).max() - A.mean(), B.mean(axis=0).max() - B.mean()
    assert even.gains == pytest.approx(regret, abs=1e-9 * scale)


def test_strategies_that_are_not_an_equilibrium_are_reported_as_such() -> None:
    result = run(from_game(*BATTLE), "auto")
    wrong = replace(result, point=Point(Criterion(result.problem), np.array([1.0, 0.0, 0.0, 1.0]))).answer
    assert (wrong.payoffs, wrong.gains) == ((0, 0), (2, 2))
    words = "not an equilibrium to the tolerance: by a best response the row player would gain 2, the column player 2"
    assert wrong.statement == words


@pytest.mark.parametrize(
    ("Q", "words"),
    [
        ([[2, 0], [0, 1]], "x is the unique minimizer, as Q is positive definite"),
        ([[1, 1], [1, 1]], "x is one of several minimizers, as Q is positive semidefinite"),
        ([[1, 3], [3, 1]], "need not be a minimizer: Q is not positive semidefinite"),
    ],
)
def test_what_a_solution_is_depends_on_convexity(Q: list[list[float]], words: str) -> None:
    assert run(from_qp(Q, [-1, -1], [[-1, -1]], [-4])).answer.statement.endswith(words)


@settings(max_examples=30)
@given(st.floats(10, 40), st.integers(0, 2**20))
def test_one_of_several_minimizers_is_said_whatever_the_last_digits_of_x(moved: float, seed: int) -> None:
    """Dantzig's transport program: New York may be served from either plant, at the same cost."""
    result = run(read("problems/programs/transport.json"), "auto")
    x = np.array([moved, 300, 0, 325 - moved, 0, 275, 0, 0, 0.225, 0.153, 0.126])
    z = x * (1 + 2e-16 * np.random.default_rng(seed).integers(0, 4, x.size))
    again = replace(result, point=Point(Criterion(result.problem), z))
    assume(again.solved)
    assert again.answer.statement == "x is one of several minimizers of the linear program"


UNBOUNDED = "the program is unbounded below"


@pytest.mark.parametrize(
    ("c", "A", "b", "statement"),
    [
        ([-1], [[1], [-1]], [2, -1], "the program is infeasible: no x satisfies its constraints"),
        ([-1], [[1]], [-2], UNBOUNDED),
        ([-1], [[1]], [2], UNBOUNDED),
        ([0, -1], [[0.1, 0], [-0.1, 0]], [0.3, -0.3], UNBOUNDED),
    ],
)
def test_an_lcp_without_solution_says_why_there_is_no_minimum(c: Any, A: Any, b: Any, statement: str) -> None:
    for matrix in (A, sparse.csr_array(np.array(A, dtype=float))):
        result = run(from_qp(None, c, matrix, b))
        assert (result.status, result.answer.statement) == (Status.INFEASIBLE, statement)


@pytest.mark.parametrize(("options", "sense"), [({"max_iterations": 3}, "min"), ({"time_limit": 1e-9}, "max")])
def test_at_a_limit_the_best_x_of_a_program_is_given_with_its_residual(options: dict[str, Any], sense: str) -> None:
    sign = 1 if sense == "min" else -1
    Q, c = sign * np.array(PORTFOLIO_Q), np.array([1.0, 2.0, 3.0])
    result = run(from_qp(Q, c, *PORTFOLIO_ROWS, sense=sense, constant=7), "shi", **options)
    answer = result.answer
    assert not result.solved
    assert not result.status.has_no_solution
    assert np.array_equal(answer.x, result.z[:3])
    assert np.array_equal(answer.y, sign * result.z[3:])
    assert answer.bound_multipliers.shape == (3,)
    assert answer.objective == pytest.approx(answer.x @ Q @ answer.x / 2 + c @ answer.x + 7)
    assert (answer.proved, answer.exact, answer.ray, answer.certificate) == (None, None, None, None)
    size = f"{result.relative_residual:.1e}"
    words = "x does not solve the program: it is the best iterate, with a relative residual of"
    assert answer.statement == f"{words} {size}"
    record = json.loads(result.to_json())["answer"]
    assert (record["x"], record["objective"], record["proved"]) == (answer.x.tolist(), answer.objective, None)
    game = run(from_game(*BATTLE), "shi", max_iterations=1).answer
    assert (game.row, game.payoffs, game.statement) == (None, None, "not solved, so there are no strategies")


@pytest.mark.parametrize("free", [(), range(0, 3, 2)])
def test_sparse_programs_stay_sparse_and_agree(free: Sequence[int]) -> None:
    dense = from_qp(PORTFOLIO_Q, [1, -1, 0], *PORTFOLIO_ROWS, free=free)
    A = np.array(PORTFOLIO_ROWS[0])
    assert np.array_equal(dense.M, np.block([[np.array(PORTFOLIO_Q), -A.T], [A, np.zeros((3, 3))]]))
    assert dense.q.tolist() == [1, -1, 0, -1, 1, -0.07]
    slim = from_qp(sparse.csc_array(PORTFOLIO_Q), [1, -1, 0], sparse.coo_array(A), PORTFOLIO_ROWS[1], free=free)
    assert sparse.issparse(slim.M)
    assert np.array_equal(slim.M.toarray(), dense.M)
    assert np.array_equal(slim.q, dense.q)
    x, expected = (run(problem).answer.x for problem in (slim, dense))
    assert x == pytest.approx(expected, abs=1e-9)


def test_costs_are_exact_decimals_within_a_factor_of_two() -> None:
    problem = from_game([[0.1, 0.3], [0.2, 0.7]], [[5, 5], [5, 5]])
    assert problem.M[:2, 2:].tolist() == [[1.2, 1.0], [1.1, 0.6]]
    assert problem.M[2:, :2].tolist() == [[1, 1], [1, 1]]
    assert problem.q.tolist() == [-1] * 4


@pytest.mark.parametrize(
    "problem",
    [
        from_qp(PORTFOLIO_Q, [0, 0, 0], *PORTFOLIO_ROWS, name="own"),
        from_qp(PORTFOLIO_Q, [1, -1, 0], free=[2, 0], name="own"),
        from_qp(sparse.csr_array(PORTFOLIO_Q), [1, -1, 0], *PORTFOLIO_ROWS, name="own"),
        from_game([[0.1, 1 / 3]], [[2, -7]], rows=["ä"], columns=["", '"'], name="own"),
    ],
    ids=["qp", "free", "sparse", "game"],
)
def test_files_keep_the_origin_but_for_csv(problem: Problem, tmp_path: Path) -> None:
    for ending in ("json", "npz"):
        write(problem, tmp_path / f"own.{ending}")
        again = read(tmp_path / f"own.{ending}")
        assert again.origin.data() == problem.origin.data()
        assert not (again.M != problem.M).sum()
        first, second = (run(each).answer for each in (problem, again))
        assert type(second) is type(first)
        assert second.statement == first.statement
    write(from_game(*BATTLE), tmp_path / "own.csv")
    assert run(read(tmp_path / "own.csv")).answer is None


def test_exact_minimum_meets_the_conditions_of_the_decimals_as_written(tmp_path: Path) -> None:
    pytest.importorskip("flint")
    from lcpcli.solving.proof import prove

    write(from_qp(PORTFOLIO_Q, [0, 0, 0], *PORTFOLIO_ROWS), tmp_path / "own.json")
    data = read_exact(str(tmp_path / "own.json"))
    exact = prove(lambda: data, run(data.problem)).answer.exact
    x, y = exact["x"], exact["y"]
    Q, A, (b,) = (
        np.array([[Fraction(repr(value)) for value in row] for row in rows])
        for rows in (PORTFOLIO_Q, PORTFOLIO_ROWS[0], [PORTFOLIO_ROWS[1]])
    )
    assert sum(x) == 1
    assert (A @ x).tolist() == b.tolist()
    assert (Q @ x).tolist() == (A.T @ y).tolist()
    assert min(*x, *y) >= 0


@pytest.mark.parametrize("variables", ["1e999", "NaN", "1.5", "0", "true", "null"])
def test_number_of_variables_of_a_program_is_a_whole_number(variables: str, lcp: Any, tmp_path: Any) -> None:
    file = tmp_path / "p.json"
    file.write_text(f'{{"M": [[1]], "q": [-1], "origin": {{"kind": "qp", "variables": {variables}}}}}')
    outcome = lcp("solve", str(file))
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
