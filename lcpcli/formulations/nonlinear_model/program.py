"""Linear and quadratic programs in .nl files: an objective of degree at most two,
linear rows, and no complementarity condition.

Expressions are read as polynomials, which may have terms up to degree two. If the
numbers are fractions, the coefficients are exact.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from typing import Any, TypeAlias

import numpy as np

from lcpcli.errors import KEEP_ONE, ProblemError
from lcpcli.files.fields import LARGEST_DENSE
from lcpcli.files.formats import refuse
from lcpcli.formulations.nonlinear_model.segments import (
    MEANINGS,
    Header,
    Linear,
    Segments,
    Term,
)
from lcpcli.typing import Vector

# The coefficients of the terms; the key of a term lists its variables in ascending
# order.
Polynomial: TypeAlias = dict[tuple[int, ...], Any]

NOT_QUADRATIC = (
    "lcp solves linear and quadratic programs; of others write the optimality "
    "conditions, as complementarity conditions"
)


def is_program(segments: Segments) -> bool:
    """Return whether a file contains a program: it has an objective and no
    complementarity condition. With a constant objective, as many equations as free
    variables are a system instead, which need not be linear.
    """
    if segments.complements or not segments.objectives:
        return False
    if segments.has_objective:
        return True
    equations = [low for low, high in segments.sides if low is not None and low == high]
    rows = [side for side in segments.sides if side != (None, None)]
    fixed = [low for low, high in segments.bounds if low is not None and low == high]
    free = [side for side in segments.bounds if side == (None, None)]
    is_system = len(equations) == len(rows) == len(free)
    return not (is_system and len(free) + len(fixed) == len(segments.bounds))


class NlProgram:
    """A program, made from the segments of a file. Raises ProblemError if it is not
    linear or quadratic.

    sense, costs : "min" or "max", and the polynomial of the objective.
    rows : the polynomials of the rows.
    sides, bounds : the lower and upper bounds of the rows and of the variables; None
        for an absent bound.
    header, unknowns, names, remark : as in `NlModel`, for all variables.
    """

    is_linear = True
    remark = ""
    objective = None  # by which the best of several solutions would be sought

    def __init__(self, segments: Segments) -> None:
        self.header: Header = segments.header
        self.sides, self.bounds = segments.sides, segments.bounds
        self._common = dict[int, Polynomial]()
        for number, (linear, terms) in segments.common.items():
            expression = self._polynomial(linear, terms, f"common expression {number}")
            self._common[self.header.variables + number] = expression
        objectives = [
            (is_maximized, self._polynomial(segments.slopes.get(number, {}), terms, ""))
            for number, (is_maximized, terms) in segments.objectives.items()
        ]
        varying = [each for each in objectives if _degree(each[1])]
        refuse(len(varying) > 1, "", f"has {len(varying)} objectives", KEEP_ONE)
        is_maximized, self.costs = varying[0] if varying else objectives[0]
        self.sense = "max" if is_maximized else "min"
        self.rows = [
            self._polynomial(
                segments.linear.get(row, {}), segments.rows[row], f"C{row}"
            )
            for row in range(self.header.rows)
        ]
        for row, polynomial in enumerate(self.rows):
            refuse(_degree(polynomial) > 1, f"C{row}", "is not linear", NOT_QUADRATIC)

    @property
    def unknowns(self) -> Sequence[int]:
        return range(self.header.variables)

    @property
    def names(self) -> list[str]:
        return [f"v{number}" for number in self.unknowns]

    def values(self, z: Vector) -> Vector:
        return z[: self.header.variables]

    def multipliers(self, z: Vector) -> Vector:
        """Return the multipliers of the rows with the sign of AMPL: the derivatives of
        the optimal value with respect to the bounds of the rows.
        """
        k = self.header.variables
        y = z[k : k + self.header.rows]
        return y if self.sense == "min" else 0 - y

    def fields(self, number: Callable[[Any], float]) -> dict[str, Any]:
        """Return the fields of the program.

        number : converts its numbers to double precision.
        """
        k, m = self.header.variables, len(self.rows)
        is_dense = k + m <= LARGEST_DENSE
        entries = {
            (i, j): value
            for i, polynomial in enumerate(self.rows)
            for (j, *_), value in _terms(polynomial, 1)
        }
        curvature = dict[tuple[int, int], Any]()
        for (i, j), value in _terms(self.costs, 2):
            # x'Qx / 2 has q_ii / 2 x_i^2 and q_ij x_i x_j.
            curvature |= (
                {(i, j): value, (j, i): value} if i != j else {(i, i): 2 * value}
            )
        fields: dict[str, Any] = {
            "sense": self.sense,
            "constant": number(self.costs.get((), 0)),
            "c": np.array([number(self.costs.get((i,), 0)) for i in range(k)]),
            "columns": self.names,
        }
        if curvature:
            fields["Q"] = _matrix(curvature, (k, k), is_dense, number)
        if m:
            fields["A"] = _matrix(entries, (m, k), is_dense, number)
            fields["rows"] = [f"C{row}" for row in range(m)]
        constants = [polynomial.get((), 0) for polynomial in self.rows]
        for keys, sides, shifts in (
            (("row_lower", "row_upper"), self.sides, constants),
            (("lower", "upper"), self.bounds, [0 for _ in range(k)]),
        ):
            for key, bound_index, none in zip(
                keys, (0, 1), (-np.inf, np.inf), strict=True
            ):
                bounds = [
                    none
                    if side[bound_index] is None
                    else number(side[bound_index] - shift)
                    for side, shift in zip(sides, shifts, strict=True)
                ]
                fields |= {key: np.array(bounds)} if bounds else {}
        return fields

    def _polynomial(
        self, linear: Linear, terms: Sequence[Term], where: str
    ) -> Polynomial:
        slopes: Polynomial = {
            (variable,): factor for variable, factor in linear.items()
        }
        try:
            return _sum([slopes, self._expression(terms)])
        except NotQuadratic as error:
            location = where or "the objective"
            reason = f"has {error} in {location}, so that this is no quadratic program"
            raise ProblemError("", reason, NOT_QUADRATIC) from None

    def _expression(self, terms: Sequence[Term]) -> Polynomial:
        stack: list[Polynomial] = []
        for letter, value, size in reversed(terms):
            if letter == "o":
                name = MEANINGS[value][0]
                stack.append(_applied(name, [stack.pop() for _ in range(size)]))
            elif letter == "v":
                stack.append(self._common.get(value, {(value,): 1}))
            elif letter == "p":
                raise NotQuadratic("a piecewise linear function")
            else:
                stack.append({(): value})
        return stack.pop()


class NotQuadratic(Exception):
    """An expression is not a polynomial of degree at most two."""


def _degree(polynomial: Polynomial) -> int:
    return max((len(term) for term, value in polynomial.items() if value), default=0)


def _terms(polynomial: Polynomial, degree: int) -> list[tuple[tuple[int, ...], Any]]:
    return [each for each in polynomial.items() if len(each[0]) == degree and each[1]]


def _sum(parts: Sequence[Polynomial]) -> Polynomial:
    total: Polynomial = {}
    for part in parts:
        for term, value in part.items():
            total[term] = total.get(term, 0) + value
    return total


def _product(a: Polynomial, b: Polynomial) -> Polynomial:
    degree = _degree(a) + _degree(b)
    if degree > 2:
        raise NotQuadratic(f"a term of degree {degree}")
    total: Polynomial = {}
    for term, value in a.items():
        for other, factor in b.items():
            if value and factor:
                key = tuple(sorted(term + other))
                total[key] = total.get(key, 0) + value * factor
    return total


def _applied(name: str, arguments: Sequence[Polynomial]) -> Polynomial:
    """Return the value of an operator for polynomials. Raises NotQuadratic if it is not
    a polynomial of degree at most two.
    """
    constants = [part.get((), 0) for part in arguments if not _degree(part)]
    are_constant = len(constants) == len(arguments)
    if name in ("+", "sum"):
        return _sum(arguments)
    if name in ("-", "negative"):
        *first, last = arguments
        return _sum([*first, {term: -value for term, value in last.items()}])
    if name == "*":
        return reduce(_product, arguments)
    if name == "/" and not _degree(arguments[1]) and (divisor := constants[-1]):
        return {term: value / divisor for term, value in arguments[0].items()}
    if name == "square":
        return _product(arguments[0], arguments[0])
    if name == "^" and not _degree(arguments[1]) and constants[-1] in (1, 2):
        return reduce(_product, int(constants[-1]) * [arguments[0]])
    what = "of constants" if are_constant else "of variables"
    raise NotQuadratic(f"the operator {name} {what}")


def _matrix(
    entries: Mapping[tuple[int, int], Any],
    shape: tuple[int, int],
    is_dense: bool,
    number: Callable[[Any], float],
) -> Any:
    from scipy.sparse import csr_array

    rows, columns = zip(*entries, strict=True) if entries else ((), ())
    values = np.array([number(value) for value in entries.values()], np.float64)
    matrix = csr_array((values, (rows, columns)), shape=shape)
    return matrix.toarray() if is_dense else matrix
