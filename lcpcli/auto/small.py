"""Problems with few unknowns: pivoting and, if doubles leave the answer open, exact arithmetic on numbers of any size.

Doubles leave the answer open where a row has a term that rounding of another term hides, as in x_1 - x_2 = 3 with both
near 1e16: a violation of the size of that term is then no more than rounding. An exact solution is sought near a point,
and then by the tree over the states of all unknowns, which finds one or proves that there is none. Both take the
problem as given: in other variables, rounding might lose the proof.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from contextlib import suppress
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from lcpcli.auto.structure import Structure
from lcpcli.clock import imports
from lcpcli.interrupts import TimeIsUp, check
from lcpcli.linalg.doubles import is_finite
from lcpcli.methods import stages
from lcpcli.methods.final_states import MOST_DECIDED, confirmed, is_doubtful
from lcpcli.methods.newton import from_start
from lcpcli.methods.stages import Ending, Finished, Iterate, NoSolution, Search, Stage, Stalled, Tried, Turns, advance
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector
from lcpcli.verify.point import Criterion, Point

if TYPE_CHECKING:
    from fractions import Fraction

    from lcpcli.rational.elimination import Effort
    from lcpcli.rational.exact_problem import ExactProblem
    from lcpcli.verify.certificate import Certificate

EXCLUDED = "each complementary set is excluded in exact arithmetic"
OUT_OF_RANGE = "there is a solution, but doubles cannot represent it: its numbers are too large or too small"
LOST_BY_ROUNDING = "there is a solution, but its nearest doubles do not solve the problem"
UNDECIDED_IN_TIME = "exact arithmetic did not decide the problem in time"
# Of the tree, in counted work: what it does at first, in which it decides nearly all problems; after turns of other
# methods it goes on, each time with twice that or the largest share, up to the most in all.
FIRST_EFFORT, LARGEST_EFFORT, MOST_EFFORT = 0.25, 2.0, 16.0


class Tree:
    """The tree over the states of a problem with few unknowns in exact arithmetic, which is suspended and goes on; most
    problems never need it, so that it is set up when it is first asked.

    is_decided : whether it has ended. solution : the exact solution that it has found; None if there is none.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem, self._share = problem, FIRST_EFFORT
        self.is_decided = False
        self.solution: list[Fraction] | None = None

    @cached_property
    def data(self) -> ExactProblem:
        """Return the problem in exact numbers."""
        with imports:
            from lcpcli.rational.exact_problem import ExactProblem
        return ExactProblem.of_floats(self._problem)

    @cached_property
    def _effort(self) -> Effort:
        with imports:
            from lcpcli.rational.elimination import Effort
        return Effort()

    @cached_property
    def _search(self) -> Iterator[list[Fraction] | None]:
        with imports:
            from lcpcli.rational.tree import solution_search
        return solution_search(self.data, self._effort.steps(self.data))

    def goes_on(self) -> bool:
        """Do the next share of the work; return whether the problem is decided."""
        until = min(self._effort.spent + self._share, MOST_EFFORT)
        while not self.is_decided and self._effort.spent < until:
            for found in self._search:
                self.is_decided, self.solution = found is not None, found
                break
            else:
                self.is_decided = True
        self._share = min(2 * self._share, LARGEST_EFFORT)
        return self.is_decided


def small(problem: Problem, x0: Vector, search: Search, tried: Tried | None = None, states: bool = False) -> Stage:
    """Solve a problem of at most FEW_UNKNOWNS; `search` runs the other methods if exact arithmetic takes too long.

    A solution that is found where rounding hides terms is replaced by an exact one. Where pivoting finds none, exact
    arithmetic decides: between the turns of the other methods, if it has not decided in its first one.

    states : whether x0 stands for states that a solution may have.
    """
    tree, turns = Tree(problem), Turns(x0)
    pivoting = partial(_pivoting, tried=tried, states=states)
    ending = yield from _without_doubt(problem, turns, stages.from_reference(problem, x0, pivoting), tree)
    if _is_proof(ending):
        return ending
    ending = yield from exactly(problem, turns, tree)
    if not isinstance(ending, Stalled):
        return ending
    start = np.zeros(problem.n) if states else turns.last.x
    others = search(problem, start, begun=True, is_decided=tree.goes_on)
    last = yield from _without_doubt(problem, turns, others)
    if _is_proof(last):
        return last
    if tree.is_decided:
        return (yield from exactly(problem, turns, tree))
    return ending if isinstance(last, Stalled) else last


def _is_proof(ending: Ending) -> bool:
    return isinstance(ending, NoSolution) and ending.certificate.kind != "ray"


def _without_doubt(problem: Problem, turns: Turns, stage: Stage, tree: Tree | None = None) -> Stage:
    """Pass on a stage up to a solution where rounding hides terms: it is replaced by an exact one, if one is found."""
    done = turns.last.evaluations
    while isinstance(step := advance(stage), Iterate):
        turns.last = step = step._replace(evaluations=done + step.evaluations)
        if step.signs_final and _is_doubtful_solution(problem, z := problem.box.z_of(step.x)):
            found = confirmed(problem, z, step.basis)
            if found is not None and found.z is not z:
                x = problem.box.x_of(found.z, problem.w(found.z))
                yield Iterate(x, None, "exact", step.evaluations, "exact", basis=found.basis)
            elif found is None:
                ending = yield from exactly(problem, Turns(step.x, step.evaluations), tree)
                if not isinstance(ending, Stalled):
                    return ending
        yield step
    return step


def _is_doubtful_solution(problem: Problem, z: Vector) -> bool:
    return is_doubtful(problem, z) and Point(Criterion(problem), z).solves()


def _pivoting(problem: Problem, turns: Turns, tried: Tried | None, states: bool) -> Stage:
    with imports:
        from lcpcli.auto.attempts import BRIEF, FIRST, in_rounds
    ending: Ending = Finished()
    if states:
        ending = yield from turns.take("newton", from_start(problem, problem.box.basis_of(turns.last.x)))
        if isinstance(ending, Finished):
            return ending
    start = np.zeros(problem.n) if states else turns.last.x
    for name, stage in in_rounds(Structure(problem, start, tried), (*FIRST, *BRIEF)):
        ending = yield from turns.take(name, stage)
        if isinstance(ending, Finished) or _is_proof(ending):
            break
    return ending


def exactly(problem: Problem, turns: Turns, tree: Tree | None = None) -> Stage:
    """Yield (z - w) / 2 of an exact solution, rounded, for a problem of at most `measure.FEW_UNKNOWNS`: of one near the
    last iterate, or else of one that the tree finds, if it is given, in its next share of work. For at most
    MOST_DECIDED unknowns the tree comes first, as it decides sooner than pivoting from states that are not right.

    Finished : there is a solution. NoSolution : it is proved that there is none. Stalled : solutions were found, but
    are out of range or do not solve the problem when rounded to doubles; or none was found in time.
    """
    return (yield from turns.take("exact", _exact(problem, problem.box.z_of(turns.last.x), tree)))


def _exact(problem: Problem, z: Vector, tree: Tree | None) -> Stage:
    with imports:
        from lcpcli.rational.elimination import Effort
        from lcpcli.rational.exact_problem import ExactProblem
        from lcpcli.verify.certificate import EXHAUSTION_EFFORT
        from lcpcli.verify.exact_solution import from_point
    data, reason = ExactProblem.of_floats(problem) if tree is None else tree.data, UNDECIDED_IN_TIME
    if tree is not None and problem.n <= MOST_DECIDED and tree.goes_on() and tree.solution is not None:
        reason = yield from _rounded(problem, tree.solution, data.w(tree.solution))
        if not reason:
            return Finished()
    if tree is None or not tree.is_decided or tree.solution is not None:
        near = None
        with suppress(TimeIsUp):
            near = from_point(data, np.where(np.isfinite(z), z, 0.0), Effort(EXHAUSTION_EFFORT))
        check()
        if near is not None:
            reason = yield from _rounded(problem, near, data.w(near))
            if not reason:
                return Finished()
    if tree is None or not tree.goes_on():
        return Stalled(reason)
    if tree.solution is None:
        return NoSolution(_no_solution(problem, data))
    reason = yield from _rounded(problem, tree.solution, data.w(tree.solution))
    return Stalled(reason) if reason else Finished()


def _rounded(
    problem: Problem, exact_z: Sequence[Fraction], exact_w: Sequence[Fraction]
) -> Generator[Iterate, None, str]:
    """Yield (z - w) / 2 of an exact solution, rounded; return "", or why that is no solution."""
    with imports:
        from lcpcli.rational.numbers import rounded
        from lcpcli.verify.exact_solution import is_rounded_solution
    z, w = rounded(exact_z), rounded(exact_w)
    if not (is_finite(z) and is_finite(w)):
        return OUT_OF_RANGE
    x = problem.box.x_of(z, w)
    yield Iterate(x, None, "exact", 1)
    z = problem.box.z_of(x)
    return "" if Point(Criterion(problem), z).solves() or is_rounded_solution(problem, z) else LOST_BY_ROUNDING


def _no_solution(problem: Problem, data: ExactProblem) -> Certificate:
    """Return the certificate of a problem that has no solution: with a Farkas vector, if it is infeasible."""
    with imports:
        from lcpcli.rational.elimination import Effort
        from lcpcli.rational.numbers import rounded_direction
        from lcpcli.verify.certificate import EXHAUSTION_EFFORT, Certificate, infeasible, proves_infeasible
        from lcpcli.verify.farkas import farkas_vector
    y = None
    with suppress(TimeIsUp):
        y = farkas_vector(data, Effort(EXHAUSTION_EFFORT).steps(data))
    vector = None if y is None else rounded_direction(y)
    if vector is None or not proves_infeasible(problem, vector):
        return Certificate("exhaustion", EXCLUDED)
    return infeasible(problem, vector)
