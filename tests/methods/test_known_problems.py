"""Problems with known answers: those of the literature and small ones by `lemke`, by `milp` and by linear programs;
random programs without a feasible point or a minimum, which auto decides as they were made."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array

from lcpcli import Problem, Status, run
from lcpcli.methods.linear import linear
from lcpcli.verify.certificate import proves_infeasible
from lcpcli.verify.point import Criterion, Point

from .. import exact
from .programs import random_program, with_rounded_combination
from .stages import through


def murty(n: int) -> NDArray[np.float64]:
    return np.eye(n) + 2 * np.triu(np.ones((n, n)), 1)


def cyclic(n: int, alpha: float) -> NDArray[np.float64]:
    return np.eye(n) + alpha * np.roll(np.eye(n), 1, axis=0)


KNOWN: list[tuple[str, ArrayLike, ArrayLike, ArrayLike]] = [
    ("Kostreva, cycles where ties go to the first index", [[1, 2, 0], [0, 1, 2], [2, 0, 1]], [-1] * 3, [1 / 3] * 3),
    ("Murty", murty(8), -np.ones(8), np.eye(8)[7]),
    ("Murty, 20", murty(20), -np.ones(20), np.eye(20)[19]),
    ("Fathi", murty(12).T @ murty(12), -np.ones(12), np.eye(12)[0]),
    ("Curtis-Han-Robinson", [[4, 5, -5], [5, 9, -5], [-5, -5, 7]], [2, 1, -3], [0, 4 / 19, 11 / 19]),
    ("Ben Gharbia-Gilbert, q = e", cyclic(9, 2.0), np.ones(9), np.zeros(9)),
    ("Ben Gharbia-Gilbert, q = -e", cyclic(9, 2.0), -np.ones(9), np.full(9, 1 / 3)),
    ("growth", np.eye(40) - np.tril(np.ones((40, 40)), -1), -np.ones(40), 2.0 ** np.arange(40)),
    ("units from 1e-6 to 1e6", np.diag(10.0 ** np.arange(-6, 7)), -(10.0 ** np.arange(-6, 7)), np.ones(13)),
    ("one unknown", [[2.0]], [-1.0], [0.5]),
    ("one unknown, q > 0 and M < 0", [[-1.0]], [1.0], [0.0]),
    ("one unknown, q = 0", [[0.0]], [0.0], [0.0]),
    ("q = 0", [[0.0, 1.0], [-1.0, 0.0]], [0.0, 0.0], [0.0, 0.0]),
    ("large", [[2e-9]], [-1e5], [5e13]),
]


@pytest.mark.parametrize("method", ["lemke", "milp"])
@pytest.mark.parametrize(("M", "q", "z"), [row[1:] for row in KNOWN], ids=[row[0] for row in KNOWN])
def test_known_solutions_are_found(M: ArrayLike, q: ArrayLike, z: ArrayLike, method: str) -> None:
    start = -np.ones(len(np.asarray(q))) if method == "lemke" else None
    result = run(Problem(M, q, x0=start), method)
    assert result.solved
    if len(np.asarray(q)) > 1 or np.min(M) > 0:
        assert np.allclose(result.z, z, rtol=1e-15, atol=1e-15)


@pytest.mark.parametrize("method", ["lemke", "milp"])
@pytest.mark.parametrize("n", [2, 5, 8, 12])
def test_hilbert_matrices_are_solved(n: int, method: str) -> None:
    hilbert = 1 / (np.arange(n)[:, None] + np.arange(n) + 1.0)
    assert run(Problem(hilbert, -np.ones(n)), method).solved


@pytest.mark.parametrize(
    ("M", "q"),
    [
        ([[0, 3, 0, 2], [-3, 0, -1, 0], [0, 1, 0, -2], [-2, 0, 2, 0]], [-3, 2, -1, 0]),
        ([[0, 1, -1], [-1, 0, 1], [1, -1, 0]], [-1, 2, 0]),
    ],
    ids=["skew, bipartite", "skew"],
)
def test_solution_for_a_skew_matrix_is_that_of_a_linear_program(M: ArrayLike, q: ArrayLike) -> None:
    problem = Problem(csr_array(np.array(M, dtype=float)), q)
    iterates, _ = through(linear(problem))
    assert Point(Criterion(problem), problem.box.z_of(iterates[-1].x)).solves()


def is_decided(seed: int, most: int) -> bool:
    """Return whether auto says what is so, with whole numbers as a proof that hold exactly."""
    data = random_program(seed, most)
    problem = data.problem()
    result = run(problem, time_limit=1e4)
    if data.has_minimum:
        return result.solved
    certificate = result.certificate
    assert certificate is None or not certificate.is_rounded
    if result.status is not Status.INFEASIBLE or certificate is None or certificate.vector is None:
        return False
    y = certificate.vector
    return bool((y != np.rint(y)).any()) or exact.refutes(problem, [Fraction(value) for value in y.tolist()])


@pytest.mark.parametrize("seed", range(16))
def test_small_integer_programs_are_decided_with_proofs(seed: int) -> None:
    assert is_decided(seed, 30)


@pytest.mark.slow("100 programs")
def test_integer_programs_are_decided_with_proofs() -> None:
    assert [seed for seed in range(100, 200) if not is_decided(seed, 160)] == []


@pytest.mark.parametrize("seed", [1, 2])
def test_contradiction_hidden_by_rounding_is_said_to_be_one_but_for_rounding(seed: int) -> None:
    problem = with_rounded_combination(seed).problem()
    result = run(problem, time_limit=120)
    assert result.status is Status.INFEASIBLE
    if not result.certificate.is_rounded:  # rounding has left a contradiction
        assert proves_infeasible(problem, result.certificate.vector)
        return
    assert "unless terms of a row of Mz that are 1e1" in result.message
    assert result.answer.proved is None
    assert "infeasible up to the rounding of its data" in result.answer.statement
