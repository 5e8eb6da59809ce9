"""Generalized Newton on F(x) = 0, which is block principal pivoting, with a safeguard that makes it finite.

Where x has no zero, F is linear, and the Newton step from x leads to the basic solution of the complementary set
P = {i : x_i > 0}: M_PP z_P = -q_P, w_P = 0, z_N = 0, w_N = M_NP z_P + q_N. Indices of negative entries are exchanged.
M. M. Kostreva, Block pivot methods for solving the complementarity problem, Linear Algebra and its Applications 21
(1978) 207-215. The safeguard: J. J. Júdice and F. M. Pires, A block principal pivoting algorithm for large-scale
strictly monotone linear complementarity problems, Computers and Operations Research 21 (1994) 587-596, after
K. G. Murty, Note on a Bard-type scheme for solving the complementarity problem, Opsearch 11 (1974) 123-130.
"""

from __future__ import annotations

import math

import numpy as np

from lcpcli.linalg import factors, matrices
from lcpcli.linalg.doubles import ROW_ROUNDING, is_finite
from lcpcli.linalg.principal import PrincipalSolver
from lcpcli.linalg.products import absolute_product, product
from lcpcli.methods.iterate import Breakdown, Finished, Iterate, Stage, Stalled
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Vector

LEAST_INDEX = "least index"
FEW_VIOLATED = 0.05  # of all signs: if no more are violated, whether they are so beyond rounding is checked
PATIENCE = 10  # block steps without a new minimum of infeasible indices, before single exchanges


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
    active, solver = x0 > 0.0, PrincipalSolver(problem.M)
    fewest, waiting, step = problem.n + 1, PATIENCE, "block"
    evaluations = 0
    while True:
        indices = active.nonzero()[0]
        try:
            z, w, infeasible, final = _basic_solution(problem, indices, solver)
        except factors.SingularMatrix:
            return Breakdown(f"the principal submatrix of {indices.size} indices is singular")
        evaluations += 1
        yield Iterate(0.5 * (z - w), None, step, evaluations, signs_final=final)
        if not infeasible.size:
            return Finished()
        if infeasible.size < fewest:
            fewest, waiting, step = infeasible.size, PATIENCE, "block"
        elif waiting > 1:
            waiting -= 1
        elif patience > 0:
            patience, step = patience - 1, LEAST_INDEX
        else:
            return Stalled("the least-index steps were not enough")
        exchanged = infeasible if step == "block" else infeasible[:1]
        active[exchanged] = ~active[exchanged]


def _basic_solution(
    problem: Problem, indices: Indices, solver: PrincipalSolver
) -> tuple[Vector, Vector, Indices, bool]:
    """z and w of the basic solution of P, where they are negative, and whether that is nowhere beyond rounding.

    If it is nowhere, z is refined once by its residual w_P, unless that is already at rounding level.
    """
    M, q = problem.M, problem.q
    z = np.zeros(q.size)
    if not indices.size:
        return z, q, (q < 0.0).nonzero()[0], False
    solve, own = solver.at(indices), q[indices]
    z[indices] = solve(-own)
    for refines in (True, False):
        if not is_finite(z):
            raise factors.SingularMatrix
        w = product(M, z)
        w += q
        residual = w[indices]
        w[indices] = 0.0
        infeasible = (np.minimum(z, w) < 0.0).nonzero()[0]
        final = not infeasible.size or not _beyond_rounding(problem, z, w, infeasible)
        if not (refines and final) or _is_rounding(residual, own):
            break
        z[indices] -= solve(residual)
    return z, w, infeasible, final


def _is_rounding(residual: Vector, q: Vector) -> bool:
    """Whether the residual is within the rounding error of these rows of w, of which q alone is a lower bound."""
    return bool(np.count_nonzero(np.abs(residual) <= ROW_ROUNDING * np.abs(q)) == q.size)


def _beyond_rounding(problem: Problem, z: Vector, w: Vector, infeasible: Indices) -> bool:
    """Whether a negative z_i or w_i exceeds the rounding error of its row; if many are negative, some do."""
    if infeasible.size > FEW_VIOLATED * problem.n:
        return True
    rows = problem.M[infeasible]
    terms = absolute_product(rows, np.abs(z)) + np.abs(problem.q[infeasible])
    sizes = matrices.row_maxima(rows)
    violations = -np.minimum(z[infeasible] * sizes, w[infeasible])
    return bool((violations > ROW_ROUNDING * terms).any())
