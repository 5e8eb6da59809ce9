"""The exact verdict about small linear programs, and their minimum: the simplex method with Bland's rule in
fractions."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from lcpcli.typing import Vector

Row = list[Fraction]


class LinearProgram(NamedTuple):
    """min c'x with row_lower <= A x <= row_upper and lower <= x <= upper, in doubles that count as they are."""

    c: Vector
    A: Vector
    row_lower: Vector
    row_upper: Vector
    lower: Vector
    upper: Vector


class Verdict(NamedTuple):
    """optimal, infeasible or unbounded; the minimum if there is one."""

    word: str
    minimum: Fraction | None = None


def verdict(program: LinearProgram) -> Verdict:
    """With x = x+ - x- and a slack for each finite end of a row or a bound."""
    n = program.c.size
    rows, ends = [], []
    for coefficients, low, high in (
        *zip(program.A.tolist(), program.row_lower.tolist(), program.row_upper.tolist(), strict=True),
        *zip(np.eye(n).tolist(), program.lower.tolist(), program.upper.tolist(), strict=True),
    ):
        for end, sign in ((low, -1), (high, 1)):
            if np.isfinite(end):
                rows.append([*map(Fraction, coefficients), *(-Fraction(a) for a in coefficients), sign])
                ends.append(Fraction(end))
    slacks = len(rows)
    A = [[*row[:-1], *(Fraction(row[-1] * (i == k)) for k in range(slacks))] for i, row in enumerate(rows)]
    c = [Fraction(value) for value in program.c.tolist()]
    return _simplex(A, ends, [*c, *(-value for value in c), *([Fraction(0)] * slacks)])


def _simplex(A: list[Row], b: Row, c: Row) -> Verdict:
    m, n = len(A), len(c)
    rows = [
        [*(a if end >= 0 else -a for a in row), *(Fraction(i == k) for k in range(m)), abs(end)]
        for i, (row, end) in enumerate(zip(A, b, strict=True))
    ]
    basis = list(range(n, n + m))
    _minimize(rows, basis, [*([Fraction(0)] * n), *([Fraction(1)] * m)], n + m)
    if any(row[-1] for row, j in zip(rows, basis, strict=True) if j >= n):
        return Verdict("infeasible")
    for i in range(m):
        entering = next((j for j in range(n) if rows[i][j]), None) if basis[i] >= n else None
        if entering is not None:
            _pivot(rows, basis, i, entering)
    if not _minimize(rows, basis, [*c, *([Fraction(0)] * m)], n):
        return Verdict("unbounded")
    return Verdict("optimal", sum((c[j] * row[-1] for row, j in zip(rows, basis, strict=True) if j < n), Fraction(0)))


def _minimize(rows: list[Row], basis: list[int], c: Row, columns: int) -> bool:
    """Pivot to a minimum; False if there is none."""
    while True:
        prices = [(c[basis[i]], row) for i, row in enumerate(rows) if c[basis[i]]]
        entering = next((j for j in range(columns) if c[j] < sum((p * row[j] for p, row in prices), Fraction(0))), None)
        if entering is None:
            return True
        ratios = [(row[-1] / row[entering], basis[i], i) for i, row in enumerate(rows) if row[entering] > 0]
        if not ratios:
            return False
        _pivot(rows, basis, min(ratios)[2], entering)


def _pivot(rows: list[Row], basis: list[int], leaving: int, entering: int) -> None:
    rows[leaving] = [value / rows[leaving][entering] for value in rows[leaving]]
    for i, row in enumerate(rows):
        if i != leaving and row[entering]:
            rows[i] = [a - row[entering] * b for a, b in zip(row, rows[leaving], strict=True)]
    basis[leaving] = entering


def fault(program: LinearProgram, x: Sequence[float], minimum: Fraction, tol: Fraction) -> str:
    """What is wrong with x as a minimizer, relative to the terms of each row and of the objective; "" if nothing is."""
    point = [Fraction(value) for value in x]
    for value, low, high in zip(x, program.lower.tolist(), program.upper.tolist(), strict=True):
        if not low <= value <= high:
            return "a bound is violated"
    for row, low, high in zip(program.A.tolist(), program.row_lower.tolist(), program.row_upper.tolist(), strict=True):
        terms = [Fraction(a) * value for a, value in zip(row, point, strict=True)]
        size = sum(map(abs, terms), Fraction(0))
        for end, sign in ((low, 1), (high, -1)):
            if np.isfinite(end) and sign * (Fraction(end) - sum(terms)) > tol * max(size, abs(Fraction(end))):
                return "a row is violated"
    terms = [Fraction(a) * value for a, value in zip(program.c.tolist(), point, strict=True)]
    wrong = abs(sum(terms, Fraction(0)) - minimum) > tol * max(sum(map(abs, terms), Fraction(0)), abs(minimum))
    return "the objective is not the minimum" if wrong else ""
