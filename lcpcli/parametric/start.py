"""The basis from which a path starts: a solution of the first problem whose basic variables it determines."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from lcpcli.interrupts import check
from lcpcli.linalg.doubles import generator
from lcpcli.linalg.factors import MOST_NUMPY_ROWS, SingularMatrix, factorizer, well_conditioned_inverse
from lcpcli.linalg.matrices import dense, is_sparse, product
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.model.changes import scale
from lcpcli.model.problem import Problem
from lcpcli.typing import Mask, Matrix, States, Vector

SINGULAR = 2.0**-40  # relative to the largest one: a singular value of a basis that counts as 0
RECOVERED = 2.0**-16  # error of a solution whose system is not singular: a third of the digits of a double are right
NOISE = 2.0**-40  # relative to the largest change: a change that counts as none


def basic_states(problem: Problem, z: Vector, w: Vector, is_fixed: Mask) -> States | None:
    """Return the states of a solution whose basic variables are determined, shape (n,); None if there is none, as the
    solutions near z contain a line.

    is_fixed : where both bounds are equal on the whole path.

    A solution z with singular M_BB is moved along a null vector of M_BB, which keeps w_B = 0, until another component
    reaches its end, as a point is moved to a vertex of its polyhedron.
    """
    states = problem.box.basis_at(z, w)
    states[problem.box.fixed] = np.where(w[problem.box.fixed] < 0, UPPER, LOWER)
    states[is_fixed] = LOWER
    units = scale(problem)
    low, high = units.problem.box.vectors(problem.n)
    z, w = units.z_inside(z), units.w_inside(w)
    for _ in range(4 * problem.n + 1):
        check()
        null = _null_vector(units.problem.M, states)
        if null is None:
            return states
        basic = states == BASIC
        change = product(units.problem.M, null)
        gaps = np.where(basic, null, np.where(states == UPPER, -change, change))
        gaps[is_fixed] = 0.0
        gaps[np.abs(gaps) <= NOISE * np.abs(gaps).max()] = 0.0
        below = np.where(basic, z - low, np.maximum(np.where(states == UPPER, -w, w), 0.0))
        above = np.where(basic, high - z, np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            steps = np.array([np.where(s * gaps < 0, below, np.where(s * gaps > 0, above, np.inf)) for s in (1, -1)])
            steps /= np.abs(gaps)
        steps[:, gaps == 0] = np.inf
        side, k = np.unravel_index(np.argmin(steps), steps.shape)
        if steps[side, k] == np.inf:
            return None
        step = (1 - 2 * int(side)) * steps[side, k]
        z, w = z + step * null, w + step * change
        if not basic[k]:
            states[k] = BASIC
        else:
            states[k] = LOWER if step * gaps[k] < 0 else UPPER
    return None


def _null_vector(M: Matrix, states: States) -> Vector | None:
    """Return a vector v of shape (n,), zero outside B, with M_BB v_B = 0 for an equilibrated M; None if M_BB is not
    singular."""
    basic = np.flatnonzero(states == BASIC)
    if not basic.size:
        return None
    block = M[basic][:, basic]
    if is_sparse(block) or basic.size > MOST_NUMPY_ROWS:
        if _is_regular(block):
            return None
        block = dense(block)
    elif well_conditioned_inverse(block, 1 / SINGULAR) is not None:
        return None
    _, values, rows = np.linalg.svd(block)
    if values[-1] > SINGULAR * values[0]:
        return None
    v = np.zeros(states.size)
    v[basic] = rows[-1]
    return v


def _is_regular(block: Matrix) -> bool:
    """Return whether a solve recovers a third of the digits of a known solution."""
    known = generator(0).uniform(1, 2, block.shape[0])
    with suppress(SingularMatrix):
        return bool(np.abs(factorizer(block)(0.0)(product(block, known)) - known).max() <= RECOVERED)
    return False
