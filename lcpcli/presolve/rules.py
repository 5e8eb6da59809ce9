"""The rules of presolve: each searches the reduced problem for a pattern, and removes
rows and columns, or multiplies rows.

A rule takes a `ReducedProblem` and yields its steps.

The last rule chooses the signs of equations: factors of rows, and an assignment of
equations to free variables, that make a monotone matrix recognizable. The optimality
conditions of a program have M = [Q -A'; A 0] with Q positive semidefinite, but
equations may be written with any sign and in any order, and rows of inequalities may be
scaled differently from their multipliers. D M, with a diagonal D that is positive for
the rows of bounded variables, has the same solutions. Where the diagonal of M is 0, D M
+ M'D is positive semidefinite only if d_i M_ij = -d_j M_ji, which determines D, a
Volterra multiplier: R. Redheffer, Volterra multipliers, SIAM J. Algebraic Discrete
Methods 6 (1985) 592-611, 612-623.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from lcpcli.clock import imports
from lcpcli.interrupts import raise_if_timed_out
from lcpcli.linalg.doubles import generator
from lcpcli.presolve.system import (
    Entries,
    PresolveStep,
    ReducedProblem,
    mask_of,
    summed,
)
from lcpcli.typing import Indices, Mask, Vector


def definitions_of_free_variables(system: ReducedProblem) -> Iterator[PresolveStep]:
    """Substitute definitions of free variables: an equation defines a free variable
    that is the only term of one other row, and occurs in no third one, as modelling
    languages write F >= 0. Only coefficients that are powers of two are used, and no
    sums, so that nothing is rounded.
    """
    entries = system.entries
    in_row, in_column = system.counts()
    equations = system.equations
    is_power = np.frexp(np.abs(entries.values))[0] == 0.5
    twice = np.flatnonzero((system.free & (in_column == 2))[entries.columns] & is_power)
    twice = twice[np.argsort(entries.columns[twice], kind="stable")]
    is_pair = np.flatnonzero(np.diff(entries.columns[twice]) == 0)
    first, second = twice[is_pair], twice[is_pair + 1]
    swapped = equations[entries.rows[second]] & ~equations[entries.rows[first]]
    definition, use = np.where(swapped, second, first), np.where(swapped, first, second)
    rows, used = entries.rows[definition], entries.rows[use]
    usable = (
        equations[rows]
        & ~equations[used]
        & (in_row[used] == 1)
        & ((system.q[rows] == 0) | (system.q[used] == 0))
    )
    yield from _pivots(system, entries.part(definition[usable]))


def single_entries_of_free_variables(system: ReducedProblem) -> Iterator[PresolveStep]:
    """Remove an equation with a free variable that occurs in no other row: the equation
    determines the variable after all others are known.
    """
    entries, (_, columns) = system.entries, system.counts()
    alone = (
        system.free[entries.columns]
        & (columns[entries.columns] == 1)
        & system.equations[entries.rows]
    )
    yield from _pivots(system, entries.part(alone))


def _pivots(system: ReducedProblem, candidates: Entries) -> Iterator[PresolveStep]:
    """Pivot on entries that are alone in their rows, or in their columns: at most one
    of each row and each column.
    """
    chosen_entries = np.unique(candidates.rows, return_index=True)[1]
    chosen_entries = chosen_entries[
        np.unique(candidates.columns[chosen_entries], return_index=True)[1]
    ]
    if chosen_entries.size:
        yield system.pivot(
            candidates.rows[chosen_entries],
            candidates.columns[chosen_entries],
            candidates.values[chosen_entries],
        )


Pairs = tuple[Indices, Indices, Vector, Vector]
# The largest factor of a row: larger ones would lose more digits than symmetry saves.
FARTHEST_FACTOR = 1e8
# Numbers that differ by at most this, relatively, are considered equal up to rounding.
EQUAL = 1e-12
# Rounds of assignments, each by means of the equations assigned before.
ASSIGNMENT_ROUNDS = 3


def signs_of_equations(system: ReducedProblem) -> Iterator[PresolveStep]:
    """Multiply rows by factors that make the matrix skew-symmetric where its diagonal
    is 0, as a monotone one is. Entries M_ij and M_ji that are equal, or opposite, up to
    rounding, are made exactly so.
    """
    if not system.columns.size:
        return
    pairs = _pairs(system)
    raise_if_timed_out()
    i, _, forth, back = pairs
    # Indices whose row or column has an entry M_ij with M_ji = 0.
    unpaired = mask_of(system.n, i[(forth == 0) != (back == 0)])
    if (unpaired & system.free & (_diagonal(system) == 0)).any():
        _assign(system)
        pairs = _pairs(system)
    raise_if_timed_out()
    factors = _factors(system, pairs)
    if (factors != 1).any():
        yield system.multiply(factors)
        pairs = _pairs(system)
    raise_if_timed_out()
    i, j, forth, back = pairs
    sign = np.where(forth * back > 0, 1.0, -1.0)
    nearly = (
        (i < j)
        & (forth != sign * back)
        & (np.abs(forth - sign * back) <= EQUAL * np.abs(forth))
    )
    # The entries of the later row are not changed: constraints often come later, and
    # their rows make up infeasibility proofs.
    if nearly.any():
        values = system.entries.values.copy()
        values[system.positions(system.row_of[i[nearly]], j[nearly])] = (sign * back)[
            nearly
        ]
        system.entries = system.entries._replace(values=values)
        system.is_lossless = False


def _pairs(system: ReducedProblem) -> Pairs:
    """Return i, j, M_ij and M_ji for all i != j for which one of the two entries is not
    0; rows are numbered like the columns that they belong to.
    """
    n = system.n
    entries = system.entries._replace(rows=system.column_of[system.entries.rows])
    off = entries.part(entries.rows != entries.columns)
    keys = np.concatenate((off.rows * n + off.columns, off.columns * n + off.rows))
    keys.sort()  # np.unique takes ten times as long
    keys = keys[np.diff(keys, prepend=-1) > 0]
    value = np.zeros(keys.size)
    value[np.searchsorted(keys, off.rows * n + off.columns)] = off.values
    i, j = keys // n, keys % n
    return i, j, value, value[np.searchsorted(keys, j * n + i)]


def _diagonal(system: ReducedProblem) -> Vector:
    """Return the diagonal of M, indexed by columns."""
    entries, diagonal = system.entries, np.zeros(system.n)
    is_diagonal = system.column_of[entries.rows] == entries.columns
    diagonal[entries.columns[is_diagonal]] = entries.values[is_diagonal]
    return diagonal


def _factors(system: ReducedProblem, pairs: Pairs) -> Vector:
    """Return the factor d_i of each row; 1 in connected components of the matrix in
    which d_i M_ij = -d_j M_ji has no suitable solution.
    """
    n = system.n
    free = system.free
    diagonal = _diagonal(system)
    i, j, forth, back = pairs
    used = (forth != 0) & (back != 0) & ((diagonal[i] == 0) | (diagonal[j] == 0))
    ratio = -forth / back  # d_j / d_i
    wild = used & ((ratio == 0) | np.isinf(ratio))
    beyond, used = np.append(i[wild], j[wild]), used & ~wild
    i = i[used]
    j = j[used]
    ratio = ratio[used]
    needed = np.where(free, np.sign(diagonal), 1.0)
    if not beyond.size and (ratio == 1).all() and (needed >= 0).all():
        return np.ones(n)
    with imports:
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import breadth_first_order, connected_components
    number, component = connected_components(
        coo_array((np.ones(i.size), (i, j)), shape=(n, n)), directed=False
    )
    root = np.zeros(number, dtype=np.intp)
    # The root of a component is a row whose sign is known, if there is one.
    for members in (np.arange(n), np.flatnonzero(needed)):
        root[component[members[::-1]]] = members[::-1]
    positions = np.concatenate((i, np.full(number, n))), np.concatenate((j, root))
    links = coo_array(
        (np.ones(positions[0].size), positions), shape=(n + 1, n + 1)
    ).tocsr()
    order, before = (each.astype(np.intp) for each in breadth_first_order(links, n))
    later = order[1:][before[order[1:]] < n]  # the factors of the roots are 1
    steps = ratio[np.searchsorted(i * n + j, before[later] * n + later)]
    factor = [1.0] * n
    for k, source, step in zip(
        later.tolist(), before[later].tolist(), steps.tolist(), strict=True
    ):
        factor[k] = factor[source] * step
    d = np.array(factor) * np.where(needed[root] < 0, -1.0, 1.0)[component]
    size = np.abs(d)
    d = np.where(np.abs(size - 1) <= EQUAL, np.sign(d), d)
    is_unfit = (
        (needed * d < 0) | (size > FARTHEST_FACTOR) | (size < 1 / FARTHEST_FACTOR)
    )
    is_unfit[
        np.append(i[np.abs(d[j] - ratio * d[i]) > EQUAL * np.abs(d[j])], beyond)
    ] = True
    unfit = mask_of(number, component[is_unfit])
    factors = np.ones(n)
    columns = system.columns
    factors[system.row_of[columns]] = np.where(unfit[component], 1.0, d)[columns]
    return factors


def _assign(system: ReducedProblem) -> None:
    """Assign equations to free variables, in order to make the matrix symmetric or
    skew-symmetric: an equation is assigned to a variable whose column has the same
    entries up to signs and a factor, or else entries in the same positions. Only the
    rows and columns that are assigned already are compared, at first those of variables
    with bounds.
    """
    is_assigned = ~system.free & (system.row_of >= 0)
    for _ in range(ASSIGNMENT_ROUNDS):
        raise_if_timed_out()
        for columns, rows in (
            _alike(system, is_assigned, of) for of in (np.abs, np.ones_like)
        ):
            if columns.size:
                system.pair(rows, columns)
                is_assigned[columns] = True
                break
        else:
            return


def _alike(
    system: ReducedProblem, is_assigned: Mask, of: Callable[[Vector], Vector]
) -> tuple[Indices, Indices]:
    """Return free columns and equations that agree in this function of their entries,
    and with no others.
    """
    n = system.n
    column_of = system.column_of
    weights = generator(0).random(system.n) + 0.5
    across = system.entries.part(is_assigned[system.entries.columns])
    down = system.entries.part(is_assigned[column_of[system.entries.rows]])
    of_rows = _keys(across.rows, of(across.values), weights[across.columns], n)
    of_columns = _keys(down.columns, of(down.values), weights[column_of[down.rows]], n)
    columns = np.flatnonzero(system.free & ~is_assigned)
    rows = system.row_of[columns]
    keys = np.concatenate((of_columns[columns], of_rows[rows]))
    order, group = np.argsort(keys, kind="stable"), np.zeros(keys.size, dtype=np.intp)
    group[order] = np.cumsum(np.diff(keys[order], prepend=0.0) > EQUAL * keys[order])
    one, other = group[: columns.size], group[columns.size :]
    alone = np.logical_and(
        *(np.bincount(each, minlength=keys.size + 1) == 1 for each in (one, other))
    )
    position = np.zeros(keys.size + 1, dtype=np.intp)
    position[other] = rows
    is_chosen = (keys[: columns.size] > 0) & alone[one]
    return columns[is_chosen], position[one[is_chosen]]


def _keys(lines: Indices, sizes: Vector, weights: Vector, n: int) -> Vector:
    """Return for each line the sum of random weights times its sizes relative to the
    largest, which is equal for equal lines; 0 for an empty line.
    """
    largest = np.zeros(n)
    np.maximum.at(largest, lines, sizes)
    return summed(lines, weights * sizes / largest[lines], n)
