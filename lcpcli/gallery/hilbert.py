"""D. Hilbert, Ein Beitrag zur Theorie des Legendre'schen Polynoms, Acta Math. 18 (1894) 155-159: the matrix with the
entries 1 / (i + j - 1), the standard example of ill-conditioning.
"""

from __future__ import annotations

import math

import numpy as np

from lcpcli.model.problem import Problem

CLASS = "symmetric positive definite"
SOURCE = "the Hilbert matrix (Hilbert 1894)"
EXACT = 18  # the largest n for which all numbers are integers representable in double precision


def hilbert(n: int, _seed: int, *, degenerate: bool = False) -> Problem:
    """M is the Hilbert matrix and q = -M z for z = e.

    Up to n = 18 M is multiplied by the least common multiple of 1, ..., 2n - 1: all data are integers, and z is the
    exact solution. Beyond, M is rounded to nearest and q = -M z is rounded; as the condition makes the solution of the
    rounded data differ from z, none is given.

    degenerate : z = (1, 0, 1, 0, ...) instead, still with w = 0.
    """
    denominators = np.arange(1, n + 1)[:, None] + np.arange(n)
    factor = math.lcm(*range(1, 2 * n)) if n <= EXACT else 1
    M = factor / denominators
    z = np.ones(n)
    if degenerate:
        z[1::2] = 0
    exact = n <= EXACT
    note = f"The Hilbert matrix times {factor}; its condition grows like exp(3.5 n)."
    return Problem(M, -M @ z, name=f"hilbert-{n}", solutions=[z] if exact else [], source=SOURCE, note=note)
