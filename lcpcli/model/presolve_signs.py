"""Factors of rows, and an assignment of equations to free variables, with which a matrix shows that it is monotone.

The conditions of a program have M = [Q -A'; A 0] with Q positive semidefinite. Equations may be written with any sign
and in any order, and rows of inequalities in other units than their multipliers have: M then has none of the properties
that methods ask for. D M, with a diagonal D, positive for the rows of bounded variables, has the same solutions; where
the diagonal of M is 0, D M + M'D is positive semidefinite only if d_i M_ij = -d_j M_ji, which determines D. Such a D is
known from stability theory as a Volterra multiplier: R. Redheffer, Volterra multipliers, SIAM J. Algebraic Discrete
Methods 6 (1985) 592-611, 612-623.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from lcpcli.clock import imports
from lcpcli.interrupts import check
from lcpcli.linalg.doubles import generator
from lcpcli.model.presolve_system import Entries, Step, System, mask_of, summed
from lcpcli.typing import Indices, Mask, Vector

Pairs = tuple[Indices, Indices, Vector, Vector]

FARTHEST_FACTOR = 1e8  # between two factors of rows: more would cost the digits that it is to save
EQUAL = 1e-12  # relative: how far rounding may have moved apart what is meant to be equal
VOTING_ROUNDS = 10  # each for equations that share an entry with those of the last one
ASSIGNMENT_ROUNDS = 3  # each assigns equations by those that are assigned already


def signs_of_equations(system: System) -> Iterator[Step]:
    """Factors of rows make the matrix skew-symmetric where its diagonal is 0, as a monotone one is."""
    if not system.columns.size:
        return
    pairs = _pairs(system)
    check()
    if _conflicts(system, pairs).any():
        _assign(system)
        pairs = _pairs(system)
    check()
    factors = _factors(system, pairs)
    if (factors != 1).any():
        yield system.multiply(factors)
        pairs = _pairs(system)
    check()
    _mirror(system, pairs)


def _by_columns(system: System) -> Entries:
    """Return the entries with each row named like the column that it belongs to."""
    return system.entries._replace(rows=system.column_of[system.entries.rows])


def _pairs(system: System) -> Pairs:
    """Return i, j, M_ij and M_ji for all i != j where one of the two entries is not 0, rows named like columns."""
    n, entries = system.n, _by_columns(system)
    off = entries.part(entries.rows != entries.columns)
    keys = np.concatenate((off.rows * n + off.columns, off.columns * n + off.rows))
    keys.sort()  # np.unique takes ten times as long
    keys = keys[np.diff(keys, prepend=-1) > 0]
    value = np.zeros(keys.size)
    value[np.searchsorted(keys, off.rows * n + off.columns)] = off.values
    i, j = keys // n, keys % n
    return i, j, value, value[np.searchsorted(keys, j * n + i)]


def _diagonal(system: System) -> Vector:
    entries, diagonal = _by_columns(system), np.zeros(system.n)
    own = entries.rows == entries.columns
    diagonal[entries.rows[own]] = entries.values[own]
    return diagonal


def _conflicts(system: System, pairs: Pairs) -> Mask:
    """Return the free columns without a diagonal entry that have an entry without a mirror image, or their row has."""
    i, _, forth, back = pairs
    found: Mask = mask_of(system.n, i[(forth == 0) != (back == 0)]) & system.free & (_diagonal(system) == 0)
    return found


def _factors(system: System, pairs: Pairs) -> Vector:
    """Return the factor of each row; 1 in the connected parts of the matrix for which there are none."""
    n, free, diagonal = system.n, system.free, _diagonal(system)
    i, j, forth, back = pairs
    used = (forth != 0) & (back != 0) & ((diagonal[i] == 0) | (diagonal[j] == 0))
    ratio = -forth / back  # d_j / d_i
    wild = used & ((ratio == 0) | np.isinf(ratio))
    beyond, used = np.append(i[wild], j[wild]), used & ~wild
    i, j, ratio = i[used], j[used], ratio[used]
    needed = np.where(free, np.sign(diagonal), 1.0)
    if not beyond.size and (ratio == 1).all() and (needed >= 0).all():
        return np.ones(n)
    with imports:
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import breadth_first_order, connected_components
    number, part = connected_components(coo_array((np.ones(i.size), (i, j)), shape=(n, n)), directed=False)
    root = np.zeros(number, dtype=np.intp)
    for members in (np.arange(n), np.flatnonzero(needed)):  # where the sign is known, if it is anywhere
        root[part[members[::-1]]] = members[::-1]
    places = np.concatenate((i, np.full(number, n))), np.concatenate((j, root))
    links = coo_array((np.ones(places[0].size), places), shape=(n + 1, n + 1)).tocsr()
    order, before = (each.astype(np.intp) for each in breadth_first_order(links, n))
    later = order[1:][before[order[1:]] < n]  # those of the roots are 1
    steps = ratio[np.searchsorted(i * n + j, before[later] * n + later)]
    factor = [1.0] * n
    for k, source, step in zip(later.tolist(), before[later].tolist(), steps.tolist(), strict=True):
        factor[k] = factor[source] * step
    d = np.array(factor) * np.where(needed[root] < 0, -1.0, 1.0)[part]
    size = np.abs(d)
    d = np.where(np.abs(size - 1) <= EQUAL, np.sign(d), d)
    unfit = np.zeros(number, dtype=bool)
    unfit[part[(needed * d < 0) | (size > FARTHEST_FACTOR) | (size < 1 / FARTHEST_FACTOR)]] = True
    unfit[part[i[np.abs(d[j] - ratio * d[i]) > EQUAL * np.abs(d[j])]]] = True
    unfit[part[beyond]] = True
    factors, columns = np.ones(n), system.columns
    if unfit.any():
        d = np.where(unfit[part], _votes(Entries(i, j, np.sign(ratio)), needed), d)
    factors[system.row_of[columns]] = d[columns]
    return factors


def _votes(ratios: Entries, needed: Vector) -> Vector:
    """Return signs that most of the ratios ask for, where they contradict each other: from variables whose sign is
    known to the others, a few steps away."""
    d, n = needed.copy(), needed.size
    for _ in range(VOTING_ROUNDS):
        votes = np.sign(summed(ratios.columns, ratios.values * d[ratios.rows], n))
        if not ((d == 0) & (votes != 0)).any():
            break
        d = np.where(needed == 0, np.where(d == 0, votes, d), d)
    return np.where(d == 0, 1.0, d)


def _mirror(system: System, pairs: Pairs) -> None:
    """Let entries that are equal to their mirror images, or opposite, but for rounding, be so exactly; those of the
    later row stay, as constraints often come later, and proofs consist of their multipliers."""
    i, j, forth, back = pairs
    sign = np.where(forth * back > 0, 1.0, -1.0)
    nearly = (i < j) & (forth != sign * back) & (np.abs(forth - sign * back) <= EQUAL * np.abs(forth))
    if nearly.any():
        entries, n = system.entries, system.n
        keys = entries.rows * n + entries.columns
        order = np.argsort(keys)
        place = order[np.searchsorted(keys[order], system.row_of[i[nearly]] * n + j[nearly])]
        values = entries.values.copy()
        values[place] = (sign * back)[nearly]
        system.entries, system.keeps_all = entries._replace(values=values), False


def _assign(system: System) -> None:
    """Assign equations to free variables whose columns have the same entries, but for a factor and signs, or else
    entries in the same places, among variables whose rows are assigned already: at first, of those with bounds."""
    settled = ~system.free & (system.row_of >= 0)
    for _ in range(ASSIGNMENT_ROUNDS):
        check()
        pairs = next(filter(None, (_alike(system, settled, of) for of in (np.abs, np.ones_like))), None)
        if pairs is None:
            return
        columns, rows = (np.array(each) for each in zip(*pairs, strict=True))
        system.give(columns, rows)
        settled[columns] = True


def _alike(system: System, settled: Mask, of: Callable[[Vector], Vector]) -> list[tuple[int, int]]:
    """Return free columns and equations that agree in this function of their entries, and with no others."""
    n, column_of, weights = system.n, system.column_of, generator(0).random(system.n) + 0.5
    across = system.entries.part(settled[system.entries.columns])
    down = system.entries.part(settled[column_of[system.entries.rows]])
    of_rows = _keys(across.rows, of(across.values), weights[across.columns], n)
    of_columns = _keys(down.columns, of(down.values), weights[column_of[down.rows]], n)
    columns = np.flatnonzero(system.free & ~settled)
    return _equal_keys(of_columns, columns, of_rows, system.row_of[columns])


def _keys(lines: Indices, sizes: Vector, weights: Vector, n: int) -> Vector:
    """Return for each line the sum of its weights times its sizes relative to the largest; 0 for an empty line."""
    largest = np.zeros(n)
    np.maximum.at(largest, lines, sizes)
    return summed(lines, weights * sizes / largest[lines], n)


def _equal_keys(first: Vector, some: Indices, second: Vector, others: Indices) -> list[tuple[int, int]]:
    """Return pairs of the indices of two kinds with equal keys that are not 0, and belong to no others."""
    keys = np.concatenate((first[some], second[others]))
    order = np.argsort(keys, kind="stable")
    group = np.zeros(keys.size, dtype=np.intp)
    group[order] = np.cumsum(np.diff(keys[order], prepend=0.0) > EQUAL * keys[order])
    of_some, of_others = group[: some.size], group[some.size :]
    counts = (np.bincount(each, minlength=keys.size + 1) for each in (of_some, of_others))
    alone = np.logical_and(*(count == 1 for count in counts))
    place = dict(zip(of_others.tolist(), others.tolist(), strict=True))
    chosen = np.flatnonzero((keys[: some.size] > 0) & alone[of_some])
    return [(int(some[at]), place[int(of_some[at])]) for at in chosen]
