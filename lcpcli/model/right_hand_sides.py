"""Many problems that share M: their right-hand sides are the columns of a matrix Q."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.linalg.doubles import FAR_FROM_ONE, is_finite, row_sizes, sizes
from lcpcli.linalg.factors import MOST_NUMPY_ROWS, well_conditioned_inverse
from lcpcli.linalg.matrices import absolute_product, dense, product
from lcpcli.model.arrays import FROM_0, as_columns, own
from lcpcli.model.bounds import as_bound, as_intervals, has_columns, with_infinity
from lcpcli.model.box import Box
from lcpcli.model.labels import by_label
from lcpcli.model.problem import Problem
from lcpcli.model.reference_point import Reference, reference
from lcpcli.typing import Indices, Mask, Matrix, Vector


class Columns:
    """k validated problems with one M of shape (n, n), the columns of Q, of shape (n, k), and bounds.

    lower, upper, infinity : as in `Problem`, but bounds may be of shape (n, k), a column for each problem.
    M : a dense matrix if it is small, for computing with many columns at once.
    """

    def __init__(self, M: Any, Q: Any, lower: Any, upper: Any, infinity: float = math.inf) -> None:
        Q, lower, upper = by_label(M, Q=Q, lower=lower, upper=upper)
        self.Q = as_columns("Q", Q)
        n, self.k = self.Q.shape
        self._bounds = None
        if has_columns("lower", lower) or has_columns("upper", upper):
            self._bounds = _bounds_of_columns(lower, upper, n, self.k, infinity)
            lower, upper = 0.0, math.inf
        self.like = _problem(M, self.Q, lower, upper, infinity)
        self.M = dense(self.like.M) if n <= MOST_NUMPY_ROWS else self.like.M

    @property
    def n(self) -> int:
        return self.like.n

    @cached_property
    def inverse(self) -> Matrix | None:
        """Return the inverse of M, if M is small and well-conditioned and there are more columns than unknowns, so
        that it pays."""
        return well_conditioned_inverse(self.M) if self.n < min(self.k, MOST_NUMPY_ROWS + 1) else None

    def block(self, first: int, last: int) -> Block:
        """Return the problems of columns first to last - 1, copied and checked as they are now, as the arrays may
        have changed since the call. Raises ProblemError."""
        q = _copy(self.Q[:, first:last])
        if not is_finite(q.reshape(-1)):
            j, i = (int(place) for place in np.argwhere(~np.isfinite(q))[0])
            fault = "has ceased to be a finite number since the call"
            raise ProblemError(f"Q[{i}][{first + j}]", fault, f"give solve_many a copy {FROM_0}")
        if self._bounds is not None:
            low, high = (_copy(bound[:, first:last]) for bound in self._bounds)
            refuse_crossed(low, high, first=first)
            return Block(self, q, Box(low, high))
        return Block(self, q, self.like.box.mapped(lambda bound: np.broadcast_to(bound, q.shape)))

    def problems(self) -> Iterator[Problem]:
        """Yield one problem after another."""
        for j in range(self.k):
            yield self.block(j, j + 1).problem(0)


def like_with(like: Problem, q: Vector, box: Box) -> Problem:
    """Return the problem with the M of another one, a validated q and other bounds, in microseconds; what is known of M
    remains known, and nothing else."""
    least, largest = sizes(q)
    is_moderate = like.has_moderate_rows and least >= 1 / FAR_FROM_ONE and largest <= FAR_FROM_ONE
    known = like.known_of_M()
    known.update(q=q, sizes_of_q=(least, largest), is_moderate=is_moderate, box=box, lower=box.lower, upper=box.upper)
    if box.is_orthant:
        known.update(reference_z=None, q_ref=q, q_error=0.0)
    return Problem.of_fields(known)


def _copy(columns: Vector) -> Vector:
    """Return some columns, each in a row of a new array, which is read-only."""
    return own(np.array(columns.T, dtype=np.float64, order="C"), [])


def _problem(M: Any, Q: Vector, lower: Any, upper: Any, infinity: float) -> Problem:
    """Return the problem with q = 0, or raise a ProblemError that names Q if its shape does not fit M."""
    n, shape = Q.shape[0], tuple[int, ...](getattr(M, "shape", ()))
    if isinstance(M, (list, tuple)):
        shape = len(M), *{len(row) for row in M if isinstance(row, (list, tuple))}
    if len(shape) == 2 and n != shape[0] == shape[1]:
        transposed = ", as Q.T here" if Q.shape[1] == shape[0] else ""
        fault = f"has shape {Q.shape}, but M is {shape[0]} x {shape[0]}"
        raise ProblemError("Q", fault, f"give one right-hand side in each column{transposed}")
    return Problem(M, np.zeros(n), lower=lower, upper=upper, infinity=infinity)


def _bounds_of_columns(lower: Any, upper: Any, n: int, k: int, infinity: float) -> tuple[Vector, Vector] | None:
    """Return both bounds of shape (n, k); None if they are 0 and infinity, the bounds of an LCP."""
    given = []
    for field, bound, absent in (("lower", lower, -math.inf), ("upper", upper, math.inf)):
        if not has_columns(field, bound):
            given.append(as_bound(field, bound, n, "unknown", absent)[:, np.newaxis])
            continue
        values = as_columns(field, bound, finite=False)
        if values.shape != (n, k):
            fault = f"has shape {values.shape}, but Q has {(n, k)}"
            raise ProblemError(field, fault, "give a number, one for each unknown, or one for each entry of Q")
        given.append(values)
    low, high = (np.broadcast_to(with_infinity(bound, infinity), (n, k)) for bound in given)
    refuse_crossed(low.T, high.T)
    return None if not low.any() and (high == np.inf).all() else (low, high)


def refuse_crossed(low: Vector, high: Vector, name: str = "column", first: int = 0) -> None:
    """Raise ProblemError if no number lies between the bounds, of shape (m, n), for columns, or what else the rows are
    for, numbered from `first`."""
    for j in np.flatnonzero(~((low <= high) & (low < np.inf) & (high > -np.inf)).all(axis=1))[:1]:
        try:
            as_intervals(("lower", "upper"), low[j], high[j], low.shape[1])
        except ProblemError as error:
            raise error.inside(f"{name} {first + j}") from None


class Block:
    """m problems that share M, one in each row of the arrays.

    columns : all columns of Q. like : a problem with the same M. M : this matrix, dense if it is small.
    q : shape (m, n). box : the bounds, of shape (m, n) unless they are z >= 0.
    """

    def __init__(self, columns: Columns, q: Vector, box: Box) -> None:
        self.columns, self.q, self.box = columns, q, box
        self.like, self.M = columns.like, columns.M
        self.units = self.like.units
        self._fields = {**self.like.known_of_M(), "lower": self.like.lower, "upper": self.like.upper, "box": box}
        self._fields.update(reference_z=None, q_error=0.0)

    def part(self, rows: Indices) -> Block:
        """Return the block of some of the problems."""
        some = Block(self.columns, self.q[rows], self.box.part(rows))
        some.references = self.references.part(rows)
        return some

    def times_M(self, z: Vector) -> Vector:
        """Return M z for each row z."""
        rows: Vector = product(self.M, z.T).T
        return rows

    def sizes(self, z: Vector) -> Vector:
        """Return |M| |z| for each row z."""
        rows: Vector = absolute_product(self.M, np.abs(z).T).T
        return rows

    def w(self, z: Vector) -> Vector:
        """Return w = M z + q for each row z, computed from the reference point."""
        w = self.times_M(self.references.moved(z))
        w += self.references.q
        return w

    @cached_property
    def _sizes_of_q(self) -> tuple[Vector, Vector]:
        """Return the least nonzero |q_i| and the largest |q_i| of each problem."""
        return row_sizes(self.q)

    @cached_property
    def are_moderate(self) -> Mask:
        """Return which of the problems have moderate numbers (see `Problem.is_moderate`); shape (m,)."""
        least, largest = self._sizes_of_q
        return np.asarray((largest <= FAR_FROM_ONE) & (least >= 1 / FAR_FROM_ONE) & self.like.has_moderate_rows)

    @cached_property
    def _fields_of_q(self) -> list[tuple[tuple[float, float], bool]]:
        """Return sizes_of_q and is_moderate of each problem."""
        least, largest = self._sizes_of_q
        return list(zip(zip(least.tolist(), largest.tolist(), strict=True), self.are_moderate.tolist(), strict=True))

    @property
    def reference_z(self) -> Vector | None:
        """Return the reference points of all problems, shape (m, n); None for LCPs."""
        return self.references.z

    @property
    def q_ref(self) -> Vector:
        """Return M z + q at the reference points, shape (m, n)."""
        return self.references.q

    @property
    def q_error(self) -> Vector | float:
        """Return bounds on the rounding errors in q_ref."""
        return self.references.error

    def problem(self, i: int) -> Problem:
        """Return the problem of row i, which takes about a microsecond, as nothing is computed or validated."""
        q, (sizes_of_q, is_moderate) = self.q[i], self._fields_of_q[i]
        problem = Problem.of_fields(self._fields, q=q, sizes_of_q=sizes_of_q, is_moderate=is_moderate, q_ref=q)
        if self._alike:
            return problem
        box, own = self.box.mapped(lambda bound: bound[i]), self.references.part(i)
        bounds = {"box": box, "lower": box.lower, "upper": box.upper}
        return problem.knowing(**bounds, reference_z=own.z, q_ref=own.q, q_error=own.error)

    @cached_property
    def _alike(self) -> bool:
        """Return whether the problems differ in q alone, as LCPs do."""
        return self.references.z is None and self.box is self.like.box

    @cached_property
    def references(self) -> Reference:
        """Return the reference points of all problems."""
        return reference(self.M, self.q, self.box)
