"""Lemke's method in rational arithmetic, for small problems where rounding obscures the right complementary set."""

from __future__ import annotations

from fractions import Fraction

from lcpcli import clock
from lcpcli.rational.problem import ExactProblem
from lcpcli.rational.tableau import IntegerTableau

MOST_UNKNOWNS = 60  # n up to which it is tried: seconds at worst


def solve(data: ExactProblem, deadline: float) -> list[Fraction] | None:
    """The solution at the end of the path from z = 0; None on a ray, for large n, with bounds, or after the deadline.

    The covering vector is e for the integer rows.
    """
    if data.n > MOST_UNKNOWNS or data.problem.is_mixed:
        return None
    tableau = IntegerTableau(data.rows, data.constants)
    if min(data.constants) < 0:
        for _ in tableau.path():
            if clock.seconds() >= deadline:
                return None
    return tableau.z() if tableau.ray is None else None
