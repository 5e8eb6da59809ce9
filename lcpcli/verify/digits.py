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

At a kink, where z_i at a bound has a w_i, or z_i in B a distance from its bound, that
is not safely larger than its own motion, rounding may exchange the two. With r the
motions of these numbers, and T their derivatives by the other numbers of the pairs (a
principal transform of M), those of an exchanged set F move by y_F = -T_FF^-1 r_F, and
all others with them. How far they do is estimated for many F, and a number may become a
kink by it in turn.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache

import numpy as np

from lcpcli.interrupts import TimeIsUp
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS, LARGEST_DOUBLE, SMALL_DISTANCE
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.box import Box, of_masks
from lcpcli.model.changes import scale
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Mask, Matrix, Vector

DOUBLE_DIGITS = 16  # decimal digits of a double
# Random right-hand sides: they give the standard deviation to within a factor of two or
# so.
SAMPLES = 8
# Variables up to which a factorization takes a few hundredths of a second.
MOST_BASIC, MOST_BASIC_SPARSE = 1000, 20_000
# Standard deviation of a relative change by rounding, for mantissas as frequent as 1/m.
ROUNDING_DEVIATION = 0.21 * EPS
MEDIAN = 0.674  # of a normally distributed size, relative to its standard deviation
# Standard deviations that rounding does not move a number: the largest motion of few
# terms is three.
SAFE = 100.0
# Relative to the changes of a row: the motions have about the right size.
LARGEST_RESIDUAL = 0.1
# That are exchanged: their linear systems take about a tenth of a second.
MOST_KINKS = 100
MOST_COMBINED = 8  # kinks up to which each set of them is exchanged
RANDOM_PARTS = 250  # of more kinks, which are exchanged besides single ones


@np.errstate(all="ignore")
def digits(problem: Problem, z: Vector, w: Vector) -> Vector | None:
    """Return how many digits of each z_i of a solution the data determine, from 0 to
    DOUBLE_DIGITS, shape (n,); all digits of a z_i at a bound, but NaN if rounding may
    move it off, or if no digit is left where others do so. None if M_BB is too large,
    or singular, so that z is one of several solutions."""
    basic = (z != problem.lower) & (z != problem.upper)
    if np.count_nonzero(basic) > (
        MOST_BASIC_SPARSE if is_sparse(problem.M) else MOST_BASIC
    ):
        return None
    motions = _motions(problem, z, w, basic) if problem.is_moderate else None
    if motions is None or not np.isfinite(motions[0]).all():
        units = scale(problem)
        problem, z, w = units.problem, units.z_inside(z), units.w_inside(w)
        motions = _motions(problem, z, w, basic) if problem.is_moderate else None
    if motions is None:
        return None
    found = (
        np.nan_to_num(-np.log10(errors / np.abs(z)), nan=0.0) for errors in motions[:2]
    )
    alone, exchanged = (np.clip(np.rint(each), 0, DOUBLE_DIGITS) for each in found)
    undetermined = np.where(basic, (exchanged == 0) & (alone > 0), motions[2])
    return np.where(undetermined, np.nan, np.where(basic, exchanged, DOUBLE_DIGITS))


def whole_digits(problem: Problem, z: Vector, w: Vector) -> list[int | None] | None:
    """Return `digits` as whole numbers, with None for NaN; None in all if the time is
    up before."""
    with suppress(TimeIsUp):
        found = digits(problem, z, w)
        return (
            None
            if found is None
            else [None if math.isnan(count) else int(count) for count in found.tolist()]
        )
    return None


def fewest(problem: Problem, z: Vector, determined: Vector) -> tuple[int, int]:
    """Return the least number of digits of components that have one and are not 0 up to
    rounding, and its index."""
    sizes = np.log2(np.abs(z), where=z != 0, out=np.full(z.size, -np.inf))
    negligible = np.ones(z.size, dtype=bool)
    for own in (sizes, sizes - problem.units.columns):
        negligible &= own <= own.max() + np.log2(SMALL_DISTANCE)
    relevant = np.where(negligible | np.isnan(determined), DOUBLE_DIGITS, determined)
    i = int(np.argmin(relevant))
    return int(relevant[i]), i


@np.errstate(all="ignore")
def _motions(
    problem: Problem, z: Vector, w: Vector, basic: Mask
) -> tuple[Vector, Vector, Mask] | None:
    """Return the expected errors of z_i in B and of w_i elsewhere, those with the bases
    exchanged at kinks, and where these numbers are so near to their bounds, or to 0,
    that rounding may take them there, each of shape (n,); None if M_BB is singular.
    With too many kinks, the latter are infinite and everywhere, and if M_BB is so
    ill-conditioned that its systems are not solved, all of them are."""
    response, distances = _response(problem.M, basic), room(problem.box, z, w, basic)
    changes = _changes(problem, z, np.where(basic | (distances < 0), w, 0.0), basic)
    try:
        moves = response(changes)
    except (SingularMatrix, ValueError):
        return None
    alone = sizes = _sizes(moves)
    if not np.isfinite(alone[:, basic]).all():
        return None
    left = np.abs(
        matrices.product(problem.M, np.where(basic[:, np.newaxis], moves, 0.0))
        + changes
    )[basic]
    if not (
        left <= LARGEST_RESIDUAL * np.abs(changes[basic]).max(axis=1, keepdims=True)
    ).all():
        infinite = np.full(z.size, np.inf)
        return infinite, infinite, np.ones(z.size, dtype=bool)
    kinks = np.zeros(z.size, dtype=bool)
    while True:
        near = distances <= np.nan_to_num(
            sizes[0] + SAFE * sizes[1], nan=LARGEST_DOUBLE, posinf=LARGEST_DOUBLE
        )
        # What is 0, and remains so, exchanges nothing.
        new = near & ~kinks & sizes.any(axis=0)
        if not new.any():
            return alone[0] + MEDIAN * alone[1], sizes[0] + MEDIAN * sizes[1], near
        kinks |= new
        P = np.flatnonzero(kinks)
        if P.size > MOST_KINKS:
            return (
                alone[0] + MEDIAN * alone[1],
                np.full(z.size, np.inf),
                np.ones(z.size, dtype=bool),
            )
        # the changes of q that stand for w_i = 1 for i in B, and for z_i = 1 elsewhere
        identity = np.equal.outer(np.arange(z.size), P).astype(float)
        columns = np.where(basic[P], -identity, matrices.dense(problem.M[:, P]))
        sizes = _largest_sizes(moves, response(columns), P)


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


def _response(M: Matrix, basic: Mask) -> Callable[[Vector], Vector]:
    """Return a function, which may raise SingularMatrix, from changes of q, shape (n,
    k), to those of z_B, w_N."""
    B = np.flatnonzero(basic)
    solver = PrincipalSolver(M)

    def response(changes: Vector) -> Vector:
        moves = np.zeros_like(changes)
        if B.size:
            moves[B] = -solver.at(B)(changes[B])
        return np.where(
            basic[:, np.newaxis], moves, changes + matrices.product(M, moves)
        )

    return response


def _largest_sizes(moves: Vector, columns: Vector, P: Indices) -> Vector:
    """Return the largest sizes of the motions, with the basis as it is and with parts F
    of the kinks P exchanged: the other number y_i of each pair moves then, by the y_F
    with which this number remains at its bound, or at 0."""
    largest = _sizes(moves)
    for part in _parts(P.size):
        F, effects = P[part], columns[:, part]
        try:
            sizes = _sizes(moves - effects @ np.linalg.solve(effects[F], moves[F]))
        except SingularMatrix:
            sizes = np.where(effects.any(axis=1), np.inf, 0.0)
        largest = np.maximum(largest, np.nan_to_num(sizes, nan=np.inf))
    return largest


def _parts(count: int) -> Mask:
    """Return rows that select all parts of a few kinks; of many, all, each one, all
    others, and RANDOM_PARTS more."""
    if count <= MOST_COMBINED:
        return (np.arange(1, 2**count)[:, np.newaxis] >> np.arange(count)) % 2 > 0
    each = np.eye(count, dtype=bool)
    return np.vstack(
        (np.ones(count, dtype=bool), each, ~each, signs(count, RANDOM_PARTS).T > 0)
    )


def _sizes(moves: Vector) -> Vector:
    """Return the motion by the error of w and the standard deviation of that by
    rounding, shape (2, n)."""
    return np.stack((np.abs(moves[:, 0]), np.sqrt(np.mean(moves[:, 1:] ** 2, axis=1))))


def room(box: Box, z: Vector, w: Vector, basic: Mask) -> Vector:
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
