"""The rules of presolve: each looks for its pattern in what is left of a mixed problem, and removes what it can.

A rule takes a `System` and yields its steps; it raises Contradiction where it sees that there is no solution.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lcpcli.linalg.doubles import generator
from lcpcli.model.presolve_system import Bounds, Contradiction, Entries, Step, System, mask_of, summed
from lcpcli.typing import Indices, Vector

CLEAR = 1e-9  # relative to the terms of a row: what is called positive, or inside bounds, is far above rounding
STABLE_PIVOT = 0.1  # relative to the largest entry of its row, for a substitution that changes other entries
FEW = 4  # entries of a column, or of a row, that substitution adds to others
EQUAL = 1e-12  # relative: the difference of hash values of multiples of each other


def fixed_variables(system: System) -> Iterator[Step]:
    """A variable whose bounds are equal has that value."""
    columns = system.columns
    columns = columns[system.lower[columns] == system.upper[columns]]
    if columns.size:
        yield system.know(columns, system.lower[columns])


def rows_of_one_sign(system: System) -> Iterator[Step]:
    """A row that is positive, or negative, for all z within the bounds says at which bound its variable is."""
    least, most = _ranges(system)
    sign, columns = np.where(least > 0, 1.0, np.where(most < 0, -1.0, 0.0)), system.columns
    signs = sign[system.row_of[columns]]
    columns, signs = columns[signs != 0], signs[signs != 0]
    values = np.where(signs > 0, system.lower[columns], system.upper[columns])
    impossible = np.flatnonzero(np.isinf(values))
    if impossible.size:
        y = np.zeros(system.n)
        y[system.row_of[columns[impossible[0]]]] = -signs[impossible[0]]
        raise Contradiction(y)
    if columns.size:
        yield system.know(columns, values)


def rows_of_their_own_variable(system: System) -> Iterator[Step]:
    """A row with a positive entry in the column of its own variable alone determines it."""
    entries, (rows, _) = system.entries, system.counts()
    own = entries.part((system.row_of[entries.columns] == entries.rows) & (rows[entries.rows] == 1))
    own = own.part((own.values > 0) & ~system.free[own.columns])
    if own.columns.size:
        z = -system.q[own.rows] / own.values
        yield system.know(own.columns, np.clip(z, system.lower[own.columns], system.upper[own.columns]))


def rows_that_are_bounds(system: System) -> Iterator[Step]:
    """A row with a single entry whose multiplier is in the row of that variable alone is a bound of the variable.

    Models have x >= l so, with a multiplier of its own. An equation may be that row too, for a free variable, after a
    change of its sign.
    """
    found = _bound_rows(system)
    i, k, j, r, a, b = found
    if not i.size:
        return
    lower_side = np.isfinite(system.lower[k])
    sign = np.where(lower_side, 1.0, -1.0)
    turned = r[system.free[j] & (a * b > 0)]
    if turned.size:
        factors = np.ones(system.n)
        factors[turned] = -1.0
        yield system.multiply(factors)
        b = np.where(mask_of(system.n, turned)[r], -b, b)
    at, from_below = -system.q[i] / a, sign * a > 0
    least, most = system.lower[j], system.upper[j]
    beyond = np.where(from_below, at - most, least - at)
    end = np.where(from_below, np.abs(most), np.abs(least))
    margin = CLEAR * np.maximum(system.terms[i] / np.abs(a), np.where(np.isinf(end), 0.0, end))
    crossed = np.flatnonzero(beyond > margin)
    if crossed.size:
        y = np.zeros(system.n)
        y[i[crossed[0]]] = sign[crossed[0]]
        raise Contradiction(y)
    system.keeps_all &= not (beyond > 0).any()
    at = np.where(beyond > 0, np.where(from_below, most, least), at)
    active = np.where(from_below, at > least, at < most)
    lower, upper = system.lower.copy(), system.upper.copy()
    lower[j] = np.where(active & from_below, at, least)
    upper[j] = np.where(active & ~from_below, at, most)
    own, entries = np.where(lower_side, system.lower[k], system.upper[k]), system.entries
    in_rows = entries.part(mask_of(system.n, r)[entries.rows] & ~mask_of(system.n, k)[entries.columns])
    in_columns = entries.part(mask_of(system.n, j)[entries.columns] & ~mask_of(system.n, i)[entries.rows])
    q = system.q[r] + b * own
    yield system.bound(Bounds(i, k, j, r, a, b, sign, own, active, at, q, in_rows, in_columns), lower, upper)


def _bound_rows(system: System) -> tuple[Indices, Indices, Indices, Indices, Vector, Vector]:
    """Return rows i and their columns k, the columns j and rows r of their single entries, and these entries."""
    entries, (in_row, in_column) = system.entries, system.counts()
    column_of, free = system.column_of, system.free
    one_sided = np.isfinite(system.lower) != np.isfinite(system.upper)
    of_row, of_column = np.zeros((2, system.n), dtype=np.intp)
    of_row[entries.rows] = of_column[entries.columns] = np.arange(entries.rows.size)
    i = np.flatnonzero((in_row == 1) & (column_of >= 0))
    i = i[one_sided[column_of[i]] & (in_column[column_of[i]] == 1)]
    k = column_of[i]
    j, r = entries.columns[of_row[i]], entries.rows[of_column[k]]
    a, b = entries.values[of_row[i]], entries.values[of_column[k]]
    opposite = (system.row_of[j] == r) & (a * b < 0) & ~free[j]
    usable = (opposite | (free[j] & system.equations[r])) & (j != k)
    usable &= ~(mask_of(system.n, i[usable])[r] & (r < i))  # where each of two rows is a bound of the other's variable
    kept = np.flatnonzero(usable)
    for each in (j, r):
        kept = kept[np.unique(each[kept], return_index=True)[1]]
    return i[kept], k[kept], j[kept], r[kept], a[kept], b[kept]


def definitions_of_free_variables(system: System) -> Iterator[Step]:
    """An equation that defines a free variable, the only term of one other row and in no third one, is put into that
    row, as modelling languages write F >= 0: by powers of two and without sums, so that nothing is rounded."""
    entries, (in_row, in_column), equations = system.entries, system.counts(), system.equations
    twice = np.flatnonzero(
        (system.free & (in_column == 2))[entries.columns] & (np.frexp(np.abs(entries.values))[0] == 0.5)
    )
    twice = twice[np.argsort(entries.columns[twice], kind="stable")]
    columns = entries.columns[twice]
    is_pair = np.flatnonzero(columns[1:] == columns[:-1])
    first, second = twice[is_pair], twice[is_pair + 1]
    swapped = equations[entries.rows[second]] & ~equations[entries.rows[first]]
    definition, use = np.where(swapped, second, first), np.where(swapped, first, second)
    rows, used = entries.rows[definition], entries.rows[use]
    usable = equations[rows] & ~equations[used] & (in_row[used] == 1) & ((system.q[rows] == 0) | (system.q[used] == 0))
    yield from _pivots(system, entries.part(definition[usable]))


def single_entries_of_free_variables(system: System) -> Iterator[Step]:
    """An equation that alone has a free variable determines it, after all others."""
    entries, (_, columns) = system.entries, system.counts()
    alone = entries.part(system.free[entries.columns] & (columns[entries.columns] == 1))
    alone = alone.part(system.equations[alone.rows])
    yield from _pivots(system, alone)


def equations_of_one_variable(system: System) -> Iterator[Step]:
    """An equation with a single entry determines a variable; a bounded one, if it is inside its bounds."""
    entries, (rows, _) = system.entries, system.counts()
    alone = entries.part(system.equations[entries.rows] & (rows[entries.rows] == 1))
    z = -system.q[alone.rows] / alone.values
    margin = CLEAR * np.maximum(np.abs(z), system.terms[alone.rows] / np.abs(alone.values))
    j = alone.columns
    alone = alone.part((z > system.lower[j] + margin) & (z < system.upper[j] - margin))
    yield from _pivots(system, alone)


def equations_of_two_variables(system: System) -> Iterator[Step]:
    """An equation of two variables is solved for a free one without a small entry that is in few rows; and the row of
    that variable is solved for the multiplier of the equation, as one without the other would hide monotonicity."""
    entries, (rows, columns), n = system.entries, system.counts(), system.n
    column_of = system.column_of
    keys = entries.rows * n + entries.columns
    short = np.flatnonzero((system.equations & (rows == 2))[entries.rows])
    first, second = short[np.argsort(entries.rows[short], kind="stable")].reshape(-1, 2).T
    place, other = np.concatenate((first, second)), np.concatenate((second, first))
    j, size = entries.columns[place], np.abs(entries.values)
    multiplier, row = column_of[entries.rows[place]], system.row_of[j]
    usable = system.free[j] & (columns[j] <= FEW) & (size[place] >= STABLE_PIVOT * size[other])
    ordered, sought = np.sort(keys), row * n + multiplier
    is_entry = ordered.take(np.searchsorted(ordered, sought), mode="clip") == sought
    usable &= (columns[multiplier] == 2) & (rows[row] <= FEW) & is_entry
    usable &= (multiplier != j) & (multiplier != entries.columns[other])
    kept, used = list[int](), np.zeros(n, dtype=bool)
    for at in np.flatnonzero(usable).tolist():
        four = [j[at], entries.columns[other[at]], multiplier[at], column_of[row[at]]]
        if not used[four].any():
            used[four] = True
            kept.append(at)
    if kept:
        pivots = entries.part(place[kept])
        yield system.pivot(*pivots)
        entries = system.entries
        keys = entries.rows * n + entries.columns
        order = np.argsort(keys)
        yield system.pivot(*entries.part(order[np.searchsorted(keys[order], row[kept] * n + multiplier[kept])]))


def repeated_equations(system: System) -> Iterator[Step]:
    """Equations that are multiples of others go, with as many free variables whose columns are multiples of others'."""
    equations, free = np.flatnonzero(system.equations), np.flatnonzero(system.free)
    rows, columns, values = system.entries
    again, first, factors = _multiples(rows, columns, values, equations, system.n)
    terms = system.terms[again] + np.abs(factors) * system.terms[first]
    differ = np.flatnonzero(np.abs(system.q[again] - factors * system.q[first]) > CLEAR * terms)
    if differ.size:
        y, at = np.zeros(system.n), differ[0]
        y[first[at]] = -factors[at]
        y[again[at]] = 1.0  # the same row, if it has no entries
        raise Contradiction(y if system.q[again[at]] < factors[at] * system.q[first[at]] else -y)
    if not again.size:
        return
    spare = _multiples(columns, rows, values, free, system.n)[0]
    number = min(again.size, spare.size)
    if number:
        q, exact = factors * system.q[first], (np.rint(factors) == factors) | (system.q[first] == 0)
        system.keeps_all &= bool((exact & (system.q[again] == q)).all())
        yield system.know(spare[:number], np.zeros(number), again[:number])


def _multiples(
    lines: Indices, places: Indices, values: Vector, among: Indices, n: int
) -> tuple[Indices, Indices, Vector]:
    """Return the lines among some that are multiples of earlier ones, the earlier ones, and the factors; lines without
    entries are 0 times themselves."""
    used = mask_of(n, among)[lines]
    order = np.lexsort((places[used], lines[used]))
    lines, places, values = lines[used][order], places[used][order], values[used][order]
    found, begin, length = np.unique(lines, return_index=True, return_counts=True)
    pairs = [(line, line, 0.0) for line in np.flatnonzero(mask_of(n, among) & ~mask_of(n, found)).tolist()]
    if found.size:
        weights = generator(0).standard_normal(n)[places]
        keys = np.add.reduceat(values / np.repeat(values[begin], length) * weights, begin)
        order = np.lexsort((found, length, keys))
        near = np.abs(np.diff(keys[order])) <= EQUAL * np.abs(keys[order][1:])
        for before, after in zip(order[:-1][near].tolist(), order[1:][near].tolist(), strict=True):
            one, two = (slice(begin[at], begin[at] + length[at]) for at in (before, after))
            crossed = values[one] * values[two][0], values[two] * values[one][0]
            if np.array_equal(places[one], places[two]) and np.array_equal(*crossed):
                pairs.append((int(found[after]), int(found[before]), float(values[two][0] / values[one][0])))
    again, first = (np.array([pair[at] for pair in pairs], dtype=np.intp) for at in (0, 1))
    return again, first, np.array([pair[2] for pair in pairs])


def _pivots(system: System, found: Entries) -> Iterator[Step]:
    """Take entries that are alone in their rows, or in their columns, as pivots: one of each row and each column."""
    kept = np.unique(found.rows, return_index=True)[1]
    kept = kept[np.unique(found.columns[kept], return_index=True)[1]]
    if kept.size:
        yield system.pivot(found.rows[kept], found.columns[kept], found.values[kept])


def _ranges(system: System) -> tuple[Vector, Vector]:
    """Return the least and the largest w of each row for z within the bounds, 0 where that may be rounding."""
    rows, columns, values = system.entries
    low, high = system.lower[columns], system.upper[columns]
    ends = np.where(values > 0, low, high) * values, np.where(values > 0, high, low) * values
    found = []
    for end in ends:
        w = system.q + summed(rows, end, system.n)
        size = system.terms + summed(rows, np.abs(end), system.n)
        found.append(np.where(np.isinf(size) | (np.abs(w) > CLEAR * size), w, 0.0))
    return found[0], found[1]
