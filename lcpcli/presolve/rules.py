"""The rules of presolve: each looks for its pattern in what is left of a mixed problem,
and removes what it can.

A rule takes a `System` and yields its steps; it raises Refuted where it sees that there
is no solution.

The signs of equations are chosen last: factors of rows, and an assignment of equations
to free variables, with which a matrix shows that it is monotone. The conditions of a
program have M = [Q -A'; A 0] with Q positive semidefinite, but equations may be written
with any sign and in any order, and rows of inequalities in other units than their
multipliers have. D M, with a diagonal D, positive for the rows of bounded variables,
has the same solutions; where the diagonal of M is 0, D M + M'D is positive semidefinite
only if d_i M_ij = -d_j M_ji, which determines D, a Volterra multiplier: R. Redheffer,
Volterra multipliers, SIAM J. Algebraic Discrete Methods 6 (1985) 592-611, 612-623.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.interrupts import check
from lcpcli.linalg.doubles import generator
from lcpcli.presolve.system import (
    Entries,
    Refuted,
    Step,
    System,
    are_integers,
    mask_of,
    summed,
)
from lcpcli.typing import Indices, Mask, Vector

# Relative to the terms of a row: what is called positive, or inside bounds, is far
# above rounding.
CLEAR = 1e-9
# Relative to the largest entry of its row, for a substitution that changes other
# entries.
STABLE_PIVOT = 0.1
FEW = 4  # entries of a column, or of a row, that substitution adds to others
SAME_HASH = 1e-12  # relative: the difference of hash values of multiples of each other


def fixed_variables(system: System) -> Iterator[Step]:
    """A variable whose bounds are equal has that value."""
    columns = np.flatnonzero((system.row_of >= 0) & (system.lower == system.upper))
    if columns.size:
        yield system.know(columns, system.lower[columns])


def rows_of_one_sign(system: System) -> Iterator[Step]:
    """A row that is positive, or negative, for all z within the bounds says at which
    bound its variable is."""
    places, of_entries, values = system.entries
    low, high, ranges = (
        system.lower[of_entries],
        system.upper[of_entries],
        list[Vector](),
    )
    # The least and the largest w, 0 where that may be rounding.
    for first, last in ((low, high), (high, low)):
        end = np.where(values > 0, first, last) * values
        w, size = (
            system.q + summed(places, end, system.n),
            system.terms + summed(places, np.abs(end), system.n),
        )
        ranges.append(np.where(np.isinf(size) | (np.abs(w) > CLEAR * size), w, 0.0))
    sign, columns = (
        np.where(ranges[0] > 0, 1.0, np.where(ranges[1] < 0, -1.0, 0.0)),
        system.columns,
    )
    columns = columns[sign[system.row_of[columns]] != 0]
    signs = sign[system.row_of[columns]]
    values = np.where(signs > 0, system.lower[columns], system.upper[columns])
    for at in np.flatnonzero(np.isinf(values))[:1].tolist():
        raise Refuted(system.n, system.row_of[columns[at]], -signs[at])
    if columns.size:
        yield system.know(columns, values)


def rows_of_their_own_variable(system: System) -> Iterator[Step]:
    """A row with a positive entry in the column of its own variable alone determines
    it."""
    entries, (rows, _) = system.entries, system.counts()
    own = entries.part(
        (system.row_of[entries.columns] == entries.rows) & (rows[entries.rows] == 1)
    )
    own = own.part((own.values > 0) & ~system.free[own.columns])
    if own.columns.size:
        z = -system.q[own.rows] / own.values
        yield system.know(
            own.columns,
            np.clip(z, system.lower[own.columns], system.upper[own.columns]),
        )


def rows_that_are_bounds(system: System) -> Iterator[Step]:
    """A row with a single entry whose multiplier is in the row of that variable alone
    is a bound of the variable.

    Models have x >= l so, with a multiplier of its own. An equation may be that row
    too, for a free variable, after a change of its sign: rows i with entries a z_j +
    q_i that are at least 0 where z_k is at its only bound (sign 1; or at most 0, sign
    -1), while z_k appears nowhere but as b z_k in the row r of z_j.
    """
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
    usable = (
        ((system.row_of[j] == r) & (a * b < 0) & ~free[j])
        | (free[j] & system.equations[r])
    ) & (j != k)
    # Where each of two rows is a bound of the other's variable.
    usable &= ~(mask_of(system.n, i[usable])[r] & (r < i))
    kept = np.flatnonzero(usable)
    for each in (j, r):
        kept = kept[np.unique(each[kept], return_index=True)[1]]
    if not kept.size:
        return
    i, k, j, r, a, b = (each[kept] for each in (i, k, j, r, a, b))
    lower_side = np.isfinite(system.lower[k])
    sign = np.where(lower_side, 1.0, -1.0)
    turned = r[free[j] & (a * b > 0)]
    if turned.size:
        factors = np.ones(system.n)
        factors[turned] = -1.0
        yield system.multiply(factors)
        b = np.where(mask_of(system.n, turned)[r], -b, b)
    at, from_below = -system.q[i] / a, sign * a > 0
    least, most, toward = (
        system.lower[j],
        system.upper[j],
        np.where(from_below, 1.0, -1.0),
    )
    near, far = np.where(from_below, (least, most), (most, least))
    beyond = toward * (at - far)
    margin = CLEAR * np.maximum(
        system.terms[i] / np.abs(a), np.where(np.isinf(far), 0.0, np.abs(far))
    )
    for crossed in np.flatnonzero(beyond > margin)[:1].tolist():
        raise Refuted(system.n, i[crossed], sign[crossed])
    system.keeps_all &= not (beyond > 0).any()
    at = np.where(beyond > 0, far, at)
    active = toward * (at - near) > 0
    system.lower[j] = np.where(active & from_below, at, least)
    system.upper[j] = np.where(active & ~from_below, at, most)
    own, entries = (
        np.where(lower_side, system.lower[k], system.upper[k]),
        system.entries,
    )
    in_rows = entries.part(
        mask_of(system.n, r)[entries.rows] & ~mask_of(system.n, k)[entries.columns]
    )
    in_columns = entries.part(
        mask_of(system.n, j)[entries.columns] & ~mask_of(system.n, i)[entries.rows]
    )
    q = system.q[r] + b * own
    fill = partial(_fill_multipliers, (j, k, r), (q, b, own, sign, active, at), in_rows)
    carry = partial(_carry_bounds, (i, j), (a, sign, active), in_columns)
    system.pair(r, j)
    system.q[r] = q
    system.terms[r] += np.abs(b * own)
    system.remove(k)
    yield Step(are_integers(at), fill, carry)


def _fill_multipliers(
    places: tuple[Any, ...], of_row: tuple[Any, ...], in_rows: Entries, z: Vector
) -> None:
    """Let z_k make w_j 0 where z_j is at the new bound and w_j has the sign for it."""
    (j, k, r), (q, b, own, sign, active, at) = places, of_row
    change = -(q + in_rows.times(z)[r]) / b
    z[k] = own + np.where(active & (z[j] == at) & (sign * change > 0), change, 0.0)


def _carry_bounds(
    places: tuple[Any, ...], of_row: tuple[Any, ...], in_columns: Entries, y: Vector
) -> None:
    """Let (M'y)_j be 0 where it has the sign with which the new bound counts."""
    (i, j), (a, sign, active) = places, of_row
    share = -in_columns.transposed_times(y)[j] / a
    y[i] = np.where(active & (sign * share > 0), share, 0.0)


def definitions_of_free_variables(system: System) -> Iterator[Step]:
    """An equation that defines a free variable, the only term of one other row and in
    no third one, is put into that row, as modelling languages write F >= 0: by powers
    of two and without sums, so that nothing is rounded."""
    entries, (in_row, in_column), equations = (
        system.entries,
        system.counts(),
        system.equations,
    )
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


def single_entries_of_free_variables(system: System) -> Iterator[Step]:
    """An equation that alone has a free variable determines it, after all others."""
    entries, (_, columns) = system.entries, system.counts()
    alone = (
        system.free[entries.columns]
        & (columns[entries.columns] == 1)
        & system.equations[entries.rows]
    )
    yield from _pivots(system, entries.part(alone))


def equations_of_one_variable(system: System) -> Iterator[Step]:
    """An equation with a single entry determines a variable; a bounded one, if it is
    inside its bounds."""
    entries, (rows, _) = system.entries, system.counts()
    alone = entries.part(system.equations[entries.rows] & (rows[entries.rows] == 1))
    z = -system.q[alone.rows] / alone.values
    margin = CLEAR * np.maximum(
        np.abs(z), system.terms[alone.rows] / np.abs(alone.values)
    )
    inside = (z > system.lower[alone.columns] + margin) & (
        z < system.upper[alone.columns] - margin
    )
    yield from _pivots(system, alone.part(inside))


def equations_of_two_variables(system: System) -> Iterator[Step]:
    """An equation of two variables is solved for a free one without a small entry that
    is in few rows; and the row of that variable is solved for the multiplier of the
    equation, as one without the other would hide monotonicity."""
    entries, (rows, columns), n = system.entries, system.counts(), system.n
    column_of = system.column_of
    short = np.flatnonzero((system.equations & (rows == 2))[entries.rows])
    first, second = (
        short[np.argsort(entries.rows[short], kind="stable")].reshape(-1, 2).T
    )
    place, other = np.concatenate((first, second)), np.concatenate((second, first))
    j, size = entries.columns[place], np.abs(entries.values)
    multiplier, row = column_of[entries.rows[place]], system.row_of[j]
    usable = (
        system.free[j]
        & (columns[j] <= FEW)
        & (size[place] >= STABLE_PIVOT * size[other])
    )
    there = entries.part(system.places(row, multiplier))
    is_entry = (there.rows == row) & (there.columns == multiplier)
    usable &= (columns[multiplier] == 2) & (rows[row] <= FEW) & is_entry
    usable &= (multiplier != j) & (multiplier != entries.columns[other])
    kept, used = list[int](), np.zeros(n, dtype=bool)
    for at in np.flatnonzero(usable).tolist():
        four = [j[at], entries.columns[other[at]], multiplier[at], column_of[row[at]]]
        if not used[four].any():
            used[four] = True
            kept.append(at)
    if kept:
        yield system.pivot(*entries.part(place[kept]))
        yield system.pivot(
            *system.entries.part(system.places(row[kept], multiplier[kept]))
        )


def repeated_equations(system: System) -> Iterator[Step]:
    """Equations that are multiples of others go, with as many free variables whose
    columns are multiples of others'."""
    equations, free = np.flatnonzero(system.equations), np.flatnonzero(system.free)
    rows, columns, values = system.entries
    again, first, factors = _multiples(rows, columns, values, equations, system.n)
    terms = system.terms[again] + np.abs(factors) * system.terms[first]
    difference = system.q[again] - factors * system.q[first]
    for at in np.flatnonzero(np.abs(difference) > CLEAR * terms)[:1].tolist():
        # The last counts, if a row without entries is both.
        y = np.array([-factors[at], 1.0])
        raise Refuted(system.n, [first[at], again[at]], y if difference[at] < 0 else -y)
    spare = (
        _multiples(columns, rows, values, free, system.n)[0] if again.size else again
    )
    number = min(again.size, spare.size)
    if number:
        q, exact = (
            factors * system.q[first],
            (np.rint(factors) == factors) | (system.q[first] == 0),
        )
        system.keeps_all &= bool((exact & (system.q[again] == q)).all())
        yield system.know(spare[:number], np.zeros(number), again[:number])


def _multiples(
    lines: Indices, at: Indices, values: Vector, among: Indices, n: int
) -> tuple[Indices, Indices, Vector]:
    """Return lines that are multiples of earlier ones, these, and the factors; empty
    lines are 0 times themselves."""
    used = mask_of(n, among)[lines]
    order = np.lexsort((at[used], lines[used]))
    lines, at, values = lines[used][order], at[used][order], values[used][order]
    found, begin, length = np.unique(lines, return_index=True, return_counts=True)
    pairs = [(line, line, 0.0) for line in np.setdiff1d(among, found).tolist()]
    if found.size:
        weights = generator(0).standard_normal(n)[at]
        keys = np.add.reduceat(
            values / np.repeat(values[begin], length) * weights, begin
        )
        order = np.lexsort((found, length, keys))
        near = np.abs(np.diff(keys[order])) <= SAME_HASH * np.abs(keys[order][1:])
        for before, after in zip(
            order[:-1][near].tolist(), order[1:][near].tolist(), strict=True
        ):
            one, two = (slice(begin[k], begin[k] + length[k]) for k in (before, after))
            crossed = values[one] * values[two][0], values[two] * values[one][0]
            if np.array_equal(at[one], at[two]) and np.array_equal(*crossed):
                pairs.append(
                    (
                        int(found[after]),
                        int(found[before]),
                        float(values[two][0] / values[one][0]),
                    )
                )
    again, first = (
        np.array([pair[k] for pair in pairs], dtype=np.intp) for k in (0, 1)
    )
    return again, first, np.array([pair[2] for pair in pairs])


def _pivots(system: System, found: Entries) -> Iterator[Step]:
    """Take entries that are alone in their rows, or in their columns, as pivots: one of
    each row and each column."""
    kept = np.unique(found.rows, return_index=True)[1]
    kept = kept[np.unique(found.columns[kept], return_index=True)[1]]
    if kept.size:
        yield system.pivot(found.rows[kept], found.columns[kept], found.values[kept])


Pairs = tuple[Indices, Indices, Vector, Vector]
# Between two factors of rows: more would cost the digits that it is to save.
FARTHEST_FACTOR = 1e8
# relative: how far rounding may have moved apart what is meant to be equal.
EQUAL = 1e-12
VOTING_ROUNDS = 10  # each for equations that share an entry with those of the last one
ASSIGNMENT_ROUNDS = 3  # each assigns equations by those that are assigned already


def signs_of_equations(system: System) -> Iterator[Step]:
    """Factors of rows make the matrix skew-symmetric where its diagonal is 0, as a
    monotone one is; entries that are equal to their mirror images, or opposite, but for
    rounding, become so exactly."""
    if not system.columns.size:
        return
    pairs = _pairs(system)
    check()
    i, _, forth, back = pairs
    # An entry of the column, or its row, has no image.
    unpaired = mask_of(system.n, i[(forth == 0) != (back == 0)])
    if (unpaired & system.free & (_diagonal(system) == 0)).any():
        _assign(system)
        pairs = _pairs(system)
    check()
    factors = _factors(system, pairs)
    if (factors != 1).any():
        yield system.multiply(factors)
        pairs = _pairs(system)
    check()
    i, j, forth, back = pairs
    sign = np.where(forth * back > 0, 1.0, -1.0)
    nearly = (
        (i < j)
        & (forth != sign * back)
        & (np.abs(forth - sign * back) <= EQUAL * np.abs(forth))
    )
    # Entries of the later row stay, as constraints often come later, and proofs consist
    # of these.
    if nearly.any():
        values = system.entries.values.copy()
        values[system.places(system.row_of[i[nearly]], j[nearly])] = (sign * back)[
            nearly
        ]
        system.entries, system.keeps_all = system.entries._replace(values=values), False


def _pairs(system: System) -> Pairs:
    """Return i, j, M_ij and M_ji for all i != j where one of the two entries is not 0,
    rows named like columns."""
    n, entries = (
        system.n,
        system.entries._replace(rows=system.column_of[system.entries.rows]),
    )
    off = entries.part(entries.rows != entries.columns)
    keys = np.concatenate((off.rows * n + off.columns, off.columns * n + off.rows))
    keys.sort()  # np.unique takes ten times as long
    keys = keys[np.diff(keys, prepend=-1) > 0]
    value = np.zeros(keys.size)
    value[np.searchsorted(keys, off.rows * n + off.columns)] = off.values
    i, j = keys // n, keys % n
    return i, j, value, value[np.searchsorted(keys, j * n + i)]


def _diagonal(system: System) -> Vector:
    entries, diagonal = system.entries, np.zeros(system.n)
    own = system.column_of[entries.rows] == entries.columns
    diagonal[entries.columns[own]] = entries.values[own]
    return diagonal


def _factors(system: System, pairs: Pairs) -> Vector:
    """Return the factor of each row; 1 in the connected parts of the matrix for which
    there are none."""
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
    number, part = connected_components(
        coo_array((np.ones(i.size), (i, j)), shape=(n, n)), directed=False
    )
    root = np.zeros(number, dtype=np.intp)
    # Where the sign is known, if it is anywhere.
    for members in (np.arange(n), np.flatnonzero(needed)):
        root[part[members[::-1]]] = members[::-1]
    places = np.concatenate((i, np.full(number, n))), np.concatenate((j, root))
    links = coo_array((np.ones(places[0].size), places), shape=(n + 1, n + 1)).tocsr()
    order, before = (each.astype(np.intp) for each in breadth_first_order(links, n))
    later = order[1:][before[order[1:]] < n]  # those of the roots are 1
    steps = ratio[np.searchsorted(i * n + j, before[later] * n + later)]
    factor = [1.0] * n
    for k, source, step in zip(
        later.tolist(), before[later].tolist(), steps.tolist(), strict=True
    ):
        factor[k] = factor[source] * step
    d = np.array(factor) * np.where(needed[root] < 0, -1.0, 1.0)[part]
    size = np.abs(d)
    d = np.where(np.abs(size - 1) <= EQUAL, np.sign(d), d)
    wrong = (needed * d < 0) | (size > FARTHEST_FACTOR) | (size < 1 / FARTHEST_FACTOR)
    wrong[np.append(i[np.abs(d[j] - ratio * d[i]) > EQUAL * np.abs(d[j])], beyond)] = (
        True
    )
    unfit, factors, columns = mask_of(number, part[wrong]), np.ones(n), system.columns
    if unfit.any():
        d = np.where(unfit[part], _votes(Entries(i, j, np.sign(ratio)), needed), d)
    factors[system.row_of[columns]] = d[columns]
    return factors


def _votes(ratios: Entries, needed: Vector) -> Vector:
    """Return signs that most of the ratios ask for, where they contradict each other:
    from variables whose sign is known to the others, a few steps away."""
    d, n = needed.copy(), needed.size
    for _ in range(VOTING_ROUNDS):
        votes = np.sign(summed(ratios.columns, ratios.values * d[ratios.rows], n))
        if not ((d == 0) & (votes != 0)).any():
            break
        d = np.where(needed == 0, np.where(d == 0, votes, d), d)
    return np.where(d == 0, 1.0, d)


def _assign(system: System) -> None:
    """Assign equations to free variables whose columns have the same entries, but for a
    factor and signs, or else entries in the same places, among variables whose rows are
    assigned already: at first, of those with bounds."""
    settled = ~system.free & (system.row_of >= 0)
    for _ in range(ASSIGNMENT_ROUNDS):
        check()
        for columns, rows in (
            _alike(system, settled, of) for of in (np.abs, np.ones_like)
        ):
            if columns.size:
                system.pair(rows, columns)
                settled[columns] = True
                break
        else:
            return


def _alike(
    system: System, settled: Mask, of: Callable[[Vector], Vector]
) -> tuple[Indices, Indices]:
    """Return free columns and equations that agree in this function of their entries,
    and with no others."""
    n, column_of, weights = (
        system.n,
        system.column_of,
        generator(0).random(system.n) + 0.5,
    )
    across = system.entries.part(settled[system.entries.columns])
    down = system.entries.part(settled[column_of[system.entries.rows]])
    of_rows = _keys(across.rows, of(across.values), weights[across.columns], n)
    of_columns = _keys(down.columns, of(down.values), weights[column_of[down.rows]], n)
    columns = np.flatnonzero(system.free & ~settled)
    rows = system.row_of[columns]
    keys = np.concatenate((of_columns[columns], of_rows[rows]))
    order, group = np.argsort(keys, kind="stable"), np.zeros(keys.size, dtype=np.intp)
    group[order] = np.cumsum(np.diff(keys[order], prepend=0.0) > EQUAL * keys[order])
    one, other = group[: columns.size], group[columns.size :]
    alone = np.logical_and(
        *(np.bincount(each, minlength=keys.size + 1) == 1 for each in (one, other))
    )
    place = np.zeros(keys.size + 1, dtype=np.intp)
    place[other] = rows
    chosen = (keys[: columns.size] > 0) & alone[one]
    return columns[chosen], place[one[chosen]]


def _keys(lines: Indices, sizes: Vector, weights: Vector, n: int) -> Vector:
    """Return for each line the sum of its weights times its sizes relative to the
    largest; 0 for an empty line."""
    largest = np.zeros(n)
    np.maximum.at(largest, lines, sizes)
    return summed(lines, weights * sizes / largest[lines], n)
