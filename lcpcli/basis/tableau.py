"""The tableau of Lemke's method: w = M y + q + z_0 c with bounds 0 <= y <= d, from a
large z_0 down to z_0 = 0.

R. W. H. Sargent, An efficient implementation of the Lemke algorithm and its extension
to deal with upper and lower bounds, Mathematical Programming Study 7 (1978) 36-54: a
basic y_i leaves at either bound, an entering one may pass to its other bound, and w_i
<= 0 while y_i = d_i. Variables have numbers: i is the number of w_i, n + i that of y_i,
2 n that of z_0.

All but `refactorize` is written for numpy in a form that numba compiles as well, so
that both make the same decisions; the pivot, the ratio test and `shift` are compiled
from other bodies, which make no temporary arrays (see `compiled`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.typing import BasisStatus, Indices, Mask, Vector

SOLVED, RAY, PAUSED = 1, 2, 3
# Returned instead of a row: the variable passes to its other bound, or is unbounded.
NO_ROW, UNBOUNDED = -1, -2
# Relative to its largest term so far: the error of the value of a basic variable.
NOISE = 1e-12
ZERO = 1e-3  # times the noise: values up to this size are set to 0
# Relative to the largest term of an entry of T so far: entries up to this size are
# treated as rounding errors of 0.
SMALL = 1e-12
# Entries of T up to which selecting the rows that change takes longer than it saves.
MAX_UNSELECTED = 2000
TIE = 1e-9  # relative: entries of the lexicographic rule that differ by less are equal


class Tableau(NamedTuple):
    """(basic variables) = T (nonbasic variables) + constants, with the values that the
    basic ones have at present.

    T : shape (n, n + 1). d : the upper bounds of y, shape (n,). values, lower, upper :
    of the basic variables and their bounds, shape (n,). basic, nonbasic : their
    numbers, shapes (n,) and (n + 1,).
    column : of the nonbasic variable of each pair, shape (n,); both variables of one
    pair are nonbasic, and its other one enters next. at_upper : which y_i stay at d_i
    if nonbasic, shape (n,).
    noise : the errors of the values, shape (n,). growth : the largest term of an entry
        of T so far, shape (1,).
    """

    T: Vector
    d: Vector
    values: Vector
    lower: Vector
    upper: Vector
    basic: Indices
    nonbasic: Indices
    column: Indices
    at_upper: Mask
    noise: Vector
    growth: Vector


def tableau_of(M: Vector, q: Vector, d: Vector, cover: Vector) -> Tableau:
    """Return the tableau with all w_i basic, and z_0 = 0 in the last column."""
    n = q.size
    T = np.empty((n, n + 1))
    T[:, :n] = M
    T[:, n] = cover
    numbers = np.arange(2 * n + 1)
    basic, nonbasic = numbers[:n].copy(), numbers[n:].copy()
    column = numbers[:n].copy()
    lower, upper = np.zeros(n), np.full(n, np.inf)
    at_upper = np.zeros(n, np.bool_)
    noise = NOISE * np.abs(q)
    growth = np.array([np.abs(T).max() if n else 0.0])
    return Tableau(
        T,
        d.copy(),
        q.copy(),
        lower,
        upper,
        basic,
        nonbasic,
        column,
        at_upper,
        noise,
        growth,
    )


def exchange(T: Vector, row: int, column: int) -> float:
    """Pivot: the nonbasic variable of a column enters the basis, that of a row leaves;
    return the largest entry of this row before, relative to the pivot."""
    pivot, others = T[row, column], T[:, column].copy()
    pivot_row = T[row] / -pivot
    sizes = np.abs(pivot_row)
    largest = sizes[sizes.argmax()]
    others[row], pivot_row[column] = 0.0, 0.0
    if T.size <= MAX_UNSELECTED or 2 * np.count_nonzero(others) >= others.size:
        T += others.reshape(-1, 1) * pivot_row
    else:
        rows = others.nonzero()[0]
        T[rows] += others[rows].reshape(-1, 1) * pivot_row
    T[row] = pivot_row
    T[:, column] = others / pivot
    T[row, column] = 1.0 / pivot
    return float(largest)


def choose(
    tableau: Tableau,
    entering: int,
    change: Vector,
    cover_row: int,
    lexicographic: bool,
) -> tuple[int, float]:
    """Do the ratio test: return the row whose basic variable leaves, and how far the
    entering variable of this column moves.

    change : the rates at which the basic variables move, with their signs.

    Of the rows that block within the noise of the values, the one with the largest
    pivot leaves, or the lexicographic minimum, but z_0 before all others.
    """
    n, noise = tableau.values.size, tableau.noise
    rate = np.abs(change)
    slack = tableau.upper - tableau.values
    np.copyto(slack, tableau.values - tableau.lower, where=change < 0.0)
    np.maximum(slack, 0.0, out=slack)
    moves = rate > SMALL * tableau.growth[0]
    ratios = np.empty(n)
    ratios.fill(np.inf)
    np.divide(slack, rate, where=moves, out=ratios)
    variable = tableau.nonbasic[entering]
    bound_flip_ratio = tableau.d[variable - n] if n <= variable < 2 * n else np.inf
    min_ratio = min(ratios[ratios.argmin()], bound_flip_ratio)
    if min_ratio == np.inf:
        return UNBOUNDED, 0.0
    fall = -change[cover_row]
    if (
        moves[cover_row]
        and fall > 0.0
        and tableau.values[cover_row] - min_ratio * fall <= noise[cover_row]
    ):
        return cover_row, ratios[cover_row]
    if bound_flip_ratio <= min_ratio:
        return NO_ROW, bound_flip_ratio
    tied = moves & (slack - min_ratio * rate <= noise)
    if lexicographic:
        row = lexicographic_minimum(tableau, np.nonzero(tied)[0], change)
    else:
        rate[np.logical_not(tied)] = 0.0
        row = int(rate.argmax())
    return row, ratios[row]


def lexicographic_minimum(tableau: Tableau, rows: Indices, change: Vector) -> int:
    """Return that of these rows which blocks first if the powers e, e^2, ..., e^n of a
    small e are added to q."""
    n = tableau.values.size
    position = np.full(2 * n + 1, -1)
    position[tableau.nonbasic] = np.arange(n + 1)
    for j in range(n):
        if rows.size == 1:
            break
        shift = (
            (tableau.basic[rows] == j) * 1.0
            if position[j] < 0
            else -tableau.T[rows, position[j]]
        )
        ratios = shift / -change[rows]
        min_ratio = ratios.min()
        rows = rows[ratios <= min_ratio + TIE * max(abs(min_ratio), 1.0)]
    return int(rows[0])


def shift(tableau: Tableau, change: Vector, step: float) -> float:
    """Let the basic variables move at these rates; return the largest rate."""
    rate, values = np.abs(change), tableau.values
    values += step * change
    np.maximum(tableau.noise, NOISE * step * rate, out=tableau.noise)
    values[np.abs(values) <= ZERO * tableau.noise] = 0.0
    return float(rate[rate.argmax()])


def move(
    tableau: Tableau,
    entering: int,
    change: Vector,
    row: int,
    step: float,
    step_sign: float,
) -> tuple[int, float]:
    """Let the variable of a column enter and that of a row leave, or let the first one
    pass to its other bound; return the column that enters next, with the direction in
    which its variable moves, or NO_ROW once z_0 has left."""
    n, d = tableau.values.size, tableau.d
    at_upper, variable = tableau.at_upper, int(tableau.nonbasic[entering])
    fastest = shift(tableau, change, step)
    if row == NO_ROW:
        pair = variable - n
        at_upper[pair] = not at_upper[pair]
    else:
        leaving = int(tableau.basic[row])
        is_growing = change[row] > 0.0
        is_y = n <= variable < 2 * n
        growth = fastest * exchange(tableau.T, row, entering)
        tableau.growth[0] = max(tableau.growth[0], growth)
        tableau.noise[row] = NOISE * step
        tableau.values[row] = (
            d[variable - n] if is_y and at_upper[variable - n] else 0.0
        ) + step_sign * step
        tableau.basic[row], tableau.nonbasic[entering] = variable, leaving
        is_negative = variable < n and at_upper[variable % n]
        tableau.lower[row] = -np.inf if is_negative else 0.0
        tableau.upper[row] = 0.0 if is_negative else np.inf
        if is_y:
            tableau.upper[row] = d[variable - n]
        if leaving == 2 * n:
            return NO_ROW, 0.0
        pair = leaving % n
        if leaving >= n:
            at_upper[pair] = is_growing
    partner = int(tableau.column[pair])
    tableau.column[pair] = entering
    return partner, -1.0 if at_upper[pair] else 1.0


def begin(
    tableau: Tableau, cover: Vector, lexicographic: bool
) -> tuple[int, int, float]:
    """Let z_0 enter at its smallest value with all w_i >= 0; return its row, the column
    that enters next, and the sign of its step."""
    ratios = tableau.values / cover
    min_ratio = ratios.min()
    # Some row, also where numbers overflow.
    tied = ~(ratios > min_ratio + (TIE * abs(min_ratio) if lexicographic else 0.0))
    row = int(tied.nonzero()[0][-1])  # the last one is the lexicographic minimum
    n = cover.size
    change = tableau.T[:, n].copy()
    entering, step_sign = move(tableau, n, change, row, -float(ratios[row]), 1.0)
    return row, entering, step_sign


def follow(
    tableau: Tableau,
    entering: int,
    step_sign: float,
    cover_row: int,
    lexicographic: bool,
    max_pivots: int,
) -> tuple[int, int, int, float]:
    """Follow the path for at most max_pivots pivots; return how it ended, their number,
    the column that enters next, and the sign of its step."""
    for pivots in range(max_pivots):
        change = tableau.T[:, entering].copy()
        if step_sign < 0.0:
            change = -change
        row, step = choose(tableau, entering, change, cover_row, lexicographic)
        if row == UNBOUNDED:
            return RAY, pivots, entering, step_sign
        entering, step_sign = move(tableau, entering, change, row, step, step_sign)
        if entering == NO_ROW:
            return SOLVED, pivots + 1, entering, step_sign
    return PAUSED, max_pivots, entering, step_sign


def path(
    K: Vector, k: Vector, d: Vector, cover: Vector, max_pivots: int
) -> tuple[int, int, BasisStatus]:
    """Follow the path of a problem for at most max_pivots pivots; return how it ended,
    their number, and the basis of y."""
    statuses = np.full(k.size, LOWER, np.int8)
    if not (k < 0.0).any():
        return SOLVED, 0, statuses
    tableau = tableau_of(K, k, d, cover)
    row, entering, step_sign = begin(tableau, cover, False)
    status, pivots, entering, step_sign = follow(
        tableau, entering, step_sign, row, False, max_pivots - 1
    )
    statuses[tableau.at_upper] = UPPER
    for variable in tableau.basic:
        if k.size <= variable < 2 * k.size:
            statuses[variable - k.size] = BASIC
    return status, pivots + 1, statuses


def refactorize(tableau: Tableau, A: Vector, q: Vector) -> None:
    """Compute T and the values again from A = [M c] and q; raise LinAlgError if the
    basis is singular."""
    n = q.size
    rows, others = (tableau.basic >= n).nonzero()[0], (tableau.basic < n).nonzero()[0]
    columns = (tableau.nonbasic < n).nonzero()[0]
    nonbasic_y = (tableau.nonbasic >= n).nonzero()[0]
    C, S = tableau.basic[rows] - n, tableau.basic[others]
    R, N = tableau.nonbasic[columns], tableau.nonbasic[nonbasic_y] - n
    inverse = np.linalg.inv(A[np.ix_(R, C)])
    elsewhere, across = A[np.ix_(S, C)] @ inverse, A[np.ix_(R, N)]
    T = tableau.T
    T[np.ix_(rows, columns)], T[np.ix_(rows, nonbasic_y)] = inverse, -inverse @ across
    T[np.ix_(others, columns)], T[np.ix_(others, nonbasic_y)] = (
        elsewhere,
        A[np.ix_(S, N)] - elsewhere @ across,
    )
    y = np.append(np.where(tableau.at_upper, tableau.d, 0.0), 0.0)
    y[C] = 0.0
    at_bounds = q + A @ np.where(np.isfinite(y), y, 0.0)
    y[C] = -inverse @ at_bounds[R]
    y[C] -= inverse @ (q + A @ y)[R]
    terms = np.abs(q) + np.abs(A) @ np.abs(y)
    tableau.values[rows], tableau.values[others] = y[C], (q + A @ y)[S]
    tableau.noise[rows] = NOISE * (np.abs(inverse) @ terms[R])
    tableau.noise[others] = NOISE * terms[S]
    tableau.growth[0] = np.abs(T).max(initial=0.0)
