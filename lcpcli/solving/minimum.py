"""What results mean for the linear or quadratic program that their problem comes from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from lcpcli.classes.classify import classify
from lcpcli.classes.verdict import NO, YES
from lcpcli.linalg.krylov import is_semidefinite
from lcpcli.model.problem import conditions_of
from lcpcli.model.reductions.program import SENSES, Program, ProgramData
from lcpcli.solving.answer import OPTIMUM, SEVERAL, STATIONARY, UNIQUE, Minimum
from lcpcli.solving.no_minimum import without_minimum
from lcpcli.solving.other_minimum import has_other_minimum
from lcpcli.solving.result import Result, Status
from lcpcli.typing import Matrix
from lcpcli.verify.multipliers import objective

SECONDS = 1.0  # for deciding whether Q is positive semidefinite
LARGEST = 2000  # variables up to which that is looked at in floats, if it is not decided
WORDS = {"min": "minimizer", "max": "maximizer"}
DEFINITE = {"min": "positive", "max": "negative"}


def minima(results: Sequence[Result], program: Program) -> list[Minimum]:
    """What each of the results on one problem means for the program: x, y and the objective, of the best iterate if it
    is not solved, unless it is proved that there is no solution."""
    problem = results[0].problem
    data = program.program(conditions_of(problem))
    assert data is not None
    solved = kind_of_point(data, program) if any(result.solved for result in results) else None
    return [
        without_minimum(problem, result.certificate.vector if result.certificate else None, program, data)
        if result.status in (Status.INFEASIBLE, Status.UNSOLVABLE)
        else _minimum(result, program, data, solved if solved and result.solved else _unsolved(result))
        for result in results
    ]


class Kind(NamedTuple):
    """What a solution of the first-order conditions, or another x, is: `proved` as in `Minimum`, and the sentence."""

    proved: str | None
    statement: str


def _unsolved(result: Result) -> Kind:
    size = f"{result.relative_residual:.1e}"
    return Kind(None, f"x does not solve the program: it is the best iterate, with a relative residual of {size}")


def _minimum(result: Result, program: Program, data: ProgramData, kind: Kind) -> Minimum:
    sign = SENSES[program.sense]
    x, y = program.parts(result.z)
    w = program.parts(result.w)[0]
    held = np.where(w > 0, x - data.lower <= w, data.upper - x <= -w)  # else w is rounding of 0
    bounded = sign * np.where(held, w, 0.0) + 0.0
    value = sign * objective(data, x) + program.constant
    exact = None
    if result.exact is not None and result.exact.z is not None:
        parts = program.parts(result.exact.z)
        exact = {"x": list(parts[0]), "y": [int(sign) * value for value in parts[1]]}
    if kind.proved == OPTIMUM and has_other_minimum(result, data):
        word = WORDS[program.sense]
        kind = Kind(SEVERAL, kind.statement.replace(f"a {word}", f"one of several {word}s"))
    return Minimum(x, sign * y + 0.0, bounded, value, kind.statement, kind.proved, exact)


def kind_of_point(data: ProgramData, program: Program) -> Kind:
    """What a solution of the first-order conditions is, from what is proved about Q."""
    word, definite = WORDS[program.sense], DEFINITE[program.sense]
    if _is_zero(data.Q):
        return Kind(OPTIMUM, f"x is a {word} of the linear program")
    verdicts = classify(data.Q, SECONDS, last="positive_semidefinite")
    if verdicts["positive_definite"].word == YES:
        return Kind(UNIQUE, f"x is the unique {word}, as Q is {definite} definite")
    verdict = verdicts["positive_semidefinite"].word
    if verdict == YES:
        return Kind(OPTIMUM, f"x is a {word}, as Q is {definite} semidefinite")
    if verdict == NO:
        return Kind(STATIONARY, f"x is a stationary point and need not be a {word}: Q is not {definite} semidefinite")
    if data.c.size <= LARGEST and is_semidefinite(data.Q):
        up_to = f"as far as Q is {definite} semidefinite, which it is up to rounding"
        return Kind(OPTIMUM, f"x is a {word}, {up_to}")
    undecided = f"whether Q is {definite} semidefinite and x a {word} is not decided"
    return Kind(None, f"x satisfies the first-order conditions; {undecided}")


def _is_zero(Q: Matrix) -> bool:
    return not (Q != 0).sum()
