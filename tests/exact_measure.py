"""The measure of `lcpcli.verify.measure` in rational arithmetic, from its definition,
with constants of its own; only the units and the reference point are the package's,
unless others are given."""

import math
from fractions import Fraction

import numpy as np
from scipy.sparse import coo_array

FINEST, ROUNDING, DROWNED = 0.01, 2.0**-50, 1e8  # as documented


def relative_residual(problem, z, units=None, reference=None):
    """The largest v_i / min(t_i, c_i) of z, rounded in the end; at most ROUNDING for
    what counts as rounding.

    units : powers of two of rows and columns, and the connected part of each.
    """
    if not np.isfinite(z).all():
        return math.inf
    units, coo = units or problem.units, coo_array(problem.M)
    M = list(
        zip(
            coo.row.tolist(),
            coo.col.tolist(),
            map(Fraction, coo.data.tolist()),
            strict=True,
        )
    )
    low, high = (
        np.broadcast_to(bound, problem.n).tolist()
        for bound in (problem.lower, problem.upper)
    )
    q, point, there = (
        list(map(Fraction, np.asarray(values, dtype=float).tolist()))
        for values in (
            problem.q,
            z,
            problem.reference_point if reference is None else reference,
        )
    )
    w, w_there = _w(M, q, point), _w(M, q, there)
    given, given_there = _terms(M, q, point), _terms(M, q, there)
    far = _terms(M, w_there, [a - b for a, b in zip(point, there, strict=True)])
    real = [
        Fraction(0) if abs(a) <= Fraction(ROUNDING) * b else a
        for a, b in zip(w_there, given_there, strict=True)
    ]
    moved = [
        abs(a - b)
        if low[j] < high[j] and (a <= low[j] or a >= high[j])
        else Fraction(0)
        for j, (a, b) in enumerate(zip(point, there, strict=True))
    ]
    sizes = _component_sizes(units, _violations(there, real, low, high), real, moved)
    # doubles near 0 lie on a grid: 2^-1042 |M_ij| for basic z_j below 2^-1022
    tiny = [
        Fraction(0 < abs(a) < Fraction(2) ** -1022 and low[j] < a < high[j])
        for j, a in enumerate(point)
    ]
    worst, grid = 0.0, _w(M, [Fraction(0)] * problem.n, tiny, abs)
    for i, violation in enumerate(_violations(point, w, low, high)):
        violation = (
            max(violation - grid[i] / 2**1042, Fraction(0))
            if violation != math.inf
            else violation
        )
        terms = min(given[i], max(far[i], Fraction(FINEST) * given[i]))
        cap = max(abs(w_there[i]), _power(sizes[units.row_part[i]] - units.rows[i]))
        worst = max(worst, _ratio(violation, terms, cap, given[i]))
    return worst


def _ratio(violation, terms, cap, given):
    if not violation:
        return 0.0
    if violation == math.inf:
        return math.inf
    least = min(terms, cap)
    ratio = float(violation / least) if least else math.inf
    rounding = min(given, Fraction(DROWNED) * cap)
    return min(ratio, ROUNDING) if violation <= Fraction(ROUNDING) * rounding else ratio


def _component_sizes(units, violations, real, moved):
    """log2 of k for each component."""
    found, fallback = (
        [-math.inf] * (int(max(*units.row_part, *units.column_part)) + 1)
        for _ in range(2)
    )
    for part, violation, value, unit in zip(
        units.row_part, violations, real, units.rows, strict=True
    ):
        found[part] = max(found[part], _log2(violation) + unit)
        fallback[part] = max(fallback[part], _log2(abs(value)) + unit)
    for part, distance, unit in zip(
        units.column_part, moved, units.columns, strict=True
    ):
        found[part] = max(found[part], _log2(distance) - unit)
    sizes = [a if a > -math.inf else b for a, b in zip(found, fallback, strict=True)]
    return [math.inf if size == -math.inf else size for size in sizes]


def _violations(z, w, low, high):
    found = []
    for a, b, lower, upper in zip(z, w, low, high, strict=True):
        if a < lower or a > upper:
            found.append(math.inf)
        elif lower == upper:
            found.append(Fraction(0))
        else:
            found.append(
                max(b if a > lower else 0, -b if a < upper else 0, Fraction(0))
            )
    return found


def _w(M, q, z, of=lambda value: value):
    w = list(map(of, q))
    for i, j, value in M:
        w[i] += of(value * z[j])
    return w


def _terms(M, q, z):
    return _w(M, q, z, abs)


def _log2(value):
    if value == math.inf:
        return math.inf
    return (
        math.log2(value.numerator) - math.log2(value.denominator)
        if value
        else -math.inf
    )


def _power(exponent):
    if exponent == math.inf:
        return math.inf
    whole = math.floor(exponent)
    return Fraction(2.0 ** (exponent - whole)) * Fraction(2) ** whole
