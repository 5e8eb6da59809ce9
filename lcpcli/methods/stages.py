"""Runs of methods: what they pass to the loop, methods in turn, and the way back from
transformed problems."""

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
from lcpcli.typing import States, Vector

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
    method : which method produced it, if several take turns; "" if there is only one.
    signs_final : False if the method knows that a next step would correct signs that
        are violated beyond rounding: an iterate within the tolerance may then not be
        accurate to the last digits.
    basis : of a solution, the basis at which pivoting has ended, in which basic
        variables may be at bounds; or None.
    z0 : on the path of Lemke's method, the value of the artificial variable z_0; or
        None.
    quantities : returns an object that has the quantities that the method declares as
        attributes, each None where it is not defined. It is called only if they are
        asked for, which may be some iterates later. If the object of the first iterate
        has an attribute `of_start`, that has those of the start.
    """

    x: Vector
    F: Vector | None
    step: str
    evaluations: int
    method: str = ""
    signs_final: bool = True
    basis: States | None = None
    z0: float | None = None
    quantities: Callable[[], object] | None = None


@dataclass(eq=False, repr=False)
class _Ended:
    """How a method ended. reason : a clause for the user; "" if the kind of ending says
    it all.
    method : which method ended, where several take turns; "" if there is only one.
    """

    reason: str = ""
    method: str = ""


class Finished(_Ended):
    """The method is complete: its last iterate satisfies its equation up to
    rounding."""


class Stalled(_Ended):
    """The method makes no further progress in double precision."""


class Undecided(Stalled):
    """What has been tried leaves open whether there is a solution, or has lost a proof
    to rounding of the variables that it works in: it remains for milp to decide, which
    works on the problem as given."""


class GivenUp(Stalled):
    """The method is made for problems like this one, and has failed: other methods
    would only take time."""


class OutOfTime(_Ended):
    """The method has used up the time that it was given; the reason says what is left
    undecided."""


class Breakdown(_Ended):
    """The method cannot continue."""


@dataclass(eq=False, repr=False)
class NoSolution:
    """The method has found that there is no solution, or it has to give up; the
    certificate says which."""

    certificate: Proof
    method: str = ""


class PackageFault(Exception):
    """A method of another package is wrong."""


Ending: TypeAlias = Finished | Stalled | OutOfTime | Breakdown | NoSolution
Stage: TypeAlias = Generator[Iterate, None, Ending]
"""A running method: a generator of the iterates after the start, which returns how it
ended."""
Tried: TypeAlias = dict[str, list[Stage]]
"""Stages that have been made before, to be passed on again: those of each method in
order."""


# Relative to the largest |q|: the size of F up to which an iterate may stand for a
# solution.
NEARLY_SOLVED = 1e-6
NOWHERE = np.empty(0)  # the start of turns of which nobody asks for it
TIME_LIMIT_REACHED = "the time limit is reached"
NO_STANDARD_FORM = "numbers overflow in the standard form"
INEXACT = (
    "no solution was found, and the change of variables rounded, so that there is "
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
    except StopIteration as end:
        ending: End = end.value
        return ending


def clause_on(fault: Exception) -> str:
    """Return a clause for the user on one of FAULTS."""
    if isinstance(fault, MemoryError):
        return "there is not enough memory"
    if isinstance(fault, SingularMatrix):
        # numpy's begins with a capital.
        ours = str(fault) if not str(fault)[:1].isupper() else ""
        return (
            ours or "a linear system that is singular or not finite in double precision"
        )
    return next(
        (
            kind
            for message, kind in FAULT_KINDS.items()
            if str(fault).startswith(message)
        ),
        str(fault),
    )


def ended(ending: Ending, *iterates: Iterate) -> Stage:
    """Return a stage of these iterates, by default none, that ends with `ending`."""
    yield from iterates
    return ending


def recorded(name: str, stage: Stage, into: Tried) -> Stage:
    """Pass on the stage; when it ends, append a stage with the same iterates and the
    same ending to those of a name."""
    iterates = list[Iterate]()
    ending: Ending = Stalled()
    try:
        while isinstance(step := advance(stage), Iterate):
            iterates.append(step)
            yield step
        ending = step
    except FAULTS as fault:
        ending = Breakdown(clause_on(fault))
        raise
    finally:
        into.setdefault(name, []).append(ended(ending, *iterates))
    return step


def limited(stage: Stage, max_iterations: float) -> Stage:
    """Pass on the stage; it counts as stalled after max_iterations iterates."""
    return Turns(faults=()).take("", stage, max_iterations)


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
    own = function if declared.takes_bounds else partial(as_lcp, function)
    package = function.__module__.partition(".")[0]
    if package == "lcpcli":
        return own(problem, x0, **options)
    with _blaming(package):
        return _guarded(own(problem, x0, **options), problem.n, package)


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
    """Pass on the stage of a method of another package; raise PackageFault for what is
    no stage."""
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
    form = standard_form_of(problem)
    if form is None:
        return ended(Breakdown(NO_STANDARD_FORM))
    stage = function(
        form.problem, x0 if form.is_identity else form.start(x0), **options
    )
    return (
        stage
        if form.is_identity
        else in_given_variables(form, stage, BasicSolutions(problem))
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
    """Pass on the stage with x, F and the final proof, if any, of the original
    problem. polishing : as in `Turns`."""
    ends = partial(_ending_in_given_variables, change)
    return Turns(None, 0, change, polishing, ends, ()).take("", stage)


def moved_back(
    change: Change, stage: Stage, polishing: BasicSolutions | None = None
) -> Stage:
    """Pass on the stage with x and F of the original problem, as `in_given_variables`,
    and its ending as it is."""
    return Turns(None, 0, change, polishing, faults=()).take("", stage)


def _ending_in_given_variables(change: Change, ending: Ending) -> Ending:
    """Return an ending with the proof, if any, of the original problem."""
    if not isinstance(ending, NoSolution):
        return ending
    with imports:
        from lcpcli.verify.certificate import MANY, UNVERIFIED, first_proof
    proof, given = ending.certificate, change.original
    if proof.kind == "exhaustion":
        return ending if change.is_exact else Undecided(INEXACT)
    if proof.vector is None or proof.kind == "ray":
        return replace(ending, certificate=replace(proof, vector=None))
    statement = proof.statement if given.box is change.problem.box else ""
    found = first_proof(
        given, [change.multipliers(proof.vector)], statement, rounded_from=MANY
    )
    if found is None:
        return Stalled(UNVERIFIED[proof.kind])
    return replace(ending, certificate=found)


class Part:
    """A stage that may be suspended, and go on in a later turn.

    method : of its iterates that name none. most : how many it yields in its next turn.
    evaluations : so far. is_over : whether it has ended, or raised an error.
    """

    def __init__(self, method: str, stage: Stage, most: float = math.inf) -> None:
        self.method, self.stage, self.most = method, stage, most
        self.evaluations, self.is_over = 0, False


class Turns:
    """The turns of the parts of a run, one after another. All stages that only pass on
    iterates do so here: with the method, the evaluations since the first part began,
    and in the variables of the run.

    last : the newest iterate, or the start with its evaluations, as the parts have it.
    change : to the variables of the parts from those in which iterates are passed on.
    polishing : the basic solutions of a mixed problem, which replace the basic
        solutions of its standard form, as the standard form has more numbers to round,
        and yields no F of the original problem.
    ends : returns the ending that is passed on. faults : what counts as a breakdown of
        a part.
    """

    def __init__(
        self,
        x0: Vector | None = None,
        evaluations: int = 0,
        change: Change | None = None,
        polishing: BasicSolutions | None = None,
        ends: Callable[[Ending], Ending] | None = None,
        faults: tuple[type[Exception], ...] = FAULTS,
    ) -> None:
        start = NOWHERE if x0 is None else x0
        self.last = Iterate(start, None, "", evaluations)
        self._change = None if change is None or change.is_identity else change
        self._polishing, self._ends, self._faults = polishing, ends, faults

    def take(self, method: str, stage: Stage, most: float = math.inf) -> Stage:
        """Give a method its turn, which may itself consist of named methods."""
        return self.go_on(Part(method, stage), most)

    def go_on(self, part: Part, most: float = math.inf) -> Stage:
        """Give a part its turn, for so many iterates at most; it is suspended then, and
        counts as stalled."""
        passed, done = 0, self.last.evaluations - part.evaluations
        most = min(most, part.most)
        while passed < most:
            part.is_over = True
            try:
                step = advance(part.stage)
            except self._faults as fault:
                return Breakdown(clause_on(fault), part.method)
            method = step.method or part.method
            if not isinstance(step, Iterate):
                ending: Ending = replace(step, method=method)
                return ending if self._ends is None else self._ends(ending)
            part.is_over, part.evaluations = False, step.evaluations
            passed += 1
            self.last = step._replace(
                evaluations=done + step.evaluations, method=method
            )
            yield self.last if self._change is None else self._moved(self._change)
        return Stalled(f"{passed} iterations were not enough", part.method)

    def _moved(self, change: Change) -> Iterate:
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
                    found = polishing.at(polishing.box.basis_of(x))
                    if is_finite(found.w) and not polishing.violated(found).any():
                        x = polishing.box.x_within(found.z, found.w, found.basis)
        basis = step.basis if change.keeps_states else None
        return step._replace(x=x, F=F, basis=basis)


Search: TypeAlias = Callable[..., Stage]
"""Methods that take turns on a problem, called with it and with the start, or the turns
with the start as last one."""


def from_reference(problem: Problem, x0: Vector, search: Search) -> Stage:
    """Search in the variables in which the reference point of the problem is 0."""
    return changed(
        shifted(problem), x0, lambda within, start: search(within, Turns(start))
    )
