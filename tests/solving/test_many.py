"""`lcpcli.solve_many` gives for each column of Q, for each Problem, or with an M for
each q, what `run` gives, in order and as asked for.
"""

import pickle
from itertools import count, islice

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.random import default_rng
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem
from lcpcli.solving import many

from .. import mixed_problems
from .conftest import assert_same


@pytest.mark.parametrize("n", [12, 250])
def test_sparse_matrices_are_solved_and_stay_sparse_and_rounding_is_refined_away(n):
    M = csr_array(4 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    Q = default_rng(0).standard_normal((n, 3))
    for result, q in zip(lcpcli.solve_many(M, Q), Q.T, strict=True):
        assert result.problem.M.nnz == M.nnz
        assert np.allclose(result.z, lcpcli.solve(M, q).z, rtol=0, atol=1e-8)
        assert result.solved
    R = np.linalg.qr(default_rng(0).standard_normal((12, 12)))[0]
    M = (R * np.logspace(0, -6, 12)) @ R.T
    results = lcpcli.solve_many((M + M.T) / 2, default_rng(1).standard_normal((12, 40)))
    assert all(
        result.solved and result.relative_residual <= 1e-14 for result in results
    )


def test_columns_are_solved_as_they_are_asked_for():
    """All of them would take minutes."""
    results = lcpcli.solve_many(np.eye(2), np.broadcast_to([[-1.0], [2.0]], (2, 10**7)))
    assert next(results).z.tolist() == [1.0, 0.0]
    assert all(result.solved for result in islice(results, 200))


def test_columns_of_the_smallest_numbers_are_solved_up_to_the_grid_near_0():
    """No double z has 0.75 z = 5e-324; the nearest one solves it, and 0 does not."""
    Q = np.full((1, 5), -5e-324)
    for result in (lcpcli.solve([[0.75]], Q[:, 0]), *lcpcli.solve_many([[0.75]], Q)):
        assert lcpcli.check(result.problem, result.z).accepted is result.solved
        assert result.solved is bool(result.z[0])


def test_seconds_of_all_columns_together_are_those_of_their_blocks(monkeypatch):
    """The clock goes on by one second each time it is read."""
    readings = count(1.0)
    monkeypatch.setattr(many, "seconds", lambda: next(readings))
    Q = default_rng(0).standard_normal((2, 200))
    seconds = [result.seconds for result in lcpcli.solve_many([[2, 1], [1, 2]], Q)]
    passed = next(readings) - 1.0
    assert 0.5 * passed <= sum(seconds) <= passed
    assert len(set(seconds)) <= 2, "equal in each of the two blocks"


def test_problems_are_read_and_solved_as_they_are_asked_for():
    read = []
    stream = (read.append(q) or Problem([[2.0]], [q]) for q in (-2.0, 1.0, -6.0))
    results = lcpcli.solve_many(stream, "lemke", tol=1e-9)
    assert read == []
    first = next(results)
    assert read == [-2.0]
    assert first.method == "lemke"
    assert first.tol == 1e-9
    assert first.z.tolist() == [1.0]
    assert [result.z.tolist() for result in results] == [[0.0], [3.0]]


def test_options_mean_what_they_mean_to_solve_and_nothing_given_is_changed():
    M, Q = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([[-5.0, 1.0], [-6.0, -1.0]])
    before = M.copy(), Q.copy()
    for options in (
        {"tol": 1e-6},
        {"max_iterations": 0},
        {"time_limit": 1e-9},
        {"method": "shi", "p": 1e9},
        {"z0": [1.0, 1.0]},
        {"trace": True},
        {"trace": False, "scale": False, "x0": None},
    ):
        columns = lcpcli.solve_many(M, Q, **options)
        batch = lcpcli.solve_many([M, M], Q.T, **options)
        for one, other, q in zip(columns, batch, Q.T, strict=True):
            alone = lcpcli.solve(M, q, **options)
            for result in (one, other):
                assert result.status == alone.status
                assert result.method == alone.method
                assert result.limits == alone.limits
                assert (result.trace is None) is (alone.trace is None)
                assert result.options == alone.options
            one.z[:] = one.w[:] = 7.0
    assert M.tolist() == before[0].tolist()
    assert Q.tolist() == before[1].tolist()
    for k in (0, 1, 2):
        assert [
            result.z.tolist()
            for result in lcpcli.solve_many([[2.0]], [[-4.0, 3.0][:k]])
        ] == [[2.0], [0.0]][:k]


B = 4
M, Q = [[[2.0, 1], [1, 2]], [[2, 0], [0, 4]]], [[-5.0, -6], [-4, 2]]
NONE = [[0.0, 1.0], [1.0, 0.0]], [-1.0, 1.0]  # a problem without a solution


def random_batch(n, generator):
    matrices = np.array([mixed_problems.monotone(n, generator)[0] for _ in range(B)])
    return matrices, 3 * generator.standard_normal((B, n))


@pytest.mark.usefixtures("way")
@pytest.mark.parametrize("n", [1, 7, 30])
def test_results_of_a_batch_and_of_columns_are_those_of_run(n):
    generator = default_rng(n)
    M, q = random_batch(n, generator)
    each = np.array([mixed_problems.with_all_bounds(n, generator) for _ in range(B)])
    unit, far = (np.zeros(n), 1.0), (-1.0, np.where(np.arange(n) % 2, 1e25, 5.0))
    for low, high in (
        (0.0, np.inf),
        unit,
        (each[:, 0], each[:, 1]),
        far,
        (-np.inf, np.inf),
    ):
        batch = lcpcli.solve_many(M, q, lower=low, upper=high)
        assert batch.solved.all()
        columns = lcpcli.solve_many(
            M[0], q.T, lower=np.transpose(low), upper=np.transpose(high)
        )
        for i, (result, column) in enumerate(zip(batch, columns, strict=True)):
            own = [bound[i] if np.ndim(bound) == 2 else bound for bound in (low, high)]
            for matrix, found in (M[i], result), (M[0], column):
                assert found.problem.q.tolist() == q[i].tolist()
                assert_same(
                    found, lcpcli.solve(matrix, q[i], lower=own[0], upper=own[1])
                )
            assert np.array_equal(batch.z[i], result.z)
            largest = float(np.abs(M[i]).max() + np.abs(q[i]).max())
            assert np.allclose(batch.w[i], result.w, rtol=0, atol=1e-12 * largest)


@pytest.mark.usefixtures("way")
@settings(max_examples=8)
@given(
    arrays(float, (6, 3, 3), elements=st.integers(-2, 2)),
    arrays(float, (6, 3), elements=st.integers(-2, 2)),
    st.sampled_from([(0.0, np.inf), (-1.0, 1.0), (0.0, [1.0, np.inf, 2.0])]),
)
def test_small_integers_are_decided_as_by_solve(M, q, bounds):
    """Of a batch, and of columns. Among them degenerate problems, singular blocks,
    several solutions and none."""
    low, high = bounds
    columns = lcpcli.solve_many(M[0], q.T, lower=low, upper=high)
    for matrices, results in (
        (M, lcpcli.solve_many(M, q, lower=low, upper=high)),
        ([M[0]] * 6, columns),
    ):
        for matrix, own, result in zip(matrices, q, results, strict=True):
            alone = lcpcli.solve(matrix, own, lower=low, upper=high)
            assert result.status is alone.status
            assert not result.solved or lcpcli.check(alone.problem, result.z).accepted


@pytest.mark.usefixtures("way")
def test_a_problem_without_a_solution_has_rows_of_nan_and_keeps_its_proof():
    batch = lcpcli.solve_many([*M, NONE[0]], [*Q, NONE[1]])
    assert batch.solved.tolist() == [True, True, False]
    assert (
        np.isnan(batch.z).all(axis=1).tolist()
        == np.isnan(batch.w).all(axis=1).tolist()
        == [False, False, True]
    )
    assert batch[2].message == lcpcli.solve(*NONE).message
    assert batch[2].z.shape == (2,)
    assert repr(batch) == "<Batch: 2 of 3 problems solved, n = 2>"


def test_a_batch_is_a_sequence_of_results():
    batch = lcpcli.solve_many(M, Q)
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
    assert not batch.solved.flags.writeable


def test_no_problems_are_an_empty_batch_and_those_without_unknowns_are_solved():
    batch = lcpcli.solve_many(np.zeros((0, 3, 3)), np.zeros((0, 3)))
    assert len(batch) == 0
    assert list(batch) == []
    assert batch.z.shape == (0, 3)
    assert batch.w.shape == (0, 3)
    assert batch.gradient(np.zeros((0, 3))).M.shape == (0, 3, 3)
    for bounds in ({}, {"lower": np.zeros((3, 0)), "upper": np.ones((3, 0))}):
        batch = lcpcli.solve_many(np.zeros((3, 0, 0)), np.zeros((3, 0)), **bounds)
        assert batch.solved.all()
        assert (
            batch.z.shape
            == batch.w.shape
            == batch.gradient(np.zeros((3, 0))).lower.shape
            == (3, 0)
        )
        assert batch.derivative(dq=np.zeros((3, 0))).z.shape == (3, 0)


def test_each_problem_of_a_batch_that_is_solved_in_parts_has_its_own_matrix():
    compiled = pytest.importorskip("lcpcli.kernels.compiled")
    n = 100
    b = 2 * (compiled.NUMBERS_AT_ONCE // n**2) + 1  # three parts
    factors = np.arange(1.0, b + 1)
    batch = lcpcli.solve_many(
        factors[:, np.newaxis, np.newaxis] * np.eye(n), -np.ones((b, n)), compiled=True
    )
    assert batch.solved.all()
    assert np.allclose(batch.z, 1 / factors[:, np.newaxis], rtol=1e-12)


def test_pivoting_counts_in_the_time_of_a_problem_that_another_method_ends(monkeypatch):
    # Of the pivoting alone.
    monkeypatch.setattr(many, "seconds", count(step=1e6).__next__)
    M = [[[2.0, 1.0], [1.0, 2.0]], [[0.0, 0.0], [0.0, 0.0]]]
    q = [[-5.0, -6.0], [-1.0, -1.0]]
    batch = lcpcli.solve_many(M, q)
    assert batch.solved.tolist() == [True, False]
    assert min(result.seconds for result in batch) >= 1e6


@pytest.mark.usefixtures("way")
@pytest.mark.parametrize("factor", [1e-61, 1.0, 2.0**300])
def test_numbers_far_from_one_are_left_to_the_run_of_each_problem(factor):
    M = factor * np.array([[1.0, 3.0, 2.0], [2.0, 0.0, 3.0], [-2.0, 1.0, 2.0]])
    q = np.array([2.0, -1.0, -2.0])
    one, other = lcpcli.solve_many([M], [q])[0], lcpcli.run(Problem(M, q))
    assert one.z.tolist() == other.z.tolist()
    assert one.route == other.route
