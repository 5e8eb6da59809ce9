"""Systems of linear equations and inequalities in exact arithmetic: dictionaries of
integers, and the simplex method.

A dictionary (V. Chvátal, Linear Programming, Freeman 1983) expresses some affine
functions of the unknowns, the basic forms, in terms of others, the cobasic ones.
Divisions leave no remainder (J. Edmonds, Systems of distinct representatives and linear
algebra, Journal of Research of the National Bureau of Standards 71B (1967) 241-245),
and ties are broken by the rule of R. G. Bland, New finite pivoting rules for the
simplex method, Mathematics of Operations Research 2 (1977) 103-107. A row whose
constant and coefficients have one sign proves that its form is not 0 on the polyhedron
(Farkas).

The vertices of a polyhedron are those of its feasible bases, which `bases` traverses.
Ties are broken lexicographically, as if each form that is basic at the start were
relaxed by a small amount, much smaller for each later form: then every vertex is
simple, and the graph of vertices and edges, which is connected, is traversed completely
once no edge leads to a new vertex. (D. Avis, A revised implementation of the reverse
search vertex enumeration algorithm, in: Polytopes - Combinatorics and Computation,
Birkhäuser 2000, uses the same pivots; here the bases are stored, so that each is
visited once.) The lexicographic minimum ratio test is described by R. W. Cottle, J.-S.
Pang and R. E. Stone, The Linear Complementarity Problem, SIAM (2009), section 4.9.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from fractions import Fraction
from itertools import product

from lcpcli.interrupts import in_time
from lcpcli.linalg.patterns import connected
from lcpcli.rational.elimination import clear, library
from lcpcli.rational.numbers import primitive

# Columns from which the time limit is also checked within a pivot, as a pivot with
# thousands of columns takes seconds.
LONG_ROW = 500
# Bits that numbers may reach from which FLINT's integers, if it is installed, are
# faster.
LONG_BITS = 200

RationalPoint = tuple[Fraction, ...]
Direction = tuple[int, ...]


class Dictionary:
    """A dictionary: the point where all cobasic forms are 0, in the polyhedron where
    all signed forms are nonnegative.

    rows : for each basic form its constant and its coefficients of the cobasic forms,
        all multiplied by `divisor` > 0.
    cobasic : the form of each column but the constant. Forms that are neither basic nor
        cobasic are 0 on the whole polyhedron.
    signed : the forms that are required to be nonnegative; others may have any sign.
    check : called before each pivot; it may raise.
    """

    def __init__(
        self,
        rows: dict[int, list[int]],
        cobasic: list[int],
        signed: Iterable[int],
        check: Callable[[], None],
    ) -> None:
        self.rows = rows
        self.cobasic = cobasic
        self.signed = set(signed)
        self.divisor = 1
        self.check = check
        longest = max(
            (abs(value).bit_length() for row in rows.values() for value in row),
            default=0,
        )
        if longest * len(cobasic) > LONG_BITS and (flint := library()):
            self.rows = {
                form: [flint.fmpz(value) for value in row]
                for form, row in in_time(rows.items())
            }

    def copy(self) -> Dictionary:
        """Return a copy whose pivots do not affect this one; rows are replaced by
        pivots, never changed, so that they are shared."""
        other = Dictionary.__new__(Dictionary)
        other.__dict__.update(self.__dict__)
        other.rows = dict(self.rows)
        other.cobasic = list(self.cobasic)
        other.signed = set(self.signed)
        return other

    def value(self, form: int) -> int:
        """Return the value of a form at the point, multiplied by `divisor`."""
        row = self.rows.get(form)
        return int(row[0]) if row is not None else 0

    def nonzero(self) -> int:
        """Return the forms that are not 0 at the point, as a bit mask."""
        return sum(1 << form for form, row in self.rows.items() if row[0])

    def vanish(self, form: int) -> bool:
        """Restrict the polyhedron to form = 0; return False if that proves it to be
        empty.
        """
        if form in self.rows and not self._reach_zero(form):
            return False
        self._drop(form)
        return True

    def require(self, form: int) -> bool:
        """Restrict the polyhedron to form >= 0; return False if that proves it to be
        empty.
        """
        if self.value(form) < 0 and not self._reach_zero(form):
            return False
        self.signed.add(form)
        return True

    def negate(self, form: int) -> None:
        """Replace a form that is not signed by its negative."""
        if form in self.rows:
            self.rows[form] = [-value for value in self.rows[form]]
        elif form in self.cobasic:
            k = self.cobasic.index(form) + 1
            self.rows = {
                basic: [*row[:k], -row[k], *row[k + 1 :]]
                for basic, row in self.rows.items()
            }

    def is_zero(self, form: int) -> bool:
        """Return whether the form is 0 on the whole polyhedron; pivots may move the
        point.
        """
        if self.value(form) or self.can_have_sign(form, 1):
            return False
        return form in self.signed or not self.can_have_sign(form, -1)

    def can_have_sign(self, form: int, sign: int) -> bool:
        """Return whether the form is positive (sign 1), or negative (-1), somewhere on
        the polyhedron; pivots may move the point.
        """
        bland = False
        while True:
            row = self.rows.get(form)
            if row is not None:
                if sign * row[0] > 0:
                    return True
                move = self._entering(row, sign, bland)
            elif form not in self.cobasic or (sign < 0 and form in self.signed):
                return False
            else:
                move = self.cobasic.index(form) + 1, sign
            if move is None:
                return False
            leaving, step = self.leaving(*move)
            if leaving is None or (step and (row is None or not row[0])):
                return True
            bland = not step
            self.pivot(leaving, move[0])

    def minimize(self, form: int) -> bool:
        """Move to a point where a basic form that is not signed is minimal; return
        False if it has no lower bound.
        """
        bland = False
        while (move := self._entering(self.rows[form], -1, bland)) is not None:
            leaving, value = self.leaving(*move)
            if leaving is None:
                return False
            bland = not value
            self.pivot(leaving, move[0])
        return True

    def restrict(self, objective: int, zero: int, signed: Iterable[int]) -> bool:
        """Restrict the polyhedron to where the form `zero` is 0 and the forms `signed`
        are nonnegative, and move from the minimizer of `objective` to the new one by
        the dual simplex method; return False if the restricted polyhedron is empty.

        Each pivot is the one that increases the objective most. C. E. Lemke, The dual
        method of solving the linear programming problem, Naval Research Logistics
        Quarterly 1 (1954) 36-47.
        """
        self.signed.update(signed)
        row = self.rows.get(zero, [0])
        if any(row):
            sign = 1 if (-row[0] or next(filter(None, row))) > 0 else -1
            move = self._entering(row, sign, False, objective)
            if move is None:
                return False
            self.pivot(zero, move[0])
        self._drop(zero)
        bland = False
        while below := [
            form
            for form, row in self.rows.items()
            if row[0] < 0 and form in self.signed
        ]:
            leaving = -1
            rise = -1
            fall = 1
            for form in sorted(below):
                row = self.rows[form]
                move = self._entering(row, 1, bland, objective)
                if move is None:
                    return False
                k = move[0]
                objective_change = -self.rows[objective][k] * row[0]
                if leaving < 0 or (
                    objective_change * fall > rise * abs(row[k]) and not bland
                ):
                    leaving = form
                    column = k
                    rise = objective_change
                    fall = abs(row[k])
            bland = not rise
            self.pivot(leaving, column)
        return True

    def nearest(self, k: int, direction: int = 1) -> list[int]:
        """Return the signed forms that reach 0 first as the form of column k, counted
        from 1, increases (direction 1) or decreases (-1).
        """
        falling = [
            form
            for form, row in self.rows.items()
            if direction * row[k] < 0 and form in self.signed
        ]
        return self._smallest_ratios(falling, 0, k, 1)

    def leaving(self, k: int, direction: int) -> tuple[int | None, int]:
        """Return the first form to reach 0, by Bland's rule, and its value; None if no
        form does.
        """
        form = min(self.nearest(k, direction), default=None)
        return form, 0 if form is None else self.rows[form][0]

    def lexicographic(
        self, tied: list[int], k: int, order: Iterable[int], less: Collection[int] = ()
    ) -> int | None:
        """Return, of tied forms, the one that would reach 0 first if the forms in
        `order` were relaxed by small amounts, or tightened if they are among `less`, by
        much smaller amounts for later ones; None if no form is tied.
        """
        if len(tied) > 1:
            columns = {form: j for j, form in enumerate(self.cobasic, 1)}
            for relaxed in order:
                if relaxed in columns:
                    tied = self._smallest_ratios(
                        tied, columns[relaxed], k, 1 if relaxed in less else -1
                    )
                elif relaxed in tied and relaxed in less:
                    return relaxed
                elif relaxed in tied:
                    tied.remove(relaxed)
                if len(tied) == 1:
                    break
        return tied[0] if tied else None

    def direction(self, k: int, forms: Iterable[int]) -> list[int]:
        """Return how forms change as the form of column k increases, in integers
        without a common divisor.
        """
        column = {form: row[k] for form, row in self.rows.items()} | {
            self.cobasic[k - 1]: self.divisor
        }
        return primitive([column.get(form, 0) for form in forms])

    def pivot(self, leaving: int, k: int) -> None:
        """Pivot: swap a basic form and the cobasic form of column k, counted from 1."""
        self.check()
        top = self.rows.pop(leaving)
        old = self.divisor
        sign = 1
        if top[k] < 0:
            top, sign = [-value for value in top], -1
        new = top[k]
        rows = {}
        before = self.rows.items()
        for form, row in before if len(top) < LONG_ROW else in_time(before):
            if row[k]:
                changed = clear(row, top, k, old)
                changed[k] = sign * row[k]
            else:
                changed = row if new == old else [new * a // old for a in row]
            rows[form] = changed
        entered = [-value for value in top]
        entered[k] = sign * old
        rows[self.cobasic[k - 1]] = entered
        self.rows, self.divisor, self.cobasic[k - 1] = rows, new, leaving

    def _smallest_ratios(
        self, forms: list[int], j: int, k: int, sign: int
    ) -> list[int]:
        """Return the forms with the smallest ratio of their entry in column j,
        multiplied by a sign, to the size of their entry in column k.
        """
        best: list[int] = []
        value, size = 0, 1
        for form in forms if len(forms) > 1 else ():
            row = self.rows[form]
            entry, fall = sign * row[j], abs(row[k])
            difference = entry * size - value * fall
            if not best or difference < 0:
                best = [form]
                value = entry
                size = fall
            elif not difference:
                best.append(form)
        return best or forms

    def _reach_zero(self, form: int) -> bool:
        """Move to a point where a basic form is 0 and make it cobasic, unless it is 0
        on the whole polyhedron; return False if it is 0 nowhere.
        """
        bland = False
        while (row := self.rows.get(form)) is not None:
            if not row[0]:
                k = next((k for k in range(1, len(row)) if row[k]), None)
                if k is not None:
                    self.pivot(form, k)
                return True
            move = self._entering(row, -1 if row[0] > 0 else 1, bland)
            if move is None:
                return False
            k = move[0]
            leaving, value = self.leaving(*move)
            if (
                leaving is None
                or leaving == form
                or abs(row[0] * self.rows[leaving][k]) <= value * abs(row[k])
            ):
                leaving = form
            bland = not value
            self.pivot(leaving, k)
        return True

    def _entering(
        self, row: list[int], sign: int, bland: bool, objective: int = -1
    ) -> tuple[int, int] | None:
        """Return the column of a form that can enter, and the direction in which it
        changes: one that moves the basic form of `row` in the direction `sign` with the
        smallest change of the objective relative to that; None if there is none.
        Without an objective, it is the one with the largest coefficient, or by Bland's
        rule the first one.
        """
        costs = self.rows.get(objective)
        best = None
        smallest_change = 0
        size = 1
        for k, form in enumerate(self.cobasic, 1):
            slope = sign * row[k]
            if slope > 0 or (slope and form not in self.signed):
                order = form if bland else -abs(slope)
                difference = (
                    costs[k] * size - smallest_change * abs(slope)
                    if costs and best
                    else 0
                )
                if (
                    best is None
                    or difference < 0
                    or (not difference and order < best[0])
                ):
                    best = (order, k, 1 if slope > 0 else -1)
                    smallest_change = costs[k] if costs else 0
                    size = abs(slope)
        return None if best is None else best[1:]

    def _drop(self, form: int) -> None:
        """Remove a form that is 0 on the whole polyhedron."""
        self.rows.pop(form, None)
        if form in self.cobasic:
            k = self.cobasic.index(form)
            del self.cobasic[k]
            self.rows = {
                basic: row[: k + 1] + row[k + 2 :] for basic, row in self.rows.items()
            }


class Vertex(RationalPoint):
    """A point that stores its hash, as hashing fractions takes long."""

    _hash: int | None = None

    def __hash__(self) -> int:
        if self._hash is None:
            self._hash = super().__hash__()
        return self._hash


def generators(
    start: Dictionary, forms: Sequence[int], max_bases: float = math.inf
) -> list[list[Direction]] | None:
    """Return the vertices, rays and lines of a polyhedron from a feasible dictionary;
    None if there are more than `max_bases` bases. The polyhedron is the product of the
    polyhedra of its independent parts.

    A vertex, ray or line consists of the values of forms that distinguish points, in
    integers without a common divisor; those of a vertex are preceded by the number that
    divides them. If there are lines, the vertices are points, one on each minimal face.
    """
    start = start.copy()
    lines = _without_lines(start, forms)
    position = {form: i for i, form in enumerate(forms, 1)}
    still = set(position)
    factors: list[tuple[list[int], list[Direction]]] = []
    rays: list[Direction] = []
    for part in _parts(start):
        part_forms = [form for form in (*part.cobasic, *part.rows) if form in position]
        still -= set(part_forms)
        part_points: dict[Direction, None] = {}
        directions: dict[Direction, None] = {}
        for dictionary, unbounded in bases(part):
            max_bases -= 1
            if max_bases < 0:
                return None
            part_points[_values(dictionary, part_forms)] = None
            directions.update(
                (tuple(dictionary.direction(k, forms)), None) for k in unbounded
            )
        factors.append(([position[form] for form in part_forms], list(part_points)))
        rays += directions
    if math.prod(len(points) for _, points in factors) > max_bases:
        return None
    factors.append(([position[form] for form in still], [_values(start, still)]))
    vertices = []
    values = [0] * (len(forms) + 1)
    for chosen in product(*(points for _, points in factors)):
        start.check()
        values[0] = math.lcm(*(point[0] for point in chosen))
        for (positions, _), (divisor, *point) in zip(factors, chosen, strict=True):
            factor = values[0] // divisor
            for i, value in zip(positions, point, strict=True):
                values[i] = factor * value
        vertices.append(tuple(values))
    return [vertices, rays, lines]


def _values(dictionary: Dictionary, forms: Iterable[int]) -> Direction:
    """Return the common divisor of the values of forms at the point, and these
    values.
    """
    return tuple(
        primitive([dictionary.divisor, *(dictionary.value(form) for form in forms)])
    )


def _parts(whole: Dictionary) -> Iterator[Dictionary]:
    """Yield the independent parts of a dictionary: their rows have no columns in
    common.
    """
    rows = list(whole.rows.items())
    first = len(whole.cobasic)

    def edges() -> Iterator[tuple[int, int]]:
        for i, (_, row) in enumerate(rows):
            for k in range(first):
                if row[k + 1]:
                    yield k, first + i

    for nodes in connected(first + len(rows), edges()):
        columns = [k for k in nodes if k < first]
        if columns:
            part = whole.copy()
            part.rows = {
                form: [row[0], *(row[k + 1] for k in columns)]
                for form, row in (rows[k - first] for k in nodes[len(columns) :])
            }
            part.cobasic = [whole.cobasic[k] for k in columns]
            yield part


def bases(dictionary: Dictionary) -> Iterator[tuple[Dictionary, list[int]]]:
    """Yield the dictionary at each feasible basis of the perturbed polyhedron, so that
    each vertex occurs at least once, with the columns of unbounded edges, counted from
    1.

    The dictionary is feasible with signed cobasic forms; it is pivoted from basis to
    basis and back, a depth-first search of the graph of vertices and edges.
    """
    order = [form for form in dictionary.rows if form in dictionary.signed]
    basis = sum(1 << form for form in dictionary.cobasic)
    seen = {basis}
    # The edges that have not been followed, for each basis on the path from the start.
    moves: list[list[tuple[int, int]]] = []
    back: list[tuple[int, int, int]] = []
    while True:
        edges = [
            (k, dictionary.lexicographic(dictionary.nearest(k), k, order))
            for k in range(1, len(dictionary.cobasic) + 1)
        ]
        yield dictionary, [k for k, leaving in edges if leaving is None]
        moves.append([(k, leaving) for k, leaving in edges if leaving is not None])
        while True:
            while not moves[-1]:
                moves.pop()
                if not back:
                    return
                basis, *step = back.pop()
                dictionary.pivot(*step)
            k, leaving = moves[-1].pop()
            entering = dictionary.cobasic[k - 1]
            other = basis ^ 1 << entering ^ 1 << leaving
            if other not in seen:
                break
        seen.add(other)
        back.append((basis, entering, k))
        dictionary.pivot(leaving, k)
        basis = other


def _without_lines(start: Dictionary, forms: Sequence[int]) -> list[Direction]:
    """Return the lines of the polyhedron and remove their columns; all other columns
    become signed.
    """
    lines = []
    for form in [form for form in start.cobasic if form not in start.signed]:
        k = start.cobasic.index(form) + 1
        leaving = start.leaving(k, 1)[0]
        if leaving is None:
            leaving = start.leaving(k, -1)[0]
        if leaving is None:
            lines.append(tuple(start.direction(k, forms)))
            start.vanish(form)
        else:
            start.pivot(leaving, k)
    return lines
