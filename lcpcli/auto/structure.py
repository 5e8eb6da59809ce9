"""What auto knows of a problem when it chooses a stage, each fact computed when it is first asked for."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING

from lcpcli.basis import tableau
from lcpcli.basis.free_variables import Reduction
from lcpcli.clock import imports
from lcpcli.linalg.krylov import is_semidefinite
from lcpcli.linalg.matrices import has_no_positive_links, is_sparse, thinned
from lcpcli.linalg.patterns import is_forest
from lcpcli.methods import direct
from lcpcli.methods.direct import MOST_PIVOTED, as_dense
from lcpcli.methods.stages import Tried
from lcpcli.model.changes import is_far_from_one
from lcpcli.model.problem import Problem
from lcpcli.typing import Mask, Vector

if TYPE_CHECKING:
    from lcpcli.methods.bimatrix import Costs
    from lcpcli.methods.lemke import Follow

FEWEST_FRICTIONAL = 35  # unknowns from which interior is tried on M with some zeros on the diagonal, as of contact
MOST_PIVOTED_BY_NUMPY = 150  # unknowns from which on interior takes less time, if M + M' is semidefinite
SHORT = 20  # unknowns up to which Lemke's path is so short that it is followed where no theorem says how it ends
MOST_UNFILLED = 100  # unknowns up to which sparse factors cost no less than dense ones


class Structure:
    """The facts on a problem.

    given, problem : the problem as it is, and with dense M if n is small. x0 : as auto starts.
    tried : the stages of first attempts that have been made, to be passed on instead of being made again.
    follow : of Lemke's paths, `tableau.follow` or its compiled form. reduced : returns a `Reduction` that is kept for
        problems with this M; None if none is.
    """

    def __init__(self, problem: Problem, x0: Vector, tried: Tried | None = None) -> None:
        self.given, self.x0, self.tried = problem, x0, tried or {}
        self.follow: Follow = tableau.follow
        self.reduced: Callable[[Problem], Reduction] | None = None
        self.is_narrow = direct.is_full_band(problem.M)
        self.is_large_and_sparse = self.is_narrow or (is_sparse(problem.M) and problem.n > direct.MOST_AS_DENSE)
        self.problem = problem if self.is_large_and_sparse else as_dense(problem)

    @cached_property
    def thin(self) -> Problem:
        """Return the problem with sparse M if M has so few entries that sparse factors cost less even for small n; else
        with dense M for small n."""
        most = direct.MOST_FILLED * self.given.n**2
        M = self.given.M if self.given.n <= MOST_UNFILLED else thinned(self.given.M, most)
        is_thin = is_sparse(M) and self.given.n > MOST_UNFILLED and M.nnz <= most
        return direct.as_sparse(self.given, M) if is_thin else self.problem

    @property
    def reduction(self) -> Reduction | None:
        """Return the problem in bounded variables, if it is kept."""
        return None if self.reduced is None else self.reduced(self.problem)

    @cached_property
    def program(self) -> str:
        """Return "linear" or "quadratic" if M is large, sparse and that of a convex program; else ""."""
        M = self.problem.M
        if not (self.is_large_and_sparse and self.is_no_p_matrix):  # there are zeros for the rows of a program
            return ""
        with imports:
            from lcpcli.methods.linear import is_skew
        if is_skew(M):
            return "linear"
        S = self.problem.signs  # of rows, but for which M is symmetric: of a program there are both kinds
        return "quadratic" if S is not None and (S[0] != S).any() and is_semidefinite(M) else ""

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
        """Return `direct.basic_zeros` if M is small, or the graph of its entries is a forest, so that its factors cost
        little; else None."""
        zeros = direct.basic_zeros(self.problem)
        return zeros if zeros is not None and (not self.is_large_and_sparse or is_forest(self.problem.M)) else None

    @cached_property
    def is_semidefinite(self) -> bool:
        """Return whether M + M' is positive semidefinite; it is assumed if M is large and sparse."""
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
        if self.is_large_and_sparse or self.problem.is_mixed or self.problem.n < FEWEST_FRICTIONAL or self.is_unsure:
            return False
        return self.is_no_p_matrix and bool(self.problem.M.diagonal().any()) and not self.is_semidefinite

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
