"""Linear and quadratic programs: R. W. Cottle, G. B. Dantzig, Complementary pivot
theory of mathematical programming, Linear Algebra Appl. 1 (1968) 103-125; with bounds
on both sides as in F. Facchinei, J.-S. Pang, Finite-Dimensional Variational
Inequalities and Complementarity Problems (2003), section 1.3.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import (
    GIVE_FINITE,
    GIVE_NUMBER,
    ProblemError,
    kind,
    quoted,
    refuse_unknown,
)
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.matrices import (
    are_equal,
    is_sparse,
    is_symmetric,
    largest_asymmetry,
    symmetric_part,
)
from lcpcli.model.box import as_intervals
from lcpcli.model.formulation import FULL, LABELS, Conditions, Formulation, names_of
from lcpcli.typing import Mask, Matrix, Vector

PROGRAM_KEYS = ("kind", "variables", "ranges", "sense", "constant", "rows", "columns")
SENSES = {"min": 1.0, "max": -1.0}
CANCELLED = 1e-12  # of an objective: rounding of its terms that counts


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


class ProgramData(NamedTuple):
    """min x'Qx / 2 + c'x subject to row_lower <= Ax <= row_upper and lower <= x <=
    upper, for k variables and m rows.

    Q, A : shapes (k, k) and (m, k), both dense or both in compressed sparse rows; Q
        symmetric.
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

    @np.errstate(over="ignore", invalid="ignore")
    def objective(self, x: Vector) -> float:
        """Return x'Qx / 2 + c'x: with more digits than doubles have where terms
        cancel, as those of a large x with Qx near 0 do."""
        value = float(x @ matrices.product(self.Q, x) / 2 + self.c @ x)
        sizes = np.abs(x)
        of_Q = sizes @ matrices.absolute_product(self.Q, sizes) / 2
        terms = float(of_Q + np.abs(self.c) @ sizes)
        if not EPS * terms > CANCELLED * abs(value) or not math.isfinite(terms):
            return value
        slopes = matrices.accurate_residual(self.Q, -x, 2 * self.c)
        return float(matrices.accurate_residual(x[None], slopes, np.zeros(1))[0]) / -2

    def with_infinity(self, infinity: float) -> ProgramData:
        """Return the program without bounds and sides of rows of at least that size, or
        raise ProblemError."""
        rows, variables = (self.row_lower, self.row_upper), (self.lower, self.upper)
        rows = as_intervals(
            ("row_lower", "row_upper"), *rows, self.row_lower.size, "row", infinity
        )
        variables = as_intervals(
            ("lower", "upper"), *variables, self.c.size, "variable", infinity
        )
        return ProgramData(self.Q, self.c, self.A, *rows, *variables)

    def conditions(self) -> Conditions:
        """Return the first-order conditions in z = (x, y, s).

        y_i is the multiplier of row i: free for an equation, y_i >= 0 or <= 0 for a row
        with only a lower or an upper bound, 0 for a row without bounds; w is then Ax
        minus the bound. For a row i between two bounds, y_i is free and w_i = (Ax)_i -
        s_i, where s_i, within the bounds, has w = y_i.
        """
        m, ranges = self.row_lower.size, self.ranges
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
        M = bordered(self.Q, self.A, ranges, is_sparse(self.A)) if m else self.Q
        return Conditions(M, q, lower, upper)


@dataclass(frozen=True)
class Program(Formulation):
    """The data that map a solution z = (x, y, s) of the conditions of a `ProgramData`
    back to the original program.

    variables, ranges : the lengths of x and of s, the number of rows between two
        different finite bounds.
    sense : "min" or "max"; the objective to be maximized has been multiplied by -1.
        constant : is added to it.
    rows, columns : the names of the rows of A and of its columns, the variables; empty
        if they have none.
    """

    variables: int
    ranges: int = 0
    sense: str = "min"
    constant: float = 0.0
    rows: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()

    kind = "qp"
    form = "written as the program's optimality conditions,"
    left_out = ("objective",)

    @classmethod
    def parse(cls, data: Mapping[str, Any]) -> Program:
        refuse_unknown("", data, PROGRAM_KEYS)
        rows, columns = (
            names_of(key, data.get(key, ())) for key in ("rows", "columns")
        )
        k, ranges = (
            _number_of("variables", data.get("variables"), 1),
            _number_of("ranges", data.get("ranges", 0), 0),
        )
        sense, constant = (
            sense_of(data.get("sense", "min")),
            constant_of(data.get("constant", 0.0)),
        )
        return cls(k, ranges, sense, constant, rows, columns)

    def data(self) -> dict[str, Any]:
        fields = {
            "kind": "qp",
            "variables": self.variables,
            "ranges": self.ranges,
            "constant": self.constant,
        }
        fields |= {"rows": list(self.rows), "columns": list(self.columns)}
        fields |= {"sense": self.sense if self.sense != "min" else ""}
        return {key: value for key, value in fields.items() if value}

    def fits(self, given: Conditions) -> bool:
        """Return whether the problem is made from a program of this size, and the
        number of names fits it."""
        k, m = self.variables, given.q.size - self.variables - self.ranges
        if m < self.ranges or any(
            len(names) not in (0, size)
            for names, size in ((self.rows, m), (self.columns, k))
        ):
            return False
        found = self.program(given)
        if (
            found is None
            or int(found.ranges.sum()) != self.ranges
            or symmetrized(found.Q) is None
        ):
            return False
        made = found.conditions()
        return are_equal(made.M, given.M) and all(
            map(np.array_equal, made[1:], given[1:])
        )

    def program(self, given: Conditions) -> ProgramData | None:
        """Return the program, to be minimized, whose conditions these are; None if
        there is none."""
        k, n = self.variables, given.q.size
        M, q, rows = given.M, given.q, slice(k, n - self.ranges)
        low, high = -q[rows] + 0.0, -q[rows] + 0.0
        low[given.upper[rows] == 0], high[given.lower[rows] == 0] = -np.inf, np.inf
        places, columns = M[rows, n - self.ranges :].nonzero()
        if (
            len(columns) != self.ranges
            or (np.sort(columns) != np.arange(self.ranges)).any()
        ):
            return None
        low[places], high[places] = (
            given.lower[n - self.ranges + columns],
            given.upper[n - self.ranges + columns],
        )
        return ProgramData(
            M[:k, :k], q[:k], M[rows, :k], low, high, given.lower[:k], given.upper[:k]
        )

    def symmetric(self, M: Matrix) -> Matrix:
        """Return the M of conditions that `fits` has accepted, with Q symmetric where
        it was so only up to rounding."""
        k = self.variables
        Q = M[:k, :k]
        if (symmetric := symmetrized(Q)) is Q or symmetric is None:
            return M
        with imports:
            from scipy.sparse import lil_array
        other = lil_array(M) if is_sparse(M) else M.copy()
        other[:k, :k] = symmetric
        return other.tocsr() if is_sparse(M) else other

    def signs(self, n: int) -> Vector:
        """Return S of shape (n,), for which S M is symmetric: 1 for variables, -1 for
        multipliers."""
        S = np.ones(n)
        S[self.variables : n - self.ranges] = -1.0
        return S

    def parts(self, z: Any) -> tuple[Any, Any]:
        """Return the x and y in z, a sequence of numbers of any type."""
        return z[: self.variables], z[self.variables : len(z) - self.ranges]

    def reversed(self, n: int) -> range:
        """Return the components of z that have the other sign in the sense of the
        program: y of a maximization."""
        return (
            range(0) if self.sense == "min" else range(self.variables, n - self.ranges)
        )

    def own_parts(self, z: Sequence[Any]) -> tuple[list[Any], list[Any], list[Any]]:
        """Return the x, y and s in z, with y in the sense of the program."""
        x, y = self.parts(z)
        return (
            list(x),
            [value if self.sense == "min" else 0 - value for value in y],
            list(z[len(x) + len(y) :]),
        )

    def z_of(self, x: Vector, y: Vector, program: ProgramData) -> Vector:
        """Return z for x and the multipliers y of the program to be minimized."""
        s = np.clip(program.A @ x, program.row_lower, program.row_upper)[program.ranges]
        return np.concatenate((x, y, s))

    def names(self, n: int, purpose: str = FULL) -> Sequence[str]:
        """Return the names of the components of z, "" where there is none; where they
        are labels, those of multipliers begin with y."""
        m = n - self.variables - self.ranges
        rows = self.rows or [""] * m
        if purpose == LABELS:
            rows = [f"y {name}" if name else "" for name in rows]
        return [
            *(self.columns or [""] * self.variables),
            *rows,
            *[""] * self.ranges,
        ]


def bordered(
    Q: Matrix | None, A: Matrix, ranges: Mask | None = None, sparse: bool = False
) -> Matrix:
    """Return [Q -A' 0; A 0 -E; 0 E' 0] for Q of shape (k, k), or None for zero, with E
    the columns of the identity that `ranges`, of shape (m,), selects; as a sparse or a
    dense matrix."""
    m, k = A.shape
    selected = np.zeros(0, dtype=np.intp) if ranges is None else np.flatnonzero(ranges)
    n = k + m + selected.size
    if not sparse:
        M = np.zeros((n, n))
        M[:k, :k] = 0.0 if Q is None else Q
        A, rows, columns = matrices.dense(A), k + selected, range(k + m, n)
        M[k : k + m, :k], M[:k, k : k + m] = A, -A.T
        M[rows, columns], M[columns, rows] = -1.0, 1.0
        return M + 0.0  # no -0
    with imports:
        from lcpcli.linalg.compressed_rows import of_entries
    A = matrices.compressed(A)
    numbers, columns, ones = (
        np.arange(n, dtype=A.indices.dtype),
        A.indices,
        np.ones(selected.size),
    )
    above, selected, beyond = (
        np.repeat(numbers[k : k + m], np.diff(A.indptr)),
        numbers[k + selected],
        numbers[k + m :],
    )
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


def sense_of(given: Any) -> str:
    if not isinstance(given, str) or given not in SENSES:
        raise ProblemError(
            "sense",
            f"is {quoted(given) if isinstance(given, str) else kind(given)}",
            "give min or max",
        )
    return given


def constant_of(given: Any) -> float:
    if isinstance(given, (bool, np.bool_)) or not isinstance(
        given, (int, float, np.integer, np.floating)
    ):
        raise ProblemError("constant", f"is {kind(given)}", GIVE_NUMBER)
    if not math.isfinite(given):
        raise ProblemError("constant", "is not a finite number", GIVE_FINITE)
    return float(given)


def _number_of(field: str, given: Any, least: int) -> int:
    if (
        isinstance(given, bool)
        or not isinstance(given, (int, float))
        or not given >= least
        or given % 1 != 0
    ):
        raise ProblemError(
            field, f"is not a number of {field}", f"give a whole number from {least}"
        )
    return int(given)
