"""Contact over time: the problem of the next step, and the basis that follows from the
contacts that persist.
"""

from __future__ import annotations

import math
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
    Law,
    law_of_bytes,
    law_of_coefficient,
    of_delassus,
    of_findex,
)
from lcpcli.linalg.matrices import are_equal
from lcpcli.model.arrays import as_square, as_vector, readonly_matrix
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.model.problem import Problem
from lcpcli.typing import BasisStatus, Vector

if TYPE_CHECKING:
    from types import ModuleType

KEYS = {
    "W": ("W", "q", "mu", "restitution", "before", "ids"),
    "findex": ("A", "b", "lower", "upper", "findex", "ids"),
}
LAW = KEYS["findex"][2:5]
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
    has_kernels = fast is not None and before.is_dense_plane and like.box.is_orthant
    contact, is_validated = _with(before, data, has_kernels)
    number = contact.number_of_ids
    ids = data.get("ids")
    if ids is not None:
        if isinstance(ids, np.ndarray):
            ids = ids.tolist()
        if type(ids) is not list and not isinstance(ids, Iterable):
            raise ProblemError("ids", f"is {kind(ids)}", "give a list of ids")
        ids = tuple(ids)
        if number != len(ids) or not _are_same(ids, before.ids):
            _refuse_equal(ids, number, contact.key)
    elif number == before.number_of_ids:
        ids = before.ids
    else:
        states = None
    if contact.ids != ids:
        contact = contact.having(ids=ids)
    problem = contact.problem_after(like, before, None if is_validated else fast)
    if states is None or (ids == before.ids and contact.has_positions_of(before)):
        return problem, states
    both = [
        range(each.number_of_ids) if each.ids is None else each.ids
        for each in (before, contact)
    ]
    return problem, _transferred_states(before, contact, problem, states, both)


def _with(
    before: Contact, data: Mapping[str, Any], has_kernels: bool
) -> tuple[Contact, bool]:
    """Return the contacts with other data, each by default as before, and whether A and
    b are validated: not where kernels do that, as they read all numbers anyway."""
    of_A, of_b = before.fields_of_A_and_b
    impact = before.impact
    A, b = data.get(of_A, before.A), data.get(of_b, impact.q if impact else before.b)
    is_raw = has_kernels and _are_plain(A, b)
    vector = b if is_raw else as_vector(of_b, b)
    law = _law(before, data, vector.size)
    if law is None:
        return _validated(before, data, A, b), True
    if is_raw and law.is_lcp:
        A, b = A.copy(), b.copy()
        A.setflags(write=False)
        b.setflags(write=False)
        return before.having(law, A=A, b=b), False
    matrix = readonly_matrix(as_square(of_A, A, vector.size, of_b)[0], A)
    b = as_vector(of_b, b) if is_raw else vector
    return before.having(law, A=matrix, b=b), True


def _are_plain(A: Any, b: Any) -> bool:
    """Return whether these are arrays of doubles of shapes (n, n) and (n,)."""
    if not type(A) is type(b) is np.ndarray or not A.dtype == b.dtype == np.float64:
        return False
    return A.shape == (b.size, b.size) and b.ndim == 1 and b.size > 0


def _validated(before: Contact, data: Mapping[str, Any], A: Any, b: Any) -> Contact:
    """Return the contacts as the functions for single problems do."""
    friction, impact = before.friction, before.impact
    if before.key == "W":
        width = 1 + friction.tangents.shape[1]
        mu = data.get("mu")
        if mu is None and not friction.coefficients.size and len(b):
            reason = "is not known, as there was no contact in the step before"
            raise ProblemError("mu", reason, "give it with the contacts that come")
        mu = _single(friction.coefficients) if mu is None else mu
        e = data.get("restitution", _single(impact.restitution) if impact else None)
        velocities = data.get("before", impact.before if impact else None)
        return of_delassus(A, b, mu, width, before.facets, (e, velocities))
    lower, upper, findex = (data.get(name, getattr(before, name)) for name in LAW)
    return of_findex(A, b, (lower, upper), findex, ("lower", "upper"))


def _law(before: Contact, data: Mapping[str, Any], n: int) -> Law | None:
    """Return the law of n unknowns if it needs no validation, or is stored; None with
    restitution, and for other data than arrays and a float."""
    if before.key == "findex":
        pairs = ((data.get(name), getattr(before, name)) for name in LAW)
        arrays = [old if value is None else value for value, old in pairs]
        are_arrays = (
            type(each) is np.ndarray and each.shape == (n,) for each in arrays
        )
        if not (n and all(are_arrays)):
            return None
        lower, upper, findex = arrays
        are_doubles = lower.dtype == upper.dtype == np.float64
        if not (are_doubles and findex.dtype.kind in "fi"):
            return None
        contents = (each.tobytes() for each in arrays)
        return law_of_bytes(*contents, findex.dtype.str)
    impacts = before.impact, data.get("restitution"), data.get("before")
    width = 1 + before.friction.tangents.shape[1]
    if any(each is not None for each in impacts) or n % width:
        return None
    mu, coefficients = data.get("mu"), before.friction.coefficients
    if isinstance(mu, float) and 0 <= mu < math.inf:
        return law_of_coefficient(mu, n // width, width)
    has_size = coefficients.size * width == n
    if not (has_size and (mu is None or _is_same(mu, coefficients))):
        return None
    return Law(before.friction, before.lower, before.upper, is_lcp=True)


def _is_same(value: Any, before: Vector) -> bool:
    """Return whether a value is an array with these numbers."""
    return value is before or (
        type(value) is np.ndarray
        and value.dtype.kind in "fi"
        and are_equal(value, before)
    )


def _are_same(ids: tuple[Any, ...], before: tuple[Hashable, ...] | None) -> bool:
    """Return whether ids are those of before, which can be hashed."""
    try:
        return ids == before
    except ValueError:  # arrays, which are compared entry by entry
        return False


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
            first = first_positions.setdefault(each, i)
        except TypeError:
            raise ProblemError(
                f"ids[{i}]", f"is {kind(each)}", "give a number or a text"
            ) from None
        if first != i:
            reason = f"is {each!r}, as ids[{first}] is"
            raise ProblemError(f"ids[{i}]", reason, f"give each {of} another one")


def _positions_of_contacts(contact: Contact) -> list[list[int]]:
    """Return the positions in z of the unknowns of each contact, or with friction
    indices of each unknown, with ABSENT for one that does not exist."""
    n, friction = contact.b.size, contact.friction
    normals, k = friction.normals.tolist(), friction.normals.size
    if not contact.is_planar:
        m = contact.facets
        betas = np.arange(k, k + k * m).reshape(k, m).tolist()
        return [[i, *betas[i], k + k * m + i] for i in range(k)]
    tangents = friction.tangents[:, 0].tolist()
    if contact.key == "W":
        return [*map(list, zip(normals, tangents, range(n, n + k), strict=True))]
    slips = [ABSENT] * n
    for slip, t in enumerate(tangents, n):
        slips[t] = slip
    return [*map(list, enumerate(slips))]


def _transferred_states(
    before: Contact,
    contact: Contact,
    problem: Problem,
    states: BasisStatus,
    ids: Sequence[Sequence[Hashable]],
) -> BasisStatus:
    """Return the basis of a problem from that of the problem before.
    ids : those of before, and of now."""
    new, statuses = [LOWER] * problem.n, states.tolist()
    if not problem.box.is_orthant:
        low, high = problem.box.vectors(problem.n)
        without_lower = np.where(high == np.inf, BASIC, UPPER)
        new = np.where(low == -np.inf, without_lower, LOWER).tolist()
    position_of = {each: i for i, each in enumerate(ids[0])}
    sources = _positions_of_contacts(before)
    for each, targets in zip(ids[1], _positions_of_contacts(contact), strict=True):
        i = position_of.get(each)
        if i is None:
            continue
        for source, target in zip(sources[i], targets, strict=True):
            if source != ABSENT != target:
                new[target] = statuses[source]
    return np.array(new, dtype=np.int8)
