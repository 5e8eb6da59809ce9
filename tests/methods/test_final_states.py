"""What is decided about solutions in which rounding hides terms of a row, and at what expense."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem
from lcpcli.methods.final_states import confirmed, is_doubtful
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.solving import direct_run
from lcpcli.verify import exact_solution

from .. import exact

A = np.array([[1.0, 0, 0], [0, 3.5, -3.5], [0, -3.5, 3.5]])
DISC = np.block([[A, np.array([[0.0], [1], [1]])], [np.array([[0.3, -1, -1, 0]])]])


def on_the_floor(slip: float) -> Problem:
    """A disc on the floor: normal and tangential impulses, and the speed at which it slides."""
    return Problem(DISC, [-0.00981, slip, -slip, 0])


@pytest.fixture
def looks(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[int]]:
    """The exact basic solutions that were computed."""
    made, at = list[int](), exact_solution.exact_basis

    def counted(data: ExactProblem, basis: np.ndarray) -> object:
        made.append(basis.size)
        return at(data, basis)

    monkeypatch.setattr(exact_solution, "exact_basis", counted)
    return made


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("slip", [1e-6, 1e-10, 1e-15, 1e-17, 1e-30])
def test_a_disc_at_rest_needs_no_exact_arithmetic(slip: float, compiled: bool, looks: list[int]) -> None:
    if compiled and direct_run.compiled() is None:
        pytest.skip("needs numba")
    problem = on_the_floor(slip)
    result = lcpcli.solve(problem.M, problem.q, compiled=compiled)
    assert (result.route, looks) == (("newton",), [])
    assert result.z == pytest.approx([0.00981, 0, slip / 3.5, 0], rel=1e-14)


def test_what_rounding_hides_is_decided_exactly() -> None:
    """w_2 is 1/3 less the double next to it and 1e-17 more, and decides whether z_2 is 0; with the double above, it is
    not."""
    M = np.array([[3.0, 0, 0], [1, 1, 1], [0, 0, 1]])
    for own in (-1 / 3, -np.nextafter(1 / 3, 1)):
        problem = Problem(M, [-1.0, own, -1e-17])
        found = confirmed(problem, np.array([1 / 3, 0.0, 1e-17]))
        solution = exact.solution(problem)
        assert found.z.tolist() == [float(value) for value in solution]
        assert (found.z[1] > 0) == (own < -1 / 3)


def test_numbers_that_contradict_each_other_by_less_than_rounding_are_not_confirmed() -> None:
    """z_3 - z_4 is at least 1e-17 and at most -1e-17."""
    M = np.array([[0, 0, 1, -1], [0, 0, -1, 1], [0, 0, 1, 0], [0, 0, 0, 1]])
    problem, z = Problem(M, [-1e-17, -1e-17, -1, -1]), np.array([0.0, 0, 1, 1])
    assert exact.solution(problem) is None
    assert is_doubtful(problem, z)
    assert confirmed(problem, z) is None
    assert lcpcli.run(problem).status.has_no_solution


@pytest.mark.parametrize("seed", range(40))
def test_a_confirmed_solution_of_few_unknowns_is_near_an_exact_one(seed: int) -> None:
    random = np.random.default_rng(seed)
    n = int(random.integers(2, 5))
    F = random.integers(-2, 3, (n, n)).astype(float)
    z = random.integers(0, 2, n) * 10.0 ** random.integers(-17, 2, n)
    problem = Problem(F @ F.T, -F @ F.T @ z + (z == 0) * random.integers(0, 2, n) * 1e-16)
    found = confirmed(problem, z)
    if found is not None and is_doubtful(problem, z):
        states = ["basic" if value > 0 else "lower" for value in found.z]
        near = exact.of_states(*exact._rational(problem), [0] * n, [np.inf] * n, states)
        assert found.z == pytest.approx([float(value) for value in near], rel=1e-11)
