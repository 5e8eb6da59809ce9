"""Matrices M for which the solutions of every problem form at most one piece, proved in exact arithmetic.

If M is positive semidefinite, the solutions are a convex set, and any two of them are complementary to each other: they
are one polyhedron. If all principal minors are positive, there is at most one (R. W. Cottle, J.-S. Pang and R. E.
Stone, The Linear Complementarity Problem, SIAM 2009, sections 3.1 and 3.3; the same holds with bounds). The minors are
positive if those of the strongly connected parts of M are, and these if, scaled, they are positive definite or
diagonally dominant.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.equilibration import equilibrate
from lcpcli.rational import elimination
from lcpcli.rational.problem import ExactProblem
from lcpcli.typing import Vector

POINT, PIECE = "a point", "a piece"
DIGITS = 20  # binary ones of the smallest component of d

Rows = list[list[int]]


def shape(data: ExactProblem, check: Callable[[], None]) -> str:
    """What the solutions are proved to be at most: POINT, PIECE or, if nothing is proved, ""."""
    M, doubles = _integers(data), matrices.dense(data.problem.M)
    parts = [([[M[i][j] for j in part] for i in part], doubles[np.ix_(part, part)]) for part in _strong_parts(data)]
    if all(_is_dominant(*part) for part in parts):
        return POINT
    found = elimination.definiteness(_symmetric(M), check)
    if found.negative is None:
        return PIECE if found.zero else POINT
    return POINT if all(_is_dominant(*part) or _is_definite(*part, check) for part in parts) else ""


def _integers(data: ExactProblem) -> Rows:
    """M times one number."""
    common = math.lcm(*data.scales)
    return [
        [row.get(j, 0) * (common // scale) for j in range(data.n)]
        for row, scale in zip(data.rows, data.scales, strict=True)
    ]


def _is_definite(M: Rows, doubles: Vector, check: Callable[[], None]) -> bool:
    """Whether M, or a scaling of it by rows and columns, is positive definite."""
    if min(M[i][i] for i in range(len(M))) <= 0:
        return False
    found = (elimination.definiteness(_symmetric(scaled), check) for scaled in (M, _balanced(M, doubles)))
    return any(each.zero is None and each.negative is None for each in found)


def _symmetric(M: Rows) -> Rows:
    """M + M'."""
    return [[M[i][j] + M[j][i] for j in range(len(M))] for i in range(len(M))]


def _balanced(M: Rows, doubles: Vector) -> Rows:
    """M with rows and columns multiplied by powers of two to entries near 1, and all by one number."""
    rows, columns = (np.rint(np.log2(scales)).astype(int) for scales in equilibrate(doubles, np.zeros(len(M))))
    powers = rows[:, None] + columns
    shifts = (powers - powers.min()).tolist()
    return [[a << k for a, k in zip(row, own, strict=True)] for row, own in zip(M, shifts, strict=True)]


def _is_dominant(M: Rows, doubles: Vector) -> bool:
    """Whether M_ii d_i > sum of |M_ij| d_j, j != i, for some d > 0, which is proposed in doubles."""
    if min(M[i][i] for i in range(len(M))) <= 0:
        return False
    try:
        proposed = np.linalg.solve(matrices.comparison(doubles), np.ones(len(M)))
    except np.linalg.LinAlgError:
        return False
    if not (np.isfinite(proposed).all() and proposed.min() > 0):
        return False
    d = [int(value) for value in np.ldexp(proposed / proposed.min(), DIGITS).tolist()]
    return all(2 * row[i] * d[i] > sum(abs(a) * v for a, v in zip(row, d, strict=True)) for i, row in enumerate(M))


def _strong_parts(data: ExactProblem) -> list[Sequence[int]]:
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    pattern = np.zeros((data.n, data.n))
    for i, row in enumerate(data.rows):
        pattern[i, list(row)] = 1
    count, part = connected_components(csr_array(pattern), connection="strong")
    return [np.flatnonzero(part == k).tolist() for k in range(count)]
