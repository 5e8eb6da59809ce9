"""How far a solution moves under relative changes of up to eps in every entry of M and q.

With A = M_PP for P = {i : l_i < z_i < u_i or w_i = 0}, without fixed variables, changes |dM| <= eps |M|, |dq| <= eps
|q| move z_P by at most eps |A^-1| (|M| |z| + |q|)_P to first order (N. J. Higham, Accuracy and Stability of Numerical
Algorithms, 2nd ed., SIAM 2002, section 7.2). No method that works on rounded data can be expected to do better.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS, ROW_ROUNDING
from lcpcli.model import changes
from lcpcli.model.problem import Problem
from lcpcli.rational import linear
from lcpcli.rational.numbers import in_integers, rounded
from lcpcli.typing import Indices, Matrix, Vector

MOST_INVERTED = 400  # the size of P up to which the inverse is formed
MOST_EXACT = 64  # the same in rational arithmetic
LARGEST_CONDITION = 1e-3 / EPS  # the condition number up to which an inverse in doubles has correct digits


@np.errstate(over="ignore", invalid="ignore", divide="ignore")
def sensitivity(problem: Problem, z: Vector) -> float | None:
    """The largest component of |A^-1| (|M| |z| + |q|)_P at the solution z, shape (n,), in units of z; None if M_PP is
    singular or too large, or too large for rational arithmetic and too ill-conditioned for doubles."""
    w = problem.w(z)
    terms = matrices.absolute_product(problem.M, np.abs(z)) + np.abs(problem.q)
    box = problem.box
    between, vanishing = (z > box.lower) & (z < box.upper), ~box.fixed & (np.abs(w) <= ROW_ROUNDING * terms)
    for active in (between | vanishing, between):
        P = np.flatnonzero(active)
        if not P.size:
            return 0.0
        inverse = _inverse(problem, P)
        if inverse is not None:
            largest = float((inverse @ terms[P]).max())
            return largest if np.isfinite(largest) else None
    return None


def _inverse(problem: Problem, P: Indices) -> Matrix | None:
    """|M_PP^-1|, shape (k, k), or None."""
    if P.size > MOST_INVERTED:
        return None
    units = changes.scale(problem)
    A = matrices.dense(units.problem.M[P][:, P])
    if P.size <= MOST_EXACT:
        whole, power = in_integers(A.ravel())
        found = linear.inverse(np.array(whole, dtype=object).reshape(A.shape).tolist())
        unit = Fraction(2) ** -power
        inverse = None if found is None else np.array([rounded(unit * value for value in row) for row in found])
    else:
        inverse = np.linalg.inv(A) if np.linalg.cond(A, 1) < LARGEST_CONDITION else None
    return None if inverse is None else np.abs(units.C[P, np.newaxis] * inverse * units.R[P])
