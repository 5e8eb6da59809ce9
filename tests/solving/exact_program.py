"""The exact verdict about small linear programs, and their minimum, by duality in fractions."""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import numpy as np

from lcpcli.typing import Vector

from .. import exact

Row = list[Fraction]


class LinearProgram(NamedTuple):
    """min c'x with row_lower <= A x <= row_upper and lower <= x <= upper, in doubles that count as they are."""

    c: Vector
    A: Vector
    row_lower: Vector
    row_upper: Vector
    lower: Vector
    upper: Vector

    def ends(self) -> list[tuple[Row, Fraction]]:
        """Rows g and numbers h for which the conditions are g'x >= h."""
        G = np.vstack((self.A, np.eye(self.c.size)))
        low, high = np.append(self.row_lower, self.lower), np.append(self.row_upper, self.upper)
        rows = [*zip(G.tolist(), low.tolist(), strict=True), *zip((-G).tolist(), (-high).tolist(), strict=True)]
        return [(list(map(Fraction, row)), Fraction(end)) for row, end in rows if np.isfinite(end)]


class Verdict(NamedTuple):
    """optimal, infeasible or unbounded; the minimum if there is one."""

    word: str
    minimum: Fraction | None = None


def verdict(program: LinearProgram) -> Verdict:
    """By x = x+ - x- and a slack for each condition, and beside it a y >= 0 with G'y = c and h'y = c'x."""
    ends, n = program.ends(), program.c.size
    m, c = len(ends), [Fraction(value) for value in program.c.tolist()]
    h, none = [end for _, end in ends], [Fraction(0)] * len(ends)
    primal = [[*row, *(-a for a in row), *(Fraction(-(i == k)) for k in range(m))] for i, (row, _) in enumerate(ends)]
    if not m:
        return Verdict("unbounded") if any(c) else Verdict("optimal", Fraction(0))
    if exact.nonnegative(primal, h) is None:
        return Verdict("infeasible")
    dual = [[*([Fraction(0)] * 2 * n), *none, *(row[j] for row, _ in ends)] for j in range(n)]
    gap = [*c, *(-value for value in c), *none, *(-end for end in h)]
    x = exact.nonnegative([*([*row, *none] for row in primal), *dual, gap], [*h, *c, Fraction(0)])
    if x is None:
        return Verdict("unbounded")
    return Verdict("optimal", sum((value * (a - b) for value, a, b in zip(c, x[:n], x[n:], strict=False)), Fraction(0)))


def fault(program: LinearProgram, x: Vector, minimum: Fraction, tol: Fraction) -> str:
    """What is wrong with x as a minimizer, relative to the terms of each row and of the objective; "" if nothing is."""
    point = [Fraction(value) for value in x.tolist()]
    if not ((program.lower <= x) & (x <= program.upper)).all():
        return "a bound is violated"
    for row, end in program.ends():
        terms = [a * value for a, value in zip(row, point, strict=True)]
        if end - sum(terms) > tol * max(sum(map(abs, terms), Fraction(0)), abs(end)):
            return "a row is violated"
    terms = [Fraction(a) * value for a, value in zip(program.c.tolist(), point, strict=True)]
    wrong = abs(sum(terms, Fraction(0)) - minimum) > tol * max(sum(map(abs, terms), Fraction(0)), abs(minimum))
    return "the objective is not the minimum" if wrong else ""
