"""Block principal pivoting for many right-hand sides at once: what has the same active set shares its factorization.

M. H. Van Benthem and M. R. Keenan, Fast algorithm for the solution of large-scale non-negativity-constrained least
squares problems, Journal of Chemometrics 18 (2004) 441-450, with the exchanges of `newton`, as in J. Kim and H. Park,
Fast nonnegative matrix factorization: an active-set-like method and comparisons, SIAM Journal on Scientific Computing
33 (2011) 3261-3281. Products with M are taken for all columns together.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.linalg.principal_many import solve_principal
from lcpcli.methods.newton import BLOCK, GROWTH, LEAST_INDEX_STEPS, MOST_STEPS, PATIENCE
from lcpcli.model.box import Basis, Box, moved
from lcpcli.model.columns import Block
from lcpcli.typing import Indices, Mask, Vector
from lcpcli.verify.basic_solution import FEW_WRONG


class Frame(NamedTuple):
    """Problems of a block with their reference points moved to 0, one in each row.

    block : where M is. q : shape (m, n). box : the bounds, for other than z >= 0 of shape (m, n).
    """

    block: Block
    q: Vector
    box: Box

    def part(self, rows: Indices) -> Frame:
        """Some of the problems."""
        if rows.size == self.q.shape[0]:
            return self
        return self._replace(q=self.q[rows], box=self.box.mapped(lambda bound: bound[rows]))

    @property
    def start(self) -> Basis:
        """The states that each reference point has with its own w."""
        return self.box.basis_of(-0.5 * self.q)


def frame_of(block: Block) -> Frame:
    """The frame of all problems of a block."""
    z, q, box = block.references.z, block.references.q, block.box
    return Frame(block, q, box if z is None else box.mapped(lambda bound: moved(bound - z, bound)))


def in_given_variables(frame: Frame, z: Vector) -> Vector:
    """Admissible z of the block for z of its frame; what is at a bound stays there."""
    given, box, there = frame.block.box, frame.box, frame.block.references.z
    z = box.project(z)
    if there is None:
        return z
    inside = np.where(z == box.upper, given.upper, z + there)
    return given.project(np.where(z == box.lower, given.lower, inside))


class Pivoted(NamedTuple):
    """Where pivoting ended.

    z : basic solutions that have the signs that their states ask for, or violate them by rounding alone, shape (m, n).
    basis : their states.
    steps : how many systems were solved for each, shape (m,).
    ended : where there is one, shape (m,); elsewhere M_PP was singular, or the steps were not enough.
    by_gradient : where projected gradients chose the start, shape (m,).
    """

    z: Vector
    basis: Basis
    steps: Indices
    ended: Mask
    by_gradient: Mask

    @classmethod
    def none(cls, m: int, n: int) -> Pivoted:
        """Before anything was solved."""
        basis, masks = Basis(*np.zeros((2, m, n), dtype=bool)), np.zeros((2, m), dtype=bool)
        return cls(np.zeros((m, n)), basis, np.zeros(m, dtype=np.intp), *masks)


def block_pivoting(
    frame: Frame,
    rows: Indices,
    basis: Basis,
    found: Pivoted,
    patience: int,
    most_steps: int,
    is_late: Callable[[], bool],
) -> None:
    """The steps of `newton.block_pivoting` for some rows of the frame at once; ended early once it is late.

    basis : the states that they start from. found : what is found is written there.
    patience : how many exchanges of least indices each may make. most_steps : how many steps in all.
    """
    frame = frame.part(rows)
    fewest, waiting, left, least = (
        np.full(rows.size, value) for value in (frame.q.shape[1] + 1, PATIENCE, patience, False)
    )
    step = 0
    while rows.size and step < most_steps and not is_late():
        step += 1
        z, wrong, count, regular = _basic_solutions(frame, basis)
        done = regular & (count == 0)
        found.steps[rows], found.ended[rows] = step, done
        ended = rows[done]
        found.z[ended], found.basis.basic[ended] = z[done], basis.basic[done]
        if basis.upper is not None and found.basis.upper is not None:
            found.basis.upper[ended] = basis.upper[done]
        fewer = count < fewest
        fewest, waiting = np.where(fewer, count, fewest), np.where(fewer, PATIENCE, waiting - 1)
        single = waiting < 1
        waiting[single], least, left = 1, (least | single) & ~fewer, left - single
        going = (regular & ~done & (left >= 0)).nonzero()[0]
        wrong[least] &= np.cumsum(wrong[least], axis=1) == 1
        basis = frame.box.exchanged(basis, wrong, z)
        if going.size < rows.size:
            frame, rows, basis = frame.part(going), rows[going], basis.part(going)
            fewest, waiting, left, least = fewest[going], waiting[going], left[going], least[going]


def refined(frame: Frame, found: Pivoted, rows: Indices, w: Vector) -> Vector:
    """The z of some rows after a step of iterative refinement, for their w."""
    basic = found.basis.basic[rows]
    z: Vector = found.z[rows] - solve_principal(frame.block.M, basic, np.where(basic, w, 0.0))
    return z


def _basic_solutions(frame: Frame, basis: Basis) -> tuple[Vector, Mask, Indices, Mask]:
    """z of the states, where signs are wrong, how many are so beyond rounding, and which are regular and in range."""
    nonbasic, right = frame.box.nonbasic(basis), frame.q
    if nonbasic.any():
        right = right + frame.block.times_M(nonbasic)
    z = solve_principal(frame.block.M, basis.basic, -right, frame.block.columns.inverse)
    z += nonbasic
    w = frame.block.times_M(z)
    w += frame.q
    w[basis.basic] = 0.0
    wrong = frame.box.wrong(z, w, basis)
    count = np.count_nonzero(wrong, axis=1)
    regular = np.isfinite(z.sum(axis=1)) & np.isfinite(w.sum(axis=1))
    few = (regular & (count > 0) & (count <= max(1, FEW_WRONG * z.shape[1]))).nonzero()[0]
    if few.size:
        part, states = frame.part(few), basis.part(few)
        violations = part.box.violations(z[few], w[few], states)
        count[few] = np.count_nonzero(violations > _by_rounding(part, z[few], states.basic), axis=1)
    return z, wrong, count, regular


def _by_rounding(frame: Frame, z: Vector, basic: Mask) -> Vector:
    """How far rounding alone may take the signs, as `basic_solution.violation_by_rounding`."""
    terms = ROW_ROUNDING * (frame.block.sizes(z) + np.abs(frame.q))
    maxima = frame.block.like.row_maxima
    in_z = np.divide(terms, maxima, where=maxima > 0, out=np.zeros_like(terms))
    return np.where(basic, in_z, terms)


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
