"""Linear and quadratic programs as complementarity problems."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import (
    IS_EMPTY,
    KEEP_ONE,
    ONE_VARIABLE,
    ProblemError,
    kind,
)
from lcpcli.formulations.quadratic_program.program import (
    Program,
    constant_of,
)
from lcpcli.linalg.doubles import EPS, distinct
from lcpcli.linalg.matrices import (
    compressed,
    is_sparse,
    largest_asymmetry,
    stack,
)
from lcpcli.model.arrays import FROM_0, as_square, as_vector, by_label
from lcpcli.model.block_form import (
    Blocks,
    matrix_of_rows,
    rows_between,
    sense_of,
    symmetrized,
)
from lcpcli.model.box import NO_BOUND, as_intervals
from lcpcli.model.formulation import names_of
from lcpcli.model.problem import Problem
from lcpcli.typing import BoundLike, Indices, Matrix, Vector, VectorLike

Interval: TypeAlias = tuple[Vector, Vector]

# Up to this many variables, a program without any matrix becomes a dense problem.
MAX_DENSE_VARIABLES = 1000


def from_qp(
    Q: Any,
    c: VectorLike,
    A: Any = None,
    b: VectorLike | None = None,
    *,
    row_lower: BoundLike = None,
    row_upper: BoundLike = None,
    lower: BoundLike = 0.0,
    upper: BoundLike = None,
    free: Sequence[int] = (),
    sense: str = "min",
    constant: float = 0.0,
    rows: Sequence[str] = (),
    columns: Sequence[str] = (),
    infinity: float = math.inf,
    **texts: str,
) -> Problem:
    """Return the conditions of min x'Qx / 2 + c'x + constant, row_lower <= Ax <=
    row_upper and lower <= x <= upper.

    Q : shape (k, k), symmetric, also only up to k eps max|Q| as rounding leaves it, for
        which (Q + Q') / 2 is used; dense, nested sequences or scipy sparse; None for a
        linear program. If Q is positive semidefinite, the solutions of the conditions
        are the minimizers, else they are the stationary points.
    c : shape (k,).
    A : shape (m, k), or None if there are only bounds.
    row_lower, row_upper : numbers or of shape (m,); None, or infinite, for no bound.
        They are equal for an equation.
    b : the same as row_lower, for a program with Ax >= b.
    lower, upper : numbers or of shape (k,), by default 0 and no bound.
    free : indices of the x_i without bounds, instead of lower and upper.
    sense : "min", or "max", for which Q should be negative semidefinite.
    rows, columns : optional names of the rows of A and of the variables.
    infinity : bounds of at least this size, often 1e20, also those of rows, are treated
        as infinite; by default only infinite bounds do.
    texts : name, source and note of the problem.

    The unknowns are z = (x, y, s), where y are the multipliers of the rows and s = Ax
    for rows between two different bounds; `Result.answer` maps them back. Raises
    ProblemError, which names the field at fault.

    >>> import lcpcli
    >>> sides = {"row_lower": 1, "row_upper": 1}
    >>> problem = lcpcli.from_qp([[2, 0], [0, 2]], [-3, 1], [[1, 1]], **sides)
    >>> answer = lcpcli.run(problem).answer
    >>> answer.x.tolist(), answer.y.tolist(), answer.objective
    ([1.0, 0.0], [-1.0], -2.0)
    """
    b, row_lower, row_upper = by_label(
        A, "the rows of A", b=b, row_lower=row_lower, row_upper=row_upper
    )
    of, table = (
        ("the columns of Q", Q) if hasattr(Q, "columns") else ("the columns of A", A)
    )
    (A,) = by_label(table, of, "columns", A=A)
    Q, c, lower, upper = by_label(table, of, Q=Q, c=c, lower=lower, upper=upper)
    quadratic, linear = _objective("Q", Q, "c", c)
    k, sense = linear.size, sense_of(sense)
    low, high = as_intervals(("lower", "upper"), lower, upper, k, "variable", infinity)
    low = low.copy()  # it may be the argument itself
    low[_free_indices(free, lower, upper, k)] = -np.inf
    matrix, sides = rows_between(A, k, b, row_lower, row_upper, infinity)
    m = matrix.shape[0]
    names = (
        names_of("rows", rows, m, "row"),
        names_of("columns", columns, k, "variable"),
    )
    return _problem(
        quadratic,
        linear,
        matrix,
        sides,
        (low, high),
        texts,
        sense,
        constant_of(constant),
        *names,
    )


def _free_indices(free: Any, lower: BoundLike, upper: BoundLike, k: int) -> Indices:
    """Return the indices of the variables that the user has declared free. Raises
    ProblemError if they are no distinct indices, or the user has set bounds, too.
    """
    if not isinstance(free, (list, tuple, range, np.ndarray)):
        raise ProblemError("free", f"is {kind(free)}", "give a list of indices")
    if not len(free):
        return np.zeros(0, dtype=np.intp)
    indices = as_vector("free", list(free))
    if upper is not None or not (isinstance(lower, (int, float)) and lower == 0):
        other = "lower" if upper is None else "upper"
        hint = f"leave it out, and give null for no bound in {other}"
        raise ProblemError("free", f"cannot be combined with {other}", hint)
    is_wrong = (indices < 0) | (indices >= k) | (indices != np.floor(indices))
    if is_wrong.any():
        i = int(is_wrong.argmax())
        hint = f"indices are integers from 0 to {k - 1}"
        raise ProblemError(f"free[{i}]", f"is {indices[i]:g}", hint)
    positions = indices.astype(np.intp)
    if distinct(positions).size < positions.size:
        raise ProblemError("free", "names an index twice", KEEP_ONE)
    return positions


def from_qpsolvers(
    P: Any,
    q: VectorLike,
    G: Any = None,
    h: VectorLike | None = None,
    A: Any = None,
    b: VectorLike | None = None,
    lb: BoundLike = None,
    ub: BoundLike = None,
    *,
    infinity: float = math.inf,
    **texts: str,
) -> Problem:
    """Return the conditions of min x'Px / 2 + q'x, Gx <= h, Ax = b and lb <= x <= ub,
    in the notation of qpsolvers.

    P : shape (k, k), symmetric, up to rounding as Q of `from_qp` is; dense, nested
        sequences or scipy sparse; None for a linear program.
    q : shape (k,).
    G, h : shapes (m, k) and (m,), or both None; A, b : shapes (p, k) and (p,), or both
        None.
    lb, ub : numbers or of shape (k,); None, or infinite, for no bound, so that x is
        free by default.
    infinity : lb, ub and h of at least this size, often 1e20, are treated as infinite;
        by default only infinite ones do.
    texts : name, source and note of the problem.

    The multipliers in `Result.answer` are those of the m rows of G, followed by those
    of the p rows of A. (S. Caron et al., qpsolvers: quadratic programming solvers in
    Python.) Raises ProblemError, which names the field at fault.

    >>> import lcpcli
    >>> P = [[2, 0], [0, 2]]
    >>> problem = lcpcli.from_qpsolvers(P, [-3, 1], A=[[1, 1]], b=[1], lb=0)
    >>> lcpcli.run(problem).answer.x.tolist()
    [1.0, 0.0]
    """
    of = "the columns of P"
    (h,), (b,) = by_label(G, "the rows of G", h=h), by_label(A, "the rows of A", b=b)
    G, A = by_label(P, of, "columns", G=G, A=A)
    P, q, lb, ub = by_label(P, of, P=P, q=q, lb=lb, ub=ub)
    quadratic, linear = _objective("P", P, "q", q)
    k = linear.size
    bounds = as_intervals(("lb", "ub"), lb, ub, k, "variable", infinity)
    below = matrix_of_rows("G", G, k, {"h": h})
    equal = matrix_of_rows("A", A, k, {"b": b})
    lowest, highest = as_intervals(("h", "h"), None, h, below.shape[0], "row", infinity)
    value = as_vector("b", [] if b is None else b, equal.shape[0], "row")
    if is_sparse(equal):
        below = compressed(below)
    sides = np.concatenate((lowest, value)), np.concatenate((highest, value))
    return _problem(quadratic, linear, stack([[below], [equal]]), sides, bounds, texts)


def from_osqp(
    P: Any,
    q: VectorLike,
    A: Any = None,
    l: BoundLike = None,  # noqa: E741 (its name there)
    u: BoundLike = None,
    **texts: str,
) -> Problem:
    """Return the conditions of min x'Px / 2 + q'x and l <= Ax <= u, in the notation of
    OSQP.

    P : shape (k, k), symmetric, up to rounding as Q of `from_qp` is, or its upper
        triangle; dense, nested sequences or scipy sparse; None for a linear program.
    q : shape (k,).
    A : shape (m, k), or None if there are no rows. Bounds on x are written as rows;
        otherwise x is free.
    l, u : numbers or of shape (m,); None, or a size of 1e20 or more, for no bound.
    texts : name, source and note of the problem.

    The multipliers in `Result.answer` are minus those of OSQP. (B. Stellato et al.,
    OSQP: an operator splitting solver for quadratic programs.) Raises ProblemError,
    which names the field at fault.

    >>> import lcpcli
    >>> P, A = [[2, 0], [0, 2]], [[1, 1], [0, 1]]
    >>> problem = lcpcli.from_osqp(P, [-3, 1], A, l=[1, 0], u=[1, 1e20])
    >>> lcpcli.run(problem).answer.x.tolist()
    [1.0, 0.0]
    """
    l, u = by_label(A, "the rows of A", l=l, u=u)  # noqa: E741
    table, of = (A, "the columns of A") if P is None else (P, "the columns of P")
    (A,) = by_label(table, of, "columns", A=A)
    P, q = by_label(table, of, P=P, q=q)
    quadratic, linear = _objective("P", P, "q", q, may_be_triangle=True)
    k = linear.size
    matrix = matrix_of_rows("A", A, k, {"l": l, "u": u})
    sides = as_intervals(("l", "u"), l, u, matrix.shape[0], "row", NO_BOUND)
    return _problem(
        quadratic,
        linear,
        matrix,
        sides,
        (np.full(k, -np.inf), np.full(k, np.inf)),
        texts,
    )


def _objective(
    field: str, quadratic: Any, other: str, linear: Any, may_be_triangle: bool = False
) -> tuple[Matrix | None, Vector]:
    """Return the matrix of the objective, symmetric and of shape (k, k), or None, and
    its vector, of shape (k,).

    may_be_triangle : whether an upper triangular matrix means the symmetric matrix with
        this triangle.
    """
    vector = as_vector(other, linear)
    if not vector.size:
        raise ProblemError(other, IS_EMPTY, ONE_VARIABLE)
    if quadratic is None:
        return None, vector
    matrix, _ = as_square(field, quadratic, vector.size, other)
    if may_be_triangle:
        matrix = _mirrored_triangle(matrix)
    symmetric = symmetrized(matrix, _rounding_of(quadratic))
    if symmetric is None:
        _, i, j = largest_asymmetry(matrix)
        reason = (
            f"is {matrix[i, j]:.15g} and {field}[{j}][{i}] is {matrix[j, i]:.15g}, so "
            f"that {field} is not symmetric"
        )
        hint = (
            f"for a minimum give ({field} + {field}') / 2; for a variational "
            f"inequality call it H and {other} h, in Python from_avi: see lcp help "
            f"equilibria {FROM_0}"
        )
        raise ProblemError(f"{field}[{i}][{j}]", reason, hint)
    return symmetric, vector


def _rounding_of(matrix: Any) -> float:
    """Return eps of the type of an array, and at least that of double precision."""
    dtype = getattr(matrix, "dtype", None)
    is_narrow = dtype is not None and np.dtype(dtype).kind == "f"
    return max(float(np.finfo(dtype).eps), EPS) if is_narrow else EPS


def _mirrored_triangle(matrix: Matrix) -> Matrix:
    """Return the symmetric matrix with this upper triangle; or the matrix itself if it
    has entries below the diagonal.
    """
    if is_sparse(matrix):
        with imports:
            from scipy.sparse import triu
    else:
        triu = np.triu
    if (triu(matrix.T, 1) != 0).sum():
        return matrix
    return matrix + triu(matrix, 1).T


def _problem(
    Q: Matrix | None,
    c: Vector,
    A: Matrix,
    sides: Interval,
    bounds: Interval,
    texts: Mapping[str, Any],
    *of: Any,
) -> Problem:
    """Return the conditions of a program. Matrices are sparse if A or Q is, or if the
    program is large and has neither.

    of : the sense, constant and names of the program, as in `Program`.
    """
    k = c.size
    if is_sparse(A) or is_sparse(Q) or (Q is None and k > MAX_DENSE_VARIABLES):
        Q, A = compressed((k, k) if Q is None else Q), compressed(A)
    Q = np.zeros((k, k)) if Q is None else Q
    data = Blocks(*((-Q, -c) if "max" in of[:1] else (Q, c)), A, *sides, *bounds)
    M, q, lower, upper = data.conditions()
    problem = Problem(M, q, lower=lower, upper=upper, **texts)
    # `Problem` would check that the origin fits the conditions, which were made from
    # it.
    return problem.having(origin=Program(k, int(data.ranges.sum()), *of))
