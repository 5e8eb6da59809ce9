"""Linear programs solve problems with Z-matrices and with skew-symmetric ones, where no principal minor is positive."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.sparse import csr_array

from lcpcli import Problem
from lcpcli.methods.linear import linear
from lcpcli.methods.stages import Iterate, advance
from lcpcli.verify.point import Criterion, Point


@pytest.mark.parametrize(
    ("M", "q"),
    [
        ([[2, -1, 0], [-1, 2, -1], [0, -1, 2]], [-1, -1, -2]),
        ([[1, -1, 0], [-1, 1, 0], [0, -1, 1]], [-1, 1, -2]),
        ([[0, 3, 0, 2], [-3, 0, -1, 0], [0, 1, 0, -2], [-2, 0, 2, 0]], [-3, 2, -1, 0]),
        ([[0, 1, -1], [-1, 0, 1], [1, -1, 0]], [-1, 2, 0]),
    ],
    ids=["M-matrix", "singular Z-matrix", "skew, bipartite", "skew"],
)
def test_solution_is_that_of_a_linear_program(M: ArrayLike, q: ArrayLike) -> None:
    problem = Problem(csr_array(np.array(M, dtype=float)), q)
    stage, last = linear(problem), None
    while isinstance(step := advance(stage), Iterate):
        last = step
    assert last is not None
    assert Point(Criterion(problem), problem.box.z_of(last.x)).solves()
