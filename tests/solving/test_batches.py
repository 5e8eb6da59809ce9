"""`lcpcli.solve_many` with an M for each q: what `run` says of each problem, and arrays that hold solutions alone."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import lcpcli
from lcpcli import Batch, Problem
from lcpcli.errors import OptionError, ProblemError
from lcpcli.solving import direct_run
from lcpcli.typing import Vector

from .. import mixed_problems
from .test_many_columns import assert_same

B = 12
M, Q = [[[2.0, 1], [1, 2]], [[2, 0], [0, 4]]], [[-5.0, -6], [-4, 2]]
NONE = [[0.0, 1.0], [1.0, 0.0]], [-1.0, 1.0]  # a problem without a solution
NOT_SOLVED = lcpcli.solve(*NONE)


def batch_of(*given: Any, **options: Any) -> Batch:
    return lcpcli.solve_many(*given, **options)


def random_batch(n: int, generator: np.random.Generator) -> tuple[Vector, Vector]:
    matrices = np.array([mixed_problems.monotone(n, generator)[0] for _ in range(B)])
    return matrices, 3 * generator.standard_normal((B, n))


@pytest.mark.usefixtures("way")
@pytest.mark.parametrize("n", [1, 2, 7, 30])
def test_results_are_those_of_run(n: int) -> None:
    generator = np.random.default_rng(n)
    M, q = random_batch(n, generator)
    each = np.array([mixed_problems.with_all_bounds(n, generator) for _ in range(B)])
    unit, far = (np.zeros(n), 1.0), (-1.0, np.where(np.arange(n) % 2, 1e25, 5.0))
    for low, high in ((0.0, np.inf), unit, (each[:, 0], each[:, 1]), far):
        batch = batch_of(M, q, lower=low, upper=high)
        assert batch.solved.all()
        for i, result in enumerate(batch):
            own = [bound[i] if np.ndim(bound) == 2 else bound for bound in (low, high)]
            assert_same(result, lcpcli.solve(M[i], q[i], lower=own[0], upper=own[1]))
            assert np.array_equal(batch.z[i], result.z)
            assert np.allclose(
                batch.w[i], result.w, rtol=0, atol=1e-12 * float(np.abs(M[i]).max() + np.abs(q[i]).max())
            )


@pytest.mark.usefixtures("way")
@settings(max_examples=25)
@given(
    arrays(float, (6, 3, 3), elements=st.integers(-2, 2)),
    arrays(float, (6, 3), elements=st.integers(-2, 2)),
    st.sampled_from([(0.0, np.inf), (-1.0, 1.0), (0.0, [1.0, np.inf, 2.0])]),
)
def test_small_integers_are_decided_as_by_solve(M: Vector, q: Vector, bounds: tuple[Any, Any]) -> None:
    """Among them degenerate problems, singular blocks, several solutions and none."""
    low, high = bounds
    batch = batch_of(M, q, lower=low, upper=high)
    for i, result in enumerate(batch):
        alone = lcpcli.solve(M[i], q[i], lower=low, upper=high)
        assert result.status is alone.status
        assert batch.solved[i] == result.solved
        if result.solved:
            assert lcpcli.check(alone.problem, batch.z[i]).accepted


@pytest.mark.usefixtures("way")
def test_a_problem_without_a_solution_has_rows_of_nan_and_keeps_its_proof() -> None:
    batch = batch_of([*M, NONE[0]], [*Q, NONE[1]])
    assert batch.solved.tolist() == [True, True, False]
    assert np.isnan(batch.z).all(axis=1).tolist() == np.isnan(batch.w).all(axis=1).tolist() == [False, False, True]
    assert batch[2].message == lcpcli.solve(*NONE).message
    assert batch[2].z.shape == (2,)
    assert repr(batch) == "<Batch: 2 of 3 problems solved, n = 2>"


@pytest.mark.usefixtures("way")
def test_numbers_far_from_one_are_left_to_run() -> None:
    scale = 2.0**300
    batch = batch_of(np.array(M) * scale, np.array(Q) * scale)
    assert batch.solved.all()
    assert np.allclose(batch.z, batch_of(M, Q).z, rtol=1e-12)


def test_a_batch_is_a_sequence_of_results() -> None:
    batch = batch_of(M, Q)
    assert len(batch) == 2
    assert [result.z.tolist() for result in batch] == batch.z.tolist()
    assert batch[-1] is batch[np.int64(1)]
    assert [result.problem.q.tolist() for result in batch[::-1]] == Q[::-1]
    with pytest.raises(IndexError):
        batch[2]
    again = pickle.loads(pickle.dumps(batch))
    assert again.z.tolist() == batch.z.tolist()
    assert again[0].iterations == batch[0].iterations
    assert not batch.z.flags.writeable


@pytest.mark.usefixtures("way")
def test_methods_options_and_limits_are_those_of_run() -> None:
    for options in ({"method": "lemke"}, {"trace": True}, {"finish": True, "method": "fixed-point"}):
        batch = batch_of(M, Q, **options)
        assert batch.solved.all()
        assert {result.method for result in batch} == {options.get("method", "auto")}
        assert all((result.trace is not None) is ("trace" in options) for result in batch)
    given = random_batch(20, np.random.default_rng(3))
    for limits, word in ({"max_iterations": 1}, "iteration_limit"), ({"time_limit": 1e-9}, "time_limit"):
        batch = batch_of(*given, **limits)
        assert not batch.solved.any()
        assert {result.status.word for result in batch} == {word}
    with pytest.raises(OptionError, match="is not an option of auto"):
        batch_of(M, Q, nonsense=1)


def test_arrays_of_any_layout_are_taken_and_may_change_after_the_call() -> None:
    expected, gradient = batch_of(M, Q).z.tolist(), batch_of(M, Q).gradient(np.ones((2, 2))).q.tolist()
    assert batch_of([np.array(M[0]), M[1]], Q).z.tolist() == expected
    assert batch_of(np.array(M, dtype=np.float32), np.array(Q, dtype=np.float32)).z.tolist() == expected
    assert batch_of(np.array(M).transpose(0, 2, 1), np.array(Q)[:, ::-1][:, ::-1]).z.tolist() == expected
    matrices, q = np.array(M), np.array(Q)
    batch = batch_of(matrices, q)
    matrices[:], q[:] = 0.0, 1.0
    assert batch[0].problem.M.tolist() == M[0]
    assert batch.gradient(np.ones((2, 2))).q.tolist() == gradient
    assert not isinstance(lcpcli.solve_many(M[0], np.array(Q).T), Batch)
    assert not isinstance(lcpcli.solve_many([Problem(M[0], Q[0])]), Batch)


def test_no_problems_are_an_empty_batch() -> None:
    batch = batch_of(np.zeros((0, 3, 3)), np.zeros((0, 3)))
    assert (len(batch), list(batch), batch.z.shape, batch.w.shape) == (0, [], (0, 3), (0, 3))
    assert batch.gradient(np.zeros((0, 3))).M.shape == (0, 3, 3)


@pytest.mark.parametrize("bounds", [{}, {"lower": np.zeros((3, 0)), "upper": np.ones((3, 0))}, {"lower": -1.0}])
def test_problems_without_unknowns_are_solved(bounds: dict[str, Any]) -> None:
    batch = batch_of(np.zeros((3, 0, 0)), np.zeros((3, 0)), **bounds)
    assert batch.solved.all()
    assert batch.z.shape == batch.w.shape == batch.gradient(np.zeros((3, 0))).lower.shape == (3, 0)
    assert batch.derivative(dq=np.zeros((3, 0))).z.shape == (3, 0)


class Loaded(Exception):
    """The kernels were asked for."""


@pytest.mark.parametrize("bounds", [{}, {"lower": -1.0, "upper": 1.0}])
def test_a_list_asks_for_the_kernels_before_its_first_problem_if_it_is_long(
    bounds: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    def load() -> None:
        raise Loaded

    monkeypatch.setattr(direct_run, "uses_kernels", lambda wanted, number: number >= 5 if wanted is None else wanted)
    monkeypatch.setattr(direct_run, "compiled", load)
    problems = [Problem(M[0], Q[0], **bounds)] * 5
    with pytest.raises(Loaded):
        next(lcpcli.solve_many(problems))
    for few in (problems[:4], iter(problems)):
        assert all(result.solved for result in lcpcli.solve_many(few))


def test_problems_that_a_batch_leaves_to_run_are_given_the_kernels_if_it_is_large(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[Any] = []

    def run(*_: Any, **given: Any) -> lcpcli.Result:
        asked.append(given)
        return NOT_SOLVED

    monkeypatch.setattr("lcpcli.solving.batch.run", run)
    monkeypatch.setattr(direct_run, "uses_kernels", lambda wanted, number: number == 2 if wanted is None else wanted)
    batch_of([NONE[0]] * 2, [NONE[1]] * 2, lower=[0.0, 0.0], upper=1e30)
    batch_of([NONE[0]], [NONE[1]])
    assert [given["compiled"] for given in asked] == [True, True, False]


BAD: dict[str, tuple[Any, Any, dict[str, Any]]] = {
    "M: has shape (2, 2, 3); give one square matrix": (np.ones((2, 2, 3)), Q, {}),
    "M[1][0][1]: is not a finite number": ([M[0], [[1, np.nan], [0, 1]]], Q, {}),
    "M[1]: has shape (1, 1) where M[0] has (2, 2)": ([M[0], [[1]]], Q, {}),
    "q: has shape (2, 3); give shape (2, 2)": (M, np.ones((2, 3)), {}),
    "q: has 1 dimension; give shape (2, 2)": (M, [1, 2], {}),
    "q[1][0]: is the text 'x'": (M, [[1, 2], ["x", 1]], {}),
    "lower: has shape (3, 2); give shape (2, 2)": (M, Q, {"lower": np.zeros((3, 2))}),
    "upper: has 3 entries for 2 unknowns": (M, Q, {"upper": [1, 2, 3]}),
    "problem 1: lower[0]: is 2, above upper[0] = 1": (M, Q, {"lower": [[0, 0], [2, 0]], "upper": 1}),
}


@pytest.mark.parametrize("message", BAD)
def test_what_cannot_be_used_is_one_clear_error(message: str) -> None:
    M, q, options = BAD[message]
    with pytest.raises(ProblemError) as caught:
        batch_of(M, q, **options)
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


def test_each_problem_of_a_batch_that_is_solved_in_parts_has_its_own_matrix() -> None:
    compiled = pytest.importorskip("lcpcli.kernels.compiled")
    n = 100
    b = 2 * (compiled.NUMBERS_AT_ONCE // n**2) + 1  # three parts
    factors = np.arange(1.0, b + 1)
    batch = batch_of(factors[:, np.newaxis, np.newaxis] * np.eye(n), -np.ones((b, n)), compiled=True)
    assert batch.solved.all()
    assert np.allclose(batch.z, 1 / factors[:, np.newaxis], rtol=1e-12)
