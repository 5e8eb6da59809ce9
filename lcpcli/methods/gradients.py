"""Projected gradients: active sets that are nearly right, from products with M alone, for block pivoting to start from.

J. Barzilai and J. M. Borwein, Two-point step size gradient methods, IMA Journal of Numerical Analysis 8 (1988) 141-148,
projected as in E. G. Birgin, J. M. Martínez and M. Raydan, Nonmonotone spectral projected gradient methods on convex
sets, SIAM Journal on Optimization 10 (2000) 1196-1211, with alternating step sizes (Y.-H. Dai and R. Fletcher,
Projected Barzilai-Borwein methods for large-scale box-constrained quadratic programming, Numerische Mathematik 100
(2005) 21-47) and without a line search.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from lcpcli.methods.stages import Breakdown, Finished, Iterate, Stage, Stalled
from lcpcli.model.box import Basis, Box
from lcpcli.model.problem import Problem
from lcpcli.typing import Mask, Vector

BLOCK = 4  # steps between two looks at the active set
SETTLED, OF_MANY = 4, 500  # indices, or one of so many, that change in that many steps when pivoting takes over
GROWTH = 1e6  # of |w|^2 over its start, in units with a unit diagonal: the iteration diverges
MOST_STEPS = 40  # no more products than a few factorizations cost


def projected_gradient(problem: Problem, x0: Vector) -> Stage:
    """z' = mid(l, u, z - t D^-1 (M z + q)) with D = diag(M) and Barzilai and Borwein's step sizes t in turn, M dense.

    Yields x = (z - D^-1 w) / 2 every BLOCK steps, which stands for the states that are likely. Finished : these have
    settled. Stalled : not in MOST_STEPS. Breakdown : a diagonal entry of M is not positive, or the iteration diverges.
    """
    box, diagonal = problem.box, problem.M.diagonal()
    if not diagonal.min() > 0:
        return Breakdown("a diagonal entry of M is not positive")
    units, z = 1 / np.sqrt(diagonal), problem.box.z_of(x0)
    w = problem.w(z) if np.count_nonzero(problem.from_reference(z)) else problem.q_ref
    looks = gradient_steps(box.in_units(units), lambda z: units * problem.w(units * z), z / units, units * w)
    for k, (z, w, basis, changes, bounded) in enumerate(looks, 1):
        x = np.where(basis.basic, units * z, box.nonbasic(basis) - units * w)
        yield Iterate(0.5 * x, None, "", BLOCK * k + 1, "", False)
        if not bounded:
            return Breakdown("the projected gradient iteration diverges")
        if changes <= max(SETTLED, z.size // OF_MANY):
            return Finished()
    return Stalled(f"the active set has not settled in {MOST_STEPS} steps")


def gradient_steps(
    box: Box, w_of: Callable[[Vector], Vector], z: Vector, w: Vector
) -> Iterator[tuple[Vector, Vector, Basis, int, Mask]]:
    """The iteration in units with a unit diagonal, for one problem or many: at every look z, its w, the states that
    they stand for, how many of these have changed since the last look, and whether it does not diverge.

    w_of : M z + q, as a new array. z, w : the start, shape (n,), or (m, n) for m problems.
    """
    basis, start, t = box.basis_of(0.5 * (z - w)), _dots(w, w), np.float64(0.5)
    for step in range(1, MOST_STEPS + 1):
        change = t * w
        former, z = z, box.project(np.subtract(z, change, out=change))
        before, w = w, w_of(z)
        difference, change = w - before, z - former
        along = _dots(change, difference)
        with np.errstate(divide="ignore", invalid="ignore"):
            lengths = _dots(change, change) / along if step % 2 else along / _dots(difference, difference)
        t = np.where(along > 0, lengths, t)
        if step % BLOCK == 0:
            last, basis = basis, box.basis_of(0.5 * (z - w))
            yield z, w, basis, basis.changes(last), (_dots(w, w) <= GROWTH * start)[..., 0]


def _dots(A: Vector, B: Vector) -> Vector:
    """The inner products of vectors, or of the rows of matrices, shape (1,) or (m, 1)."""
    return np.asarray(np.einsum("...i,...i->...", A, B)[..., np.newaxis])
