"""What a problem with the same M takes over from another one."""

import numpy as np

from lcpcli.model.box import ORTHANT, Box
from lcpcli.model.problem import M_FIELDS, Problem
from lcpcli.model.right_hand_sides import Columns, like_with


def _known() -> Problem:
    problem = Problem([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0], names=("a", "b"), solutions=[[4 / 3, 7 / 3]])
    assert problem.row_maxima.tolist() == [2.0, 2.0]
    return problem.knowing(units=problem.units, a_new_property_of_q=problem.q.sum())


def test_what_is_not_known_to_depend_on_M_alone_is_dropped() -> None:
    other = like_with(_known(), np.array([1.0, -1.0]), ORTHANT)
    assert "a_new_property_of_q" not in vars(other)
    assert other.solutions == ()
    assert other.verdict == ""
    assert other.q_ref.tolist() == [1.0, -1.0]


def test_properties_of_M_and_names_are_taken_over() -> None:
    like = _known()
    box = Box(np.array([1.0, 0.0]), np.array([2.0, np.inf]))
    for other in (like_with(like, np.array([1.0, -1.0]), ORTHANT), like_with(like, like.q, box)):
        assert all(vars(other)[name] is vars(like)[name] for name in M_FIELDS if name in vars(like))
        assert list(other.names) == ["a", "b"]
    assert (
        other.reference_point.tolist()
        == Problem(like.M, like.q, lower=box.lower, upper=box.upper).reference_point.tolist()
    )


def test_the_problems_of_a_block_know_of_M_and_not_of_q() -> None:
    columns = Columns([[2.0, 1.0], [1.0, 2.0]], [[-5.0, 1.0], [-6.0, -1.0]], 0.0, np.inf)
    columns.like.knowing(units=columns.like.units, a_new_property_of_q=0.0)
    first, second = columns.problems()
    assert first.units is second.units is columns.like.units
    assert "a_new_property_of_q" not in vars(first)
    assert (first.q.tolist(), second.q.tolist()) == ([-5.0, -6.0], [1.0, -1.0])
