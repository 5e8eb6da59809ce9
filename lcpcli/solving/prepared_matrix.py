"""What a sequence of problems with one M keeps of it."""

from __future__ import annotations

from functools import cached_property

from lcpcli.basis.free_variables import Reduction
from lcpcli.linalg import matrices
from lcpcli.linalg.factors import PrincipalSolver
from lcpcli.methods.direct import MAX_PIVOTED, stored, with_M
from lcpcli.methods.lemke import reduced
from lcpcli.methods.z_matrix import of_tridiagonal
from lcpcli.model.problem import Problem


class PreparedMatrix:
    """One M, prepared for problems with it.

    like : a problem with M in the form whose route takes less time. elimination : of a
        tridiagonal M-matrix; None for any other M. is_paused : whether the basis of the
        last solution is not used, as it has led to no solution: each time for twice as
        many problems.
    """

    def __init__(self, like: Problem) -> None:
        M = stored(like.M)
        self.elimination = of_tridiagonal(M)
        if like.n <= MAX_PIVOTED and not self.elimination:
            M = matrices.dense(M)
        self.like = with_M(like, M)
        self._reduction: Reduction | None = None
        self._problems_left, self._pause = 0, 1

    @cached_property
    def principal(self) -> PrincipalSolver:
        return PrincipalSolver(self.like.M, self.like.latest)

    def reduced(self, problem: Problem) -> Reduction:
        """Return the problem in bounded variables; it is stored as long as the same
        variables are bounded."""
        reduction = self._reduction
        if reduction is not None and reduction.box is not problem.box:
            reduction = reduction.within(problem.box)
        self._reduction = reduction or reduced(problem)
        return self._reduction

    @property
    def is_paused(self) -> bool:
        return self._problems_left > 0

    def pause(self, has_led: bool) -> None:
        """Pause unless the basis of the last solution has led to a solution."""
        self._pause = 1 if has_led else 2 * self._pause
        self._problems_left = self._pause if self._pause > 1 else 0

    def next(self) -> None:
        """Count a problem."""
        self._problems_left = max(self._problems_left - 1, 0)
