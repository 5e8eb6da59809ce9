"""The solution of a strictly monotone affine variational inequality by an active-set
method. At any time, x solves the inequality with the active constraints as equations.

A violated constraint is made active by increasing its multiplier; active constraints
whose multipliers become 0 on the way are dropped. For a symmetric H this is the dual
method of D. Goldfarb, A. Idnani, Math. Program. 27 (1983) 1-33. For other H no
objective proves that the method terminates; if it does not, a method for general
problems is used.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg.blas import daxpy, dger

from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.block_form import Blocks, bordered
from lcpcli.model.formulation import Proposal
from lcpcli.typing import Mask, Vector

MAX_CONSTRAINTS = 600
STEPS = 3  # the largest number of steps, for each constraint
# A violation up to this, relative to the terms of the constraint, is rounding error.
SATISFIED = 1e-12
# A slope up to this, relative to the largest entry of H^-1, is rounding error of 0: the
# constraint depends linearly on the active ones.
DEPENDENT = 1e-11
MIN_MULTIPLIER = 1e-300  # instead of 0, which would divide 0


class _Constraints(NamedTuple):
    """The constraints Cx >= c, or = c for equations, with rows of norm 1. Those of
    finite row bounds come first, then those of finite bounds of variables.

    rows : for each constraint the row of A, or the variable.
    signs : -1 for constraints that are upper bounds, otherwise 1.
    sizes : the norms by which the constraints were divided.
    of_rows : how many constraints belong to rows of A.
    """

    C: Vector
    c: Vector
    is_equation: Mask
    rows: Vector
    signs: Vector
    sizes: Vector
    of_rows: int


def _constraints(blocks: Blocks) -> _Constraints | None:
    """Return the constraints; None if a row has no nonzero entry."""
    k = blocks.c.size
    parts = []
    sides_of = (
        (blocks.A, blocks.row_lower, blocks.row_upper),
        (np.eye(k), blocks.lower, blocks.upper),
    )
    for A, low, high in sides_of:
        equal = low == high
        has_low, has_high = np.isfinite(low), np.isfinite(high) & ~equal
        rows = np.concatenate((has_low.nonzero()[0], has_high.nonzero()[0]))
        signs = np.repeat((1.0, -1.0), (has_low.sum(), has_high.sum()))
        sides = np.concatenate((low[has_low], -high[has_high]))
        is_equation = equal[rows] & (signs > 0)
        parts.append((signs[:, np.newaxis] * A[rows], sides, is_equation, rows, signs))
    C, c, is_equation, rows, signs = map(np.concatenate, zip(*parts, strict=True))
    sizes = np.sqrt(np.einsum("ij,ij->i", C, C))
    if not sizes.all():
        return None
    C = C / sizes[:, np.newaxis]
    return _Constraints(C, c / sizes, is_equation, rows, signs, sizes, len(parts[0][3]))


@np.errstate(all="ignore")
def proposed(blocks: Blocks) -> Proposal | None:
    """Return the solution z = (x, y, s) of the conditions; None unless H + H' is
    positive definite and the method terminates.
    """
    H, k = blocks.Q, blocks.c.size
    if is_sparse(H) or is_sparse(blocks.A) or k + len(blocks.A) > MAX_CONSTRAINTS:
        return None
    constraints = _constraints(blocks)
    if constraints is None:
        return None
    try:
        np.linalg.cholesky(H + H.T)
        inverse = np.linalg.inv(H)
    except np.linalg.LinAlgError:
        return None
    active, steps = _active(constraints, inverse, -(inverse @ blocks.c))
    return None if active is None else _at(blocks, constraints, active, steps)


class _System:
    """The inverse Z of [H -C_W'; C_W 0] for the set W of active constraints. Each of
    them has one of k slots, which follow the k variables; rows and columns of unused
    slots are 0.
    """

    def __init__(self, inverse: Vector, C: Vector) -> None:
        self.k, self.C = len(inverse), C
        self.Z = np.zeros((2 * self.k, 2 * self.k), order="F")
        self.Z[: self.k, : self.k] = inverse
        self.free = list(range(2 * self.k - 1, self.k - 1, -1))
        self.of_slots = np.full(2 * self.k, -1)  # the constraint in each slot, or -1

    def members(self) -> Vector:
        """Return the active constraints, by their slots."""
        return self.of_slots[self.of_slots >= 0]

    def direction(self, p: int) -> Vector:
        """Return the derivatives of x and of the multipliers in all slots with respect
        to the multiplier of constraint p.
        """
        direction: Vector = self.Z[:, : self.k] @ self.C[p]
        return direction

    def add(self, p: int, direction: Vector, slope: float) -> int:
        """Make constraint p active and return its slot.

        slope : the derivative of the value of the constraint with respect to its
            multiplier.
        """
        slot = self.free.pop()
        self.of_slots[slot] = p
        row = self.C[p] @ self.Z[: self.k]
        column = direction.copy()
        column[slot], row[slot] = 1.0, -1.0
        self._subtract(column, row, slope)
        return slot

    def drop(self, slot: int) -> int:
        """Make the constraint in a slot inactive and return it."""
        column, row = self.Z[:, slot].copy(), self.Z[slot].copy()
        self._subtract(column, row, float(column[slot]))
        self.Z[slot] = 0.0
        self.Z[:, slot] = 0.0
        p = int(self.of_slots[slot])
        self.of_slots[slot] = -1
        self.free.append(slot)
        return p

    def _subtract(self, column: Vector, row: Vector, divisor: float) -> None:
        dger(-1 / divisor, column, row, a=self.Z, overwrite_a=1)


def _active(
    constraints: _Constraints, inverse: Vector, x: Vector
) -> tuple[Vector | None, int]:
    """Return the active constraints at the solution, or None if the method does not
    reach it, and the number of steps.
    """
    system = _System(inverse, constraints.C)
    m = constraints.c.size
    values = constraints.C @ x - constraints.c
    allowed = -SATISFIED * (np.abs(constraints.C) @ np.abs(x) + np.abs(constraints.c))
    min_slope = DEPENDENT * float(np.abs(inverse).max())
    has_equations = bool(constraints.is_equation.any())
    is_active = np.zeros(m, dtype=np.bool_)
    # The multipliers in all slots; infinite where no constraint may be dropped.
    y = np.full(2 * x.size, np.inf)
    p = -1
    driven = 0.0
    sign = 1.0
    for step in range(STEPS * m + 1):
        if p < 0:
            gaps = np.where(is_active, 0.0, values)
            if has_equations:
                gaps = np.where(constraints.is_equation, -np.abs(gaps), gaps)
            p = int(gaps.argmin()) if m else 0
            if not m or not gaps[p] < allowed[p]:
                return system.members(), step
            driven, sign = 0.0, -1.0 if values[p] > 0 else 1.0
        move = system.direction(p)
        changes = constraints.C @ move[: x.size]
        slope = float(changes[p])
        full = -sign * float(values[p]) / slope if slope > min_slope else np.inf
        # How fast each multiplier falls, relative to its value.
        rates = move / y
        slot = int(rates.argmin() if sign > 0 else rates.argmax())
        rate = -sign * float(rates[slot])
        length = min(full, 1 / rate if rate > 0 else np.inf)
        if not length < np.inf:
            return None, step
        driven += sign * length
        values = daxpy(changes, values, a=sign * length)
        y = np.maximum(daxpy(move, y, a=sign * length), MIN_MULTIPLIER)
        if length < full:
            dropped = system.drop(slot)
            is_active[dropped] = False
            y[slot] = np.inf
            continue
        if not system.free:
            return None, step
        slot = system.add(p, move, slope)
        is_active[p] = True
        y[slot] = np.inf if constraints.is_equation[p] else driven
        p = -1
    return None, step


def _at(
    blocks: Blocks, constraints: _Constraints, active: Vector, steps: int
) -> Proposal | None:
    """Return the solution with these active constraints; None if their system is
    singular."""
    k, K = blocks.c.size, bordered(blocks.Q, constraints.C[active])
    right = np.concatenate((-blocks.c, constraints.c[active]))
    try:
        both = np.linalg.solve(K, right)
    except np.linalg.LinAlgError:
        return None
    if not np.isfinite(both).all():
        return None
    x, multipliers = both[:k], both[k:]
    of_rows = active < constraints.of_rows
    bounds = active[~of_rows]
    x[constraints.rows[bounds]] = (constraints.signs * constraints.c)[bounds]
    x = np.clip(x, blocks.lower, blocks.upper)
    y = np.zeros(len(blocks.A))
    inside = active[of_rows]
    row_multipliers = multipliers[of_rows]
    row_multipliers = np.where(
        constraints.is_equation[inside],
        row_multipliers,
        np.maximum(row_multipliers, 0.0),
    )
    np.add.at(
        y,
        constraints.rows[inside],
        constraints.signs[inside] * row_multipliers / constraints.sizes[inside],
    )
    # A row with a nonzero multiplier has s at its bound exactly, without rounding of
    # Ax.
    s = np.clip(blocks.A @ x, blocks.row_lower, blocks.row_upper)
    s = np.where(y > 0, blocks.row_lower, np.where(y < 0, blocks.row_upper, s))
    z = np.concatenate((x, y, s[blocks.ranges]))
    return Proposal(z, steps, "active set")
