"""The result of a solve: how it ended, its numbers, what exact arithmetic proves and,
if requested, its trace."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, TypeVar, cast

import numpy as np

from lcpcli.clock import imports
from lcpcli.interrupts import deadline_after
from lcpcli.model import views
from lcpcli.model.box import in_words
from lcpcli.model.problem import Problem
from lcpcli.options import Limits
from lcpcli.typing import BasisStatus, VectorLike
from lcpcli.verify.point import Point

if TYPE_CHECKING:
    import os
    from fractions import Fraction

    from lcpcli.solving.derivatives import OneDerivative, OneGradient
    from lcpcli.solving.trace import Trace
    from lcpcli.verify.certificate import Proof
    from lcpcli.verify.error_theorems import Bound

# What is proved of a program.
WITHOUT_OPTIMUM = INFEASIBLE, UNBOUNDED, NONE = "infeasible", "unbounded", "no_optimum"
T = TypeVar("T")


def _derived(read: Callable[[Result], T]) -> T:
    """Return a property of a Result; for type checkers it is the value."""
    return cast(T, property(read))


@dataclass(frozen=True, eq=False, repr=False)
class Result:
    """The outcome of one method on one problem. A failed result still carries its best
    iterate and its trace.

    status, message : how the run ended, in one word and in one sentence.
    point : the best iterate and its measures, each computed when it is first read:
    z, w : the best iterate and w = M z + q, each of shape (n,), without scaling.
    residual, relative_residual, error : as defined in `point.Point`, recomputed from M
        and q; the error is the distance to the nearest known solution, None if none is
        known.
    names : those of the components of z, "" for those without one.
    negligible_q : the indices, from 0, of the entries of q that had to be treated as 0:
        in a large problem they may be rounding errors (see `verify.point`). The
        relative residual leaves them out, the residual does not.
    objective_error : of a program that is solved, by how much its objective may differ
        from the minimum, relative to its size (see `verify.objective`); else None.
    iterations, evaluations : the number of iterations, and of evaluations of F, or of
        its smoothed form, in them.
    seconds : the time from the problem in memory (for `solve`, from its arrays) to the
        verified result, without imports and the recording of traces. It is the sum of
        three times:
    setup_seconds, solve_seconds, verify_seconds : for setting up the method, for
        iterating, and for measuring accuracy.
    basis : the status of each variable: "lower" or "upper" where z is at that bound,
        else "basic", where w = 0. After Lemke's method it is the last basis of the
        path, in which basic variables may be at bounds.
    limits : the tolerance for the relative residual, and the limits on iterations and
        time.
    options : the values of the method's options in this run.
    interrupted : whether Ctrl-C stopped the run, even if z proves to be a solution;
        False if a callback ended it.
    label : the name of the run among several of the same method, as in shi:p=10; "" for
        the method's name.
    trace, curve : the recorded rows, and a second trace for figures and milestones;
        each None if not requested.
    spread : the median time of the repetitions relative to `seconds`; None if there
        were none.
    route : the methods that took part, in order.
    end : the basis of the solution if the method reports one, as Lemke's method does,
        in which basic variables may be at bounds; else None.
    nearest : the method in the route whose iterate is reported; "" if there is only
        one.
    certificate : the proof that there is no solution, or the ray on which Lemke's
        method ended; else None.
    exact : what has been proved exactly, or None if not requested.
    bound : the proved bound on |z - z*|_inf, infinite if nothing is proved; None if not
        requested.
    verified : whether the claim to have solved the problem holds for the recomputed
        residual; None without a claim.
    others, exactly_solvable : whether the problem has further solutions, and whether,
        with its numbers as written, it has an exact one; each None if unknown or not
        requested.
    suggestions, answer, digits : computed when they are first read, and therefore not
        counted in `seconds`.

    to_dict(), to_json() return what `lcp solve --format json` writes; plot(file=None)
    draws the trace, as `lcpcli.plot` does; derivative(...) and gradient(g) say how z
    changes with M, q and the bounds (`lcp help derivatives`).

    >>> import lcpcli
    >>> result = lcpcli.solve([[2, 1], [1, 2]], [-5, -6])
    >>> result.solved, result.z.round(3).tolist(), result.residual < 1e-9
    (True, [1.333, 2.333], True)
    >>> result
    <Result: solved by newton, n = 2, residual ..., in ..., z = (1.333333, 2.333333)>
    """

    problem: Problem
    method: str
    status: Status
    message: str
    point: Point
    iterations: int
    evaluations: int
    parts: Mapping[str, float]
    limits: Limits
    options: dict[str, Any]
    route: tuple[str, ...]
    trace: Trace | None = None
    curve: Trace | None = None
    certificate: Proof | None = None
    interrupted: bool = False
    label: str = ""
    spread: float | None = None
    bound: Bound | None = None
    exact: Exact | None = None
    verified: bool | None = None
    others: bool | None = None
    exactly_solvable: bool | None = None
    nearest: str = ""
    end: BasisStatus | None = None

    z = _derived(lambda result: result.point.z)
    w = _derived(lambda result: result.point.w)
    residual = _derived(lambda result: result.point.residual)
    relative_residual = _derived(lambda result: result.point.relative_residual)
    negligible_q = _derived(lambda result: result.point.negligible)
    names = _derived(lambda result: result.problem.names)
    error = _derived(lambda result: result.problem.error(result.z))
    tol = _derived(lambda result: result.limits.tol)
    setup_seconds = _derived(lambda result: result.parts["setup"])
    solve_seconds = _derived(lambda result: result.parts["solve"])
    verify_seconds = _derived(lambda result: result.parts["verify"])
    seconds = _derived(lambda result: sum(result.parts.values(), 0.0))
    success = _derived(lambda result: result.solved)  # the name that scipy uses

    # As many parameters as fields that differ: a record of them would take as long to
    # make as the result.
    @classmethod
    def of_solution(
        cls,
        route: tuple[str, ...],
        steps: int,
        limits: Limits,
        options: dict[str, Any],
        parts: Mapping[str, float],
        evaluations: int | None = None,
        end: BasisStatus | None = None,
        reason: str = "",
        **attributes: Any,
    ) -> Result:
        """Return the result of `auto` for a problem that it has solved, much faster
        than the constructor.

        evaluations : by default as many as steps. attributes : its problem and point,
            or what they are made of when read, and what differs in other runs."""
        result = cls.__new__(cls)
        result.__dict__.update(
            method="auto",
            status=Status.SOLVED,
            message=Status.SOLVED.sentence(reason) if reason else SAID_OF_SOLVED,
            iterations=steps,
            evaluations=steps if evaluations is None else evaluations,
            parts=parts,
            limits=limits,
            options=options,
            route=route,
            end=end,
        )
        result.__dict__.update(attributes)
        return result

    def __repr__(self) -> str:
        return str(views.outcome.result_text(self))

    def _repr_html_(self) -> str:
        return str(views.tables.result_html(self))

    def to_dict(self) -> dict[str, Any]:
        """Return the object that `lcp solve --format json` writes; `advice` names
        options as in Python."""
        return {**views.result_formats.data(self), "advice": self.advice or None}

    def to_frame(self) -> Any:
        """Return a pandas data frame, if pandas is installed: z, w and state, with a
        row for each unknown, by name."""
        return views.outcome.frame(self)

    def to_json(self) -> str:
        """Return the object of `to_dict` as JSON in one line."""
        return str(views.result_formats.text(self.to_dict()))

    def plot(self, file: str | os.PathLike[str] | None = None) -> Any:
        """Draw the iterates in a `Picture`, as `lcpcli.plot` does; the run must have
        recorded them, with trace=True."""
        return views.plotting.plot(self, file)

    @property
    def objective_error(self) -> float | None:
        if not self.solved or self.problem.block_form is None:
            return None
        with imports:
            from lcpcli.verify.objective import objective_error_at
        return objective_error_at(self.problem, self.point)

    @cached_property
    def linearizations(self) -> list[Any]:
        """Return the bases and factors that earlier derivatives have stored for later
        ones."""
        return []

    def __getstate__(self) -> dict[str, Any]:
        return {
            name: value
            for name, value in vars(self).items()
            if name != "linearizations"
        }

    def derivative(
        self,
        dM: Any = None,
        dq: VectorLike | None = None,
        dlower: VectorLike | None = None,
        dupper: VectorLike | None = None,
        one_sided: bool = False,
        J: Any = None,
    ) -> OneDerivative:
        """Return the derivative of z and w for a change of the data in one direction.
        `Derivative` explains what holds at kinks, where z_i is at a bound and w_i = 0,
        and what `one_sided` does there.

        dM : shape (n, n), dense or sparse. dq, dlower, dupper : shape (n,). None means
        no change; only a finite bound can be changed, and equal bounds only together.
        J : shape (k, n), for the derivative of J z instead of z, which may exist where
        that of z does not. Raises DerivativeError if the problem is not solved or there
        is no derivative.

        >>> import lcpcli
        >>> result = lcpcli.solve([[2, 1], [1, 2]], [-5, -6])
        >>> result.derivative(dq=[3, 0]).z.round(9).tolist()
        [-2.0, 1.0]
        """
        changes = {"dM": dM, "dq": dq, "dlower": dlower, "dupper": dupper}
        derivative: OneDerivative = views.derivative.derivative(
            self.problem, self, changes, one_sided, J
        )
        return derivative

    def gradient(self, g: VectorLike, J: Any = None) -> OneGradient:
        """Return the derivatives of a function of z with respect to M, q and the
        bounds, by solving one linear system.

        g : the gradient of the function at z, shape (n,); with J, of shape (k, n), of a
        function of J z, shape (k,). Where g is 0 all derivatives are 0, also of a
        problem that is not solved; for other g it raises DerivativeError as
        `derivative` does.

        >>> import lcpcli
        >>> result = lcpcli.solve([[2, 1], [1, 2]], [-5, -6])
        >>> gradient = result.gradient([3, 0])
        >>> gradient.q.round(9).tolist(), gradient.M.round(6).tolist()
        ([-2.0, 1.0], [[-2.666667, -4.666667], [1.333333, 2.333333]])
        """
        gradient: OneGradient = views.derivative.gradient(self.problem, self, g, J)
        return gradient

    def __getitem__(self, name: str) -> float:
        """Return the component of z with this name; a multiplier of a maximization has
        the sign of the maximization. Raise KeyError, suggesting a likely name, if there
        is none."""
        with imports:
            from lcpcli.model.words import component
        return float(component(self.problem, name, self.z))

    @property
    @np.errstate(all="ignore")
    def basis(self) -> list[str]:
        w = None if self.solved else self.w  # w of a solution rounds to 0
        return in_words(
            self.problem.box.basis_at(self.z, w) if self.end is None else self.end
        )

    @cached_property
    def suggestions(self) -> Suggestions:
        """Return what to try next if the problem is not solved; `advice` says it in one
        line."""
        suggestions: Suggestions = views.advice.suggestions(self)
        return suggestions

    @cached_property
    def answer(self) -> Any:  # an Answer, whose kind the reader knows from the problem
        """Return what the result means for what the problem was made from, such as a
        program or a game: what its formulation says; None if it is defined by M and
        q."""
        return self.problem.formulation.answer(self)

    @property
    def digits(self) -> list[int | None] | None:
        """Return how many digits of each z_i the data determine, if their numbers are
        rounded to double precision: from 0 to 16, or None for a z_i that rounding may
        move off its bound, or that is not unique. Return None if the problem is not
        solved, is too large (also for half of the time limit), or was interrupted. See
        `verify.digits`."""
        return None if self._determined is None else self._determined[0]

    @property
    def not_unique(self) -> list[int] | None:
        """Return the indices, from 0, of the components of z that differ, to working
        precision, among the solutions close to z, as far as their bases show it; None
        where `digits` is None."""
        return None if self._determined is None else self._determined[1]

    @cached_property
    def _determined(self) -> tuple[list[int | None], list[int]] | None:
        if not self.solved or self.interrupted:
            return None
        with deadline_after(self.limits.time_limit / 2):
            determined: tuple[list[int | None], list[int]] | None = (
                views.digits.determined(self.problem, self.z, self.w)
            )
            return determined

    @property
    def solved(self) -> bool:
        """Return whether z is a solution: by its residual, recomputed from M and q, or
        by exact arithmetic."""
        return self.status is Status.SOLVED

    @property
    def word(self) -> str:
        """Return the word of the status or, for a program without an optimum, that of
        its answer, such as unbounded."""
        proved = None if self.solved else getattr(self.answer, "word", None)
        return word_of(self.status.word, proved)

    def __bool__(self) -> bool:
        reason = (
            "is neither true nor false, as a problem that is not solved may be "
            "proved to have no solution"
        )
        raise TypeError(f"a Result {reason}; use result.solved or result.status")

    @property
    def advice(self) -> str:
        """Return what to try next, as options in Python; "" if nothing is known to
        help, or nothing is needed."""
        return "" if self.solved else self.suggestions.line(views.advice.in_python)


def word_of(status: str, proved: str | None) -> str:
    """Return one word for how a run ended: the status or, for a program without an
    optimum, why it has none."""
    return proved if proved in WITHOUT_OPTIMUM else status


class Status(Enum):
    """How a solve ended. The value is for users; `word` is for JSON and scripts.

    SOLVED : the relative residual, recomputed from M and q, is at most the tolerance.
    ITERATION_LIMIT, TIME_LIMIT : stopped by a limit.
    STALLED : the method makes no further progress in double precision, or its claim
        fails verification.
    DIVERGED : the iterates diverge.
    BREAKDOWN : the method cannot continue, for instance because a matrix is singular.
    INFEASIBLE : proved to have no z >= 0 with M z + q >= 0 or, with bounds, no z within
        them whose w has the signs that they require; the certificate holds the Farkas
        vector.
    UNSOLVABLE : proved to have no solution, as every complementary set is excluded.
    ILL_POSED : the problem in double precision has a solution, too large to satisfy the
        tolerance, but a change of M within its rounding provably leaves none, and the
        certificate holds the Farkas vector of that proof; or the numbers as written
        decide otherwise than their doubles, or what they decide is not known.
    RAY : Lemke's method ended on a ray, which proves nothing for this M.
    INTERRUPTED : ended by Ctrl-C, or by a callback.

    >>> from lcpcli import Status
    >>> [status.word for status in Status if status.has_no_solution]
    ['infeasible', 'unsolvable']
    """

    SOLVED = "solved"
    ITERATION_LIMIT = "stopped at the iteration limit"
    TIME_LIMIT = "stopped at the time limit"
    STALLED = "stalled"
    DIVERGED = "diverged"
    BREAKDOWN = "broke down"
    INFEASIBLE = "proved infeasible"
    UNSOLVABLE = "has no solution"
    ILL_POSED = "ill-posed"
    RAY = "ended on a ray"
    INTERRUPTED = "interrupted"

    @property
    def word(self) -> str:
        """Return the word for the status in JSON and scripts, its name in lower
        case."""
        return self.name.lower()

    def sentence(self, reason: str) -> str:
        """Return the sentence about a run with this status and reason; the reason is ""
        if the status says it all."""
        statement = Status.UNSOLVABLE.value if self is Status.INFEASIBLE else self.value
        return f"{statement}: {reason}" if reason else statement

    @property
    def has_no_solution(self) -> bool:
        """Return whether the problem is proved to have no solution."""
        return self in (Status.INFEASIBLE, Status.UNSOLVABLE)


SAID_OF_SOLVED = Status.SOLVED.sentence("")


class Exact(NamedTuple):
    """What rational arithmetic proves about a problem whose decimals are taken as
    written.

    status : solved, infeasible or unsolvable; None if nothing was proved.
    proof : how the status is proved, as a clause for the user.
    z, w : the solution and w = M z + q, each of length n, if it is solved; else None.
    y : of length n, a Farkas vector of integers, if it is infeasible; else None.
    """

    status: Status | None
    proof: str
    z: list[Fraction] | None = None
    w: list[Fraction] | None = None
    y: list[Fraction] | None = None


Options: TypeAlias = Mapping[str, Any]  # names as in Python
NOTHING: Options = {}


class Suggestions(NamedTuple):
    """Options to be added to those of a run, or to replace them.

    ways : what to try, the surest first; empty if nothing is known to help, or nothing
        is needed.
    more : options that each of the ways needs in addition. others : what else to try,
        in words.
    """

    ways: tuple[Options, ...] = ()
    more: Options = NOTHING
    others: tuple[str, ...] = ()

    def line(self, written: Callable[[Options], str]) -> str:
        """Return one line of advice, with options as `written` writes them; "" if there
        is nothing to suggest."""
        if not self.ways and not self.others:
            return ""
        suggestions = ", or ".join([*map(written, self.ways), *self.others])
        return f"try {suggestions}{f', with {written(self.more)}' if self.more else ''}"
