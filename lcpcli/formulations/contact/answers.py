"""The impulses, velocities and states of contacts that a z represents, in the order of
the caller, recomputed from A and b: whether each contact is separated, sticks or
slides.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property, partial
from operator import sub
from typing import Any, NamedTuple

import numpy as np

from lcpcli.errors import count, listed
from lcpcli.formulations.contact.friction import Contact
from lcpcli.linalg.doubles import ROUNDING, ROW_ROUNDING, SYSTEM_ROUNDING, number_of
from lcpcli.linalg.matrices import absolute_product, product
from lcpcli.model.formulation import Answer
from lcpcli.model.problem import Problem
from lcpcli.rational.numbers import zeros
from lcpcli.report import wording
from lcpcli.report.document import Table
from lcpcli.solving.result import Result, Status
from lcpcli.typing import Vector
from lcpcli.verify.point import Criterion, Point
from lcpcli.verify.verification import Proposed, Verification

SEPARATED = "separated"
STICKING = "sticking"
SLIDING = "sliding"
STATES = (STICKING, SLIDING, SEPARATED)
MAX_CONTACTS = 100  # contacts in a table, a few screens
UNSOLVED = "not solved, so it is not known which contacts slide"
JAMMED = (
    "jammed: no impulses within the cones of friction lead to velocities that the "
    "contacts allow; b is outside what impulses can reach"
)
WITHOUT_SOLUTION = (
    "no impulses satisfy the laws of Signorini and Coulomb, whichever contacts stick, "
    "slide or are separated"
)
NEARLY_JAMMED = (
    "jammed, up to rounding of the matrix: for the matrix as stored there are "
    "impulses, but too large to satisfy the laws of contact to the tolerance"
)
# Impulses within the cones of friction with velocities that the contacts allow exist
# just when the conditions are feasible.
WITHOUT_SOLUTION_BY_STATUS = {
    Status.INFEASIBLE: JAMMED,
    Status.UNSOLVABLE: WITHOUT_SOLUTION,
    Status.ILL_POSED: NEARLY_JAMMED,
}
REASON = "z solves the problem to the tolerance, but x and w = A x + b do not"


@dataclass(frozen=True, eq=False)
class ContactState:
    """The state of a contact.

    normal, tangential : the indices of its unknowns in x, from 0.
    state : "separated" if it has no impulse; else "sticking" if it has no tangential
        velocity, and "sliding" if it has one.
    """

    normal: int
    tangential: list[int]
    state: str


class Impulses(Answer):
    """The impulses and velocities that a solution represents, and what each contact
    does.

    x, w : the impulses or forces, and the velocities A x + b, or W x + q with
        restitution, 0 if they are at the level of rounding errors, in the order of A;
        None, as are the contacts, if the problem is not solved.
    contacts : each contact, in the order of their normal unknowns.
    statement : how many contacts stick, slide and are separated, or why that is not
        known.
    exact : x and w in fractions if z is proved, else None.
    """

    def __init__(
        self,
        x: Vector | None,
        velocities: Callable[[], Vector] | None,
        states: Callable[[], list[ContactState]] | str,
        exact: dict[str, list[Fraction]] | None = None,
    ) -> None:
        """velocities, states : return w and the states of the contacts, which are
        computed when they are first read; or None, and why they are not known."""
        self.x, self.exact = x, exact
        self._velocities, self._states = velocities, states

    @cached_property
    def w(self) -> Vector | None:
        return None if self._velocities is None else self._velocities()

    @cached_property
    def contacts(self) -> list[ContactState] | None:
        return None if isinstance(self._states, str) else self._states()

    @cached_property
    def statement(self) -> str:  # type: ignore[override]
        if isinstance(self._states, str):
            return self._states
        return _statement(self.contacts or [])

    def record(self) -> Mapping[str, Any]:
        names = "x", "w", "contacts", "statement", "exact"
        return {name: getattr(self, name) for name in names}

    def __repr__(self) -> str:
        parts = (f"{name}={value!r}" for name, value in self.record().items())
        return f"{type(self).__name__}({', '.join(parts)})"

    @property
    def _values(self) -> tuple[Sequence[Any], Sequence[Any]]:
        if self.exact is not None:
            return self.exact["x"], self.exact["w"]
        assert self.x is not None
        assert self.w is not None
        return self.x.tolist(), self.w.tolist()

    def tables(self, *, whole: bool = True) -> list[Table]:  # noqa: ARG002
        if not self.contacts:
            return []
        x, w = self._values
        rows = [
            [
                str(number),
                wording.number(x[contact.normal]),
                _numbers(x, contact.tangential),
                wording.number(w[contact.normal]),
                _numbers(w, contact.tangential),
                contact.state,
            ]
            for number, contact in enumerate(self.contacts[:MAX_CONTACTS], 1)
        ]
        notes = []
        if len(self.contacts) > MAX_CONTACTS:
            notes = [f"the first {MAX_CONTACTS} of {len(self.contacts)} contacts"]
        impulses = ["normal", "tangential"]
        velocities = [f"{each} velocity" for each in impulses]
        header = ["contact", *impulses, *velocities, "state"]
        return [Table(header, [rows], (5,), notes=notes)]

    def cells(self) -> Mapping[str, Sequence[Any]]:
        headings = ("impulse", "velocity", "contact")
        if self.contacts is None:
            return dict.fromkeys(headings, ())
        x, w = self._values
        states = [""] * len(x)
        for contact in self.contacts:
            for i in (contact.normal, *contact.tangential):
                states[i] = contact.state
        return dict(zip(headings, (x, w, states), strict=True))


def _numbers(values: Sequence[Any], indices: Sequence[int]) -> str:
    return ", ".join(wording.number(values[i]) for i in indices)


def answer(contact: Contact, result: Result) -> Impulses:
    """Return the impulses and velocities, and what each contact does, if the result is
    solved."""
    if not result.solved:
        why = WITHOUT_SOLUTION_BY_STATUS.get(result.status, UNSOLVED)
        return Impulses(None, None, why)
    motion = motion_at(contact, result.z)
    exact, proved = None, result.exact
    if proved is not None and proved.z and proved.w and contact.is_planar:
        exact = _exactly(contact, proved.z, proved.w)
    states: Callable[[], list[ContactState]]
    states = partial(_states_of_motion, contact, motion, result.tol)
    if exact is not None:
        nothing = [0] * len(motion.w)
        values = list(exact["x"]), list(exact["w"])
        states = partial(_states, contact, *values, nothing, nothing)
    if contact.impact is not None and exact is not None:
        shift = contact.impact.exact_shift(contact.friction.normals)
        exact["w"] = [*map(sub, exact["w"], shift)]
    velocities = partial(_velocities, contact, motion)
    return Impulses(motion.x.copy(), velocities, states, exact)


def _velocities(contact: Contact, motion: Motion) -> Vector:
    """Return w, or W x + q with restitution, with 0 for rounding errors."""
    w = motion.rounded_w()
    return w if contact.impact is None else w - contact.impact.shift


@np.errstate(all="ignore")
def _states_of_motion(
    contact: Contact, motion: Motion, tol: float
) -> list[ContactState]:
    """Return whether each contact is separated, sticks or slides, by impulses and
    velocities to a tolerance."""
    x, rounding = motion.x, tol * motion.terms
    small = _negligible(contact, x, rounding, tol).tolist()
    w = motion.rounded_w().tolist()
    return _states(contact, x.tolist(), w, small, rounding.tolist())


def _negligible(contact: Contact, x: Vector, rounding: Vector, tol: float) -> Vector:
    """Return the size up to which each impulse is considered 0: it changes the
    velocity of its row by no more than rounding, and is small relative to the largest
    impulse. The second condition alone would call a contact separated because of
    another one, however far away.
    """
    diagonal = contact.A.diagonal()
    of_rows = np.where(diagonal > 0, rounding / diagonal, np.inf)
    smallest: Vector = np.minimum(of_rows, tol * abs(x).max(initial=0.0))
    return smallest


class Motion(NamedTuple):
    """Impulses x in the plane or in space, the velocities w = A x + b, and the terms of
    its rows, |A| |x| + |b|, in which a tangential x_t is treated as mu x_f if that is
    larger, as it is the difference of beta and mu x_f in z.
    """

    x: Vector
    w: Vector
    terms: Vector

    @classmethod
    def of_impulses(cls, contact: Contact, x: Vector) -> Motion:
        sizes = abs(x)
        if contact.is_planar:
            friction = contact.friction
            tangents = friction.tangents[:, 0]
            max_friction = friction.coefficients * sizes[friction.normals]
            sizes[tangents] = np.maximum(sizes[tangents], max_friction)
        w = np.asarray(product(contact.A, x) + contact.b)
        return cls(x, w, absolute_product(contact.A, sizes) + abs(contact.b))

    def rounded_w(self) -> Vector:
        """Return w with 0 for rounding errors."""
        return np.where(abs(self.w) <= ROW_ROUNDING * self.terms, 0.0, self.w)


def motion_at(contact: Contact, z: Vector) -> Motion:
    """Return the impulses of a z, with tangential ones projected on their bounds, and
    their velocities; those of the last z are stored, as several functions need them.

    The terms of `Motion` also take rounding errors in x_t = beta - mu x_f into account.
    """
    last_z, motion = contact.last_motion
    if last_z is not z:
        motion = _motion_of(contact, z)
        contact.store_motion(z, motion)
    last_motion: Motion = motion
    return last_motion


@np.errstate(all="ignore")  # overflow gives infinity
def _motion_of(contact: Contact, z: Vector) -> Motion:
    friction = contact.friction
    if not contact.is_planar:
        x = np.asarray(product(contact.T, z))
    else:
        tangents, x = friction.tangents[:, 0], z[: contact.b.size].copy()
        x[tangents] -= friction.coefficients * x[friction.normals]
        max_friction = friction.coefficients * np.maximum(x[friction.normals], 0.0)
        # If lambda > 0, complementarity requires exactly the upper bound.
        at_end = z[contact.b.size :] > 0
        inside = np.minimum(np.maximum(x[tangents], -max_friction), max_friction)
        inside = without_rounding(inside, max_friction)
        x[tangents] = np.where(at_end, max_friction, inside)
    return Motion.of_impulses(contact, x)


def without_rounding(tangential: Vector, max_friction: Vector) -> Vector:
    """Return tangential impulses with 0 where they are only rounding errors of the
    bounds of friction."""
    return np.where(abs(tangential) <= ROUNDING * max_friction, 0.0, tangential)


def _exactly(
    contact: Contact, z: Sequence[Fraction], rows: Sequence[Fraction]
) -> dict[str, list[Fraction]]:
    """Return x and w from an exact z and its rows M z + q: the rows of beta and lambda
    are w + lambda and mu x_f - x_t.
    """
    n = contact.b.size
    x, w = list(z[:n]), list(rows[:n])
    for row, t in enumerate(contact.friction.tangents[:, 0].tolist(), n):
        x[t] = (x[t] - rows[row]) / 2
        w[t] -= z[row]
    return {"x": x, "w": w}


def _states(
    contact: Contact,
    x: Sequence[Any],
    w: Sequence[Any],
    small: Sequence[Any],
    rounding: Sequence[Any],
) -> list[ContactState]:
    """Return whether each contact is separated, sticks or slides.

    small, rounding : the impulses and velocities up to which they are considered 0.
    """
    contact_states, tangents = [], contact.friction.tangents.tolist()
    for normal, *pairs in contact.contacts:
        tangential = [i for pair in pairs for i in tangents[pair]]
        state = STICKING
        if x[normal] <= small[normal]:
            state = SEPARATED
        elif any(abs(w[i]) > rounding[i] for i in tangential):
            state = SLIDING
        contact_states.append(ContactState(normal, tangential, state))
    return contact_states


def _statement(states: Sequence[ContactState]) -> str:
    if not states:
        return ""
    times = Counter(contact.state for contact in states)
    parts = [f"{times[state]} {state}" for state in STATES if times[state]]
    return f"{count(len(states), 'contact')}: {listed(parts)}"


def accepted(contact: Contact, result: Result) -> Result:
    """Return the result if its x and w satisfy the laws of contact to the tolerance,
    otherwise the result with the status stalled.
    """
    if not contact.is_planar or _is_solved(contact, result.z, result.tol):
        return result
    message = Status.STALLED.sentence(REASON)
    return replace(result, status=Status.STALLED, message=message, end=None)


def _is_solved(contact: Contact, z: Vector, tol: float) -> bool:
    """Return whether x solves the mixed problem of A and b with the friction bounds
    that the normal impulses of x imply.
    """
    motion = motion_at(contact, z)
    x, w, terms = motion
    # Almost every result satisfies the conditions up to rounding errors of the system
    # that it solves, which needs no measure, as z has been measured.
    rounding = min(SYSTEM_ROUNDING, tol) * terms
    if number_of(abs(w) <= rounding) == w.size:
        return True
    lower, upper = contact.box(x)
    x = np.minimum(np.maximum(x, lower), upper)
    falls = (w >= -rounding) | (x == upper)
    rises = (w <= rounding) | (x == lower)
    if (falls & rises).all():
        return True
    box = Problem(contact.A, contact.b, lower=lower, upper=upper)
    return bool(Point(Criterion(box, tol), x).solves())


def point_of(contact: Contact, motion: Motion) -> Vector:
    """Return the z of an x in the plane. Its beta and lambda are exactly 0, or beta is
    at its upper limit, if they differ from that only by rounding errors.
    """
    friction = contact.friction
    tangents = friction.tangents[:, 0]
    x = motion.x
    max_friction = friction.coefficients * x[friction.normals]
    w = motion.w[tangents]
    zero = SYSTEM_ROUNDING * motion.terms[tangents]
    beta, slips = x[tangents] + max_friction, np.zeros(w.size)
    if number_of(abs(w) <= zero) < w.size:
        rounding = ROUNDING * max_friction
        beta[(beta <= rounding) & (w > zero)] = 0.0
        is_upper = (beta >= 2 * max_friction - rounding) & (w < -zero)
        beta[is_upper] = 2 * max_friction[is_upper]
        slips = np.where(w < -zero, -w, 0.0)
    z = np.concatenate((x, slips))
    z[tangents] = beta
    return z


@np.errstate(all="ignore")
def verified(contact: Contact, proposed: Proposed) -> Verification:
    """Verify z, or x."""
    if len(proposed.values) == proposed.problem.n or not contact.is_planar:
        return proposed.of_z(proposed.values)
    if proposed.data is None:
        motion = Motion.of_impulses(contact, np.array(proposed.values))
        return proposed.of_z(point_of(contact, motion))
    x = [Fraction(value) for value in proposed.values]
    friction = contact.friction
    data, n = proposed.data, contact.b.size
    z = x + zeros(data.n - n)
    tangents = friction.tangents[:, 0].tolist()
    for t in tangents:
        z[t] = Fraction(0)
    # The row of a lambda is 2 mu x_f - beta, here with beta = 0, which is x_t + mu x_f.
    twice_friction = data.w(z)[n:]
    for t, twice in zip(tangents, twice_friction, strict=True):
        z[t] = x[t] + twice / 2
    w = data.w(z)
    for row, t in enumerate(tangents, n):
        z[row] = max(-w[t], Fraction(0))
    return proposed.of_z(z)
