"""Proofs that there is no solution, from iterates that diverge: Farkas' y is the direction in which they do."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from lcpcli.methods.interior.scaling import Scaled
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.typing import Vector
from lcpcli.verify.alternative import simplest
from lcpcli.verify.certificate import Certificate, farkas_statement, proof_in_units

FAR = 1e2  # in scaled units: what diverges is at least that large
COARSE = 1e-3  # of the largest entry of y: what is left out first
CLEAR = 1e-10  # of the sum of |y|: what a proof is negative by
ROUGHLY, NEARLY = 1e-2, 1e-5  # of the same: what is not yet 0 before and after rounding


def proof_of(problem: Problem, within: Scaled, directions: Sequence[Vector]) -> Certificate | None:
    """The certificate from one of the directions, or from the part of either sign S; None if none is one."""
    given = conditions_of(problem)
    low, high = np.isfinite(given.lower), np.isfinite(given.upper)
    for direction in directions:
        if not np.abs(direction).max() > FAR:
            continue
        parts = [direction] if within.S is None else [np.where(s == within.S, direction, 0.0) for s in (1, -1)]
        for part in (*parts, direction)[: len(parts) + (within.S is not None)]:
            y = np.zeros(problem.n)
            y[within.kept] = part * within.units
            y = np.where(low & high, 0.0, np.where(low, np.maximum(y, 0.0), np.where(high, np.minimum(y, 0.0), y)))
            if not _is_clear(within, y, ROUGHLY):
                continue
            for candidate in _simplest_first(y):
                if not _is_clear(within, candidate, NEARLY):
                    continue
                proof = proof_in_units(problem, np.ones(problem.n), candidate)
                if proof is not None:
                    return Certificate("farkas", farkas_statement(problem), proof)
    return None


def _simplest_first(y: Vector) -> Iterator[Vector]:
    """What y may be an approximation of: integers, fractions, and itself, without small entries and with them."""
    for least in (COARSE * float(np.abs(y).max()), 0.0):
        yield from reversed(list(simplest(np.where(np.abs(y) < least, 0.0, y))))


def _is_clear(within: Scaled, y: Vector, nearly: float) -> bool:
    """Whether y is nearly a proof, and one that does not hang on the last digits of the data, which may have been
    rounded from others that have a solution: in scaled units and floats, which are quicker than exact arithmetic."""
    y = y[within.kept] / within.units
    product, size = within.M.T @ y, float(np.abs(y).sum())
    ends = np.where(product > 0, within.upper, within.lower)
    finite = np.isfinite(ends)
    if np.abs(product[~finite]).max(initial=0.0) > nearly * size:
        return False
    return bool(within.q @ y + ends[finite] @ product[finite] < -CLEAR * size)
