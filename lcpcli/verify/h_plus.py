"""H+-matrices: generalized strict diagonal dominance, proved by a positive scaling d of the columns.

M with positive diagonal L is an H+-matrix if its comparison matrix <M> (|M_ii| on the diagonal, -|M_ij| off it) is a
nonsingular M-matrix, that is, if <M> d > 0 for some d > 0 (A. Berman and R. J. Plemmons, Nonnegative matrices in the
mathematical sciences, SIAM 1994, chapter 6). Whoever asks for d says in which arithmetic <M> d > 0 is to be proved.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from lcpcli import interrupts
from lcpcli.clock import imports
from lcpcli.linalg import factors, matrices
from lcpcli.linalg.doubles import EPS, SMALLEST_NORMAL
from lcpcli.linalg.factors import MOST_NUMPY_ROWS, PrincipalSolver, Solve
from lcpcli.linalg.matrices import is_sparse, product
from lcpcli.typing import Matrix, Vector

SLACK = 2.0**-30  # of the diagonal: far above rounding, so that d passes the exact check, and small beside most margins
KRYLOV_STEPS = 2000  # at most: the scaling found by then is verified in any case


class Scaling(NamedTuple):
    """A proof that M is H+: d of shape (n,), positive, with <M> d > 0. solve : solves systems with <M>; None if d was
    found without factors of <M>."""

    d: Vector
    solve: Solve | None


def scaling(
    M: Matrix, is_dominant: Callable[[Vector], bool], check: Callable[[], None] = interrupts.check
) -> Scaling | None:
    """Return a proof that M, of shape (n, n) with positive diagonal, is H+; None if no d was found.

    is_dominant : returns whether <M> d > 0 is proved for a finite d > 0, as by `lower_image`, or in exact arithmetic.
    check : called between steps; it may raise TimeIsUp.
    """
    for found in _candidates(matrices.comparison(M), check):
        if np.isfinite(found.d).all() and (found.d > 0).all() and is_dominant(found.d):
            return found
    return None


def lower_image(M: Matrix, diagonal: Vector, d: Vector) -> Vector:
    """Return a lower bound on <M> d for d >= 0: 2 L d - |M| d minus a bound on the rounding errors."""
    terms = int(np.diff(M.indptr).max(initial=0)) if is_sparse(M) else M.shape[1]
    own, others = 2 * diagonal * d, matrices.absolute_product(M, d)
    lower: Vector = own - others - (factor(terms) * (own + others) + (terms + 4) * SMALLEST_NORMAL)
    return lower


def factor(terms: int) -> float:
    """Return gamma_k = k u / (1 - k u), the relative error of a sum of k products, with a margin for a few operations
    before and after (N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM 2002, chapter 3)."""
    return (terms + 16) * EPS


def _candidates(C: Matrix, check: Callable[[], None]) -> Iterator[Scaling]:
    """Yield candidates for d: C d = L 1 or, where d varies widely, (C - SLACK L) d = L 1."""
    diagonal, direct = C.diagonal(), True
    if is_sparse(C) or diagonal.size > MOST_NUMPY_ROWS:
        with imports:
            from lcpcli.linalg.patterns import affordable
        direct = affordable(C)
    for slack in (0.0, SLACK):
        check()
        A = matrices.plus_diagonal(C, -slack * diagonal) if slack else C
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"), suppress(factors.SingularMatrix):
            if direct:
                solver, everything = PrincipalSolver(A), np.arange(diagonal.size)
                d = solver.solve(everything, diagonal)
                yield Scaling(d, None if slack else solver.at(everything))
            else:
                yield Scaling(_krylov(A, diagonal, check), None)


def _krylov(C: Matrix, diagonal: Vector, check: Callable[[], None]) -> Vector:
    with imports:
        from lcpcli.linalg.krylov import bicgstab, conjugate_gradients, norm

    def multiply(v: Vector) -> Vector:
        check()
        return product(C, v)

    solve = conjugate_gradients if matrices.is_symmetric(C) else bicgstab
    target = min(0.5 * float(diagonal.min()), 1e-3 * norm(diagonal))
    return solve(multiply, diagonal, np.ones(diagonal.size), target, KRYLOV_STEPS, lambda r: r / diagonal)[0]
