"""The next step of contacts in the plane, starting from their states in the previous
one: if they separate, stick or slide as before, the solution follows from one linear
system in the impulses that are not at a limit of their range.

Contacts that violate their conditions change their states together, a few times, as in
block principal pivoting (L. F. Portugal, J. J. Judice, L. N. Vicente, Math. Comp. 63
(1994) 625-643). Nothing guarantees that this terminates: otherwise the general methods
solve the problem.
"""

from __future__ import annotations

import numpy as np

from lcpcli.formulations.contact.answers import (
    Motion,
    friction_within,
    point_of,
)
from lcpcli.formulations.contact.friction import Contact
from lcpcli.linalg.doubles import EPS, ROW_ROUNDING
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.model.formulation import Proposal
from lcpcli.typing import BasisStatus, Vector

MAX_SYSTEMS = 5
# Added to the diagonal of a system, relative to its largest entry, which makes systems
# of redundant contacts nonsingular; CORRECTIONS steps of refinement remove its effect.
SHIFT = 1e-10
CORRECTIONS = 2


class _Step:
    """The contacts, and the basis statuses of all unknowns: `states` of those that are
    not tangential, and BASIC for others; `slip_signs` of the tangential ones, -1 and 1
    at the limits of their range, 0 between them.
    """

    def __init__(self, contact: Contact, states: BasisStatus) -> None:
        n, friction = contact.b.size, contact.friction
        self.A, self.b = np.asarray(contact.A), contact.b
        self.normals, self.mu = friction.normals, friction.coefficients
        self.tangents = friction.tangents[:, 0]
        self.states, is_upper = states[:n].copy(), states[n:] == BASIC
        is_lower = self.states[self.tangents] != BASIC
        self.slip_signs = is_upper - np.where(is_upper, 0.0, is_lower)
        self.states[self.tangents] = BASIC
        self.lower, self.upper = contact.lower.copy(), contact.upper.copy()
        self.lower[self.tangents], self.upper[self.tangents] = -np.inf, np.inf

    def impulses(self) -> Vector | None:
        """Return x for these statuses, or None if it is not unique."""
        normals, tangents = self.normals, self.tangents
        is_free = self.states == BASIC
        x: Vector = np.where(self.states == UPPER, self.upper, self.lower)
        x[is_free] = 0.0
        # If a normal impulse is 0, its tangential one is 0 too.
        is_open = is_free[normals] | (x[normals] > 0)
        sticks = self.slip_signs == 0
        is_free[tangents] = sticks & is_open
        slips = self.slip_signs * self.mu
        x[tangents] = slips * x[normals]
        free = is_free.nonzero()[0]
        if not free.size:
            return x
        matrix = self.A[free]
        block = matrix[:, free]
        row = matrix @ x
        row += self.b[free]
        sliding = (is_free[normals] & ~sticks).nonzero()[0]
        if sliding.size:
            columns_of_normals = np.cumsum(is_free)[normals[sliding]] - 1
            columns = matrix[:, tangents[sliding]] * slips[sliding]
            np.add.at(block.T, columns_of_normals, columns.T)
        impulses = _solved(block, row)
        if impulses is None:
            return None
        x[free] = impulses
        x[tangents] = np.where(sticks, x[tangents], slips * x[normals])
        return x

    def exchanged(self, motion: Motion) -> bool:
        """Change the statuses whose conditions are violated by more than rounding
        errors, and return whether there are any.
        """
        x, w = motion.x, motion.w
        small, rounding = self._small(x), ROW_ROUNDING * motion.terms
        is_basic = self.states == BASIC
        beyond = np.maximum(self.lower - x, x - self.upper) - small
        signed = np.where(self.states == UPPER, w, -w) - rounding
        is_wrong = np.where(is_basic, beyond, signed) > 0
        is_wrong &= is_basic | (self.lower < self.upper)
        max_friction = self.mu * np.maximum(x[self.normals], 0.0)
        tangential, velocity = x[self.tangents], w[self.tangents]
        beyond_friction = np.abs(tangential) - max_friction - small
        along = self.slip_signs * velocity - rounding[self.tangents]
        sticks, is_closed = self.slip_signs == 0, max_friction == 0.0
        is_wrong_slip = np.where(sticks, beyond_friction, along) > 0
        is_wrong_slip &= ~is_closed
        if not (np.count_nonzero(is_wrong) or np.count_nonzero(is_wrong_slip)):
            return False
        falls = np.where(x < self.lower, LOWER, UPPER)
        self.states[is_wrong] = np.where(is_basic, falls, BASIC)[is_wrong]
        changed = np.where(sticks, np.sign(tangential), 0.0)
        self.slip_signs = np.where(is_wrong_slip, changed, self.slip_signs)
        self.slip_signs[is_closed] = -np.sign(velocity[is_closed])
        return True

    def _small(self, x: Vector) -> float:
        return EPS * float(np.abs(x).max(initial=0.0))

    def within(self, x: Vector) -> Vector:
        """Return x with each entry within its bounds, those of friction last."""
        x = np.minimum(np.maximum(x, self.lower), self.upper)
        max_friction = self.mu * np.maximum(x[self.normals], 0.0)
        x[self.tangents] = friction_within(x[self.tangents], max_friction)
        return x


def _solved(block: Vector, row: Vector) -> Vector | None:
    """Return y with block y + row = 0; None if the shifted block is singular.

    A small multiple of the identity makes blocks of redundant contacts nonsingular; its
    effect on y is corrected, and in directions that change no velocity y stays close to
    0.
    """
    shift = SHIFT * float(np.abs(block).max())
    shifted = block.copy()
    shifted.flat[:: len(row) + 1] += shift
    try:
        inverse = np.linalg.inv(shifted)
    except np.linalg.LinAlgError:
        return None
    y = -(inverse @ row)
    for _ in range(CORRECTIONS):
        y -= inverse @ (block @ y + row)
    return y


@np.errstate(all="ignore")
def followed(contact: Contact, states: BasisStatus) -> Proposal | None:
    """Return the z of contacts from the basis of the previous step; None if this does
    not lead to a solution.
    """
    is_dense = isinstance(contact.A, np.ndarray)
    if not (is_dense and contact.is_planar and contact.friction.normals.size):
        return None
    step = _Step(contact, states)
    for number in range(1, MAX_SYSTEMS + 1):
        x = step.impulses()
        if x is None or not np.isfinite(x).all():
            return None
        motion = Motion.of_impulses(contact, x)
        if not step.exchanged(motion):
            inside = step.within(x)
            if not np.array_equal(inside, x):
                motion = Motion.of_impulses(contact, inside)
            z = point_of(contact, motion)
            contact.last_motion[:] = z, motion
            return Proposal(z, number, "newton")
    return None
