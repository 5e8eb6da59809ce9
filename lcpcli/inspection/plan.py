"""The plan of `auto` for a problem: its attempts until one solves the problem or proves that there is no solution."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from lcpcli.methods.auto_table import BRIEF, FIRST, LATER, Row
from lcpcli.methods.presolved_stages import may_gain_by_presolve
from lcpcli.methods.structure import Structure
from lcpcli.model.changes import composed, shifted
from lcpcli.model.far_bounds import relaxed
from lcpcli.model.problem import Problem, as_problem
from lcpcli.verify.measure import FEW_UNKNOWNS


class Attempt(NamedTuple):
    """An attempt of `auto`.

    method, part : the method, as in the route of a result, and which part of it is tried; "" if it is tried as a whole.
    iterations : the number in its first turn. Once these are used up, the later attempts have their turns before it
    continues with twice as many; None if it is never suspended. reason : why the attempt is made.
    """

    method: str
    part: str
    iterations: int | None
    reason: str


PRESOLVE = Attempt("presolve", "", None, "rows with one entry may decide variables: what is left is tried first")
EXACT = Attempt("exact", "", None, f"there are at most {FEW_UNKNOWNS} unknowns, whose states can be searched")
MILP = Attempt("milp", "", None, "it needs no property of M")


@np.errstate(all="ignore")
def plan(problem: Problem) -> list[Attempt]:
    """Return the attempts of `auto` on a problem, in the order in which they begin; most problems need only the first.

    The plan depends only on facts that cost at most one factorization of M: the same problem has the same plan
    everywhere.

    >>> import lcpcli
    >>> [attempt.method for attempt in lcpcli.plan(lcpcli.Problem([[2, 1], [1, 2]], [-5, -6]))][:3]
    ['newton', 'newton', 'lemke']
    """
    problem = composed(as_problem(problem), relaxed, shifted).problem  # as auto searches
    structure = Structure(problem, problem.q)
    first, brief, others = (_attempts(structure, rows) for rows in (FIRST, BRIEF, LATER))
    presolve = [PRESOLVE] if problem.is_mixed and may_gain_by_presolve(structure) else []
    if structure.is_large_and_sparse:
        return [*presolve, *first, *others, MILP]
    if problem.n <= FEW_UNKNOWNS:
        return [*first, *brief, EXACT, *presolve, *(attempt for attempt in others if attempt not in brief), MILP]
    return [*first, *presolve, *others, MILP]


def _attempts(structure: Structure, rows: tuple[Row, ...]) -> list[Attempt]:
    applying = [row for row in rows if row.applies(structure)]
    return [_attempt(row, structure) for row in sorted(applying, key=lambda row: row.first_round)]


def _attempt(row: Row, structure: Structure) -> Attempt:
    share = row.share(structure)
    return Attempt(row.method, row.part, None if share == math.inf else int(share), row.reason)
