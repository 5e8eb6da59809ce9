"""Repairs: no smaller change is enough, by every combination of states, and the point
solves the changed problem."""

from fractions import Fraction

import numpy as np
import pytest

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
    for seed, small in unsolvable(10, most, is_mixed):
        found = why(small.problem())
        least = small.least_change(small.keys())
        if np.isinf(least):
            assert found.is_impossible, seed
            assert found.repair is None, seed
            continue
        repair = found.repair
        assert repair.is_least, seed
        assert float(repair.total) == pytest.approx(least), seed
        assert sum(abs(each.change) for each in repair.changes) == repair.total, seed
        assert repair.z is not None, seed
        assert changed(found.data, repair).is_solution(repair.z), seed
