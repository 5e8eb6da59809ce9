"""Where block pivoting for many right-hand sides starts: from nearly right active sets, so that few systems are solved.

For right-hand sides that follow each other closely, as in time, that of a neighbour's solution; for the others that at
which projected gradients arrive, as in `auto.dense_route`, each step of which is one product with M for all.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lcpcli.methods.auto.dense_route import BLOCK, GROWTH, LEAST_INDEX_STEPS, MOST_STEPS
from lcpcli.methods.columns import Frame, Pivoted, block_pivoting
from lcpcli.model.box import Basis
from lcpcli.typing import Indices, Mask, Vector

STRIDE = 16  # problems of which the first is solved first, for the others to start from its solution
NEAR = 0.25  # of the distance of q from 0: the distance from another one that makes it a neighbour
FASTER = 0.5  # of the changes of state between two looks: the most between the next two, if it is to go on
SETTLED = 0.1  # changes of state of a problem, on average, between two looks


def pivoted(frame: Frame, wanted: Mask, R: Vector, C: Vector, most_steps: int, is_late: Callable[[], bool]) -> Pivoted:
    """Block pivoting for the wanted problems, shape (m,), in at most so many steps, ended early once it is late.

    R, C : units in which sizes are compared, shape (n,).
    """
    found, rows = Pivoted.none(*frame.q.shape), wanted.nonzero()[0]
    leaders, near = _neighbours(frame.q[rows] * R)
    cold, warm, leaders = rows[~near], rows[near], rows[leaders[near]]
    start, found.by_gradient[cold] = _start(frame.part(cold), R, C)
    block_pivoting(frame, cold, start, found, LEAST_INDEX_STEPS, most_steps, is_late)
    ended = found.ended[leaders]
    warm, leaders = warm[ended], leaders[ended]
    block_pivoting(frame, warm, found.basis.part(leaders), found, LEAST_INDEX_STEPS, most_steps, is_late)
    return found


def _neighbours(q: Vector) -> tuple[Indices, Mask]:
    """For each row the first one of its stride, and whether to start from its solution; only if most are neighbours."""
    rows = np.arange(q.shape[0])
    leaders, near = rows // STRIDE * STRIDE, np.zeros(rows.size, dtype=bool)
    last = rows[STRIDE - 1 :: STRIDE]
    if 2 * np.count_nonzero(_are_near(q, last, leaders[last])) > last.size:
        near[:] = _are_near(q, rows, leaders)
        near[::STRIDE] = False
    return leaders, near


def _are_near(q: Vector, rows: Indices, others: Indices) -> Mask:
    distances, sizes = q[rows] - q[others], q[rows]
    near: Mask = _dots(distances, distances) < NEAR**2 * _dots(sizes, sizes)
    return near


def _start(frame: Frame, R: Vector, C: Vector) -> tuple[Basis, Mask]:
    """The states to start from, and where gradients have found them; elsewhere those of the reference points."""
    start, diagonal = frame.start, frame.block.M.diagonal()
    if not (diagonal.min() > 0 and frame.q.size):
        return start, np.zeros(frame.q.shape[0], dtype=bool)
    basis, good = _projected_gradient(frame, R, C)
    for states, better in zip(start, basis, strict=True):
        if states is not None and better is not None:
            states[good] = better[good]
    return start, good


def _projected_gradient(frame: Frame, R: Vector, C: Vector) -> tuple[Basis, Mask]:
    """The states at which z' = mid(l, u, z - t (M z + q)) arrives in units with a unit diagonal, with Barzilai and
    Borwein's step sizes t in turn; and where the iteration does not diverge.

    It goes on while the states settle: while each look at them finds less than FASTER of the changes of the last one.
    """
    half = 1 / np.sqrt(R * frame.block.M.diagonal() * C)
    R, C = R * half, C * half
    M, q = np.ascontiguousarray((R[:, np.newaxis] * frame.block.M * C).T), frame.q * R
    box = frame.box.in_units(C)
    z, gradient, t = np.zeros(q.shape), q.copy(), np.full((q.shape[0], 1), 0.5)
    change, difference = np.empty_like(q), np.empty_like(q)
    first, basis, most = _dots(q, q), box.basis_of(-0.5 * q), np.inf
    for step in range(1, MOST_STEPS + 1):
        np.multiply(t, gradient, out=change)
        former, z = z, box.project(np.subtract(z, change, out=change))
        np.matmul(z, M, out=difference)
        difference += q
        gradient, difference = difference, np.subtract(difference, gradient, out=gradient)
        np.subtract(z, former, out=change)
        along = _dots(change, difference)
        lengths = _dots(change, change) if step % 2 else along
        with np.errstate(divide="ignore"):
            lengths = lengths / (along if step % 2 else _dots(difference, difference))
        t = np.where(along > 0, lengths, t[:, 0])[:, np.newaxis]
        if step % BLOCK == 0:
            before, basis = basis, box.basis_of(0.5 * (z - gradient))
            changes = basis.changes(before) / q.shape[0]
            if changes <= SETTLED or changes > FASTER * most:
                break
            most = changes
    return basis, _dots(gradient, gradient) <= GROWTH * first


def _dots(A: Vector, B: Vector) -> Vector:
    """The inner products of rows."""
    dots: Vector = np.einsum("ij,ij->i", A, B)
    return dots
