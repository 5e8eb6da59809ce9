"""The measure of `lcpcli.verify.measure` in rational arithmetic, from its definition, with constants of its own; only
the units are the package's."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from lcpcli import Problem

from . import exact

FINEST, ROUNDING, DROWNED = 0.01, 2.0**-50, 1e8  # as documented
Numbers = list[Fraction]


def relative_residual(problem: Problem, z: np.ndarray) -> float:
    """The largest v_i / min(t_i, c_i) of z, rounded in the end; at most ROUNDING for what counts as rounding."""
    if not np.isfinite(z).all():
        return math.inf
    M, q = exact._rational(problem)
    low, high = (np.broadcast_to(bound, problem.n).tolist() for bound in (problem.lower, problem.upper))
    point, there = (list(map(Fraction, values.tolist())) for values in (z, problem.reference_point))
    w, w_there = _w(M, q, point), _w(M, q, there)
    given, given_there = _terms(M, q, point), _terms(M, q, there)
    far = _terms(M, w_there, [a - b for a, b in zip(point, there, strict=True)])
    real = [Fraction(0) if abs(a) <= Fraction(ROUNDING) * b else a for a, b in zip(w_there, given_there, strict=True)]
    moved = [
        abs(a - b) if low[j] < high[j] and (a <= low[j] or a >= high[j]) else Fraction(0)
        for j, (a, b) in enumerate(zip(point, there, strict=True))
    ]
    sizes = _component_sizes(problem, _violations(there, real, low, high), real, moved)
    worst, grid = 0.0, _grid(M, point, low, high)
    for i, violation in enumerate(_violations(point, w, low, high)):
        violation = max(violation - grid[i], Fraction(0)) if violation != math.inf else violation
        terms = min(given[i], max(far[i], Fraction(FINEST) * given[i]))
        cap = max(abs(w_there[i]), _power(sizes[problem.units.row_part[i]] - problem.units.rows[i]))
        worst = max(worst, _ratio(violation, terms, cap, given[i]))
    return worst


def _grid(M: list[Numbers], z: Numbers, low: list[float], high: list[float]) -> Numbers:
    """What each row may be violated by as doubles near 0 lie on a grid: 2^-1042 |M_ij| for basic z_j below 2^-1022."""
    tiny = [0 < abs(a) < Fraction(2) ** -1022 and low[j] < a < high[j] for j, a in enumerate(z)]
    return [sum((abs(row[j]) for j in range(len(z)) if tiny[j]), Fraction(0)) / 2**1042 for row in M]


def _ratio(violation: Fraction, terms: Fraction, cap: Fraction, given: Fraction) -> float:
    if not violation:
        return 0.0
    if violation == math.inf:
        return math.inf
    least = min(terms, cap)
    ratio = float(violation / least) if least else math.inf
    rounding = min(given, Fraction(DROWNED) * cap)
    return min(ratio, ROUNDING) if violation <= Fraction(ROUNDING) * rounding else ratio


def _component_sizes(problem: Problem, violations: Numbers, real: Numbers, moved: Numbers) -> list[float]:
    """log2 of k for each component."""
    units = problem.units
    found = []
    for part in range(units.parts):
        rows = [i for i in range(problem.n) if units.row_part[i] == part]
        columns = [j for j in range(problem.n) if units.column_part[j] == part]
        values = [_log2(violations[i]) + units.rows[i] for i in rows] + [
            _log2(moved[j]) - units.columns[j] for j in columns
        ]
        size = max(values, default=-math.inf)
        if size == -math.inf:
            size = max((_log2(abs(real[i])) + units.rows[i] for i in rows), default=-math.inf)
        found.append(math.inf if size == -math.inf else size)
    return found


def _violations(z: Numbers, w: Numbers, low: list[float], high: list[float]) -> Numbers:
    found = []
    for a, b, lower, upper in zip(z, w, low, high, strict=True):
        if a < lower or a > upper:
            found.append(math.inf)
        elif lower == upper:
            found.append(Fraction(0))
        else:
            found.append(max(b if a > lower else 0, -b if a < upper else 0, Fraction(0)))
    return found


def _w(M: list[Numbers], q: Numbers, z: Numbers) -> Numbers:
    return [sum((a * b for a, b in zip(row, z, strict=True)), value) for row, value in zip(M, q, strict=True)]


def _terms(M: list[Numbers], q: Numbers, z: Numbers) -> Numbers:
    return [sum((abs(a * b) for a, b in zip(row, z, strict=True)), abs(value)) for row, value in zip(M, q, strict=True)]


def _log2(value: Fraction) -> float:
    if value == math.inf:
        return math.inf
    return math.log2(value.numerator) - math.log2(value.denominator) if value else -math.inf


def _power(exponent: float) -> Fraction:
    """2^exponent."""
    if exponent == math.inf:
        return math.inf
    whole = math.floor(exponent)
    return Fraction(2.0 ** (exponent - whole)) * Fraction(2) ** whole
