"""The route for sparse matrices: only products with M if these suffice, else one factorization and finishing."""

from __future__ import annotations

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.units import equilibrate
from lcpcli.methods.auto.krylov import krylov, multilevel
from lcpcli.methods.auto.turns import Turns
from lcpcli.methods.finish import finish
from lcpcli.methods.fixed_point import fixed_point
from lcpcli.methods.iterate import Breakdown, Finished, Iterate, Stage, Stalled, advance, ended, limited
from lcpcli.methods.transformed import in_given_variables
from lcpcli.model.problem import Problem
from lcpcli.model.scaled import in_units
from lcpcli.options import AUTO
from lcpcli.typing import Matrix, Vector

MEMORY = 10  # pairs for Anderson acceleration: more do not find the active set sooner (measured for 5 to 20)
MODULUS_STEPS = 500  # ten times what it needs for the matrices that it is meant for
GROWTH = 1e6  # of |F| over its minimum: the modulus iteration diverges


def sparse_route(problem: Problem, x0: Vector, krylov_only: bool = False) -> Stage:
    """Solve the problem in units in which M has diagonal 1: by pivoting with Krylov solves, else by modulus iteration.

    Well-conditioned M, however large and with any fill-in, needs a few dozen products and no factorization
    (`krylov`). It gives up early if convergence is slow. For symmetric M a hierarchy of coarse versions follows
    (`multilevel`), still without factorizing M unless rounding stops it short of the solution. Last come the modulus
    iteration with omega from the spectrum and Anderson acceleration, which finds the active set with one factorization,
    and `finish`.

    Parameters
    ----------
    problem : the LCP, n unknowns, M sparse.
    x0 : starting point, shape (n,).
    krylov_only : whether to end after the first part, as where others are better: with zeros on the diagonal, as for
        contact, or a narrow band.

    Yields
    ------
    Iterate : in the problem's own units; `method` names the part of the route.

    Returns
    -------
    As the last part. It is meant for positive definite and H-matrices; it may fail for other M.
    """
    R, C = _units(problem.M, problem.q)
    units = in_units(problem, R, C)
    return (yield from in_given_variables(units, _parts(units.problem, units.start(x0), krylov_only)))


def _parts(problem: Problem, x: Vector, krylov_only: bool) -> Stage:
    turns = Turns(x)
    ending = yield from turns.take("krylov", krylov(problem, x))
    if krylov_only or isinstance(ending, Stalled | Finished):
        return ending
    if matrices.is_symmetric(problem.M):
        ending = yield from turns.take("multilevel", multilevel(problem))
        if isinstance(ending, Stalled):
            return (yield from turns.take("multilevel", finish(problem, turns.last.x, ended(ending))))
        if isinstance(ending, Finished):
            return ending
    last = turns.last.x
    modulus = limited(fixed_point(problem, last, omega=AUTO, anderson=MEMORY), MODULUS_STEPS)
    return (yield from turns.take("fixed-point", finish(problem, last, _while_bounded(modulus))))


def _while_bounded(stage: Stage) -> Stage:
    """The stage, until |F| has grown by a factor GROWTH over its minimum so far."""
    least = np.inf
    while isinstance(step := advance(stage), Iterate):
        if step.F is not None:
            size = float(np.abs(step.F).max())
            if not size <= GROWTH * least:
                return Breakdown("the modulus iteration diverges")
            least = min(size, least)
        yield step
    return step


def _units(M: Matrix, q: Vector) -> tuple[Vector, Vector]:
    """Diagonals R, C of shape (n,) that make the diagonal of R M C one if it is positive, and preserve symmetry."""
    diagonal = M.diagonal()
    positive = bool(diagonal.min() > 0)
    if positive and matrices.is_symmetric(M):
        root = 1 / np.sqrt(diagonal)
        return root, root
    R, C = equilibrate(M, q)
    return (1 / (diagonal * C) if positive else R), C
