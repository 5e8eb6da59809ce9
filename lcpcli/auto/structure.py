"""What auto knows of a problem when it chooses a stage, each fact computed when it is first asked for.

How the attempts of `auto` begin; the table in `attempts` says when they are made.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lcpcli.basis import tableau
from lcpcli.basis.free_variables import Reduction
from lcpcli.clock import imports
from lcpcli.linalg.matrices import has_no_positive_links, is_sparse, thinned, width
from lcpcli.methods import stages
from lcpcli.methods.direct import (
    FEW_INDEX_STEPS,
    MOST_AS_DENSE,
    MOST_FILLED,
    MOST_PIVOTED,
    as_dense,
    as_sparse,
    basic_zeros,
    is_full_band,
)
from lcpcli.methods.lemke_path import Follow
from lcpcli.methods.newton import LEAST_INDEX_STEPS, SLOW, dense_route, newton
from lcpcli.methods.newton import without_w as newton_without_w
from lcpcli.methods.stages import Iterate, Stage, Stalled, Tried, ended
from lcpcli.model.changes import is_far_from_one
from lcpcli.model.problem import Problem
from lcpcli.typing import Mask, Vector

if TYPE_CHECKING:
    from lcpcli.methods.bimatrix import Costs
    from lcpcli.methods.projected_gradient import Steps

FEWEST_FRICTIONAL = 35  # unknowns from which interior is tried on M with some zeros on the diagonal, as of contact
MOST_PIVOTED_BY_NUMPY = 150  # unknowns from which on interior takes less time, if M + M' is semidefinite
SHORT = 20  # unknowns up to which Lemke's path is so short that it is followed where no theorem says how it ends
MOST_UNFILLED = 100  # unknowns up to which sparse factors cost no less than dense ones


class Structure:
    """The facts on a problem.

    given, problem : the problem as it is, and with dense M if n is small. x0 : as auto starts.
    tried : the stages of first attempts that have been made, to be passed on instead of being made again.
    follow : of Lemke's paths, `tableau.follow` or its compiled form. gradient_steps : those of projected gradients in
        compiled form, or None. reduced : returns a `Reduction` that is
        kept for problems with this M; None if none is.
    """

    def __init__(self, problem: Problem, x0: Vector, tried: Tried | None = None) -> None:
        self.given, self.x0, self.tried = problem, x0, tried or {}
        self.follow: Follow = tableau.follow
        self.gradient_steps: Steps | None = None
        self.reduced: Callable[[Problem], Reduction] | None = None
        self.is_narrow = is_full_band(problem.M)
        self.is_large_and_sparse = self.is_narrow or (is_sparse(problem.M) and problem.n > MOST_AS_DENSE)
        self.problem = problem if self.is_large_and_sparse else as_dense(problem)

    @cached_property
    def thin(self) -> Problem:
        """Return the problem with sparse M if M has so few entries that sparse factors cost less even for small n; else
        with dense M for small n."""
        most = MOST_FILLED * self.given.n**2
        M = self.given.M if self.given.n <= MOST_UNFILLED else thinned(self.given.M, most)
        is_thin = is_sparse(M) and self.given.n > MOST_UNFILLED and M.nnz <= most
        return as_sparse(self.given, M) if is_thin else self.problem

    @cached_property
    def program(self) -> str:
        """Return "linear" or "quadratic" if M is large, sparse and that of a convex program; else ""."""
        return _program(self.problem) if self.is_large_and_sparse else ""

    @cached_property
    def is_no_p_matrix(self) -> bool:
        """Return whether M has a zero on the diagonal, as for programs: newton then rarely settles, unless it does so
        fast."""
        return not self.problem.M.diagonal().all()

    @cached_property
    def is_z_matrix(self) -> bool:
        """Return whether no entry of M off the diagonal is positive, and all on it are: exchanges then advance from
        both sides."""
        return self.has_no_positive_links and bool((self.problem.M.diagonal() > 0).all())

    @cached_property
    def has_no_positive_links(self) -> bool:
        """Return whether M is a Z-matrix: whether no entry off the diagonal is positive."""
        return has_no_positive_links(self.problem.M)

    @cached_property
    def basic_zeros(self) -> Mask | None:
        """Return `direct.basic_zeros` if M is small, or has no more entries than a tree, so that its factors cost
        little; else None."""
        problem = self.problem
        return basic_zeros(problem) if not self.is_large_and_sparse or problem.M.nnz <= 2 * problem.n else None

    @property
    def is_tridiagonal(self) -> bool:
        """Return whether M is sparse and tridiagonal, with the signs of an M-matrix, and there are no bounds."""
        if not (self.is_narrow and self.problem.box.is_orthant and self.is_z_matrix):
            return False
        return width(self.problem.M) <= 1

    @cached_property
    def is_semidefinite(self) -> bool:
        """Return whether M + M' is positive semidefinite; it is assumed if M is large and sparse."""
        with imports:
            from lcpcli.linalg.krylov import is_semidefinite
        return self.is_large_and_sparse or is_semidefinite(self.given.M)

    @cached_property
    def is_unsure(self) -> bool:
        """Return whether an entry on the diagonal of M is negative, for more than a few unknowns without bounds: M is
        then neither copositive nor a P-matrix, nor of another class for which Lemke's path ends at a solution."""
        return self.problem.n > SHORT and not self.problem.is_mixed and bool(self.problem.M.diagonal().min() < 0)

    @cached_property
    def is_frictional(self) -> bool:
        """Return whether M is dense, not monotone, and has some zeros on the diagonal but not only zeros, as games
        have, nor negative entries."""
        if self.is_large_and_sparse or self.problem.is_mixed or self.problem.n < FEWEST_FRICTIONAL:
            return False
        if self.is_unsure:
            return False
        return self.is_no_p_matrix and not self.has_zero_diagonal and not self.is_semidefinite

    @cached_property
    def is_pivoted(self) -> bool:
        """Return whether Lemke's path is followed before anything but newton is tried."""
        n = self.problem.n
        if n > MOST_PIVOTED or self.is_unsure or is_far_from_one(self.problem):
            return False
        return n <= MOST_PIVOTED_BY_NUMPY or self.follow is not tableau.follow or not self.is_semidefinite

    @cached_property
    def game(self) -> Costs | None:
        """Return the costs of the bimatrix game whose equilibria solve the problem; None if it is no game."""
        if self.is_large_and_sparse or self.problem.n < 2 or self.problem.M[0, 0]:
            return None
        with imports:
            from lcpcli.methods.bimatrix import costs
        return costs(self.problem)

    @property
    def has_zero_diagonal(self) -> bool:
        """Return whether the diagonal of M is zero, as in games."""
        return not self.problem.M.diagonal().any()


def _program(problem: Problem) -> str:
    """Return "linear" or "quadratic" for the sparse M of a convex program; "" for any other."""
    if problem.M.diagonal().all():  # there are zeros for the rows of a program
        return ""
    with imports:
        from lcpcli.linalg.krylov import is_semidefinite
        from lcpcli.methods.linear import is_skew
    if is_skew(problem.M):
        return "linear"
    return "quadratic" if _has_form_of_program(problem) and is_semidefinite(problem.M) else ""


def _has_form_of_program(problem: Problem) -> bool:
    """Return whether M is symmetric but for signs of rows, of both kinds, with zeros on the diagonal."""
    S = None if problem.M.diagonal().all() else problem.signs
    return S is not None and bool((S[0] != S).any())


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
        from lcpcli.methods.z_matrix import eliminated
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
