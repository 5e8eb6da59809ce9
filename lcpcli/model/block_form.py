"""Conditions with rows and bounds, in blocks: a matrix for the variables, bordered by
the rows, their multipliers, and a slack for each row between two bounds.

F. Facchinei, J.-S. Pang, Finite-Dimensional Variational Inequalities and
Complementarity Problems (2003), section 1.3.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import (
    IS_MISSING,
    LEAVE_ONE_OUT,
    ProblemError,
    kind,
    quoted,
    refuse_unknown,
)
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS, ROW_ROUNDING
from lcpcli.linalg.matrices import (
    absolute_product,
    are_equal,
    is_sparse,
    is_symmetric,
    largest_asymmetry,
    symmetric_part,
)
from lcpcli.model.arrays import as_rows
from lcpcli.model.box import as_intervals
from lcpcli.model.formulation import (
    FULL,
    LABELS,
    Conditions,
    Formulation,
    names_of,
    unnamed,
)
from lcpcli.typing import Mask, Matrix, Vector

if TYPE_CHECKING:
    from typing_extensions import Self


SENSES = {"min": 1.0, "max": -1.0}  # of objectives
CANCELLED = 1e-12  # relative to an objective: rounding of its terms that matters


def symmetrized(Q: Matrix, eps: float = EPS) -> Matrix | None:
    """Return Q if it is symmetric, (Q + Q') / 2 if it is up to rounding, else None.

    Rounding: |Q_ij - Q_ji| <= k eps max|Q|, as the errors of Q = B'B, or of another
    product with sums of k terms, may be. eps : from 1 to the next number of the type
    in which Q has been computed.
    """
    if is_symmetric(Q):
        return Q
    entries = Q.data if is_sparse(Q) else Q
    bound = Q.shape[0] * eps * float(np.abs(entries).max())
    return symmetric_part(Q) if largest_asymmetry(Q)[0] <= bound else None


class Blocks(NamedTuple):
    """k variables x, of which the conditions have Qx + c, under row_lower <= Ax <=
    row_upper and lower <= x <= upper, with m rows.

    Q, A : shapes (k, k) and (m, k), both dense or both in compressed sparse rows.
    c, lower, upper, row_lower, row_upper : vectors; bounds may be infinite.
    """

    Q: Matrix
    c: Vector
    A: Matrix
    row_lower: Vector
    row_upper: Vector
    lower: Vector
    upper: Vector

    @property
    def ranges(self) -> Mask:
        """Return where rows lie between two different finite bounds."""
        return (
            np.isfinite(self.row_lower)
            & np.isfinite(self.row_upper)
            & (self.row_lower < self.row_upper)
        )

    def with_rows(self, rows: Sequence[int]) -> Blocks:
        """Return the blocks with these rows, which may be repeated."""
        selected = (each[rows] for each in (self.A, self.row_lower, self.row_upper))
        A, row_lower, row_upper = selected
        return self._replace(A=A, row_lower=row_lower, row_upper=row_upper)

    def conditions(self) -> Conditions:
        """Return the first-order conditions in z = (x, y, s)."""
        M = self.Q
        if self.row_lower.size:
            M = bordered(self.Q, self.A, self.ranges, is_sparse(self.A))
        return Conditions(M, *self.vectors())

    def vectors(self) -> tuple[Vector, Vector, Vector]:
        """Return q and the bounds of the conditions.

        y_i is the multiplier of row i: free for an equation, y_i >= 0 or <= 0 for a row
        with only a lower or an upper bound, 0 for a row without bounds; w is then Ax
        minus the bound. For a row i between two bounds, y_i is free and w_i = (Ax)_i -
        s_i, where s_i, within the bounds, has w = y_i.
        """
        ranges = self.ranges
        low, high = np.isfinite(self.row_lower), np.isfinite(self.row_upper)
        bound = np.where(low, self.row_lower, np.where(high, self.row_upper, 0.0))
        q = (
            np.concatenate(
                (self.c, np.where(ranges, 0.0, -bound), np.zeros(int(ranges.sum())))
            )
            + 0.0
        )  # no -0
        lower = np.concatenate(
            (self.lower, np.where(high, -np.inf, 0.0), self.row_lower[ranges])
        )
        upper = np.concatenate(
            (self.upper, np.where(low, np.inf, 0.0), self.row_upper[ranges])
        )
        return q, lower, upper

    def gradient_terms(self, x: Vector, y: Vector) -> Vector:
        """Return the sum of the absolute values of the terms of Qx + c - A'y. x, y :
        absolute values."""
        terms = matrices.absolute_product(self.Q, x) + np.abs(self.c)
        return np.asarray(terms + matrices.absolute_product(self.A.T, y))

    @np.errstate(over="ignore", invalid="ignore")
    def objective(self, x: Vector) -> float:
        """Return x'Qx / 2 + c'x for a symmetric Q, with more digits than double
        precision has where terms cancel, as those of a large x with Qx close to 0
        do."""
        value = float(x @ matrices.product(self.Q, x) / 2 + self.c @ x)
        sizes = np.abs(x)
        of_Q = sizes @ matrices.absolute_product(self.Q, sizes) / 2
        terms = float(of_Q + np.abs(self.c) @ sizes)
        if not EPS * terms > CANCELLED * abs(value) or not math.isfinite(terms):
            return value
        slopes = matrices.accurate_residual(self.Q, -x, 2 * self.c)
        return float(matrices.accurate_residual(x[None], slopes, np.zeros(1))[0]) / -2

    def with_infinity(self, infinity: float) -> Blocks:
        """Return the blocks without bounds and row sides of at least the size
        `infinity`, or raise ProblemError."""
        rows, variables = (self.row_lower, self.row_upper), (self.lower, self.upper)
        rows = as_intervals(
            ("row_lower", "row_upper"), *rows, self.row_lower.size, "row", infinity
        )
        variables = as_intervals(
            ("lower", "upper"), *variables, self.c.size, "variable", infinity
        )
        return Blocks(self.Q, self.c, self.A, *rows, *variables)


class BlockForm(Formulation):
    """A formulation whose conditions are those of `Blocks`, in z = (x, y, s).

    variables, ranges : the lengths of x and of s, the number of rows between two
        different finite bounds.
    rows, columns : the names of the rows of A and of its columns, the variables; empty
        if they have none.
    constant : a number that is added to the objective.
    """

    variables: int
    ranges: int
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    constant: float = 0.0

    @property
    def sign(self) -> float:
        """Return 1.0, or -1.0 for an objective to be maximized, of which Q and c are
        the negatives."""
        return 1.0

    @classmethod
    def parse(cls, data: Mapping[str, Any]) -> Any:
        refuse_unknown("", data, ("kind", "variables", "ranges", "rows", "columns"))
        names = (names_of(key, data.get(key, ())) for key in ("rows", "columns"))
        made: Any = cls  # a dataclass with these fields
        return made(size_of(data, "variables", 1), size_of(data, "ranges", 0), *names)

    def data(self) -> dict[str, Any]:
        fields = {"kind": self.kind, "variables": self.variables, "ranges": self.ranges}
        names = {"rows": list(self.rows), "columns": list(self.columns)}
        return {key: value for key, value in (fields | names).items() if value}

    def fits(self, conditions: Conditions) -> bool:
        return self.blocks_that_fit(conditions) is not None

    def of_conditions(self, conditions: Conditions) -> BlockForm | None:
        """Return this object, which reads q and the bounds from the problem, if they
        are those of its blocks; M is unchanged."""
        blocks = self.blocks(conditions)
        if blocks is None or int(blocks.ranges.sum()) != self.ranges:
            return None
        is_same = all(map(np.array_equal, blocks.vectors(), conditions[1:]))
        return self if is_same else None

    def fields_of(self, blocks: Blocks, matrix: str, vector: str) -> dict[str, Any]:
        """Return the keys of a file for these blocks, without defaults, with these keys
        for Q and c."""
        fields = {matrix: blocks.Q, vector: blocks.c + 0.0}
        if blocks.row_lower.size:
            sides = {"row_lower": blocks.row_lower, "row_upper": blocks.row_upper}
            fields |= {"A": blocks.A, **sides}
        fields |= {"lower": blocks.lower} if blocks.lower.any() else {}
        fields |= {"upper": blocks.upper} if np.isfinite(blocks.upper).any() else {}
        names = {"rows": list(self.rows), "columns": list(self.columns)}
        return fields | {key: value for key, value in names.items() if value}

    @property
    def names_of_rows(self) -> Sequence[str]:
        """Return the names of the multipliers."""
        return self.rows

    def conditions(self, blocks: Blocks) -> Conditions:
        return blocks.conditions()

    def lengths(self, problem: Any) -> dict[int, str]:
        both = problem.n - self.ranges
        return {problem.n: "z", both: "x and y", self.variables: "x"}

    def blocks_that_fit(self, conditions: Conditions) -> Blocks | None:
        """Return the blocks of these conditions, if they have no other entries, and as
        many rows and columns as there are names; else None."""
        k, m = self.variables, conditions.q.size - self.variables - self.ranges
        if m < self.ranges or any(
            len(names) not in (0, size)
            for names, size in ((self.names_of_rows, m), (self.columns, k))
        ):
            return None
        blocks = self.blocks(conditions)
        if blocks is None or int(blocks.ranges.sum()) != self.ranges:
            return None
        made = self.conditions(blocks)
        is_same = are_equal(made.M, conditions.M) and all(
            map(np.array_equal, made[1:], conditions[1:])
        )
        return blocks if is_same else None

    def blocks(self, conditions: Conditions) -> Blocks | None:
        """Return the blocks of these conditions; None if they have none of this
        size."""
        k, n = self.variables, conditions.q.size
        M = conditions.M
        q = conditions.q
        rows = slice(k, n - self.ranges)
        low, high = -q[rows] + 0.0, -q[rows] + 0.0
        low[conditions.upper[rows] == 0] = -np.inf
        high[conditions.lower[rows] == 0] = np.inf
        range_rows, columns = M[rows, n - self.ranges :].nonzero()
        if (
            len(columns) != self.ranges
            or (np.sort(columns) != np.arange(self.ranges)).any()
        ):
            return None
        low[range_rows] = conditions.lower[n - self.ranges + columns]
        high[range_rows] = conditions.upper[n - self.ranges + columns]
        return Blocks(
            M[:k, :k],
            q[:k],
            M[rows, :k],
            low,
            high,
            conditions.lower[:k],
            conditions.upper[:k],
        )

    def parts(self, z: Any) -> tuple[Any, Any]:
        """Return the x and y in z, a sequence of numbers of any type."""
        return z[: self.variables], z[self.variables : len(z) - self.ranges]

    def symmetric(self, M: Matrix) -> Matrix:
        """Return the M of conditions that `blocks_that_fit` has accepted, with Q
        symmetric where it was so only up to rounding."""
        k = self.variables
        Q = M[:k, :k]
        if (symmetric := symmetrized(Q)) is Q or symmetric is None:
            return M
        with imports:
            from scipy.sparse import lil_array
        other = lil_array(M) if is_sparse(M) else M.copy()
        other[:k, :k] = symmetric
        return other.tocsr() if is_sparse(M) else other

    def with_ranges(self, ranges: int) -> Self:
        """Return this formulation with another number of rows between two bounds."""
        raise NotImplementedError

    def signs(self, n: int) -> Vector:
        """Return S of shape (n,), for which S M is symmetric: 1 for variables, -1 for
        multipliers."""
        S = np.ones(n)
        S[self.variables : n - self.ranges] = -1.0
        return S

    def reversed(self, n: int) -> range:
        """Return the components of z that have the other sign in the sense of the
        objective: y of a maximization."""
        return range(self.variables, n - self.ranges) if self.sign < 0 else range(0)

    def unsigned_parts(
        self, z: Sequence[Any]
    ) -> tuple[list[Any], list[Any], list[Any]]:
        """Return the x, y and s in z, with y in the sense of the objective."""
        x, y = self.parts(z)
        multipliers = [0 - value for value in y] if self.sign < 0 else list(y)
        return list(x), multipliers, list(z[len(x) + len(y) :])

    def objective(self, blocks: Blocks, x: Vector) -> float:
        """Return the objective in the sense in which it is stated, with its
        constant."""
        return self.sign * blocks.objective(x) + self.constant

    def z_of(self, x: Vector, y: Vector, blocks: Blocks) -> Vector:
        """Return z for x and the multipliers y."""
        with np.errstate(over="ignore", invalid="ignore"):
            activities = blocks.A @ x
            rounding = ROW_ROUNDING * absolute_product(blocks.A, np.abs(x))
            # A row with a multiplier is at this side, and off it by rounding alone.
            side = np.where(y > 0, blocks.row_lower, blocks.row_upper)
            is_at_side = (y != 0) & (np.abs(activities - side) <= rounding)
            s = np.where(is_at_side, side, activities)
            s = np.clip(s, blocks.row_lower, blocks.row_upper)
        return np.concatenate((x, y, s[blocks.ranges]))

    def names(self, n: int, purpose: str = FULL) -> Sequence[str]:
        """Return the names of the components of z, "" where there is none; where they
        are labels, those of multipliers begin with y."""
        m = n - self.variables - self.ranges
        rows = self.names_of_rows or unnamed(m)
        if purpose == LABELS:
            rows = [f"y {name}" if name else "" for name in rows]
        return [
            *(self.columns or unnamed(self.variables)),
            *rows,
            *unnamed(self.ranges),
        ]


def size_of(data: Mapping[str, Any], field: str, minimum: int) -> int:
    raw_value = data.get(field, 0)
    if (
        isinstance(raw_value, bool)
        or not isinstance(raw_value, (int, float))
        or not raw_value >= minimum
        or raw_value % 1 != 0
    ):
        raise ProblemError(
            field, f"is not a number of {field}", f"give an integer from {minimum}"
        )
    return int(raw_value)


def bordered(
    Q: Matrix | None, A: Matrix, ranges: Mask | None = None, sparse: bool = False
) -> Matrix:
    """Return [Q -A' 0; A 0 -E; 0 E' 0] for Q of shape (k, k), or None for zero, with E
    the columns of the identity that `ranges`, of shape (m,), selects; as a sparse or a
    dense matrix."""
    m, k = A.shape
    selected = np.zeros(0, dtype=np.intp) if ranges is None else np.flatnonzero(ranges)
    n = k + m + selected.size
    if not sparse or n <= matrices.FEW_AS_DENSE:
        M = np.zeros((n, n))
        M[:k, :k] = 0.0 if Q is None else matrices.dense(Q)
        A = matrices.dense(A)
        rows = k + selected
        columns = range(k + m, n)
        M[k : k + m, :k], M[:k, k : k + m] = A, -A.T
        M[rows, columns], M[columns, rows] = -1.0, 1.0
        M += 0.0  # no -0
        return matrices.thinned(M, M.size) if sparse else M
    with imports:
        from lcpcli.linalg.compressed_rows import of_entries
    A = matrices.compressed(A)
    numbers = np.arange(n, dtype=A.indices.dtype)
    columns = A.indices
    ones = np.ones(selected.size)
    above = np.repeat(numbers[k : k + m], np.diff(A.indptr))
    selected = numbers[k + selected]
    beyond = numbers[k + m :]
    entries = [
        (columns, above, -A.data),
        (above, columns, A.data),
        (selected, beyond, -ones),
        (beyond, selected, ones),
    ]
    if Q is not None:
        Q = matrices.compressed(Q)
        entries.insert(
            0, (np.repeat(numbers[:k], np.diff(Q.indptr)), Q.indices, Q.data)
        )
    M = of_entries((n, n), *zip(*entries, strict=True))
    if not M.data.all():
        M.eliminate_zeros()
    M.data.setflags(write=False)  # so that it is not copied again
    return M


def sense_of(raw_value: Any) -> str:
    if not isinstance(raw_value, str) or raw_value not in SENSES:
        shown = quoted(raw_value) if isinstance(raw_value, str) else kind(raw_value)
        raise ProblemError("sense", f"is {shown}", "give min or max")
    return raw_value


def rows_between(
    A: Any,
    k: int,
    b: Any,
    row_lower: Any,
    row_upper: Any,
    infinity: float,
) -> tuple[Matrix, tuple[Vector, Vector]]:
    """Return the matrix of rows, of shape (m, k), and their lower and upper sides, or
    raise ProblemError. b : an alternative name of row_lower."""
    if b is not None and row_lower is not None:
        raise ProblemError(
            "b", "is short for row_lower, which is passed too", LEAVE_ONE_OUT
        )
    field, low = ("row_lower", row_lower) if b is None else ("b", b)
    matrix = matrix_of_rows("A", A, k, {field: low, "row_upper": row_upper})
    m = matrix.shape[0]
    return matrix, as_intervals(
        (field, "row_upper"), low, row_upper, m, "row", infinity
    )


def matrix_of_rows(
    field: str, raw_value: Any, k: int, bounds: Mapping[str, Any]
) -> Matrix:
    """Return the matrix of the rows, of shape (m, k), also with m = 0, as if there are
    neither a matrix nor bounds."""
    present = [name for name, bound in bounds.items() if bound is not None]
    if raw_value is None and not present:
        return np.zeros((0, k))
    if raw_value is None:
        raise ProblemError(
            field, IS_MISSING, f"give it with {present[0]}, or leave both out"
        )
    if not present:
        raise ProblemError(
            next(iter(bounds)), IS_MISSING, f"give it with {field}, or leave both out"
        )
    return as_rows(field, raw_value, k, "variable")
