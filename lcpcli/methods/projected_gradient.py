"""Projected gradients, for active sets that are nearly right from products with M alone.

J. Barzilai and J. M. Borwein, Two-point step size gradient methods, IMA Journal of Numerical Analysis 8 (1988) 141-148,
projected as in E. G. Birgin, J. M. Martínez and M. Raydan, Nonmonotone spectral projected gradient methods on convex
sets, SIAM Journal on Optimization 10 (2000) 1196-1211, with alternating step sizes (Y.-H. Dai and R. Fletcher,
Projected Barzilai-Borwein methods for large-scale box-constrained quadratic programming, Numerische Mathematik 100
(2005) 21-47) and without a line search.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from lcpcli.linalg.doubles import largest
from lcpcli.linalg.matrices import is_sparse, product
from lcpcli.methods.stages import Breakdown, Finished, Iterate, Stage, Stalled
from lcpcli.model.box import Box
from lcpcli.model.problem import Problem
from lcpcli.typing import States, Vector

GRADIENT_BLOCK = 4  # steps between two looks at the active set
SETTLED_INDICES, SETTLED_ONE_IN = 8, 500  # most changes of state in two looks: so many, or one in so many unknowns
LOOKS_TO_ADVANCE = 3  # looks in which the changes have to decrease, for the iteration to go on
GRADIENT_GROWTH = 1e6  # of |w|^2 over its start, in units with a unit diagonal: the iteration diverges
MOST_GRADIENT_STEPS = 40  # at least; for large n no more products than a factorization costs:
MOST_PER_UNKNOWN = 1 / 12
SINGLE_RANGE = 1e9  # sizes up to which, and down to whose inverse, single precision has room for products


def projected_gradient(problem: Problem, x0: Vector) -> Stage:
    """Iterate z' = mid(l, u, z - t D^-1 (M z + q)), D = diag(M), with Barzilai and Borwein's two step sizes t in turn.

    For dense M in single precision, unless numbers are too large or small for it: that is enough for likely states, and
    a product takes half the time, or less where M in doubles does not fit in the cache.

    Yields the last x = (z - D^-1 w) / 2, which stands for the likely states: what the loop does with an iterate may
    take as long as a step. Finished : the states have settled. Stalled : they have not settled within
    MOST_GRADIENT_STEPS, or do not settle any further.
    """
    box, diagonal = problem.box, problem.M.diagonal()
    if not diagonal.min() > 0:
        return Breakdown("a diagonal entry of M is not positive")
    units, start = 1 / np.sqrt(diagonal), box.z_of(x0)
    w_start = problem.w(start) if np.count_nonzero(problem.from_reference(start)) else problem.q_ref
    few, history = max(SETTLED_INDICES, x0.size // SETTLED_ONE_IN), [x0.size] * LOOKS_TO_ADVANCE
    box, z, w, w_of = box.in_units(units), start / units, units * w_start, lambda z: units * problem.w(units * z)
    sizes = (problem.largest, largest(z), largest(w), units.max(), 1 / units.min())
    if not is_sparse(problem.M) and max(sizes) <= SINGLE_RANGE and largest(w) >= 1 / SINGLE_RANGE:
        M, scale, q, z, w = (given.astype(np.float32) for given in (problem.M, units, units * problem.q, z, w))
        box = box.in_single_precision()

        def w_of(z: Vector) -> Vector:
            w = product(M, scale * z)
            w *= scale
            w += q
            return w

    for last in gradient_steps(box, w_of, z, w):
        history.append(last.changes)
        settled = max(history[-2:]) <= few
        if settled or not last.bounded or history[-1] >= max(few, *history[-1 - LOOKS_TO_ADVANCE : -1]):
            break
    if not last.bounded:
        return Breakdown("the projected gradient iteration diverges")
    products = 1 + GRADIENT_BLOCK * (len(history) - LOOKS_TO_ADVANCE)
    yield Iterate(0.5 * units * (last.z - last.w), None, "", products, "", False)
    return Finished() if settled else Stalled("the active set does not settle")


class Glance(NamedTuple):
    """The state of `gradient_steps` at a check: z and its w, of shape (n,) or (m, n), the states that they stand for,
    how many of these have changed since the last check, and whether the iteration is bounded."""

    z: Vector
    w: Vector
    basis: States
    changes: int
    bounded: Any


def gradient_steps(box: Box, w_of: Callable[[Vector], Vector], z: Vector, w: Vector) -> Iterator[Glance]:
    """Iterate in units with a unit diagonal, for one problem or many, and yield every GRADIENT_BLOCK steps.

    w_of : M z + q, as a new array. z, w : the start, shape (n,), or (m, n) for m problems.
    """
    basis, start, t = box.basis_of(0.5 * (z - w)), _dots(w, w), z.dtype.type(0.5)
    for step in range(1, max(MOST_GRADIENT_STEPS, round(MOST_PER_UNKNOWN * z.shape[-1])) + 1):
        change = t * w
        former, z = z, box.project(np.subtract(z, change, out=change))
        before, w = w, w_of(z)
        moved, bent = z - former, w - before
        along = _dots(moved, bent)
        with np.errstate(divide="ignore", invalid="ignore"):
            lengths = _dots(moved, moved) / along if step % 2 else along / _dots(bent, bent)
        t = np.where(along > 0, lengths, t)  # else M shows no positive curvature
        if step % GRADIENT_BLOCK == 0:
            last, basis = basis, box.basis_of(0.5 * (z - w))
            bounded = (_dots(w, w) <= GRADIENT_GROWTH * start)[..., 0]
            yield Glance(z, w, basis, int(np.count_nonzero(basis != last)), bounded)


def _dots(A: Vector, B: Vector) -> Vector:
    """Return the inner products of vectors, or of the rows of matrices, shape (1,) or (m, 1)."""
    return np.asarray(np.einsum("...i,...i->...", A, B))[..., np.newaxis]
