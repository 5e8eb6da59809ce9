"""Many problems of one size, each with a dense M of its own."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.linalg.doubles import FAR_FROM_ONE, are_moderate, row_sizes
from lcpcli.linalg.principal_many import each_product
from lcpcli.model.arrays import FROM_0, NUMBERS, as_floats, own, plain, refuse_infinite, refuse_other_than_numbers
from lcpcli.model.bounds import as_bound, with_infinity
from lcpcli.model.box import NO_BOUND, ORTHANT, Box
from lcpcli.model.problem import Problem
from lcpcli.model.right_hand_sides import refuse_crossed
from lcpcli.typing import Mask, Vector


class Stack:
    """m validated problems with n unknowns each, which keeps copies of their data as `Problem` does.

    M, q : shapes (m, n, n) and (m, n). lower, upper : numbers, or of shape (n,) or (m, n). infinity : as in `Problem`.
    like : a problem of this size. box : the bounds, of shape (m, n) unless they are z >= 0.
    """

    def __init__(self, M: Any, q: Any, lower: Any, upper: Any, infinity: float = math.inf) -> None:
        self.M = own(np.ascontiguousarray(as_stack("M", M, (None, None, None))), M)
        m, n, columns = self.M.shape
        if n != columns:
            raise ProblemError("M", f"has shape {self.M.shape}", "give one square matrix for each problem")
        self.q = own(as_stack("q", q, (m, n)), q)
        if dimensions(q) < 2:
            raise ProblemError("q", f"has {dimensions(q)} dimension", f"give shape ({m}, {n}), a row for each problem")
        self.n: int = n
        of_each = dimensions(lower) > 1 or dimensions(upper) > 1
        bounds: dict[str, Any] = {} if of_each else {"lower": lower, "upper": upper, "infinity": infinity}
        self.like = Problem(self.M[0] if m else np.eye(n), self.q[0] if m else np.zeros(n), **bounds)
        self.box = self.like.box.mapped(lambda bound: np.broadcast_to(bound, (m, n)))
        if of_each:
            self.box = _box(lower, upper, m, n, infinity)

    def __len__(self) -> int:
        return len(self.q)

    def problem(self, i: int) -> Problem:
        """Return the problem of row i."""
        bounds = {} if self.box.is_orthant else {"lower": self.box.lower[i], "upper": self.box.upper[i]}
        return Problem(self.M[i], self.q[i], **bounds)

    @cached_property
    def largest(self) -> Vector:
        """Return the largest |M_ij| of each problem, shape (m,)."""
        return np.asarray(np.abs(self.M).max(axis=(1, 2), initial=0.0))

    @cached_property
    def are_moderate(self) -> Mask:
        """Return which problems have moderate numbers (see `Problem`), and no bounds that may stand for infinite
        ones; shape (m,)."""
        moderate = np.ones(len(self), dtype=bool)
        if not (are_moderate(self.M) and are_moderate(self.q)):
            for values in (np.abs(self.M).max(axis=2, initial=0.0), self.q):
                least, largest = row_sizes(values)
                moderate &= (least >= 1 / FAR_FROM_ONE) & (largest <= FAR_FROM_ONE)
        if self.box.is_far:
            for bound in (self.box.lower, self.box.upper):
                moderate &= ~((np.abs(bound) >= NO_BOUND) & np.isfinite(bound)).any(axis=1)
        return moderate

    def w(self, z: Vector) -> Vector:
        """Return w = M z + q for each row z."""
        w = each_product(self.M, z)
        w += self.q
        return w


def _box(lower: Any, upper: Any, m: int, n: int, infinity: float) -> Box:
    """Return the bounds of all problems, some of which have their own, or raise ProblemError."""
    ends = []
    for field, bound, absent in (("lower", lower, -math.inf), ("upper", upper, math.inf)):
        of_each = dimensions(bound) > 1
        end = as_stack(field, bound, (m, n), finite=False) if of_each else as_bound(field, bound, n, "unknown", absent)
        ends.append(own(np.array(np.broadcast_to(with_infinity(end, infinity), (m, n))), []))
    low, high = ends
    refuse_crossed(low, high, "problem")
    return Box(low, high) if low.any() or (high < math.inf).any() else ORTHANT


def dimensions(values: Any) -> int:
    """Return the number of dimensions of an array, or of nested lists, by their first entries."""
    if isinstance(values, (list, tuple)):
        return 1 + dimensions(values[0]) if values else 1
    return int(getattr(values, "ndim", 0))


def as_stack(field: str, values: Any, shape: tuple[int | None, ...], finite: bool = True) -> Vector:
    """Return values as a float64 array of this shape, in which None stands for any length, or raise ProblemError.
    Without the first dimension they are the same for all."""
    given = _stacked(field, values, len(shape))
    expected = shape[len(shape) - max(given.ndim, 1) :]
    known = tuple(have if want is None else want for have, want in zip(given.shape, expected, strict=False))
    if given.ndim < len(shape) - 1 or given.shape != known:
        raise ProblemError(field, f"has shape {given.shape}", f"give shape {shape}".replace("None", "k"))
    if finite:
        refuse_infinite(field, given)
    return np.broadcast_to(given, (shape[0], *known)) if given.ndim < len(shape) and shape[0] is not None else given


def _stacked(field: str, values: Any, most: int) -> Vector:
    """Return an array, or lists of up to `most` dimensions, as floats."""
    values = plain(field, values, NUMBERS)
    if not isinstance(values, (list, tuple)):
        return as_floats(field, values)
    if most == 1 or not values or dimensions(values) == 1:
        refuse_other_than_numbers(field, values)
        return as_floats(field, values)
    parts = [_stacked(f"{field}[{i}]", part, most - 1) for i, part in enumerate(values)]
    for i, part in enumerate(parts):
        if part.shape != parts[0].shape:
            fault = f"has shape {part.shape} where {field}[0] has {parts[0].shape}"
            raise ProblemError(f"{field}[{i}]", fault, f"make all of them the same {FROM_0}")
    return np.array(parts)
