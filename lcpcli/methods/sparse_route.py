"""The route for sparse matrices: only products with M if these suffice, else coarse versions of it, else factors."""

from __future__ import annotations

from functools import partial

import numpy as np

from lcpcli.linalg.matrices import is_symmetric
from lcpcli.linalg.units import equilibrate
from lcpcli.methods import stages
from lcpcli.methods.active_set import Factors, active_set, multilevel
from lcpcli.methods.inexact import krylov
from lcpcli.methods.newton import finish
from lcpcli.methods.stages import Breakdown, Finished, Stage, Stalled, Turns
from lcpcli.model.changes import in_units
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector

WEAK_DOMINANCE = 0.02  # of a diagonal entry over the others of its row, the median: products alone will not suffice


def sparse_route(problem: Problem, x0: Vector, krylov_only: bool = False) -> Stage:
    """Solve the problem in units in which M has diagonal 1: by pivoting with inexact solves.

    Well-conditioned M, however large and with any fill-in, needs a few dozen products and no factorization
    (`krylov`). It gives up early if convergence is slow, and is left out where entries that are not positive off the
    diagonal nearly add up to it, as for differential equations. Then the start and the solves come from coarse versions
    of M (`multilevel`), or, where these converge slowly, the solves come from factors of principal submatrices. Where
    rounding stops that short of the tolerance, `finish` factorizes the last one.

    It is meant for sparse positive definite and H-matrices; it may fail for other M, and ends as its last part does.

    krylov_only : whether to end after the first part, where other methods are better than the rest: for zeros on the
        diagonal, as in contact.
    """
    symmetric = problem.M.diagonal().min() > 0 and is_symmetric(problem.M)
    units = in_units(problem, *_units(problem.M, problem.q, symmetric))
    return (yield from stages.changed(units, x0, partial(_parts, symmetric=symmetric, krylov_only=krylov_only)))


def _parts(problem: Problem, x: Vector, symmetric: bool, krylov_only: bool) -> Stage:
    turns, M = Turns(x), problem.M
    if krylov_only or not _is_barely_dominant(M):
        ending = yield from turns.take("krylov", krylov(problem, x, symmetric))
        if krylov_only or isinstance(ending, Stalled | Finished):
            return ending
    ending = yield from turns.take("multilevel", multilevel(problem, symmetric))
    if isinstance(ending, Breakdown):
        z = problem.box.z_of(turns.last.x)
        ending = yield from turns.take("multilevel", active_set(problem, z, Factors(M), symmetric))
    if isinstance(ending, Stalled):
        return (yield from turns.take("multilevel", finish(problem, turns.last.x, stages.ended(ending))))
    return ending


def _is_barely_dominant(M: Matrix) -> bool:
    """Return whether M, with diagonal 1, has no positive entries off it and these nearly add up to 1, or to more, in
    most rows."""
    return bool(np.count_nonzero(M.data > 0) == M.shape[0] and np.median(M @ np.ones(M.shape[0])) < WEAK_DOMINANCE)


def _units(M: Matrix, q: Vector, symmetric: bool) -> tuple[Vector, Vector]:
    """Return diagonals R, C for which a positive diagonal becomes 1 in R M C and symmetry is preserved.

    symmetric : whether M is symmetric and has such a diagonal.
    """
    diagonal = M.diagonal()
    if symmetric:
        root = 1 / np.sqrt(diagonal)
        return root, root
    R, C = equilibrate(M, q)
    return (1 / (diagonal * C) if diagonal.min() > 0 else R), C
