"""Many problems that share M, whose right-hand sides are the columns of a matrix Q, or
that have a dense M each."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import ProblemError
from lcpcli.linalg.doubles import (
    FAR_FROM_ONE,
    are_moderate,
    is_finite,
    row_sizes,
    sizes,
)
from lcpcli.linalg.factors import (
    MAX_NUMPY_ROWS,
    each_product,
    well_conditioned_inverse,
)
from lcpcli.linalg.matrices import absolute_product, dense, product
from lcpcli.model import arrays
from lcpcli.model.arrays import FROM_0, by_label, readonly_copy
from lcpcli.model.box import (
    NO_BOUND,
    ORTHANT,
    Box,
    Reference,
    bounds_of_each,
    has_columns,
    reference,
    refuse_crossed,
)
from lcpcli.model.problem import Facts, Problem, conditions_of
from lcpcli.typing import Indices, Mask, Matrix, Vector


class Columns:
    """k validated problems with one M of shape (n, n), the columns of Q, of shape (n,
    k), and bounds.

    lower, upper, infinity : as in `Problem`, but bounds may be of shape (n, k), a
        column for each problem.
    M : a dense matrix if it is small, for computing with many columns at once.
    """

    def __init__(
        self, M: Any, Q: Any, lower: Any, upper: Any, infinity: float = math.inf
    ) -> None:
        Q, lower, upper = by_label(M, Q=Q, lower=lower, upper=upper)
        self.Q = arrays.as_columns("Q", Q)
        self.n, self.k = self.Q.shape
        self._bounds = None
        if has_columns("lower", lower) or has_columns("upper", upper):
            self._bounds = bounds_of_each(
                self._rows_of, lower, upper, (self.k, self.n), infinity, "column"
            )
            lower, upper = 0.0, math.inf
        shape = tuple[int, ...](getattr(M, "shape", ()))
        if isinstance(M, (list, tuple)):
            shape = len(M), *{len(row) for row in M if isinstance(row, (list, tuple))}
        if len(shape) == 2 and self.n != shape[0] == shape[1]:
            transposed = ", as Q.T here" if self.k == shape[0] else ""
            reason = f"has shape {self.Q.shape}, but M is {shape[0]} x {shape[0]}"
            raise ProblemError(
                "Q", reason, f"give one right-hand side in each column{transposed}"
            )
        self.like = Problem(
            M, np.zeros(self.n), lower=lower, upper=upper, infinity=infinity
        )
        self.M = dense(self.like.M) if self.n <= MAX_NUMPY_ROWS else self.like.M

    def _rows_of(self, field: str, bound: Any) -> Vector | None:
        """Return a bound that differs between problems, with a row for each of them;
        None for any other."""
        if not has_columns(field, bound):
            return None
        values = arrays.as_columns(field, bound, finite=False)
        if values.shape != (self.n, self.k):
            reason = f"has shape {values.shape}, but Q has {(self.n, self.k)}"
            raise ProblemError(
                field,
                reason,
                "give a number, one for each unknown, or one for each entry of Q",
            )
        return np.asarray(values.T)

    @cached_property
    def inverse(self) -> Matrix | None:
        """Return the inverse of a small well-conditioned M if there are more columns
        than unknowns, so that it saves time."""
        return (
            well_conditioned_inverse(self.M)
            if self.n < min(self.k, MAX_NUMPY_ROWS + 1)
            else None
        )

    def block(self, first: int, last: int) -> Block:
        """Return the problems of some columns, copied and checked as they are now; may
        raise ProblemError."""
        q = _copy(self.Q[:, first:last].T)
        if not is_finite(q.reshape(-1)):
            j, i = (int(index) for index in np.argwhere(~np.isfinite(q))[0])
            reason = "has ceased to be a finite number since the call"
            raise ProblemError(
                f"Q[{i}][{first + j}]", reason, f"give solve_many a copy {FROM_0}"
            )
        if self._bounds is not None:
            low, high = (_copy(bound[first:last]) for bound in self._bounds)
            refuse_crossed(low, high, "column", first)
            return Block(self, q, Box(low, high))
        return Block(
            self, q, self.like.box.mapped(lambda bound: np.broadcast_to(bound, q.shape))
        )

    def problems(self) -> Iterator[Problem]:
        return (self.block(j, j + 1).problem(0) for j in range(self.k))


def like_with(
    like: Problem,
    q: Vector,
    box: Box,
    M: Matrix | None = None,
    facts: Facts | None = None,
    sizes_of_q: tuple[float, float] | None = None,
) -> Problem:
    """Return a problem like another one, with a validated q and bounds, quickly: with
    its M and all that is computed of it, or with another M.

    M : read-only, of the same kind, with entries that need not be finite; None for that
        of the other problem. facts, sizes_of_q : those of M and q, if they are known.
    """
    smallest, largest = sizes_of_q or sizes(q)
    fields = like.fields_of_M()
    if M is not None:
        facts = facts or Facts(M, like.block_form)
        fields.update(M=M, n=M.shape[0], facts=facts, largest=facts.largest)
        fields.pop("latest", None)
    is_moderate = (
        fields["facts"].has_moderate_rows
        and smallest >= 1 / FAR_FROM_ONE
        and largest <= FAR_FROM_ONE
    )
    fields.update(
        q=q,
        sizes_of_q=(smallest, largest),
        is_moderate=is_moderate,
        box=box,
        lower=box.lower,
        upper=box.upper,
    )
    if box.is_orthant:
        fields.update(reference_z=None, q_ref=q, q_error=0.0)
    return Problem.of_fields(fields)


def like_of_conditions(like: Problem, q: Vector, box: Box) -> Problem:
    """Return the problem of `like_with` with the origin for this q and these bounds;
    with names alone if they have another kind of origin."""
    problem, origin = like_with(like, q, box), like.origin
    if origin is None or (box is like.box and np.array_equal(q, like.q)):
        return problem
    other = origin.of_conditions(conditions_of(problem))
    if other is origin:
        return problem
    if other is None:
        with imports:
            from lcpcli.model.formulation import Named
        other = Named(tuple(like.names))
    return Problem.of_fields(vars(problem), origin=other)


def _copy(rows: Vector) -> Vector:
    return readonly_copy(np.array(rows, dtype=np.float64, order="C"), [])


class Block:
    """m problems that share M, one in each row of the arrays.

    columns : all columns of Q. like : a problem with the same M. M : this matrix, dense
        if it is small.
    q : shape (m, n). box : the bounds, of shape (m, n) unless they are z >= 0.
    """

    def __init__(
        self, columns: Columns, q: Vector, box: Box, references: Reference | None = None
    ) -> None:
        self.columns = columns
        self.q = q
        self.box = box
        self.like, self.M = columns.like, columns.M
        self.units = self.like.units
        self.references = references or reference(self.M, q, box)
        self.reference_z, self.q_ref, self.q_error = self.references
        bounds = {"lower": self.like.lower, "upper": self.like.upper, "box": box}
        self._fields = {
            **self.like.fields_of_M(),
            **bounds,
            "reference_z": None,
            "q_error": 0.0,
        }

    def part(self, rows: Indices) -> Block:
        return Block(
            self.columns, self.q[rows], self.box.part(rows), self.references.part(rows)
        )

    def times_M(self, z: Vector) -> Vector:
        return np.asarray(product(self.M, z.T).T)

    def sizes(self, z: Vector) -> Vector:
        return np.asarray(absolute_product(self.M, np.abs(z).T).T)

    def w(self, z: Vector) -> Vector:
        """Return w = M z + q for each row z, computed from the reference point."""
        return (
            self.times_M(z if self.reference_z is None else z - self.reference_z)
            + self.q_ref
        )

    @cached_property
    def _sizes_of_q(self) -> tuple[Vector, Vector]:
        return row_sizes(self.q)

    @cached_property
    def are_moderate(self) -> Mask:
        """Return which of the problems have moderate numbers (see
        `Problem.is_moderate`); shape (m,)."""
        smallest, largest = self._sizes_of_q
        return np.asarray(
            (largest <= FAR_FROM_ONE)
            & (smallest >= 1 / FAR_FROM_ONE)
            & self.like.facts.has_moderate_rows
        )

    @cached_property
    def _fields_of_q(self) -> list[tuple[tuple[float, float], bool]]:
        sizes_of_q = zip(
            *(of_rows.tolist() for of_rows in self._sizes_of_q), strict=True
        )
        return list(zip(sizes_of_q, self.are_moderate.tolist(), strict=True))

    def problem(self, i: int) -> Problem:
        """Return the problem of row i, which takes about a microsecond, as nothing is
        computed or validated."""
        q, (sizes_of_q, is_moderate) = self.q[i], self._fields_of_q[i]
        of_q = {"q": q, "sizes_of_q": sizes_of_q, "is_moderate": is_moderate}
        # The problems differ in q alone, as LCPs do.
        if self.reference_z is None and self.box is self.like.box:
            return Problem.of_fields(self._fields, **of_q, q_ref=q)
        box, reference_point = self.box.part(i), self.references.part(i)
        bounds = {"box": box, "lower": box.lower, "upper": box.upper}
        reference = {
            "reference_z": reference_point.z,
            "q_ref": reference_point.q,
            "q_error": reference_point.error,
        }
        return Problem.of_fields(self._fields, **of_q, **bounds, **reference)


class Stack:
    """m validated problems with n unknowns each, with copies of their data as in
    `Problem`.

    M, q : shapes (m, n, n) and (m, n). lower, upper : numbers, or of shape (n,) or (m,
        n). infinity : as in `Problem`.
    like : a problem of this size. box : the bounds, of shape (m, n) unless they are z
        >= 0.
    """

    def __init__(
        self, M: Any, q: Any, lower: Any, upper: Any, infinity: float = math.inf
    ) -> None:
        self.M = readonly_copy(
            np.ascontiguousarray(as_stack("M", M, (None, None, None))), M
        )
        m, n, columns = self.M.shape
        if n != columns:
            raise ProblemError(
                "M",
                f"has shape {self.M.shape}",
                "give one square matrix for each problem",
            )
        self.q = readonly_copy(as_stack("q", q, (m, n)), q)
        if dimensions(q) < 2:
            raise ProblemError(
                "q",
                f"has {dimensions(q)} dimension",
                f"give shape ({m}, {n}), a row for each problem",
            )
        self.n: int = n
        of_each = max(dimensions(lower), dimensions(upper)) > 1
        bounds: dict[str, Any] = (
            {} if of_each else {"lower": lower, "upper": upper, "infinity": infinity}
        )
        self.like = Problem(
            self.M[0] if m else np.eye(n), self.q[0] if m else np.zeros(n), **bounds
        )
        self.box = self.like.box.mapped(lambda bound: np.broadcast_to(bound, (m, n)))
        if of_each:
            bounds_by_row = bounds_of_each(
                self._rows_of, lower, upper, (m, n), infinity, "problem"
            )
            self.box = (
                ORTHANT if bounds_by_row is None else Box(*map(_copy, bounds_by_row))
            )

    def _rows_of(self, field: str, bound: Any) -> Vector | None:
        return (
            as_stack(field, bound, self.q.shape, finite=False)
            if dimensions(bound) > 1
            else None
        )

    def __len__(self) -> int:
        return len(self.q)

    def problem(self, i: int) -> Problem:
        bounds = (
            {}
            if self.box.is_orthant
            else {"lower": self.box.lower[i], "upper": self.box.upper[i]}
        )
        return Problem(self.M[i], self.q[i], **bounds)

    @cached_property
    def largest(self) -> Vector:
        return np.asarray(np.abs(self.M).max(axis=(1, 2), initial=0.0))

    @cached_property
    def are_moderate(self) -> Mask:
        """Return which problems have moderate numbers (see `Problem`), and no far
        bounds; shape (m,)."""
        moderate = np.ones(len(self), dtype=bool)
        if not (are_moderate(self.M) and are_moderate(self.q)):
            for smallest, largest in map(
                row_sizes, (np.abs(self.M).max(axis=2, initial=0.0), self.q)
            ):
                moderate &= (smallest >= 1 / FAR_FROM_ONE) & (largest <= FAR_FROM_ONE)
        for bound in (self.box.lower, self.box.upper) if self.box.is_far else ():
            moderate &= ~((np.abs(bound) >= NO_BOUND) & np.isfinite(bound)).any(axis=1)
        return moderate

    def w(self, z: Vector) -> Vector:
        return np.asarray(each_product(self.M, z) + self.q)


def dimensions(values: Any) -> int:
    """Return the number of dimensions of an array, or of nested lists, by their first
    entries."""
    if isinstance(values, (list, tuple)):
        return 1 + dimensions(values[0]) if values else 1
    return int(getattr(values, "ndim", 0))


def as_stack(
    field: str, values: Any, shape: tuple[int | None, ...], finite: bool = True
) -> Vector:
    """Return values as a float64 array of this shape, in which None means any length,
    or raise ProblemError. Without the first dimension they are the same for all."""
    array = arrays.as_nested(field, values, len(shape))
    expected = shape[len(shape) - max(array.ndim, 1) :]
    expected_shape = tuple(
        have if want is None else want
        for have, want in zip(array.shape, expected, strict=False)
    )
    if array.ndim < len(shape) - 1 or array.shape != expected_shape:
        raise ProblemError(
            field,
            f"has shape {array.shape}",
            f"give shape {shape}".replace("None", "k"),
        )
    if finite:
        arrays.refuse_infinite(field, array)
    return (
        np.broadcast_to(array, (shape[0], *expected_shape))
        if array.ndim < len(shape) and shape[0] is not None
        else array
    )
