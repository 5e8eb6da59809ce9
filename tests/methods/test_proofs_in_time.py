"""What `auto` decides at once: degenerate solutions with w = 0, few unknowns with any bounds, and Z-matrices."""

import numpy as np
import pytest

from lcpcli import Problem, run


@pytest.mark.parametrize("n", [50, 100])
def test_a_solution_with_w_0_is_found_by_one_look_however_many_z_are_rounding_of_0(n: int) -> None:
    random = np.random.default_rng(n)
    A = random.standard_normal((n, n))
    for M in (A, A + A.T):
        z = np.where(random.random(n) < 0.5, 0.0, random.random(n))
        result = run(Problem(M, -M @ z))
        assert result.solved
        assert result.route == ("newton",)


@pytest.mark.parametrize("shift", [0.0, 0.1])
def test_bounds_that_are_no_integers_do_not_cost_the_proof(shift: float) -> None:
    random = np.random.default_rng(3)
    for n in (11, 12, 13, 14):
        problem = Problem(random.integers(-5, 6, (n, n)), random.integers(-10, 11, n), lower=shift, upper=np.inf)
        assert run(problem).status.name in {"SOLVED", "INFEASIBLE", "UNSOLVABLE"}


def test_a_z_matrix_without_a_solution_is_proved_infeasible() -> None:
    M = np.diag(np.full(30, 1.0)) - np.diag(np.full(29, 2.0), 1) - np.diag(np.full(29, 2.0), -1)
    result = run(Problem(M, np.where(np.arange(30) == 3, -1.0, 1.0)))
    assert result.status.name == "INFEASIBLE"
