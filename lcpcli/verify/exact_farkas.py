"""From a Farkas vector in doubles to one that is a proof for the exact data (see `farkas`)."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from lcpcli.rational import linear
from lcpcli.rational.numbers import rounded
from lcpcli.rational.problem import ExactProblem, fractions_of
from lcpcli.rational.sums import over_one_denominator
from lcpcli.typing import Vector
from lcpcli.verify.farkas import ACTIVE

SIMPLE_DENOMINATORS = (100, 10**6)  # denominators of the simple fractions that are tried first


def exact_proof(data: ExactProblem, y: Vector) -> list[Fraction] | None:
    """A rational vector near y, finite doubles of shape (n,), that proves the problem infeasible; None if not found.

    It tries simple fractions, y itself, and y changed so that components of M'y that are nearly 0 become 0.
    """
    if not (np.isfinite(y).all() and y.any()):
        return None
    return next((candidate for candidate in _candidates(data, y) if data.refuted_by(candidate)), None)


def _candidates(data: ExactProblem, y: Vector) -> Iterator[list[Fraction]]:
    exact = fractions_of(y)
    sizes = [abs(value) for value in exact if value]
    for unit in (max(sizes), min(sizes)):
        for largest in SIMPLE_DENOMINATORS:
            yield [(value / unit).limit_denominator(largest) for value in exact]
    yield exact
    corrected = _corrected(data, exact)
    if corrected is not None:
        yield corrected


def _corrected(data: ExactProblem, y: list[Fraction]) -> list[Fraction] | None:
    """y changed on its support so that components of M'y that are small relative to their terms vanish."""
    support = sorted((i for i in range(data.n) if y[i]), key=lambda i: -abs(y[i]))  # the best to correct
    columns, _ = data.with_transpose(y)
    floats = rounded(y)
    with np.errstate(all="ignore"):
        size = abs(data.problem.M).T @ np.abs(floats)
        small = np.abs(rounded(columns)) <= ACTIVE * size
    active = [j for j in np.flatnonzero(small & (size > 0)).tolist() if any(j in data.rows[i] for i in support)]
    if not active:
        return None
    target, d = over_one_denominator([-columns[j] for j in active])
    found = linear.particular([[data.rows[i].get(j, 0) for i in support] for j in active], target)
    if found is None:
        return None
    corrected = list(y)
    for i, change in zip(support, found, strict=True):
        corrected[i] += change * data.scales[i] / d
    return corrected
