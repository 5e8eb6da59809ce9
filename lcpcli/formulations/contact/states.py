"""The next step of contacts in the plane, starting from their states in the previous
one: if they separate, stick or slide as before, the solution follows from one linear
system in the impulses that are not at an end of their range.

Contacts with wrong signs change their states together, a few times, as in block
principal pivoting (L. F. Portugal, J. J. Judice, L. N. Vicente, Math. Comp. 63 (1994)
625-643). Nothing guarantees that this terminates: otherwise the general methods solve
the problem.
"""

from __future__ import annotations

import numpy as np

from lcpcli.formulations.contact.answers import point_of, terms_of
from lcpcli.formulations.contact.friction import Contact
from lcpcli.linalg.doubles import EPS, ROW_ROUNDING
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.model.formulation import Proposal
from lcpcli.typing import States, Vector

MAX_SYSTEMS = 5
# Added to the diagonal of a system, relative to its largest entry, which makes systems
# of redundant contacts nonsingular; CORRECTIONS steps of refinement remove its effect.
SHIFT = 1e-10
CORRECTIONS = 2


class _Step:
    """The contacts, and the states of all unknowns: `states` of those that are not
    tangential; `slip_signs` of the tangential ones, -1 and 1 at an end of their range,
    0 between the ends.
    """

    def __init__(self, contact: Contact, states: States) -> None:
        n, friction = contact.b.size, contact.friction
        self.contact, self.A = contact, np.asarray(contact.A)
        self.normals, self.mu = friction.normals, friction.coefficients
        self.tangents = friction.tangents[:, 0]
        self.states, is_upper = states[:n].copy(), states[n:] == BASIC
        is_lower = self.states[self.tangents] != BASIC
        self.slip_signs = np.where(is_upper, 1.0, np.where(is_lower, -1.0, 0.0))
        self.is_other = np.ones(n, dtype=np.bool_)
        self.is_other[self.tangents] = False
        self.lower, self.upper = contact.lower, contact.upper

    def impulses(self) -> Vector | None:
        """Return x for these states, or None if it is not unique."""
        is_free = self.is_other & (self.states == BASIC)
        x = np.where(self.states == UPPER, self.upper, self.lower)
        x[is_free | ~self.is_other] = 0.0
        # If a normal impulse is 0, its tangential one is 0 too.
        is_open = is_free[self.normals] | (x[self.normals] > 0)
        is_free[self.tangents] = (self.slip_signs == 0) & is_open
        free, slips = is_free.nonzero()[0], self.slip_signs * self.mu
        x[self.tangents] = slips * x[self.normals]
        if not free.size:
            return x
        matrix = self.A[free]
        row = self.contact.b[free] + matrix @ x
        block = matrix[:, free]
        sliding = (is_free[self.normals] & (slips != 0)).nonzero()[0]
        if sliding.size:
            columns_of_normals = np.cumsum(is_free)[self.normals[sliding]] - 1
            columns = matrix[:, self.tangents[sliding]] * slips[sliding]
            np.add.at(block.T, columns_of_normals, columns.T)
        impulses = _solved(block, row)
        if impulses is None:
            return None
        x[free] = impulses
        x[self.tangents] = np.where(
            self.slip_signs == 0, x[self.tangents], slips * x[self.normals]
        )
        return x

    def exchanged(self, x: Vector, w: Vector, rounding: Vector) -> bool:
        """Change the states whose signs are wrong at x by more than rounding errors,
        and return whether there are any.
        """
        small = EPS * float(np.abs(x).max(initial=0.0))
        states = self.states.copy()
        is_basic = states == BASIC
        states[is_basic & (x < self.lower - small)] = LOWER
        states[is_basic & (x > self.upper + small)] = UPPER
        falls = (states == LOWER) & (w < -rounding) & ~is_basic
        rises = (states == UPPER) & (w > rounding) & ~is_basic
        states[(falls | rises) & (self.lower < self.upper)] = BASIC
        states[self.tangents] = self.states[self.tangents]
        max_friction = self.mu * np.maximum(x[self.normals], 0.0)
        tangential, velocity = x[self.tangents], w[self.tangents]
        zero = rounding[self.tangents]
        slip_signs = self.slip_signs.copy()
        beyond = (slip_signs == 0) & (np.abs(tangential) > max_friction + small)
        slip_signs[beyond] = np.sign(tangential[beyond])
        slip_signs[~beyond & (slip_signs * velocity > zero)] = 0.0
        is_closed = max_friction == 0.0
        slip_signs[is_closed] = -np.sign(velocity[is_closed])
        others = ~is_closed & (slip_signs != self.slip_signs)
        is_changed = bool((states != self.states).any() or others.any())
        self.states, self.slip_signs = states, slip_signs
        return is_changed


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
def followed(contact: Contact, states: States) -> Proposal | None:
    """Return the z of contacts by the states of its unknowns in the previous step; None
    if these do not lead to a solution.
    """
    is_dense = isinstance(contact.A, np.ndarray)
    if not (is_dense and contact.is_planar and contact.contacts):
        return None
    step = _Step(contact, states)
    for number in range(1, MAX_SYSTEMS + 1):
        x = step.impulses()
        if x is None or not np.isfinite(x).all():
            return None
        w = step.A @ x + contact.b
        rounding = ROW_ROUNDING * terms_of(contact, x)
        if not step.exchanged(x, w, rounding):
            x = np.clip(x, *contact.box(np.clip(x, contact.lower, contact.upper)))
            return Proposal(point_of(contact, x), number, "newton")
    return None
