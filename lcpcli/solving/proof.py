"""From a result in floating point to one that is proved for the exact data.

What the run has found is only a hint. Its active set is solved for and checked in rational arithmetic, or else, for a
small problem, Lemke's method is done exactly; its Farkas vector is made a rational one that stands up to the exact
data, and a proof by exhaustion counts if it was about these very data. Where the data are decimals, whose rounding may
have misled the run, the rows are multiplied by their denominators and the problem is run once more in integers, which
doubles hold exactly.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction

import numpy as np

from lcpcli.rational.linear import require
from lcpcli.rational.numbers import rounded
from lcpcli.rational.problem import ExactProblem
from lcpcli.solving import exact_lemke
from lcpcli.solving import run as driver
from lcpcli.solving.exact_solution import from_point
from lcpcli.solving.limits import Limits
from lcpcli.solving.result import Exact, Result, Status
from lcpcli.typing import Vector
from lcpcli.verify.accuracy import Accuracy
from lcpcli.verify.certificate import Certificate
from lcpcli.verify.exact_farkas import exact_proof

SOLVED = "z >= 0, w = Mz + q >= 0 and z'w = 0 hold in rational arithmetic"
INFEASIBLE = "y >= 0, M'y <= 0 and q'y < 0 hold in rational arithmetic, so that no z >= 0 has Mz + q >= 0"
UNSOLVABLE = "every complementary set is excluded by inequalities that were checked in rational arithmetic"
UNPROVED = "no exact proof was found for the numbers as written"


def prove(data: ExactProblem, result: Result, time_limit: float = math.inf) -> Result:
    """The result of a run on data.problem with `exact` filled in, and all else as far as the proof says otherwise.

    Proved to be solved: z is the exact solution rounded, and its measures are those of this z. If nothing is proved,
    the result stays what it was, and its message says so. time_limit is in seconds and counts from here on; it is
    looked at between steps. Raises OptionError without python-flint.
    """
    require()
    if result.interrupted:
        return _unproved(result)
    deadline = time.perf_counter() + time_limit
    try:
        for run, own in _runs(data, result, deadline):
            exact = _exact(data, run, own, deadline)
            if exact is not None and exact.status is not None:
                return _proved(data, result, exact, exact.status)
    except KeyboardInterrupt:
        result = replace(result, status=Status.INTERRUPTED, message=Status.INTERRUPTED.value)
    return _unproved(result)


def _runs(data: ExactProblem, result: Result, deadline: float) -> Iterator[tuple[Result, bool]]:
    """The result, and one in integers, each with whether it is about the exact data and not about rounded ones."""
    own = data.are_floats()
    yield result, own
    seconds = deadline - time.perf_counter()
    whole = None if own or seconds <= 0 else data.in_integers()
    if whole is not None:
        yield driver.run(whole, "auto", z0=_finite(result.z), limits=Limits(time_limit=seconds), conclude=False), True


def _exact(data: ExactProblem, run: Result, own: bool, deadline: float) -> Exact | None:
    """What a run leads to a proof of, if anything."""
    certificate = run.certificate
    if certificate is not None and certificate.kind == "farkas" and certificate.vector is not None:
        y = certificate.vector
        if run.problem is not data.problem:  # in integers, where rows are larger by their denominators
            largest = max(data.scales)  # any positive multiple of y will do: one that is finite
            y = y * rounded(Fraction(scale, largest) for scale in data.scales)
        found = exact_proof(data, y)
        if found is not None:
            return Exact(Status.INFEASIBLE, INFEASIBLE, y=found)
    if own and run.status is Status.UNSOLVABLE:
        return Exact(Status.UNSOLVABLE, UNSOLVABLE)
    z = from_point(data, _finite(run.z), deadline) or exact_lemke.solve(data, deadline)
    return Exact(Status.SOLVED, SOLVED, z=z, w=data.w(z)) if z is not None and data.is_solution(z) else None


@np.errstate(over="ignore", invalid="ignore")  # what overflows is judged as infinite
def _proved(data: ExactProblem, result: Result, exact: Exact, status: Status) -> Result:
    result = replace(
        result, status=status, message=f"{status.value}: {exact.proof}", certificate=_certificate(exact), exact=exact
    )
    if exact.z is None or not np.isfinite(rounded(exact.z)).all():
        return result
    z = rounded(exact.z)
    accuracy = Accuracy(data.problem)
    w = accuracy.w(z)
    return replace(
        result,
        z=z,
        w=w,
        residual=accuracy.natural_residual(z, w),
        relative_residual=accuracy.relative_residual(z, w),
        error=accuracy.error(z),
    )


def _certificate(exact: Exact) -> Certificate | None:
    if exact.y is not None:
        return Certificate("farkas", exact.proof, rounded(exact.y))
    return Certificate("exhaustion", exact.proof) if exact.status is Status.UNSOLVABLE else None


def _unproved(result: Result) -> Result:
    exact = Exact(None, UNPROVED)
    return replace(result, message=f"{result.message}; {exact.proof}", exact=exact)


def _finite(z: Vector) -> Vector:
    return np.where(np.isfinite(z), z, 0.0)
