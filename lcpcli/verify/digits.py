"""The number of digits of a solution that its data determine: how far the solution
moves if every number of the data is rounded.

Changes dM and dq move z_B of the basic variables B by -M_BB^-1 (dM z + dq)_B, to first
order (N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM 2002,
section 7.2). For changes like those of rounding, independent and up to half an ulp of
each number, the standard deviation of this motion is estimated from a few systems with
random right-hand sides. Unlike a condition number it does not depend on the scaling of
the data. The part due to w_B, if the equations are not solved exactly, is added.
Changes |dM| <= eps |M|, |dq| <= eps |q| move z_B by at most eps
|M_BB^-1| (|M| |z| + |q|)_B: no method that works with rounded data can be expected to
do better.

Digits are determined for each component separately. If M_BB is singular to working
precision, for example because an equation follows from others, z_B + v solves the same
equations for all v with M_BB v = 0. A z_i with v_i != 0 for one of them is not unique.
The others move by -G (dM z + dq)_B with any generalized inverse G of M_BB, for changes
that leave the equations consistent, as if dependent data were rounded consistently.

A kink is an index at which z_i is at a bound and w_i is not safely larger than its
motion, or at which z_i is basic and its distance from a bound is not: rounding may then
swap the roles of the two numbers. With r the motions of these numbers, and T their
derivatives with respect to the other numbers of the pairs (a principal transform of M),
pivots on the pairs of a set F move their other numbers by y_F = -T_FF^-1 r_F, and all
components with them. The motions are estimated for many sets F, which may create
further kinks. If T_FF is singular, r_F is the same for y_F + v with T_FF v = 0, and the
components that v moves are not unique.
"""

from __future__ import annotations

import math
from contextlib import suppress
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from lcpcli.interrupts import TimeIsUp
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS, LARGEST_DOUBLE, ROW_ROUNDING, SMALL_DISTANCE
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix, Solve, finite
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.units import (
    MIN_DIGITS,
    PseudoInverse,
    largest_growth,
)
from lcpcli.model.box import Box, of_masks
from lcpcli.model.changes import scale
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Mask, Vector

DOUBLE_DIGITS = 16  # decimal digits of a double precision number
# Random right-hand sides: they estimate the standard deviation to a factor of about
# two.
SAMPLES = 8
# Basic variables up to which a factorization takes a few hundredths of a second.
MAX_BASIC, MAX_BASIC_SPARSE = 1000, 20_000
# Basic variables of a singular system up to which a factorization with column pivoting
# takes as little time.
MAX_SINGULAR = 500
# The largest ratio of a pivot that is rounding error to the one before it. In a matrix
# that is only ill-conditioned, pivots decrease gradually, and its rank is not defined.
LARGEST_GAP = 1e-4
# Standard deviation of the relative change of a number by rounding, for mantissas m
# distributed with density proportional to 1 / m (Benford's law).
ROUNDING_DEVIATION = 0.21 * EPS
MEDIAN = 0.674  # the median of |x| for a standard normal x
# A number is a kink unless it is farther from 0 or its bound than this many standard
# deviations of its motion: a sum of few rounding errors moves it by at most three of
# them, so that the rest is a margin.
SAFE = 100.0
# The largest number of kinks that are pivoted: their linear systems take about a
# tenth of a second.
MAX_KINKS = 100
MAX_COMBINED = 8  # kinks up to which every subset is pivoted
RANDOM_PARTS = 250  # random subsets of more kinks, in addition to single kinks


class Digits(NamedTuple):
    """The digits of a solution z that its data determine.

    counts : the number of digits of each z_i that the data determine, from 0 to
        DOUBLE_DIGITS, shape (n,): all digits for a z_i at a bound. It is NaN if
        rounding may move z_i off its bound, if a pivot on other components leaves no
        digit, or if z_i is not unique.
    not_unique : the z_i that differ, to working precision, among the solutions close to
        z.
    """

    counts: Vector
    not_unique: Mask


@np.errstate(all="ignore")
def digits(problem: Problem, z: Vector, w: Vector) -> Digits | None:
    """Return the digits of a solution that its data determine; None if M_BB is too
    large, or singular with a rank that is not clear.
    """
    basic = (z != problem.lower) & (z != problem.upper)
    if np.count_nonzero(basic) > (
        MAX_BASIC_SPARSE if is_sparse(problem.M) else MAX_BASIC
    ):
        return None
    motions = _motions(problem, z, w, basic) if problem.is_moderate else None
    if motions is None or not np.isfinite(motions.alone).all():
        units = scale(problem)
        problem = units.problem
        z = units.z_inside(z)
        w = units.w_inside(w)
        motions = _motions(problem, z, w, basic) if problem.is_moderate else None
    if motions is None:
        return None
    alone, exchanged = (
        np.where(motion == 0, DOUBLE_DIGITS, _count(motion, z))
        for motion in (motions.alone, motions.exchanged)
    )
    is_lost = np.where(basic, (exchanged == 0) & (alone > 0), motions.may_reach_bound)
    counts = np.where(basic, exchanged, DOUBLE_DIGITS)
    unknown = is_lost | motions.not_unique | ~motions.determined
    return Digits(np.where(unknown, np.nan, counts), motions.not_unique)


def _count(motion: Vector, z: Vector) -> Vector:
    """Return the number of digits of z_i that a motion of this size does not change."""
    count = np.nan_to_num(-np.log10(motion / np.abs(z)), nan=0.0)
    return np.asarray(np.clip(np.rint(count), 0, DOUBLE_DIGITS))


def determined(
    problem: Problem, z: Vector, w: Vector
) -> tuple[list[int | None], list[int]] | None:
    """Return the counts of `digits` as integers, with None for NaN, and the indices of
    the components that are not unique; None if they are not known, or the time limit is
    reached.
    """
    with suppress(TimeIsUp):
        result = digits(problem, z, w)
        if result is None:
            return None
        counts = [
            None if math.isnan(count) else int(count)
            for count in result.counts.tolist()
        ]
        return counts, np.flatnonzero(result.not_unique).tolist()
    return None


def fewest_digits(problem: Problem, z: Vector, determined: Vector) -> tuple[int, int]:
    """Return the smallest number of determined digits and the index of that component,
    among the components that are not 0 up to rounding.
    """
    sizes = np.log2(np.abs(z), where=z != 0, out=np.full(z.size, -np.inf))
    negligible = np.ones(z.size, dtype=bool)
    for powers in (sizes, sizes - problem.units.columns):
        negligible &= powers <= powers.max() + np.log2(SMALL_DISTANCE)
    relevant = np.where(negligible | np.isnan(determined), DOUBLE_DIGITS, determined)
    i = int(np.argmin(relevant))
    return int(relevant[i]), i


class _States:
    """The basic variables B, and which z_i their equations w_B = 0 determine.

    determined : the z_i that they determine, shape (n,); a z_i at a bound is
        determined.
    is_regular : whether systems with M_BB, or with its regular part, are solved to a
        few digits.
    """

    def __init__(self, problem: Problem, basic: Mask) -> None:
        """Raise SingularMatrix if M_BB is singular and its rank is not clear."""
        self.problem = problem
        self.M = M = problem.M
        self.basic = basic
        self.B = np.flatnonzero(basic)
        self.determined = np.ones(basic.size, dtype=bool)
        self.is_regular, self._block = True, None
        if not self.B.size:
            return
        block = M[self.B][:, self.B]
        try:
            self._solve: Solve = PrincipalSolver(M).at(self.B)
            growth = largest_growth(block, self._solve)
        except (SingularMatrix, ValueError):
            growth = math.nan
        self.is_regular = growth * ROW_ROUNDING < MIN_DIGITS
        if self.is_regular:
            return
        if self.B.size <= MAX_SINGULAR:
            dense = np.asarray(matrices.dense(block))
            inverse = PseudoInverse(dense, self.B.size * ROW_ROUNDING)
            if inverse.is_singular and inverse.gap <= LARGEST_GAP:
                self._solve = self._block = inverse
                self.determined[self.B] = inverse.determines(np.eye(self.B.size))
                self.is_regular = True
        if math.isnan(growth) and self._block is None:
            raise SingularMatrix

    def response(self, changes: Vector) -> Vector:
        """Return the changes of z_B and of w_N for changes of q, shape (n, k)."""
        moves = np.zeros_like(changes)
        if self.B.size:
            moves[self.B] = -self._solve(changes[self.B])
        others = changes + matrices.product(self.M, moves)
        return np.where(self.basic[:, np.newaxis], moves, others)

    def residual(self, changes: Vector, moves: Vector) -> Vector:
        """Return the residuals of w_B = 0 for the responses `moves` to changes of q; 0
        for nonbasic variables."""
        of_basic = np.where(self.basic[:, np.newaxis], moves, 0.0)
        remainder = changes + matrices.product(self.M, of_basic)
        return np.where(self.basic[:, np.newaxis], remainder, 0.0)

    def contradictions(self, changes: Vector) -> Vector:
        """Return by how much changes of q, shape (n, k), make dependent equations
        inconsistent, relative to the changes, shape (j, k).
        """
        if self._block is None:
            return np.zeros((0, changes.shape[1]))
        return self._block.contradictions(changes[self.B])

    def free(self, kinks: Mask) -> Mask:
        """Return which z_i differ among the solutions of w_B = 0 for which the w of
        kinks at bounds are 0 too.

        kinks : mask of shape (n,).
        """
        is_free = np.zeros(self.basic.size, dtype=bool)
        if self._block is not None:
            rows = self.M[np.flatnonzero(kinks & ~self.basic)][:, self.B]
            is_free[self.B] = self._block.free(np.asarray(matrices.dense(rows)))
        return is_free


class _Motions(NamedTuple):
    """How far rounding of the data moves a solution; each of shape (n,).

    alone : the expected errors of z_i in B and of w_i elsewhere. exchanged : those
        after pivots at kinks. may_reach_bound : the numbers so close to their
        bounds, or to 0, that rounding may move them there. With too many kinks, errors
        are infinite, and this is True everywhere.
    determined : as in `_States`. not_unique : as in `Digits`.
    """

    alone: Vector
    exchanged: Vector
    may_reach_bound: Mask
    determined: Mask
    not_unique: Mask


@np.errstate(all="ignore")
def _motions(problem: Problem, z: Vector, w: Vector, basic: Mask) -> _Motions | None:
    """Return how far rounding of the data moves a solution; None if M_BB is singular
    with a rank that is not clear.
    """
    try:
        statuses = _States(problem, basic)
        distances = state_slacks(problem.box, z, w, basic)
        violations = np.where(basic | (distances < 0), w, 0.0)
        changes = _changes(problem, z, violations, basic)
        moves = statuses.response(changes)
        # The residuals of the linear systems are converted to errors of the motions.
        errors = _sizes(statuses.response(statuses.residual(changes, moves)))
    except (SingularMatrix, ValueError):
        return None
    sizes = _sizes(moves)
    # A component that does not move, as a multiplier of 0, has only this error.
    is_at_rest = (sizes <= 2 * errors).all(axis=0) & (z == 0) & basic
    alone = sizes = np.where(is_at_rest & statuses.is_regular, 0.0, sizes + errors)
    if not np.isfinite(alone[:, basic]).all():
        return None
    distances[~statuses.determined] = np.inf
    kinks, at_bound, free = np.zeros((3, z.size), dtype=bool)
    while True:
        may_reach_bound = distances <= np.nan_to_num(
            sizes[0] + SAFE * sizes[1], nan=LARGEST_DOUBLE, posinf=LARGEST_DOUBLE
        )
        # A number that is 0 and does not move causes no pivot; nor does one that is
        # not unique, as its basis status is not determined.
        at_bound |= may_reach_bound & np.isfinite(sizes).all(axis=0)
        new = at_bound & ~kinks & sizes.any(axis=0)
        kinks |= new
        if np.count_nonzero(kinks) > MAX_KINKS:
            may_reach_bound = np.ones(z.size, dtype=bool)
            sizes = np.full_like(sizes, np.inf)
            break
        if not new.any():
            break
        exchanges = _Exchanges(statuses, z, moves, kinks, at_bound)
        sizes, free = exchanges.largest_sizes(), exchanges.free
    return _Motions(
        alone[0] + MEDIAN * alone[1],
        sizes[0] + MEDIAN * sizes[1],
        may_reach_bound,
        statuses.determined,
        free | statuses.free(kinks),
    )


def _changes(problem: Problem, z: Vector, violations: Vector, basic: Mask) -> Vector:
    """Return the changes of w whose effects are computed, shape (n, 1 + SAMPLES): the
    violations in the first column, then random samples of the rounding errors of the
    data.
    """
    M = problem.M
    squares = M.power(2) @ z**2 if is_sparse(M) else np.einsum("ij,ij,j->i", M, M, z**2)
    random = np.empty((z.size, SAMPLES))
    random[np.concatenate((np.flatnonzero(basic), np.flatnonzero(~basic)))] = signs(
        z.size
    )
    deviations = ROUNDING_DEVIATION * np.sqrt(squares + problem.q**2)
    return np.column_stack((violations, deviations[:, np.newaxis] * random))


class _Exchanges:
    """The motions after pivots on subsets F of the kinks P: the other number y_k of
    each pair then moves by as much as keeps this number at its bound, or at 0.

    free : the z_i that such pivots show to differ among the solutions close to z,
        shape (n,).
    """

    def __init__(
        self, statuses: _States, z: Vector, moves: Vector, kinks: Mask, at_bound: Mask
    ) -> None:
        problem = statuses.problem
        basic = statuses.basic
        box = problem.box
        P = np.flatnonzero(kinks)
        # The changes of q that have the effect of w_i = 1 for i in B, and of z_i = 1
        # otherwise.
        identity = np.equal.outer(np.arange(z.size), P).astype(float)
        columns = np.where(basic[P], -identity, matrices.dense(problem.M[:, P]))
        effects = statuses.response(columns)
        # Both w_i and z_i are scaled by R and C, as they are compared.
        R, C = problem.units.diagonals()
        self._units = np.where(basic, C, 1 / R)[:, np.newaxis]
        of_y = np.where(basic, 1 / R, C)[P]
        effects *= of_y / self._units
        # Effects below this are rounding errors of 0. If M_BB is ill-conditioned, no
        # threshold would separate them.
        rounding = z.size * ROW_ROUNDING if statuses.is_regular else 0.0
        self._noise = rounding * np.abs(effects).max(axis=0)
        self._effects = np.where(np.abs(effects) <= self._noise, 0.0, effects)
        # If equations are dependent, y_P may make them inconsistent.
        self._contradictions = statuses.contradictions(columns)
        self._moves = moves / self._units
        self._P = P
        self._basic = basic
        self._at_bound = at_bound
        # 1 if a number is closer to its lower bound, and may not decrease; else -1.
        self._signs = np.where(box.upper - z < z - box.lower, -1.0, 1.0)
        self.free = np.zeros(z.size, dtype=bool)

    def largest_sizes(self) -> Vector:
        """Return the largest motions over the basis itself and all pivots on subsets of
        kinks.
        """
        largest, singular = _sizes(self._moves), list[Mask]()
        for part in _parts(self._P.size):
            F, effects = self._P[part], self._effects[:, part]
            try:
                y = np.linalg.solve(effects[F], self._moves[F])
                sizes = _sizes(self._moves - effects @ y)
                grown = F.size * ROW_ROUNDING * np.abs(y).max(initial=0.0)
                is_singular = grown > np.abs(self._moves[F]).max(initial=0.0)
            except SingularMatrix:
                sizes = np.where(effects.any(axis=1), np.inf, 0.0)
                is_singular = True
            # A subset that contains a singular one yields no further information.
            if is_singular and any(part[other].all() for other in singular):
                continue
            if is_singular or self._contradictions[:, part].any():
                of_singular = self._of_singular(part)
                if of_singular is not None:
                    sizes, has_free = of_singular
                    if has_free:
                        singular.append(part)
            largest = np.maximum(largest, np.where(np.isnan(sizes), np.inf, sizes))
        return largest * self._units[:, 0]

    def _of_singular(self, part: Mask) -> tuple[Vector, bool] | None:
        """Return the motions for a subset F for which T_FF is singular, or y_F may make
        equations inconsistent, and whether there are v != 0 with T_FF v = 0; components
        that such a v moves have infinite motions. Also record the components that
        differ among the solutions on these v. None if the rank is not clear.
        """
        F, effects = self._P[part], self._effects[:, part]
        noise = F.size * self._noise[part].max()
        others = self._contradictions[:, part]
        # Effects and contradictions are made comparable in size.
        scale = np.abs(effects).max() or 1.0
        T = np.vstack((effects[F], others * scale))
        left, values, right = np.linalg.svd(finite(T))
        rank = int(np.count_nonzero(values > noise))
        if 0 < rank < F.size and values[rank] > LARGEST_GAP * values[rank - 1]:
            return None
        moves = left[: F.size, :rank].T @ self._moves[F]
        y = right[:rank].T / values[:rank] @ moves
        null = right[rank:].T
        motions = effects @ null
        motions[np.abs(motions) <= noise] = 0.0
        motions[F] = 0.0
        for v, motion in zip(null.T, motions.T, strict=True):
            self._record_other_solutions(F, v, motion)
        sizes = _sizes(self._moves - effects @ y)
        sizes[:, motions.any(axis=1)] = np.inf
        return sizes, rank < F.size

    def _record_other_solutions(self, F: Indices, v: Vector, motion: Vector) -> None:
        """Record the components that are not unique if y_F = s v satisfies all sign
        conditions for small s > 0 or for small s < 0.

        motion : how v moves the numbers that are not in F.
        """
        # This includes numbers that rounding does not move, as those that are 0 in the
        # data.
        at_bound = (motion * self._signs)[self._at_bound]
        others = np.where(np.abs(v) > F.size * ROW_ROUNDING, v, 0.0) * self._signs[F]
        for side in (1.0, -1.0):
            if (side * at_bound >= 0).all() and (side * others >= 0).all():
                self.free |= self._basic & (motion != 0)
                self.free[F[~self._basic[F] & (others != 0)]] = True


def _parts(count: int) -> Mask:
    """Return masks of subsets of the kinks as rows: all nonempty ones if there are few
    kinks; otherwise the whole set, each single kink, each complement of one, and
    RANDOM_PARTS random subsets.
    """
    if count <= MAX_COMBINED:
        return (np.arange(1, 2**count)[:, np.newaxis] >> np.arange(count)) % 2 > 0
    each = np.eye(count, dtype=bool)
    return np.vstack(
        (np.ones(count, dtype=bool), each, ~each, signs(count, RANDOM_PARTS).T > 0)
    )


def _sizes(moves: Vector) -> Vector:
    """Return the size of the motion by the error of w, and the standard deviation of
    the motion by rounding, shape (2, n).
    """
    return np.stack((np.abs(moves[:, 0]), np.sqrt(np.mean(moves[:, 1:] ** 2, axis=1))))


def state_slacks(box: Box, z: Vector, w: Vector, basic: Mask) -> Vector:
    """Return the distance of each component from violating the condition of its basis
    status; infinite if l_i = u_i.
    """
    return np.where(
        box.fixed,
        np.inf,
        -box.violations(z, w, of_masks(basic, ~basic & (z == box.upper))),
    )


@lru_cache(maxsize=8)
def signs(n: int, samples: int = SAMPLES) -> Vector:
    """Return columns of pseudo-random signs, shape (n, samples), the same at each call;
    the array must not be modified.
    """
    return np.sign(
        np.sin(np.outer((np.arange(n) + 1.0) ** 2, np.arange(samples) + 1.234))
    )
