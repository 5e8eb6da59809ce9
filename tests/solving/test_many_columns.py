"""`lcpcli.solve_many` gives for each column of Q, or for each Problem, what `run` gives, in order and as asked for."""

from __future__ import annotations

from itertools import count, islice
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem, Result
from lcpcli.errors import OptionError, ProblemError
from lcpcli.solving import many
from lcpcli.typing import Vector

from .. import mixed_problems

K = 40
TOL = 1e-10


def hidden_definite(n: int, generator: np.random.Generator) -> tuple[Vector, Vector]:
    """A P-matrix that is not definite, and Q; definite but for the units of its rows and columns."""
    M, _ = mixed_problems.monotone(n, generator)
    R, C = 10 ** generator.uniform(-1, 1, (2, n))
    return R[:, np.newaxis] * M * C, 3 * R[:, np.newaxis] * generator.standard_normal((n, K))


def assert_same(ours: Result, theirs: Result) -> None:
    assert (ours.status, ours.method, ours.message) == (theirs.status, theirs.method, theirs.message)
    assert np.allclose(ours.z, theirs.z, rtol=1e-9, atol=1e-10 * float(np.abs(theirs.z).max()))
    assert ours.basis == theirs.basis
    assert ours.relative_residual <= TOL
    largest = float(np.abs(theirs.problem.q).max()) + float(np.abs(theirs.problem.M).max() * np.abs(ours.z).max())
    assert abs(ours.residual - lcpcli.check(theirs.problem, ours.z).residual) <= 1e-14 * largest
    assert ours.limits == theirs.limits
    assert ours.options | {"compiled": True} == theirs.options | {"compiled": True}, "with the kernels or without"
    assert list(ours.to_dict()) == list(theirs.to_dict())
    assert min(ours.parts.values()) >= 0.0 < ours.seconds
    assert ours.parts.keys() == theirs.parts.keys()


@pytest.mark.parametrize(
    ("n", "order"),
    [(7, "walk"), *(pytest.param(n, "random", marks=pytest.mark.slow("each is solved twice")) for n in (1, 30))],
)
def test_results_are_those_of_run(n: int, order: str) -> None:
    generator = np.random.default_rng(n)
    M, Q = hidden_definite(n, generator)
    k = 8 if n == 7 else K
    if order == "walk":
        Q = Q[:, :1] + 0.02 * np.cumsum(Q[:, :k], axis=1)
    each = [mixed_problems.with_all_bounds(n, generator) for _ in range(k)]
    per_column, far = np.array(each).transpose(1, 2, 0), (each[0][0] + 1e4, each[0][1] + 1e4)
    for low, high in ((0.0, np.inf), (0.0, 1.0), each[0], per_column, (None, None), far):
        results = list(lcpcli.solve_many(M, Q, lower=low, upper=high))
        assert len(results) == k
        for j, result in enumerate(results):
            own = [bound[:, j] if np.ndim(bound) == 2 else bound for bound in (low, high)]
            problem = Problem(M, Q[:, j], lower=own[0], upper=own[1])
            assert result.problem.q.tolist() == Q[:, j].tolist()
            assert_same(result, lcpcli.run(problem))


@pytest.mark.parametrize("n", [12, 250])
def test_sparse_matrices_are_solved_and_stay_sparse_and_rounding_is_refined_away(n: int) -> None:
    M = csr_array(4 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    Q = np.random.default_rng(0).standard_normal((n, 3))
    for result, q in zip(lcpcli.solve_many(M, Q), Q.T, strict=True):
        assert result.problem.M.nnz == M.nnz
        assert np.allclose(result.z, lcpcli.solve(M, q).z, rtol=0, atol=1e-8)
        assert result.solved
    R = np.linalg.qr(np.random.default_rng(0).standard_normal((12, 12)))[0]
    M = (R * np.logspace(0, -6, 12)) @ R.T
    results = lcpcli.solve_many((M + M.T) / 2, np.random.default_rng(1).standard_normal((12, K)))
    assert all(result.solved and result.relative_residual <= 1e-14 for result in results)


SINGULAR = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, -1.0]]
COLUMNS = {  # of a matrix that is no P-matrix, with the status of each
    (-1.0, 1.0, 1.0): "solved",
    (-1.0, -1.0, 1.0): "infeasible",
    (2.0, 0.0, 3.0): "solved",
    (1.0, 2.0, -1.0): "infeasible",
    (-3.0, 0.0, 0.0): "solved",
}


def test_columns_without_a_solution_keep_their_place_and_their_proof() -> None:
    results = list(lcpcli.solve_many(SINGULAR, np.array(list(COLUMNS)).T))
    assert [result.status.word for result in results] == list(COLUMNS.values())
    for result in results:
        assert (result.certificate is None) is result.solved
        assert result.message == lcpcli.run(result.problem).message


@pytest.mark.slow("many random problems")
@given(
    arrays(float, (3, 3), elements=st.integers(-2, 2)),
    arrays(float, (3, 5), elements=st.integers(-2, 2)),
    st.sampled_from([(0.0, np.inf), (-1.0, 1.0), (0.0, [1.0, np.inf, 2.0])]),
)
def test_small_integers_are_decided_as_by_solve(M: Vector, Q: Vector, bounds: tuple[Any, Any]) -> None:
    """Among them degenerate problems, singular blocks, several solutions and none."""
    low, high = bounds
    for result, q in zip(lcpcli.solve_many(M, Q, lower=low, upper=high), Q.T, strict=True):
        alone = lcpcli.solve(M, q, lower=low, upper=high)
        assert result.status is alone.status
        assert lcpcli.check(alone.problem, result.z).accepted is result.solved


def test_columns_are_solved_as_they_are_asked_for() -> None:
    """All of them would take minutes."""
    results = lcpcli.solve_many(np.eye(2), np.broadcast_to([[-1.0], [2.0]], (2, 10**7)))
    assert next(results).z.tolist() == [1.0, 0.0]
    assert all(result.solved for result in islice(results, 1000))


def test_columns_of_the_smallest_numbers_are_solved_up_to_the_grid_of_doubles_near_0() -> None:
    """No double z has 0.75 z = 5e-324; the nearest one solves it, and 0 does not."""
    Q = np.full((1, 5), -5e-324)
    for result in (lcpcli.solve([[0.75]], Q[:, 0]), *lcpcli.solve_many([[0.75]], Q)):
        assert lcpcli.check(result.problem, result.z).accepted is result.solved
        assert result.solved is bool(result.z[0])


def test_seconds_of_all_columns_together_are_those_of_their_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock goes on by one second each time it is read."""
    readings = count(1.0)
    monkeypatch.setattr(many, "seconds", lambda: next(readings))
    M, Q = hidden_definite(5, np.random.default_rng(0))
    seconds = [result.seconds for result in lcpcli.solve_many(M, np.tile(Q, 5)) if result.solved]
    passed = next(readings) - 1.0
    assert 0.5 * passed <= sum(seconds) <= passed
    assert (len(seconds), len(set(seconds)) <= 2) == (5 * K, True), "equal in each of the two blocks"


def test_problems_are_read_and_solved_as_they_are_asked_for() -> None:
    read: list[float] = []
    stream = (read.append(q) or Problem([[2.0]], [q]) for q in (-2.0, 1.0, -6.0))
    results = lcpcli.solve_many(stream, "lemke", tol=1e-9)
    assert read == []
    first = next(results)
    assert (read, first.method, first.tol, first.z.tolist()) == ([-2.0], "lemke", 1e-9, [1.0])
    assert [result.z.tolist() for result in results] == [[0.0], [3.0]]


def test_options_have_the_effect_that_they_have_on_solve_and_what_is_given_is_never_changed() -> None:
    M, Q = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([[-5.0, 1.0], [-6.0, -1.0]])
    before = M.copy(), Q.copy()
    for options in (
        {"tol": 1e-6},
        {"max_iterations": 0},
        {"time_limit": 1e-9},
        {"method": "shi", "p": 1e9},
        {"method": "lemke"},
        {"z0": [1.0, 1.0]},
        {"trace": True},
        {"trace": False, "scale": False, "x0": None},
    ):
        for result, q in zip(lcpcli.solve_many(M, Q, **options), Q.T, strict=True):
            alone = lcpcli.solve(M, q, **options)
            assert (result.status, result.method, result.limits) == (alone.status, alone.method, alone.limits)
            assert (result.trace is None) is (alone.trace is None)
            assert result.options == alone.options
            result.z[:] = result.w[:] = 7.0
    assert (M.tolist(), Q.tolist()) == (before[0].tolist(), before[1].tolist())
    assert next(lcpcli.solve_many(M, Q.astype(np.float32))).solved
    for k in (0, 1, 2):
        assert [result.z.tolist() for result in lcpcli.solve_many([[2.0]], [[-4.0, 3.0][:k]])] == [[2.0], [0.0]][:k]


I2 = np.eye(2)


@pytest.mark.parametrize(
    ("given", "options", "message"),
    [
        ((I2, [1.0, 2.0]), {}, r"^Q: has 1 dimension; give .* one, np.reshape\(Q, \(-1, 1\)\)"),
        ((I2, np.ones((3, 2))), {}, r"^Q: has shape \(3, 2\), but M is 2 x 2; give .* column, as Q.T here"),
        ((I2, np.ones((2, 2, 2))), {}, "^Q: has 3 dimensions"),
        ((I2, [[1.0, np.nan], [1.0, 2.0]]), {}, r"^Q\[0\]\[1\]: is not a finite number"),
        ((I2, csr_array(I2)), {}, "^Q: is sparse; give a dense array"),
        ((I2[:1], I2), {}, "^M: is 1 x 2; make it square"),
        ((I2,), {}, "^Q: is missing"),
        (([1.0],), {}, r"^problem: is a number; make it by Problem\(M, q\)"),
        ((I2, I2), {"lower": np.ones((2, 3))}, r"^lower: has shape \(2, 3\), but Q has \(2, 2\)"),
        ((I2, I2), {"lower": [0.0, 0.0, 0.0]}, "^lower: has 3 entries for 2 unknowns"),
        ((I2, I2), {"upper": [[1.0, -1.0], [1.0, 1.0]]}, r"^column 1: lower\[0\]: is 0, above upper\[0\] = -1"),
        (([],), {"upper": 1.0}, "^upper: has no effect on Problems"),
        ((I2, I2), {"tolerance": 0.1}, "^tolerance: is not an option of auto"),
    ],
)
def test_what_cannot_be_used_is_said(given: tuple[Any, ...], options: dict[str, Any], message: str) -> None:
    with pytest.raises((ProblemError, OptionError), match=message):
        list(lcpcli.solve_many(*given, **options))


@pytest.mark.parametrize("n", [12, 150])
def test_no_component_is_below_zero_where_basic_ones_are_zero(n: int) -> None:
    """For z with zeros and w = 0, rounding makes some basic components negative."""
    rng = np.random.default_rng(n)
    A = rng.normal(size=(n, n))
    Z = np.maximum(rng.normal(size=(n, 60)), 0.0)
    M = A @ A.T + np.eye(n)
    for result in lcpcli.solve_many(M, -M @ Z):
        assert result.solved
        assert result.z.min() >= 0
