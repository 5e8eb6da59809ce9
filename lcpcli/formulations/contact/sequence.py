"""Contact over time: the problem of the next step, and the basis that follows from the
contacts that persist.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.errors import (
    MAKE_AGREE,
    ProblemError,
    kind,
    numbers_for,
    refuse_unknown,
)
from lcpcli.formulations.contact.friction import (
    Contact,
    of_delassus,
    of_findex,
    same_coefficients,
)
from lcpcli.linalg.matrices import are_equal
from lcpcli.model.arrays import as_square, as_vector, readonly_matrix
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.model.problem import Problem
from lcpcli.typing import BasisStatus, Indices, Vector

if TYPE_CHECKING:
    from types import ModuleType

KEYS = {
    "W": ("W", "q", "mu", "restitution", "before", "ids"),
    "findex": ("A", "b", "lower", "upper", "findex", "ids"),
}
ABSENT = -1  # the position of an unknown that does not exist


def following(
    before: Contact,
    like: Problem,
    states: BasisStatus | None,
    data: Mapping[str, Any],
    fast: ModuleType | None = None,
) -> tuple[Problem, BasisStatus | None]:
    """Return the problem with other data, each by default as before, and its basis: the
    statuses before for the unknowns of a contact, or with friction indices an unknown,
    with the same id, and statuses without impulse for new ones.
    """
    refuse_unknown("", data, KEYS[before.key], "the data of contacts")
    if not (before.is_dense_plane and like.box.is_orthant):
        fast = None
    contact = _with(before, data, has_kernels=fast is not None)
    number = contact.number_of_ids
    ids = data.get("ids")
    if ids is not None:
        if isinstance(ids, np.ndarray):
            ids = ids.tolist()
        if type(ids) is not list and not isinstance(ids, Iterable):
            raise ProblemError("ids", f"is {kind(ids)}", "give a list of ids")
        ids = tuple(ids)
        if ids != before.ids or number != len(ids):
            _refuse_equal(ids, number, contact.key)
    elif number == before.number_of_ids:
        ids = before.ids
    else:
        states = None
    if contact.ids != ids:
        contact = contact.having(ids=ids)
    problem = contact.problem_after(like, before, fast)
    if states is None or (ids == before.ids and contact.has_positions_of(before)):
        return problem, states
    both = [
        range(each.number_of_ids) if each.ids is None else each.ids
        for each in (before, contact)
    ]
    return problem, _transferred_states(before, contact, problem, states, both)


def _with(before: Contact, data: Mapping[str, Any], has_kernels: bool) -> Contact:
    """Return the contacts with other data, each by default as before. has_kernels :
    whether a kernel is to find numbers that are not finite.
    """
    friction, law = before.friction, before.impact
    of_A, of_b = KEYS[before.key][:2]
    A, b = data.get(of_A, before.A), data.get(of_b, law.q if law else before.b)
    if _has_same_law(before, data):
        if has_kernels and _has_form_of(A, before.A) and _has_form_of(b, before.b):
            A, b = A.copy(), b.copy()
            A.setflags(write=False)
            b.setflags(write=False)
            return before.having(A=A, b=b)
        vector = as_vector(of_b, b)
        if vector.size == before.b.size:
            matrix = as_square(of_A, A, vector.size, of_b)[0]
            return before.having(A=readonly_matrix(matrix, A), b=vector)
    if before.key == "W":
        width = 1 + friction.tangents.shape[1]
        mu = data.get("mu")
        mu = _single(friction.coefficients) if mu is None else mu
        e = data.get("restitution", _single(law.restitution) if law else None)
        velocities = data.get("before", law.before if law else None)
        return of_delassus(A, b, mu, width, before.facets, (e, velocities))
    defaults = {"lower": before.lower, "upper": before.upper, "findex": before.findex}
    lower, upper, findex = (data.get(name, defaults[name]) for name in defaults)
    return of_findex(A, b, (lower, upper), findex, ("lower", "upper"))


def _has_form_of(value: Any, before: Vector) -> bool:
    """Return whether a value is an array of doubles of this shape."""
    is_array = type(value) is np.ndarray and value.dtype == np.float64
    return is_array and value.shape == before.shape


def _has_same_law(before: Contact, data: Mapping[str, Any]) -> bool:
    """Return whether these data have the bounds and the friction of before, and no
    restitution."""
    if before.key == "findex":
        defaults: tuple[Any, ...] = before.lower, before.upper, before.findex
        pairs = zip(map(data.get, KEYS["findex"][2:]), defaults, strict=False)
        return all(value is None or _is_same(value, old) for value, old in pairs)
    law, mu = (before.impact, *map(data.get, KEYS["W"][3:5])), data.get("mu")
    coefficients = before.friction.coefficients
    has_mu = mu is None or (
        same_coefficients(mu, coefficients.size) is coefficients
        if type(mu) is float
        else _is_same(mu, coefficients)
    )
    return has_mu and law == (None, None, None)


def _is_same(value: Any, before: Any) -> bool:
    """Return whether a value is an array with these numbers."""
    if type(value) is not np.ndarray or value.dtype.kind not in "fi":
        return False
    # This takes a third of the time of the comparison by numbers.
    if value.dtype == before.dtype and value.tobytes() == before.tobytes():
        return bool(value.shape == before.shape)
    return are_equal(value, before)


def _single(values: Vector) -> Vector | float:
    """Return one number if all are equal, so that it is valid for any number of
    contacts.
    """
    return float(values[0]) if np.unique(values).size == 1 else values


def _refuse_equal(ids: tuple[Hashable, ...], number: int, key: str) -> None:
    """Raise ProblemError if two ids are equal, or there are not as many as things."""
    of = "contact" if key == "W" else "unknown"
    if len(ids) != number:
        raise ProblemError("ids", numbers_for(len(ids), "id", number, of), MAKE_AGREE)
    first_positions: dict[Hashable, int] = {}
    for i, each in enumerate(ids):
        try:
            hash(each)
        except TypeError:
            raise ProblemError(
                f"ids[{i}]", f"is {kind(each)}", "give a number or a text"
            ) from None
        first = first_positions.setdefault(each, i)
        if first != i:
            reason = f"is {each!r}, as ids[{first}] is"
            raise ProblemError(f"ids[{i}]", reason, f"give each {of} another one")


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
    ids: Sequence[Sequence[Hashable]],
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
