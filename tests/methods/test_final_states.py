"""What is decided about solutions in which rounding hides terms of a row, and at what expense."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem
from lcpcli.gallery.rigid_bodies import contact_in_time
from lcpcli.methods.final_states import MOST_LOOKS, confirmed, is_doubtful
from lcpcli.solving import direct_run
from lcpcli.verify import exact_solution
from lcpcli.verify.exact_solution import ExactBases

from .. import exact

A = np.array([[1.0, 0, 0], [0, 3.5, -3.5], [0, -3.5, 3.5]])
DISC = np.block([[A, np.array([[0.0], [1], [1]])], [np.array([[0.3, -1, -1, 0]])]])


def on_the_floor(slip: float) -> Problem:
    """A disc on the floor: normal and tangential impulses, and the speed at which it slides."""
    return Problem(DISC, [-0.00981, slip, -slip, 0])


@pytest.fixture
def looks(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[int]]:
    """The exact basic solutions that were computed."""
    made, at = list[int](), ExactBases.at

    def counted(self: ExactBases, basis: np.ndarray) -> object:
        made.append(basis.size)
        return at(self, basis)

    monkeypatch.setattr(ExactBases, "at", counted)
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


def test_boxes_at_rest_take_a_few_exact_systems_at_most(looks: list[int]) -> None:
    """Their states hang on velocities of 1e-17, which rounding of impulses of 1 makes."""
    for boxes in (1, 2):
        scene, of_step = contact_in_time("tower", boxes, 1), list[int]()
        solver = lcpcli.Solver(np.eye(4))
        for step in range(70):
            problem = scene.problem()
            looks.clear()
            solver.update(problem.M)
            result = solver.solve(problem.q)
            of_step += [len(looks)] * (step >= 55)
            assert lcpcli.check(problem, result.z).accepted
            scene.advance(result.z)
        assert np.median(of_step) <= 3


def test_what_rounding_hides_is_decided_exactly() -> None:
    """w_2 is 1/3 less the double next to it and 1e-17 more, and decides whether z_2 is 0; with the double above, it is
    not."""
    M = np.array([[3.0, 0, 0], [1, 1, 1], [0, 0, 1]])
    for own in (-1 / 3, -np.nextafter(1 / 3, 1)):
        problem = Problem(M, [-1.0, own, -1e-17])
        found = confirmed(problem, np.array([1 / 3, 0.0, 1e-17]))
        assert found is not None
        solution = exact.solution(problem)
        assert solution is not None
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
    found, solution = confirmed(problem, z), exact.solution(problem)
    if found is not None and is_doubtful(problem, z):
        assert solution is not None
        states = found.z > 0
        none = ([0] * n, [np.inf] * n)
        words = ["basic" if own else "lower" for own in states]
        near = exact.of_states(*exact._rational(problem), *none, words)
        assert near is not None
        assert found.z == pytest.approx([float(value) for value in near], rel=1e-11)


def test_few_exact_systems_are_solved_where_states_go_round(looks: list[int]) -> None:
    scene = contact_in_time("tower", 2, 3, 0.3)
    for _ in range(30):
        problem = scene.problem()
        looks.clear()
        result = lcpcli.solve(problem.M, problem.q)
        assert len(looks) <= 2 * MOST_LOOKS
        scene.advance(result.z)


def test_boxes_at_rest_are_decided_by_the_tree_before_exact_pivoting(monkeypatch: pytest.MonkeyPatch) -> None:
    """A box on the floor has states that hang on velocities of 1e-18, and pivoting from them goes round."""
    made = list[int]()
    pivoting = exact_solution.from_point
    monkeypatch.setattr(exact_solution, "from_point", lambda *given: made.append(1) or pivoting(*given))
    routes = set[str]()
    for seed in range(6):
        scene = contact_in_time("heap", 1, seed, (0.5, 0.3, 0.8)[seed % 3])
        for _ in range(80):
            if not scene.contacts:
                scene.advance()
                continue
            problem = scene.problem()
            result = lcpcli.solve(problem.M, problem.q)
            assert result.solved
            routes |= set(result.route)
            scene.advance(result.z)
    assert "exact" in routes
    assert not made
