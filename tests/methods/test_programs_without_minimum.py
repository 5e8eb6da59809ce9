"""auto decides programs without a feasible point or a minimum, as they were made, and proves it."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from lcpcli import Status, run
from lcpcli.verify.certificate import proves_infeasible

from .. import exact
from .programs import random_program, with_rounded_combination


def is_decided(seed: int, most: int) -> bool:
    """Return whether auto says what is so, with whole numbers as a proof that hold exactly."""
    data = random_program(seed, most)
    problem = data.problem()
    result = run(problem, time_limit=10)
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
    result = run(problem, time_limit=10)
    assert result.status is Status.INFEASIBLE
    assert result.certificate is not None
    if not result.certificate.is_rounded:  # rounding has left a contradiction
        assert result.certificate.vector is not None
        assert proves_infeasible(problem, result.certificate.vector)
        return
    assert "unless terms of a row of Mz that are 1e1" in result.message
    assert result.answer.proved is None
    assert "infeasible up to the rounding of its data" in result.answer.statement
