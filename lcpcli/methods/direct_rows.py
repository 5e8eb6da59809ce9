"""Block pivoting on many dense problems with an M each, all at once, with the answers judged on the spot."""

from __future__ import annotations

import numpy as np

from lcpcli.linalg.doubles import ROW_ROUNDING, row_sizes
from lcpcli.linalg.matrices import TINY_TERMS
from lcpcli.linalg.principal_many import each_product, principal_inverses
from lcpcli.methods.direct import CANDIDATE, CERTAIN, MOST_STEPS, NOTHING
from lcpcli.methods.final_states import HIDDEN_TERM, LONG_NUMBER
from lcpcli.model.box import BASIC, Box
from lcpcli.typing import Indices, Vector
from lcpcli.verify.measure import FEW_UNKNOWNS


@np.errstate(all="ignore")
def direct_many(M: Vector, q: Vector, largest: Vector, tol: float, box: Box) -> tuple[Vector, Indices]:
    """Solve m problems at once by block pivoting, as `direct.direct` does one. Return z for each, shape (m, n), and
    what it is, NOTHING, CANDIDATE or CERTAIN, with the number of steps, shape (m, 2).

    M, q, largest : shapes (m, n, n), (m, n) and (m,): the matrices, and their largest |M_ij|.
    box : the bounds, of shape (m, n) unless they are z >= 0.
    """
    Z, found = np.zeros(q.shape), np.zeros((len(q), 2), dtype=np.intp)
    rows, start = np.arange(len(q)), np.broadcast_to(box.corner, q.shape)
    basis = box.basis_of((start - q - each_product(M, start)) / 2)
    for steps in range(1, MOST_STEPS + 1):
        basic, z = basis == BASIC, box.nonbasic(basis)
        inverse = principal_inverses(M, basic)
        z = z - each_product(inverse, each_product(M, z) + q)
        w = np.where(basic, 0.0, each_product(M, z) + q)
        wrong = box.wrong(z, w, basis)
        regular = np.isfinite(z.sum(axis=1) + w.sum(axis=1))
        done = regular & ~wrong.any(axis=1)
        if done.any():
            own = M[done], q[done], box.part(done)
            refined = z[done] - each_product(inverse[done], each_product(own[0], z[done]) + own[1])
            found[rows[done], 0], Z[rows[done]] = _judged(*own, refined, largest[rows[done]], tol)
            found[rows[done], 1] = steps - ~basic[done].any(axis=1)
        going = (regular & ~done).nonzero()[0]
        if not going.size:
            break
        basis = box.exchanged(basis, wrong, z)[going]
        rows, M, q, box = rows[going], M[going], q[going], box.part(going)
    return Z, found


def _judged(M: Vector, q: Vector, box: Box, z: Vector, largest: Vector, tol: float) -> tuple[Indices, Vector]:
    """Return what each z, a basic solution, is once it is within its bounds, shape (m,), and this z."""
    z, absolute, sizes = box.project(z), np.abs(M), np.abs(q)
    w, terms = each_product(M, z) + q, each_product(absolute, np.abs(z)) + sizes
    least = terms
    for reference in (0.0,) if box.is_orthant else (box.project(np.zeros(q.shape)), box.corner):  # whichever it is
        at = np.broadcast_to(reference, q.shape)
        rounding = ROW_ROUNDING * (each_product(absolute, np.abs(at)) + sizes)
        least = np.minimum(least, np.abs(each_product(M, at) + q) - rounding)
    surely = box.excess(z, w) + ROW_ROUNDING * terms <= tol * least
    is_zero = ~z.any(axis=1) & box.is_orthant
    kinds = np.where(is_zero | (surely & (terms > TINY_TERMS)).all(axis=1), CERTAIN, CANDIDATE)
    if q.shape[1] <= FEW_UNKNOWNS:  # as in `final_states.hides_terms`
        (least_z, largest_z), (least_q, largest_q) = row_sizes(z), row_sizes(q)
        largest_term = np.maximum(largest * largest_z, largest_q)
        hidden = np.minimum(largest * least_z, least_q) < HIDDEN_TERM * largest_term
        kinds[hidden | (np.maximum(largest, largest_q) > LONG_NUMBER)] = NOTHING
    return kinds, z
