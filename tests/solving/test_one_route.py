"""A run has one route and one result to the bit, whether it keeps iterates or not, and one deadline for its parts."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import lcpcli
from lcpcli import Problem, Result, Status, Trace
from lcpcli.gallery import families
from lcpcli.interrupts import remaining, within
from lcpcli.options import Limits
from lcpcli.solving import driver, reference
from lcpcli.solving.driver import run

FAMILIES = [("harker-pang", 25), ("contact", 40), ("boxes", 10), ("degenerate", 40), ("qp", 120), ("obstacle", 300)]
SMALL = st.integers(1, 5).flatmap(
    lambda n: st.tuples(*(arrays(float, shape, elements=st.integers(-3, 3)) for shape in ((n, n), n)))
)


def is_same(one: Result, other: Result) -> bool:
    fields = ("status", "message", "route", "iterations", "evaluations", "basis")
    return np.array_equal(one.z, other.z) and all(getattr(one, name) == getattr(other, name) for name in fields)


def check(problem: Problem) -> None:
    plain, kept = lcpcli.run(problem), lcpcli.run(problem, trace=True)
    assert is_same(plain, kept)
    assert is_same(plain, driver.run(problem, "auto", observe=lambda *_: None))
    rows = kept.trace.rows
    if kept.status is lcpcli.Status.SOLVED:
        assert [row.k for row in rows] == list(range(kept.iterations + 1))
        assert np.array_equal(rows[-1].z, kept.z)
    times = [row.seconds for row in rows]
    assert times == sorted(times)
    assert times[-1] <= kept.seconds


@settings(max_examples=50)
@given(SMALL)
def test_small_problems_have_one_run(data: tuple[np.ndarray, np.ndarray]) -> None:
    check(Problem(*data))


@pytest.mark.parametrize(("family", "n"), FAMILIES)
def test_problems_of_the_gallery_have_one_run_whatever_was_solved_before(family: str, n: int) -> None:
    problem = families.make(family, n, 0)
    first = lcpcli.run(problem)
    check(problem)
    for _ in range(5):
        lcpcli.solve([[2]], [-1])
    assert is_same(first, lcpcli.run(problem))


def test_a_start_has_its_iterates_too() -> None:
    problem = families.make("harker-pang", 25, 0)
    basis = lcpcli.run(problem).basis
    plain, kept = (lcpcli.run(problem, basis=basis, trace=trace) for trace in (False, True))
    assert is_same(plain, kept)
    assert [row.k for row in kept.trace.rows] == [0, 1]
    assert plain.iterations == 1


def test_milestones_are_reached_within_the_time_of_the_run() -> None:
    problem = families.make("harker-pang", 25, 0)
    known = Problem(problem.M, problem.q, solutions=[lcpcli.run(problem).z])
    result = lcpcli.run(known, trace=Trace(levels=(1e-3, 1e-9)))
    assert [each.level for each in result.trace.milestones] == [1e-3, 1e-9]
    assert all(0 < each.seconds <= result.seconds < math.inf for each in result.trace.milestones)


def test_ctrl_c_while_iterates_are_kept_leaves_the_result() -> None:
    class Pressing(Trace):
        def add(self, *_: object) -> None:
            raise KeyboardInterrupt

    problem = families.make("harker-pang", 25, 0)
    with pytest.raises(lcpcli.Interrupted) as error:
        lcpcli.run(problem, trace=Pressing())
    assert error.value.result.solved


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
