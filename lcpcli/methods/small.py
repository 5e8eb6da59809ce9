"""Problems with few unknowns: pivoting and, if doubles leave the answer open, exact arithmetic on numbers of any size.

Doubles leave the answer open where a row has a term that rounding of another term hides, as in x_1 - x_2 = 3 with both
near 1e16: a violation of the size of that term is then no more than rounding. An exact solution is sought near a point,
and then by the tree over the states of all unknowns, which finds one or proves that there is none.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from lcpcli.clock import imports
from lcpcli.interrupts import TimeIsUp
from lcpcli.linalg.doubles import is_finite
from lcpcli.methods import stages
from lcpcli.methods.final_states import MOST_DECIDED, confirmed, is_doubtful
from lcpcli.methods.stages import Ending, Finished, Iterate, NoSolution, Search, Stage, Stalled, Turns, advance
from lcpcli.methods.structure import Structure
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector
from lcpcli.verify.point import Criterion, Point

EXCLUDED = "each complementary set is excluded in exact arithmetic"
OUT_OF_RANGE = "there is a solution, but doubles cannot represent it: its numbers are too large or too small"
LOST_BY_ROUNDING = "there is a solution, but its nearest doubles do not solve the problem"
UNDECIDED_IN_TIME = "exact arithmetic did not decide the problem in time"


def small(problem: Problem, x0: Vector, search: Search, tried: dict[str, Stage] | None = None) -> Stage:
    """Solve a problem of at most FEW_UNKNOWNS; `search` runs the methods to use if exact arithmetic takes too long.

    A solution that is found where rounding hides terms is replaced by an exact one. Where pivoting finds none, exact
    arithmetic decides, for at most MOST_DECIDED unknowns.
    """
    decide, x, evaluations = problem.n <= MOST_DECIDED, x0, 0
    stage = stages.from_reference(problem, x0, partial(_pivoting if decide else search, tried=tried))
    while isinstance(step := advance(stage), Iterate):
        x, evaluations = step.x, step.evaluations
        if step.signs_final and _is_doubtful_solution(problem, z := problem.box.z_of(x)):
            found = confirmed(problem, z, step.basis)
            if found is not None and found.z is not z:
                x = problem.box.x_of(found.z, problem.w(found.z))
                yield Iterate(x, None, "exact", evaluations, "exact", basis=found.basis)
            elif found is None:
                ending = yield from exactly(problem, Turns(x, evaluations), decide)
                if not isinstance(ending, Stalled):
                    return ending
        yield step
    if not decide or (isinstance(step, NoSolution) and step.certificate.kind != "ray"):
        return step
    ending = yield from exactly(problem, Turns(x, evaluations), decide=True)
    if not isinstance(ending, Stalled):
        return ending
    return (yield from stages.from_reference(problem, x, search))


def _is_doubtful_solution(problem: Problem, z: Vector) -> bool:
    return is_doubtful(problem, z) and Point(Criterion(problem), z).solves()


def _pivoting(problem: Problem, turns: Turns, tried: dict[str, Stage] | None) -> Stage:
    with imports:
        from lcpcli.methods.auto_table import BRIEF, FIRST, in_rounds
    ending: Ending = Finished()
    for name, stage in in_rounds(Structure(problem, turns.last.x, tried), (*FIRST, *BRIEF)):
        ending = yield from turns.take(name, stage)
        if isinstance(ending, Finished) or (isinstance(ending, NoSolution) and ending.certificate.kind != "ray"):
            break
    return ending


def exactly(problem: Problem, turns: Turns, decide: bool) -> Stage:
    """Give exact arithmetic its turn, from the last iterate (see `_exact`)."""
    return (yield from turns.take("exact", _exact(problem, problem.box.z_of(turns.last.x), decide)))


def _exact(problem: Problem, z: Vector, decide: bool) -> Stage:
    """Yield (z - w) / 2 of an exact solution, rounded, for a problem of at most `measure.FEW_UNKNOWNS`.

    z : where to look for the solution first, shape (n,). decide : whether to search all states if none is near z.

    Finished : there is a solution. NoSolution : it is proved that there is none. Stalled : solutions were found, but
    are out of range or do not solve the problem when rounded to doubles; or none was found in time.
    """
    with imports:
        from lcpcli.rational.effort import Effort
        from lcpcli.rational.exact_problem import ExactProblem
        from lcpcli.rational.numbers import rounded, rounded_direction
        from lcpcli.rational.tree import first_solution
        from lcpcli.verify.certificate import EXHAUSTION_EFFORT, Certificate, farkas_statement, proves_infeasible
        from lcpcli.verify.exact_farkas import farkas_vector
        from lcpcli.verify.exact_solution import from_point
        from lcpcli.verify.refinement import is_rounded_solution
    data, effort, reason = ExactProblem.of_floats(problem), Effort(EXHAUSTION_EFFORT), UNDECIDED_IN_TIME
    near, count = partial(from_point, data, np.where(np.isfinite(z), z, 0.0), effort), effort.steps(data)
    try:
        for search in (near, partial(first_solution, data, count))[: 1 + decide]:
            solution = search()
            if solution is None:
                continue
            z, w, reason = rounded(solution), rounded(data.w(solution)), OUT_OF_RANGE
            if is_finite(z) and is_finite(w):
                x, reason = problem.box.x_of(z, w), LOST_BY_ROUNDING
                yield Iterate(x, None, "exact", 1)
                z = problem.box.z_of(x)
                if Point(Criterion(problem), z).solves() or is_rounded_solution(problem, z):
                    return Finished()
        if decide and solution is None:
            exact_y = farkas_vector(data, count)
            y = None if exact_y is None else rounded_direction(exact_y)
            if y is None or not proves_infeasible(problem, y):
                return NoSolution(Certificate("exhaustion", EXCLUDED))
            return NoSolution(Certificate("farkas", farkas_statement(problem), y))
    except TimeIsUp:
        pass
    return Stalled(reason)
