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
from lcpcli.methods.newton import PATIENCE
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
