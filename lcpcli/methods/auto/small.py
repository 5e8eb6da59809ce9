"""Few unknowns: pivoting, and where doubles leave the answer open, exact arithmetic.

They do where a row has a term that rounding of another one hides, as in x_1 - x_2 = 3 with both near 1e16: a violation
of the size of that term is then no more than rounding.
"""

from __future__ import annotations

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import sizes
from lcpcli.methods.newton import dense_route
from lcpcli.methods.stages import (
    Finished,
    Iterate,
    NoSolution,
    Search,
    Stage,
    Stalled,
    Turns,
    advance,
    begin,
    from_reference,
    limited,
)
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector
from lcpcli.verify.point import Criterion, Point

MOST_DECIDED = 10  # unknowns for which all states can be searched in milliseconds
PIVOTS = 3  # of lemke, per unknown: enough for most small problems that it solves
LONG = 2.0**50  # a number from which on units in the last place are no longer small fractions of one
HIDDEN = 1e-8  # relative to the largest term of a row: a term of which rounding of the others leaves half of the digits


def small(problem: Problem, x0: Vector, search: Search) -> Stage:
    """A problem of at most FEW unknowns; `search` has the methods for when exact arithmetic takes too long.

    What is found where rounding hides terms is replaced by an exact solution. What pivoting does not find is decided in
    exact arithmetic, for at most MOST_DECIDED unknowns.
    """
    decide, x, evaluations = problem.n <= MOST_DECIDED, x0, 0
    stage = from_reference(problem, x0, _pivoting if decide else search)
    while isinstance(step := advance(stage), Iterate):
        x, evaluations = step.x, step.evaluations
        if step.signs_final and _is_doubtful(problem, problem.box.z_of(x)):
            ending = yield from exactly(problem, Turns(x, evaluations), decide)
            if not isinstance(ending, Stalled):
                return ending
        yield step
    if not decide or (isinstance(step, NoSolution) and step.certificate.kind != "ray"):
        return step
    ending = yield from exactly(problem, Turns(x, evaluations), decide=True)
    if not isinstance(ending, Stalled):
        return ending
    return (yield from from_reference(problem, x, search))


def _is_doubtful(problem: Problem, z: Vector) -> bool:
    """Whether z solves the problem, but rounding hides a term of a row of M z + q, or integers may have been
    rounded."""
    (least_z, largest_z), (least_q, largest_q) = sizes(z), problem.sizes_of_q
    if max(problem.largest, largest_q) > LONG:
        return Point(Criterion(problem), z).solves()
    if min(problem.largest * least_z, least_q) >= HIDDEN * max(problem.largest * largest_z, largest_q):
        return False  # as far as one can tell without a look at M
    terms = np.abs(np.column_stack((matrices.dense(problem.M) * z, problem.q)))
    hidden = terms.min(axis=1, where=terms > 0, initial=np.inf) < HIDDEN * terms.max(axis=1)
    return bool(hidden.any()) and Point(Criterion(problem), z).solves()


def _pivoting(problem: Problem, turns: Turns) -> Stage:
    ending = yield from turns.take("newton", dense_route(problem, turns.last.x))
    if isinstance(ending, Finished):
        return ending
    return (yield from turns.take("lemke", limited(begin("lemke", problem, turns.last.x), PIVOTS * problem.n)))


def exactly(problem: Problem, turns: Turns, decide: bool) -> Stage:
    """The turn of exact arithmetic, from the last iterate."""
    from lcpcli.methods.auto.exact import exact

    return (yield from turns.take("exact", exact(problem, problem.box.z_of(turns.last.x), decide)))
