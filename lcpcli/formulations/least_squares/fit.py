"""Linear least squares with bounds and equations as a mixed problem, without A'A.

    min |A x - b|^2 / 2  subject to  lower <= x <= upper,  E x = d.

With the residual r = b - A x as an unknown, the optimality conditions are linear in the
numbers of A, b, E and d: A. Bjorck, Numerical Methods for Least Squares Problems
(1996), sections 1.4 (the augmented system) and 5.2 (bounds).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import MAKE_AGREE, ProblemError, numbers_for, refuse_unknown
from lcpcli.files import fields as files
from lcpcli.linalg.matrices import compressed, dense, is_sparse
from lcpcli.model.arrays import (
    ROWS,
    as_columns,
    as_matrix,
    as_rows,
    as_vector,
    by_label,
    has_rows,
    plain,
    readonly_copy,
    readonly_matrix,
    texts,
)
from lcpcli.model.box import as_bound, as_intervals
from lcpcli.model.formulation import (
    FULL,
    LABELS,
    Conditions,
    Formulation,
    names_of,
    unnamed,
)
from lcpcli.model.formulations import TEXTS
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.model.right_hand_sides import dimensions
from lcpcli.typing import BoundLike, Matrix, Vector, VectorLike

MAX_DENSE_UNKNOWNS = 200  # up to here M is stored dense, as pivoting is fast then
COEFFICIENT = "coefficient"
KEYS = ("A", "b", "lsq", "lower", "upper", "E", "d", "columns", *TEXTS)


class Data(NamedTuple):
    """The problem min |A x - b|^2 / 2 with lower <= x <= upper and E x = d, for m
    measurements, n coefficients and k equations.

    A, E : shapes (m, n) and (k, n), both dense or both in compressed sparse rows.
    b, d : shapes (m,) and (k,). lower, upper : shape (n,); bounds may be infinite.
    """

    A: Matrix
    b: Vector
    lower: Vector
    upper: Vector
    E: Matrix
    d: Vector

    def conditions(self) -> Conditions:
        """Return the optimality conditions in z = (r, x, y), as written in
        `LeastSquares`.
        """
        m, k = self.b.size, self.d.size
        n = self.lower.size
        free = np.inf
        lower = np.concatenate((np.full(m, -free), self.lower, np.full(k, -free)))
        upper = np.concatenate((np.full(m, free), self.upper, np.full(k, free)))
        q = np.concatenate((-self.b, np.zeros(n), -self.d)) + 0.0  # no -0
        return Conditions(self._matrix(), q, lower, upper)

    def _matrix(self) -> Matrix:
        m, n = self.b.size, self.lower.size
        size = m + n + self.d.size
        x = slice(m, m + n)
        if size <= MAX_DENSE_UNKNOWNS:
            A, E = dense(self.A), dense(self.E)
            M = np.zeros((size, size))
            M[:m, :m] = np.eye(m)
            M[:m, x], M[x, :m] = A, -A.T
            M[m + n :, x], M[x, m + n :] = E, -E.T
            return M + 0.0  # no -0
        with imports:
            from scipy.sparse import block_array, eye_array
        A, E = compressed(self.A), compressed(self.E)
        return block_array(
            [[eye_array(m), A, None], [-A.T, None, -E.T], [None, E, None]],
            format="csr",
        )


def from_lsq(
    A: Any,
    b: VectorLike,
    lower: BoundLike = -math.inf,
    upper: BoundLike = math.inf,
    E: Any = None,
    d: VectorLike | None = None,
    *,
    columns: Sequence[str] = (),
    name: str = "",
    source: str = "",
    note: str = "",
) -> Problem:
    """Return the mixed problem whose solutions are the coefficients x that minimize |A
    x - b|, subject to lower <= x <= upper and E x = d.

    Parameters
    ----------
    A, b : the model, shape (m, n), dense or sparse, and the m measurements. A may have
        more columns than rows, columns that depend on others, or none. A pandas frame
        gives the names of the coefficients.
    lower, upper : each a number or of shape (n,), by default no bounds; lower=0 makes
        it nonnegative least squares.
    E, d : equations E x = d, shapes (k, n) and (k,); a single equation may be a vector
        and a number.
    columns : n texts, the names of the coefficients.
    name, source, note : texts of the problem.

    The unknowns are z = (r, x, y): the residuals r = b - A x, the coefficients, and the
    multipliers of the equations. `Result.answer` has them under their names
    (`lcpcli.lsq` solves such a problem in one call). No product of A with itself is
    formed, so that the answer has the accuracy that the data allow.

    Raises ProblemError, which names the argument at fault.

    >>> import lcpcli
    >>> problem = lcpcli.from_lsq([[1, 1], [1, 2], [1, 3]], [1, 0, 1], lower=0)
    >>> answer = lcpcli.run(problem).answer
    >>> answer.x.round(6).tolist(), round(answer.norm, 6)
    ([0.666667, 0.0], 0.816497)
    """
    if dimensions(b) == 2:
        raise ProblemError(
            "b", "has 2 dimensions", "give one vector; lsq takes several"
        )
    data, labels = data_of(A, b, lower, upper, E, d)
    n = data.A.shape[1]
    names = names_of("columns", columns, n, COEFFICIENT) if len(columns) else labels
    return problem_of(data, LeastSquares(data.b.size, n, names), name, source, note)


def problem_of(
    data: Data, origin: LeastSquares, name: str = "", source: str = "", note: str = ""
) -> Problem:
    """Return the mixed problem with these data. `origin` has to have their sizes."""
    M, q, lower, upper = data.conditions()
    problem = Problem(M, q, name, source=source, note=note, lower=lower, upper=upper)
    # `Problem` would check that the origin fits the conditions, which were made from
    # it.
    return problem.having(origin=origin)


def data_of(
    A: Any,
    b: VectorLike,
    lower: BoundLike = -math.inf,
    upper: BoundLike = math.inf,
    E: Any = None,
    d: VectorLike | None = None,
) -> tuple[Data, tuple[str, ...]]:
    """Return the validated data, and the names of the columns of A, if it has any.
    Raises ProblemError if an argument cannot be used.
    """
    labels: tuple[str, ...] = ()
    if type(A) is not np.ndarray and hasattr(A, "columns"):
        labels = texts(A.columns)
        lower, upper = by_label(A, of="the columns of A", lower=lower, upper=upper)
        (b,) = by_label(A, of="the rows of A", b=b)
        axis = "columns" if hasattr(E, "columns") else "index"  # of a Series, one row
        (E,) = by_label(A, "the columns of A", axis, E=E)
    (d,) = by_label(E, "the rows of E", d=d)
    E = plain("E", E, ROWS)
    matrix = as_matrix("A", A, may_be_empty=True)
    m, n = matrix.shape
    low, high = as_intervals(("lower", "upper"), lower, upper, n, COEFFICIENT)
    vector = _measurements(b, m)
    rows, sides = _equations(E, d, n)
    if is_sparse(matrix) or is_sparse(rows):
        matrix, rows = compressed(matrix), compressed(rows)
    # Answers are computed when they are read: the caller may have changed A by then.
    return Data(
        readonly_matrix(matrix, A),
        readonly_copy(vector, b),
        readonly_copy(low, lower),
        readonly_copy(high, upper),
        readonly_matrix(rows, E),
        readonly_copy(sides, d),
    ), labels


def _measurements(b: Any, m: int) -> Vector:
    """Return b as a vector; or, if it has a column for each of several fits, as a
    matrix.
    """
    if dimensions(b) != 2:
        return as_vector("b", b, m, "row of A")
    columns = as_columns("b", b)
    if len(columns) != m:
        reason = numbers_for(len(columns), "row", m, "row of A")
        raise ProblemError("b", reason, MAKE_AGREE)
    return np.array(columns)


def _equations(E: Any, d: Any, n: int) -> tuple[Matrix, Vector]:
    """Return E and d; if there are no equations, a matrix and a vector without rows."""
    if E is None and d is None:
        return np.zeros((0, n)), np.zeros(0)
    for key, value, other in (("E", E, "d"), ("d", d, "E")):
        if value is None:
            reason = f"is missing, though there is {other}"
            raise ProblemError(key, reason, f"add it, or leave {other} out")
    matrix = as_rows("E", E if has_rows([E]) else [E], n, COEFFICIENT)
    sides = as_vector("d", d if has_rows([d]) else [d], matrix.shape[0], "row of E")
    return matrix, sides


@dataclass(frozen=True)
class LeastSquares(Formulation):
    """The least-squares problem whose minimizers are described by z = (r, x, y):

        r free,              r + A x - b = 0,
        lower <= x <= upper, w = -A'r - E'y,
        y free,              E x - d = 0.

    w contains the multipliers of the bounds, and y those of the equations. Where they
    are unique, they are the derivatives of the minimum of |A x - b|^2 / 2 with respect
    to the active bounds and to d.

    measurements, coefficients : the lengths of r and x.
    columns : the names of the coefficients; empty if they have none.
    """

    measurements: int
    coefficients: int
    columns: tuple[str, ...] = ()

    kind = "lsq"
    has_picture = True
    inverse = "answers"
    form = "written as the optimality conditions of the fit,"

    @classmethod
    def of_fields(cls, fields: Mapping[str, Any]) -> Problem:
        files.refuse_unknown("", fields, KEYS, "a least-squares problem")
        arguments = files.without_nulls(fields)
        flag = arguments.pop("lsq", None)
        # An array of one number in MAT files.
        if isinstance(flag, (str, list)) or np.size(flag) != 1 or not np.all(flag):
            raise ProblemError("lsq", "is not true", "write true, or leave it out")
        for key in ("A", "b"):
            if key not in arguments:
                raise ProblemError(key, "is missing", f"add the key {key}")
        columns = names_of("columns", arguments.pop("columns", ()))
        return from_lsq(**arguments, columns=columns)

    @classmethod
    def parse(cls, data: Mapping[str, Any]) -> LeastSquares:
        refuse_unknown("", data, ("kind", "measurements", "coefficients", "columns"))
        sizes = [data.get(key) for key in ("measurements", "coefficients")]
        for key, size in zip(("measurements", "coefficients"), sizes, strict=True):
            if not isinstance(size, (int, float)) or size < 0 or size % 1:
                raise ProblemError(key, "is no size", "write an integer from 0")
        m, n = (int(size) for size in sizes if size is not None)
        return cls(m, n, names_of("columns", data.get("columns", ()), n, COEFFICIENT))

    def data(self) -> dict[str, Any]:
        sizes = {"measurements": self.measurements, "coefficients": self.coefficients}
        names = {"columns": list(self.columns)} if self.columns else {}
        return {"kind": self.kind, **sizes, **names}

    def fits(self, conditions: Conditions) -> bool:
        m, n = self.measurements, self.coefficients
        if conditions.q.size < m + n:
            return False
        expected = self.fitted(conditions).conditions()
        difference = compressed(conditions.M) - compressed(expected.M)
        return not difference.count_nonzero() and all(
            map(np.array_equal, conditions[1:], expected[1:])
        )

    def of_conditions(self, conditions: Conditions) -> LeastSquares | None:
        """Return this object, which reads b and the bounds from the problem, if the
        conditions have its form: q is 0 in the rows of A'r, and only coefficients have
        bounds. Otherwise return None.
        """
        of_x = self.parts(conditions.q)[1]
        r_lower, _, y_lower = self.parts(conditions.lower)
        r_upper, _, y_upper = self.parts(conditions.upper)
        others = np.concatenate((r_lower, y_lower, -r_upper, -y_upper))
        return None if of_x.any() or (others > -np.inf).any() else self

    def fields(
        self,
        problem: Problem,
        *,
        in_text: bool,  # noqa: ARG002
    ) -> dict[str, Any]:
        data = self.fitted(conditions_of(problem))
        fields: dict[str, Any] = {"A": data.A, "b": data.b, "lsq": True}
        fields |= {"lower": data.lower} if np.isfinite(data.lower).any() else {}
        fields |= {"upper": data.upper} if np.isfinite(data.upper).any() else {}
        fields |= {"E": data.E, "d": data.d} if data.d.size else {}
        return fields | ({"columns": list(self.columns)} if self.columns else {})

    def fitted(self, conditions: Conditions) -> Data:
        """Return the data from which the conditions were made."""
        m, n = self.measurements, self.coefficients
        x, y = slice(m, m + n), slice(m + n, None)
        M, q = conditions.M, conditions.q
        sides = -q[:m] + 0.0, conditions.lower[x], conditions.upper[x]
        return Data(M[:m, x], *sides, M[y, x], -q[y] + 0.0)

    def data_in(self, problem: Problem) -> Data:
        """Return the data of a problem that was made from this object."""
        return self.fitted(conditions_of(problem))

    def parts(self, z: Any) -> tuple[Any, Any, Any]:
        """Return the r, x and y of z, or the corresponding parts of w; the entries of
        the sequence may be numbers of any type.
        """
        m, stop = self.measurements, self.measurements + self.coefficients
        return z[:m], z[m:stop], z[stop:]

    def names(self, n: int, purpose: str = FULL) -> Sequence[str]:
        """Return the names of the components of z. Residuals and multipliers have none,
        except for labels, which are never empty.
        """
        m = self.measurements
        k = n - m - self.coefficients
        if purpose != LABELS:
            return ["", *[""] * (m - 1), *self.coefficient_names(), *unnamed(k)]
        r, y = (
            [f"{letter}{i + 1}" for i in range(size)]
            for letter, size in (("r", m), ("y", k))
        )
        return [*r, *self.coefficient_names(), *y]

    def coefficient_names(self) -> Sequence[str]:
        return self.columns or [f"x{j + 1}" for j in range(self.coefficients)]

    def bounds(
        self, problem: Problem, user_bounds: Mapping[str, Any]
    ) -> Mapping[str, Any]:
        """Return the bounds of z in which the bounds of the coefficients are those of
        the user.
        """
        bounds = {"lower": problem.lower, "upper": problem.upper}
        new_bounds = {}
        for name, values in user_bounds.items():
            absent = -math.inf if name == "lower" else math.inf
            bound = np.broadcast_to(bounds[name], problem.n).copy()
            of_coefficients = as_bound(
                name, values, self.coefficients, COEFFICIENT, absent
            )
            self.parts(bound)[1][:] = of_coefficients
            new_bounds[name] = bound
        return new_bounds

    def proposed(self, problem: Problem) -> Any:
        return self.sibling("at_once").proposed(self.data_in(problem))

    def lengths(self, problem: Problem) -> dict[int, str]:
        return {problem.n: "z", self.coefficients: "the coefficients x"}
