"""Classes of small matrices, decided by their definitions: principal minors in fractions, eigenvalues, signs."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import combinations

import numpy as np

from lcpcli import Problem
from lcpcli.linalg.matrices import is_sparse


def dense(problem: Problem) -> np.ndarray:
    return problem.M.toarray() if is_sparse(problem.M) else problem.M


def determinant(rows: list[list[Fraction]]) -> Fraction:
    if not rows:
        return Fraction(1)
    pivot = next((i for i, row in enumerate(rows) if row[0]), None)
    if pivot is None:
        return Fraction(0)
    first, rest = rows[pivot], rows[:pivot] + rows[pivot + 1 :]
    below = [[v - row[0] / first[0] * p for v, p in zip(row, first, strict=True)][1:] for row in rest]
    return (-1) ** pivot * first[0] * determinant(below)


def subsets(n: int) -> list[list[int]]:
    return [list(chosen) for size in range(1, n + 1) for chosen in combinations(range(n), size)]


def has_positive_minors(M: np.ndarray) -> bool:
    return all(
        determinant([[Fraction(v) for v in row] for row in M[np.ix_(P, P)].tolist()]) > 0 for P in subsets(len(M))
    )


def is_positive_definite(M: np.ndarray) -> bool:
    """By Sylvester's criterion on M + M', in fractions."""
    S = [
        [Fraction(a) + Fraction(b) for a, b in zip(row, column, strict=True)]
        for row, column in zip(M.tolist(), M.T.tolist(), strict=True)
    ]
    return all(determinant([row[:k] for row in S[:k]]) > 0 for k in range(1, len(M) + 1))


def is_positive_semidefinite(M: np.ndarray) -> bool:
    return bool(np.linalg.eigvalsh(M + M.T)[0] >= -1e-13 * abs(M).max())


def is_symmetric(M: np.ndarray) -> bool:
    return np.array_equal(M, M.T)


def is_copositive(M: np.ndarray) -> bool:
    """No principal submatrix of M + M' has a positive eigenvector to a negative eigenvalue (Kaplan 2000)."""
    for P in subsets(len(M)):
        values, vectors = np.linalg.eigh((M + M.T)[np.ix_(P, P)])
        for value, v in zip(values, vectors.T, strict=True):
            if value < -1e-12 and ((v > 1e-12).all() or (v < -1e-12).all()):
                return False
    return True


def is_m_matrix(M: np.ndarray) -> bool:
    return bool((M - np.diag(np.diag(M)) <= 0).all()) and has_positive_minors(M)


def is_h_plus(M: np.ndarray) -> bool:
    D = np.diag(np.diag(M))
    return bool((np.diag(M) > 0).all()) and is_m_matrix(D - abs(M - D))


HOLDS: dict[str, Callable[[np.ndarray], bool]] = {
    "P": has_positive_minors,
    "M": is_m_matrix,
    "H+": is_h_plus,
    "positive definite": is_positive_definite,
    "not positive definite": lambda M: not is_positive_definite(M),
    "positive semidefinite": is_positive_semidefinite,
    "symmetric positive definite": lambda M: is_symmetric(M) and is_positive_definite(M),
    "skew-symmetric": lambda M: np.array_equal(M, -M.T),
    "copositive": is_copositive,
    "any": lambda _: True,
    "none": lambda M: not has_positive_minors(M),
}
