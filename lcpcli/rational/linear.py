"""Linear systems with integer data, solved in rational arithmetic: the only exact solver in the program.

Small systems by fraction-free Gauss-Jordan elimination (E. H. Bareiss, Sylvester's identity and multistep integer-
preserving Gaussian elimination, Mathematics of Computation 22 (1968) 565-578): n^3 operations on minors of the matrix.
Larger ones by FLINT (https://flintlib.org), where python-flint is installed: a nonsingular system costs n^3 operations
modulo primes and a p-adic lifting (J. D. Dixon, Exact solution of linear equations using p-adic expansions, Numerische
Mathematik 40 (1982) 137-141), a second for n = 400 and entries of 7 bits. Both give the same results.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

from lcpcli.errors import ParameterError
from lcpcli.interrupts import check
from lcpcli.rational import flint_calls

SMALL = 16  # rows up to which FLINT is not faster
SECONDS = 1e-9  # that a nonsingular system takes by FLINT, for each bit of its entries and n^3
PRIME = 2**61 - 1  # below the largest integer of a word

Rows = Sequence[Sequence[int]]


class Solutions(NamedTuple):
    """The solutions of a linear system.

    x : one of them, with 0 for unknowns whose columns depend on earlier ones; None if there is none.
    null_space : a basis of the solutions of A x = 0; empty if x is unique.
    """

    x: list[Fraction] | None
    null_space: list[list[Fraction]]


def require() -> Any:
    """The module flint, or a ParameterError that says how to install it."""
    flint = _flint()
    if flint is None:
        raise ParameterError("exact", "needs python-flint", "pip install 'linear-complementarity[exact]'")
    return flint


def solve(A: Rows, b: Sequence[int]) -> Solutions:
    """The solutions of A x = b, for integers A of shape (m, n) and b of length m."""
    m, n = len(A), len(A[0]) if A else 0
    if m == n > SMALL and is_fast():
        found = flint_calls.call("solved", duration(A), A, list(b))
        if found is not None:
            return Solutions([Fraction(*value) for value in found], [])
    rows, pivots, divisor = _reduced([[*row, value] for row, value in zip(A, b, strict=True)], n)
    x = [Fraction(0)] * n
    for row, column in zip(rows, pivots, strict=False):
        x[column] = Fraction(row[n], divisor)
    null_space = []
    for j in (j for j in range(n) if j not in pivots):
        v = [Fraction(int(i == j)) for i in range(n)]
        for row, column in zip(rows, pivots, strict=False):
            v[column] = Fraction(-row[j], divisor)
        null_space.append(v)
    return Solutions(None if any(row[n] for row in rows[len(pivots) :]) else x, null_space)


def duration(A: Rows) -> float:
    """About how many seconds `solve` takes for a nonsingular A of many rows."""
    bits = max((abs(value).bit_length() for row in A for value in row), default=0)
    return SECONDS * bits * float(len(A)) ** 3


def long_integer() -> Any:
    """The type of FLINT's integers, which are faster than Python's where they are long; None without FLINT."""
    flint = _flint()
    return None if flint is None else flint.fmpz


def is_fast() -> bool:
    """Whether FLINT is there, for large systems."""
    return _flint() is not None


def particular(A: Rows, b: Sequence[int]) -> list[Fraction] | None:
    """A solution x of A x = b, with 0 for unknowns whose columns depend on earlier ones; None if none is found.

    For integers A of shape (m, n) and b of length m. By FLINT, a large system is solved as a nonsingular part of it
    that has its rank modulo a prime. The other equations are not checked: they hold if A x = b has a solution, unless
    the prime divides a minor, which is unlikely.
    """
    flint = _flint() if A and min(len(A), len(A[0])) > SMALL else None
    if flint is None:
        return solve(A, b).x
    columns = _pivots(flint.nmod_mat(flint.fmpz_mat(A), PRIME))
    part = [[row[j] for j in columns] for row in A]
    rows = _pivots(flint.nmod_mat(flint.fmpz_mat(part), PRIME).transpose())
    found = solve([part[i] for i in rows], [b[i] for i in rows]).x
    if found is None:
        return None
    x = [Fraction(0)] * len(A[0])
    for j, value in zip(columns, found, strict=True):
        x[j] = value
    return x


def inverse(A: Rows) -> list[list[Fraction]] | None:
    """The inverse of a square A of integers; None if it is singular."""
    n = len(A)
    rows, pivots, divisor = _reduced([[*row, *(int(i == j) for j in range(n))] for i, row in enumerate(A)], n)
    return [[Fraction(value, divisor) for value in row[n:]] for row in rows] if len(pivots) == n else None


def _reduced(rows: list[list[int]], n: int) -> tuple[list[list[int]], list[int], int]:
    """The reduced row echelon form of the first n columns times a divisor, its pivot columns, and that divisor."""
    if len(rows) > SMALL and is_fast():
        whole, divisor, rank = flint_calls.call("reduced", duration(rows), rows)
        leading = [next(j for j, value in enumerate(row) if value) for row in whole[:rank]]
        return whole, [j for j in leading if j < n], divisor
    pivots: list[int] = []
    previous = 1
    for column in range(n):
        check()
        top = len(pivots)
        found = next((i for i in range(top, len(rows)) if rows[i][column]), None)
        if found is None:
            continue
        rows[top], rows[found] = rows[found], rows[top]
        pivot_row = rows[top]
        pivot = pivot_row[column]
        for i, row in enumerate(rows):
            if i != top:
                factor = row[column]
                rows[i] = [(pivot * v - factor * p) // previous for v, p in zip(row, pivot_row, strict=True)]
        pivots.append(column)
        previous = pivot
    return rows, pivots, previous


def _pivots(A: Any) -> list[int]:
    """The pivot columns of a matrix of FLINT modulo a prime."""
    reduced, rank = A.rref()
    return [next(j for j in range(A.ncols()) if reduced[i, j]) for i in range(rank)]


def _flint() -> Any:
    try:
        import flint
    except ModuleNotFoundError:
        return None
    return flint
