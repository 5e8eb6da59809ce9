"""One M prepared once for a sequence of problems, each solved from the states of the
previous one; and such a sequence in which M may change."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sized
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.basis.exchanges import BasicSolutions
from lcpcli.basis.free_variables import Reduction
from lcpcli.clock import Stopwatch, seconds
from lcpcli.errors import ProblemError, count
from lcpcli.interrupts import TimeIsUp, within
from lcpcli.linalg.factors import PrincipalSolver
from lcpcli.linalg.krylov import dot, norm
from lcpcli.linalg.matrices import are_equal
from lcpcli.linalg.threads import with_limited_threads
from lcpcli.methods import registry as methods
from lcpcli.methods.direct import MOST_PIVOTED, as_dense, as_sparse, stored
from lcpcli.methods.lemke import reduced
from lcpcli.methods.stages import FAULTS
from lcpcli.methods.z_matrix import of_tridiagonal
from lcpcli.model.arrays import as_vector, by_names
from lcpcli.model.box import ORTHANT, Box, bounds_of, of_masks
from lcpcli.model.problem import Problem, as_problem
from lcpcli.model.right_hand_sides import like_with
from lcpcli.model.words import Start
from lcpcli.options import Limits
from lcpcli.solving import direct_run
from lcpcli.solving.call import SolverOptions, chosen, run
from lcpcli.solving.direct_run import Session
from lcpcli.solving.result import Result
from lcpcli.typing import BoundLike, States, VectorLike

if TYPE_CHECKING:
    from typing_extensions import Unpack

# Basic solutions: if they are not enough, the states were not near.
MOST_TRIED_BASES = 3
# Of the angle between two q, from which their solutions may have the same states.
CLOSE_COSINE = 0.9


class Solver:
    """A solver for problems with one M, for time steps and other sequences: M is
    checked and prepared once, and each problem is solved from the states of the
    previous solution, where these are near.

    Parameters
    ----------
    M : shape (n, n), as in `solve`; it is copied unless it is read-only.
    lower, upper, infinity : the bounds of z, as in `solve`, for all problems that have
        none of their own.
    compiled : whether the kernels of the extra `fast` are used, by default where it is
        installed.
    options : tol, max_iterations, time_limit and threads, as in `solve`, for every
        problem.

    A Solver serves one thread at a time; each thread needs its own. It raises the same
    errors as `solve`.

    >>> import lcpcli
    >>> solver = lcpcli.Solver([[2, 1], [1, 2]])
    >>> [solver.solve(q).z.round(6).tolist() for q in ([-5, -4], [-5.5, -4.1], [1, -2])]
    [[2.0, 1.0], [2.3, 0.9], [0.0, 1.0]]
    """

    # Whether there are so many problems that the kernels of the extra `fast` are worth
    # loading.
    compiled = True
    n, _infinity = -1, math.inf
    # The bounds where they are the same for all unknowns, however many these are.
    _ends: Mapping[str, Any] | None = None
    _last: Result | None = None

    def __init__(
        self,
        M: Any,
        *,
        lower: BoundLike = 0.0,
        upper: BoundLike = math.inf,
        infinity: float = math.inf,
        compiled: bool | None = None,
        **options: Unpack[SolverOptions],
    ) -> None:
        given = chosen(
            options, (*SolverOptions.__annotations__, "compiled"), of="Solver"
        )
        self._given, self._limits = given, Limits.taken_from({**given})
        if compiled is not None:
            self.compiled = direct_run.uses_kernels(compiled, direct_run.MANY)
            self._given["compiled"] = compiled
        self._infinity = infinity
        ends: dict[str, Any] = {"lower": lower, "upper": upper}
        self._ends = None if any(map(np.ndim, ends.values())) else ends
        self._prepare(
            Problem(M, np.zeros(_order(M)), lower=lower, upper=upper, infinity=infinity)
        )

    @classmethod
    def of(cls, like: Problem | None, options: dict[str, Any]) -> Solver:
        """Return a Solver for problems with the same M as this one; if it is None, with
        that of the first to follow."""
        solver = cls.__new__(cls)
        solver.compiled = direct_run.uses_kernels(
            options.get("compiled"), direct_run.MANY
        )
        solver._given, solver._limits = options, Limits.taken_from({**options})
        if like is not None:
            solver._prepare(like)
        return solver

    def _prepare(self, like: Problem) -> None:
        like = as_sparse(like, stored(like.M))
        self._elimination = of_tridiagonal(like.M)
        self._like = (
            as_dense(like) if like.n <= MOST_PIVOTED and not self._elimination else like
        )
        self._principal: PrincipalSolver | None = None
        self._reduction: Reduction | None = None
        self._last = self._last if like.n == self.n else None
        self.M, self.n = self._like.M, self._like.n
        self._paused, self._pause = 0, 1

    def update(self, M: Any) -> None:
        """Replace M and keep the bounds; the next problem still starts from the last
        states, which is what this saves: M is checked and prepared anew, as by another
        Solver. Where the bounds are two numbers, as for LCPs, the new M may have
        another shape, as when contacts come and go; the last states are then
        dropped."""
        box, other = self._like.box, Problem(M, np.zeros(_order(M)))
        if other.n != self.n and self._ends is not None:
            self._prepare(Problem(M, other.q, **self._ends, infinity=self._infinity))
            return
        if other.n != self.n and not box.is_orthant:
            raise ProblemError(
                "M",
                f"has {count(other.n, 'row')} for {self.n} bounds",
                "make another Solver for it",
            )
        self._prepare(other if box.is_orthant else like_with(other, other.q, box))

    def solve(
        self,
        q: VectorLike,
        *,
        lower: BoundLike = None,
        upper: BoundLike = None,
        warm: bool = True,
    ) -> Result:
        """Return the result for a right-hand side, as `solve` does.

        q : shape (n,). lower, upper : bounds for this problem only, each as in `solve`;
            None for those of the Solver.
        warm : whether to start from the states of the last solution.
        """
        began = seconds()
        box, n = self._like.box, self.n
        q, lower, upper = by_names(
            lambda: self._like.names, q=q, lower=lower, upper=upper
        )
        if lower is not None or upper is not None:
            given = (
                box.lower if lower is None else lower,
                box.upper if upper is None else upper,
            )
            box = (
                ORTHANT
                if (bounds := bounds_of(*given, n, self._infinity)) is None
                else Box(*bounds)
            )
        return self.next(like_with(self._like, as_vector("q", q, n), box), warm, began)

    def next(
        self, problem: Problem, warm: bool = True, began: float | None = None
    ) -> Result:
        """Return the result for a problem with the M of the Solver."""
        options = methods.options_in_force("auto", problem, {})
        stopwatch = Stopwatch(seconds, seconds() if began is None else began)
        session = Session(
            problem,
            self._limits,
            options,
            stopwatch,
            self.compiled,
            reduced=self._reduced,
        )
        result = self._attempted(session, warm, threads=self._given.get("threads"))
        result = run(problem, **self._given) if result is None else result
        self._last = result if result.solved else self._last
        return result

    def follow(self, problem: Problem, compiled: bool = True) -> Result:
        """Return the result for the next problem of a sequence, as `run` does, from the
        last states, also for another M of the same shape. compiled : whether there are
        so many that kernels are worth loading."""
        if as_problem(problem).n != self.n:
            self._prepare(problem)
        elif not are_equal(problem.M, self.M):
            self.update(problem.M)
        self.compiled = compiled
        return self.next(problem)

    @with_limited_threads
    def _attempted(
        self,
        session: Session,
        warm: bool,
        threads: int | None,  # noqa: ARG002 (the decorator limits them)
    ) -> Result | None:
        """Return the result where elimination, the direct route, or a few exchanges
        from the states of the last solution, suffice; else None."""
        problem = session.problem
        if (
            self._elimination is not None
            and problem.is_moderate
            and problem.box.is_orthant
        ):
            session.stopwatch.count("setup")
            z, basic = self._elimination.solution(problem.q)
            session.stopwatch.count("solve")
            result = session.judged(
                session.point(z), 1, ("elimination",), end=of_masks(basic)
            )
            if result is not None:
                return result
        basis, result = self._states(problem) if warm else None, None
        if direct_run.applies(problem):
            session.start = None if basis is None else Start(problem, basis)
            return direct_run.exhausted(direct_run.direct_steps(session))
        if basis is not None and not self._paused:
            self._principal = self._principal or PrincipalSolver(
                self._like.M, self._like.latest
            )
            result = _near(session, basis, self._principal)
            self._pause = 1 if result is not None else 2 * self._pause
            self._paused = self._pause if self._pause > 1 else 0
        self._paused = max(self._paused - 1, 0)
        return result

    def _reduced(self, problem: Problem) -> Reduction:
        """Return the problem in bounded variables; it is kept as long as the same
        variables are bounded."""
        kept = self._reduction
        if kept is not None and kept.box is not problem.box:
            kept = kept.within(problem.box)
        self._reduction = kept or reduced(problem)
        return self._reduction

    @np.errstate(over="ignore")
    def _states(self, problem: Problem) -> States | None:
        """Return the states of the last solution; None if q points in too different a
        direction."""
        last, box = self._last, problem.box
        if last is None or (
            box is not last.problem.box and box.kinds != last.problem.box.kinds
        ):
            return None
        q, before = problem.q_ref, last.problem.q_ref
        if dot(q, before) < CLOSE_COSINE * norm(q) * norm(before):
            return None
        return box.basis_at(last.z) if last.end is None else last.end


def _order(M: Any) -> int:
    return (
        int(M.shape[0])
        if getattr(M, "shape", ())
        else len(M)
        if isinstance(M, Sized)
        else 1
    )


@np.errstate(all="ignore")
def _near(session: Session, basis: States, solver: PrincipalSolver) -> Result | None:
    """Return the result, if the problem is solved by these states or by a few exchanges
    from them; else None."""
    box, limits = session.problem.box, session.limits
    exchanges = BasicSolutions(session.problem, solver).exchanging(basis)
    pivoting = islice(exchanges, min(MOST_TRIED_BASES, limits.max_iterations))
    try:
        with within(limits.time_limit):
            steps, found = next(
                (k, found) for k, found in enumerate(pivoting, 1) if found.is_solution
            )
    except (*FAULTS, TimeIsUp, StopIteration):
        return None
    session.stopwatch.count("solve")
    z = box.z_of(box.x_within(found.z, found.w, found.basis))
    return session.judged(session.point(z), steps, ("newton",))
