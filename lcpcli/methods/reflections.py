"""Relaxed reflections: a search for solutions with any M, which proves nothing if there
is no result.

Complementary pairs (z, w) that satisfy w = M z + q are the common points of the affine
set A of all (z, w) with w = M z + q and of the set B of all (z, w) with l <= z <= u
where w has the signs required by complementarity. Neither convexity nor monotonicity is
needed to project onto B, as its points are computed component by component. The
iteration

    x' = x + beta (P_A(2 P_B x - x) - P_B x)

is the relaxed difference map: V. Elser, I. Rankenburg and P. Thibault, Searching with
iterated maps, Proceedings of the National Academy of Sciences 104 (2007) 418-423; V.
Elser, The complexity of bit retrieval, IEEE Transactions on Information Theory 64
(2018) 412-428, section III. It converges only close to a common point. Several walkers
from random starts share each product with the matrix of P_A, of order 2n, and single
precision is enough, as only the basis of a walker matters: where its step is small,
block pivoting from this basis gives the solution.
"""

from __future__ import annotations

import itertools
import math
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from lcpcli.linalg.doubles import each_step, generator, is_finite
from lcpcli.linalg.matrices import dense
from lcpcli.methods import stages
from lcpcli.methods.newton import FINISH, from_states
from lcpcli.methods.stages import (
    Breakdown,
    Finished,
    Iterate,
    MethodSequence,
    Stage,
    Stalled,
    advance,
)
from lcpcli.model.box import Box
from lcpcli.model.changes import in_units, scale
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector
from lcpcli.verify.point import Criterion, Point

Single: TypeAlias = NDArray[np.float32]

BALANCING_ROUNDS = 5  # by then norms are equal to a few percent
CHECK = 20  # steps between two checks of the walkers
# Sizes of M, relative to an average singular value of 1, one after another: the best
# one depends on M.
SCALES = 3.0, 2.0, 4.0
# Steps before all walkers start again: almost all of the remaining ones are trapped by
# then.
ROUND_STEPS, ROUND_STEPS_PER_UNKNOWN = 2000, 4


def reflections(
    problem: Problem, x0: Vector, *, beta: float = 0.7, walkers: int = 16, seed: int = 0
) -> Stage:
    """Search for a common point of A and B until the run stops it; x0 has no influence.

    The problem is scaled so that M is equilibrated and the violations at the reference
    point are of size 1.

    The walkers start again after some thousand steps, with another size of M relative
    to the identity.

    Yields, every CHECK steps, the point of B of the walker with the smallest step;
    evaluations are steps. Finished : at a solution by block pivoting from the basis of
    a walker, with step "finish". Breakdown : numbers overflow, or there are too many
    unknowns.
    """
    return (
        yield from stages.from_reference(
            problem, x0, partial(_search, beta=beta, walkers=walkers, seed=seed)
        )
    )


def _search(
    problem: Problem, sequence: MethodSequence, beta: float, walkers: int, seed: int
) -> Stage:
    change = scale(problem)
    R, C = _balance(change.problem.M)
    natural_residual = R * change.problem.box.gaps(
        np.zeros(problem.n), change.problem.q
    )
    size = float(np.linalg.norm(natural_residual)) / math.sqrt(
        np.count_nonzero(natural_residual) or 1
    )
    if not math.isfinite(size):
        return Breakdown("the violations overflow")
    units = in_units(
        problem, R * change.R / (size or 1.0), C * change.C * (size or 1.0)
    )
    walk = partial(_walk, beta=beta, walkers=walkers, seed=seed)
    return (yield from stages.changed(units, sequence.last.x, walk))


def _balance(M: Matrix) -> tuple[Vector, Vector]:
    """Return diagonals that give the rows and columns of M norms that are almost equal
    (Sinkhorn and Knopp 1967)."""
    squares = dense(M) ** 2
    R, C = np.ones((2, len(squares)))
    for _ in range(BALANCING_ROUNDS):
        rows = squares @ C**2
        R = np.where(rows > 0, rows, 1.0) ** -0.5
        columns = squares.T @ R**2
        C = np.where(columns > 0, columns, 1.0) ** -0.5
    return R, C


@each_step(over="ignore")
def _walk(
    problem: Problem,
    x0: Vector,  # noqa: ARG001 (the walkers start at random points)
    beta: float,
    walkers: int,
    seed: int,
) -> Stage:
    n = problem.n
    steps = 0
    random = generator(seed)
    M = dense(problem.M)
    criterion = Criterion(problem)
    visited_bases = set[bytes]()
    size = float(np.linalg.norm(M)) / math.sqrt(n)
    if not 0 < size < math.inf:
        return Breakdown("M is zero, or overflows")
    for relative in itertools.cycle(SCALES):
        factor = relative / size
        iteration = Iteration(factor * M, factor * problem.q, problem.box, walkers)
        X = random.standard_normal((2 * n, walkers)).astype(np.float32)
        for _ in range((ROUND_STEPS + ROUND_STEPS_PER_UNKNOWN * n) // CHECK):
            for _ in range(CHECK):
                change = iteration.step(X)
                change *= np.float32(beta)
                X += change
            steps += CHECK
            sizes = np.sqrt((change * change).mean(axis=0))
            for rank, j in enumerate(np.argsort(sizes)):
                z, w = np.split(iteration.nearest[:, j].astype(float), 2)
                x = problem.box.x_of(z, w / factor)
                if not is_finite(x):
                    return Breakdown("the iteration overflows")
                if rank == 0:
                    yield Iterate(x, None, "", steps, signs_final=False)
                basis = problem.box.basis_of(x).tobytes()
                if basis not in visited_bases:
                    visited_bases.add(basis)
                    pivoting = from_states(problem, problem.box.basis_of(x))
                    while isinstance(step := advance(pivoting), Iterate):
                        if (
                            step.signs_final
                            or Point(criterion, problem.box.z_of(step.x)).solves()
                        ):
                            yield step._replace(
                                step=FINISH, evaluations=steps, signs_final=True
                            )
                            return Finished()
                    break
    return Stalled()


class Iteration:
    """The map x -> P_A(2 P_B x - x) - P_B x in single precision, for A of w = G z + g
    and each column of X = [z; w]."""

    def __init__(self, G: Matrix, g: Vector, box: Box, walkers: int) -> None:
        n = g.size
        H = np.linalg.inv(np.eye(n) + G @ G.T)
        K = G.T @ H
        self._P = np.block([[np.eye(n) - K @ G, K], [K.T, np.eye(n) - H]]).astype(
            np.float32
        )
        self._c = np.concatenate((-K @ g, H @ g)).astype(np.float32)[:, np.newaxis]
        self._lower, self._upper = (
            bound.astype(np.float32)[:, np.newaxis] for bound in box.vectors(n)
        )
        self._has_upper = bool(np.isfinite(self._upper).any())
        self._fixed = self._lower == self._upper
        self.nearest, self._reflected, self._change = np.empty(
            (3, 2 * n, walkers), np.float32
        )

    def step(self, X: Single) -> Single:
        """Return P_A(2 P_B X - X) - P_B X, in an array that the next step overwrites,
        as it does P_B X in `nearest`: z within the bounds and w with the signs required
        by complementarity."""
        nearest = self.nearest
        reflected = self._reflected
        change = self._change
        n = self._lower.size
        Z = X[:n]
        W = X[n:]
        z = nearest[:n]
        w = nearest[n:]
        np.maximum(Z, self._lower, out=z)
        if self._has_upper:
            np.minimum(z, self._upper, out=z)
            # The squares of distances to each part of the set.
            squared_distance = (Z - z) ** 2 + W**2
            below = (Z - self._lower) ** 2 + np.minimum(W, 0) ** 2
            above = (Z - self._upper) ** 2 + np.maximum(W, 0) ** 2
            at_lower = below < np.minimum(squared_distance, above)
            at_upper = above < np.minimum(squared_distance, below)
            np.copyto(z, self._upper, where=at_upper)
            signed = np.where(
                at_lower, np.maximum(W, 0), np.where(at_upper, np.minimum(W, 0), 0)
            )
            w[:] = np.where(self._fixed, W, signed)
        else:
            at_lower = Z - self._lower < W
            np.maximum(W, 0, out=w)
            w *= at_lower
        np.copyto(z, self._lower, where=at_lower)
        np.subtract(nearest, X, out=reflected)
        reflected += nearest
        np.matmul(self._P, reflected, out=change)
        change += self._c
        change -= nearest
        return change
