"""What is proved of decimals holds for the bounds as they are written, not for their doubles."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from lcpcli import Problem
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.solving.driver import run
from lcpcli.solving.proof import prove


def test_no_solution_of_the_doubles_proves_nothing_of_the_decimals() -> None:
    """w1 = 10 z3 - 1 with z3 = 0.1: only where it is 0, z1 may be 1, as w2 = z1 - 1 asks for."""
    pytest.importorskip("flint")
    M, end = [[0, 0, 10], [1, 0, 0], [0, 0, 0]], [0.1]
    problem = Problem(M, [-1, -1, 0], lower=[0, 0, *end], upper=[np.inf, np.inf, *end])
    result = run(problem, "auto")
    assert prove(lambda: ExactProblem.of_floats(problem), result).status.word == "unsolvable"
    decimals = prove(lambda: ExactProblem.of_decimals(problem), result)
    assert decimals.exact is not None
    assert (decimals.status.word, decimals.exact.z) == ("solved", [1, 0, Fraction(1, 10)])
