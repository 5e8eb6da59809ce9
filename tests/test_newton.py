"""The method `newton` is block principal pivoting with the safeguard that makes it finite on P-matrices."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array

from lcpcli import Limits, Problem, Status, Trace, read, run
from lcpcli.files import shipped


def test_rows_of_the_papers_first_table_are_its_own() -> None:
    """From any start with all components negative: 0; 4, 0, 4, 0; 1, 0, 1, 0, the vector-division rows."""
    trace = Trace()
    run(read(shipped.path("paper-example-1.json")), "newton", [-1.0, -1.0, -1.0, -1.0], trace=trace)
    assert [row.z.tolist() for row in trace.rows[1:]] == [[4.0, 0.0, 4.0, 0.0], [1.0, 0.0, 1.0, 0.0]]


@pytest.mark.parametrize("n", [3, 5, 21])
def test_cycle_of_plain_newton_is_broken(n: int) -> None:
    """M = I + 2 C with the cyclic shift C, n odd, q = e, from x = -e_1: plain steps never end."""
    M = np.eye(n) + 2 * np.roll(np.eye(n), 1, axis=0)
    trace = Trace()
    result = run(Problem(M, np.ones(n)), "newton", 1.0 - 2 * np.eye(n)[0], trace=trace)
    assert result.solved
    assert {"block", "least index"} <= {row.step for row in trace.rows}


@pytest.mark.parametrize("n", [1, 10, 201, 300])
@pytest.mark.parametrize("symmetric", [True, False])
def test_positive_definite_problems_take_a_handful_of_steps(n: int, symmetric: bool) -> None:
    generator = np.random.default_rng(n)
    A, B = generator.uniform(-5, 5, (2, n, n))
    M = A.T @ A + np.eye(n) + (0 if symmetric else B - B.T)
    q = generator.uniform(-500, 500, n)
    dense, sparse = run(Problem(M, q), "newton"), run(Problem(csr_array(M), q), "newton")
    assert dense.solved
    assert dense.iterations <= 12
    assert np.allclose(dense.z, sparse.z, rtol=0, atol=1e-9 * max(1.0, float(np.abs(dense.z).max())))


def test_singular_principal_submatrix_is_a_breakdown() -> None:
    result = run(Problem([[0.0, 1.0], [1.0, 0.0]], [-1.0, 1.0]), "newton")
    assert result.status is Status.BREAKDOWN
    assert "singular" in result.message


def test_matrix_that_is_no_p_matrix_may_keep_it_going() -> None:
    result = run(Problem([[-1.0]], [-1.0]), "newton", limits=Limits(max_iterations=50))
    assert not result.solved
