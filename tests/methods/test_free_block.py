"""Free variables of sparse problems, eliminated by sparse factors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array

from lcpcli.basis.free_variables import WithoutFree
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.model.problem import Problem
from lcpcli.solving.call import run


def problem_with_free(n: int, seed: int) -> Problem:
    """Return a monotone problem with n unknowns, every other of which is free."""
    rng = np.random.default_rng(seed)
    A = rng.uniform(-1, 1, (n, n)) * (rng.random((n, n)) < 3 / n)
    M = csr_array(A - A.T + np.diag(rng.uniform(0.5, 1, n)))
    return Problem(M, rng.uniform(-1, 1, n), lower=np.where(np.arange(n) % 2, 0.0, -np.inf))


@pytest.mark.parametrize("n", [6, 40, 101])
def test_solutions_of_the_bounded_variables_are_those_of_the_problem(n: int) -> None:
    problem = problem_with_free(n, n)
    own = WithoutFree(problem)
    inner = run(own.reduced)
    assert inner.solved
    assert own.reduced.n == n // 2
    z, states = own.given(inner.z, own.reduced.box.basis_at(inner.z))
    assert np.abs(problem.box.gaps(z, problem.w(z))).max() <= 1e-12
    assert np.array_equal(states, problem.box.basis_at(z))


def test_a_singular_block_is_not_eliminated() -> None:
    equal = csr_array([[1.0, 1.0, 1.0], [1.0, 1.0, 2.0], [0.0, 1.0, 1.0]])
    for M in (equal, csr_array(np.diag([1.0, 0.0, 1.0]))):
        with pytest.raises(SingularMatrix):
            WithoutFree(Problem(M, np.ones(3), lower=[-np.inf, -np.inf, 0.0]))
    with pytest.raises(SingularMatrix):
        WithoutFree(Problem(csr_array(np.eye(3)), np.ones(3)))
