"""Evaluations of F and J of a nonlinear problem, counted; J by finite differences where it is not given.

Columns of J without a common row are differenced together: A. R. Curtis, M. J. D. Powell, J. K. Reid, On the estimation
of sparse Jacobian matrices, IMA Journal of Applied Mathematics 13 (1974) 117-119.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from functools import cached_property

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import ParameterError, count
from lcpcli.linalg.doubles import EPS, is_finite
from lcpcli.linalg.matrices import absolute_product, dense, is_sparse, product
from lcpcli.model.arrays import FROM_0
from lcpcli.model.differences import RATIO, noise
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.typing import Indices, Mask, Matrix, Vector

MOST_DENSE = 100  # unknowns up to which J is differenced column by column, and is dense
KEPT = 4  # points whose F is kept, as the loop and the method, and J by differences, ask for it again
STEP = EPS**0.5  # of a forward difference, relative to z_j, or to 1 if z_j is smaller
LONG_STEP = 2.0**-7  # that tells whether differences by STEP are doubtful
DOUBTFUL = 0.2  # relative to the change of F, or to the terms of J: a difference between the two
FLAT = 1 / 64  # of the slope by the longer step: one by the shorter step that is next to nothing
MOST_ADAPTED = 6  # times that steps are changed in a run
BEST, LONGEST = 8**0.25, 2.0**-3  # times the root of the relative noise: the best step, and the longest one
MOST_SHORTER, ALIKE, ROUNDINGS = 12, 0.1, 64  # of steps; of quotients by two steps, and by how many roundings F changes
WRONG = 0.1  # the relative difference from which an entry of J is said to be wrong
NOTABLE = 1e-4  # relative to the largest entry of the row, for such changes: the size from which an entry is
BY_DIFFERENCES = "by differences of F"


class Evaluations:
    """The evaluations of one run. The last J is kept, as the loop and the method ask for it at the same z.

    pattern : the places of J that may differ from 0, a csr array, for finite differences; None to find them.
    difference_step : their step, relative to z_j, or to 1 where z_j is smaller; by default STEP, or what F asks for.
    noise, sizes : of each row of F, its noise and the largest |F_i| beside it, where the noise was estimated last.
    functions, jacobians : the numbers of evaluations so far; those for finite differences count as functions.
    pivots : of the linear problems that a run has solved, counted by what solves them.
    """

    def __init__(
        self, problem: NonlinearProblem, pattern: Matrix | None = None, difference_step: float | None = None
    ) -> None:
        if pattern is not None and (shape := getattr(pattern, "shape", np.shape(pattern))) != (problem.n, problem.n):
            fault = f"has shape {shape} for {count(problem.n, 'unknown')}"
            raise ParameterError("pattern", fault, f"give shape ({problem.n}, {problem.n})")
        self.problem, self._given = problem, pattern
        self.functions = self.jacobians = self.pivots = 0
        self._is_given, self._left = difference_step is not None, MOST_ADAPTED
        self._shares = np.full(problem.n, STEP if difference_step is None else difference_step)
        self.noise = self.sizes = np.zeros(problem.n)
        self._noise_of: Vector | None = None
        self._last: tuple[Vector, Matrix] | None = None
        self._values = deque[tuple[Vector, Vector]](maxlen=KEPT)

    def values(self, z: Vector) -> Vector:
        """Return F(z), with nan where it is undefined; what is known from before counts as an evaluation, too."""
        self.functions += 1
        return self.known_values(z)

    def known_values(self, z: Vector) -> Vector:
        """Return F(z), which does not count, and is evaluated only if it is not known."""
        if (F := self.known(z)) is None:
            F = self.problem.values(z)
            self._values.appendleft((z, F))
        return F

    def known(self, z: Vector) -> Vector | None:
        """Return F(z) if it has been evaluated of late."""
        return next((F for place, F in self._values if np.array_equal(place, z)), None)

    def jacobian(self, z: Vector) -> Matrix:
        """Return J(z), dense or a csr array, with nan or infinity where it is undefined."""
        if self._last is None or not np.array_equal(self._last[0], z):
            self.jacobians += 1
            is_first, by_differences = self._last is None, self.problem.J is None
            self._last = z, self._differences(z, self._steps(z)) if by_differences else self.problem.jacobian(z)
            if is_first and by_differences and not self._is_given and self._is_doubtful(*self._last):
                self.adapt(z)
                return self.jacobian(z)
        return self._last[1]

    @np.errstate(all="ignore")
    def _is_doubtful(self, z: Vector, J: Matrix) -> bool:
        """Return whether differences by longer steps in all components are far from those by J."""
        F, slopes, differs = self.known_values(z), list[Vector](), list[Mask]()
        for step in (LONG_STEP, RATIO * STEP):  # the second one where curvature may be the reason
            move = self._inward(z, step * np.maximum(np.abs(z), 1.0))
            change = self.values(z + move) - F
            terms = np.maximum(np.abs(change), absolute_product(J, np.abs(move)))
            differs.append(np.abs(change - product(J, move)) > DOUBTFUL * terms)
            slopes.append(np.abs(change) / step)
            if not differs[-1].any():
                return bool((differs[0] & (slopes[-1] == 0)).any())
        is_flat = (slopes[1] < FLAT * slopes[0]) & (slopes[1] > 0)
        return bool((differs[0] & ((differs[1] & ~is_flat) | (slopes[1] == 0))).any())

    @np.errstate(all="ignore")
    def adapt(self, z: Vector) -> bool:
        """Change the steps of differences to what F asks for at z; return whether they have changed, by much. They
        become longer where F is noisy, as J. J. Moré and S. M. Wild, Estimating derivatives of noisy simulations, ACM
        Transactions on Mathematical Software 38 (2012) 19, choose them, and shorter where that changes quotients."""
        if self.problem.J is not None or self._is_given or self._left == 0:
            return False
        before, F, noise = self._shares.copy(), self.known_values(z), self.noise_at(z)
        move = self._inward(z, LONG_STEP * np.maximum(np.abs(z), 1.0))
        ranges = np.abs(self.values(z + move) - F) / LONG_STEP
        noisy = (noise > 0) & np.isfinite(ranges)
        if noisy.any():
            shares = BEST * np.sqrt(np.median(noise[noisy] / np.maximum(ranges, noise)[noisy]))
            self._shares = np.clip(shares, self._shares, LONGEST) if shares > STEP else self._shares
        if (self._shares == before).all():
            for group in self._groups:
                self._shorten(z, F, group)
        is_changed = bool((np.abs(np.log2(self._shares / before)) > 1).any())
        self._left = max(self._left - (1 if is_changed else MOST_ADAPTED // 2), 0)
        self._last = None if is_changed else self._last
        return is_changed

    def noise_at(self, z: Vector) -> Vector:
        """Return the noise of each row of F near z."""
        if self._noise_of is None or not np.array_equal(self._noise_of, z):
            self._noise_of = z
            self.noise, self.sizes = noise(self.values, self.problem.box, z, self.noise > 0)
        return self.noise

    def _shorten(self, z: Vector, F: Vector, group: Indices) -> None:
        """Divide the steps of a group until that changes its quotients little, or rounding begins."""
        longer = self._quotient(z, F, self._steps(z), group)
        for _ in range(MOST_SHORTER):
            self._shares[group] /= RATIO
            steps = self._steps(z)
            shorter = self._quotient(z, F, steps, group)
            changes = np.abs(shorter * self._divisors(steps, group))
            counts = (changes > 10 * self.noise) & (changes > ROUNDINGS * EPS * np.abs(F)) | ~np.isfinite(shorter)
            apart = np.abs(longer - shorter) > ALIKE * np.abs(shorter)
            if not (counts & (apart | ~np.isfinite(longer))).any():
                self._shares[group] *= RATIO
                return
            longer = shorter

    def finite_jacobian(self, z: Vector) -> Matrix | None:
        """Return J(z), or None unless all its entries are finite."""
        J = self.jacobian(z)
        return J if is_finite(J.data if is_sparse(J) else J.ravel()) else None

    @np.errstate(all="ignore")
    def fault_of_jacobian(self, z: Vector) -> str:
        """Return at which entry a given J(z) differs most from differences of F on both sides, as a clause; "" if none
        does by much, and where there would be too many differences."""
        J = self.jacobian(z)
        if self.problem.J is None or (self.problem.n > MOST_DENSE and not is_sparse(J)):
            return ""
        other = Evaluations(replace(self.problem, J=None), J if self.problem.n > MOST_DENSE else None)
        other.adapt(z)
        steps, F = other._steps(z), self.known_values(z)
        ways = [dense(other._differences(z, way)) for way in (steps, self.problem.box.project(z - steps) - z)]
        J, low, high = dense(J), np.fmin(*ways), np.fmax(*ways)
        gaps, sizes = np.fmax(low - J, J - high), np.fmax(np.abs(J), np.fmax(np.abs(low), np.abs(high)))
        gaps = np.where(np.isfinite(J), gaps, np.where(np.isfinite(low), np.inf, 0.0))
        scales, noise = np.maximum(np.abs(z), 1.0), np.maximum(other.noise, EPS * np.abs(F))
        notable = NOTABLE * (sizes * scales).max(axis=1, initial=0.0)[:, np.newaxis]
        least = np.maximum(notable / scales, ROUNDINGS * noise[:, np.newaxis] / np.abs(steps))
        excess = np.where(gaps > np.maximum(WRONG * sizes, least), gaps / sizes, 0.0)
        excess = np.where(gaps == np.inf, np.inf, excess)
        if not excess.any():
            return ""
        i, j = np.unravel_index(excess.argmax(), excess.shape)
        return f"J[{i}, {j}] is {J[i, j]:.6g} there, but {BY_DIFFERENCES} {ways[0][i, j]:.6g} {FROM_0}"

    @cached_property
    def _rows(self) -> list[Indices] | None:
        """Return the rows of each column of J that may differ from 0, where F_i changes with z_j at x0, or is nan where
        z_j is; None if it is to be dense."""
        n, rows = self.problem.n, list[Indices]()
        if self._given is not None:
            with imports:
                from scipy.sparse import coo_array
            pattern = coo_array(self._given).tocsc()  # where repeated entries are one
            return np.split(pattern.indices, pattern.indptr[1:-1])
        if n <= MOST_DENSE:
            return None
        z, F = self.problem.x0, self.values(self.problem.x0)
        for j in range(n):
            moved, undefined = z.copy(), z.copy()
            moved[j], undefined[j] = z[j] + self._steps(z)[j], np.nan
            rows.append(((self.values(moved) != F) | np.isnan(self.values(undefined))).nonzero()[0])
        return rows

    @cached_property
    def _groups(self) -> list[Indices]:
        """Return groups of columns, none with a common row, each found greedily."""
        n = self.problem.n
        if self._rows is None:
            return [np.array([j]) for j in range(n)]
        last, color = np.full((n, 0), False), np.full(n, -1)
        for j, own in enumerate(self._rows):
            free = (~last[own].any(axis=0)).nonzero()[0]
            if not free.size:
                last, free = np.hstack([last, np.full((n, 1), False)]), np.array([last.shape[1]])
            color[j] = free[0]
            last[own, free[0]] = True
        return [(color == k).nonzero()[0] for k in range(last.shape[1])]

    def _steps(self, z: Vector) -> Vector:
        return self._inward(z, self._shares * np.maximum(np.abs(z), 1.0))

    def _inward(self, z: Vector, steps: Vector) -> Vector:
        """Return steps that stay below the upper bounds, and go down where there is no room above."""
        above, below = self.problem.upper - z, z - self.problem.lower
        is_down = (above < steps) & (below > above)
        return np.where(is_down, -np.minimum(steps, below), np.minimum(steps, above))

    @np.errstate(all="ignore")
    def _differences(self, z: Vector, steps: Vector) -> Matrix:
        """Return J by forward differences, by backward ones where those are undefined."""
        F = self.known_values(z)
        quotients, rows, n = [self._quotient(z, F, steps, group) for group in self._groups], self._rows, self.problem.n
        if rows is None:
            return np.array(quotients).T
        with imports:
            from scipy.sparse import csc_array
        of_column = {j: own for group, own in zip(self._groups, quotients, strict=True) for j in group.tolist()}
        data = np.concatenate([of_column[j][own] for j, own in enumerate(rows)])
        return csc_array((data, np.concatenate(rows), np.cumsum([0, *map(len, rows)])), shape=(n, n)).tocsr()

    def _quotient(self, z: Vector, F: Vector, steps: Vector, group: Indices) -> Vector:
        """Return the change of F with the components of a group, each row divided by the step of its component."""
        quotient = np.full(z.size, np.nan)
        for sign in (1.0, -1.0):
            if not is_finite(quotient):
                moved = z.copy()
                moved[group] += sign * steps[group]
                self.functions += 1
                own = (self.problem.values(moved) - F) / self._divisors(moved - z, group)
                quotient = np.where(np.isfinite(quotient), quotient, own)
        return quotient

    def _divisors(self, moves: Vector, group: Indices) -> Vector:
        """Return for each row the move of the component of the group that it depends on; 1 without one."""
        divisors = np.ones(self.problem.n)
        for j in group.tolist():
            divisors[slice(None) if self._rows is None else self._rows[j]] = moves[j] or 1.0
        return divisors
