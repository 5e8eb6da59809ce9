"""Repairs: no smaller change is enough, by every combination of states, and the point
solves the changed problem."""

from fractions import Fraction

import numpy as np
import pytest

import lcpcli
from lcpcli import why
from lcpcli.rational.exact_problem import ExactProblem

from .brute_force import unsolvable


def changed(data, found):
    """The problem with the changes of a repair, all in its q."""
    q = [Fraction(*each) for each in zip(data.constants, data.scales, strict=True)]
    for each in found.changes:
        assert each.number.field == "q"
        q[each.number.at] += each.number.sense * each.change
    return ExactProblem(data.problem, data.M, q, data.lower, data.upper)


@pytest.mark.parametrize(
    ("most", "is_mixed"), [(4, False), (3, True)], ids=["lcp", "mixed"]
)
def test_the_repair_is_the_least_one_and_its_point_a_solution(most, is_mixed):
    for seed, small in unsolvable(25, most, is_mixed):
        found = why(small.problem())
        least = small.least_change()
        if least is None:
            assert found.is_impossible, seed
            assert found.repair is None, seed
            continue
        repair = found.repair
        assert repair.is_least, seed
        assert repair.total == least, seed
        assert sum(abs(each.change) for each in repair.changes) == least, seed
        assert repair.z is not None, seed
        assert changed(found.data, repair).is_solution(repair.z), seed


def test_weights_decide_what_changes_and_change_what_may():
    diet = lcpcli.from_qp(
        None,
        [1, 1],
        [[1, 1], [1, 0], [0, 1]],
        row_lower=[10, -np.inf, -np.inf],
        row_upper=[np.inf, 3, 4],
        rows=["need", "a", "b"],
    )

    def changes(**how):
        repair = why(diet, **how).repair
        assert repair.is_least
        own = repair.changes
        return {
            f"{each.number.name} {each.number.what}": str(each.change) for each in own
        }

    assert changes(change=["need"]) == {"need lower side": "-3"}
    assert changes(change=["a", "b"], weights={"b": 2}) == {"a upper side": "3"}
    assert changes(weights={"need": 5, "a": "3/2"}) == {"b upper side": "3"}


def test_no_change_of_a_number_that_has_no_part_in_the_conflict_is_enough():
    problem = lcpcli.Problem([[0, 1, 0], [1, 0, 0], [0, 0, 1]], [-1, 1, 0])
    beside, usual = why(problem, change="z3"), why(problem)
    assert beside.repair is None
    assert beside.is_impossible
    assert beside.to_dict()["repairable"] is False
    assert usual.repair is not None
    assert not usual.is_impossible


def test_bounds_of_variables_change_only_where_they_are_named():
    problem = lcpcli.from_qp(None, [1], [[1]], row_lower=[5], upper=[3], columns=["x"])
    usual = why(problem, keep="x upper bound").repair
    named = why(problem, change="x upper bound").repair
    assert [each.number.what for each in usual.changes] == ["lower side"]
    assert [each.number.what for each in named.changes] == ["upper bound"]
    assert named.total == 2
    assert named.z[0] == 5


MAXIMUM = """NAME p
OBJSENSE
 MAX
ROWS
 N gain
 L most
COLUMNS
 x gain 2 most -1
 y most 1
RHS
 RHS most 9
ENDATA
"""


def test_numbers_of_a_maximum_are_those_of_its_author(tmp_path):
    """It has no limit until the gain falls to 0, which the conditions of the minimum
    know as a cost of -2."""
    (tmp_path / "p.mps").write_text(MAXIMUM)
    repair = why(lcpcli.read(tmp_path / "p.mps")).repair
    (change,) = repair.changes
    assert change.number.name == "x"
    assert change.number.what == "cost"
    assert change.change == -2
    (tmp_path / "p.mps").write_text(MAXIMUM.replace("most -1", "most 1"))
    found = why(lcpcli.read(tmp_path / "p.mps"))
    cost, side = found.ranges["q"][0], found.ranges["q"][2]
    assert cost.value == 2
    assert (cost.below and cost.below.value) == 0
    assert cost.above is None
    assert side.value == 9
    assert (side.below and side.below.objective) == 0
