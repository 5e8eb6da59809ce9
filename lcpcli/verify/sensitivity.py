"""How far a solution moves when every number of M and q is changed by up to eps of itself.

With A = M_PP for P = {i : z_i > 0 or w_i = 0}, changes |dM| <= eps |M|, |dq| <= eps |q| move z_P by at most
eps |A^-1| (|A| z_P + |q_P|) to first order (N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM
2002, section 7.2). No method that works on rounded data can be expected to do better, whatever its residual.
"""

from __future__ import annotations

from fractions import Fraction
from importlib.util import find_spec

import numpy as np

from lcpcli.linalg import matrices, products
from lcpcli.model import scaled
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Matrix, Vector

LARGEST = 400  # of P, for which an inverse is formed
LARGEST_EXACT = 64  # the same in rational arithmetic
BELIEVED = 1e-3 / float(np.finfo(np.float64).eps)  # condition up to which an inverse in doubles has correct digits
ROUNDING = 8 * float(np.finfo(np.float64).eps)


@np.errstate(over="ignore", invalid="ignore", divide="ignore")
def sensitivity(problem: Problem, z: Vector) -> float | None:
    """The largest component of |A^-1| (|A| z_P + |q_P|) at the solution z, shape (n,), in units of z.

    Times eps it is the error that rounding the data alone may cause. None where M_PP is singular or too large, or so
    badly conditioned that only rational arithmetic (the extra `exact`) could tell.
    """
    w = problem.w(z)
    terms = products.absolute_product(problem.M, np.abs(z)) + np.abs(problem.q)
    for inside in ((z > 0) | (w <= ROUNDING * terms), z > 0):
        P = np.flatnonzero(inside)
        if not P.size:
            return 0.0
        inverse = _inverse(problem, P)
        if inverse is not None:
            A = _block(problem.M, P)
            largest = float((inverse @ (np.abs(A) @ z[P] + np.abs(problem.q[P]))).max())
            return largest if np.isfinite(largest) else None
    return None


def _block(M: Matrix, P: Indices) -> Matrix:
    return matrices.dense(M[P][:, P])


def _inverse(problem: Problem, P: Indices) -> Matrix | None:
    """|M_PP^-1|, shape (k, k), or None."""
    if P.size <= LARGEST_EXACT and find_spec("flint") is not None:
        return _exact_inverse(_block(problem.M, P))
    if P.size > LARGEST:
        return None
    units = scaled.scale(problem)
    A = _block(units.problem.M, P)
    try:
        inverse = np.linalg.inv(A)
    except np.linalg.LinAlgError:
        return None
    condition = np.linalg.norm(A, 1) * np.linalg.norm(inverse, 1)
    return np.abs(units.C[P, np.newaxis] * inverse * units.R[P]) if condition < BELIEVED else None


def _exact_inverse(A: Matrix) -> Matrix | None:
    import flint

    from lcpcli.rational import numbers

    exactly = [flint.fmpq(*value.as_integer_ratio()) for value in A.ravel().tolist()]
    try:
        inverse = flint.fmpq_mat(*A.shape, exactly).inv()
    except ZeroDivisionError:
        return None
    return numbers.rounded(abs(Fraction(int(entry.p), int(entry.q))) for entry in inverse.entries()).reshape(A.shape)
