"""Linear bilevel programs of the literature, with published optima: the follower's conditions are a mixed problem."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import pytest

import lcpcli
from lcpcli.rational.exact_problem import ExactProblem

Rows = Sequence[Sequence[float]]
THREE_ROWS = [[0, 0, -1, 1, 1], [2, 0, -1, 2, -0.5], [0, 2, 2, -1, -0.5]]


class Program(NamedTuple):
    """Minimize leader'(x, y) for 0 <= x <= most and upper (x, y) <= limits, where y minimizes a convex function, with
    the gradient curvature (x, y) + follower, for rows (x, y) <= sides and 0 <= y <= most; the first of these rows are
    equations."""

    source: str
    optimum: str
    leader: Sequence[float]
    follower: Sequence[float]
    rows: Rows
    sides: Sequence[float]
    most: float = 10
    upper: Rows = ()
    limits: Sequence[float] = ()
    equations: int = 0
    curvature: Rows = ()

    def problem(self) -> lcpcli.Problem:
        """Return the mixed problem in x, y, the multipliers of the rows, and one unknown for each row of the leader."""
        k, m, outer, n = len(self.follower), len(self.rows), len(self.limits), len(self.leader)
        G, H = np.array(self.rows), np.reshape(self.upper, (outer, n))
        M = np.zeros((n + m + outer, n + m + outer))
        M[n - k : n, :n] = self.curvature or 0
        M[n - k : n, n : n + m] = G[:, n - k :].T
        M[n : n + m, :n], M[n + m :, :n] = -G, -H
        q = [*[0] * (n - k), *self.follower, *self.sides, *self.limits]
        lower = [*[0] * n, *[-np.inf] * self.equations, *[0] * (m - self.equations + outer)]
        return lcpcli.Problem(M, q, lower=lower, upper=[*[self.most] * n, *[np.inf] * (m + outer)])


PROGRAMS = [
    Program("Bard and Falk 1982, example 1", "-26", [-8, -4, 4, -40, 4], [1, 1, 2], THREE_ROWS, [1, 1, 1]),
    Program(
        "Candler and Townsley 1982, section 6",
        "-29.2",
        [-8, -4, 4, -40, -4, 0, 0, 0],
        [1, 1, 2, 0, 0, 0],
        np.hstack((THREE_ROWS, np.eye(3))).tolist(),
        [1, 1, 1],
        equations=3,
    ),
    Program("Clark and Westerberg 1988", "-37", [1, -4], [1], [[-2, 1], [2, 5], [2, -3]], [0, 108, -4], most=30),
    Program(
        "Savard 1989",
        "-14.6",
        [-8, -4, 4, -40, 4],
        [2, 1, 2],
        [[0, 0, -1, 1, 1], [4, 0, -2, 4, -1], [0, 4, 4, -2, -1]],
        [1, 2, 2],
        upper=[[1, 2, 0, 0, -1]],
        limits=[1.3],
    ),
    Program("Bard 1991, example 2.2", "-1", [-1, 10, -1], [-1, -1], [[1, 1, 0], [1, 0, 1], [0, 1, 1]], [1, 1, 1]),
    Program("Liu and Hart 1994", "-16", [-1, -3], [1], [[-1, 1], [1, 2], [4, -1]], [3, 12, 12]),
    Program(
        "Shimizu, Ishizuka and Bard 1997, example 16.1.1",
        "-2",
        [1, -4],
        [1],
        [[-1, -1], [-2, 1], [2, 1], [-3, 2]],
        [-3, 0, 12, -4],
    ),
    Program(  # with y + 10 for y
        "Aiyoshi and Shimizu 1984, example 2",
        "0",
        [2, 2, -3, -3],
        [20, 20],
        [[-1, 0, 2, 0], [0, -1, 0, 2]],
        [10, 10],
        most=50,
        upper=[[1, 1, 1, -2]],
        limits=[30],
        curvature=[[-2, 0, 2, 0], [0, -2, 0, 2]],
    ),
]


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda program: program.source)
def test_the_optimum_is_the_published_one(program: Program) -> None:
    problem = program.problem()
    costs = {f"z{i}": Fraction(str(cost)) for i, cost in enumerate(program.leader, 1)}
    found = lcpcli.optimum(ExactProblem.of_decimals(problem), costs)
    assert (found.status, found.value) == ("optimal", Fraction(program.optimum))
