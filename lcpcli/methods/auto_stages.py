"""How the attempts of `auto` begin; the table in `auto_table` says when they are made."""

from __future__ import annotations

import math

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.matrices import is_sparse
from lcpcli.methods import stages
from lcpcli.methods.direct import FEW_INDEX_STEPS, MOST_PIVOTED
from lcpcli.methods.newton import LEAST_INDEX_STEPS, SLOW, dense_route, newton
from lcpcli.methods.newton import without_w as newton_without_w
from lcpcli.methods.stages import Iterate, Stage, Stalled, ended
from lcpcli.methods.structure import Structure
from lcpcli.model.problem import Problem

# Iterations of the simplex method, by the seconds that so many usually take: for each entry of M, for a linear program
# before the interior point method has its turn; after first attempts of that, by the order of M; and at least.
SIMPLEX_EFFORT, SIMPLEX_EFFORT_BY_ORDER, LEAST_SIMPLEX_EFFORT = 4e-5, 1e-9, 0.1
NEWTON_SETTLING_FACTOR = 0.2  # most changes of state in a step of newton, relative to the last step, if it is to go on
SETTLED_CHANGES = 3  # of state in a step of newton: so few do not end it
MOST_BAND_STEPS = 5  # of newton with factors of a band: it settles in these, or takes as many as there are unknowns
MOST_SMALL_BAND_STEPS = 25  # the same for a small M, where other attempts take longer


def newton_while_fast(structure: Structure) -> Stage:
    """Run newton until a step changes more than NEWTON_SETTLING_FACTOR of the states that the last step changed.

    Circuits need three steps, each with one factorization; most programs end it at the first one.
    """
    box, stage = structure.problem.box, usual_newton(structure)
    basis, most = box.basis_of(np.zeros(structure.problem.n)), math.inf
    while isinstance(step := stages.advance(stage), Iterate):
        before, basis = basis, box.basis_of(step.x)
        changes = np.count_nonzero(basis != before)
        yield step
        if changes > most:
            return Stalled(SLOW)
        most = max(NEWTON_SETTLING_FACTOR * changes, SETTLED_CHANGES)
    return step


def eliminated(structure: Structure) -> Stage:
    """Eliminate one unknown after another of a tridiagonal M-matrix."""
    with imports:
        from lcpcli.methods.elimination import eliminated
    return eliminated(structure.problem)


def newton_in_band(structure: Structure) -> Stage:
    """Run newton for MOST_BAND_STEPS while it settles fast."""
    return stages.limited(newton_while_fast(structure), MOST_BAND_STEPS)


def basic_in_band(structure: Structure) -> Stage:
    """Run newton from w = 0 for as many steps with factors of a narrow band as take no longer than coarse versions of
    a small M."""
    return stages.limited(all_basic(structure), MOST_SMALL_BAND_STEPS)


def usual_newton(structure: Structure) -> Stage:
    """Run newton; on dense M its exchanges of single indices, which advance only for P-matrices, are few or none."""
    problem = structure.problem
    if is_sparse(problem.M):
        return newton(problem, structure.x0, problem.n)
    patience = _single_exchanges(structure) if problem.M.diagonal().min() > 0 else 0
    return dense_route(problem, structure.x0, patience, structure.gradient_steps, _is_hasty(problem))


def _is_hasty(problem: Problem) -> bool:
    """Return whether newton is given up as soon as it is hopeless: where Lemke's path follows."""
    return problem.n <= MOST_PIVOTED


def _single_exchanges(structure: Structure) -> int:
    """Return how many exchanges of single indices on dense M are made before other methods have their turn: few where
    Lemke's path follows, which advances by one index at a time too, for a fraction of the cost, or interior."""
    return FEW_INDEX_STEPS if _is_hasty(structure.problem) else LEAST_INDEX_STEPS


def without_w(structure: Structure) -> Stage:
    """Solve M z = -q once."""
    return newton_without_w(structure.problem)


def all_basic(structure: Structure) -> Stage:
    """Solve M z = -q, and exchange the signs that are wrong.

    Pivoting from q < 0 may miss a solution with w = 0 and many z_i at bounds, as these have no definite states, and may
    take n steps where M is an M-matrix, as for options, and each step finds only the neighbours of the last variables.
    """
    problem = structure.problem
    lower, upper = (np.clip(bound, -1.0, 1.0) for bound in problem.box.vectors(problem.n))  # 0 is within the bounds
    patience = problem.n if is_sparse(problem.M) else _single_exchanges(structure)
    return newton(problem, (lower + upper) / 4, patience, _is_hasty(problem))


def from_basic_zeros(structure: Structure) -> Stage:
    """Run newton from w = 0 where q <= 0."""
    problem = structure.thin
    return newton(problem, np.where(problem.q <= 0, 0.5, -0.5), _single_exchanges(structure), _is_hasty(problem))


def of_z_matrix(structure: Structure) -> Stage:
    """Run Chandrasekaran's method."""
    with imports:
        from lcpcli.methods.z_matrix import z_matrix
    return z_matrix(structure.problem)


def sparse(structure: Structure) -> Stage:
    """Run the route for sparse M; where there are zeros on the diagonal, only the part that needs no factors."""
    with imports:
        from lcpcli.methods.active_set import sparse_route
    problem = structure.problem
    return sparse_route(problem, structure.x0, krylov_only=not problem.M.diagonal().all())


def convex_program(structure: Structure) -> Stage:
    """Solve a convex program by PIQP."""
    with imports:
        from lcpcli.methods.convex_program import convex_program
    return convex_program(structure.given)


def linear(structure: Structure, effort: float = math.inf) -> Stage:
    """Run linear, for a proof of infeasibility, or for the solution if M is skew-symmetric."""
    with imports:
        from lcpcli.methods.linear import linear
    return linear(structure.given, max(effort, LEAST_SIMPLEX_EFFORT))


def half_linear(structure: Structure) -> Stage:
    """Run linear with iterations by the entries of M, as it takes far fewer than interior, or far more."""
    return linear(structure, SIMPLEX_EFFORT * structure.problem.M.nnz)


def briefly_linear(structure: Structure) -> Stage:
    """Run linear: where the first attempts of interior stall, there is often no solution, as an LP shows at once."""
    return linear(structure, SIMPLEX_EFFORT_BY_ORDER * structure.problem.n**3)


def pivoted(structure: Structure) -> Stage:
    """Follow Lemke's path to its end without iterates in between."""
    with imports:
        from lcpcli.methods.lemke import pivoted
    reduction = None if structure.reduced is None else structure.reduced(structure.problem)
    return pivoted(structure.problem, structure.follow, reduction, lambda: structure.is_semidefinite)


def lemke(structure: Structure) -> Stage:
    """Follow Lemke's path, not much longer than those that end at a solution."""
    with imports:
        from lcpcli.methods.lemke import MAX_PIVOTS
    return stages.limited(stages.begin("lemke", structure.problem, structure.x0), MAX_PIVOTS * structure.problem.n)


def pure_equilibrium(structure: Structure) -> Stage:
    """Look for an equilibrium of a bimatrix game in pure strategies."""
    with imports:
        from lcpcli.methods.bimatrix import pure_equilibrium
    return pure_equilibrium(structure.problem, structure.game)


def lemke_howson(structure: Structure) -> Stage:
    """Follow the paths of Lemke and Howson from several labels."""
    with imports:
        from lcpcli.methods.bimatrix import lemke_howson
    return ended(Stalled()) if structure.game is None else lemke_howson(structure.problem, structure.game)


def interior(structure: Structure) -> Stage:
    """Make all attempts of interior."""
    return stages.begin("interior", structure.problem, structure.x0)


def first_attempts(structure: Structure) -> Stage:
    """Make the attempts of interior that give up early."""
    with imports:
        from lcpcli.methods.interior import FIRST_ATTEMPTS, attempts
    return attempts(structure.thin, FIRST_ATTEMPTS)


def further_attempts(structure: Structure) -> Stage:
    """Make the attempts of interior that follow these."""
    with imports:
        from lcpcli.methods.interior import FURTHER_ATTEMPTS, attempts
    return attempts(structure.thin, FURTHER_ATTEMPTS)


def reflections(structure: Structure) -> Stage:
    """Search by reflections."""
    return stages.begin("reflections", structure.problem, structure.x0)


def few_nodes(structure: Structure) -> Stage:
    """Examine a few nodes of the tree of milp, which take about as long as Lemke's path."""
    with imports:
        from lcpcli.methods.milp import FEW_ENTRIES, first_nodes
    return first_nodes(structure.problem, FEW_ENTRIES)


def first_nodes(structure: Structure) -> Stage:
    """Examine the first nodes of the tree of milp."""
    with imports:
        from lcpcli.methods.milp import FIRST_ENTRIES, first_nodes
    return first_nodes(structure.problem, FIRST_ENTRIES)
