"""Linear and quadratic programs: R. W. Cottle, G. B. Dantzig, Complementary pivot
theory of mathematical programming, Linear Algebra Appl. 1 (1968) 103-125; with bounds
on both sides as in F. Facchinei, J.-S. Pang, Finite-Dimensional Variational
Inequalities and Complementarity Problems (2003), section 1.3.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

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
    is_sparse,
    is_symmetric,
    largest_asymmetry,
    symmetric_part,
)
from lcpcli.model.block_form import BlockForm, Blocks, size_of
from lcpcli.model.box import as_intervals
from lcpcli.model.formulation import Conditions, names_of
from lcpcli.typing import Matrix, Vector

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


class ProgramData(Blocks):
    """min x'Qx / 2 + c'x subject to row_lower <= Ax <= row_upper and lower <= x <=
    upper, for k variables and m rows, in the order of `Blocks`; Q is symmetric.

    Of its first-order conditions in z = (x, y, s), y are the multipliers.
    """

    __slots__ = ()

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


@dataclass(frozen=True)
class Program(BlockForm):
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
            size_of(data, "variables", 1),
            size_of(data, "ranges", 0),
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
        found = self.blocks_that_fit(given)
        return found is not None and symmetrized(found.Q) is not None

    def program(self, given: Conditions) -> ProgramData | None:
        """Return the program, to be minimized, whose conditions these are; None if
        there is none."""
        found = self.blocks(given)
        return None if found is None else ProgramData(*found)

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
