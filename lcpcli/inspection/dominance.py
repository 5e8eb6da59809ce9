"""H+ and M-matrices: generalized strict diagonal dominance, proved by a positive scaling of the columns.

M is an H+-matrix if C d > 0 for its comparison matrix C and some d > 0 (see `verify.matrix_classes`). There is no such
d if C v <= 0 for some v >= 0, v != 0, as C^-1 >= 0. d and v are computed in double precision and verified exactly.
"""

from __future__ import annotations

import numpy as np

from lcpcli.inspection.verdict import NO, UNDECIDED, YES, Check, Context, Verdict, index_set, signs, text_of
from lcpcli.linalg import matrices
from lcpcli.linalg.matrices import product
from lcpcli.rational import elimination, numbers
from lcpcli.typing import Matrix, Vector
from lcpcli.verify.matrix_classes import scaling

EXACT_MINORS = 64  # n up to which the leading minors of C are computed exactly, in about a second
STEPS = 300  # of power iteration for a v that rules out d, which is verified whatever its accuracy
ZERO = 1e-9  # of the largest component of v, below which a component has not converged and is treated as zero


def h_plus(context: Context) -> Verdict:
    """Decide whether M_ii > 0, and M_ii d_i > sum of |M_ij| d_j, j != i, in every row for some d > 0."""
    return context.low_diagonal() or scaled_dominance(context.M, context.check)


def m_matrix(context: Context) -> Verdict:
    """Decide whether M is a nonsingular M-matrix: a Z-matrix that is an H+-matrix."""
    if not context.yes("z_matrix"):
        return Verdict(NO, "it is not a Z-matrix")
    word, undecided = context.verdicts["h_plus"].word, "whether it is an H+-matrix is not decided"
    return Verdict(word, {YES: "it is a Z-matrix and an H+-matrix", NO: "it is not an H+-matrix"}.get(word, undecided))


def scaled_dominance(M: Matrix, check: Check) -> Verdict:
    """Decide whether M, with positive diagonal, is an H+-matrix."""
    C = matrices.comparison(M)
    e = np.ones(C.shape[0])
    row = signs(C, e, check)
    if (row > 0).all():
        return Verdict(YES, "it is strictly diagonally dominant: d = (1, ..., 1)", vector=e)
    if (row <= 0).all():
        return _excluded(e)
    found = scaling(M, lambda d: bool((signs(C, d, check) > 0).all()), check)
    if found is not None:
        evidence = f"scaling the columns of M by d = {text_of(found.d)} makes it strictly diagonally dominant"
        return Verdict(YES, evidence, vector=found.d)
    v = _perron(C, check)
    if v.any() and (signs(C, v, check) <= 0).all():
        return _excluded(v)
    if e.size > EXACT_MINORS:
        return Verdict(UNDECIDED, "neither a scaling d nor a vector that rules one out was found")
    first = elimination.definiteness(numbers.integers(matrices.dense(C)), check)
    indices = first.zero or first.negative
    if indices is None:
        return Verdict(YES, "all leading minors of its comparison matrix are positive, in exact arithmetic")
    return Verdict(NO, f"the minor {index_set(indices)} of its comparison matrix is not positive", indices)


def _excluded(v: Vector) -> Verdict:
    return Verdict(NO, f"M_ii v_i <= sum of |M_ij| v_j, j != i, in every row for v = {text_of(v)}", vector=v)


def _perron(C: Matrix, check: Check) -> Vector:
    """Return an approximate Perron vector v >= 0 of J = I - D^-1 C, by power iteration on I + J; D v may be below |off|
    v."""
    diagonal = C.diagonal()
    v = np.ones(diagonal.size)
    for _ in range(STEPS):
        check()
        with np.errstate(over="ignore", invalid="ignore"):
            v = 2 * v - product(C, v) / diagonal
        if not np.isfinite(v).all() or not v.max() > 0:
            return np.zeros(v.size)
        v /= v.max()
    v[v < ZERO] = 0.0
    return v
