"""Runs of methods: what they pass to the loop, sequences of methods, and the inverse
transformation of iterates of transformed problems."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, TypeVar

import numpy as np

from lcpcli.basis.exchanges import BasicSolutions
from lcpcli.clock import imports
from lcpcli.errors import LCPError, ProblemError, raised
from lcpcli.interrupts import TimeIsUp
from lcpcli.linalg.doubles import is_finite, largest
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.methods import registry as methods
from lcpcli.model.changes import Change, shifted
from lcpcli.model.problem import Problem
from lcpcli.typing import BasisStatus, Vector

if TYPE_CHECKING:
    from lcpcli.model.changes import StandardForm
    from lcpcli.verify.certificate import Proof


class Iterate(NamedTuple):
    """One iterate of a method that works on F(x) = M z - w + q with z = |x| + x.

    x : shape (n,), a separate array that the method never modifies again.
    F : shape (n,) or None; F or its smoothed form at x if the method has computed it.
        If it is F itself, |min(z, M z + q)| <= |F| componentwise, which saves the
        loop computing the residual of every iterate.
    step : the step of the published algorithm that produced this iterate, as numbered
        there; "" if it has only one.
    evaluations : evaluations of F (or of its smoothed form) so far; principal systems
        solved for pivoting methods.
    method : the method that produced it, if several alternate; "" if there is only one.
    signs_final : False if the method knows that a next step would correct
        infeasibilities beyond rounding: an iterate within the tolerance may then not be
        accurate to the last digits.
    basis : of a solution, the basis at which pivoting has ended, in which basic
        variables may be at bounds; or None.
    z0 : on the path of Lemke's method, the value of the artificial variable z_0; or
        None.
    quantities : returns an object that has the quantities that the method declares as
        attributes, each None where it is not defined. It is called only if they are
        requested, which may be some iterates later. If the object of the first iterate
        has an attribute `of_start`, that has those of the start.
    """

    x: Vector
    F: Vector | None
    step: str
    evaluations: int
    method: str = ""
    signs_final: bool = True
    basis: BasisStatus | None = None
    z0: float | None = None
    quantities: Callable[[], object] | None = None


@dataclass(eq=False, repr=False)
class _MethodEnding:
    """How a method ended. reason : a clause for the user; "" if the kind of ending is
    enough.
    method : the method that ended, where several alternate; "" if there is only one.
    """

    reason: str = ""
    method: str = ""


class Finished(_MethodEnding):
    """The method is complete: its last iterate satisfies its equation up to
    rounding."""


class Stalled(_MethodEnding):
    """The method makes no further progress in double precision."""


class Undecided(Stalled):
    """The attempts so far leave open whether there is a solution, or have lost a proof
    to rounding in transformed variables: it remains for milp to decide, which works on
    the original problem."""


class GivenUp(Stalled):
    """The method is made for problems like this one, and has failed: other methods
    would only take time."""


class OutOfTime(_MethodEnding):
    """The method has used up its time limit; the reason says what remains
    undecided."""


class Breakdown(_MethodEnding):
    """The method cannot continue."""


@dataclass(eq=False, repr=False)
class NoSolution:
    """There is no solution, or the method cannot continue; the certificate says
    which."""

    certificate: Proof
    method: str = ""


class PackageFault(Exception):
    """A method of another package is wrong."""


Ending: TypeAlias = Finished | Stalled | OutOfTime | Breakdown | NoSolution
Stage: TypeAlias = Generator[Iterate, None, Ending]
"""A running method: a generator of the iterates after the start, which returns how it
ended."""
RecordedStages: TypeAlias = dict[str, list[Stage]]
"""Stages that have run before, to be passed on again instead of being run again: those
of each method in order."""


# Relative to the largest |q|: the size of F up to which the basis of an iterate may be
# that of a solution.
NEARLY_SOLVED = 1e-6
NOWHERE = np.empty(0)  # the start of a sequence whose start is never read
TIME_LIMIT_REACHED = "the time limit is reached"
NO_STANDARD_FORM = "numbers overflow in the standard form"
INEXACT = (
    "no solution was computed, and the change of variables rounded, so that there is "
    "no proof either"
)
FAULTS = (FloatingPointError, MemoryError, PackageFault, SingularMatrix)
"""What a running method may raise when it cannot continue."""
FAULT_KINDS = {  # of FloatingPointError, by how numpy's message begins
    "overflow": "an overflow of double precision",
    "divide": "a division by zero",
    "invalid": "an undefined operation on infinite numbers",
}

Item = TypeVar("Item")
End = TypeVar("End")


def advance(stage: Generator[Item, None, End]) -> Item | End:
    """Return the next iterate of a stage or, after the last one, how the stage
    ended."""
    try:
        return next(stage)
    except StopIteration as stop:
        ending: End = stop.value
        return ending


def clause_on(error: Exception) -> str:
    """Return a clause for the user on one of FAULTS."""
    if isinstance(error, MemoryError):
        return "there is not enough memory"
    if isinstance(error, SingularMatrix):
        # A message of numpy begins with a capital.
        ours = str(error) if not str(error)[:1].isupper() else ""
        return (
            ours or "a linear system that is singular or not finite in double precision"
        )
    return next(
        (
            kind
            for message, kind in FAULT_KINDS.items()
            if str(error).startswith(message)
        ),
        str(error),
    )


def ended(ending: Ending, *iterates: Iterate) -> Stage:
    """Return a stage of these iterates, by default none, that returns `ending`."""
    yield from iterates
    return ending


def recorded(name: str, stage: Stage, recorded_stages: RecordedStages) -> Stage:
    """Pass on the stage; when it finishes, append a stage with the same iterates and
    the same ending to those of a name."""
    iterates = list[Iterate]()
    ending: Ending = Stalled()
    try:
        while isinstance(step := advance(stage), Iterate):
            iterates.append(step)
            yield step
        ending = step
    except FAULTS as error:
        ending = Breakdown(clause_on(error))
        raise
    finally:
        recorded_stages.setdefault(name, []).append(ended(ending, *iterates))
    return step


def limited(stage: Stage, max_iterations: float) -> Stage:
    """Pass on the stage; after max_iterations iterates it is treated as stalled."""
    return MethodSequence(faults=()).run_stage("", stage, max_iterations)


def begin(method: str, problem: Problem, x0: Vector, **options: Any) -> Stage:
    """Start a method on a problem, through its standard form if the method knows only z
    >= 0."""
    declared, function = methods.declared(method), methods.load(method)
    if declared.max_unknowns is not None and problem.n > declared.max_unknowns:
        return ended(
            Breakdown(
                f"it takes at most {declared.max_unknowns} unknowns; this "
                f"problem has {problem.n}"
            )
        )
    method_function = function if declared.takes_bounds else partial(as_lcp, function)
    package = function.__module__.partition(".")[0]
    if package == "lcpcli":
        return method_function(problem, x0, **options)
    with _blaming(package):
        return _guarded(method_function(problem, x0, **options), problem.n, package)


@contextmanager
def _blaming(package: str) -> Iterator[None]:
    """Open a context in which errors of another package become a PackageFault."""
    try:
        yield
    except (*FAULTS, TimeIsUp, LCPError):
        raise
    except Exception as error:
        raise PackageFault(f"the package {package} raises {raised(error)}") from error


def _guarded(stage: Stage, n: int, package: str) -> Stage:
    """Pass on the stage of a method of another package; raise PackageFault if it breaks
    the contract of methods."""
    with _blaming(package):
        while isinstance(step := advance(stage), Iterate):
            x, evaluations = step.x, step.evaluations
            if not isinstance(x, np.ndarray) or x.dtype.kind not in "fiu":
                raise PackageFault(
                    f"the package {package} yields an x that is not an array of numbers"
                )
            if x.shape != (n,):
                raise PackageFault(
                    f"the package {package} yields an x of shape {x.shape} for "
                    f"{n} unknowns"
                )
            if np.isnan(x).any():
                raise PackageFault(f"the package {package} yields an x with nan")
            if not isinstance(evaluations, int | np.integer):
                raise PackageFault(
                    f"the package {package} counts {evaluations!r} evaluations"
                )
            yield step
    if not isinstance(step, Ending):
        raise PackageFault(f"the package {package} yields or returns {step!r}")
    return step


def as_lcp(
    function: Callable[..., Stage], problem: Problem, x0: Vector, **options: Any
) -> Stage:
    """Return the stage of an LCP, or for a mixed problem the stage of its standard
    form."""
    standard_form = standard_form_of(problem)
    if standard_form is None:
        return ended(Breakdown(NO_STANDARD_FORM))
    stage = function(
        standard_form.problem,
        x0 if standard_form.is_identity else standard_form.start(x0),
        **options,
    )
    return (
        stage
        if standard_form.is_identity
        else in_given_variables(standard_form, stage, BasicSolutions(problem))
    )


def standard_form_of(problem: Problem) -> StandardForm | None:
    """Return the problem as an LCP; None if numbers overflow in it."""
    with imports:
        from lcpcli.model.changes import standard_form
    try:
        return standard_form(problem)
    except ProblemError:
        return None


def changed(
    change: Change, x0: Vector, run: Callable[[Problem, Vector], Stage]
) -> Stage:
    """Return what `run` does with the problem in other variables, from x0, as a stage
    in the original variables."""
    if change.is_identity:
        return run(change.problem, x0)
    return in_given_variables(change, run(change.problem, change.start(x0)))


def in_given_variables(
    change: Change, stage: Stage, polishing: BasicSolutions | None = None
) -> Stage:
    """Pass on the stage with x, F and, in its ending, the proof, if any, of the
    original problem. polishing : as in `MethodSequence`."""
    ending_of = partial(_ending_in_given_variables, change)
    sequence = MethodSequence(None, change, polishing, ending_of, ())
    return sequence.run_stage("", stage)


def in_new_variables(change: Change, stage: Stage) -> Stage:
    """Pass on a stage of the original problem with x of the problem in other
    variables."""
    while isinstance(step := advance(stage), Iterate):
        yield step._replace(x=change.start(step.x), F=None)
    return step


def moved_back(
    change: Change, stage: Stage, polishing: BasicSolutions | None = None
) -> Stage:
    """Pass on the stage with x and F of the original problem, as `in_given_variables`,
    and its ending as it is."""
    return MethodSequence(None, change, polishing, faults=()).run_stage("", stage)


def _ending_in_given_variables(change: Change, ending: Ending) -> Ending:
    """Return an ending with the proof, if any, of the original problem."""
    if not isinstance(ending, NoSolution):
        return ending
    with imports:
        from lcpcli.verify.certificate import MANY, UNVERIFIED, first_proof
    proof, original_problem = ending.certificate, change.original
    if proof.kind == "exhaustion":
        return ending if change.is_exact else Undecided(INEXACT)
    if proof.vector is None or proof.kind == "ray":
        return replace(ending, certificate=replace(proof, vector=None))
    statement = proof.statement if original_problem.box is change.problem.box else ""
    original_proof = first_proof(
        original_problem,
        [change.multipliers(proof.vector)],
        statement,
        rounded_from=MANY,
    )
    if original_proof is None:
        return Stalled(UNVERIFIED[proof.kind])
    return replace(ending, certificate=original_proof)


class Part:
    """A stage that may be suspended, and continued later.

    method : the method of iterates that name none.
    max_iterates : how many iterates it yields before it is suspended again.
    evaluations : the evaluations so far.
    is_over : whether it has ended, or raised an error.
    """

    def __init__(
        self, method: str, stage: Stage, max_iterates: float = math.inf
    ) -> None:
        self.method = method
        self.stage = stage
        self.max_iterates = max_iterates
        self.evaluations, self.is_over = 0, False


class MethodSequence:
    """The methods of a run, one after another. All stages that only pass on iterates do
    so here: with the method, the evaluations since the first part began, and in the
    variables of the run.

    last : the newest iterate, or the start with its evaluations, as the parts have it.
    change : to the variables of the parts from those in which iterates are passed on.
    polishing : the basic solutions of a mixed problem, which replace the basic
        solutions of its standard form, as the standard form has more numbers to round,
        and yields no F of the original problem.
    ending_of : returns the ending that is passed on.
    faults : the errors that are treated as a breakdown of a part.
    """

    def __init__(
        self,
        x0: Vector | None = None,
        change: Change | None = None,
        polishing: BasicSolutions | None = None,
        ending_of: Callable[[Ending], Ending] | None = None,
        faults: tuple[type[Exception], ...] = FAULTS,
    ) -> None:
        start = NOWHERE if x0 is None else x0
        self.last = Iterate(start, None, "", 0)
        self._change = None if change is None or change.is_identity else change
        self._polishing = polishing
        self._ending_of = ending_of
        self._faults = faults

    def run_stage(
        self, method: str, stage: Stage, max_iterates: float = math.inf
    ) -> Stage:
        """Run the whole stage of a method, passing on its iterates under the name
        of the method, or under the names of the methods that it consists of."""
        return self.run_part(Part(method, stage), max_iterates)

    def run_part(self, part: Part, max_iterates: float = math.inf) -> Stage:
        """Run a part for at most `max_iterates` iterates; after these it is suspended,
        and is treated as stalled."""
        n_passed, evaluations_before = 0, self.last.evaluations - part.evaluations
        max_iterates = min(max_iterates, part.max_iterates)
        while n_passed < max_iterates:
            part.is_over = True
            try:
                step = advance(part.stage)
            except self._faults as error:
                return Breakdown(clause_on(error), part.method)
            method = step.method or part.method
            if not isinstance(step, Iterate):
                ending: Ending = replace(step, method=method)
                return ending if self._ending_of is None else self._ending_of(ending)
            part.is_over, part.evaluations = False, step.evaluations
            n_passed += 1
            self.last = step._replace(
                evaluations=evaluations_before + step.evaluations, method=method
            )
            yield (
                self.last
                if self._change is None
                else self._in_original_variables(self._change)
            )
        return Stalled(f"{n_passed} iterations were not enough", part.method)

    def _in_original_variables(self, change: Change) -> Iterate:
        """Return the last iterate with x and F of the original problem."""
        step, polishing = self.last, self._polishing
        with np.errstate(over="ignore", invalid="ignore"):
            x, F = change.back(step.x), None
            if polishing is None:
                F = None if step.F is None else change.residual(step.F)
            elif step.F is None or largest(step.F) <= NEARLY_SOLVED * largest(
                change.problem.q
            ):
                with suppress(SingularMatrix):
                    basic_solution = polishing.at(polishing.box.basis_of(x))
                    if (
                        is_finite(basic_solution.w)
                        and not polishing.violated(basic_solution).any()
                    ):
                        x = polishing.box.x_within(
                            basic_solution.z, basic_solution.w, basic_solution.basis
                        )
        basis = step.basis if change.keeps_states else None
        return step._replace(x=x, F=F, basis=basis)


Search: TypeAlias = Callable[..., Stage]
"""Methods that alternate on a problem, called with it and with the start, or with the
sequence that has the start as its last iterate."""


def from_reference(problem: Problem, x0: Vector, search: Search) -> Stage:
    """Search in the variables in which the reference point of the problem is 0."""
    return changed(
        shifted(problem),
        x0,
        lambda within, start: search(within, MethodSequence(start)),
    )
