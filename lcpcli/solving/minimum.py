"""What results mean for the linear or quadratic program that their problem comes from.

A program without a minimum is infeasible or unbounded: M. Frank, P. Wolfe, An algorithm for quadratic programming,
Naval Res. Logist. Quart. 3 (1956) 95-110.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from lcpcli.classes.classify import classify
from lcpcli.classes.verdict import NO, YES
from lcpcli.linalg.linear_program import minimized
from lcpcli.linalg.matrices import compressed
from lcpcli.linalg.products import product
from lcpcli.linalg.semidefinite import is_semidefinite
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.model.reductions.program import SENSES, Program, ProgramData
from lcpcli.solving.answer import OPTIMUM, SEVERAL, STATIONARY, UNIQUE, Minimum
from lcpcli.solving.other_minimum import has_other_minimum
from lcpcli.solving.result import Result, Status
from lcpcli.typing import Matrix, Vector
from lcpcli.verify.certificate import farkas, proof

SECONDS = 1.0  # for deciding whether Q is positive semidefinite
LARGEST = 2000  # variables up to which that is looked at in floats, if it is not decided
SIMPLE = 10**6  # the largest denominator of a feasible point that is verified exactly
MOST_FRACTIONS = 10_000  # entries of A for which that is done
WORDS = {"min": ("minimizer", "minimum", "below"), "max": ("maximizer", "maximum", "above")}
DEFINITE = {"min": "positive", "max": "negative"}


def minima(results: Sequence[Result], program: Program) -> list[Minimum]:
    """What each of the results on one problem means for the program: x, y and the objective if it is solved."""
    problem = results[0].problem
    data = program.program(conditions_of(problem))
    assert data is not None
    solved = _kind_of_point(data, program) if any(result.solved for result in results) else None
    return [
        _minimum(result, program, data, solved) if solved and result.solved else _without_minimum(result, program, data)
        for result in results
    ]


class _Kind(NamedTuple):
    """What a solution of the first-order conditions is: `proved` as in `Minimum`, and the sentence."""

    proved: str | None
    statement: str


def _minimum(result: Result, program: Program, data: ProgramData, kind: _Kind) -> Minimum:
    sign = SENSES[program.sense]
    x, y = program.parts(result.z)
    w = program.parts(result.w)[0]
    held = np.where(w > 0, x - data.lower <= w, data.upper - x <= -w)  # else w is rounding of 0
    bounded = sign * np.where(held, w, 0.0) + 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        objective = sign * float(x @ product(data.Q, x) / 2 + data.c @ x) + program.constant
    exact = None
    if result.exact is not None and result.exact.z is not None:
        parts = program.parts(result.exact.z)
        exact = {"x": list(parts[0]), "y": [int(sign) * value for value in parts[1]]}
    if kind.proved == OPTIMUM and has_other_minimum(result, data):
        word = WORDS[program.sense][0]
        kind = _Kind(SEVERAL, kind.statement.replace(f"a {word}", f"one of several {word}s"))
    return Minimum(x, sign * y + 0.0, bounded, objective, kind.statement, kind.proved, exact)


def _kind_of_point(data: ProgramData, program: Program) -> _Kind:
    """What a solution of the first-order conditions is, from what is proved about Q."""
    word, definite = WORDS[program.sense][0], DEFINITE[program.sense]
    if _is_zero(data.Q):
        return _Kind(OPTIMUM, f"x is a {word} of the linear program")
    verdicts = classify(data.Q, SECONDS, last="positive_semidefinite")
    if verdicts["positive_definite"].word == YES:
        return _Kind(UNIQUE, f"x is the unique {word}, as Q is {definite} definite")
    verdict = verdicts["positive_semidefinite"].word
    if verdict == YES:
        return _Kind(OPTIMUM, f"x is a {word}, as Q is {definite} semidefinite")
    if verdict == NO:
        return _Kind(STATIONARY, f"x is a stationary point and need not be a {word}: Q is not {definite} semidefinite")
    if data.c.size <= LARGEST and is_semidefinite(data.Q):
        up_to = f"as far as Q is {definite} semidefinite, which it is up to rounding"
        return _Kind(OPTIMUM, f"x is a {word}, {up_to}")
    undecided = f"whether Q is {definite} semidefinite and x a {word} is not decided"
    return _Kind(None, f"x satisfies the first-order conditions; {undecided}")


def _without_minimum(result: Result, program: Program, data: ProgramData) -> Minimum:
    """Which constraints exclude each other, or in which direction the objective improves for ever."""
    problem, k = result.problem, program.variables
    _, best, side = WORDS[program.sense]
    if result.status not in (Status.INFEASIBLE, Status.UNSOLVABLE):
        return Minimum(None, None, None, None, "not solved, so there is no x")
    of_x, of_rows = _halves(result, k)
    rows = proof(problem, of_rows)
    if rows is None:
        rows = _excluding_rows(problem, data)
    if rows is not None:
        told = "the program is infeasible: no x satisfies its constraints"
        return Minimum(None, None, None, None, told, certificate=program.parts(rows)[1])
    found = proof(problem, of_x)
    ray = None if found is None else found[:k]
    unbounded = f"the program is unbounded {side}"
    if _is_feasible_at_0(data):
        return Minimum(None, None, None, None, unbounded, ray=ray)
    point = _feasible_point(data)
    if point is not None:
        qualified = "" if _is_feasible(point, data) else ": an LP finds its constraints feasible, to its tolerance"
        return Minimum(None, None, None, None, unbounded + qualified, ray=ray)
    told = f"the program has no {best}: it is infeasible or unbounded {side}"
    return Minimum(None, None, None, None, told, ray=ray)


def _halves(result: Result, k: int) -> tuple[Vector, Vector]:
    """The y of Farkas that the result has, for the k variables alone and for the rows alone; zeros if it has none."""
    certificate, of_x, of_rows = result.certificate, np.zeros(result.problem.n), np.zeros(result.problem.n)
    if certificate is not None and certificate.vector is not None:
        of_x[:k], of_rows[k:] = certificate.vector[:k], certificate.vector[k:]
    return of_x, of_rows


def _excluding_rows(problem: Problem, data: ProgramData) -> Vector | None:
    """Farkas' y of the program without its objective, which then consists of multipliers of its rows."""
    zero = data.Q * 0.0
    if not isinstance(zero, np.ndarray):
        zero.eliminate_zeros()
    M, q, lower, upper = data._replace(Q=zero, c=np.zeros(data.c.size)).conditions()
    found = farkas(Problem(M, q, lower=lower, upper=upper), SECONDS) if data.row_lower.size else None
    if found is None:
        return None
    found[: data.c.size] = 0.0
    return proof(problem, found)


def _is_feasible_at_0(data: ProgramData) -> bool:
    ends = ((data.lower, data.upper), (data.row_lower, data.row_upper))
    return all(bool((low <= 0).all() and (high >= 0).all()) for low, high in ends)


def _feasible_point(data: ProgramData) -> Vector | None:
    """A point within rows and bounds to the tolerance of an LP solver, if it finds one."""
    ends, bounds = (data.row_lower, data.row_upper), (data.lower, data.upper)
    found = minimized(np.zeros(data.c.size), data.A, ends, bounds, SECONDS)
    return None if found is None else found.x


def _is_feasible(x: Vector, data: ProgramData) -> bool:
    """Whether x, rounded to simple fractions, is within rows and bounds without any tolerance."""
    A = compressed(data.A).tocoo()
    if A.nnz > MOST_FRACTIONS:
        return False
    point = [Fraction(value).limit_denominator(SIMPLE) for value in x.tolist()]
    Ax = [Fraction(0)] * data.row_lower.size
    for i, j, value in zip(A.row.tolist(), A.col.tolist(), A.data.tolist(), strict=True):
        Ax[i] += Fraction(value) * point[j]
    ends = ((point, data.lower, data.upper), (Ax, data.row_lower, data.row_upper))
    return all(
        low <= value <= high
        for values, lower, upper in ends
        for value, low, high in zip(values, lower.tolist(), upper.tolist(), strict=True)
    )


def _is_zero(Q: Matrix) -> bool:
    return not (Q != 0).sum()
