"""Reduction of a quadratic program to the LCP of its first-order conditions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from lcpcli.errors import ProblemError, count
from lcpcli.model.arrays import FROM_0, as_matrix, as_square, as_vector
from lcpcli.model.problem import Problem
from lcpcli.model.reductions.quadratic_program import QuadraticProgram, indices_of_free


def from_qp(
    Q: Any,
    c: ArrayLike,
    A: Any = None,
    b: ArrayLike | None = None,
    *,
    free: Sequence[int] = (),
    name: str = "",
    source: str = "",
    note: str = "",
) -> Problem:
    """The LCP of the first-order conditions of min x'Qx / 2 + c'x subject to Ax >= b and x >= 0.

    Q : shape (k, k), symmetric; dense, nested sequences or scipy sparse. If it is positive semidefinite, the solutions
        of the LCP are the minimizers, else the first-order stationary points. Zeros for a linear program.
    c : shape (k,).
    A, b : shapes (m, k) and (m,), or both None if x >= 0 is the only constraint.
    free : indices of the x_i that may be negative.

    z = (x, y), with the multipliers y; `Result.answer` maps it back. Raises ProblemError, which names the field.

    >>> import lcpcli
    >>> problem = lcpcli.from_qp([[2, 0], [0, 2]], [-3, 1], [[1, 1]], [1])
    >>> answer = lcpcli.run(problem, "auto").answer
    >>> answer.x.tolist(), answer.objective
    ([1.5, 0.0], -2.25)
    """
    linear = as_vector("c", c)
    k = linear.size
    if not k:
        raise ProblemError("c", "is empty", "give a program with at least one variable")
    quadratic, _ = as_square("Q", Q, k, "c")
    rows, columns = (quadratic != quadratic.T).nonzero()
    if rows.size:
        raise ProblemError(
            f"Q[{rows[0]}][{columns[0]}]", "makes Q unsymmetric", f"give (Q + Q') / 2, the same program {FROM_0}"
        )
    program = QuadraticProgram(k, indices_of_free(free, k))
    if A is None or b is None:
        if (A is None) != (b is None):
            absent, present = ("A", "b") if A is None else ("b", "A")
            raise ProblemError(absent, "is missing", f"give it with {present}, or leave both out")
        M, q = program.conditions(quadratic, linear, None, np.empty(0))
        return Problem(M, q, name=name, source=source, note=note, origin=program)
    matrix, right = as_matrix("A", A), as_vector("b", b)
    if matrix.shape[1] != k:
        raise ProblemError("A", f"has {count(matrix.shape[1], 'column')} for {count(k, 'variable')}", "make them agree")
    if right.size != matrix.shape[0]:
        fault = f"has {count(right.size, 'entry')} where A has {count(matrix.shape[0], 'row')}"
        raise ProblemError("b", fault, "make them agree")
    M, q = program.conditions(quadratic, linear, matrix, right)
    return Problem(M, q, name=name, source=source, note=note, origin=program)
