"""Verification of a proposed solution, or of what a formulation accepts instead, and of
a proof that there is none."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from functools import partial
from numbers import Rational
from typing import Any

import numpy as np

from lcpcli import options
from lcpcli.errors import IS_MISSING, LEAVE_ONE_OUT, LEAVE_OUT, ParameterError
from lcpcli.model.arrays import as_vector, by_names
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.model.problem import Problem, as_problem
from lcpcli.options import TOL
from lcpcli.rational.exact_problem import ExactProblem, fractions_of
from lcpcli.rational.numbers import rounded
from lcpcli.typing import Vector, VectorLike
from lcpcli.verify.certificate import Proof
from lcpcli.verify.verification import (
    Proposed,
    Verification,
    verify,
    verify_exactly,
    verify_farkas,
    verify_nonlinear,
)

# The largest tolerance that is proposed for an answer whose digits were rounded.
LARGEST_TOL = 1e-4


@np.errstate(all="ignore")
def check(
    problem: Problem | NonlinearProblem,
    z: VectorLike | None = None,
    *,
    y: VectorLike | None = None,
    tol: float | None = None,
) -> Verification:
    """Verify a proposed solution z of a problem, or a proof y that there is none,
    whatever its source: `lcp check`.

    Parameters
    ----------
    problem : a Problem, or a NonlinearProblem, for which z is verified in double
        precision only.
    z : shape (n,); accepted if its relative residual is at most tol. If one of its
        numbers is a fractions.Fraction and tol is not specified, z is verified in exact
        arithmetic, with the floating-point numbers of the problem taken as exact. For a
        problem made from a program, z may also be x, shape (k,), for which multipliers
        are sought, or x followed by the multipliers y of the rows, shape (k + m,). For
        a game, it may also be the probabilities of the row player's and then the column
        player's strategies: those of each player are nonnegative and add up to 1. For a
        game tree, it may also be the probabilities of all actions at the first player's
        information sets, in the order of the file, and then at the second player's.
    y : shape (n,), instead of z: a Farkas vector, y >= 0 with M'y <= 0 and q'y < 0,
        verified in exact arithmetic.
    tol : 1e-10 by default.

    Returns
    -------
    Verification : whether the answer is accepted and why, with the residuals, the
        violated conditions and the componentwise backward error; the interpreter shows
        it as the command prints it.

    Raises LCPError if z or y has the wrong length or is not finite, or both are passed,
    or tol is out of range.

    Examples
    --------
    >>> import lcpcli
    >>> problem = lcpcli.Problem([[2, 1], [1, 2]], [-5, -6])
    >>> lcpcli.check(problem, [4 / 3, 7 / 3]).accepted
    True
    >>> lcpcli.check(problem, [1, 2]).violated
    2
    >>> lcpcli.check(lcpcli.Problem([[-1]], [-2]), y=[1]).accepted
    True
    >>> sides = {"row_lower": 1, "row_upper": 1}
    >>> program = lcpcli.from_qp([[2, 0], [0, 2]], [-3, 1], [[1, 1]], **sides)
    >>> lcpcli.check(program, [1, 0]).statement
    'x is the unique minimizer, as Q is positive definite'
    >>> from fractions import Fraction
    >>> lcpcli.check(problem, [Fraction(4, 3), Fraction(7, 3)]).exact
    True
    """
    options.check((TOL,), {"tol": tol})
    if isinstance(problem, NonlinearProblem):
        if y is not None:
            raise ParameterError(
                "y", "proves nothing for a nonlinear problem", "give z"
            )
        (values,) = by_names(lambda: problem.names, z=z)
        return verify_nonlinear(
            problem, as_vector("z", values, problem.n), tol or TOL.value
        )
    n = as_problem(problem).n
    if z is None and y is None:
        raise ParameterError("z", IS_MISSING, "give z, or a proof y")
    if z is not None and y is not None:
        raise ParameterError("y", "cannot be combined with z", LEAVE_ONE_OUT)
    z, y = by_names(lambda: problem.names, z=z, y=y)
    if z is not None:
        exact = _fractions("z", z) if tol is None else []
        values = rounded(exact) if exact else as_vector("z", z)
        if values.size not in lengths(problem):
            as_vector("z", values, n)
        if exact:
            return verified_exactly(ExactProblem.of_problem(problem), exact)
        return verified(problem, values, tol or TOL.value)
    if tol is not None:
        raise ParameterError("tol", "has no effect on a proof", LEAVE_OUT)
    if exact := _fractions("y", y, n):
        return verified_proof(problem, exact)
    return verified_proof(problem, fractions_of(as_vector("y", y, n)), is_rounded=True)


def _fractions(field: str, values: Any, n: int | None = None) -> list[Fraction]:
    """Return the numbers of a list or an array as fractions, which may be beyond the
    range of double precision, if one of them is a Fraction; else an empty list. n : the
    number of entries that is required."""
    listed = values.tolist() if isinstance(values, np.ndarray) else values
    if not isinstance(listed, (list, tuple)) or not any(
        isinstance(value, Fraction) for value in listed
    ):
        return []
    is_exact = [isinstance(x, Rational) and not isinstance(x, bool) for x in listed]
    pairs = list(zip(listed, is_exact, strict=True))
    as_vector(field, [0 if exact else value for value, exact in pairs], n)
    # Integers of numpy are Rational, too, but their arithmetic overflows.
    return [
        Fraction(int(value.numerator), int(value.denominator))
        if exact
        else Fraction(float(value))
        for value, exact in pairs
    ]


def lengths(problem: Problem | NonlinearProblem) -> dict[int, str]:
    """Return what may be verified, by its length: z, or what the formulation accepts
    instead."""
    return problem.formulation.lengths(problem)


def verified(
    problem: Problem, values: Vector, tol: float, has_formulation_signs: bool = False
) -> Verification:
    """Verify proposed values. Their number tells whether they are z or the variables of
    the formulation (`lengths`).

    has_formulation_signs : whether multipliers are known to have the signs of the
        formulation; else they may also have those of z.
    """
    of_z = partial(verify, problem, tol=tol)
    return _of_origin(Proposed(problem, values, tol, None, of_z, has_formulation_signs))


def _of_origin(proposed: Proposed) -> Verification:
    verification: Verification = proposed.problem.formulation.verified(proposed)
    return verification


def accepting(
    problem: Problem,
    values: Vector,
    verification: Verification,
    has_formulation_signs: bool = False,
) -> float | None:
    """Return the smallest power of ten, at most LARGEST_TOL, with which rejected values
    would be accepted, as they may have been rounded; None if there is none, or if the
    values were accepted."""
    relative = verification.relative_residual
    if verification.accepted or relative is None:
        return None
    if math.isinf(relative):  # beyond a bound
        relative = _beyond_bounds(problem, values)
    if not relative <= LARGEST_TOL:
        return None
    powers = [10.0**k for k in range(-9, 0)]
    candidates = (tol for tol in powers if relative <= tol <= LARGEST_TOL)
    return next(
        (
            tol
            for tol in candidates
            if verified(problem, values, tol, has_formulation_signs).accepted
        ),
        None,
    )


def _beyond_bounds(problem: Problem, values: Vector) -> float:
    """Return how far the first of the unknowns, as many as there are values, are beyond
    their bounds, relative to the largest, in the column scaling of M."""
    C = problem.units.diagonals()[1]
    z = np.concatenate((values, np.zeros(problem.n)))[: problem.n]
    beyond = np.abs(z - problem.box.project(z))[: values.size] / C[: values.size]
    largest = np.abs(values / C[: values.size]).max()
    return float(beyond.max() / largest) if largest else math.inf


def verified_exactly(
    data: ExactProblem,
    values: list[Fraction],
    w: list[Fraction] | None = None,
    has_formulation_signs: bool = False,
) -> Verification:
    """Verify proposed values, as `verified` does, in rational arithmetic. w : a claimed
    M z + q for a z, to be verified too."""
    claimed_w = w if len(values) == data.n else None
    of_z = partial(verify_exactly, data, claimed_w=claimed_w)
    return _of_origin(
        Proposed(data.problem, values, 0.0, data, of_z, has_formulation_signs)
    )


def verified_proof(
    problem: Problem,
    y: list[Fraction],
    data: ExactProblem | None = None,
    is_rounded: bool = False,
) -> Verification:
    """Verify a proof y that there is no solution, and translate it to what the problem
    was made from.

    data : exact data for which the proof is to hold. is_rounded : whether y is known to
        be rounded.
    """
    verification = verify_farkas(problem, y, data, is_rounded)
    if problem.origin is None or not verification.accepted:
        return verification
    meaning = problem.formulation.meaning(data or ExactProblem.of_floats(problem))
    if meaning is None:
        return verification
    proof = None
    if not data or data.are_floats():
        claim = Proof("farkas", rounded(y), verification.message)
        is_known = verification.exact or claim.holds(problem)
        proof = replace(claim, is_rounded=not is_known)
    answer = meaning.without_solution(proof)
    if answer is None:
        return verification
    return replace(verification, message=f"proved: {answer.statement}", answer=answer)
