"""What a result on the conditions of a linear or quadratic program says about the
program: what x is, why there is no optimum, and how the optimum varies."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from lcpcli.formulations.quadratic_program.no_minimum import (
    OPTIMUM,
    SEVERAL,
    STATIONARY,
    UNIQUE,
    Conclusion,
    undecided,
    without_minimum,
)
from lcpcli.formulations.quadratic_program.other_minimum import has_other_minimum
from lcpcli.formulations.quadratic_program.program import Program
from lcpcli.formulations.quadratic_program.sensitivity import (
    Sensitivities,
    sensitivities,
)
from lcpcli.inspection.classes import definiteness
from lcpcli.inspection.verdict import NO, YES
from lcpcli.linalg.threads import with_limited_threads
from lcpcli.model.block_form import Blocks
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.rational.numbers import approximate
from lcpcli.solving.result import Result, Status

WORDS = {"min": "minimizer", "max": "maximizer"}
DEFINITE = {"min": "positive", "max": "negative"}


def data_of(problem: Problem, program: Program) -> Blocks:
    """Return the program, as a minimization, whose conditions the problem has."""
    data = program.blocks(conditions_of(problem))
    assert data is not None
    return data


@with_limited_threads
@np.errstate(all="ignore")
def conclusion(problem: Problem, result: Result, program: Program) -> Conclusion:
    """Return what a result on the conditions of a program says about the program. If
    Ctrl-C has ended the run, computations that take long are skipped. What holds for
    every solution of the problem is cached in the problem.
    """
    noun, data = WORDS[program.sense], data_of(problem, program)
    if result.status.has_no_solution:
        done = result.interrupted
        return (
            undecided(program)
            if done
            else without_minimum(problem, result.certificate, program, data)
        )
    if result.status is Status.ILL_POSED:
        return Conclusion(
            f"the program is ill-posed: whether it has a {noun} depends on the "
            "rounding of its data"
        )
    if not result.solved:
        relative = result.relative_residual
        size = (
            f"relative residual of {relative:.1e}"
            if relative < math.inf
            else f"residual of {result.residual:.1e}"
        )
        return Conclusion(
            f"x does not solve the program: it is the best iterate, with a {size}"
        )
    if result.interrupted:
        return Conclusion(
            f"x satisfies the first-order conditions; whether it is a {noun} "
            "was not examined"
        )
    kind = kind_of_solutions(problem, program, data)
    is_exact = kind.within is None
    if kind.proved == OPTIMUM and has_other_minimum(
        problem, program, data, result.z, result.tol, is_exact
    ):
        several = kind.statement.replace(f"a {noun}", f"one of several {noun}s")
        proved = SEVERAL if is_exact else OPTIMUM
        return Conclusion(several, proved, within=kind.within)
    return kind


@with_limited_threads
def variations(
    problem: Problem, result: Result, program: Program
) -> Sensitivities | None:
    """Return the derivatives of the optimal objective of a convex program with respect
    to its bounds; None if they are not known, or Ctrl-C has ended the run.
    """
    if not result.solved or result.interrupted:
        return None
    data = data_of(problem, program)
    kind = kind_of_solutions(problem, program, data)
    if kind.proved not in (UNIQUE, OPTIMUM):
        return None
    return sensitivities(problem, program, data, result.z, result.tol)


def kind_of_solutions(problem: Problem, program: Program, data: Blocks) -> Conclusion:
    """Return what every solution of the conditions of a program is, which is cached in
    the problem.
    """
    if problem.facts.kind is None:
        problem.facts.kind = kind_of_point(data, program)
    kind: Conclusion = problem.facts.kind
    return kind


def kind_of_point(data: Blocks, program: Program) -> Conclusion:
    """Return what a solution of the first-order conditions is, from what is known about
    Q: whether it is definite, semidefinite, or neither.

    This may hold up to rounding: if Q + d diag(Q) is semidefinite, x minimizes the
    program with this matrix instead of Q, as its conditions are violated by at most d
    times the sum of the absolute values of their terms.
    """
    noun, definite = WORDS[program.sense], DEFINITE[program.sense]
    if not (data.Q != 0).sum():
        return Conclusion(f"x is a {noun} of the linear program", OPTIMUM)
    definiteness_of_Q = definiteness(data.Q)
    if definiteness_of_Q.definite == YES:
        return Conclusion(
            f"x is the unique {noun}, as Q is {definite} definite", UNIQUE
        )
    if definiteness_of_Q.semidefinite == YES:
        return Conclusion(f"x is a {noun}, as Q is {definite} semidefinite", OPTIMUM)
    if definiteness_of_Q.semidefinite == NO:
        return Conclusion(
            f"x is a stationary point and need not be a {noun}: Q is not "
            f"{definite} semidefinite",
            STATIONARY,
        )
    if definiteness_of_Q.within is not None:
        change = approximate(Fraction(definiteness_of_Q.within), 1, 1)
        statement = (
            f"x is a {noun} up to rounding: Q differs by at most {change}, relatively, "
            f"from a {definite} semidefinite matrix"
        )
        return Conclusion(statement, OPTIMUM, within=definiteness_of_Q.within)
    open_question = (
        f"whether Q is {definite} semidefinite and x a {noun} is not decided"
    )
    return Conclusion(f"x satisfies the first-order conditions; {open_question}")
