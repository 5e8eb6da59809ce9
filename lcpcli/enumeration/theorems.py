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

from lcpcli.linalg import matrices
from lcpcli.linalg.linear_program import linprog
from lcpcli.model.origins import Game
from lcpcli.rational import elimination
from lcpcli.rational.exact_problem import ExactProblem, fractions_of
from lcpcli.typing import Vector

POINT, PIECE = "a point", "a piece"
MOST_WITHOUT_THEOREM = 10  # unknowns up to which the tree is faster than a search for parts and multipliers
MULTIPLIER_BITS = 30  # binary digits of the smallest component of d: integers stay short
MOST_CUTS = 200  # rounds of cutting planes, each with a linear program; a time limit may end them before
LEAST_EIGENVALUE = 1e-9  # of D M + M'D, with ones on its diagonal: far above rounding, so that a proof is worth trying
CUT_EIGENVALUE = 0.02  # eigenvalue below which an eigenvector gives a cut, so that one round gives several
LEAST_MULTIPLIER = 1e-4  # relative to the largest multiplier, so that D M does not lose its digits

Rows = list[list[int]]


def shape(data: ExactProblem, check: Callable[[], None]) -> str:
    """Return what the solutions are proved to be at most: POINT, PIECE or, if nothing is proved, ""."""
    game = data.problem.origin
    if isinstance(game, Game):
        rows = zip(*game.payoffs(), strict=True)
        return PIECE if len({a + b for own, other in rows for a, b in zip(own, other, strict=True)}) == 1 else ""
    M, doubles = _integers(data), matrices.dense(data.problem.M)
    indices = _strong_parts(data) if all(M[i][i] > 0 for i in range(data.n)) else []
    parts = [([[M[i][j] for j in part] for i in part], doubles[np.ix_(part, part)]) for part in indices]
    if parts and all(_is_dominant(*part) for part in parts):
        return POINT
    found = elimination.definiteness(_symmetric(M), check)
    if found.negative is None:
        return PIECE if found.zero else POINT
    if not parts or data.n <= MOST_WITHOUT_THEOREM:
        return ""
    return POINT if all(_is_dominant(*part) or _is_definite(*part, check) for part in parts) else ""


def _integers(data: ExactProblem) -> Rows:
    """Return M times a number that makes its entries integers."""
    common = math.lcm(*data.scales)
    multiples = [common // scale for scale in data.scales]
    return [[row.get(j, 0) * k for j in range(data.n)] for row, k in zip(data.rows, multiples, strict=True)]


def _is_definite(M: Rows, doubles: Vector, check: Callable[[], None]) -> bool:
    """Return whether diag(d) M is positive definite for some d > 0, which is proposed in doubles."""
    proposed = multipliers(doubles, check)
    if proposed is None:
        return False
    d = _whole(proposed)
    found = elimination.definiteness(_symmetric([[v * a for a in row] for v, row in zip(d, M, strict=True)]), check)
    return found.zero is None and found.negative is None


def _symmetric(M: Rows) -> Rows:
    """Return M + M'."""
    return [[M[i][j] + M[j][i] for j in range(len(M))] for i in range(len(M))]


def _is_dominant(M: Rows, doubles: Vector) -> bool:
    """Return whether M_ii d_i > sum of |M_ij| d_j, j != i, for some d > 0, which is proposed in doubles."""
    try:
        proposed = np.asarray(np.linalg.solve(matrices.comparison(doubles), np.ones(len(M))), dtype=float)
    except np.linalg.LinAlgError:
        return False
    if not (np.isfinite(proposed).all() and proposed.min() > 0):
        return False
    d = _whole(proposed)
    return all(2 * row[i] * d[i] > sum(abs(a) * v for a, v in zip(row, d, strict=True)) for i, row in enumerate(M))


def _whole(d: Vector) -> list[int]:
    """Return positive numbers multiplied by a common factor and rounded to integers."""
    values = fractions_of(d)
    unit = min(values) / 2**MULTIPLIER_BITS
    return [int(value / unit) for value in values]


def _strong_parts(data: ExactProblem) -> list[Sequence[int]]:
    """Return the unknowns of the strongly connected parts of M; of a small problem, for which scipy is not loaded,
    all."""
    if data.n <= MOST_WITHOUT_THEOREM:
        return [range(data.n)]
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    pattern = np.zeros((data.n, data.n))
    for i, row in enumerate(data.rows):
        pattern[i, list(row)] = 1
    count, part = connected_components(csr_array(pattern), connection="strong")
    return [np.flatnonzero(part == k).tolist() for k in range(count)]


@np.errstate(over="ignore", invalid="ignore")
def multipliers(M: Vector, check: Callable[[], None]) -> Vector | None:
    """Return d > 0, shape (n,), for which diag(d) M, for M with a positive diagonal, may be positive definite, so that
    M is a P-matrix (G. W. Cross, Linear Algebra and its Applications 20 (1978) 253-263); None if none is found.

    d is sought by cutting planes (J. E. Kelley, Journal of the SIAM 8 (1960) 703-712): v'D M v > 0 for the eigenvectors
    v that have violated it, halfway from the last d to the best one for these.
    """
    n, diagonal = len(M), M.diagonal()
    unit = M / diagonal[:, None]
    if not np.isfinite(unit).all():
        return None
    d, cuts = np.ones(n), np.empty((0, n))
    for _ in range(MOST_CUTS):
        check()
        S = d[:, None] * unit
        scale = 1 / np.sqrt(2 * d)
        scaled = scale[:, None] * (S + S.T) * scale
        if not np.isfinite(scaled).all():
            return None
        values, vectors = np.linalg.eigh(scaled)
        if values[0] > LEAST_EIGENVALUE:
            return np.asarray(d / diagonal)
        V = scale[:, None] * vectors[:, values < CUT_EIGENVALUE]
        new = (V * (unit @ V)).T
        largest = np.abs(new).max(axis=1, keepdims=True)
        if not (np.isfinite(largest).all() and new.max(axis=1).min() > 0):  # v'D M v <= 0 for all D, if M is singular
            return None
        cuts = np.vstack((cuts, new / largest))
        found = linprog(  # the largest t with cuts d >= t
            np.append(np.zeros(n), -1.0),
            np.column_stack((-cuts, np.ones(len(cuts)))),
            np.zeros(len(cuts)),
            lower=np.append(np.full(n, LEAST_MULTIPLIER), -np.inf),
            upper=np.append(np.ones(n), np.inf),
        )
        if found is None or found.x[-1] <= 0:
            return None
        d = (d / d.max() + found.x[:n]) / 2
    return None
