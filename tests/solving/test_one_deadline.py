"""Whatever is part of a run with a time limit ends with it, and nothing else does."""

from __future__ import annotations

import math

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem, Status
from lcpcli.interrupts import remaining, within
from lcpcli.options import Limits
from lcpcli.solving import reference
from lcpcli.solving.driver import run

SWAPS = Problem(np.kron(np.eye(3), [[0, 1], [1, 0]]), -np.ones(6))  # with faces of solutions


@pytest.mark.parametrize("method", ["milp", "fixed-point", "newton"])
def test_a_run_that_is_part_of_another_one_ends_with_it(method: str) -> None:
    problem = Problem([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0])
    assert run(problem, method).solved
    with within(-1.0):
        assert run(problem, method).status is Status.TIME_LIMIT


def test_no_context_is_open_between_pieces() -> None:
    found = lcpcli.solutions(SWAPS, time_limit=60.0)
    for _ in found:
        assert remaining() == math.inf
    assert found.complete


def test_a_search_ends_with_what_it_is_part_of() -> None:
    found = lcpcli.solutions(SWAPS, time_limit=60.0)
    with within(-1.0):
        assert not list(found)
    assert found.others is None


def test_reference_that_is_not_found_in_time_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = Problem([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0])
    seen: list[float] = []

    def seeing(problem: Problem, z: np.ndarray) -> None:  # noqa: ARG001
        seen.append(remaining())

    monkeypatch.setattr(reference, "_exact", seeing)
    with within(2.0):
        assert reference.with_reference(problem).reference == "computed"
    assert reference.with_reference(problem).reference == "computed"
    assert 0 < seen[0] <= 2 < seen[1] <= reference.REFERENCE_SECONDS


def test_digits_have_half_of_the_time_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[float] = []
    monkeypatch.setattr("lcpcli.verify.digits.digits", lambda *_: seen.append(remaining()))
    solved = run(Problem([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0]), "newton", limits=Limits(time_limit=100.0))
    assert solved.digits is None
    assert 40 < seen[0] <= 50
