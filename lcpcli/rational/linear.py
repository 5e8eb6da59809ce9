"""Linear systems in integers, solved in rational numbers by FLINT (https://flintlib.org), by way of python-flint.

A regular system costs n^3 operations modulo primes and a p-adic lifting, J. D. Dixon, Exact solution of linear
equations using p-adic expansions, Numerische Mathematik 40 (1982) 137-141: a second for n = 400 and entries of 7 bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from lcpcli.errors import OptionError


def require() -> Any:
    """The module flint, or an OptionError that says how to get it."""
    try:
        import flint
    except ModuleNotFoundError:
        raise OptionError("--exact", "needs python-flint", "pip install 'linear-complementarity[exact]'") from None
    return flint


def solve(A: Sequence[Sequence[int]], b: Sequence[int]) -> list[Fraction] | None:
    """x with A x = b, for integers A of shape (m, n), m, n >= 1, and b of length m; None if there is none.

    Where there are many, unknowns are taken in their order as long as their columns are independent; the others are 0.
    """
    flint = require()
    m, n = len(A), len(A[0])
    if m == n:
        try:
            return [_fraction(x.p, x.q) for x in flint.fmpz_mat(A).solve(flint.fmpz_mat(n, 1, b)).entries()]
        except ZeroDivisionError:
            pass
    reduced, divisor, rank = flint.fmpz_mat([[*row, value] for row, value in zip(A, b, strict=True)]).rref()
    x = [Fraction(0)] * n
    for row in reduced.tolist()[:rank]:
        pivot = next(j for j, value in enumerate(row) if value)
        if pivot == n:
            return None
        x[pivot] = _fraction(row[n], divisor)
    return x


def _fraction(above: Any, below: Any) -> Fraction:
    return Fraction(int(above), int(below))
