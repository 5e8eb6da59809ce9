"""Tables of programs that are too long to be shown whole."""

from __future__ import annotations

import numpy as np
import pytest

import lcpcli
from lcpcli.report.programs_and_games import rows_of


@pytest.mark.parametrize(("k", "m"), [(3, 1), (4, 1), (1, 4)])
def test_a_table_that_is_cut_says_so_whether_rows_or_variables_are_many(k: int, m: int) -> None:
    result = lcpcli.run(lcpcli.from_qp(None, np.ones(k), np.ones((m, k)), np.ones(m)))
    (table,) = rows_of(result.answer, result.problem.origin, 3)
    assert [len(group) for group in table.groups] == [min(m, 3), min(k, 3)]
    assert bool(table.notes) is (max(k, m) > 3)
