"""Evaluations of F and J of a nonlinear problem, counted; J by finite differences if
the problem has none.

Columns of J without a common row are differenced together: A. R. Curtis, M. J. D.
Powell, J. K. Reid, On the estimation of sparse Jacobian matrices, IMA Journal of
Applied Mathematics 13 (1974) 117-119.

The noise of F, be it of rounding or of inner iterations, is estimated from its
differences at equally spaced points: J. J. Moré, S. M. Wild, Estimating computational
noise, SIAM Journal on Scientific Computing 33 (2011) 1292-1314.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from copy import copy
from functools import cached_property
from math import comb
from typing import NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import ParameterError, count
from lcpcli.linalg.doubles import EPS, generator, is_finite, size
from lcpcli.linalg.matrices import absolute_product, dense, is_sparse, product
from lcpcli.model.arrays import FROM_0
from lcpcli.model.box import Box
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.typing import Indices, Mask, Matrix, Vector

MAX_DENSE = 100  # unknowns up to which J is differenced column by column, and is dense
# Points whose F is cached, as the loop and the method, and J by differences, need it
# again.
MAX_CACHED = 4
# Differences of F_i above this relative to its largest value are not considered noise.
MAX_NOISE = 1e-10
STEP = EPS**0.5  # of a forward difference, relative to z_j, or to 1 if z_j is smaller
LONG_STEP = 2.0**-7  # that shows whether differences by STEP are doubtful
# Relative to the change of F, or to the terms of J: a difference of the two that is
# doubtful.
DOUBTFUL = 0.2
# Relative to the slope by the longer step: a slope by the shorter step that is almost
# 0.
FLAT = 1 / 64
MAX_ADAPTED = 6  # how often steps are changed in a run
# The best step, relative to the root of the relative noise, and the longest step.
BEST, LONGEST = 8**0.25, 2.0**-3
# How often steps are shortened; the relative difference of quotients by two steps that
# are the same; and by how many rounding errors F has to change.
MAX_SHORTER = 12
SAME = 0.1
ROUNDINGS = 64
WRONG = 0.1  # the relative difference from which an entry of J is reported as wrong
# Relative to the largest entry of the row, for such changes: the size from which an
# entry is reported.
NOTABLE = 1e-4
# Steps along a direction, relative to z.
STEPS = tuple(2.0**-power for power in (26, 30, 34, 38, 42, 46, 22, 18, 14, 10, 6))
RATIO = 16.0  # of two successive steps
# Two quotients are used if they are at least this multiple of their distance.
APART = 8.0
# Number of directions in which J has to agree with differences where these alone do not
# show that terms are large enough.
DIRECTIONS = 3
# Relative to the terms of J along a direction: a difference from quotients up to which
# J agrees.
MATCH = 1e-2
# Relative to the larger of the slopes on two sides: a difference that shows a kink.
KINKED = 0.4
# Pairs of quotients that agree with each other but not with J, from which on J is
# wrong.
REFUTED = 2
UNEVEN = 2e-5  # relative to these terms: a difference that may be noise of F
# Fraction of the terms |J| |z| that a direction has to have for J to be confirmed.
COVERED = 0.1
# Distances of points, relative to z, or to 1 where it is smaller.
SPACINGS = tuple(2.0**-power for power in range(9, 37, 3))
RESOLVED = 2.0**-30  # the finest of them that distinguish oscillations from noise
# How fast differences of third order fall with the spacing, where this resolves F.
MIN_FALL, CUBIC = 4.0, (128.0, 4096.0)
# Relative to the largest |F_i|: differences of third order that are no more than
# rounding.
QUIET = 16 * EPS
ORDERS = 6  # of differences, from ORDERS + 1 points
# Largest fraction of first differences that are 0: of more, the points are too close.
MAX_EQUAL = 0.5
# The second largest first difference, less the median, relative to the largest one: if
# it is smaller, there is a jump.
JUMP = 1e-2
# Largest ratio of the levels by differences of successive orders that show noise.
ALIKE = 4.0
BY_DIFFERENCES = "by differences of F"

Values = Callable[[Vector], Vector]


class Evaluations:
    """The evaluations of one run. The last J is cached, as the loop and the method need
    it at the same z.

    pattern : the positions of J that may differ from 0, a csr array, for finite
        differences; None if F has to show them.
    difference_step : their step, relative to z_j, or to 1 where z_j is smaller; by
        default STEP, or what suits F.
    noise, sizes : the noise of each row of F, and the largest |F_i| at the points where
        the noise was estimated last.
    functions : the number of evaluations of F so far, also for finite differences.
    pivots : the number of pivots on the linear problems of a run, counted by their
        solver.
    """

    def __init__(
        self,
        problem: NonlinearProblem,
        pattern: Matrix | None = None,
        difference_step: float | None = None,
    ) -> None:
        if pattern is not None and (
            shape := getattr(pattern, "shape", np.shape(pattern))
        ) != (problem.n, problem.n):
            reason = f"has shape {shape} for {count(problem.n, 'unknown')}"
            raise ParameterError(
                "pattern", reason, f"give shape ({problem.n}, {problem.n})"
            )
        self.problem, self._given = problem, pattern
        self.functions = self.pivots = 0
        self._is_given, self._left = difference_step is not None, MAX_ADAPTED
        self._shares = np.full(
            problem.n, STEP if difference_step is None else difference_step
        )
        self.noise = self.sizes = np.zeros(problem.n)
        self._noise_of: Vector | None = None
        self._last: tuple[Vector, Matrix] | None = None
        self._values = deque[tuple[Vector, Vector]](maxlen=MAX_CACHED)

    def values(self, z: Vector) -> Vector:
        """Return F(z), with nan where it is undefined; a cached value is counted as an
        evaluation, too."""
        self.functions += 1
        return self.known_values(z)

    def known_values(self, z: Vector) -> Vector:
        """Return F(z) without counting it; it is evaluated only if it is not cached."""
        if (F := self.cached(z)) is None:
            F = self.problem.values(z)
            self._values.appendleft((z, F))
        return F

    def cached(self, z: Vector) -> Vector | None:
        """Return F(z) if it is cached; else None."""
        return next((F for point, F in self._values if np.array_equal(point, z)), None)

    def jacobian(self, z: Vector) -> Matrix:
        """Return J(z), dense or a csr array, with nan or infinity where it is
        undefined."""
        if self._last is None or not np.array_equal(self._last[0], z):
            is_first, by_differences = self._last is None, self.problem.J is None
            self._last = (
                z,
                self._differences(z, self._steps(z))
                if by_differences
                else self.problem.jacobian(z),
            )
            if (
                is_first
                and by_differences
                and not self._is_given
                and self._is_doubtful(*self._last)
            ):
                self.adapt(z)
                return self.jacobian(z)
        return self._last[1]

    @np.errstate(all="ignore")
    def _is_doubtful(self, z: Vector, J: Matrix) -> bool:
        """Return whether differences by longer steps in all components are far from
        those by J."""
        F = self.known_values(z)
        slopes = list[Vector]()
        differs = list[Mask]()
        # The second step follows where curvature may be the reason.
        for step in (LONG_STEP, RATIO * STEP):
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
        """Change the steps of differences to what suits F at z; return whether they
        have changed by a factor of more than 2. They become longer where F is noisy, as
        J. J. Moré and S. M. Wild, Estimating derivatives of noisy simulations, ACM
        Transactions on Mathematical Software 38 (2012) 19, choose them, and shorter
        where that changes quotients."""
        if self.problem.J is not None or self._is_given or self._left == 0:
            return False
        before = self._shares.copy()
        F = self.known_values(z)
        noise = self.noise_at(z)
        move = self._inward(z, LONG_STEP * np.maximum(np.abs(z), 1.0))
        ranges = np.abs(self.values(z + move) - F) / LONG_STEP
        noisy = (noise > 0) & np.isfinite(ranges)
        if noisy.any():
            shares = BEST * np.sqrt(
                np.median(noise[noisy] / np.maximum(ranges, noise)[noisy])
            )
            self._shares = (
                np.clip(shares, self._shares, LONGEST)
                if shares > STEP
                else self._shares
            )
        if (self._shares == before).all():
            for group in self._groups:
                self._shorten(z, F, group)
        is_changed = bool((np.abs(np.log2(self._shares / before)) > 1).any())
        self._left = max(self._left - (1 if is_changed else MAX_ADAPTED // 2), 0)
        self._last = None if is_changed else self._last
        return is_changed

    def noise_at(self, z: Vector) -> Vector:
        """Return the noise of each row of F close to z."""
        if self._noise_of is None or not np.array_equal(self._noise_of, z):
            self._noise_of = z
            self.noise, self.sizes = noise(
                self.values, self.problem.box, z, self.noise > 0
            )
        return self.noise

    def _shorten(self, z: Vector, F: Vector, group: Indices) -> None:
        """Divide the steps of a group until that hardly changes its quotients, or
        rounding dominates."""
        longer = self._quotient(z, F, self._steps(z), group)
        for _ in range(MAX_SHORTER):
            self._shares[group] /= RATIO
            steps = self._steps(z)
            shorter = self._quotient(z, F, steps, group)
            changes = np.abs(shorter * self._divisors(steps, group))
            counts = (changes > 10 * self.noise) & (
                changes > ROUNDINGS * EPS * np.abs(F)
            ) | ~np.isfinite(shorter)
            apart = np.abs(longer - shorter) > SAME * np.abs(shorter)
            if not (counts & (apart | ~np.isfinite(longer))).any():
                self._shares[group] *= RATIO
                return
            longer = shorter

    def finite_jacobian(self, z: Vector) -> Matrix | None:
        """Return J(z), or None unless all its entries are finite."""
        J = self.jacobian(z)
        entries = J.data if is_sparse(J) else J.ravel()
        return J if is_finite(entries) else None

    @np.errstate(all="ignore")
    def fault_of_jacobian(self, z: Vector) -> str:
        """Return the entry in which the J(z) of the problem differs most from
        differences of F on both sides, as a clause; "" if no entry differs by much, or
        there would be too many differences."""
        J = self.jacobian(z)
        if self.problem.J is None or (self.problem.n > MAX_DENSE and not is_sparse(J)):
            return ""
        other = Evaluations(
            copy(self.problem), J if self.problem.n > MAX_DENSE else None
        )
        other.problem.J = None
        other.adapt(z)
        steps, F = other._steps(z), self.known_values(z)
        ways = [
            dense(other._differences(z, step))
            for step in (steps, self.problem.box.project(z - steps) - z)
        ]
        J = dense(J)
        low = np.fmin(*ways)
        high = np.fmax(*ways)
        gaps = np.fmax(low - J, J - high)
        sizes = np.fmax(np.abs(J), np.fmax(np.abs(low), np.abs(high)))
        gaps = np.where(np.isfinite(J), gaps, np.where(np.isfinite(low), np.inf, 0.0))
        scales = np.maximum(np.abs(z), 1.0)
        noise = np.maximum(other.noise, EPS * np.abs(F))
        notable = NOTABLE * (sizes * scales).max(axis=1, initial=0.0)[:, np.newaxis]
        min_gap = np.maximum(
            notable / scales, ROUNDINGS * noise[:, np.newaxis] / np.abs(steps)
        )
        excess = np.where(gaps > np.maximum(WRONG * sizes, min_gap), gaps / sizes, 0.0)
        excess = np.where(gaps == np.inf, np.inf, excess)
        if not excess.any():
            return ""
        i, j = np.unravel_index(excess.argmax(), excess.shape)
        return (
            f"J[{i}, {j}] is {J[i, j]:.6g} there, but {BY_DIFFERENCES} "
            f"{ways[0][i, j]:.6g} {FROM_0}"
        )

    @cached_property
    def _rows(self) -> list[Indices] | None:
        """Return where each column of J may differ from 0, as F changes with z_j at x0,
        or is nan where z_j is; None if J is to be dense."""
        n, rows = self.problem.n, list[Indices]()
        if self._given is not None:
            with imports:
                from scipy.sparse import coo_array
            pattern = coo_array(self._given).tocsc()  # where repeated entries are one
            return np.split(pattern.indices, pattern.indptr[1:-1])
        if n <= MAX_DENSE:
            return None
        z, F = self.problem.x0, self.values(self.problem.x0)
        for j in range(n):
            shifted_z, undefined = z.copy(), z.copy()
            shifted_z[j], undefined[j] = z[j] + self._steps(z)[j], np.nan
            rows.append(
                (
                    (self.values(shifted_z) != F) | np.isnan(self.values(undefined))
                ).nonzero()[0]
            )
        return rows

    @cached_property
    def _groups(self) -> list[Indices]:
        """Return groups of columns, made greedily, of which no two in a group have a
        common row."""
        n = self.problem.n
        if self._rows is None:
            return [np.array([j]) for j in range(n)]
        last, color = np.full((n, 0), False), np.full(n, -1)
        for j, rows in enumerate(self._rows):
            free = (~last[rows].any(axis=0)).nonzero()[0]
            if not free.size:
                last, free = (
                    np.hstack([last, np.full((n, 1), False)]),
                    np.array([last.shape[1]]),
                )
            color[j] = free[0]
            last[rows, free[0]] = True
        return [(color == k).nonzero()[0] for k in range(last.shape[1])]

    def _steps(self, z: Vector) -> Vector:
        return self._inward(z, self._shares * np.maximum(np.abs(z), 1.0))

    def _inward(self, z: Vector, steps: Vector) -> Vector:
        """Return steps within the bounds, downwards where the upper bound is too close
        and the lower one is farther away."""
        above, below = self.problem.upper - z, z - self.problem.lower
        is_down = (above < steps) & (below > above)
        return np.where(is_down, -np.minimum(steps, below), np.minimum(steps, above))

    @np.errstate(all="ignore")
    def _differences(self, z: Vector, steps: Vector) -> Matrix:
        """Return J by forward differences, by backward ones where those are
        undefined."""
        F = self.known_values(z)
        quotients = [self._quotient(z, F, steps, group) for group in self._groups]
        rows = self._rows
        n = self.problem.n
        if rows is None:
            return np.array(quotients).T
        with imports:
            from scipy.sparse import csc_array
        of_column = {
            j: column_rows
            for group, column_rows in zip(self._groups, quotients, strict=True)
            for j in group.tolist()
        }
        data = np.concatenate(
            [of_column[j][column_rows] for j, column_rows in enumerate(rows)]
        )
        return csc_array(
            (data, np.concatenate(rows), np.cumsum([0, *map(len, rows)])), shape=(n, n)
        ).tocsr()

    def _quotient(self, z: Vector, F: Vector, steps: Vector, group: Indices) -> Vector:
        """Return the change of F with the components of a group, each row divided by
        the step of its component."""
        quotient = np.full(z.size, np.nan)
        for sign in (1.0, -1.0):
            if not is_finite(quotient):
                shifted_z = z.copy()
                shifted_z[group] += sign * steps[group]
                self.functions += 1
                one_sided = (self.problem.values(shifted_z) - F) / self._divisors(
                    shifted_z - z, group
                )
                quotient = np.where(np.isfinite(quotient), quotient, one_sided)
        return quotient

    def _divisors(self, steps: Vector, group: Indices) -> Vector:
        """Return for each row the move of the component of the group that it depends
        on; 1 without one."""
        divisors = np.ones(self.problem.n)
        for j in group.tolist():
            divisors[slice(None) if self._rows is None else self._rows[j]] = (
                steps[j] or 1.0
            )
        return divisors


class _Quotient(NamedTuple):
    """The change of F along a direction relative to the step, how far J is from it, and
    the terms of J."""

    change: Vector
    gap: Vector
    terms: Vector


class Slopes:
    """What quotients of differences along directions d with |d_j| <= |z_j| show about
    the rows of F at z.

    A quotient is right where a shorter step changes it little: for longer ones the
    curvature of F matters, for shorter ones its noise. The derivative of a row along d
    is at most its terms |J| |z|, whatever the J of the problem is. Two steps suffice
    for a smooth F with moderate scaling. Where their quotients disagree, shorter steps
    follow, then longer ones, as a noisy F needs; the latter are used up to the
    quotients by shorter ones, unless these are 0, as of a rounded F.

    min_terms : lower bounds on these terms. refuting : the number of pairs of quotients
        of each row that agree, but not with J.
    """

    def __init__(
        self, problem: NonlinearProblem, z: Vector, F: Vector, J: Matrix
    ) -> None:
        self._problem = problem
        self._z = z
        self._F = F
        self._J = J
        self._terms = absolute_product(J, np.abs(z))
        self._random = generator(0)
        self._first = list[_Quotient]()
        self.min_terms = np.zeros(z.size)
        self._confirmed, self.refuting = np.zeros((2, z.size), dtype=int)

    @property
    def is_uneven(self) -> bool:
        """Return whether the quotients by the first two steps differ from J by more
        than those of a smooth F do."""
        first = self._first or [
            self._quotient(step * self._direction()) for step in STEPS[:2]
        ]
        return any((quotient.gap > UNEVEN * quotient.terms).any() for quotient in first)

    @property
    def refuted(self) -> Mask:
        """Return the rows in which J is wrong; one pair of quotients that differ from
        it may be noise."""
        return self.refuting >= REFUTED

    @np.errstate(all="ignore")
    def lacking(self, needed: Vector) -> Mask:
        """Return the rows whose terms are not shown to be as large as needed, and in
        which J is not confirmed."""
        for _ in range(DIRECTIONS):
            self._confirmed += self._along(self._direction(), needed)
            is_open = self.min_terms < needed
            if (
                not is_open.any()
                or (is_open & (self.refuted | (self._confirmed == 0))).any()
            ):
                break
        return np.asarray(
            (self.min_terms < needed) & (self.refuted | (self._confirmed < DIRECTIONS))
        )

    def _direction(self) -> Vector:
        """Return a direction at random, but towards the farther bound where the other
        one is close."""
        z = self._z
        sizes = np.abs(self._z) * self._random.uniform(0.5, 1.0, self._z.size)
        above, below = self._problem.upper - z, z - self._problem.lower
        is_close = np.minimum(above, below) < STEPS[-1] * sizes
        up = np.where(is_close, above >= below, self._random.random(z.size) < 0.5)
        return np.where(up, sizes, -sizes)

    def _along(self, d: Vector, needed: Vector) -> Mask:
        """Add what a direction shows; return in which rows J agrees with two successive
        quotients."""
        quotients, is_confirmed = dict[float, _Quotient](), np.zeros(d.size, dtype=bool)
        max_changes = np.full(d.size, np.inf)  # by the quotients of shorter steps
        for step in STEPS:
            quotients[step] = quotient = self._quotient(step * d)
            if len(self._first) < 2:
                self._first.append(quotient)
            if (
                other := quotients.get(RATIO * step) or quotients.get(step / RATIO)
            ) is not None:
                apart = np.abs(quotient.change - other.change)
                low = (
                    np.fmin(np.abs(quotient.change), np.abs(other.change))
                    - APART * apart
                )
                if step > STEPS[0]:  # longer than those before
                    sizes = np.array(
                        [
                            np.abs(each.change)
                            for length, each in quotients.items()
                            if length < step
                        ]
                    )
                    max_changes = np.where(sizes > 0, sizes, np.inf).min(axis=0)
                self.min_terms = np.fmax(self.min_terms, np.fmin(low, max_changes))
                covered = quotient.terms >= COVERED * self._terms
                is_confirmed |= (
                    np.maximum(quotient.gap, other.gap) <= MATCH * quotient.terms
                ) & covered
                differs = (
                    np.minimum(quotient.gap, other.gap)
                    > 2 * apart + MATCH * quotient.terms
                )
                self.refuting += (low > 0) & (low <= max_changes) & differs
            is_open = self.min_terms < needed
            if not (is_open & ~is_confirmed).any() or (is_open & self.refuted).any():
                break
        return is_confirmed

    @np.errstate(all="ignore")
    def unsmooth(self, noise: Vector) -> tuple[Mask, Mask]:
        """Return the rows with a kink at z, by the slopes on both sides, and those with
        a jump, far above the noise."""
        d = self._direction()
        distance = np.minimum(
            self._problem.upper - self._z, self._z - self._problem.lower
        )
        # On each side, the changes by a long and a short step.
        ways = d, np.where(distance < STEPS[0] * np.abs(d), 0.0, d)
        sides, inner = [
            [
                [self._quotient(sign * step * direction).change for step in STEPS[:2]]
                for sign in (1.0, -1.0)
            ]
            for direction in ways
        ]
        steady = [
            np.abs(long - short) <= KINKED / 4 * np.abs(short) for long, short in inner
        ]
        short = [side[1] for side in inner]
        kink = (
            steady[0]
            & steady[1]
            & (np.abs(short[0] + short[1]) > KINKED * np.fmax(*np.abs(short)))
        )
        grows = [np.abs(short) > RATIO / 2 * np.abs(long) for long, short in sides]
        large = [STEPS[1] * np.abs(short) > 16 * noise for _, short in sides]
        return kink, (grows[0] & large[0]) | (grows[1] & large[1])

    def _quotient(self, step: Vector) -> _Quotient:
        move = (shifted_z := self._problem.box.project(self._z + step)) - self._z
        move_of_z = np.where(self._z != 0, np.abs(move) / np.abs(self._z), 0.0)
        length = move_of_z.max(initial=0.0) or 1.0
        change, d = (self._problem.values(shifted_z) - self._F) / length, move / length
        return _Quotient(
            change,
            np.abs(change - product(self._J, d)),
            absolute_product(self._J, np.abs(d)),
        )


@np.errstate(all="ignore")
def noise(values: Values, box: Box, z: Vector, is_noisy: Mask) -> tuple[Vector, Vector]:
    """Return the noise of each row of F at z, be it of rounding or of inner iterations:
    the first level on which points of two spacings agree, from the coarsest one on; 0
    where there is none above rounding, and where finer spacings resolve apparent noise
    as oscillations of F, unless the row is known to be noisy. And the largest |F_i|."""
    (noise_levels, last), is_known = np.zeros((2, z.size)), np.zeros(z.size, dtype=bool)
    sizes, thirds = np.abs(values(z)), list[Vector]()
    for spacing in SPACINGS:
        F, level, is_noise, third = _level(values, box, z, spacing)
        sizes = np.fmax(sizes, np.where(np.isfinite(F), np.abs(F), 0.0).max(axis=0))
        apart = np.maximum(level, last) > ALIKE * np.minimum(level, last)
        is_new_level = is_noise & ~apart & ~is_known
        noise_levels = np.where(is_new_level, level, noise_levels)
        is_known |= is_new_level | (third <= QUIET * sizes)
        last = np.where(is_noise, level, last)
        thirds.append(third)
        if is_known.all():
            break
    noise_levels[
        _oscillates(values, box, z, np.where(is_noisy, 0.0, noise_levels), thirds)
    ] = 0.0
    return noise_levels, sizes


def _oscillates(
    values: Values, box: Box, z: Vector, noise_levels: Vector, thirds: list[Vector]
) -> Mask:
    """Return the rows of which finer spacings resolve apparent noise: in the
    differences of third order F then falls little by little, and as the cube of the
    spacing; noise falls at once, if at all. noise_levels : 0 in rows that are not
    tested. thirds : these differences by the first spacings."""
    finest = SPACINGS.index(RESOLVED)
    resolved = np.zeros(z.size, dtype=bool)
    is_open = noise_levels > 0
    if is_open.any() and len(thirds) <= finest:
        is_open &= _level(values, box, z, RESOLVED)[-1] < noise_levels / ALIKE
    last = np.zeros(z.size)  # no fall
    for k in range(1, finest + 1):
        if not is_open.any():
            break
        if k == len(thirds):
            thirds.append(_level(values, box, z, SPACINGS[k])[-1])
        # The fall of noise, not that of curvature.
        fall = np.where(
            thirds[k - 1] > ALIKE * noise_levels, 0.0, thirds[k - 1] / thirds[k]
        )
        resolved |= (
            is_open & (last >= MIN_FALL) & (fall >= CUBIC[0]) & (fall <= CUBIC[1])
        )
        is_open &= ~resolved & (fall <= CUBIC[1])
        last = fall
    return resolved


@np.errstate(all="ignore")
def rounding(values: Values, box: Box, z: Vector) -> Vector:
    """Return the noise of each row of F at z that is of rounding, by the finest spacing
    that shows it. Where |F| is larger at the points than at z, so may its rounding be;
    so the noise is at most that by closer points."""
    rounding_levels = np.zeros(z.size)
    is_known = np.zeros(z.size, dtype=bool)
    closest = np.full(z.size, np.inf)
    finest = 48 - int(np.floor(np.log2(min(size(z) or 1.0, 1.0))))
    for power in range(finest, 0, -6):
        F, level, is_noise, third = _level(values, box, z, 2.0**-power)
        if not np.isfinite(F).all():
            break
        closest = np.where(third > 0, np.fmin(closest, third), closest)
        is_noise &= level <= MAX_NOISE * np.abs(F).max(axis=0)
        rounding_levels = np.where(
            is_noise & ~is_known, np.minimum(level, ALIKE * closest), rounding_levels
        )
        is_known |= is_noise
        if is_known.all():
            break
    return rounding_levels


def _level(
    values: Values, box: Box, z: Vector, spacing: float
) -> tuple[Vector, Vector, Mask, Vector]:
    """Return F at ORDERS + 1 points from z on, in their rows, with a spacing relative
    to z, or to 1 if z is smaller; the noise of each row that its differences show, and
    whether they show noise: they change sign, few are 0, more than one is large, and
    those of successive orders agree; and the noise by differences of third order, to
    which a smooth F contributes almost nothing."""
    above, below = box.upper - z, z - box.lower
    up = np.where(above == below, generator(0).random(z.size) < 0.5, above > below)
    steps = np.where(up, spacing, -spacing) * np.maximum(np.abs(z), 1.0)
    F = table = np.array(
        [values(box.project(z + k * steps)) for k in range(ORDERS + 1)]
    )
    levels = list[Vector]()
    changes = list[Mask]()
    first = np.diff(F, axis=0)
    sorted_changes = np.sort(np.abs(first - np.median(first, axis=0)), axis=0)
    few = ((first == 0).mean(axis=0) <= MAX_EQUAL) & (
        sorted_changes[-2] >= JUMP * sorted_changes[-1]
    )  # no jump
    for order in range(1, ORDERS):
        table = np.diff(table, axis=0)
        levels.append(np.sqrt((table**2).mean(axis=0) / comb(2 * order, order)))
        changes.append((table.min(axis=0) < 0) & (table.max(axis=0) > 0))
    level, is_noise = np.zeros(z.size), np.zeros(z.size, dtype=bool)
    for k in range(len(levels) - 2):
        three = np.array(levels[k : k + 3])
        agree = (three.max(axis=0) <= ALIKE * three.min(axis=0)) & changes[k] & few
        level = np.where(agree & ~is_noise, levels[k], level)
        is_noise |= agree
    return F, level, is_noise, levels[2]
