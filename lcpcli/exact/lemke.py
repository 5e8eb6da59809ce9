"""Lemke's method in rational arithmetic, for small problems whose rounding hides the right complementary set.

C. E. Lemke, Bimatrix equilibrium points and mathematical programming, Management Science 11 (1965) 681-689; the
lexicographic ratio test as in R. W. Cottle, J.-S. Pang and R. E. Stone, The Linear Complementarity Problem, SIAM 2009,
section 4.9; pivots divide exactly, as in J. Edmonds, Systems of distinct representatives and linear algebra, Journal of
Research of the National Bureau of Standards 71B (1967) 241-245, so that all numbers are integers, minors of [I -M -1
q].
"""

from __future__ import annotations

import time
from fractions import Fraction

from lcpcli.exact.problem import ExactProblem

LARGEST = 60  # unknowns: seconds at worst


def solve(data: ExactProblem, deadline: float) -> list[Fraction] | None:
    """The solution where the path from z = 0 ends, or None: on a ray, for a large problem, after the deadline.

    The covering vector is that of the integer rows. Columns: w_0 ... w_(n-1), z_0 ... z_(n-1), z_n (artificial), q.
    """
    n = data.n
    if n > LARGEST:
        return None
    rows = [
        [*(int(i == j) for j in range(n)), *(-data.rows[i].get(j, 0) for j in range(n)), -1, data.constants[i]]
        for i in range(n)
    ]
    basis, divisor, entering = list(range(n)), 1, 2 * n
    leaving = min(range(n), key=lambda i: (*rows[i][-1:], *rows[i][:n]))
    if rows[leaving][-1] >= 0:
        return [Fraction(0)] * n
    while time.perf_counter() < deadline:
        divisor = _pivot(rows, leaving, entering, divisor)
        left, basis[leaving] = basis[leaving], entering
        if left == 2 * n:
            return _z(rows, basis, divisor)
        entering = left + n if left < n else left - n
        candidates = [i for i in range(n) if rows[i][entering] > 0]
        if not candidates:
            return None
        leaving = _first(rows, basis, candidates, entering)
    return None


def _pivot(rows: list[list[int]], r: int, c: int, divisor: int) -> int:
    """Make column c the unit vector of row r, times the divisor that is returned, which stays positive."""
    pivot = rows[r]
    if pivot[c] < 0:
        pivot[:] = [-value for value in pivot]
    by = pivot[c]
    for i, row in enumerate(rows):
        factor = row[c]
        if i != r:
            row[:] = [(by * a - factor * b) // divisor for a, b in zip(row, pivot, strict=True)]
    return by


def _first(rows: list[list[int]], basis: list[int], candidates: list[int], entering: int) -> int:
    """The row with the lexicographically least (q, w columns) / entering; the artificial variable's, where q ties."""
    n = len(rows)
    best = candidates[0]
    for i in candidates[1:]:
        a, b = rows[i][entering], rows[best][entering]
        order = _sign(rows[i][-1] * b - rows[best][-1] * a)
        if order == 0 and 2 * n in (basis[i], basis[best]):
            order = -1 if basis[i] == 2 * n else 1
        j = 0
        while order == 0 and j < n:
            order, j = _sign(rows[i][j] * b - rows[best][j] * a), j + 1
        if order < 0:
            best = i
    return best


def _sign(value: int) -> int:
    return (value > 0) - (value < 0)


def _z(rows: list[list[int]], basis: list[int], divisor: int) -> list[Fraction]:
    n = len(rows)
    z = [Fraction(0)] * n
    for row, j in zip(rows, basis, strict=True):
        if n <= j < 2 * n:
            z[j - n] = Fraction(row[-1], divisor)
    return z
