"""Lemke's path for a mixed problem, in the bounded variables that `free_variables` leaves of it.

The solution at a basis, as where Lemke's path ends, computed anew from M and q.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from lcpcli.basis import tableau
from lcpcli.basis.exchanges import BasicSolution, BasicSolutions, basic_solution
from lcpcli.basis.free_variables import Reduction
from lcpcli.basis.tableau import PAUSED, RAY, SOLVED, begin, refactorize, tableau_of
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import generator
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.methods.registry import ONES
from lcpcli.methods.small_numbers import violations
from lcpcli.methods.stages import Breakdown, Finished, Iterate, Stage, Stalled
from lcpcli.model.box import BASIC
from lcpcli.model.problem import Problem
from lcpcli.typing import States, Vector

Follow: TypeAlias = Callable[..., tuple[int, int, int, float]]

LEAST_REFRESHED = 50  # pivots, or n if that is more, after which the tableau is computed anew


def cover_of(cover: int | str, units: Vector) -> Vector:
    """Return the covering vector: of ones in the given units of the rows, or numbers between 1/2 and 3/2 that a seed
    determines, so that rows which block at once for a vector of ones block one after another."""
    if cover == ONES:
        return units
    found: Vector = 0.5 + generator(int(cover)).random(units.size)
    return found


class LemkePath:
    """The path of one problem, from z_0 = max -k_i / c_i on; it has no pivots if no k_i is negative.

    follow : `tableau.follow`, or its compiled form. end : SOLVED, RAY, or PAUSED as long as it goes on. pivots : how
    many there were.
    """

    def __init__(
        self, reduction: Reduction, q: Vector, cover: int | str, lexicographic: bool, follow: Follow = tableau.follow
    ) -> None:
        self.reduction, self.k, self.follow = reduction, reduction.constants(q), follow
        self.cover = cover_of(cover, reduction.units)
        self.lexicographic = lexicographic
        self.tableau = tableau_of(reduction.K, self.k, self.cover)
        self.pivots, self.age, self.row, self.end = 0, 0, 0, SOLVED
        if (self.k < 0).any():
            self.row, self.entering, self.way = begin(self.tableau, reduction.d, self.cover, lexicographic)
            self.pivots, self.age, self.end = 1, 1, PAUSED

    def advance(self, most: int) -> None:
        """Follow the path for at most so many more pivots; compute the tableau anew where it is old, and before it
        says that the path ends on a ray."""
        last = self.pivots + most
        while self.end == PAUSED and self.pivots < last:
            young = max(LEAST_REFRESHED, self.k.size) - self.age
            if young <= 0:
                self._refresh()
                continue
            found = self.follow(
                self.tableau,
                self.reduction.d,
                self.entering,
                self.way,
                self.row,
                self.lexicographic,
                min(young, last - self.pivots),
            )
            self.end, pivots, self.entering, self.way = found
            self.pivots, self.age = self.pivots + pivots, self.age + pivots
            if self.end == RAY and self.age:
                self.end = PAUSED
                self._refresh()

    def _refresh(self) -> None:
        refactorize(self.tableau, np.column_stack((self.reduction.K, self.cover)), self.k, self.reduction.d)
        self.age = 0

    def point(self) -> tuple[Vector, Vector, States]:
        """Return z and w of the given problem at present, and the states of z."""
        t, m = self.tableau, self.k.size
        is_y = (t.basic >= m) & (t.basic < 2 * m)
        y, basic = np.where(t.at_upper, self.reduction.d, 0.0), np.zeros(m, np.bool_)
        y[t.basic[is_y] - m], basic[t.basic[is_y] - m] = t.values[is_y], True
        w = np.zeros(m)
        w[t.basic[t.basic < m]] = t.values[t.basic < m]
        z, basis = self.reduction.given(y, basic, t.at_upper)
        return z, self.reduction.given_w(w), basis

    @property
    def cover_value(self) -> float:
        """Return the value of z_0."""
        return float(self.tableau.values[self.row]) if self.tableau.basic[self.row] == 2 * self.k.size else 0.0

    def ray(self) -> tuple[Vector, Vector]:
        """Return the direction of z on the ray, and the multipliers of the rows in the row of z_0, for the given
        problem."""
        t, m = self.tableau, self.k.size
        y, u = np.zeros(2 * m + 1), np.zeros(2 * m + 1)
        y[t.basic] = self.way * t.T[:, self.entering]
        y[t.nonbasic[self.entering]] = self.way
        u[t.nonbasic] = t.T[self.row]
        return self.reduction.direction(y[m : 2 * m]), self.reduction.multipliers(u[:m])


LITERAL_STEPS = 8  # exchanges of wrong signs at the end of a path


def solution_at(problem: Problem, path: LemkePath) -> Vector:
    """Return z of the basis at which a path has ended.

    Signs that are wrong beyond rounding belong to numbers so small beside others that z_0 left before they decided:
    they are exchanged, as long as that leads to a solution soon.
    """
    near, _, basis = path.point()
    box, M = problem.box, path.reduction.M
    z = basic_solution(problem, near, basis, M)
    first = box.project(z)
    if not violations(problem, first)[2].any():
        return first
    solutions = BasicSolutions(problem)
    for _ in range(LITERAL_STEPS):
        w = np.where(basis == BASIC, 0.0, problem.w(z))
        violated = solutions.violated(BasicSolution(basis, z, w, box.wrong(z, w, basis), False))
        if not violated.any():
            return box.project(z)
        basis = box.exchanged(basis, violated, z)
        z = basic_solution(problem, box.project(z), basis, M)
    return first


def confirmed(problem: Problem, basis: States, near: Vector | None) -> Stage:
    """Yield the basic solution of a basis, if it violates no row beyond rounding, as the one at which a path has
    ended often does for the next q.

    near : a z for a singular M_BB, of which it is then the least correction; None if there is none.
    """
    box, M = problem.box, matrices.dense(problem.M)
    try:
        z = box.project(basic_solution(problem, near, basis, M))
    except SingularMatrix:
        return Breakdown("the principal submatrix of the given states is singular")
    if violations(problem, z)[2].any():
        return Stalled("the given states are not those of a solution")
    yield Iterate(box.x_within(z, problem.w(z), box.basis_at(z)), None, "block", 1, basis=basis)
    return Finished()
