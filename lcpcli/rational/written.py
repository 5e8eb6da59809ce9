"""The numbers for which a claim about a problem has to hold: those that somebody wrote.

Double precision numbers are what methods compute with, not always what was meant: the
rows (-0.3, 0.3) and (-0.2, 0.2) are multiples of each other as written, while their
nearest doubles are not. So a claim such as "there is no solution" may hold for these
and be false of the problem.

- For a problem that was read from a text, a claim holds for the decimals of the text.
  Decimals of up to 15 digits are the shortest ones of their doubles.
- For a problem made from arrays, nobody knows what was meant: a claim holds for the
  doubles as well as for their shortest decimals.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from lcpcli.linalg.matrices import compressed, is_sparse, scaled
from lcpcli.model.problem import Problem
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import (
    LARGEST_INTEGER,
    LARGEST_POWER,
    are_rounded,
    shortest_decimal,
)
from lcpcli.typing import Indices, Matrix, Vector

# Multiples m / 1024 of an integer m up to this have at most 10 decimals and 17 digits,
# so that their shortest decimal is the number itself.
LARGEST_EXACT_MULTIPLE = 1e10
UNIT = 1024.0


def as_written(problem: Problem) -> ExactProblem:
    """Return the problem with the numbers of its text or, for arrays, with the shortest
    decimals of what it was made from."""
    if problem.written is None or problem.written.are_short():
        return ExactProblem.of_decimals(problem)
    data: ExactProblem = problem.exact_numbers
    return data


def exact_data(problem: Problem) -> ExactProblem:
    """Return the problem with the numbers by which exact arithmetic looks for
    solutions: those as written, or the doubles where these are computed, as in a
    method's own variables."""
    if problem.written is None and problem.formulation.exact_conditions() is None:
        is_computed = are_computed(problem)
        return ExactProblem.of_floats(problem) if is_computed else as_written(problem)
    return as_written(problem)


def readings(problem: Problem) -> Iterator[ExactProblem]:
    """Yield the exact problems for which a claim about a problem has to hold: one for a
    text, or if the doubles are their shortest decimals; otherwise two."""
    if problem.written is not None:
        yield as_written(problem)
        return
    doubles = ExactProblem.of_floats(problem)
    yield doubles
    if not are_same(problem):
        yield as_written(problem)


def are_same(problem: Problem) -> bool:
    """Return whether the numbers as written are the doubles of the problem, so that
    what holds for these needs no second look."""
    if problem.written is not None and not problem.written.are_short():
        return as_written(problem).are_floats()
    if problem.formulation.exact_conditions() is not None:
        return ExactProblem.of_decimals(problem).are_floats()
    bounds = (bound[np.isfinite(bound)] for bound in problem.bounds.values())
    M = problem.M.data if is_sparse(problem.M) else problem.M.ravel()
    return all(map(are_decimals, (problem.q, M, *bounds)))


def are_computed(problem: Problem) -> bool:
    """Return whether a problem has numbers of so many digits that nobody wrote
    them."""
    M = problem.M.data if is_sparse(problem.M) else problem.M
    return bool(are_rounded(M).any() or are_rounded(problem.q).any())


def are_decimals(values: Vector) -> bool:
    """Return whether finite floats are equal to their shortest decimals."""
    multiples = values * UNIT
    is_short = (multiples == np.rint(multiples)) & (
        np.abs(multiples) <= LARGEST_EXACT_MULTIPLE
    )
    is_integer = (values == np.rint(values)) & (np.abs(values) <= LARGEST_INTEGER)
    others = values[~(is_short | is_integer)]
    return all(shortest_decimal(value) == Fraction(value) for value in others.tolist())


@np.errstate(all="ignore")
def in_integers(problem: Problem, rows: Indices) -> tuple[Matrix, Vector] | None:
    """Return M and q with some rows multiplied by the power of ten that makes all their
    decimals integers, and zeros in the other rows; None if some are no decimals of at
    most 15 digits, or too long for doubles to hold such integers exactly."""
    if problem.written is not None and not problem.written.are_short():
        return None
    if problem.formulation.exact_conditions() is not None:
        return None
    part = problem.M[rows]
    values = np.append(part.data if is_sparse(part) else part.ravel(), problem.q[rows])
    if are_rounded(values).any():
        return None
    for power in range(LARGEST_POWER + 1):
        unit = 10.0**power
        whole = np.rint(values * unit)
        if np.abs(whole).max(initial=0.0) > LARGEST_INTEGER:
            return None
        if np.array_equal(whole / unit, values):
            break
    else:
        return None
    factors, q = np.zeros(problem.n), np.zeros(problem.n)
    factors[rows] = unit
    q[rows] = whole[whole.size - rows.size :]
    M = scaled(problem.M, factors, np.ones(problem.n))
    if is_sparse(M):
        M = compressed(M)
        M.data = np.rint(M.data)
        return M, q
    return np.rint(M), q
