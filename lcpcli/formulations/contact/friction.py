"""Contact with Coulomb friction from the data of engineering programs: A, b, lo, hi and
findex, as in ODE, Bullet and DART, or a Delassus matrix W, q and mu, as in Siconos.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property, lru_cache
from operator import add
from types import ModuleType
from typing import Any, ClassVar, NamedTuple

import numpy as np

from lcpcli.errors import IS_MISSING, MAKE_AGREE, ProblemError, count, refuse_unknown
from lcpcli.files import fields as files
from lcpcli.files.json_format import sparse_matrix
from lcpcli.formulations.contact import cones
from lcpcli.formulations.contact.cones import Form, Friction
from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.matrices import are_equal, compressed, is_sparse, product
from lcpcli.model.arrays import (
    FROM_0,
    as_flat,
    as_square,
    as_vector,
    by_label,
    plain,
    readonly_copy,
    readonly_matrix,
    refuse_infinite,
)
from lcpcli.model.box import as_bound, as_intervals
from lcpcli.model.formulation import (
    FULL,
    Conditions,
    Formulation,
    Proposal,
)
from lcpcli.model.formulations import TEXTS
from lcpcli.model.problem import LABELS, Facts, Problem
from lcpcli.model.right_hand_sides import like_with
from lcpcli.rational.numbers import rounded, shortest_decimal, zeros
from lcpcli.typing import BasisStatus, BoundLike, Indices, Matrix, Vector, VectorLike

NONE = -1  # in findex: an unknown that is not tangential
FACETS = 8
MAX_FACETS = 1000  # with as many, friction is too small by 5e-6
# M and q belong to contacts if they differ from their matrices by at most this,
# relative to the largest entry.
ROUNDING = 64 * EPS
NAME_NORMAL = f"give the index of a normal unknown, or {NONE} for none {FROM_0}"
FROM_ZERO = f"give a number from 0 {FROM_0}"
# What a contact stores that depends on A and b, and on its friction.
OF_A_AND_B = "_form", "last_motion", "last_system"
OF_FRICTION = "findex", "contacts"
FILE_KEYS = {
    "findex": ("A", "b", "lo", "hi", "findex"),
    "W": ("W", "q", "mu", "dimension", "facets", "restitution", "before"),
}


def from_findex(
    A: Any,
    b: VectorLike,
    lower: BoundLike,
    upper: BoundLike,
    findex: Any,
    *,
    lagged: bool = False,
    name: str = "",
    source: str = "",
    note: str = "",
) -> Problem:
    """Return the problem of contact with friction for bounds and friction indices: find
    x in its bounds with w = A x + b, w_i >= 0 where x_i is below its upper bound, and
    w_i <= 0 where it is above its lower one.

    A : shape (n, n), dense or sparse; symmetric and positive semidefinite if it is the
        inverse mass at the contacts. b : shape (n,). A x is a velocity or an
        acceleration, x an impulse or a force.
    lower, upper : each a number or of shape (n,), infinite for no bound.
    findex : shape (n,), -1, or the index f of a normal unknown; then x_i is tangential,
        upper_i = -lower_i is its coefficient of friction mu, and -mu x_f <= x_i <=
        mu x_f. x_f itself must not be tangential, and its lower bound is at least 0.
    lagged : whether to return the model of engines, not the law: the bounds of friction
        are mu times the normal x of the box before, first without friction, until they
        no longer change or MAX_BOXES boxes are solved, which nothing guarantees. The
        result is the last box, with x as its z, and its note says how it ended.
    name, source, note : texts of the problem.

    ODE and DART hold A x = b + w: give them as from_findex(A, -b, lo, hi, findex). With
    -1 everywhere this is the mixed problem with M = A and q = b. Otherwise it is
    exactly the law of Coulomb, not a box from the step before; its matrix need not be
    copositive, so that Lemke's method may terminate on a ray, whatever A is.
    `Result.answer` has x, w, and whether each contact is separated, sticks or slides.
    Raises ProblemError, which names the entry at fault.

    >>> import lcpcli
    >>> from math import inf
    >>> A, b = [[1, 0.2], [0.2, 2]], [-1, -3]
    >>> problem = lcpcli.from_findex(A, b, [0, -0.5], [inf, 0.5], [-1, 0])
    >>> answer = lcpcli.run(problem).answer
    >>> answer.x.round(6).tolist(), [each.state for each in answer.contacts]
    ([0.909091, 0.454545], ['sliding'])
    """
    contact = of_findex(A, b, (lower, upper), findex, ("lower", "upper"))
    if lagged:
        problem: Problem = contact.sibling("boxes").last_box(
            contact, name, source, note
        )
        return problem
    return contact.problem(name=name, source=source, note=note)


def from_contact(
    W: Any,
    q: VectorLike,
    mu: float | VectorLike,
    *,
    dimension: int = 2,
    facets: int = FACETS,
    restitution: float | VectorLike | None = None,
    before: VectorLike | None = None,
    name: str = "",
    source: str = "",
    note: str = "",
) -> Problem:
    """Return the problem of contact with friction for a Delassus matrix: find impulses
    r with velocities u = W r + q, by the laws of Signorini and Coulomb.

    W : shape (n, n), dense or sparse, with rows and columns by contacts: normal and
        tangential, in three dimensions normal and two tangential ones.
    q : shape (n,), the velocities at the contacts without impulses.
    mu : the coefficient of friction, a number or one for each contact.
    dimension : 2 or 3. In the plane the problem is exact.
    facets : in three dimensions, the even number of edges, from 4 to 1000, of a polygon
        in the circle of Coulomb, that replaces it; friction is too small by at most the
        share 1 - cos(pi / facets), by 8 percent for 8.
    restitution, before : for Newton's law of impact the coefficient e, from 0 to 1, a
        number or one for each contact, and the velocities u at the contacts before the
        step, shape (n,): normal velocities after it are at least -e times those before.
    name, source, note : texts of the problem.

    `Result.answer` has the impulses x and the velocities w in this order, and whether
    each contact is separated, sticks or slides. Raises ProblemError, which names the
    entry at fault.

    >>> import lcpcli
    >>> W = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> problem = lcpcli.from_contact(W, [-1, -0.2, 0.1], 0.5, dimension=3)
    >>> answer = lcpcli.run(problem).answer
    >>> answer.x.round(6).tolist(), answer.contacts[0].state
    ([1.0, 0.2, -0.1], 'sticking')
    """
    contact = of_delassus(W, q, mu, dimension, facets, (restitution, before))
    return contact.problem(name=name, source=source, note=note)


class Impact(NamedTuple):
    """Newton's law of impact: q without it, the coefficients of restitution, shape
    (k,), and the velocities before the step; b = q + shift.
    """

    q: Vector
    restitution: Vector
    before: Vector
    shift: Vector

    def exact_shift(self, normals: Indices) -> list[Fraction]:
        """Return b - q for the shortest decimals of the numbers: .1 times 3 is .3."""
        shift = zeros(self.q.size)
        before = self.before.tolist()
        for f, e in zip(normals.tolist(), self.restitution.tolist(), strict=True):
            shift[f] = shortest_decimal(e) * shortest_decimal(before[f])
        return shift


@dataclass(frozen=True, eq=False)
class Contact(Formulation):
    """The data of a problem of contact with friction.

    A, b, lower, upper : as in `from_findex`, or W and q, without bounds of tangential
        unknowns. friction : which unknowns are tangential.
    facets : the number of directions of friction, 2 in the plane.
    key : "findex" or "W", the key by which a file is recognized.
    ids : of the contacts, or of the unknowns of findex, in a sequence; None for their
        indices.
    impact : the addition to q by Newton's law of impact; None without restitution.
    """

    A: Matrix
    b: Vector
    lower: Vector
    upper: Vector
    friction: Friction
    facets: int
    key: str
    ids: tuple[Hashable, ...] | None = None
    impact: Impact | None = None
    # The last z of which impulses and velocities were computed, and these.
    last_motion: ClassVar[tuple[Any, Any]] = None, None

    kind = "contact"
    form = "written as the complementarity problem of the contacts,"
    inverse = "answers"
    is_of_doubles = True
    left_out = ("contacts",)

    @classmethod
    def of_fields(cls, fields: Mapping[str, Any]) -> Problem:
        key = "findex" if "findex" in fields else "W"
        keys = FILE_KEYS[key]
        files.refuse_unknown("", fields, (*keys, *TEXTS), "a problem of contact")
        texts = files.without_nulls({key: fields.get(key) for key in TEXTS})
        return cls.parse({key: fields[key] for key in keys if key in fields}).problem(
            **texts
        )

    @classmethod
    def parse(cls, data: Mapping[str, Any]) -> Contact:
        key = "findex" if "findex" in data else "W"
        keys = FILE_KEYS[key]
        refuse_unknown("", data, ("kind", *keys))
        arguments = {key: data[key] for key in keys if data.get(key) is not None}
        needed = {"findex": ("A", "b", "findex"), "W": ("W", "q", "mu")}[key]
        for each in needed:
            if each not in arguments:
                raise ProblemError(each, IS_MISSING, f"add the key {each}")
        matrix = arguments.pop(keys[0])
        if isinstance(matrix, Mapping):
            matrix = sparse_matrix(keys[0], dict(matrix))
        if key == "findex":
            bounds = arguments.get("lo"), arguments.get("hi")
            return of_findex(
                matrix, arguments["b"], bounds, arguments["findex"], ("lo", "hi")
            )
        dimension = arguments.get("dimension", 2)
        facets = arguments.get("facets", FACETS)
        law = arguments.get("restitution"), arguments.get("before")
        return of_delassus(
            matrix, arguments["q"], arguments["mu"], dimension, facets, law
        )

    def data(self) -> dict[str, Any]:
        return {"kind": self.kind} | {
            key: _listed(value) for key, value in self._fields().items()
        }

    def fields(
        self,
        problem: Problem,  # noqa: ARG002
        *,
        in_text: bool,  # noqa: ARG002
    ) -> dict[str, Any]:
        return self._fields()

    def _fields(self) -> dict[str, Any]:
        friction = self.friction
        if self.key == "W":
            mu, width = friction.coefficients, 1 + friction.tangents.shape[1]
            fields = {"W": self.A, "q": self.b, "mu": mu, "dimension": width}
            fields |= {"facets": self.facets} if width > 2 else {}
            law = self.impact
            if law is None:
                return fields
            impact = {"restitution": law.restitution, "before": law.before}
            return fields | {"q": law.q} | impact
        bounds = {"lo": self.lower, "hi": self.upper}
        findex = self.findex.astype(np.float64)
        return {"A": self.A, "b": self.b, **bounds, "findex": findex}

    @cached_property
    def findex(self) -> Indices:
        """Return the friction indices."""
        findex = np.full(self.b.size, NONE)
        findex[self.friction.tangents[:, 0]] = self.friction.normals
        findex.setflags(write=False)
        return findex

    def problem(self, **texts: Any) -> Problem:
        """Return the problem, with these texts."""
        M, q, lower, upper = self._form.conditions
        bounds: dict[str, Any] = {"lower": lower, "upper": upper}
        if lower.size and not lower.any() and upper.min() == math.inf:
            bounds = {}  # those of an LCP, which need no check
        try:
            problem = Problem(M, q, **bounds, **texts)
        except ProblemError:
            self._finite(self._form)
            raise
        # This skips the check of `Problem` that the formulation fits M and q.
        return Problem.of_fields(vars(problem), origin=self)

    @property
    def fields_of_A_and_b(self) -> tuple[str, str]:
        return ("W", "q") if self.key == "W" else ("A", "b")

    @property
    def number_of_ids(self) -> int:
        """Return of how many contacts, or with friction indices unknowns, it is."""
        if self.key == "findex":
            return self.b.size
        return self.friction.normals.size

    def having(self, law: Law | None = None, **fields: Any) -> Contact:
        """Return the same contacts with another A, b and ids, and perhaps another law,
        which nothing validates, before anything is computed of them."""
        contact = Contact.__new__(Contact)
        values = vars(contact)
        values.update(vars(self), **fields)
        for name in OF_A_AND_B:
            values.pop(name, None)
        if law is not None and law.friction is not self.friction:
            values.update(friction=law.friction, lower=law.lower, upper=law.upper)
            for name in OF_FRICTION:
                values.pop(name, None)
        return contact

    def has_positions_of(self, other: Contact) -> bool:
        """Return whether each unknown of z is that of the same unknown of another
        one's x."""
        friction, before = self.friction, other.friction
        is_like = self.b.size == other.b.size and self.facets == other.facets
        return is_like and are_equal(friction.tangents, before.tangents)

    def has_law_of(self, other: Contact) -> bool:
        """Return whether the friction and the bounds are those of another one."""
        if self.friction is other.friction:
            return True
        parts = (*self.friction, self.lower, self.upper)
        others = (*other.friction, other.lower, other.upper)
        return all(map(are_equal, parts, others))

    @property
    def is_dense_plane(self) -> bool:
        """Return whether these are contacts in the plane with friction and dense A, for
        whose sequences there is a special method."""
        has_friction = self.is_planar and self.friction.normals.size > 0
        return has_friction and type(self.A) is np.ndarray

    def _problem_by_kernel(
        self, like: Problem, before: Contact, fast: ModuleType
    ) -> Problem | None:
        """Return the problem after another one, with the M that a kernel computes; None
        if a number is not finite, or the kernel cannot be loaded."""
        facts: Facts = like.facts
        contacts = self.A, self.b, *self.friction
        has_law = self.has_law_of(before)
        A_before = before.A if has_law else None
        form = fast.compact_form(contacts, A_before, facts.near_base)
        if form is None:
            return None
        M, q, sizes_of_M, sizes_of_q, change = form
        next_facts = None if M is None else facts.after(M, sizes_of_M, change)
        problem = like_with(like, q, like.box, M, next_facts, sizes_of_q)
        if not has_law:
            for label in LABELS:
                vars(problem).pop(label, None)
        vars(problem)["origin"] = self
        return problem

    def problem_after(
        self, like: Problem, before: Contact, fast: ModuleType | None = None
    ) -> Problem:
        """Return the problem after another one, of the contacts before: with its M and
        all cached facts about M if they differ at most in b.

        fast : the module of the kernels for contacts in the plane with dense A, with
            the conditions of an LCP, whose A and b are not validated; else None."""
        if fast is not None:
            problem = self._problem_by_kernel(like, before, fast)
            if problem is not None:
                return problem
            refuse_infinite(self.fields_of_A_and_b[1], self.b)
            refuse_infinite(self.fields_of_A_and_b[0], self.A)
        vars(self)["last_system"] = [*before.last_system]
        is_dense = type(self.A) is type(before.A) is np.ndarray
        if not (is_dense and self.has_law_of(before)):
            return self.problem()
        origin: Any = like.formulation
        if are_equal(self.A, before.A):
            problem = like_with(like, self._share_form(origin._form), like.box)
        elif self.is_planar:
            form = vars(self)["_form"] = self._compact(origin._form)
            M, q = form.conditions[:2]
            problem = like_with(like, q, like.box, M)
            if not problem.largest < math.inf:
                self._finite(form)
        else:
            return self.problem()
        vars(problem)["origin"] = self
        return problem

    def _share_form(self, form: Form) -> Vector:
        """Take over the form of contacts that differ only in b, instead of computing it
        again, and return its q.
        """
        if self.is_planar:
            q = np.concatenate((self.b, form.conditions.q[self.b.size :]))
            q.setflags(write=False)
        else:
            q = as_vector("q", form.T.T @ self.b)
        conditions = form.conditions._replace(q=q)
        vars(self)["_form"] = form._replace(conditions=conditions)
        return conditions.q

    def store_motion(self, z: Vector, motion: Any) -> None:
        """Store the impulses and velocities of a z until those of another one come."""
        vars(self)["last_motion"] = z, motion

    @cached_property
    def last_system(self) -> list[Any]:
        """Return the inverse that the last step of contacts used, and of what, to be
        replaced by others."""
        return [None, None]

    @property
    def is_planar(self) -> bool:
        return self.friction.tangents.shape[1:] == (1,)

    @cached_property
    def _form(self) -> Form:
        return self._compact() if self.is_planar else self.stewart_trinkle()

    @np.errstate(over="ignore", invalid="ignore")
    def _compact(self, before: Form | None = None) -> Form:
        parts = self.A, self.b, self.lower, self.upper, self.friction
        return cones.compact(*parts, before)

    def stewart_trinkle(self) -> Form:
        """Return the form of Stewart and Trinkle, which may have another M."""
        parts = self.A, self.b, self.lower, self.upper, self.friction
        polygon = cones.polygon(self.facets)
        with np.errstate(over="ignore", invalid="ignore"):
            return self._finite(cones.stewart_trinkle(*parts, polygon))

    def _finite(self, form: Form) -> Form:
        """Return a form, or raise ProblemError if M or q has overflowed."""
        M, q = form.conditions.M, form.conditions.q
        entries = M.data if is_sparse(M) else M
        if np.isfinite(entries).all() and np.isfinite(q).all():
            return form
        reason = "exceeds the double-precision range in products with the coefficients"
        A, b = self.fields_of_A_and_b
        hint = f"scale {A} and {b}, or give smaller coefficients of friction"
        raise ProblemError(A, f"{reason} of friction", hint)

    @property
    def T(self) -> Matrix:
        """Return T with x = T z."""
        return self._form.T

    def box(self, x: Vector) -> tuple[Vector, Vector]:
        """Return the bounds of x in the plane, with the friction bounds for the normal
        components of x.
        """
        friction = self.friction
        lower = self.lower.copy()
        upper = self.upper.copy()
        tangents = friction.tangents[:, 0]
        max_friction = friction.coefficients * np.maximum(x[friction.normals], 0.0)
        lower[tangents], upper[tangents] = -max_friction, max_friction
        return lower, upper

    def fits(self, conditions: Conditions) -> bool:
        expected = self._form.conditions
        if conditions.M.shape != expected.M.shape or not all(
            map(np.array_equal, conditions[2:], expected[2:])
        ):
            return False
        off = abs(compressed(conditions.M) - compressed(expected.M)).max()
        off_q = abs(conditions.q - expected.q).max()
        size, size_q = abs(expected.M).max(), abs(expected.q).max()
        return bool(off <= ROUNDING * size and off_q <= ROUNDING * size_q)

    def of_conditions(self, conditions: Conditions) -> Contact | None:
        """Return the contacts with the b that yields this q; None if no b does, or for
        other bounds.
        """
        form = self._form
        if not all(map(np.array_equal, conditions[2:], form.conditions[2:])):
            return None
        if self.is_planar:
            b = conditions.q[: self.b.size]
        else:
            # q = T'b, where the rows of T are orthogonal: the directions of friction
            # are the vertices of a regular polygon.
            b = product(form.T, conditions.q) / (form.T * form.T).sum(axis=1)
        b = as_vector("b", b)
        impact = self.impact
        if impact is not None:
            impact = impact._replace(q=as_vector("q", b - impact.shift))
        contact = replace(self, b=b, impact=impact)
        q = contact._share_form(form)
        off = abs(q - conditions.q).max(initial=0.0)
        return contact if off <= ROUNDING * abs(q).max(initial=0.0) else None

    def exact_conditions(
        self, number: Callable[[float], Fraction] = shortest_decimal
    ) -> tuple[Any, ...] | None:
        """Return the conditions for the exact numbers of all floats; None in space,
        where the directions are no rational numbers.
        """
        if not self.is_planar:
            return None
        impact = self.impact
        b = [*map(number, (self.b if impact is None else impact.q).tolist())]
        if impact is not None:
            for key, values in (
                ("restitution", impact.restitution),
                ("before", impact.before),
            ):
                for i, value in enumerate(values.tolist()):
                    if number(value) != shortest_decimal(value):
                        reason = "has more digits than a double"
                        raise ProblemError(f"{key}[{i}]", reason, "round it")
            b = [*map(add, b, impact.exact_shift(self.friction.normals))]
        return cones.exact_compact(
            self.A, b, (self.lower, self.upper), self.friction, number
        )

    @cached_property
    def contacts(self) -> list[list[int]]:
        """Return the normal unknown of each contact, and its pairs or triples in
        `friction`, in the order of the normal unknowns."""
        members: dict[int, list[int]] = {}
        for k, normal in enumerate(self.friction.normals.tolist()):
            members.setdefault(normal, [normal]).append(k)
        return [members[normal] for normal in sorted(members)]

    def names(self, n: int, purpose: str = FULL) -> Sequence[str]:  # noqa: ARG002
        if self.key == "findex":
            names = [f"x{i}" for i in range(1, self.b.size + 1)]
            for k, (tangent,) in enumerate(self.friction.tangents.tolist()):
                names.append(f"slip {names[tangent]}")
                normal = names[self.friction.normals[k]]
                names[tangent] += f" + {self.friction.coefficients[k]:g} {normal}"
            return names
        k, width = len(self.contacts), 1 if self.is_planar else self.facets
        numbers = range(1, k + 1)
        slips = [f"slip {i}" for i in numbers]
        if self.is_planar:
            pairs = ((f"normal {i}", f"tangential {i} + mu normal") for i in numbers)
            return [*(name for pair in pairs for name in pair), *slips]
        sides = [f"tangential {i}.{j + 1}" for i in numbers for j in range(width)]
        return [*(f"normal {i}" for i in numbers), *sides, *slips]

    def accepted(self, result: Any) -> Any:
        return self.sibling("answers").accepted(self, result)

    def lengths(self, problem: Problem) -> dict[int, str]:
        return {problem.n: "z", self.b.size: "x"}

    def retried(self, result: Any) -> Any:
        return self.sibling("other_form").retried(self, result)

    def in_other_form(self, problem: Problem, stage_of: Any) -> Any:
        if not (self.is_planar and self.contacts):
            return None
        return self.sibling("other_form").iterates(self, problem, stage_of)

    def update(
        self,
        like: Problem,
        states: BasisStatus | None,
        data: Mapping[str, Any],
        fast: ModuleType | None = None,
    ) -> tuple[Problem, BasisStatus | None]:
        next_problem: tuple[Problem, BasisStatus | None]
        following = self.sibling("sequence").following
        next_problem = following(self, like, states, data, fast)
        return next_problem

    def followed(
        self,
        problem: Problem,
        states: BasisStatus,
        tol: float,
        fast: ModuleType | None = None,
    ) -> Proposal | None:
        followed = self.sibling("states").followed
        proposal: Proposal | None = followed(self, problem, states, tol, fast)
        return proposal


def of_findex(
    A: Any,
    b: Any,
    bounds: tuple[Any, Any],
    findex: Any,
    fields: tuple[str, str],
) -> Contact:
    """Return the contacts of these data; raise ProblemError if they are invalid. fields
    : the names of the bounds in messages.
    """
    of, (lower, upper) = "the columns of A", bounds
    A, b, lower, upper = by_label(A, of, A=A, b=b, lower=lower, upper=upper)
    bounds = lower, upper
    b = as_vector("b", b)
    n = b.size
    matrix = readonly_matrix(as_square("A", A, n, "b")[0], A)
    law = _law_of_findex(bounds, findex, fields, n)
    return Contact(matrix, b, law.lower, law.upper, law.friction, 2, "findex")


class Law(NamedTuple):
    """Friction, and the bounds of all unknowns. is_lcp : whether unknowns that are not
    tangential have the bounds 0 and infinity."""

    friction: Friction
    lower: Vector
    upper: Vector
    is_lcp: bool


def _law_of_findex(
    bounds: tuple[Any, Any], findex: Any, fields: tuple[str, str], n: int
) -> Law:
    normal_of = _friction_indices(findex, n)
    tangents = np.flatnonzero(normal_of >= 0)
    normals = normal_of[tangents]
    # In separate memory, as the caller may write the bounds of the next step in theirs.
    lower, upper = map(readonly_copy, as_intervals(fields, *bounds, n))
    for t, f in zip(tangents.tolist(), normals.tolist(), strict=True):
        _refuse_friction(t, f, lower, upper, fields)
    friction = Friction(normals, tangents[:, np.newaxis], upper[tangents])
    for array in friction:
        array.setflags(write=False)
    others = normal_of < 0
    is_lcp = not lower[others].any() and bool((upper[others] == math.inf).all())
    return Law(friction, lower, upper, is_lcp)


@lru_cache(maxsize=16)  # as in a sequence they are often the same
def law_of_bytes(lower: bytes, upper: bytes, findex: bytes, kind: str) -> Law:
    """Return the law of arrays with these bytes: two of doubles, and one of a kind of
    numbers, as numpy names it."""
    bounds = np.frombuffer(lower), np.frombuffer(upper)
    indices = np.frombuffer(findex, np.dtype(kind))
    return _law_of_findex(bounds, indices, ("lower", "upper"), indices.size)


def _refuse_friction(
    t: int, f: int, lower: Vector, upper: Vector, fields: tuple[str, str]
) -> None:
    """Raise ProblemError if the bounds of a tangential unknown and of its normal one
    are not those of friction.
    """
    below, above = fields
    mu = upper[t]
    if mu == math.inf:
        hint = f"give a finite one, or findex {NONE} for no limit {FROM_0}"
        reason = "is infinite, but findex makes it a coefficient of friction"
        raise ProblemError(f"{above}[{t}]", reason, hint)
    if mu < 0:
        reason = f"is {mu:g}, but findex makes it a coefficient of friction"
        raise ProblemError(f"{above}[{t}]", reason, FROM_ZERO)
    if lower[t] != -mu:
        reason = f"is {lower[t]:g}, but findex makes it minus {above}[{t}], {-mu:g}"
        raise ProblemError(f"{below}[{t}]", reason, f"{MAKE_AGREE} {FROM_0}")
    if lower[f] < 0:
        reason = f"is {lower[f]:g}, but findex[{t}] makes unknown {f} a normal one"
        raise ProblemError(f"{below}[{f}]", reason, FROM_ZERO)


def _friction_indices(findex: Any, n: int) -> Indices:
    """Return findex as integers; raise ProblemError for an entry that is not the index
    of a normal unknown.
    """
    values = as_flat(
        "findex", plain("findex", findex, "a list of indices"), n, "unknown"
    )
    for i, value in enumerate(values.tolist()):
        if not (value.is_integer() and NONE <= value < n):
            last = f"the indices of {count(n, 'unknown')} are at most {n - 1}"
            raise ProblemError(f"findex[{i}]", f"is {value:g}, but {last}", NAME_NORMAL)
        if value == i:
            raise ProblemError(
                f"findex[{i}]", f"is {i}, the index of this unknown", NAME_NORMAL
            )
        if value >= 0 and values[int(value)] >= 0:
            reason = f"is {value:g}, a tangential unknown itself"
            raise ProblemError(f"findex[{i}]", reason, NAME_NORMAL)
    return values.astype(np.intp)


def of_delassus(
    W: Any,
    q: Any,
    mu: Any,
    dimension: Any,
    facets: Any,
    law: tuple[Any, Any] = (None, None),
) -> Contact:
    """Return the contacts of these data; raise ProblemError if they are invalid. law :
    restitution, and the velocities before the step.
    """
    width, edges = _integer(dimension), _integer(facets)
    if width not in (2, 3):
        raise ProblemError("dimension", f"is {dimension!r}", "give 2 or 3")
    if width == 3 and not (4 <= edges <= MAX_FACETS and edges % 2 == 0):
        hint = f"give an even number from 4 to {MAX_FACETS}"
        raise ProblemError("facets", f"is {facets!r}", hint)
    restitution, before = law
    W, q, before = by_label(W, "the columns of W", W=W, q=q, before=before)
    law = restitution, before
    q = as_vector("q", q)
    contacts, rest = divmod(q.size, width)
    if rest:
        reason = f"has {count(q.size, 'entry')} for contacts of {width} each"
        raise ProblemError("q", reason, MAKE_AGREE)
    matrix = readonly_matrix(as_square("W", W, q.size)[0], W)
    if isinstance(mu, float) and 0 <= mu < math.inf:
        friction, lower, upper, _ = law_of_coefficient(mu, contacts, width)
    else:
        coefficients = _of_contacts("mu", mu, contacts)
        for k in np.flatnonzero(coefficients < 0)[:1].tolist():
            raise ProblemError(f"mu[{k}]", f"is {coefficients[k]:g}", FROM_ZERO)
        friction, lower, upper, _ = _law_of_contacts(coefficients, width)
    edges = 2 if width == 2 else edges
    impact = _impact(q, friction.normals, *law)
    b = q if impact is None else as_vector("q", q + impact.shift)
    return Contact(matrix, b, lower, upper, friction, edges, "W", impact=impact)


def _of_contacts(field: str, values: Any, contacts: int) -> Vector:
    """Return a finite number for each contact from one for all, or from a list."""
    return as_vector(field, as_bound(field, values, contacts, "contact", math.nan))


@lru_cache(maxsize=16)  # as in a sequence mu and the number of contacts are often equal
def law_of_coefficient(mu: float, contacts: int, width: int) -> Law:
    """Return the law of contacts of this width, which have the same mu >= 0."""
    return _law_of_contacts(readonly_copy(np.full(contacts, mu), []), width)


def _law_of_contacts(coefficients: Vector, width: int) -> Law:
    """Return the law of contacts, in contiguous read-only arrays: the bounds of
    friction are infinite."""
    unknowns = np.arange(coefficients.size * width).reshape(-1, width)
    normals, tangents = unknowns[:, 0].copy(), unknowns[:, 1:].copy()
    lower, upper = np.zeros(unknowns.size), np.full(unknowns.size, math.inf)
    lower[tangents] = -math.inf
    mu = np.ascontiguousarray(coefficients)
    for array in (normals, tangents, mu, lower, upper):
        array.setflags(write=False)
    return Law(Friction(normals, tangents, mu), lower, upper, True)


def _impact(
    q: Vector, normals: Indices, restitution: Any, before: Any
) -> Impact | None:
    if restitution is None and before is None:
        return None
    for key, value, other in (
        ("restitution", restitution, "before"),
        ("before", before, "restitution"),
    ):
        if value is None:
            reason = f"is missing, though there is {other}"
            raise ProblemError(key, reason, f"add it, or leave {other} out")
    size = normals.size
    coefficients = _of_contacts("restitution", restitution, size)
    for k in np.flatnonzero((coefficients < 0) | (coefficients > 1))[:1].tolist():
        reason = f"is {coefficients[k]:g}"
        hint = f"give a number from 0 to 1 {FROM_0}"
        raise ProblemError(f"restitution[{k}]", reason, hint)
    velocities = as_vector("before", before, q.size, "velocity")
    impact = Impact(q, coefficients, velocities, np.zeros(q.size))
    return impact._replace(shift=rounded(impact.exact_shift(normals)))


def _integer(raw_value: Any) -> int:
    """Return an integer, which may be an array of one entry; -1 for anything else."""
    if isinstance(raw_value, np.ndarray) and raw_value.size == 1:
        raw_value = raw_value.item()
    is_whole = isinstance(raw_value, (int, float, np.number)) and raw_value == int(
        raw_value
    )
    return int(raw_value) if is_whole else -1


def _listed(value: Any) -> Any:
    """Return an array or a sparse matrix for JSON."""
    if is_sparse(value):
        coo = value.tocoo()
        parts = {"rows": coo.row, "cols": coo.col, "values": coo.data}
        lists = {key: part.tolist() for key, part in parts.items()}
        return {"format": "coo", "shape": list(value.shape), **lists}
    if not isinstance(value, np.ndarray):
        return value
    if np.isfinite(value).all():
        return value.tolist()
    return [None if math.isinf(entry) else entry for entry in value.tolist()]
