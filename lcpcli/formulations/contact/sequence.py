"""Contact over time: the problem of the next step, and the basis that follows from the
contacts that persist.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np

from lcpcli.errors import MAKE_AGREE, ProblemError, numbers_for, refuse_unknown
from lcpcli.formulations.contact.friction import (
    Contact,
    of_delassus,
    of_findex,
)
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.model.problem import Problem
from lcpcli.typing import BasisStatus, Indices, Vector

KEYS = {
    "W": ("W", "q", "mu", "restitution", "before", "ids"),
    "findex": ("A", "b", "lower", "upper", "findex", "ids"),
}
ABSENT = -1  # the position of an unknown that does not exist


def following(
    before: Contact, like: Problem, states: BasisStatus | None, data: Mapping[str, Any]
) -> tuple[Problem, BasisStatus | None]:
    """Return the problem with other data, each by default as before, and its basis: the
    statuses before for the unknowns of a contact, or with friction indices an unknown,
    with the same id, and statuses without impulse for new ones.
    """
    refuse_unknown("", data, KEYS[before.key], "the data of contacts")
    contact = _with(before, data)
    number = contact.number_of_ids
    ids = data.get("ids")
    ids_before = range(before.number_of_ids) if before.ids is None else before.ids
    if ids is not None:
        contact = contact.having_ids(_distinct(ids, number, contact.key))
    elif number == len(ids_before):
        contact = contact.having_ids(before.ids)
    else:
        states = None
    problem = contact.problem_after(like, before)
    ids_now = range(number) if contact.ids is None else contact.ids
    have_positions = contact.has_positions_of(before)
    if states is None or (have_positions and ids_now == ids_before):
        return problem, states
    return problem, _transferred_states(
        before, contact, problem, states, (ids_before, ids_now)
    )


def _with(before: Contact, data: Mapping[str, Any]) -> Contact:
    """Return the contacts with other data, each by default as before."""
    friction = before.friction
    if before.key == "W":
        law = before.impact
        W, q = data.get("W", before.A), data.get("q", law.q if law else before.b)
        width = 1 + friction.tangents.shape[1]
        mu = data.get("mu")
        mu = _single(friction.coefficients) if mu is None else mu
        e = data.get("restitution", _single(law.restitution) if law else None)
        velocities = data.get("before", law.before if law else None)
        return of_delassus(W, q, mu, width, before.facets, (e, velocities))
    findex_before = before.findex()
    names = ("A", "b", "lower", "upper", "findex")
    defaults = (before.A, before.b, before.lower, before.upper, findex_before)
    parts = [data.get(name, value) for name, value in zip(names, defaults, strict=True)]
    A, b, lower, upper, findex = parts
    return of_findex(A, b, (lower, upper), findex, ("lower", "upper"))


def _single(values: Vector) -> Vector | float:
    """Return one number if all are equal, so that it is valid for any number of
    contacts.
    """
    return float(values[0]) if np.unique(values).size == 1 else values


def _distinct(ids: Any, number: int, key: str) -> tuple[Hashable, ...]:
    """Return the ids as a tuple, or raise ProblemError."""
    listed = tuple(ids.tolist() if isinstance(ids, np.ndarray) else ids)
    of = "contact" if key == "W" else "unknown"
    if len(listed) != number:
        raise ProblemError(
            "ids", numbers_for(len(listed), "id", number, of), MAKE_AGREE
        )
    first_positions: dict[Hashable, int] = {}
    for i, each in enumerate(listed):
        first = first_positions.setdefault(each, i)
        if first != i:
            reason = f"is {each!r}, as ids[{first}] is"
            raise ProblemError(f"ids[{i}]", reason, f"give each {of} another one")
    return listed


def _positions_of_contacts(contact: Contact) -> Indices:
    """Return the positions in z of the unknowns of each contact, or with friction
    indices of each unknown: a row for each, with ABSENT if it has fewer.
    """
    n, friction = contact.b.size, contact.friction
    k = friction.normals.size
    if contact.key == "findex":
        slips = np.full(n, ABSENT)
        slips[friction.tangents[:, 0]] = n + np.arange(k)
        return np.column_stack((np.arange(n), slips))
    if contact.is_planar:
        slips = n + np.arange(k)
        return np.column_stack((friction.normals, friction.tangents, slips))
    m = contact.facets
    betas = k + np.arange(k * m).reshape(k, m)
    return np.column_stack((np.arange(k), betas, k + k * m + np.arange(k)))


def _transferred_states(
    before: Contact,
    contact: Contact,
    problem: Problem,
    states: BasisStatus,
    ids: tuple[Sequence[Hashable], Sequence[Hashable]],
) -> BasisStatus:
    """Return the basis of a problem from that of the problem before.
    ids : those of before, and of now."""
    low, high = problem.box.vectors(problem.n)
    new = np.full(problem.n, LOWER, dtype=np.int8)
    new[low == -np.inf] = UPPER
    new[(low == -np.inf) & (high == np.inf)] = BASIC
    position_of = {each: i for i, each in enumerate(ids[0])}
    pairs = [
        (position_of[each], i) for i, each in enumerate(ids[1]) if each in position_of
    ]
    if not pairs:
        return new
    old_rows, new_rows = np.array(pairs).T
    source = _positions_of_contacts(before)[old_rows]
    target = _positions_of_contacts(contact)[new_rows]
    both = (source != ABSENT) & (target != ABSENT)
    new[target[both]] = states[source[both]]
    return new
