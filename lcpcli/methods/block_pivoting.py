"""Block principal pivoting for many right-hand sides at once: problems with one active
set share its factorization.

M. H. Van Benthem and M. R. Keenan, Fast algorithm for the solution of large-scale
non-negativity-constrained least squares problems, Journal of Chemometrics 18 (2004)
441-450, with the safeguard of `newton`, as in J. Kim and H. Park, Fast nonnegative
matrix factorization: an active-set-like method and comparisons, SIAM Journal on
Scientific Computing 33 (2011) 3261-3281. Products with M are computed for all columns
together. So that few systems are solved, it starts from almost right active sets: for
right-hand sides that follow each other closely, as in time, from the active set of a
neighbour's solution; for the others from the active set at which projected gradients
arrive, with one product with M per step for all problems.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lcpcli.basis.exchanges import (
    BasicSolution,
    block_principal_pivoting,
    in_units_of_state,
)
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.linalg.factors import solve_principal
from lcpcli.methods.direct import Safeguard
from lcpcli.methods.newton import MAX_LEAST_INDEX_STEPS, gradient_steps
from lcpcli.model.box import BASIC, LOWER, Box
from lcpcli.model.right_hand_sides import Block
from lcpcli.typing import BasisStatus, Indices, Mask, Vector

# Number of successive problems of which the first one is solved first; the others start
# from its solution.
STRIDE = 16
# Distance of a q from another one, relative to |q|, below which the two are neighbours.
NEIGHBOUR_DISTANCE = 0.25
# Largest ratio of the numbers of status changes at two successive checks with which
# projected gradients continue.
SETTLING_FACTOR = 0.5
# Average number of status changes of a problem between two checks at which pivoting
# takes over.
SETTLED_CHANGES = 0.1


@dataclass(frozen=True, eq=False)
class Frame:
    """The problems of a block with their reference points moved to 0, one in each row.

    block : the block, which has M. q : shape (m, n). box : the bounds, of shape (m, n)
        unless they are z >= 0.
    """

    block: Block
    q: Vector
    box: Box

    def part(self, rows: Indices) -> Frame:
        return (
            self
            if rows.size == len(self.q)
            else replace(self, q=self.q[rows], box=self.box.part(rows))
        )

    def at(self, basis: BasisStatus) -> BasicSolution:
        """Return the basic solutions of the bases; they are not finite where M_PP is
        singular or numbers overflow."""
        M, z = self.block.M, self.box.nonbasic(basis)
        right = self.q + self.block.times_M(z) if z.any() else self.q
        z += solve_principal(M, basis == BASIC, -right, self.block.columns.inverse)
        w = self.block.times_M(z)
        w += self.q
        w[basis == BASIC] = 0.0
        like, violations = self.block.like, self.box.violations(z, w, basis)
        wrong = violations > 0.0
        solved: Any = np.logical_not(wrong.any(axis=1))
        largest = np.where(basis == BASIC, like.row_maxima, 1.0) * violations
        rounding_bounds = ROW_ROUNDING * (
            np.abs(self.q).max(axis=1, initial=0.0)
            + like.largest * np.abs(z).sum(axis=1)
        )
        doubtful = (
            ~solved & (largest.max(axis=1, initial=0.0) <= rounding_bounds)
        ).nonzero()[0]
        if doubtful.size:
            row_magnitudes = ROW_ROUNDING * (
                self.block.sizes(z[doubtful]) + np.abs(self.q[doubtful])
            )
            by_rounding = in_units_of_state(
                row_magnitudes, like.row_maxima, basis[doubtful] == BASIC
            )
            solved[doubtful] = (violations[doubtful] <= by_rounding).all(axis=1)
        return BasicSolution(basis, z, w, wrong, solved)


def frame_of(block: Block) -> Frame:
    """Return the frame of all problems of a block."""
    z = block.references.z
    q = block.references.q
    box = block.box
    return Frame(block, q, box if z is None else box.shifted_by(z))


def in_given_variables(frame: Frame, z: Vector) -> Vector:
    """Return the z of the block, within its bounds, for z of its frame; a z at a bound
    stays at that bound."""
    original_box, reference_z = frame.block.box, frame.block.references.z
    z = frame.box.project(z)
    return (
        z
        if reference_z is None
        else original_box.project(original_box.add_within(z, frame.box, reference_z))
    )


@dataclass(frozen=True, eq=False)
class ManyPivotingResult:
    """The points and bases at which pivoting ended.

    z, basis : basic solutions without infeasibilities beyond rounding, shape (m, n).
    steps : how many systems were solved for each, shape (m,). ended : which problems
    have such a solution, shape (m,); for the others M_PP was singular,
    or the steps were too few. by_gradient : where projected gradients chose the start,
    shape (m,).
    """

    z: Vector
    basis: BasisStatus
    steps: Indices
    ended: Mask
    by_gradient: Mask


def solve_many_by_pivoting(
    frame: Frame,
    wanted: Mask,
    R: Vector,
    C: Vector,
    max_steps: int,
    is_late: Callable[[], bool],
) -> ManyPivotingResult:
    """Pivot the wanted problems, shape (m,), by blocks in at most `max_steps`,
    stopping early once `is_late()`.

    R, C : the row and column scaling with which sizes are compared, shape (n,).
    """

    def pivot(rows: Indices, basis: BasisStatus) -> None:
        """Pivot some rows of the frame from their bases, and write the solutions into
        `pivoting_result`."""
        guard = Safeguard(shape[1], MAX_LEAST_INDEX_STEPS)
        pivoting = block_principal_pivoting(frame.part(rows), basis)
        going: Indices | None = None
        for step in range(1, max_steps + 1 if rows.size else 0):
            if is_late():
                return
            now = next(pivoting) if going is None else pivoting.send(going)
            regular = np.isfinite(now.z.sum(axis=1)) & np.isfinite(now.w.sum(axis=1))
            done = regular & now.is_solution
            pivoting_result.steps[rows], pivoting_result.ended[rows] = step, done
            ended = rows[done]
            pivoting_result.z[ended] = now.z[done]
            pivoting_result.basis[ended] = now.basis[done]
            guard.choose(now.wrong, np.count_nonzero(now.wrong, axis=1))
            going = (regular & ~done & (guard.left >= 0)).nonzero()[0]
            rows = rows[going]
            if not rows.size:
                return
            guard.keep(going)

    rows, shape = wanted.nonzero()[0], frame.q.shape
    masks = np.zeros((2, wanted.size), dtype=bool)
    pivoting_result = ManyPivotingResult(
        np.zeros(shape),
        np.full(shape, LOWER, np.int8),
        np.zeros(wanted.size, dtype=np.intp),
        *masks,
    )
    leaders, is_warm = _neighbours(frame.q[rows] * R)
    cold = rows[~is_warm]
    warm = rows[is_warm]
    leaders = rows[leaders[is_warm]]
    start, pivoting_result.by_gradient[cold] = _start(frame.part(cold), R, C)
    pivot(cold, start)
    ended = pivoting_result.ended[leaders]
    warm, leaders = warm[ended], leaders[ended]
    pivot(warm, pivoting_result.basis[leaders])
    return pivoting_result


def refine_once(
    frame: Frame, pivoting_result: ManyPivotingResult, rows: Indices, w: Vector
) -> Vector:
    """Return the z of some rows after a step of iterative refinement, for their w."""
    basic = pivoting_result.basis[rows] == BASIC
    return np.asarray(
        pivoting_result.z[rows]
        - solve_principal(frame.block.M, basic, np.where(basic, w, 0.0))
    )


def _neighbours(q: Vector) -> tuple[Indices, Mask]:
    """Return for each row the first row of its stride, and which rows are close to that
    row: none unless in more than half of the strides the last row is close to the
    first."""
    rows = np.arange(q.shape[0])
    leaders, is_warm = rows // STRIDE * STRIDE, np.zeros(rows.size, dtype=bool)
    last = rows[STRIDE - 1 :: STRIDE]
    if 2 * np.count_nonzero(_are_near(q, last, leaders[last])) > last.size:
        is_warm[:] = _are_near(q, rows, leaders)
        is_warm[::STRIDE] = False
    return leaders, is_warm


def _are_near(q: Vector, rows: Indices, others: Indices) -> Mask:
    distances, sizes = q[rows] - q[others], q[rows]
    return np.asarray(
        (distances**2).sum(axis=1) < NEIGHBOUR_DISTANCE**2 * (sizes**2).sum(axis=1)
    )


def _start(frame: Frame, R: Vector, C: Vector) -> tuple[BasisStatus, Mask]:
    """Return the bases to start from, and for which problems projected gradients, which
    did not diverge, have determined them, instead of the reference points. Gradients
    continue while each check counts at most SETTLING_FACTOR times the status changes of
    the check before."""
    start, diagonal = frame.box.basis_of(-0.5 * frame.q), frame.block.M.diagonal()
    if not (frame.q.size and diagonal.min() > 0):
        return start, np.zeros(frame.q.shape[0], dtype=bool)
    half = 1 / np.sqrt(R * diagonal * C)
    R, C = R * half, C * half
    M, q = np.ascontiguousarray((R[:, np.newaxis] * frame.block.M * C).T), frame.q * R

    def w_of(z: Vector) -> Vector:
        w: Vector = z @ M
        w += q
        return w

    max_changes = np.inf
    for gradient_check in gradient_steps(
        frame.box.in_units(C), w_of, np.zeros(q.shape), q
    ):
        if (
            gradient_check.changes <= SETTLED_CHANGES * q.shape[0]
            or gradient_check.changes > SETTLING_FACTOR * max_changes
        ):
            break
        max_changes = gradient_check.changes
    start[gradient_check.bounded] = gradient_check.basis[gradient_check.bounded]
    return start, gradient_check.bounded
