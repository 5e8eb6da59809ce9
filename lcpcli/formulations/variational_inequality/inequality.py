"""An affine variational inequality as a mixed problem. Its conditions are those of a
program with the gradient Hx + h, although H need not be symmetric.

F. Facchinei, J.-S. Pang, Finite-Dimensional Variational Inequalities and
Complementarity Problems (2003), sections 1.2 and 1.3.1.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lcpcli.clock import imports
from lcpcli.errors import IS_EMPTY, ONE_VARIABLE, ProblemError
from lcpcli.files import fields as files
from lcpcli.files.formats import refuse
from lcpcli.linalg.matrices import compressed, is_sparse
from lcpcli.model.arrays import as_square, as_vector, by_label
from lcpcli.model.block_form import BlockForm, Blocks, rows_between
from lcpcli.model.box import as_intervals
from lcpcli.model.formulation import Proposal, names_of
from lcpcli.model.formulations import TEXTS
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.typing import BoundLike, VectorLike

SIDES = ("row_lower", "row_upper", "lower", "upper")
KEYS = ("H", "h", "A", "b", *SIDES, "rows", "columns", *TEXTS)


def from_avi(
    H: Any,
    h: VectorLike,
    A: Any = None,
    b: VectorLike | None = None,
    *,
    row_lower: BoundLike = None,
    row_upper: BoundLike = None,
    lower: BoundLike = 0.0,
    upper: BoundLike = None,
    rows: Sequence[str] = (),
    columns: Sequence[str] = (),
    infinity: float = math.inf,
    **texts: Any,
) -> Problem:
    """Return the conditions of an affine variational inequality: find x in C with (Hx +
    h)'(y - x) >= 0 for all y in C, the x with row_lower <= Ax <= row_upper and lower <=
    x <= upper.

    H : shape (k, k), symmetric or not; dense, nested sequences or scipy sparse.
    h : shape (k,).
    A : shape (m, k), or None if there are only bounds.
    row_lower, row_upper : numbers or of shape (m,); None, or infinite, for no bound.
        They are equal for an equation.
    b : the same as row_lower, for Ax >= b.
    lower, upper : numbers or of shape (k,), by default 0 and no bound.
    rows, columns : optional names of the rows of A and of the variables.
    infinity : bounds of at least this size, also those of rows, are treated as
        infinite.
    texts : name, source and note of the problem.

    The unknowns are z = (x, y, s), where y are the multipliers of the rows and s = Ax
    for rows between two different bounds. If H is symmetric, these are the first-order
    conditions of min x'Hx / 2 + h'x. `Result.answer` has x and y, and what is proved:
    whether x solves, whether H is monotone on the affine hull of C, and whether there
    are other solutions. Raises ProblemError, which names the field at fault.

    >>> import lcpcli
    >>> H, sides = [[2, 1], [-1, 2]], {"row_upper": 2}
    >>> problem = lcpcli.from_avi(H, [-4, -4], [[1, 1]], **sides)
    >>> answer = lcpcli.run(problem).answer
    >>> answer.x.round(6).tolist(), answer.y.round(6).tolist()
    ([0.5, 1.5], [-1.5])
    """
    b, row_lower, row_upper = by_label(
        A, "the rows of A", b=b, row_lower=row_lower, row_upper=row_upper
    )
    of = "the columns of H"
    (A,) = by_label(H, of, "columns", A=A)
    H, h, lower, upper = by_label(H, of, H=H, h=h, lower=lower, upper=upper)
    vector = as_vector("h", h)
    if not (k := vector.size):
        raise ProblemError("h", IS_EMPTY, ONE_VARIABLE)
    matrix, _ = as_square("H", H, k, "h")
    bounds = as_intervals(("lower", "upper"), lower, upper, k, "variable", infinity)
    A, sides = rows_between(A, k, b, row_lower, row_upper, infinity)
    if is_sparse(A) or is_sparse(matrix):
        matrix, A = compressed(matrix), compressed(A)
    blocks = Blocks(matrix, vector, A, *sides, *bounds)
    of_rows = names_of("rows", rows, A.shape[0], "row")
    of_columns = names_of("columns", columns, k, "variable")
    M, q, low, high = blocks.conditions()
    origin = Inequality(k, int(blocks.ranges.sum()), of_rows, of_columns)
    # `Problem` would check that the origin fits the conditions, which were made from
    # it.
    return Problem(M, q, lower=low, upper=high, **texts).having(origin=origin)


@dataclass(frozen=True)
class Inequality(BlockForm):
    """The variational inequality whose conditions are those of `Blocks`, with H and h
    instead of Q and c."""

    variables: int
    ranges: int = 0
    rows: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()

    kind = "avi"
    form = "written as the conditions of the variational inequality,"
    inverse = "answers"

    @classmethod
    def of_fields(cls, fields: Mapping[str, Any]) -> Problem:
        files.refuse_unknown("", fields, KEYS, "a variational inequality")
        for key in ("H", "h"):
            refuse(fields[key] is None, key, "is null", "give its numbers")
        return from_avi(**files.without_nulls(fields))

    def fields(self, problem: Problem, *, in_text: bool) -> dict[str, Any] | None:
        del in_text
        blocks = self.blocks(conditions_of(problem))
        return None if blocks is None else self.fields_of(blocks, "H", "h")

    def proposed(self, problem: Problem) -> Proposal | None:
        blocks = self.blocks(conditions_of(problem))
        if blocks is None:
            return None
        proposal: Proposal | None = self.sibling("active_set").proposed(blocks)
        return proposal

    def verified(self, proposed: Any) -> Any:
        with imports:
            from lcpcli.verify.blocks import verified
        return verified(self, proposed)
