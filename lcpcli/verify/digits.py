"""How many digits of a solution are determined by its data: how far it moves if each of their numbers is rounded.

With B the basic variables, changes dM and dq move the solution by -M_BB^-1 (dM z + dq)_B, to first order (N. J. Higham,
Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM 2002, section 7.2). For changes like those by rounding,
independent and up to half a unit in the last place of each number, the standard deviation of this motion is estimated
by a few systems with random right-hand sides, which unlike a condition number does not depend on units; the part due to
w_B, if equations are not solved exactly, is added. Changes |dM| <= eps |M|, |dq| <= eps |q| move z_B by at most eps
|M_BB^-1| (|M| |z| + |q|)_B: no method that works on rounded data can be expected to do better.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS, ROW_ROUNDING
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix, well_conditioned_inverse
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.changes import scale
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Matrix, Vector

DOUBLE_DIGITS = 16  # decimal digits of a double
SAMPLES = 8  # random right-hand sides: they give the standard deviation to within a factor of two or so
MOST_BASIC, MOST_BASIC_SPARSE = 1000, 20_000  # variables up to which a factorization takes a few hundredths of a second
ROUNDING_DEVIATION = 0.21 * EPS  # standard deviation of a relative change by rounding, for mantissas as frequent as 1/m
MEDIAN = 0.674  # of a normally distributed size, relative to its standard deviation
NEGLIGIBLE_COMPONENT = 1e-13  # relative to the largest, as it is and in the units of M: z_i is 0 but for rounding
MOST_INVERTED = 400  # the size of M_PP up to which the inverse is formed, in a few hundredths of a second
MOST_INVERTED_EXACTLY = 64  # the size of M_PP up to which it is inverted in rational arithmetic, in about a second
LARGEST_CONDITION = 1e-3 / EPS  # the condition number up to which an inverse in doubles has three correct digits


def digits(problem: Problem, z: Vector, w: Vector) -> Vector | None:
    """Return how many digits of each z_i of a solution the data determine, from 0 to DOUBLE_DIGITS, shape (n,); all
    digits of a z_i at a bound. None if M_BB is too large, or singular, so that z is one of several solutions."""
    basic = np.flatnonzero((z != problem.lower) & (z != problem.upper))
    determined = np.full(z.size, float(DOUBLE_DIGITS))
    if not basic.size:
        return determined
    if basic.size > (MOST_BASIC_SPARSE if is_sparse(problem.M) else MOST_BASIC):
        return None
    errors = _errors(problem, z, w, basic)
    if errors is None:
        return None
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        found = np.rint(-np.log10(errors / np.abs(z[basic])))
    determined[basic] = np.clip(np.nan_to_num(found, nan=0.0, posinf=DOUBLE_DIGITS, neginf=0.0), 0, DOUBLE_DIGITS)
    return determined


def fewest(problem: Problem, z: Vector, determined: Vector) -> tuple[int, int]:
    """Return the least number of digits among the components that are not 0 up to rounding, and the index of that
    component."""
    sizes = np.log2(np.abs(z), where=z != 0, out=np.full(z.size, -np.inf))
    negligible = np.ones(z.size, dtype=bool)
    for own in (sizes, sizes - problem.units.columns):
        negligible &= own <= own.max() + np.log2(NEGLIGIBLE_COMPONENT)
    relevant = np.where(negligible, DOUBLE_DIGITS, determined)
    i = int(np.argmin(relevant))
    return int(relevant[i]), i


@np.errstate(over="ignore", invalid="ignore")
def _errors(problem: Problem, z: Vector, w: Vector, basic: Indices) -> Vector | None:
    """Return the expected errors of the basic variables, shape (k,); None if M_BB is singular."""
    if not problem.is_moderate:
        units = scale(problem)
        errors = _errors(units.problem, z / units.C, units.R * w, basic) if units.problem.is_moderate else None
        return None if errors is None else errors * units.C[basic]
    M, q = problem.M[basic], problem.q[basic]
    changes = ROUNDING_DEVIATION * np.sqrt((M.power(2) if is_sparse(M) else M**2) @ z**2 + q**2)
    try:
        solve = PrincipalSolver(problem.M).at(basic)
        moves = solve(np.column_stack((w[basic], changes[:, np.newaxis] * signs(basic.size))))
    except (SingularMatrix, ValueError):
        return None
    errors = np.abs(moves[:, 0]) + MEDIAN * np.sqrt(np.mean(moves[:, 1:] ** 2, axis=1))
    return errors if np.isfinite(errors).all() else None


@lru_cache(maxsize=8)
def signs(n: int, samples: int = SAMPLES) -> Vector:
    """Return columns of signs, shape (n, samples), that look random but are the same each time; not to be changed."""
    return np.sign(np.sin(np.outer((np.arange(n) + 1.0) ** 2, np.arange(samples) + 1.234)))


@np.errstate(over="ignore", invalid="ignore", divide="ignore")
def sensitivity(problem: Problem, z: Vector) -> float | None:
    """Return the largest component of |M_PP^-1| (|M| |z| + |q|)_P at the solution z, shape (n,), in units of z, for
    P with l_i < z_i < u_i or w_i = 0; None if M_PP is singular or too large, or too ill-conditioned where it is not
    small."""
    w = problem.w(z)
    terms = matrices.absolute_product(problem.M, np.abs(z)) + np.abs(problem.q)
    box = problem.box
    between, vanishing = (z > box.lower) & (z < box.upper), ~box.fixed & (np.abs(w) <= ROW_ROUNDING * terms)
    for active in (between | vanishing, between):
        P = np.flatnonzero(active)
        if not P.size:
            return 0.0
        inverse = _inverse(problem, P)
        if inverse is not None:
            largest = float((inverse @ terms[P]).max())
            return largest if np.isfinite(largest) else None
    return None


def _inverse(problem: Problem, P: Indices) -> Matrix | None:
    """Return |M_PP^-1|, shape (k, k); None if M_PP is singular, too large or too ill-conditioned."""
    if P.size > MOST_INVERTED:
        return None
    units = scale(problem)
    A = matrices.dense(units.problem.M[P][:, P])
    if P.size <= MOST_INVERTED_EXACTLY:
        from fractions import Fraction

        from lcpcli.rational import elimination
        from lcpcli.rational.numbers import in_integers, rounded

        whole, power = in_integers(A.ravel())
        found = elimination.inverse(np.array(whole, dtype=object).reshape(A.shape).tolist())
        unit = Fraction(2) ** -power
        inverse = None if found is None else np.array([rounded(unit * value for value in row) for row in found])
    else:
        inverse = well_conditioned_inverse(A, LARGEST_CONDITION)
    return None if inverse is None else np.abs(units.C[P, np.newaxis] * inverse * units.R[P])
