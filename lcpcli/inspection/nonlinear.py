"""Diagnosis of a nonlinear problem: its rows and operators, F and its Jacobian J at the start, and what its pattern
makes singular.

The pattern is taken from J at the start and at SAMPLES points nearby, at random from fixed seeds: an entry of J that is
0 at all of them counts as 0 everywhere, and a row that is the same at all of them as that of a linear function.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from lcpcli.clock import imports
from lcpcli.inspection import theory
from lcpcli.inspection.verdict import Verdict, classify
from lcpcli.interrupts import TimeIsUp, within
from lcpcli.linalg.doubles import generator, size
from lcpcli.linalg.patterns import affordable
from lcpcli.model import views
from lcpcli.model.evaluations import Evaluations
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.options import INSPECTION_SECONDS
from lcpcli.typing import Matrix, Vector

SAMPLES = 2  # points beside the start
NEARER = 0.5**3  # by which another point is moved towards the start where J is not finite, MOST_MOVES times
MOST_MOVES = 10
LAST_CLASS = "positive_semidefinite"  # of those that are decided: all that are cheap
MOST_NAMED = 5  # rows or unknowns in a hint


@dataclass(frozen=True, eq=False)
class NonlinearInspection:
    """The diagnosis of a nonlinear problem. What is unknown, or too expensive, is None.

    operators, common_expressions, fixed_variables : of a model, how often each operator occurs, and how many common
        expressions and fixed variables, which are no unknowns, it has; None for other problems.
    equations : the number of unknowns without bounds, whose rows are equations.
    nonlinear_rows : the number of rows of J that vary. nonzeros : the number of entries of J that are not 0 everywhere.
    structural_rank : of J: the largest rank that a matrix of its pattern can have; _of_equations : of the rows of the
        equations; _of_free : of the columns of the unknowns without bounds.
    undefined_rows : those in which F is not finite at the start. residual : the natural residual there.
    condition, spread, classes : of J at the start; classes is empty where J is not finite.
    """

    problem: NonlinearProblem
    operators: Mapping[str, int] | None
    common_expressions: int | None
    fixed_variables: int | None
    equations: int
    nonlinear_rows: int
    nonzeros: int
    structural_rank: int
    structural_rank_of_equations: int
    structural_rank_of_free: int
    undefined_rows: Sequence[int]
    residual: float | None
    condition: float | None
    spread: theory.Spread | None
    classes: Mapping[str, Verdict]
    hints: list[str]

    def __repr__(self) -> str:
        return str(views.inspection_text.report(self).render()).rstrip()


@np.errstate(all="ignore")
def inspect_nonlinear(
    problem: NonlinearProblem,
    operators: Mapping[str, int] | None = None,
    common: int | None = None,
    fixed: int | None = None,
    time_limit: float = INSPECTION_SECONDS,
) -> NonlinearInspection:
    """Diagnose a nonlinear problem.

    operators, common, fixed : of the model from which it is made, if it is. time_limit : seconds, after which expensive
    computations end, and what they would have found is unknown.
    """
    evaluations, F = Evaluations(problem), problem.values(problem.x0)
    samples = list(_samples(evaluations))
    pattern, varying = _pattern(problem.n, samples)
    free = np.isneginf(problem.lower) & np.isposinf(problem.upper)
    J, undefined = evaluations.finite_jacobian(problem.x0), (~np.isfinite(F)).nonzero()[0].tolist()
    condition, classes = None, dict[str, Verdict]()
    with suppress(TimeIsUp), within(time_limit):
        if J is not None and problem.n and affordable(J):
            condition = theory.condition(J)
        if J is not None:
            classes = classify(J, LAST_CLASS)
    found = NonlinearInspection(
        problem=problem,
        operators=operators,
        common_expressions=common,
        fixed_variables=fixed,
        equations=int(free.sum()),
        nonlinear_rows=int(varying.sum()),
        nonzeros=int(pattern.nnz),
        structural_rank=_rank(pattern),
        structural_rank_of_equations=_rank(pattern[free]),
        structural_rank_of_free=_rank(pattern[:, free]),
        undefined_rows=undefined,
        residual=None if undefined else size(problem.box.gaps(problem.x0, F)),
        condition=condition,
        spread=None if J is None else theory.spread(J),
        classes=classes,
        hints=[],
    )
    found.hints.extend(_hints(found, J is None))
    return found


def _samples(evaluations: Evaluations) -> Iterator[Matrix]:
    """Yield J at the start, and at points nearby where it is finite."""
    problem = evaluations.problem
    yield evaluations.jacobian(problem.x0)
    for seed in range(SAMPLES):
        move = generator(seed).uniform(-1.0, 1.0, problem.n) * np.maximum(1.0, np.abs(problem.x0))
        for _ in range(MOST_MOVES):
            J = evaluations.finite_jacobian(problem.box.project(problem.x0 + move))
            if J is not None:
                yield J
                break
            move *= NEARER


def _pattern(n: int, samples: Sequence[Matrix]) -> tuple[Matrix, Vector]:
    """Return the places where one of the samples is not 0 as a csr array, and which rows differ between samples."""
    with imports:
        from scipy.sparse import csr_array
    whole = list(map(csr_array, samples))
    pattern, varying = csr_array((n, n)), np.zeros(n, dtype=bool)
    for J in whole if n else ():
        pattern = pattern + (J != 0).astype(float)  # also where it is not finite
        varying |= abs(J - whole[0]).max(axis=1).toarray().ravel() != 0
    return pattern, varying


def _rank(pattern: Matrix) -> int:
    with imports:
        from scipy.sparse.csgraph import structural_rank
    return int(structural_rank(pattern.tocsr())) if min(pattern.shape) else 0


def _hints(found: NonlinearInspection, is_undefined: bool) -> Iterator[str]:
    """Yield hints at likely mistakes, each with evidence and advice."""
    problem, spread = found.problem, found.spread
    if found.undefined_rows:
        yield f"F is not finite at the start in {_named(problem, found.undefined_rows)}: start inside its domain"
    elif is_undefined:
        yield "J is not finite at the start: start inside the domain of F"
    k, of_rows, of_free = found.equations, found.structural_rank_of_equations, found.structural_rank_of_free
    if of_rows < k:
        few = f"the {k} equations can be solved for at most {of_rows} unknowns, whatever the values"
        yield f"{few}: some are redundant, or contradict each other"
    if of_free < k:
        yield f"at most {of_free} of the {k} unknowns without bounds are determined by the rows in which they occur"
    if spread is not None and (decades := max(spread.rows, spread.columns)) > theory.BAD_SPREAD:
        yield f"badly scaled: the largest entries of rows or columns of J at the start vary by {decades:.1f} decades"
    is_singular = found.condition is not None and found.condition > theory.BAD_CONDITION
    if is_singular and found.structural_rank == problem.n:
        yield "J is singular at the start, or nearly: another start may be better"


def _named(problem: NonlinearProblem, rows: Sequence[int]) -> str:
    named = ", ".join(f"{i + 1} {problem.names[i]}".rstrip() for i in rows[:MOST_NAMED])
    return f"row{'s' * (len(rows) > 1)} {named}" + f" and {len(rows) - MOST_NAMED} more" * (len(rows) > MOST_NAMED)
