"""The stages of auto before milp for a problem as it is and, if it is mixed, first for what presolve leaves of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from lcpcli import clock
from lcpcli.clock import imports
from lcpcli.interrupts import TimeIsUp, check, remaining, within
from lcpcli.linalg import factors
from lcpcli.linalg.matrices import is_sparse
from lcpcli.methods import stages
from lcpcli.methods.auto_table import FIRST, LATER, TABLE, Row, in_rounds
from lcpcli.methods.stages import (
    TIME_LIMIT_REACHED,
    Iterate,
    NoSolution,
    OutOfTime,
    Stage,
    Stalled,
    Tried,
    advance,
    ended,
    in_given_variables,
)
from lcpcli.methods.structure import Structure
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector
from lcpcli.verify.certificate import Certificate, farkas_statement, is_clear, proves_infeasible

MANY_SHORT_ROWS = 0.2  # of all rows: with no more than one entry, from which on presolve may help the best methods too
MUCH_SMALLER = 0.8  # of the unknowns: what presolve may leave if milp is to begin with that


def all_stages(
    problem: Problem, x0: Vector, presolve: bool, tried: Tried | None = None, begun: bool = False
) -> Iterator[tuple[str, Stage]]:
    """Yield the stages before milp in order; with presolve first on what that leaves of a mixed problem, but a small or
    dense one is first given to newton, which takes no longer than presolve. milp comes after all others for what
    presolve leaves too, for half of the time that is left. tried : as in `Structure`. begun :
    whether the first stages of the table have had their turns."""
    structure = Structure(problem, x0, tried)
    rows: Sequence[Row] = LATER if begun else TABLE
    if not (presolve and problem.is_mixed):
        yield from in_rounds(structure, rows)
        return
    if not (begun or structure.is_large_and_sparse):
        yield from in_rounds(structure, FIRST)
        rows = LATER
    given = in_rounds(structure, rows)
    with imports:
        from lcpcli.model.presolve import Presolved, Refuted, presolved
    change = None
    if may_gain_by_presolve(structure):
        change = presolved(problem)
    if isinstance(change, Refuted) and clearly_refutes(problem, change.y):
        yield "presolve", ended(NoSolution(Certificate("farkas", farkas_statement(problem), change.y)))
    if not isinstance(change, Presolved) or not (problem.n <= factors.MOST_NUMPY_ROWS or change.is_worthwhile):
        yield from given
        return
    left = Structure(change.problem, change.start(x0))
    for name, stage in in_rounds(left):
        yield name, _clearly(problem, in_given_variables(change, stage))
    yield from given
    if change.kept.size <= MUCH_SMALLER * problem.n:
        milp = stages.changed(change, x0, partial(stages.begin, "milp"))
        yield "milp", _for_half_of_the_time(milp)


def may_gain_by_presolve(structure: Structure) -> bool:
    """Return whether many rows have at most one entry, or variables are fixed; or else M is not monotone as it is.
    Sparse convex programs gain nothing: they take as many steps as before."""
    problem, M = structure.problem, structure.problem.M
    if structure.program:
        return False
    lengths = np.diff(M.indptr) if is_sparse(M) else np.count_nonzero(M, axis=1)
    if np.count_nonzero(problem.box.fixed | (lengths <= 1)) >= MANY_SHORT_ROWS * problem.n:
        return True
    if structure.is_large_and_sparse:
        return not M.diagonal().all()
    return not structure.is_semidefinite


def _for_half_of_the_time(stage: Stage) -> Stage:
    """Pass on the stage, for at most half of the time that is left. No context stays open while it is suspended."""
    end = clock.seconds() + remaining() / 2
    while True:
        try:
            with within(end - clock.seconds()):
                step = advance(stage)
        except TimeIsUp:
            check()  # whether all of the time is up
            return OutOfTime(TIME_LIMIT_REACHED)
        if not isinstance(step, Iterate):
            return step
        yield step


def clearly_refutes(problem: Problem, y: Vector) -> bool:
    """Return whether y proves that a problem has no solution, and would for slightly different data."""
    return is_clear(problem, y) and proves_infeasible(problem, y)


def _clearly(problem: Problem, stage: Stage) -> Stage:
    """Pass on the stage; a proof that would not hold for slightly different data counts as none."""
    ending = yield from stage
    y = ending.certificate.vector if isinstance(ending, NoSolution) and ending.certificate.kind == "farkas" else None
    return ending if y is None or is_clear(problem, y) else Stalled("its proof hangs on rounding in the data")
