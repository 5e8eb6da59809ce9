"""Finishing turns a nearly right active set into the solution, and leaves a method alone where it cannot."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.sparse import csr_array

from lcpcli import Problem
from lcpcli.linalg import factors
from lcpcli.methods.newton import FINISH, finish
from lcpcli.methods.stages import Breakdown, Ending, Finished, Iterate, Stage, Stalled
from lcpcli.model.box import ORTHANT
from lcpcli.typing import Matrix, Vector
from lcpcli.verify.basic_solution import BLOCK_PATIENCE, BasicSolutions, Safeguard

from .grids import line
from .planted import matrix
from .stages import scripted, through


def constant(x: Vector, ending: Ending | None = None, times: int = 5) -> Stage:
    """A method that has found its active set and goes nowhere."""
    return scripted((Iterate(x.copy(), None, "", k) for k in range(times)), ending)


def with_solution(M: Matrix, seed: int) -> tuple[Problem, Vector]:
    """A problem whose solution is known, nondegenerate, and the x that has its signs."""
    generator = np.random.default_rng(seed)
    x = generator.standard_normal(M.shape[0])
    z, w = 2 * np.maximum(x, 0), 2 * np.maximum(-x, 0)
    return Problem(M, w - M @ z, solutions=[z]), x


@pytest.mark.parametrize("n", [5, factors.MOST_NUMPY_ROWS + 20])
@pytest.mark.parametrize("kind", ["dense", "sparse", "nonsymmetric"])
def test_right_signs_give_the_solution_to_rounding(n: int, kind: str) -> None:
    M = matrix("monotone" if kind == "nonsymmetric" else "definite", n, np.random.default_rng(1))
    problem, x = with_solution(csr_array(M) if kind == "sparse" else M, 2)
    *_, last = finish(problem, None, constant(np.sign(x) * np.random.default_rng(3).uniform(0.1, 1, n)))
    assert last.step == FINISH
    z = ORTHANT.z_of(last.x)
    rounding = 1e-13 * (np.abs(M) @ z + np.abs(problem.q)).max()
    assert np.abs(np.minimum(z, problem.w(z))).max() <= rounding


@pytest.mark.parametrize("seed", range(8))
def test_a_few_wrong_signs_are_corrected(seed: int) -> None:
    """Nearly always: for 14 of the first 3000 seeds the number of wrong signs does not fall; there it gives up."""
    problem, x = with_solution(line(40, 4.0).toarray(), seed)
    x[np.random.default_rng(seed).choice(40, 3, replace=False)] *= -1
    *_, last = finish(problem, None, constant(x))
    assert last.step == FINISH
    assert np.allclose(ORTHANT.z_of(last.x), problem.solutions[0], rtol=0, atol=1e-12)


def test_iterates_are_passed_on_unchanged_before() -> None:
    problem, x = with_solution(np.diag([1.0, 2.0, 3.0]), 5)
    iterates, _ = through(constant(x))
    passed = list(finish(problem, None, scripted(iterates)))
    assert passed[:-1] == iterates[: len(passed) - 1]
    assert passed[-1].step == FINISH


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_degenerate_solution_is_recognised(sign: float) -> None:
    M, z = line(3).toarray(), np.array([1.0, 0.0, 0.0])
    problem = Problem(M, np.array([0.0, 0.0, 1.0]) - M @ z)  # z_2 = w_2 = 0
    *_, last = finish(problem, None, constant(np.array([1.0, sign, -1.0])))
    assert last.step == FINISH
    assert np.allclose(ORTHANT.z_of(last.x), z, rtol=0, atol=1e-15)


@pytest.mark.parametrize("sparse", [False, True])
@pytest.mark.parametrize("ending", [Finished(), Stalled("rounding"), Breakdown("no more")])
def test_singular_block_leaves_the_method_its_ending(sparse: bool, ending: Ending) -> None:
    M = np.ones((3, 3))
    problem = Problem(csr_array(M) if sparse else M, np.array([-1.0, -2.0, -3.0]))
    iterates, found = through(finish(problem, None, constant(np.ones(3), ending)))
    assert all(iterate.step == "" for iterate in iterates)
    assert found == ending


def test_active_set_of_the_start_counts_too() -> None:
    problem, x = with_solution(np.diag([1.0, 2.0, 3.0]), 5)
    lengths = [len(list(finish(problem, start, constant(x)))) for start in (None, x)]
    assert lengths[1] == lengths[0] - 1


def test_first_attempt_comes_after_two_steps_without_a_change_of_the_active_set() -> None:
    """As long as attempts cost no more than the evaluations of the method so far."""
    problem, x = with_solution(np.diag([1.0, 2.0, 3.0]), 5)
    for others in range(4):
        changing = [Iterate((-1.0) ** k * x, None, "", k) for k in range(others, 0, -1)]
        iterates = scripted(iter([*changing, *[Iterate(x.copy(), None, "", 99)] * 9]))
        steps = [iterate.step for iterate in finish(problem, None, iterates)]
        assert steps == [""] * (others + 3) + [FINISH]


def test_a_method_that_ends_is_finished_at_its_last_iterate() -> None:
    problem, x = with_solution(np.diag([1.0, 2.0, 3.0]), 7)
    steps = [iterate.step for iterate in finish(problem, None, constant(x, Stalled("here"), times=1))]
    assert steps == ["", FINISH]


def test_attempts_cost_no_more_products_than_the_method_has_made(monkeypatch: pytest.MonkeyPatch) -> None:
    random, tries, original = np.random.default_rng(8), [], BasicSolutions.at
    monkeypatch.setattr("lcpcli.methods.newton.MAX_CHANGE", 1.0)
    monkeypatch.setattr("lcpcli.methods.newton._products", lambda *_: 10.0)
    monkeypatch.setattr(BasicSolutions, "at", lambda *given: tries.append(given) or original(*given))
    problem = Problem(matrix("definite", 60, random), random.standard_normal(60))
    list(finish(problem, None, scripted(Iterate(2 * np.eye(60)[k % 60] - 1, None, "", k) for k in range(200))))
    assert 2 <= len(tries) <= 30


def test_sparse_blocks_are_not_made_dense() -> None:
    problem, x = with_solution(line(20_000, 4.0), 11)
    *_, last = finish(problem, None, constant(x))
    assert last.step == FINISH
    assert np.allclose(ORTHANT.z_of(last.x), problem.solutions[0], rtol=0, atol=1e-12)


def test_one_sign_is_exchanged_at_a_time_only_while_block_exchanges_find_nothing_better() -> None:
    """After as many steps without fewer wrong signs as the patience of the rule, and until there are fewer."""
    safeguard = Safeguard(6, math.inf)
    exchanged = []
    for count in (3, *[4] * (BLOCK_PATIENCE + 2), 2, 3):
        wrong = np.arange(6) < count
        safeguard.choose(wrong, count)
        exchanged.append(np.flatnonzero(wrong).tolist())
    assert exchanged == [[0, 1, 2], *[[0, 1, 2, 3]] * (BLOCK_PATIENCE - 1), *[[0]] * 3, [0, 1], [0, 1, 2]]
