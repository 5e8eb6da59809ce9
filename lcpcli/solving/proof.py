"""How a result in floating point becomes one that is proved for the exact data.

The result of the run is only a guess. The system of its active set is solved and
checked in rational arithmetic; its Farkas vector is turned into a rational one that is
a proof for the exact data, and a proof by exhaustion is accepted if it was made for
exactly these data. If the data are decimals, whose rounding may have misled the run,
the rows are multiplied by their denominators and the method is run again on integers,
which double precision represents exactly.

If the question is still open, rational arithmetic searches for the answer: by Lemke's
method, which is fast where it applies, and by a tree search over the complementary
bases, which returns a solution or a proof that there is none.

In the same way the reference is computed by which errors are measured, if no solution
is known.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction

import numpy as np

from lcpcli.auto.attempts import Structure
from lcpcli.interrupts import TimeIsUp, deadline_after, raise_if_timed_out, remaining
from lcpcli.methods.z_matrix import EXACT_EFFORT, decided
from lcpcli.model.problem import WITHOUT_SOLUTION, Problem, as_problem
from lcpcli.options import DEFAULTS, Limits
from lcpcli.rational import pivoting
from lcpcli.rational.elimination import Effort, require
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import rounded, zeros
from lcpcli.rational.tree import first_solution
from lcpcli.solving import driver as driver
from lcpcli.solving.call import RAISE, chosen, unless_interrupted
from lcpcli.solving.result import Exact, Result, Status
from lcpcli.typing import Interrupts, Vector
from lcpcli.verify.certificate import Proof
from lcpcli.verify.exact_solution import (
    accurate_basic_solution,
    finitely_rounded,
    from_point,
)
from lcpcli.verify.farkas import exact_proof, farkas_vector, simplified
from lcpcli.verify.point import Criterion, Point

UNSOLVABLE = (
    "every complementary set is excluded by inequalities that were checked in "
    "rational arithmetic"
)
BEYOND_DOUBLES = (
    "the exact z is beyond the range of doubles, so that the other z is that of the "
    "last run"
)
UNPROVED = "no exact proof is known for the numbers as written"
EXCLUDED = Exact(Status.UNSOLVABLE, UNSOLVABLE)
# Work limit of a search without a time limit, in nominal seconds: up to 20 unknowns a
# second is enough, beyond 30 a minute may not be.
EXACT_SEARCH_EFFORT = 60.0
REFERENCE_SECONDS = 10.0  # for the search for a reference
MAX_EXACT_UNKNOWNS = 200  # up to which an exact solution takes a second
# Positive components of z up to which they are computed exactly, in a second.
MAX_EXACT_POSITIVE = 64


@np.errstate(all="ignore")
def exact(
    problem: Problem, time_limit: float | None = None, interrupts: Interrupts = RAISE
) -> Result:
    """Solve a problem and prove the result in rational arithmetic, without any
    tolerance, as `lcp solve --exact` does.

    The floating-point numbers in M and q are taken as exact, so that 0.1 is
    3602879701896397/36028797018963968; the command takes the numbers of a file as
    written. The payoffs of a game, and numbers of planar contacts, are used instead of
    M and q, as written or as their shortest decimals. Up to n = 200 it takes seconds. A
    problem with few unknowns is always decided.

    Parameters
    ----------
    problem : a Problem.
    time_limit : seconds after which to give up; by default the search in rational
        arithmetic is limited to a minute, and the rest is not limited.
    interrupts : what Ctrl-C does, as in `solve`.

    Returns
    -------
    Result : `exact` has, as fractions, z and w, or the Farkas vector y which proves
        that no z >= 0 has M z + q >= 0, and says how they are proved; its status is
        None if nothing was proved.

    Raises OptionError without python-flint, which comes with the extra `exact`, and
    Interrupted as `solve` does.

    Examples
    --------
    >>> import lcpcli
    >>> result = lcpcli.exact(lcpcli.Problem([[2, 1], [1, 2]], [-5, -6]))
    >>> result
    <Result: solved by newton, n = 2, residual ..., in ..., exact z = (4/3, 7/3)>
    >>> [str(value) for value in result.exact.z], result.exact.proof
    (['4/3', '7/3'], "z >= 0, w = Mz + q >= 0 and z'w = 0 hold in rational arithmetic")
    """
    as_problem(problem)
    require()
    chosen({"interrupts": interrupts}, ["interrupts"])
    limits = DEFAULTS if time_limit is None else Limits(time_limit=time_limit)
    result = driver.run(problem, "auto", limits=limits)
    result = prove(lambda: ExactProblem.of_problem(problem), result)
    return unless_interrupted(result, interrupts)


def prove(exactly: Callable[[], ExactProblem], result: Result) -> Result:
    """Return the result of a run with `exact` filled in, and the rest corrected by the
    proof.

    exactly : makes the exact data of the problem, within the time that the run has left
        of its limit.

    If the problem is proved to be solved, z is the rounded exact solution, and all
    measures refer to this z. If nothing is proved, the result stays as it was, and its
    message says so. Raises OptionError without python-flint.
    """
    require()
    try:
        with (
            suppress(TimeIsUp),
            deadline_after(result.limits.time_limit - result.seconds),
        ):
            raise_if_timed_out()
            if (
                not result.interrupted
                and (exact := exact_answer(data := exactly(), result)) is not None
            ):
                return _proved(data, result, exact)
    except KeyboardInterrupt:
        result = replace(
            result,
            status=Status.INTERRUPTED,
            interrupted=True,
            message=Status.INTERRUPTED.value,
        )
    return replace(
        result, message=f"{result.message}; {UNPROVED}", exact=Exact(None, UNPROVED)
    )


def exact_answer(data: ExactProblem, result: Result) -> Exact | None:
    """Return what is proved: from the run; or from a run on the problem multiplied by
    numbers that make its data integers, which floats represent; or by a search."""
    is_exact = data.are_floats()
    exact = _exact(data, result, is_exact)
    in_integers = None if exact is not None or is_exact else data.in_integers()
    if in_integers is not None:
        # `auto` would try all other methods again before milp excludes a solution.
        is_excluded = result.status is Status.UNSOLVABLE and result.route[-1:] == (
            "milp",
        )
        other = (
            driver.run(in_integers, "milp")
            if is_excluded
            else driver.run(in_integers, "auto", z0=_finite(result.z))
        )
        if other.interrupted:
            raise KeyboardInterrupt
        exact = _exact(data, other, True)
    with suppress(TimeIsUp):
        return _searched(data) if exact is None else exact
    return None


def _exact(data: ExactProblem, run: Result, is_exact: bool) -> Exact | None:
    """Return what can be proved starting from a run, or None."""
    y = (
        None
        if run.certificate is None or run.certificate.kind != "farkas"
        else run.certificate.vector
    )
    if y is not None:
        # In integers: rows are multiplied by their denominators.
        if run.problem is not data.problem:
            largest = max(data.scales)  # of the positive multiples of y, a finite one
            y = y * rounded(Fraction(scale, largest) for scale in data.scales)
        proof = exact_proof(data, y)
        if proof is not None:
            return _verified(data, y=proof)
    if is_exact and run.status is Status.UNSOLVABLE:
        return EXCLUDED
    return _verified(data, from_point(data, _finite(run.z)))


def _searched(data: ExactProblem) -> Exact | None:
    """Return what a search decides in the remaining time, Lemke's method in half of it,
    for each connected part of M separately; raise TimeIsUp if it decides nothing."""
    if len(data.blocks) > 1:
        return _by_parts(data)
    z = y = None
    if (
        not data.problem.is_mixed
        and Structure(data.problem, data.problem.q).has_no_positive_links
    ):
        z, y = decided(data, Effort(EXACT_EFFORT))
    if z is None and y is None:
        count = Effort(
            EXACT_SEARCH_EFFORT if remaining() == math.inf else math.inf
        ).steps(data)
        z = pivoting.solve(data, Effort(EXACT_SEARCH_EFFORT / 2)) or first_solution(
            data, count
        )
        y = farkas_vector(data, count) if z is None else None
    return (
        EXCLUDED
        if z is None and y is None
        else _verified(data, z, y and simplified(data, y))
    )


def _by_parts(data: ExactProblem) -> Exact | None:
    """Return what a search decides of the parts: that one of them has no solution, or
    the solutions of all; None if one is undecided."""
    z, is_undecided = zeros(data.n), False
    for indices in data.blocks:
        raise_if_timed_out()
        answer: Exact | None = None
        with suppress(TimeIsUp):
            answer = _searched(data.part(indices))
        if answer is None:
            is_undecided = True
        elif answer.z is not None:
            for i, value in zip(indices, answer.z, strict=True):
                z[i] = value
        elif answer.y is not None:
            y = zeros(data.n)
            for i, value in zip(indices, answer.y, strict=True):
                y[i] = Fraction(value)
            return _verified(data, y=y)
        else:
            return EXCLUDED
    return None if is_undecided else _verified(data, z)


def _verified(
    data: ExactProblem, z: list[Fraction] | None = None, y: list[Fraction] | None = None
) -> Exact | None:
    """Return a proof by z and its w, or by the Farkas vector y, each verified again;
    None if it proves nothing."""
    wording = data.problem.box.wording
    if z is not None and data.is_solution(z):
        return Exact(Status.SOLVED, wording.solved, z=z, w=data.w(z))
    return (
        None
        if y is None or not data.refuted_by(y)
        else Exact(Status.INFEASIBLE, wording.infeasible, y=y)
    )


@np.errstate(all="ignore")  # overflow gives infinity
def _proved(data: ExactProblem, result: Result, exact: Exact) -> Result:
    z = None if exact.z is None else rounded(exact.z)
    if z is not None and not np.isfinite(z).all():
        exact, z = exact._replace(proof=f"{exact.proof}; {BEYOND_DOUBLES}"), None
    assert exact.status is not None
    certificate = (
        None if exact.y is None else Proof.of_fractions(data, exact.y, exact.proof)
    )
    if exact.status is Status.UNSOLVABLE:
        certificate = Proof("exhaustion", statement=exact.proof)
    point = result.point if z is None else Point(Criterion(data.problem), z)
    message = exact.status.sentence(exact.proof)
    return replace(
        result,
        status=exact.status,
        message=message,
        certificate=certificate,
        exact=exact,
        point=point,
    )


def _finite(z: Vector) -> Vector:
    return np.where(np.isfinite(z), z, 0.0)


def with_reference(problem: Problem) -> Problem:
    """Return the problem with a computed solution; unchanged if it already has one, or
    none is computed in time.

    For small n it is exact. Otherwise `auto` computes it, and it is refined, if
    possible to its last digits. It may be one of several, and is verified like any
    other result, on the original data.

    Raises
    ------
    KeyboardInterrupt : the search was interrupted.
    """
    if problem.solutions or problem.verdict in WITHOUT_SOLUTION:
        return problem
    result = exact = None
    with suppress(TimeIsUp), deadline_after(REFERENCE_SECONDS):
        result = driver.run(problem, "auto")
        if result.interrupted:
            raise KeyboardInterrupt
        if result.status.has_no_solution:
            return problem
        if problem.n <= MAX_EXACT_UNKNOWNS:
            data, effort = ExactProblem.of_floats(problem), Effort()
            exact = from_point(
                data, result.z, effort, MAX_EXACT_POSITIVE
            ) or pivoting.solve(data, effort)
    z = None if exact is None else finitely_rounded(exact)
    if z is not None:
        return problem.having(solutions=(z,), reference="exact")
    if result is None or not result.solved:
        return problem
    with suppress(TimeIsUp):  # of the caller's time limit
        z = accurate_basic_solution(problem, result.z)
        return problem.having(solutions=(z,), reference="computed")
    return problem
