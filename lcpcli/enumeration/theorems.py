"""Problems whose solutions form at most one piece, mostly for every q, proved in exact arithmetic.

If M is positive semidefinite, the solutions are one polyhedron; if all principal minors are positive, there is at most
one (R. W. Cottle, J.-S. Pang and R. E. Stone, The Linear Complementarity Problem, SIAM 2009, sections 3.1 and 3.3; the
same holds with bounds). The minors are positive if those of the strongly connected parts of M are, and these if,
scaled, they are positive definite or diagonally dominant. If the payoffs of a game sum to a constant, the equilibria
are one polyhedron too (J. von Neumann, Mathematische Annalen 100 (1928) 295-320).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg import matrices
from lcpcli.model.origins import Game
from lcpcli.rational import elimination
from lcpcli.rational.exact_problem import ExactProblem, fractions_of
from lcpcli.typing import Vector
from lcpcli.verify.matrix_classes import row_scalings, scaling

POINT, PIECE = "a point", "a piece"
MOST_WITHOUT_THEOREM = 10  # unknowns up to which the tree is faster than a search for parts and multipliers
MULTIPLIER_BITS = 30  # binary digits of the smallest component of d: integers stay short

Rows = list[list[int]]


def shape(data: ExactProblem, check: Callable[[], None]) -> str:
    """Return what the solutions are proved to be at most: POINT, PIECE or, if nothing is proved, ""."""
    game = data.problem.origin
    if isinstance(game, Game):
        rows = zip(*game.payoffs(), strict=True)
        return PIECE if len({a + b for own, other in rows for a, b in zip(own, other, strict=True)}) == 1 else ""
    common, doubles = math.lcm(*data.scales), matrices.dense(data.problem.M)
    own = zip(data.rows, (common // scale for scale in data.scales), strict=True)
    M = [[row.get(j, 0) * k for j in range(data.n)] for row, k in own]  # integers, a multiple of M
    indices = _strong_parts(data) if all(M[i][i] > 0 for i in range(data.n)) else []
    parts = [([[M[i][j] for j in part] for i in part], doubles[np.ix_(part, part)]) for part in indices]
    if parts and all(_is_dominant(*part) for part in parts):
        return POINT
    found = elimination.definiteness(elimination.symmetrized(M), check)
    if found.negative is None:
        return PIECE if found.zero else POINT
    if not parts or data.n <= MOST_WITHOUT_THEOREM:
        return ""
    return POINT if all(_is_dominant(*part) or _is_definite(*part, check) for part in parts) else ""


def _is_definite(M: Rows, doubles: Vector, check: Callable[[], None]) -> bool:
    """Return whether diag(d) M is positive definite for some d > 0 (G. W. Cross, Lin. Alg. Appl. 20 (1978) 253-263)."""
    for d in filter(None, map(_whole, row_scalings(doubles))):
        found = elimination.definiteness(
            elimination.symmetrized([[v * a for a in row] for v, row in zip(d, M, strict=True)]), check
        )
        if found.zero is None and found.negative is None:
            return True
    return False


def _is_dominant(M: Rows, doubles: Vector) -> bool:
    """Return whether M_ii d_i > sum of |M_ij| d_j, j != i, for some d > 0, which is proposed in doubles."""

    def is_dominant(proposed: Vector) -> bool:
        d = _whole(proposed)
        return all(2 * row[i] * d[i] > sum(abs(a) * v for a, v in zip(row, d, strict=True)) for i, row in enumerate(M))

    return scaling(doubles, is_dominant) is not None


def _whole(d: Vector) -> list[int]:
    """Return numbers times a common factor, rounded to integers; empty if they are not all positive and finite."""
    if not (np.isfinite(d).all() and d.min() > 0):
        return []
    values = fractions_of(d)
    unit = min(values) / 2**MULTIPLIER_BITS
    return [int(value / unit) for value in values]


def _strong_parts(data: ExactProblem) -> list[Sequence[int]]:
    """Return the unknowns of the strongly connected parts of M; without scipy, of a small problem, all as one."""
    if data.n <= MOST_WITHOUT_THEOREM:
        return [range(data.n)]
    with imports:
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import connected_components
    pattern = np.zeros((data.n, data.n))
    for i, row in enumerate(data.rows):
        pattern[i, list(row)] = 1
    count, part = connected_components(csr_array(pattern), connection="strong")
    return [np.flatnonzero(part == k).tolist() for k in range(count)]
