"""Block pivoting on a dense LCP with few unknowns, with its answer judged on the spot.

For few unknowns a step of `newton` takes less time than what a run does around it. So `auto` first makes the same steps
in as few operations as possible, and continues only where these do not lead to a solution beyond doubt. The exchanges
are those of `verify.basic_solution`, and the judgement is the first bound of `Measure.surely_solves`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import ROW_ROUNDING, sizes
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.rounding import row_errors
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Mask, States, Vector
from lcpcli.verify.measure import FEW_UNKNOWNS

MOST_UNKNOWNS = 100
MOST_PIVOTED = 300  # unknowns up to which Lemke's path is followed before anything but newton is tried
MOST_COMPILED = 400  # the same for the compiled path of a mixed problem
NOTHING, CANDIDATE, CERTAIN = 0, 1, 2  # what kernels find: no answer, one to be judged, or a solution beyond doubt
MOST_WRONG = 0.25  # of all signs at a start: if more are wrong, it is not near a solution's basis
MOST_STEPS = 12  # before `newton`, with its safeguard, takes over
LONG_NUMBER = 2.0**50  # a number from which on units in the last place are no longer small fractions of one
HIDDEN_TERM = 1e-8  # relative to the largest term of a row: rounding of the others leaves half of its digits


class DirectAnswer(NamedTuple):
    """A basic solution without wrong signs, which may solve the problem.

    z : shape (n,). is_certain : whether z solves the problem, whatever the rounding errors in w are; if not, this
    remains to be seen. steps : how many basic solutions were computed. method : by which. evaluations : as a method
    counts them. end : the basis, where z does not show it.
    """

    z: Vector
    is_certain: bool
    steps: int
    method: str = "newton"
    evaluations: int | None = None
    end: States | None = None


def as_dense(problem: Problem) -> Problem:
    """Return the problem with M dense, without its origin if M was not."""
    return replace(problem, M=matrices.dense(problem.M), origin=None) if is_sparse(problem.M) else problem


def applies(problem: Problem) -> bool:
    """Return whether a problem is an LCP with few unknowns and moderate numbers."""
    return problem.n <= MOST_UNKNOWNS and problem.box.is_orthant and problem.is_moderate


@np.errstate(all="ignore")
def direct(
    problem: Problem, tol: float, basic: Mask | None = None, keep: Callable[[Vector, int], None] | None = None
) -> DirectAnswer | None:
    """Return the answer of block pivoting from a basis, or, if none is given or it is not near a solution's, from
    q < 0; None if it meets a singular M_PP, takes many steps, or may have to be replaced by an exact one, which `small`
    does for few unknowns.

    keep : called with the x = (z - w) / 2 of each basic solution, and its number.
    """
    M, q = problem.M, problem.q
    is_start, basic = basic is not None, q < 0 if basic is None else basic.copy()
    for steps in range(MOST_STEPS):
        P = basic.nonzero()[0]
        z = np.zeros(problem.n)
        if not P.size:
            negative = q < 0
            if not np.count_nonzero(negative):
                return DirectAnswer(z, True, steps)
            basic = negative
            if keep is not None:
                keep(q / -2, steps + 1)
            continue
        block = M[P[:, np.newaxis], P]
        try:
            z[P] = np.linalg.solve(block, -q[P])
        except np.linalg.LinAlgError:
            if not is_start:
                return None
            is_start, basic = False, q < 0
            continue
        w = M @ z
        w += q
        own = w[P]
        w[P] = 0.0
        if keep is not None:
            keep((z - w) / 2, steps + 1)
        wrong = np.minimum(z, w) < 0.0
        if is_start and np.count_nonzero(wrong) > MOST_WRONG * problem.n:
            is_start, basic = False, q < 0
            continue
        is_start = False
        if not np.count_nonzero(wrong):
            answer = _judged(problem, z, P, block, own, w, tol, steps + 1)
            return None if hides_terms(problem, answer.z) else answer
        basic ^= wrong
    return None


def _judged(
    problem: Problem, z: Vector, P: Indices, block: Vector, own: Vector, w: Vector, tol: float, steps: int
) -> DirectAnswer:
    """Return the answer z, refined once if its residual `own`, w_P, is more than rounding; w has zeros in its place."""
    M, q = problem.M, problem.q
    size, absolute = np.abs(q), np.abs(M)
    terms = absolute @ z
    terms += size
    if np.count_nonzero(np.abs(own) > ROW_ROUNDING * terms[P]):
        z[P] -= np.linalg.solve(block, own)
        np.maximum(z, 0.0, out=z)
        w = M @ z
        w += q
        own = w[P]
        terms = absolute @ z + size
    np.negative(w, out=w)
    w[P] = np.abs(own)
    w += row_errors(M, z, terms)
    return DirectAnswer(z, np.count_nonzero(w <= tol * size) == q.size, steps)


def hides_terms(problem: Problem, z: Vector) -> bool:
    """Return whether there are few unknowns and rounding may hide a term of a row at z, or integers may have been
    rounded, as far as one can tell without a look at M."""
    if problem.n > FEW_UNKNOWNS:
        return False
    (least_z, largest_z), (least_q, largest_q) = sizes(z), problem.sizes_of_q
    if max(problem.largest, largest_q) > LONG_NUMBER:
        return True
    largest_term = max(problem.largest * largest_z, largest_q)
    return min(problem.largest * least_z, least_q) < HIDDEN_TERM * largest_term
