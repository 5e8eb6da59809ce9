"""Lemke's method in rational arithmetic, for small problems whose rounding hides the right complementary set."""

from __future__ import annotations

import time
from fractions import Fraction

from lcpcli.rational.problem import ExactProblem
from lcpcli.rational.tableau import IntegerTableau

MOST_UNKNOWNS = 60  # unknowns: seconds at worst


def solve(data: ExactProblem, deadline: float) -> list[Fraction] | None:
    """The solution where the path from z = 0 ends, or None: on a ray, for a large problem, after the deadline.

    The covering vector is that of the integer rows.
    """
    if data.n > MOST_UNKNOWNS:
        return None
    tableau = IntegerTableau(data.rows, data.constants)
    if min(data.constants) < 0:
        for _ in tableau.path():
            if time.perf_counter() >= deadline:
                return None
    return tableau.z() if tableau.ray is None else None
