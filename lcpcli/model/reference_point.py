"""The reference point of a problem: a residual measured from there is hidden neither by bounds far from 0 nor by very
large ones that stand for infinite ones."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lcpcli.linalg.doubles import are_moderate
from lcpcli.linalg.matrices import absolute_product, accurate_residual, is_sparse, product, row_errors
from lcpcli.model.box import Box
from lcpcli.typing import Indices, Matrix, Vector

# The factor by which the terms of a row of M z + q may exceed their sum: beyond it, the row is summed exactly.
CANCELLATION = 1000


class Reference(NamedTuple):
    """The reference point z of one problem, shape (n,), or of each of m problems, shape (m, n); M z + q there, kept as
    `q`, and bounds on its rounding errors. Where all reference points are 0, as for LCPs, z is None and the error 0."""

    z: Vector | None
    q: Vector
    error: Vector | float

    def part(self, rows: Indices | int) -> Reference:
        if self.z is None or isinstance(self.error, float) or not self.z[rows].any():
            return Reference(None, self.q[rows], 0.0)
        return Reference(self.z[rows], self.q[rows], self.error[rows])


@np.errstate(over="ignore", invalid="ignore")
def reference(M: Matrix, q: Vector, box: Box) -> Reference:
    """Return the z within the bounds nearest to 0, or with every z_i at a finite bound, whichever leaves the smaller
    residual; 0 if w overflows at both. Rows of w that cancel there are summed exactly. q : shape (n,), or (m, n)."""
    z, corner = box.project(np.zeros(q.shape)), box.corner
    differ = np.count_nonzero(z != corner)
    if not differ and not np.count_nonzero(z):
        return Reference(None, q, 0.0)
    w = product(M, z.T).T + q
    if differ:
        other = product(M, corner.T).T + q
        better = _largest(box.gaps(corner, other)) < _largest(box.gaps(z, w))
        z, w = np.where(better, corner, z), np.where(better, other, w)
    usable = np.isfinite(w).all(axis=-1, keepdims=True)
    z, w = np.where(usable, z, 0.0), np.where(usable, w, q)
    if not z.any():
        return Reference(None, q, 0.0)
    terms = absolute_product(M, np.abs(z).T).T + np.abs(q)
    errors = row_errors(M, z, terms)
    each = zip(*map(np.atleast_2d, (z, w, q, terms, errors)), strict=True)
    for z_i, w_i, q_i, terms_i, errors_i in each:  # views
        rows = np.flatnonzero(terms_i > CANCELLATION * np.abs(w_i))
        if not rows.size:
            continue
        part = M[rows]
        if all(map(are_moderate, (part.data if is_sparse(M) else part, q_i[rows], z_i))):
            w_i[rows] = 0.0 - accurate_residual(part, z_i, -q_i[rows])
            errors_i[rows] = 0.0
    return Reference(z, w, errors)


def _largest(gaps: Vector) -> Vector:
    """Return the largest size in each row, infinite where a number is not finite; shape (m, 1), or (1,)."""
    sizes: Vector = np.abs(gaps).max(axis=-1, keepdims=True)
    return np.where(np.isfinite(sizes), sizes, np.inf)
