"""What classes small matrices belong to, straight from the definitions, in rational arithmetic.

Nothing here is shared with the package. Where a definition ranges over all vectors, those of a grid can refute it only.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations, product
from typing import Any

import numpy as np

Rows = list[list[Fraction]]


def rational(M: Any) -> Rows:
    """The floats of M as the rationals that they are."""
    return [[Fraction(float(value)) for value in row] for row in M]


def minor(A: Rows, indices: tuple[int, ...]) -> Fraction:
    """The principal minor."""
    return determinant([[A[i][j] for j in indices] for i in indices])


def determinant(rows: Rows) -> Fraction:
    """By expansion along the first row."""
    if not rows:
        return Fraction(1)
    first, rest = rows[0], rows[1:]
    parts = [a * determinant([row[:j] + row[j + 1 :] for row in rest]) for j, a in enumerate(first) if a]
    signs = [(-1) ** j for j, a in enumerate(first) if a]
    return sum((sign * part for sign, part in zip(signs, parts, strict=True)), Fraction(0))


def minors(A: Rows) -> list[Fraction]:
    """All principal minors."""
    n = len(A)
    return [minor(A, P) for size in range(1, n + 1) for P in combinations(range(n), size)]


def form(A: Rows, v: Any) -> Fraction:
    """v'Av."""
    x = [Fraction(float(value)) for value in v]
    return sum((x[i] * A[i][j] * x[j] for i in range(len(x)) for j in range(len(x))), Fraction(0))


def products(A: Rows, v: Any) -> list[Fraction]:
    """v_i (Av)_i for all i."""
    x = [Fraction(float(value)) for value in v]
    return [
        a * sum((value * b for value, b in zip(row, x, strict=True)), Fraction(0)) for a, row in zip(x, A, strict=True)
    ]


def comparison(A: Rows) -> Rows:
    """|a_ii| on the diagonal, -|a_ij| off it."""
    return [[abs(v) if i == j else -abs(v) for j, v in enumerate(row)] for i, row in enumerate(A)]


def belongs(A: Rows) -> dict[str, bool]:
    """For each class that minors or entries decide, whether A belongs to it."""
    n = len(A)
    T = [list(column) for column in zip(*A, strict=True)]
    S = [[a + b for a, b in zip(row, column, strict=True)] for row, column in zip(A, T, strict=True)]
    of_A, of_S = minors(A), minors(S)
    off = [A[i][j] for i in range(n) for j in range(n) if i != j]
    z_matrix = all(value <= 0 for value in off)
    h_plus = all(A[i][i] > 0 for i in range(n)) and min(minors(comparison(A))) > 0
    return {
        "symmetric": A == T,
        "skew_symmetric": not any(value for row in S for value in row),
        "z_matrix": z_matrix,
        "strictly_diagonally_dominant": all(sum(row) > 0 for row in comparison(A)),
        "h_plus": h_plus,
        "m_matrix": z_matrix and h_plus,
        "positive_definite": min(of_S) > 0,
        "positive_semidefinite": min(of_S) >= 0,
        "p_matrix": min(of_A) > 0,
        "p0_matrix": min(of_A) >= 0,
    }


def grid(n: int, size: int, lowest: int) -> list[tuple[int, ...]]:
    """All whole vectors but 0 with entries from `lowest` to `size`."""
    return [v for v in product(range(lowest, size + 1), repeat=n) if any(v)]


def refuted(M: Any, size: int = 3) -> dict[str, bool]:
    """Whether a small whole vector refutes that M, whole numbers below 2^20, belongs to each of the other classes."""
    M = np.asarray(M, dtype=np.int64)
    n = len(M)
    x, S = np.array(grid(n, size, 0)), M + M.T
    values = np.einsum("ki,ij,kj->k", x, S, x)
    zeros = values == 0
    plus = bool((x[zeros] @ S).any())
    found = {"copositive": bool((values < 0).any()), "strictly_copositive": bool((values <= 0).any())}
    found["copositive_plus"] = found["copositive"] or plus
    z = np.array(grid(n, size, -size))
    for name, A in (("column_sufficient", M), ("row_sufficient", M.T)):
        signs = z * (z @ A.T)
        found[name] = bool(((signs <= 0).all(axis=1) & (signs < 0).any(axis=1)).any())
    return found
