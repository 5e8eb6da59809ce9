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


def has_positive_minors(M: np.ndarray) -> bool:
    return is_p([[Fraction(v) for v in row] for row in M.tolist()])


def is_p(A: list[list[Fraction]]) -> bool:
    """With a positive first entry, what is left without its row and column is P, before and after elimination by it."""
    if not A:
        return True
    first, *rest = A
    if first[0] <= 0:
        return False
    eliminated = [[v - row[0] / first[0] * p for v, p in zip(row, first, strict=True)][1:] for row in rest]
    return is_p([row[1:] for row in rest]) and is_p(eliminated)


def is_positive_definite(M: np.ndarray) -> bool:
    """Whether M + M' in fractions is P, as for symmetric matrices that is the same."""
    rows, columns = ([[Fraction(v) for v in row] for row in A.tolist()] for A in (M, M.T))
    return is_p([[a + b for a, b in zip(*pair, strict=True)] for pair in zip(rows, columns, strict=True)])


def is_positive_semidefinite(M: np.ndarray) -> bool:
    return bool(np.linalg.eigvalsh(M + M.T)[0] >= -1e-13 * abs(M).max())


def is_symmetric(M: np.ndarray) -> bool:
    return np.array_equal(M, M.T)


def is_copositive(M: np.ndarray) -> bool:
    """No principal submatrix of M + M' has a positive eigenvector to a negative eigenvalue (Kaplan 2000)."""
    n = len(M)
    for P in (list(P) for size in range(1, n + 1) for P in combinations(range(n), size)):
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
