"""Whether a point solves a nonlinear problem, and its residuals, by F evaluated there once more.

z solves the problem if and only if it solves the linearization there, whose w at z is F(z). So z is measured as a point
of that linear problem (see `measure`): a row may be violated by tol of its terms |J| |z| + |q|, with q = F(z) - J z, or
of its cap. To first order, z then is the exact solution of a problem whose J differs by at most tol, relatively.

That J may be wrong: a mistake in a given one, a difference over far more than z or over a jump of F. Where it is too
large, any violation is little beside its terms. So where the natural residual is not small itself, z has to solve the
linearization with a second J too, by differences with steps relative to z.

The terms of F itself are unknown. Where they cancel, as in exp(z) - 1 near 0, what is left of a row is rounding, and
may be far more than tol of |J| |z|. So a violation also counts as none if it is no more than a few times the noise of
F, estimated from its differences at equally spaced points: J. J. Moré, S. M. Wild, Estimating computational noise, SIAM
Journal on Scientific Computing 33 (2011) 1292-1314.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from math import comb
from typing import Any

import numpy as np

from lcpcli.linalg.doubles import EPS, generator, is_finite, size
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.evaluations import Evaluations
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector
from lcpcli.verify.measure import ROUNDING, Rows
from lcpcli.verify.noise import on_bounds, without_small_distances
from lcpcli.verify.point import Criterion, Point

SPACINGS = tuple(2.0**-power for power in range(48, 0, -6))  # relative to z, or to 1 where it is smaller, finest first
ORDERS = 6  # of differences, from ORDERS + 1 points
MOST_EQUAL = 0.5  # of first differences that may be 0: of more, the points are too close
AGREEMENT = 4.0  # the ratio of the noise by differences of successive orders, if it is that of noise
MOST_NOISE = 1e-10  # relative to the largest |F_i| at the points: what F_i computes is no noise if it is more
VANISHED = 1e-12  # relative to the largest |z_i|: a component so small may be what rounding leaves of 0
WORTH = 1e-6  # the natural residual up to which noise may be all that is left


class NonlinearCriterion(Criterion):
    """What a point must satisfy to count as a solution of a nonlinear problem. problem : the linearization at x0."""

    is_linear = False
    reference_solves = False

    def __init__(self, evaluations: Evaluations, tol: float) -> None:
        self.evaluations = evaluations
        given = evaluations.problem
        super().__init__(self.linearization(given.x0, given.values(given.x0)), tol, literal=True)
        self._first = 0.0

    def linearization(self, z: Vector, F: Vector, J: Matrix | None = None) -> Problem:
        """Return the linear problem with M = J, by default J(z), and w(z) = F; entries of J that are not finite count
        as 0, so that they make no terms."""
        given, J = self.evaluations.problem, _finite(self.evaluations.jacobian(z) if J is None else J)
        names = given.names if any(given.names) else ()
        q = F - J @ z
        q = np.where(np.isfinite(q), q, 0.0)
        linear = Problem(J, q, name=given.name, names=names, lower=given.lower, upper=given.upper)
        return linear.knowing(solutions=given.solutions)

    def point(self, z: Vector) -> Point:
        """Return the point of an admissible z or, if that is nearly a solution, of one with components on bounds, or
        at 0, that rounding has left near them, if this is a solution."""
        point = NonlinearPoint(self, z)
        if point.solves() or not point.residual <= WORTH:
            return point
        return next((other for other in point.cleaned() if other.solves()), point)

    def residuals(self, Z: Vector) -> tuple[list[float], list[bool]]:
        problem = self.evaluations.problem
        natural = [size(problem.box.gaps(z, problem.values(z))) for z in Z]
        return natural, [False] * len(natural)

    def bound(self, F: Vector) -> float:
        """Return the size of the natural residual relative to the first one."""
        found = float(np.abs(F).max(initial=0.0))
        self._first = self._first or found
        return found / self._first if found else 0.0


class NonlinearPoint(Point):
    """A z with its measures; w : F(z). noise : of each row of F, 0 as long as it is not needed."""

    def __init__(
        self, criterion: NonlinearCriterion, z: Vector, noise: Vector | float = 0.0, is_admissible: bool = True
    ) -> None:
        self.given, self.noise = criterion, noise
        self.F = criterion.evaluations.problem.values(z)
        linear = Criterion(criterion.linearization(z, self.F), criterion.tol, literal=True)
        super().__init__(linear, z, is_admissible)

    def __getstate__(self) -> dict[str, Any]:  # without F as a function, which may be of any kind
        return {**vars(self), "_solves": self.solves(), "given": None}

    @cached_property
    def _plain(self) -> Rows:
        return self._rows_by(self.criterion)

    def _rows_by(self, criterion: Criterion) -> Rows:
        rows = criterion.measure.rows(self._inside)
        return rows._replace(w=self.F, full_terms=np.maximum(rows.full_terms, self.noise / EPS))

    @property
    def _rows(self) -> Rows:
        return self._plain

    @np.errstate(all="ignore")
    def _decision(self) -> bool:
        if not is_finite(self.F) or (self._beyond is not None and self._beyond.any()):
            return False
        if not self._is_within(self.criterion, self._plain):
            return False
        if self.residual <= WORTH:
            return True
        given = self.given
        linear = given.linearization(self.z, self.F, given.evaluations.second_jacobian(self.z))
        second = Criterion(linear, given.tol, literal=True)
        rows = self._rows_by(second)
        if self._is_within(second, rows):
            return True
        self.criterion, self._plain = second, rows  # whose residuals are the ones to tell
        vars(self).pop("relative_residuals", None)
        return False

    def _is_within(self, criterion: Criterion, rows: Rows) -> bool:
        """Return whether no row is violated by more than is allowed."""
        measure, tol = criterion.measure, criterion.tol
        violations = measure.violations(self.z, self.F)
        most = np.maximum(np.maximum(tol * rows.terms, ROUNDING * rows.full_terms), 4 * self.noise)
        if (violations > most).any():  # whatever the caps are
            return False
        allowed = np.maximum(measure.allowed(rows, measure.caps(self.z), tol), 4 * self.noise)
        return bool((violations <= allowed).all())

    @property
    def counted_as_0(self) -> str:
        return "up to the noise of F" if np.count_nonzero(self.noise) else ""

    def solution(self) -> Point | None:
        """Return this point if it solves the problem, if need be up to the noise of F; else None."""
        if self.solves():
            return self
        if not self.residual <= WORTH:
            return None
        other = NonlinearPoint(self.given, self.z, self._noise())
        return other if other.solves() else None

    @np.errstate(all="ignore")
    def cleaned(self) -> Iterator[NonlinearPoint]:
        """Yield points without what rounding and the steps of a method leave of zeros, as `noise` has them; then those
        without components that are rounding beside the largest one, or no more than the natural residual."""
        measure, problem = self.criterion.measure, self.given.evaluations.problem
        small = (np.where(np.abs(self.z) <= most, 0.0, self.z) for most in (VANISHED * size(self.z), self.residual))
        for start in (self.z, without_small_distances(measure, self.z), *map(problem.box.project, small)):
            w = self.F if start is self.z else problem.values(start)
            z = on_bounds(measure, start, w)
            if is_finite(w) and not np.array_equal(z, self.z):
                yield NonlinearPoint(self.given, z)

    @np.errstate(all="ignore")
    def _noise(self) -> Vector:
        """Return the noise of each row of F, by the finest spacing whose differences of successive orders agree on it;
        0 where none is."""
        problem, z = self.given.evaluations.problem, self.z
        above, below = problem.upper - z, z - problem.lower
        up = np.where(above == below, generator(0).random(z.size) < 0.5, above > below)
        moves = np.where(up, 1.0, -1.0) * np.maximum(np.abs(z), 1.0)
        noise, is_known = np.zeros(z.size), np.zeros(z.size, dtype=bool)
        for spacing in SPACINGS:
            places = (problem.box.project(z + k * spacing * moves) for k in range(ORDERS + 1))
            values = np.array([problem.values(place) for place in places])
            if not np.isfinite(values).all():
                break
            found, is_noise = _by_differences(values)
            is_noise &= found <= MOST_NOISE * np.abs(values).max(axis=0)
            noise = np.where(is_noise & ~is_known, found, noise)
            is_known |= is_noise
        return noise


def _by_differences(values: Vector) -> tuple[Vector, np.ndarray]:
    """Return the noise of each row from its values at equally spaced points, shape (ORDERS + 1, n), and whether that
    is what they show: the differences change sign, few are 0, and those of two successive orders agree."""
    levels, changes, table = list[Vector](), list[np.ndarray](), values
    few = (np.diff(values, axis=0) == 0).mean(axis=0) <= MOST_EQUAL
    for order in range(1, ORDERS):
        table = np.diff(table, axis=0)
        levels.append(np.sqrt((table**2).mean(axis=0) / comb(2 * order, order)))
        changes.append((table.min(axis=0) < 0) & (table.max(axis=0) > 0))
    level, is_noise = np.zeros(values.shape[1]), np.zeros(values.shape[1], dtype=bool)
    for k in range(len(levels) - 2):
        three = np.array(levels[k : k + 3])
        agree = (three.max(axis=0) <= AGREEMENT * three.min(axis=0)) & changes[k] & few
        level = np.where(agree & ~is_noise, levels[k], level)
        is_noise |= agree
    return level, is_noise


def _finite(J: Matrix) -> Matrix:
    """Return J with 0 in place of what is not finite."""
    if not is_sparse(J):
        return np.where(np.isfinite(J), J, 0.0)
    J = J.copy()
    J.data = np.where(np.isfinite(J.data), J.data, 0.0)
    return J
