"""The next step of contacts in the plane, starting from their states in the previous
one: if they separate, stick or slide as before, the solution follows from one linear
system in the impulses that are not at a limit of their range.

Contacts that violate their conditions change their states together, a few times, as in
block principal pivoting (L. F. Portugal, J. J. Judice, L. N. Vicente, Math. Comp. 63
(1994) 625-643). Nothing guarantees that this terminates: otherwise the general methods
solve the problem.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from lcpcli.formulations.contact.answers import Motion, point_of, without_rounding
from lcpcli.formulations.contact.friction import Contact
from lcpcli.linalg.doubles import SYSTEM_ROUNDING, largest, number_of
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.model.formulation import Proposal
from lcpcli.model.problem import Problem
from lcpcli.typing import BasisStatus, Vector

if TYPE_CHECKING:
    from types import ModuleType

MAX_SYSTEMS = 5
# Added to the diagonal of a system, relative to its largest entry, which makes systems
# of redundant contacts nonsingular; CORRECTIONS steps of refinement remove its effect.
SHIFT = 1e-10
CORRECTIONS = 2
# Relative to the right-hand side: the residual before the last correction from which on
# another inverse is computed.
CONVERGED = 1e-11


class _Step:
    """The contacts, and the basis status of each unknown of x, at its lower or upper
    bound or between them: `statuses`, for tangential ones by their friction bounds.
    """

    def __init__(self, contact: Contact, basis: BasisStatus) -> None:
        n, friction = contact.b.size, contact.friction
        self.contact = contact
        self.normals, self.mu = friction.normals, friction.coefficients
        self.tangents = friction.tangents[:, 0]
        self.statuses = basis[:n].copy()
        self.statuses[self.tangents[basis[n:] == BASIC]] = UPPER

    def impulses(self) -> Vector | None:
        """Return x for these statuses, or None if it is not unique."""
        contact, normals, tangents = self.contact, self.normals, self.tangents
        A, b = np.asarray(contact.A), contact.b
        is_free = self.statuses == BASIC
        if number_of(is_free) == b.size:
            return self._solution(A, b, b"")
        x: Vector = np.where(self.statuses == UPPER, contact.upper, contact.lower)
        x[is_free] = 0.0
        # If a normal impulse is 0, its tangential one is 0 too.
        is_free[tangents] &= is_free[normals] | (x[normals] > 0)
        slips = self.statuses[tangents] * self.mu
        x[tangents] = slips * x[normals]
        free = is_free.nonzero()[0]
        if not free.size:
            return x
        matrix = A[free]
        block = matrix[:, free]
        row = matrix @ x
        row += b[free]
        sliding = (is_free[normals] & (self.statuses[tangents] != BASIC)).nonzero()[0]
        if sliding.size:
            columns_of_normals = np.cumsum(is_free)[normals[sliding]] - 1
            columns = matrix[:, tangents[sliding]] * slips[sliding]
            np.add.at(block.T, columns_of_normals, columns.T)
        impulses = self._solution(block, row, is_free.tobytes() + slips.tobytes())
        if impulses is None:
            return None
        x[free] = impulses
        x[tangents[sliding]] = slips[sliding] * x[normals[sliding]]
        return x

    def _solution(self, block: Vector, row: Vector, key: bytes) -> Vector | None:
        """Return y with block y + row = 0, by the inverse for the step before if that
        is close; None if the shifted block is singular. key : the unknowns of the
        system, and how they depend on each other.
        """
        last_system = self.contact.last_system
        last_key, inverse = last_system
        if last_key == key and len(inverse) == row.size:
            y, residual = _refined(inverse, block, row)
            if largest(residual) <= CONVERGED * largest(row):
                return y
        inverse = _inverse(block)
        if inverse is None:
            return None
        last_system[:] = key, inverse
        return _refined(inverse, block, row)[0]

    def motion(self, x: Vector, size: float) -> Motion | None:
        """Return the motion of impulses x with these statuses if all conditions are
        satisfied up to rounding errors, which are removed; otherwise change the
        statuses whose conditions are violated, and return None. size : the largest
        |x_i|.
        """
        contact, statuses, tangents = self.contact, self.statuses, self.tangents
        inside = np.minimum(np.maximum(x, contact.lower), contact.upper)
        max_friction = self.mu * np.maximum(x[self.normals], 0.0)
        tangential = np.maximum(x[tangents], -max_friction)
        inside[tangents] = np.minimum(tangential, max_friction)
        is_wrong = np.abs(x - inside) > SYSTEM_ROUNDING * size
        is_outside = number_of(is_wrong) > 0
        if is_outside:
            is_wrong &= statuses == BASIC
            is_outside = number_of(is_wrong) > 0
        if not is_outside:
            inside[tangents] = without_rounding(inside[tangents], max_friction)
        motion = Motion.of_impulses(contact, x if is_outside else inside)
        is_pulled = statuses * motion.w > SYSTEM_ROUNDING * motion.terms
        if not (is_outside or number_of(is_pulled)):
            return motion
        lower, upper = contact.box(x)
        is_wrong |= is_pulled & (lower < upper)
        if not number_of(is_wrong):
            return motion
        limits = np.where(x < lower, LOWER, UPPER)
        exchanged = np.where(statuses == BASIC, limits, BASIC)
        statuses[is_wrong] = exchanged[is_wrong]
        # Their tangential impulses are 0, whatever their velocities are.
        closed = tangents[max_friction == 0.0]
        statuses[closed] = np.where(motion.w[closed] < 0, UPPER, LOWER)
        return None


def _inverse(block: Vector) -> Vector | None:
    """Return the inverse of a shifted block; None if it is singular.

    A small multiple of the identity makes blocks of redundant contacts nonsingular.
    """
    shifted = block.copy()
    shifted.flat[:: len(block) + 1] += SHIFT * float(np.abs(block).max())
    try:
        return np.linalg.inv(shifted)
    except np.linalg.LinAlgError:
        return None


def _refined(inverse: Vector, block: Vector, row: Vector) -> tuple[Vector, Vector]:
    """Return y with block y + row = 0 by an approximate inverse, and the residual
    before the last correction. In directions that change no velocity y stays close to
    0.
    """
    y = -(inverse @ row)
    for _ in range(CORRECTIONS):
        residual = block @ y
        residual += row
        y -= inverse @ residual
    return y, residual


def followed(
    contact: Contact,
    problem: Problem,
    states: BasisStatus,
    tol: float,
    fast: ModuleType | None,
) -> Proposal | None:
    """Return the z of contacts from the basis of the previous step; None if this does
    not lead to a solution.
    """
    if not contact.is_dense_plane:
        return None
    # The M of a dense A with many zeros may be sparse.
    is_lcp = type(problem.M) is np.ndarray and problem.box.is_orthant
    if fast is not None and is_lcp and problem.is_moderate:
        return _by_kernel(contact, problem, states, tol, fast)
    return _by_numpy(contact, states)


def _by_kernel(
    contact: Contact,
    problem: Problem,
    states: BasisStatus,
    tol: float,
    fast: ModuleType,
) -> Proposal | None:
    contacts = contact.A, contact.b, *contact.friction
    systems = MAX_SYSTEMS, CORRECTIONS, SHIFT
    outcome = fast.contact_step(problem, contacts, states, systems, tol)
    if outcome is None or not outcome[0]:
        return None
    number, is_certain, (z, motion, basis) = outcome
    contact.store_motion(z, Motion(*motion))
    return Proposal(z, number, "newton", is_certain=is_certain, basis=basis)


@np.errstate(all="ignore")
def _by_numpy(contact: Contact, states: BasisStatus) -> Proposal | None:
    step = _Step(contact, states)
    for number in range(1, MAX_SYSTEMS + 1):
        x = step.impulses()
        if x is None or not (size := largest(x)) < math.inf:
            return None
        motion = step.motion(x, size)
        if motion is not None:
            z = point_of(contact, motion)
            contact.store_motion(z, motion)
            return Proposal(z, number, "newton")
    return None
