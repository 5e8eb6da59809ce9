"""Lemke's path for a mixed problem, in the bounded variables that `free_variables` leaves of it.

Where the path ends, the solution at its basis is computed from M and q, and small numbers are settled by problems of
what they leave: a path ends once z_0 is within rounding of the largest numbers, before numbers decide that are smaller
by sixteen digits, as those of bodies at rest: momenta of 1e-17 beside impulses of 1. At the point z that it finds, M (z
+ s d) + q = s (M d + (M z + q) / s): in units s of what is violated this is a problem in d with the bounds (l - z) / s,
in which components far inside their bounds are free, and those with a large w stay where they are.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from lcpcli.basis import tableau
from lcpcli.basis.exchanges import BasicSolution, BasicSolutions, basic_solution
from lcpcli.basis.free_variables import Reduction
from lcpcli.basis.tableau import PAUSED, RAY, SOLVED, begin, refactorize, tableau_of
from lcpcli.errors import ProblemError
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import SIGN_ROUNDING, generator
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import absolute_product
from lcpcli.methods.registry import ONES
from lcpcli.methods.stages import Breakdown, Finished, Iterate, Stage, Stalled
from lcpcli.model.box import BASIC
from lcpcli.model.problem import Problem
from lcpcli.typing import Mask, States, Vector

Follow: TypeAlias = Callable[..., tuple[int, int, int, float]]

LEAST_REFRESHED = 50  # pivots, or n if that is more, after which the tableau is computed anew


def cover_of(cover: int | str, units: Vector) -> Vector:
    """Return the covering vector: of ones in the given units of the rows, or numbers between 1/2 and 3/2 that a seed
    determines, so that rows which block at once for a vector of ones block one after another."""
    if cover == ONES:
        return units
    return _seeded_cover(int(cover), units.size)


@lru_cache(maxsize=16)
def _seeded_cover(seed: int, size: int) -> Vector:
    cover: Vector = 0.5 + generator(seed).random(size)
    cover.setflags(write=False)  # as all paths share it
    return cover


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


def solution_at(problem: Problem, M: Vector, near: Vector, basis: States) -> tuple[Vector, bool]:
    """Return z of the basis at which a path has ended near a z, for M as a dense array, and whether it violates no row
    beyond rounding.

    Signs that are wrong beyond rounding belong to numbers so small beside others that z_0 left before they decided:
    they are exchanged, as long as that leads to a solution soon.
    """
    box = problem.box
    z = basic_solution(problem, near, basis, M)
    first = box.project(z)
    if not np.count_nonzero(violations(problem, first)[2]):
        return first, True
    solutions = BasicSolutions(problem)
    for _ in range(LITERAL_STEPS):
        w = np.where(basis == BASIC, 0.0, problem.w(z))
        violated = solutions.violated(BasicSolution(basis, z, w, box.wrong(z, w, basis), False))
        if not violated.any():
            return box.project(z), False
        basis = box.exchanged(basis, violated, z)
        z = basic_solution(problem, box.project(z), basis, M)
    return first, False


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


MOST_LEVELS = 3
SMALL = 1e-8  # relative to the largest |q|: violations above this are not those of small numbers
FAR = 1e4  # in units of the violations: distances from bounds, and sizes of w, that stay as they are
NOISE = 1e-10  # in these units: components of z and of w that are rounding of 0


def violations(problem: Problem, z: Vector) -> tuple[Vector, Vector, Mask]:
    """Return how a z within its bounds violates the problem: w = M z + q with 0 in place of what may be rounding of 0,
    the natural residuals of the rows, and in which rows these are more than rounding."""
    w = problem.w(z)
    gaps = np.abs(problem.box.gaps(z, w))
    rounding = SIGN_ROUNDING * (absolute_product(problem.M, np.abs(z)) + np.abs(problem.q))
    return np.where(np.abs(w) <= rounding, 0.0, w), gaps, gaps > rounding


@np.errstate(all="ignore")
def settled(problem: Problem, z: Vector, solve: Callable[[Problem], Vector | None]) -> Vector:
    """Return z with small numbers settled, as far as `solve` finds solutions of what is left."""
    for _ in range(MOST_LEVELS):
        w, gaps, violated = violations(problem, z)
        size = gaps.max(where=violated, initial=0.0)
        if not 0.0 < size <= SMALL * np.abs(problem.q_ref).max():
            break
        try:
            d = solve(_left(problem, z, w, violated, size))
        except ProblemError:
            break
        if d is None or not np.isfinite(d).all():
            break
        z = z + size * d
        z = problem.box.project(np.where(np.abs(z) <= NOISE * size, 0.0, z))
    return z


def _left(problem: Problem, z: Vector, w: Vector, violated: Mask, size: float) -> Problem:
    """Return the problem that is left at z, in units of this size."""
    lower, upper = ((bound - z) / size for bound in problem.box.vectors(problem.n))
    stays = ((lower >= 0.0) & (w > FAR * size)) | ((upper <= 0.0) & (w < -FAR * size))
    lower, upper = np.where(lower < -FAR, -np.inf, lower), np.where(upper > FAR, np.inf, upper)
    is_settled = (np.isinf(lower) & np.isinf(upper) & ~violated) | stays | (np.abs(w) <= NOISE * size)
    q = np.where(is_settled, 0.0, w / size)
    return Problem(problem.M, q, lower=np.where(stays, 0.0, lower), upper=np.where(stays, 0.0, upper))
