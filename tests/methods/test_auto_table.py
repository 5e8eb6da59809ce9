"""What auto tries before a search: a few nodes of the tree, the trivial solution, and exchanges from w = 0."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array

from lcpcli import Problem, Status, run
from lcpcli.gallery import families


def test_a_few_nodes_prove_that_there_is_no_solution_before_a_search() -> None:
    """Also where the problem is feasible, but each complementary set is excluded."""
    results = [run(families.make("gaussian", 40, seed)) for seed in (0, 3)]
    assert [result.status for result in results] == 2 * [Status.UNSOLVABLE]
    assert all(result.route[-1] == "milp" and "reflections" not in result.route for result in results)


def test_the_trivial_solution_is_seen_at_once_unless_the_run_has_a_start() -> None:
    problem = families.make("ben-gharbia-gilbert", 51)
    assert problem.x0 is not None
    result = run(problem)
    assert (result.solved, result.evaluations, np.count_nonzero(result.z)) == (True, 0, 0)
    assert run(problem, x0=np.ones(problem.n)).evaluations > 0


@pytest.mark.parametrize("n", [100, 300])
def test_z_matrices_are_exchanged_from_w_0_too(n: int) -> None:
    """From q < 0, each step finds one more of the prices that are held."""
    result = run(families.make("american-put", n))
    assert result.route == (("newton",) if n <= 150 else ("elimination",))


@pytest.mark.parametrize("n", [100, 200, 400, 800])
@pytest.mark.parametrize("sparse", [False, True])
def test_chains_and_trees_of_zeros_take_one_system(n: int, sparse: bool) -> None:
    """Each q_i but those of a few roots is 0: from q < 0, each step finds the children of the last variables."""
    random = np.random.default_rng(n)
    for parents in (np.arange(n) - 1, np.array([int(random.integers(0, max(i, 1))) for i in range(n)])):
        M, q, roots = np.eye(n), np.zeros(n), [0, *random.integers(1, n, size=3).tolist()]
        M[np.arange(1, n), parents[1:]] = -(10.0 ** random.uniform(-3, 3, size=n - 1))
        M[roots] = np.eye(n)[roots]
        q[roots] = -(10.0 ** random.uniform(-3, 3, size=len(roots)))
        result = run(Problem(csr_array(M) if sparse else M, q))
        assert result.solved
        assert result.iterations == 1
