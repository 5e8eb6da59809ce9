"""How many digits of a solution are determined by its data: how far it moves if each of
their numbers is rounded.

With B the basic variables, changes dM and dq move the solution by -M_BB^-1 (dM z +
dq)_B, to first order (N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd
ed., SIAM 2002, section 7.2). For changes like those by rounding, independent and up to
half a unit in the last place of each number, the standard deviation of this motion is
estimated by a few systems with random right-hand sides, which unlike a condition number
does not depend on units; the part due to w_B, if equations are not solved exactly, is
added. Changes |dM| <= eps |M|, |dq| <= eps |q| move z_B by at most eps |M_BB^-1| (|M|
|z| + |q|)_B: no method that works on rounded data can be expected to do better.

Digits belong to components. If M_BB is singular to working precision, as with an
equation that follows from others, z_B + v solves the same equations for all v with
M_BB v = 0. A z_i with v_i != 0 for one of them is not unique. The others move by -G (dM
z + dq)_B with any generalized inverse G of M_BB, for changes with which the equations
still do not contradict each other, as the numbers of one follow from those of others.

At a kink, where z_i at a bound has a w_i, or z_i in B a distance from its bound, that
is not safely larger than its own motion, rounding may exchange the two. With r the
motions of these numbers, and T their derivatives by the other numbers of the pairs (a
principal transform of M), those of an exchanged set F move by y_F = -T_FF^-1 r_F, and
all others with them. How far they do is estimated for many F, and a number may become a
kink by it in turn. If T_FF is singular, r_F is the same for y_F + v with T_FF v = 0,
which move what is not unique then.
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
from lcpcli.typing import Indices, Mask, Matrix, Vector

DOUBLE_DIGITS = 16  # decimal digits of a double
# Random right-hand sides: they give the standard deviation to within a factor of two or
# so.
SAMPLES = 8
# Variables up to which a factorization takes a few hundredths of a second.
MAX_BASIC, MAX_BASIC_SPARSE = 1000, 20_000
# Variables of a singular system up to which pivots of its columns show, in as much
# time, what it determines.
MAX_SINGULAR = 500
# Of a pivot that is rounding, relative to the one before: in a matrix that is only
# ill-conditioned pivots decrease gradually, and no rank is better than another.
LARGEST_GAP = 1e-4
# Standard deviation of a relative change by rounding, for mantissas as frequent as 1/m.
ROUNDING_DEVIATION = 0.21 * EPS
MEDIAN = 0.674  # of a normally distributed size, relative to its standard deviation
# Standard deviations that rounding does not move a number: the largest motion of few
# terms is three.
SAFE = 100.0
# That are exchanged: their linear systems take about a tenth of a second.
MAX_KINKS = 100
MAX_COMBINED = 8  # kinks up to which each set of them is exchanged
RANDOM_PARTS = 250  # of more kinks, which are exchanged besides single ones


class Digits(NamedTuple):
    """What the data determine of a solution z.

    counts : the number of digits of each z_i that the data determine, from 0 to
        DOUBLE_DIGITS, shape (n,); all digits of a z_i at a bound, but NaN if rounding
        may move it off, or if no digit is left where others do so; and NaN where z_i is
        not unique.
    not_unique : the z_i that differ, to working precision, among the solutions near z.
    """

    counts: Vector
    not_unique: Mask


@np.errstate(all="ignore")
def digits(problem: Problem, z: Vector, w: Vector) -> Digits | None:
    """Return what the data determine of a solution; None if M_BB is too large, or if
    it is singular and it is not clear which equations follow from others."""
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
    count = np.nan_to_num(-np.log10(motion / np.abs(z)), nan=0.0)
    return np.asarray(np.clip(np.rint(count), 0, DOUBLE_DIGITS))


def determined(
    problem: Problem, z: Vector, w: Vector
) -> tuple[list[int | None], list[int]] | None:
    """Return `digits` as whole numbers, with None for NaN, and the indices of the
    components that are not unique; None if the time is up before."""
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
    """Return the least number of digits of components that have one and are not 0 up to
    rounding, and its index."""
    sizes = np.log2(np.abs(z), where=z != 0, out=np.full(z.size, -np.inf))
    negligible = np.ones(z.size, dtype=bool)
    for powers in (sizes, sizes - problem.units.columns):
        negligible &= powers <= powers.max() + np.log2(SMALL_DISTANCE)
    relevant = np.where(negligible | np.isnan(determined), DOUBLE_DIGITS, determined)
    i = int(np.argmin(relevant))
    return int(relevant[i]), i


class _States:
    """The basic variables B, and what their equations w_B = 0 determine.

    determined : the z_i that they determine, shape (n,); a z_i at a bound is one.
    is_regular : whether M_BB, or the part of it that counts, has systems that are
        solved to a few digits.
    """

    def __init__(self, M: Matrix, basic: Mask) -> None:
        """Raise SingularMatrix if M_BB is singular and its rank is not clear."""
        self.M = M
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
        """Return what a response leaves of w_B = 0; 0 elsewhere."""
        of_basic = np.where(self.basic[:, np.newaxis], moves, 0.0)
        remainder = changes + matrices.product(self.M, of_basic)
        return np.where(self.basic[:, np.newaxis], remainder, 0.0)

    def contradictions(self, changes: Vector) -> Vector:
        """Return by how much changes of q, shape (n, k), contradict equations that
        follow from others, relative to the changes, shape (j, k)."""
        if self._block is None:
            return np.zeros((0, changes.shape[1]))
        return self._block.contradictions(changes[self.B])

    def free(self, kinks: Mask) -> Mask:
        """Return which z_i differ among the solutions of w_B = 0 for which the w of
        kinks at bounds, shape (n,), are 0 too."""
        is_free = np.zeros(self.basic.size, dtype=bool)
        if self._block is not None:
            rows = self.M[np.flatnonzero(kinks & ~self.basic)][:, self.B]
            is_free[self.B] = self._block.free(np.asarray(matrices.dense(rows)))
        return is_free


class _Motions(NamedTuple):
    """How far rounding moves a solution; each of shape (n,).

    alone : the expected errors of z_i in B and of w_i elsewhere. exchanged : those with
        the bases exchanged at kinks. may_reach_bound : where these numbers are so near
        to their bounds, or to 0, that rounding may take them there. With too many
        kinks, errors are infinite, and this is everywhere.
    determined : as in `_States`. not_unique : as in `Digits`.
    """

    alone: Vector
    exchanged: Vector
    may_reach_bound: Mask
    determined: Mask
    not_unique: Mask


@np.errstate(all="ignore")
def _motions(problem: Problem, z: Vector, w: Vector, basic: Mask) -> _Motions | None:
    """Return how far rounding moves a solution; None if M_BB is singular, and its rank
    is not clear."""
    try:
        states = _States(problem.M, basic)
        distances = state_slacks(problem.box, z, w, basic)
        violations = np.where(basic | (distances < 0), w, 0.0)
        changes = _changes(problem, z, violations, basic)
        moves = states.response(changes)
        # What the solver leaves of the equations is an error of the motions.
        errors = _sizes(states.response(states.residual(changes, moves)))
    except (SingularMatrix, ValueError):
        return None
    sizes = _sizes(moves)
    # Of a number that does not move, as a multiplier that is 0, it is all there is.
    is_at_rest = (sizes <= 2 * errors).all(axis=0) & (z == 0) & basic
    alone = sizes = np.where(is_at_rest & states.is_regular, 0.0, sizes + errors)
    if not np.isfinite(alone[:, basic]).all():
        return None
    distances[~states.determined] = np.inf
    kinks, at_bound, free = np.zeros((3, z.size), dtype=bool)
    while True:
        may_reach_bound = distances <= np.nan_to_num(
            sizes[0] + SAFE * sizes[1], nan=LARGEST_DOUBLE, posinf=LARGEST_DOUBLE
        )
        # What is 0, and remains so, exchanges nothing; nor does what moves among the
        # solutions, whose states these are not.
        at_bound |= may_reach_bound & np.isfinite(sizes).all(axis=0)
        new = at_bound & ~kinks & sizes.any(axis=0)
        kinks |= new
        if np.count_nonzero(kinks) > MAX_KINKS:
            may_reach_bound, sizes = (
                np.ones(z.size, dtype=bool),
                np.full_like(sizes, np.inf),
            )
            break
        if not new.any():
            break
        exchanges = _Exchanges(problem, z, states, moves, kinks, at_bound)
        sizes, free = exchanges.largest_sizes(), exchanges.free
    return _Motions(
        alone[0] + MEDIAN * alone[1],
        sizes[0] + MEDIAN * sizes[1],
        may_reach_bound,
        states.determined,
        free | states.free(kinks),
    )


def _changes(problem: Problem, z: Vector, violations: Vector, basic: Mask) -> Vector:
    """Return what is added to w: the violations, and samples of the rounding of the
    data; shape (n, 1 + SAMPLES)."""
    M = problem.M
    squares = M.power(2) @ z**2 if is_sparse(M) else np.einsum("ij,ij,j->i", M, M, z**2)
    random = np.empty((z.size, SAMPLES))
    random[np.concatenate((np.flatnonzero(basic), np.flatnonzero(~basic)))] = signs(
        z.size
    )
    deviations = ROUNDING_DEVIATION * np.sqrt(squares + problem.q**2)
    return np.column_stack((violations, deviations[:, np.newaxis] * random))


class _Exchanges:
    """The motions with parts F of the kinks P exchanged: the other number y_k of each
    pair moves then, by as much as keeps this one at its bound, or at 0.

    free : the z_i that differ among the solutions near z, as far as such exchanges show
        it, shape (n,).
    """

    def __init__(
        self,
        problem: Problem,
        z: Vector,
        states: _States,
        moves: Vector,
        kinks: Mask,
        at_bound: Mask,
    ) -> None:
        basic, box, P = states.basic, problem.box, np.flatnonzero(kinks)
        # The changes of q that stand for w_i = 1 for i in B, and for z_i = 1 elsewhere.
        identity = np.equal.outer(np.arange(z.size), P).astype(float)
        columns = np.where(basic[P], -identity, matrices.dense(problem.M[:, P]))
        effects = states.response(columns)
        # In units of w_i and z_i, as numbers of both kinds are compared.
        R, C = problem.units.diagonals()
        self._units = np.where(basic, C, 1 / R)[:, np.newaxis]
        of_y = np.where(basic, 1 / R, C)[P]
        effects *= of_y / self._units
        # What may be rounding of 0; of an ill-conditioned M_BB anything may be.
        rounding = z.size * ROW_ROUNDING if states.is_regular else 0.0
        self._noise = rounding * np.abs(effects).max(axis=0)
        self._effects = np.where(np.abs(effects) <= self._noise, 0.0, effects)
        # With equations that follow from others, y_P may contradict them.
        self._contradictions = states.contradictions(columns)
        self._moves = moves / self._units
        self._P, self._basic, self._at_bound = P, basic, at_bound
        # At which of its bounds each number is: neither may fall, or rise.
        self._signs = np.where(box.upper - z < z - box.lower, -1.0, 1.0)
        self.free = np.zeros(z.size, dtype=bool)

    def largest_sizes(self) -> Vector:
        """Return the largest sizes of the motions, with the basis as it is and with
        parts of the kinks exchanged."""
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
            # A part that contains another singular one shows nothing more.
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
        """Return the sizes of the motions with a part F for which T_FF is singular or
        y_F may contradict equations, infinite where the v with T_FF v = 0 that do not
        move a number, and whether there are any, and see whether they lead to other
        solutions; None if the rank is not clear."""
        F, effects = self._P[part], self._effects[:, part]
        noise = F.size * self._noise[part].max()
        others = self._contradictions[:, part]
        # Both on one scale; where nothing else moves, contradictions still count.
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
        """See whether y_F = v leads to other solutions, on one side of 0 or the other;
        this moves numbers that are not exchanged."""
        # Also of numbers that rounding does not move: those that are 0 in the data.
        at_bound = (motion * self._signs)[self._at_bound]
        others = np.where(np.abs(v) > F.size * ROW_ROUNDING, v, 0.0) * self._signs[F]
        for side in (1.0, -1.0):
            if (side * at_bound >= 0).all() and (side * others >= 0).all():
                self.free |= self._basic & (motion != 0)
                self.free[F[~self._basic[F] & (others != 0)]] = True


def _parts(count: int) -> Mask:
    """Return rows that select all parts of a few kinks; of many, all, each one, all
    others, and RANDOM_PARTS more."""
    if count <= MAX_COMBINED:
        return (np.arange(1, 2**count)[:, np.newaxis] >> np.arange(count)) % 2 > 0
    each = np.eye(count, dtype=bool)
    return np.vstack(
        (np.ones(count, dtype=bool), each, ~each, signs(count, RANDOM_PARTS).T > 0)
    )


def _sizes(moves: Vector) -> Vector:
    """Return the motion by the error of w and the standard deviation of that by
    rounding, shape (2, n)."""
    return np.stack((np.abs(moves[:, 0]), np.sqrt(np.mean(moves[:, 1:] ** 2, axis=1))))


def state_slacks(box: Box, z: Vector, w: Vector, basic: Mask) -> Vector:
    """Return how far each component is from violating the condition of its state;
    infinite if it is fixed."""
    return np.where(
        box.fixed,
        np.inf,
        -box.violations(z, w, of_masks(basic, ~basic & (z == box.upper))),
    )


@lru_cache(maxsize=8)
def signs(n: int, samples: int = SAMPLES) -> Vector:
    """Return columns of signs, shape (n, samples), that look random but are the same
    each time; not to be changed."""
    return np.sign(
        np.sin(np.outer((np.arange(n) + 1.0) ** 2, np.arange(samples) + 1.234))
    )
