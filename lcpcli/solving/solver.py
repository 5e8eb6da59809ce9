"""One M prepared once for a sequence of problems, each solved from the basis of the
previous solution; and such a sequence in which M may change."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sized
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.clock import Stopwatch, seconds
from lcpcli.errors import ProblemError, count
from lcpcli.linalg.krylov import dot, norm
from lcpcli.linalg.matrices import are_equal
from lcpcli.linalg.threads import with_limited_threads
from lcpcli.methods import registry as methods
from lcpcli.model.arrays import as_vector, by_names
from lcpcli.model.box import box_of
from lcpcli.model.formulation import named
from lcpcli.model.problem import Problem, as_problem
from lcpcli.model.right_hand_sides import like_of_conditions, like_with
from lcpcli.model.words import Start
from lcpcli.options import Limits
from lcpcli.solving import direct_run
from lcpcli.solving.call import SolverOptions, chosen, run
from lcpcli.solving.direct_run import Session
from lcpcli.solving.prepared_matrix import PreparedMatrix
from lcpcli.solving.result import Result
from lcpcli.typing import BasisStatus, BoundLike, VectorLike
from lcpcli.verify.point import Criterion, Point

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from lcpcli.model.formulation import Proposal

# Cosine of the angle between two q from which on their solutions may have the same
# basis.
CLOSE_COSINE = 0.9


class Solver:
    """A solver for problems with one M, for time steps and other sequences: M is
    checked and prepared once, and each problem is solved from the basis of the previous
    solution, where this is close.

    Parameters
    ----------
    M : shape (n, n), as in `solve`; it is copied unless it is read-only. Or a Problem,
        with its bounds, whose data `update` replaces.
    lower, upper, infinity : the bounds of z, as in `solve`, for all problems for which
        `solve` gets no others.
    compiled : whether the kernels of the extra `fast` are used, by default where it is
        installed.
    options : tol, max_iterations, time_limit and threads, as in `solve`, for every
        problem.

    A Solver serves one thread at a time: use one for each thread. It raises the same
    errors as `solve`.

    >>> import lcpcli
    >>> solver = lcpcli.Solver([[2, 1], [1, 2]])
    >>> [solver.solve(q).z.round(6).tolist() for q in ([-5, -4], [-5.5, -4.1], [1, -2])]
    [[2.0, 1.0], [2.3, 0.9], [0.0, 1.0]]
    """

    # Whether the kernels of the extra `fast` are used: there are so many problems that
    # loading them is worthwhile.
    compiled = True
    n, _infinity = -1, math.inf
    _like: Problem
    # The bounds where they are the same for all unknowns, however many these are.
    _uniform_bounds: Mapping[str, Any] | None = None
    _last: Result | None = None
    # The basis from which a problem with other data starts.
    _moved: BasisStatus | None = None

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
        explicit_options = chosen(
            options, (*SolverOptions.__annotations__, "compiled"), of="Solver"
        )
        self._options = explicit_options
        self._limits = Limits.pop_from({**explicit_options})
        if compiled is not None:
            self.compiled = direct_run.uses_kernels(compiled, direct_run.MANY)
            self._options["compiled"] = compiled
        if isinstance(M, Problem):
            self._prepare(M)
            return
        self._infinity = infinity
        bounds: dict[str, Any] = {"lower": lower, "upper": upper}
        self._uniform_bounds = None if any(map(np.ndim, bounds.values())) else bounds
        self._prepare(
            Problem(M, np.zeros(_order(M)), lower=lower, upper=upper, infinity=infinity)
        )

    @classmethod
    def of(cls, like: Problem | None, options: dict[str, Any]) -> Solver:
        """Return a Solver for problems with the same M as this one; if it is None, with
        the M of the first problem that follows."""
        solver = cls.__new__(cls)
        solver.compiled = direct_run.uses_kernels(
            options.get("compiled"), direct_run.MANY
        )
        solver._options, solver._limits = options, Limits.pop_from({**options})
        if like is not None:
            solver._prepare(like)
        return solver

    def _prepare(self, like: Problem) -> None:
        self._prepared = PreparedMatrix(like)
        if like.n == self.n:
            self._prepared.like.facts.follow(self._like.facts)
        else:
            self._last, self._moved = None, None
        self._like = self._prepared.like
        self.M, self.n = self._like.M, self._like.n

    def update(self, M: Any = None, **data: Any) -> None:
        """Replace M and keep the bounds. The next problem still starts from the last
        basis, which is what this saves; M is checked and prepared again, as by another
        Solver. Where the bounds are two numbers, as for LCPs, the new M may have
        another shape, as when contacts come and go; the last basis is then dropped.

        data : instead of M, other data of what the problem was made from, such as W,
            q, mu and ids of contacts, which then keep their basis status; `solve()`
            solves that problem (see `Formulation.update`).
        """
        if M is None:
            like, basis = self._like, self._last_states()
            fast = direct_run.compiled() if self.compiled else None
            problem, moved = like.formulation.update(like, basis, data, fast)
            if problem.M is self.M:
                self._like = problem
            else:
                self._prepare(problem)
            # The statuses of the last solution may be those of other contacts.
            self._last, self._moved = None, moved
            return
        box, names = self._like.box, self._like.names
        other = Problem(M, np.zeros(_order(M)))
        if other.n == self.n and other.origin is None and any(names):
            other = other.having(origin=named(names, self.n))
        if other.n != self.n and self._uniform_bounds is not None:
            self._prepare(
                Problem(M, other.q, **self._uniform_bounds, infinity=self._infinity)
            )
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
        q: VectorLike | None = None,
        *,
        lower: BoundLike = None,
        upper: BoundLike = None,
        warm: bool = True,
    ) -> Result:
        """Return the result for a right-hand side, as `solve` does.

        q : shape (n,); None for that of the last `update`. lower, upper : bounds for
            this problem only, each as in `solve`; None for those of the Solver.
        warm : whether to start from the basis of the last solution.
        """
        began = seconds()
        box, n = self._like.box, self.n
        if q is None:
            if lower is None and upper is None:
                return self.next(self._like, warm, began)
            q = self._like.q
        q, lower, upper = by_names(
            lambda: self._like.names, q=q, lower=lower, upper=upper
        )
        if lower is not None or upper is not None:
            lower = box.lower if lower is None else lower
            upper = box.upper if upper is None else upper
            box = box_of(lower, upper, n, self._infinity)
        problem = like_of_conditions(self._like, as_vector("q", q, n), box)
        return self.next(problem, warm, began)

    def next(
        self, problem: Problem, warm: bool = True, began: float | None = None
    ) -> Result:
        """Return the result for a problem with the M of the Solver."""
        stopwatch = Stopwatch(seconds, seconds() if began is None else began)
        basis, proposal = None, None
        if warm:
            basis = self._states(problem) if self._moved is None else self._moved
        if basis is not None and problem.origin is not None:
            stopwatch.count("setup")
            proposal = self._proposal(
                problem, basis, threads=self._options.get("threads")
            )
        result = None
        if proposal is not None and proposal.is_certain:
            result = self._of_kernels(problem, proposal, stopwatch)
        if result is None:
            result = self._of_session(problem, basis, proposal, stopwatch)
        if result.solved:
            self._last, self._moved = result, None
        return result

    @with_limited_threads
    def _proposal(
        self,
        problem: Problem,
        basis: BasisStatus,
        threads: int | None,  # noqa: ARG002 (the decorator limits them)
    ) -> Proposal | None:
        """Return the point that the formulation of a problem proposes from a basis."""
        fast = direct_run.compiled() if self.compiled else None
        return problem.formulation.followed(problem, basis, self._limits.tol, fast)

    def _of_kernels(
        self, problem: Problem, proposal: Proposal, stopwatch: Stopwatch
    ) -> Result | None:
        """Return the result at a point that kernels have accepted; None beyond the
        limits."""
        limits = self._limits
        stopwatch.count("solve")
        time_limit = limits.time_limit
        is_late = time_limit < math.inf and not stopwatch.total < time_limit
        if is_late or proposal.steps > limits.max_iterations:
            return None
        return Result.of_solution(
            (proposal.method,),
            proposal.steps,
            limits,
            methods.OF_AUTO.copy(),
            stopwatch.parts,
            end=proposal.basis,
            problem=problem,
            point=Point.of_solution(Criterion(problem, limits.tol), proposal.z),
        )

    def _of_session(
        self,
        problem: Problem,
        basis: BasisStatus | None,
        proposal: Proposal | None,
        stopwatch: Stopwatch,
    ) -> Result:
        session = Session(
            problem,
            self._limits,
            methods.OF_AUTO.copy(),
            stopwatch,
            self.compiled,
            start=None if basis is None else Start(problem, basis),
            prepared=self._prepared,
            proposal=proposal,
        )
        result = self._answered(session, threads=self._options.get("threads"))
        if result is None:
            return run(problem, **self._options)
        if problem.origin is not None:
            result = problem.origin.accepted(result)
        return result

    def follow(self, problem: Problem, compiled: bool = True) -> Result:
        """Return the result for the next problem of a sequence, as `run` does, from the
        last basis, also for another M of the same shape. compiled : whether there are
        so many problems that loading kernels is worthwhile."""
        if as_problem(problem).n != self.n:
            self._prepare(problem)
        elif not are_equal(problem.M, self.M):
            self.update(problem.M)
        self.compiled = compiled
        return self.next(problem)

    @with_limited_threads
    def _answered(
        self,
        session: Session,
        threads: int | None,  # noqa: ARG002 (the decorator limits them)
    ) -> Result | None:
        return direct_run.answered(session)

    @np.errstate(over="ignore")
    def _states(self, problem: Problem) -> BasisStatus | None:
        """Return the basis of the last solution; None if q points in too different a
        direction, or other variables are bounded."""
        last, box = self._last, problem.box
        if last is None or (
            box is not last.problem.box and box.kinds != last.problem.box.kinds
        ):
            return None
        q, before = problem.q_ref, last.problem.q_ref
        if dot(q, before) < CLOSE_COSINE * norm(q) * norm(before):
            return None
        return self._last_states()

    def _last_states(self) -> BasisStatus | None:
        last = self._last
        if last is None:
            return self._moved
        return last.problem.box.basis_at(last.z) if last.end is None else last.end


def _order(M: Any) -> int:
    if getattr(M, "shape", ()):
        return int(M.shape[0])
    return len(M) if isinstance(M, Sized) else 1
