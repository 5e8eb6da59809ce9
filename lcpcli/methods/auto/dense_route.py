"""The route for dense matrices: an active set that is nearly right from products with M, then block pivoting.

J. Barzilai and J. M. Borwein, Two-point step size gradient methods, IMA Journal of Numerical Analysis 8 (1988) 141-148,
projected as in E. G. Birgin, J. M. Martínez and M. Raydan, Nonmonotone spectral projected gradient methods on convex
sets, SIAM Journal on Optimization 10 (2000) 1196-1211, with alternating step sizes (Y.-H. Dai and R. Fletcher,
Projected Barzilai-Borwein methods for large-scale box-constrained quadratic programming, Numerische Mathematik 100
(2005) 21-47) and without a line search.
"""

from __future__ import annotations

import numpy as np

from lcpcli.linalg import factors
from lcpcli.linalg.products import product
from lcpcli.methods.auto.turns import Turns
from lcpcli.methods.iterate import Breakdown, Finished, Iterate, Stage, Stalled
from lcpcli.methods.newton import block_pivoting
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

LEAST_INDEX_STEPS = 60  # of newton: block steps advance, these may take 2^n
BLOCK = 4  # gradient steps between two looks at the active set
SETTLED, OF_MANY = 4, 500  # indices, or one of so many, that change in that many steps when pivoting takes over
GROWTH = 1e6  # of |D^-1 w|^2 over its start: the iteration diverges
MOST_STEPS = 40  # no more products than a few factorizations cost


def dense_route(problem: Problem, x0: Vector) -> Stage:
    """Newton from x0, or from w = q at the origin; for large n from the active set at which projected gradients arrive.

    A product with M costs a small part of a factorization, and a few dozen of them correct most of the signs that
    block pivoting would take several factorizations for, if M is a well-conditioned P-matrix.
    """
    start = x0 if np.count_nonzero(x0) else -problem.q / 2  # z = 0 with its own w
    if problem.n <= factors.SMALL:
        return (yield from block_pivoting(problem, start, LEAST_INDEX_STEPS))
    turns = Turns(x0)
    ending = yield from turns.take("gradient", projected_gradient(problem, x0))
    if not isinstance(ending, Breakdown):
        start = turns.last.x
    return (yield from turns.take("newton", block_pivoting(problem, start, LEAST_INDEX_STEPS)))


def projected_gradient(problem: Problem, x0: Vector) -> Stage:
    """z' = max(z - t D^-1 (M z + q), 0) with D = diag(M) and Barzilai and Borwein's step sizes t in turn.

    Parameters
    ----------
    problem : the LCP, n unknowns, M dense.
    x0 : starting point, shape (n,).

    Yields
    ------
    Iterate : every BLOCK steps, x = (z - D^-1 w) / 2, whose signs are those of the active set.

    Returns
    -------
    Finished : the active set has settled. Stalled : it has not in MOST_STEPS. Breakdown : a diagonal entry of M is not
        positive, or the iteration diverges.
    """
    M, q, diagonal = problem.M, problem.q, problem.M.diagonal()
    if not diagonal.min() > 0:
        return Breakdown("a diagonal entry of M is not positive")
    inverse = 1 / diagonal
    z = 2 * np.maximum(x0, 0)
    gradient = (product(M, z) + q) * inverse if np.count_nonzero(z) else q * inverse
    first = gradient.dot(gradient)
    active, t = z > gradient, 0.5
    for step in range(1, MOST_STEPS + 1):
        previous, former = z, gradient
        z = np.maximum(z - t * gradient, 0.0)
        gradient = product(M, z)
        gradient += q
        gradient *= inverse
        change, difference = z - previous, gradient - former
        weighted = diagonal * difference
        along = change.dot(weighted)
        if along > 0:
            t = change.dot(diagonal * change) / along if step % 2 else along / difference.dot(weighted)
        if step % BLOCK:
            continue
        before, active = active, z > gradient
        yield Iterate(0.5 * np.where(active, z, -gradient), None, "", step + 1, signs_final=False)
        if not gradient.dot(gradient) <= GROWTH * first:
            return Breakdown("the projected gradient iteration diverges")
        if np.count_nonzero(before != active) <= max(SETTLED, z.size // OF_MANY):
            return Finished()
    return Stalled(f"the active set has not settled in {MOST_STEPS} steps")
