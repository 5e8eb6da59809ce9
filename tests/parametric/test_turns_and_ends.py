"""Turns of a path, and its ends."""

from __future__ import annotations

import pytest

from lcpcli import Problem, path


def test_a_path_that_turns_has_all_points_at_a_t_that_it_passes_twice() -> None:
    """For M = -1 and q = 1 - 3 t, z = 0 solves the problems up to t = 1/3, and so does z = q."""
    found = path(Problem([[-1]], [1]), Problem([[-1]], [-2]), turns=True)
    assert found.end == "returned"
    assert sorted(found(0.1).ravel().tolist()) == pytest.approx([0, 0.7])
    assert sorted(found(0.0).ravel().tolist()) == pytest.approx([0, 1])


def test_an_edge_of_no_length_on_which_t_would_decrease_is_no_turn() -> None:
    M = [[-2, 0, 2], [-1, 0, 2], [-2, 0, 1]]
    found = path(Problem(M, [1, 0, 0]), Problem(M, [-1, 2, 0]))
    assert found.reached
    assert found.verified
    assert found.z[-1].tolist() == [0.5, 0, 1]


@pytest.mark.parametrize(("start", "stop"), [(0.7, 3.4), (0.1, 0.3), (-1 / 3, 1e17)])
def test_t_begins_and_ends_exactly_where_it_is_asked_to(start: float, stop: float) -> None:
    """In doubles, 0.7 + (3.4 - 0.7) is not 3.4."""
    problem, to = Problem([[2]], [1]), Problem([[2]], [-1])
    found = path(problem, to, start=start, stop=stop)
    assert (found.t[0], found.t[-1]) == (start, stop)
    assert found(stop).tolist() == [0.5]
