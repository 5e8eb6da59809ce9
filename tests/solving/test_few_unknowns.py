"""Problems of few unknowns are decided where doubles leave it open: in exact arithmetic, in a fraction of a second."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from lcpcli import Problem, Status, run
from lcpcli.typing import Matrix, Vector

from .. import exact


def hidden(n: int, seed: int) -> tuple[Matrix, Vector, Vector]:
    """M positive definite, q, and the only solution: integers, in which numbers up to 1e12 hide others from
    rounding."""
    random = np.random.default_rng(seed)
    F = random.integers(-3, 4, (n, n)).astype(float)
    z = np.where(random.random(n) < 0.5, 0.0, random.integers(1, 5, n))
    z *= np.where(random.random(n) < 0.4, 10.0 ** random.integers(9, 13, n), 1.0)
    M = F @ F.T + np.eye(n)
    return M, -M @ z + np.where(z > 0, 0, random.integers(1, 5, n)), z


@pytest.mark.parametrize("n", [2, 5, 10, 20])
def test_terms_hidden_by_rounding_are_solved_for_too(n: int) -> None:
    for seed in range(4):
        M, q, z = hidden(n, seed)
        result = run(Problem(M, q))
        assert result.solved
        assert result.z == pytest.approx(z, rel=1e-12)


def test_integers_beyond_2_to_the_53_are_taken_as_they_are() -> None:
    """(2^53 + 2) z_1 + z_2 = 1 and z_1 + z_2 = 2^60: only their exact solution has the right signs."""
    problem = Problem([[2.0**53 + 2, 1], [1, 1]], [-1.0, -(2.0**60)])
    solution, result = exact.solution(problem), run(problem)
    assert solution is not None
    assert result.solved
    assert result.z.tolist() == [float(value) for value in solution]


@pytest.mark.parametrize(
    ("M", "q"),
    [
        ([[1e-200]], [-1e200]),
        ([[1e-300, 1], [-1, 1e-300]], [-1e200, -1e250]),
        ([[1e-200, 0], [0, 1]], [-1e200, -1]),
    ],
)
def test_solutions_beyond_the_range_of_doubles_are_called_that(M: Matrix, q: Vector) -> None:
    result = run(Problem(M, q))
    assert result.status is Status.STALLED
    assert "there is a solution, but doubles cannot represent it" in result.message


def test_a_problem_that_is_infeasible_by_less_than_rounding_is_proved_to_be() -> None:
    """3 z_2 >= 1 and 3 z_2 <= 1 - 2^-53 are one inequality up to rounding."""
    problem = Problem([[0, 3], [0, -3]], [-1, 1 - 2.0**-53])
    assert exact.solution(problem) is None
    result = run(problem)
    assert result.status.has_no_solution
    y = [Fraction(value) for value in result.certificate.vector.tolist()]
    assert min(y) >= 0
    assert sum(value * Fraction(part) for value, part in zip(y, problem.q.tolist(), strict=True)) < 0
