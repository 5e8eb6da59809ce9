"""Generalized Newton on F(x) = 0, which is block principal pivoting, with a safeguard that makes it finite.

Where x has no zero, F is linear, and the Newton step from x leads to the basic solution of the complementary set
P = {i : x_i > 0}: M_PP z_P = -q_P, w_P = 0, z_N = 0, w_N = M_NP z_P + q_N. Indices of negative entries are exchanged.
With bounds, a basic variable goes to the bound that it violates, and one whose w has the wrong sign becomes basic.
M. M. Kostreva, Block pivot methods for solving the complementarity problem, Linear Algebra and its Applications 21
(1978) 207-215. The safeguard: J. J. Júdice and F. M. Pires, A block principal pivoting algorithm for large-scale
strictly monotone linear complementarity problems, Computers and Operations Research 21 (1994) 587-596, after
K. G. Murty, Note on a Bard-type scheme for solving the complementarity problem, Opsearch 11 (1974) 123-130.
"""

from __future__ import annotations

import math

import numpy as np

from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import is_narrow, is_sparse
from lcpcli.methods.iterate import Breakdown, Finished, Iterate, Stage, Stalled
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector
from lcpcli.verify.basic_solution import BasicSolutions

LEAST_INDEX = "least index"
PATIENCE = 10  # block steps without a new minimum of infeasible indices, before single exchanges
FAST = 0.5  # of the violations: what a fast step from given states leaves at most
SLOW, SLOW_NARROW = 2, 12  # other steps after which they are not nearly right; one costs little if the band is narrow


def newton(problem: Problem, x0: Vector) -> Stage:
    """Exchange all indices whose z or w is negative; after PATIENCE steps without a new minimum, only the least one.

    Ends at the solution after finitely many steps for every P-matrix M and every q, in practice after a handful. For
    other matrices it may meet a singular M_PP or cycle. An iteration costs one factorization of M_PP and one product
    with M.

    Parameters
    ----------
    problem : the LCP, n unknowns.
    x0 : starting point, shape (n,); only its signs matter.

    Yields
    ------
    Iterate : x = (z - w) / 2 of the basic solutions, with step "block" or "least index".

    Returns
    -------
    Finished, or Breakdown : M_PP is singular.
    """
    return block_pivoting(problem, x0, math.inf)


def block_pivoting(problem: Problem, x0: Vector, patience: float) -> Stage:
    """The same, stalled after so many exchanges of least indices: block steps advance, these may take 2^n."""
    fewest, waiting, step = problem.n + 1, PATIENCE, "block"
    pivoting = BasicSolutions(problem).exchanging(problem.box.basis_of(x0))
    try:
        for evaluations, found in enumerate(pivoting, 1):
            yield Iterate(found.x, None, step, evaluations, signs_final=found.is_solution)
            infeasible = found.wrong.nonzero()[0]
            if not infeasible.size:
                break
            if infeasible.size < fewest:
                fewest, waiting, step = infeasible.size, PATIENCE, "block"
            elif waiting > 1:
                waiting -= 1
            elif patience > 0:
                patience, step = patience - 1, LEAST_INDEX
            else:
                return Stalled("the least-index steps were not enough")
            if step == LEAST_INDEX:
                found.wrong[infeasible[1:]] = False
    except SingularMatrix as error:
        return Breakdown(str(error))
    return Finished()


def from_states(problem: Problem, x0: Vector) -> Stage:
    """Block pivoting from states that are nearly right, while most steps leave at most FAST of the violations.

    The states of a solution take one factorization, even where many components are 0 but for rounding.

    Returns
    -------
    Finished : no sign is violated beyond rounding. Stalled, or Breakdown : the states are not nearly right.
    """
    solutions, before = BasicSolutions(problem), problem.n
    slow = SLOW_NARROW if is_sparse(problem.M) and is_narrow(problem.M) else SLOW
    try:
        for evaluations, found in enumerate(solutions.exchanging(problem.box.basis_of(x0)), 1):
            found.wrong[:] = solutions.violated(found)
            violations = int(np.count_nonzero(found.wrong))
            if not violations:
                yield Iterate(problem.box.x_within(found.z, found.w, found.basis), None, "block", evaluations)
                return Finished()
            yield Iterate(found.x, None, "block", evaluations, signs_final=False)
            slow, before = slow - (violations > FAST * before), violations
            if not slow:
                break
    except SingularMatrix as error:
        return Breakdown(str(error))
    return Stalled("the given basis is not nearly right")
