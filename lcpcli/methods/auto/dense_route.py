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
    """Newton from x0, or from the reference point, the origin of an LCP, with its own w; for large n from the active
    set at which projected gradients arrive.

    A product with M costs a small part of a factorization, and a few dozen of them correct most of the signs that
    block pivoting would take several factorizations for, if M is a well-conditioned P-matrix.
    """
    start = x0 if np.count_nonzero(x0) else _reference(problem)
    if problem.n > factors.SMALL:
        return _after_gradients(problem, x0, start)
    return block_pivoting(problem, start, LEAST_INDEX_STEPS)


def _after_gradients(problem: Problem, x0: Vector, start: Vector) -> Stage:
    turns = Turns(x0)
    ending = yield from turns.take("gradient", projected_gradient(problem, x0))
    if not isinstance(ending, Breakdown):
        start = turns.last.x
    return (yield from turns.take("newton", block_pivoting(problem, start, LEAST_INDEX_STEPS)))


def projected_gradient(problem: Problem, x0: Vector) -> Stage:
    """z' = mid(l, u, z - t D^-1 (M z + q)) with D = diag(M) and Barzilai and Borwein's step sizes t in turn.

    Parameters
    ----------
    problem : the LCP, n unknowns, M dense.
    x0 : starting point, shape (n,).

    Yields
    ------
    Iterate : every BLOCK steps, x = (z - D^-1 w) / 2, which stands for the states that are likely.

    Returns
    -------
    Finished : the active set has settled. Stalled : it has not in MOST_STEPS. Breakdown : a diagonal entry of M is not
        positive, or the iteration diverges.
    """
    box, diagonal = problem.box, problem.M.diagonal()
    if not diagonal.min() > 0:
        return Breakdown("a diagonal entry of M is not positive")
    inverse = 1 / diagonal
    z = box.z_of(x0)
    gradient = (problem.w(z) if np.count_nonzero(problem.from_reference(z)) else problem.q_ref) * inverse
    first = gradient.dot(gradient)
    basis, t = box.basis_of(0.5 * (z - gradient)), 0.5
    for step in range(1, MOST_STEPS + 1):
        previous, former = z, gradient
        z = box.project(z - t * gradient)
        gradient = problem.w(z)
        gradient *= inverse
        change, difference = z - previous, gradient - former
        weighted = diagonal * difference
        along = change.dot(weighted)
        if along > 0:
            t = change.dot(diagonal * change) / along if step % 2 else along / difference.dot(weighted)
        if step % BLOCK:
            continue
        before, basis = basis, box.basis_of(0.5 * (z - gradient))
        yield Iterate(0.5 * np.where(basis.basic, z, box.nonbasic(basis) - gradient), None, "", step + 1, "", False)
        if not gradient.dot(gradient) <= GROWTH * first:
            return Breakdown("the projected gradient iteration diverges")
        if basis.changes(before) <= max(SETTLED, z.size // OF_MANY):
            return Finished()
    return Stalled(f"the active set has not settled in {MOST_STEPS} steps")


def _reference(problem: Problem) -> Vector:
    """The x = (z - w) / 2 of the reference point."""
    return -problem.q / 2 if problem.reference_z is None else (problem.reference_z - problem.q_ref) / 2
