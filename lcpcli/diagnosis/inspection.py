"""Diagnosis of a problem: the classes of M with evidence, its difficulty, and which methods are guaranteed."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from lcpcli import clock
from lcpcli.classes import classify
from lcpcli.classes.verdict import YES, Late, Verdict
from lcpcli.diagnosis import matrix, rates, remarks
from lcpcli.diagnosis.factorization import Factorization, factorization
from lcpcli.diagnosis.guarantees import Guarantee, guarantees
from lcpcli.linalg.band import affordable
from lcpcli.model import far_bounds
from lcpcli.model.problem import Problem, as_problem
from lcpcli.options import INSPECTION_SECONDS


@dataclass(frozen=True, eq=False)
class Inspection:
    """The diagnosis of one problem. None for quantities that are too expensive to compute.

    condition, equilibrated_condition : in the 1-norm, of M and of R M C; infinite if singular, estimated for large n.
    spread, equilibrated_spread : of M and of R M C. spectrum : of a symmetric M.
    factorization : the one that `interior` repeats; None for dense M.
    published, best : of `fixed-point`, with omega = 1 and with `--omega auto`.
    obvious : the answer, if it is evident from M and q; else "".
    """

    problem: Problem
    nonzeros: int
    classes: dict[str, Verdict]
    spread: matrix.Spread
    equilibrated_spread: matrix.Spread
    condition: float | None
    equilibrated_condition: float | None
    spectrum: matrix.Spectrum | None
    cost: matrix.Cost
    factorization: Factorization | None
    published: rates.Rate | None
    best: rates.Rate | None
    smoothing: rates.Smoothing
    guarantees: dict[str, Guarantee]
    obvious: str
    hints: list[str]

    def __repr__(self) -> str:
        from lcpcli.report.inspection import as_text

        return as_text(self).rstrip()


@np.errstate(over="ignore", invalid="ignore", divide="ignore")
def inspect(problem: Problem, time_limit: float = INSPECTION_SECONDS) -> Inspection:
    """Classify and diagnose a problem, as `lcp inspect`: the classes of M, its scaling, which methods are guaranteed.

    Parameters
    ----------
    problem : a Problem; a sparse M is made dense only if it is small.
    time_limit : seconds after which no further expensive computation is started; one in progress is not interrupted.
        The factorization of a sparse M may take as long besides, and is then stopped.

    Returns an Inspection, which the interpreter shows as the command prints it. A class is "yes" or "no" only where
    rounding errors cannot affect the answer.

    >>> import lcpcli
    >>> found = lcpcli.inspect(lcpcli.Problem([[2, 1], [1, 2]], [-5, -6]))
    >>> found.classes["p_matrix"].word, found.guarantees["lemke"].word
    ('yes', 'yes')
    """
    as_problem(problem)
    deadline = clock.seconds() + time_limit

    def check() -> None:
        if clock.seconds() > deadline:
            raise Late

    found = classify.classify(problem.M, time_limit)
    definite = found["symmetric"].word == found["positive_definite"].word == YES
    before, after, scaled = matrix.spreads(problem)
    condition = equilibrated = spectrum = published = best = None
    with suppress(Late):
        if affordable(problem.M):
            check()
            condition = matrix.condition(problem.M)
            check()
            equilibrated = matrix.condition(scaled)
        if found["symmetric"].word == YES:
            check()
            spectrum = matrix.eigenvalues(problem.M, definite)
        check()
        published, best = rates.rates(problem.M, spectrum if definite else None)
    hints = [far] if (far := far_bounds.remark(problem)) else []
    with suppress(Late):
        hints += remarks.hints(problem, found, (before, after), equilibrated, spectrum, check)
    return Inspection(
        problem=problem,
        nonzeros=matrix.nonzeros(problem.M),
        classes=found,
        spread=before,
        equilibrated_spread=after,
        condition=condition,
        equilibrated_condition=equilibrated,
        spectrum=spectrum,
        cost=matrix.cost(problem.M, definite),
        factorization=factorization(problem, time_limit),
        published=published,
        best=best,
        smoothing=rates.smoothing(problem),
        guarantees=guarantees(found, problem),
        obvious=remarks.obvious(problem, found),
        hints=hints,
    )
