"""Ranging: how far each number of a solved problem may change, the others being fixed,
while the optimal partition stays the same, that is, which z_i can be off their bounds,
and which w_i can be nonzero, at solutions.

The dictionary of a basis expresses z and w in terms of those of them that are 0. If
both z_i and w_i are 0 at its point, directions d in which solutions lie have d_i >= 0,
e_i >= 0 and d_i e_i = 0 for the change e of w, and the largest support of such
directions completes the partition (A. B. Berkelaar, K. Roos and T. Terlaky, The optimal
set and optimal partition approach to linear and quadratic programming, in: Advances in
Sensitivity Analysis and Parametric Programming, Kluwer 1997). It is the partition of
all solutions if these form a polyhedron, as for positive semidefinite M, and otherwise
that of a polyhedron of solutions around the point.

If q_i increases by t, w_i + t replaces w_i, and similarly for bounds: that adds a
column to the dictionary. The smallest and the largest t at which forms outside the
partition are 0, and those inside nonnegative, delimit the range; for any t between
them, an average with a solution in the relative interior has the same partition. The
change at a limit of the range is the partition of the next piece of the path of
solutions beyond it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from lcpcli.enumeration.meaning import meaning_of
from lcpcli.explanation.conditions import LOWER, UPPER, System
from lcpcli.explanation.search import Choices, Node
from lcpcli.model import box
from lcpcli.parametric.following import basic_states
from lcpcli.rational.dictionary import Dictionary
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import rounded
from lcpcli.rational.pivoting import RationalPivoting
from lcpcli.rational.tree import explored

Values = list[Fraction]
# The forms that become 0, and those that become positive.
Change = tuple[set[int], set[int]]
PATH_ENDS: Change = (set(), set())  # the path of solutions does not continue
BEYOND = -2  # the number of an auxiliary form that is to be positive


class End(NamedTuple):
    """A limit of a range. value : the number there. z : a solution there. objective :
    the objective of a program there; None for other problems. enters, leaves : the
    components of z that can be off their bounds beyond the limit but not within the
    range, and vice versa; None if they are not known, or if the path of solutions
    terminates (`ends`) or has a turning point there.
    """

    value: Fraction
    z: Values
    objective: Fraction | None
    enters: Sequence[int] | None
    leaves: Sequence[int] | None
    ends: bool


class Range(NamedTuple):
    """The range of a number in the data. value : its value. below, above : its limits,
    None for an unbounded range. basis : the limits of the range in which the basis
    stays the same, which is smaller if several bases have this partition.
    """

    value: Fraction
    below: End | None
    above: End | None
    basis: tuple[Fraction | None, Fraction | None]

    def opposite(self) -> Range:
        """Return the range of the negative of the number."""
        below, above = (
            end and end._replace(value=-end.value) for end in (self.above, self.below)
        )
        low, high = (None if end is None else -end for end in reversed(self.basis))
        return Range(-self.value, below, above, (low, high))


class Position(RationalPivoting):
    """A basis of a solution, with the forms of `RationalPivoting`."""

    def __init__(
        self, system: System, dictionary: Dictionary, statuses: Sequence[int]
    ) -> None:
        self.system = system
        super().__init__(system.n, dictionary, statuses)

    @classmethod
    def of(cls, system: System, z: Values, effort: Effort) -> Position | None:
        """Return a basis of a solution close to z; None if the search yields none."""
        position = cls._at(system, z, effort)
        return position or cls._at(system, _vertex(system, z, effort), effort)

    @classmethod
    def _at(cls, system: System, z: Values, effort: Effort) -> Position | None:
        """Return the basis of z, with basic variables replaced where rows are
        dependent; None if it is not feasible."""
        data, n = system.data, system.n
        problem, w = data.problem, rounded(data.w(z))
        is_fixed = np.equal(*problem.box.vectors(n))
        basis = basic_states(problem, rounded(z), w, is_fixed)
        if basis is None:  # there is a line of solutions
            basis = problem.box.basis_at(rounded(z), w)
        # Beyond the range of doubles z_i is rounded to a bound that is not there.
        has_no_upper = np.array([high is None for high in data.upper], bool)
        basis[(basis == box.UPPER) & has_no_upper] = box.BASIC
        bounds = list(enumerate(zip(data.lower, data.upper, strict=True)))
        dictionary, columns = system.dictionary(_forms(data), effort)
        fixed = {n + i for i, (low, high) in bounds if low is not None and low == high}
        dictionary.signed = {*_forms(data)} - fixed
        entering_forms = [system.form_of_z(i) for i in columns if basis[i] == box.BASIC]
        for i, state in enumerate(basis.tolist()):
            entries = zip(dictionary.cobasic, dictionary.rows[n + i][1:], strict=True)
            candidates = [
                form for form, value in entries if value and form in entering_forms
            ]
            if state == box.BASIC and candidates:
                entering_forms.remove(candidates[0])
                dictionary.pivot(n + i, dictionary.cobasic.index(candidates[0]) + 1)
                continue
            if state == box.BASIC:  # the row depends on others
                basis[i] = box.LOWER if system.form_of_z(i) == i else box.UPPER
            if basis[i] == box.UPPER:
                dictionary.negate(n + i)
                if system.form_of_z(i) == i:
                    dictionary.pivot(2 * n + i, dictionary.cobasic.index(i) + 1)
        values = (dictionary.value(form) for form in dictionary.signed)
        is_feasible = min(values, default=0) >= 0 and not any(
            dictionary.value(n + i) for i, (low, high) in bounds if low is high
        )
        return cls(system, dictionary, basis.tolist()) if is_feasible else None

    def column(self, field: str, i: int, sign: int) -> dict[int, int]:
        """Return how the basic forms change, multiplied by `divisor`, as a number
        increases, or decreases for the sign -1.
        """
        dictionary, n = self.dictionary, self.n
        form = {"q": n + i, LOWER: i, UPPER: 2 * n + i}[field]
        slope = sign * self.system.factors.get(form, 1)
        if field == LOWER or (field == "q" and self._signed_at[i] == box.UPPER):
            slope = -slope
        if form in dictionary.rows:
            return {form: slope * int(dictionary.divisor)}
        k = dictionary.cobasic.index(form) + 1
        return {
            other: -slope * int(row[k])
            for other, row in dictionary.rows.items()
            if row[k]
        }

    def moved(self, column: Mapping[int, int]) -> Position:
        """Return the same basis with an additional column, for a parameter."""
        dictionary = self.dictionary.copy()
        dictionary.rows = {
            form: [*row, column.get(form, 0)] for form, row in dictionary.rows.items()
        }
        dictionary.cobasic.append(self.parameter)
        return self.at(dictionary)

    def at(self, dictionary: Dictionary) -> Position:
        """Return the same basis with another dictionary."""
        other = Position(self.system, dictionary, self.statuses)
        other._signed_at = list(self._signed_at)
        return other

    def positive(self) -> set[int]:
        """Return the optimal partition: the signed forms that can be positive at a
        solution in the polyhedron of solutions around the point.
        """
        dictionary, n = self.dictionary, self.n
        positive_forms = {
            form for form, row in dictionary.rows.items() if row[0]
        } & dictionary.signed
        pairs = dict[int, tuple[int, int]]()
        for i in range(n):
            bounds = dictionary.signed.intersection((i, 2 * n + i)) - positive_forms
            if n + i in dictionary.signed - positive_forms and bounds:
                pairs[i] = min(bounds), n + i
                self._set_sign(i, box.LOWER if i in bounds else box.UPPER)
        both = [form for pair in pairs.values() for form in pair]
        columns = [form for form in dictionary.cobasic if form in both]
        # Free columns belong to lines of solutions.
        columns += [
            form for form in dictionary.cobasic if form not in dictionary.signed
        ]
        column_numbers = [dictionary.cobasic.index(form) + 1 for form in columns]
        equations = [form for form in self.equations() if form in dictionary.rows]
        rows = {
            form: [0, *(dictionary.rows[form][k] for k in column_numbers)]
            for form in (*both, *equations)
            if form in dictionary.rows
        }
        cone = Dictionary(rows, columns, both, dictionary.check)
        for form in equations:
            cone.vanish(form)
        for form in both:
            if (
                form in positive_forms
                or (point := _direction(cone, form, pairs)) is None
            ):
                continue
            for one, other in (*pairs.values(), *map(reversed, pairs.values())):
                if point.value(one):
                    positive_forms.add(one)
                    cone.vanish(other)
        return positive_forms

    def equations(self) -> list[int]:
        """Return the forms that are 0 at all solutions: w_i of a free z_i."""
        bounds = zip(self.system.data.lower, self.system.data.upper, strict=True)
        return [self.n + i for i, (low, high) in enumerate(bounds) if low is high]

    def _set_sign(self, i: int, state: int) -> None:
        """Give form n + i the sign that w_i may have at a bound."""
        if self._signed_at[i] != state:
            self._signed_at[i] = state
            self.dictionary.negate(self.n + i)

    def is_simple(self, positive: set[int]) -> bool:
        """Return whether the forms of a partition are the basic ones, and none of these
        is 0.
        """
        dictionary = self.dictionary
        is_unique = dictionary.signed.issuperset(dictionary.cobasic)
        return is_unique and positive == dictionary.signed & dictionary.rows.keys()

    def ahead(
        self, column: Mapping[int, int], t: Fraction | None
    ) -> tuple[Fraction, Values] | None:
        """Return the parameter t, and the forms of z at it; None if t is None."""
        if t is None:
            return None
        dictionary, values = self.dictionary, list[Fraction]()
        for form in map(self.system.form_of_z, range(self.n)):
            change = column.get(form, 0) * t
            values.append((dictionary.value(form) + change) / int(dictionary.divisor))
        return t, values

    def inside(self, positive: set[int]) -> set[int]:
        """Return the components that can be off their bounds in a partition."""
        at = {
            form % self.n
            for form in self.dictionary.signed - positive
            if form // self.n != 1
        }
        return {*range(self.n)} - at

    def farthest(self, positive: set[int]) -> tuple[Fraction, Values] | None:
        """Return the largest parameter with the same partition, and the forms of z
        there; None if it is unbounded.
        """
        dictionary, n = self.dictionary, self.n
        kept_columns = [
            k
            for k, form in enumerate(dictionary.cobasic, 1)
            if form in positive or form not in dictionary.signed
        ]
        cobasic = [dictionary.cobasic[k - 1] for k in kept_columns]
        rows = {
            form: [row[0], *(row[k] for k in kept_columns)]
            for form, row in dictionary.rows.items()
        }
        target = 3 * n + 1
        rows[target] = [0] * len(kept_columns) + [-1]
        face = Dictionary(rows, cobasic, positive, dictionary.check)
        for form in dictionary.signed - positive:
            face.vanish(form)
        if not face.minimize(target):
            return None
        d = Fraction(1, int(face.divisor))
        z_forms = map(self.system.form_of_z, range(n))
        values = [
            face.value(form)
            * d
            / (int(dictionary.divisor) if form in dictionary.rows else 1)
            for form in z_forms
        ]
        return -face.value(target) * d, values

    def until(self, column: Mapping[int, int]) -> tuple[Fraction | None, list[int]]:
        """Return the largest parameter with the same basis, None if it is unbounded,
        and the forms that become 0 there.
        """
        dictionary = self.dictionary
        ratios = {
            form: Fraction(int(dictionary.rows[form][0]), -slope)
            for form, slope in column.items()
            if slope < 0 and form in dictionary.signed
        }
        smallest_ratio = min(ratios.values(), default=None)
        return smallest_ratio, [
            form for form, ratio in ratios.items() if ratio == smallest_ratio
        ]

    def after(
        self, column: Mapping[int, int], t: Fraction, first: list[int]
    ) -> Change | None:
        """Return the forms that become 0 and those that become positive as the
        parameter passes t, where the form `first` is 0, if the basis is not degenerate.
        The complement of that form enters: either the parameter increases with it, or
        it is constant until a second form is 0, whose complement then enters. None if
        this is not determined.
        """
        dictionary, rows = self.dictionary, self.dictionary.rows
        if len(first) > 1:
            return None
        entering, sign = self._partner(first[0])
        if entering not in dictionary.cobasic:  # both bounds have met
            return PATH_ENDS
        k = dictionary.cobasic.index(entering) + 1
        rate = sign * int(rows[first[0]][k])
        if rate:
            return ({first[0]}, {entering}) if rate > 0 else PATH_ENDS
        ratios = {
            form: (int(row[0]) + column.get(form, 0) * t) / (-sign * int(row[k]))
            for form, row in (
                (form, rows[form]) for form in dictionary.signed & rows.keys()
            )
            if sign * row[k] < 0
        }
        smallest_ratio = min(ratios.values(), default=None)
        second = [form for form, ratio in ratios.items() if ratio == smallest_ratio]
        if len(second) != 1:
            return None if second else PATH_ENDS
        if second[0] % self.n == first[0] % self.n:  # z_i goes to its other bound
            return {second[0]}, {entering}
        other, sign = self._partner(second[0])
        rate = sign * int(rows[first[0]][dictionary.cobasic.index(other) + 1])
        return ({first[0], second[0]}, {entering, other}) if rate > 0 else None

    def _partner(self, form: int) -> tuple[int, int]:
        """Return the cobasic form that is complementary to a basic one, and the sign
        with which it increases once that is 0.
        """
        i, n = form % self.n, self.n
        if form // n == 1:
            return (i if i in self.dictionary.cobasic else 2 * n + i), 1
        state = box.LOWER if form == i else box.UPPER
        return n + i, 1 if self._signed_at[i] == state else -1

    def beyond(self, positive: set[int]) -> set[int] | None:
        """Return the partition of the next piece of the path of solutions with a larger
        parameter; None if the path terminates before, or turns back.
        """
        rows = (self.dictionary.rows.get(form, [0]) for form in self.equations())
        if any(row[-1] for row in rows):
            return None
        path, first = self.follow(self.parameter, set()), set[int]()
        last = Fraction(0)
        while True:
            before = self.at(self.dictionary.copy())
            pivot = next(path, None)
            entering = self.ray if pivot is None else pivot.entering
            assert entering is not None
            now = last + 1 if pivot is None else self.value_of(self.parameter)
            rises = entering == self.parameter or before.slope(entering) > 0
            if now < last or (pivot is None and not rises):
                return None
            if now > last:
                partition = before.within(entering, (last + now) / 2).positive()
                if partition != positive:
                    return partition
            # The path may be a closed curve if it reverses immediately.
            if pivot is None or {*self.dictionary.cobasic} == first:
                return None
            first = first or {*self.dictionary.cobasic}
            i, is_w = pivot.leaving % self.n, pivot.leaving // self.n == 1
            following = i if self.statuses[i] == box.LOWER else 2 * self.n + i
            # Otherwise both bounds of a component have become equal.
            if (following if is_w else self.n + i) not in self.dictionary.cobasic:
                return None
            last = now

    def can_follow(self) -> bool:
        """Return whether the equations hold along all edges; they may not if there is a
        line of solutions.
        """
        rows = (self.dictionary.rows.get(form, [0, 0]) for form in self.equations())
        return not any(any(row[1:-1]) for row in rows)

    def slope(self, entering: int) -> int:
        """Return the sign of the change of the parameter along an edge."""
        k = self.dictionary.cobasic.index(entering) + 1
        return int(self.dictionary.rows[self.parameter][k])

    def within(self, entering: int, t: Fraction) -> Position:
        """Move along an edge to the point where the parameter is t, and substitute t
        for it.
        """
        dictionary, d = self.dictionary, t.denominator
        if entering != self.parameter:
            dictionary.pivot(self.parameter, dictionary.cobasic.index(entering) + 1)
        k = dictionary.cobasic.index(self.parameter) + 1
        for form, row in dictionary.rows.items():
            whole = [d * value for value in row]
            whole[0] += t.numerator * row[k]
            del whole[k]
            dictionary.rows[form] = whole
        del dictionary.cobasic[k - 1]
        dictionary.divisor *= d
        return self


def _forms(data: ExactProblem) -> list[int]:
    """Return the forms of a problem: w_i, and the distances of z_i from finite
    bounds.
    """
    n, bounds = data.n, list(enumerate(zip(data.lower, data.upper, strict=True)))
    forms = [*range(n, 2 * n), *(i for i, (low, _) in bounds if low is not None)]
    return [*forms, *(2 * n + i for i, (_, high) in bounds if high is not None)]


def _vertex(system: System, z: Values, effort: Effort) -> Values:
    """Return a vertex of a polyhedron of solutions that contains z, if it has one."""
    data, n = system.data, system.n
    dictionary, columns = system.dictionary(_forms(data), effort)
    for i, (low, high) in enumerate(zip(data.lower, data.upper, strict=True)):
        if z[i] in (low, high):
            dictionary.vanish(i if z[i] == low else 2 * n + i)
            if z[i] == high:
                dictionary.negate(n + i)
            if low != high:
                dictionary.require(n + i)
            continue
        dictionary.vanish(n + i)
        for form, end in ((i, low), (2 * n + i, high)):
            if end is not None:
                dictionary.require(form)
    return system.point(dictionary, columns)


def _direction(
    cone: Dictionary, form: int, pairs: Mapping[int, tuple[int, int]]
) -> Dictionary | None:
    """Return a dictionary of a cone at whose point a form is at least 1 and one of each
    pair is 0; None if there is none.
    """
    dictionary = cone.copy()
    if form in dictionary.rows:
        row = list(dictionary.rows[form])
    elif form in dictionary.cobasic:
        row = [0, *(dictionary.divisor * (each == form) for each in dictionary.cobasic)]
    else:
        return None
    dictionary.rows[BEYOND] = [row[0] - dictionary.divisor, *row[1:]]
    if not dictionary.require(BEYOND):
        return None
    alternatives = {
        i: [[(one, True)], [(two, True)]] for i, (one, two) in pairs.items()
    }
    tree = explored(
        Choices(alternatives, dictionary.check), [Node(dictionary, frozenset())]
    )
    return next((node.dictionary for node, is_leaf in tree if is_leaf), None)


def ranges(
    system: System, z: Values, effort: Effort
) -> Iterator[tuple[tuple[str, int], Range]]:
    """Yield the ranges of all numbers in the data of a problem with a solution z, by
    their fields and indices; none for the bounds of fixed components and of
    multipliers, and none at all if no basis of a solution is computed.
    """
    position = Position.of(system, z, effort)
    if position is None:
        return
    positive = position.positive()
    movable = {(each.field, each.at) for each in system.numbers}
    for field in ("q", LOWER, UPPER):
        for i in range(system.n):
            is_fixed = system.data.lower[i] == system.data.upper[i] is not None
            if field == "q" or ((field, i) in movable and not is_fixed):
                yield (field, i), _range(position, positive, field, i)


def _range(position: Position, positive: set[int], field: str, i: int) -> Range:
    """Return the range of one number, for the optimal partition `positive`."""
    data = position.system.data
    value = Fraction(data.constants[i], data.scales[i])
    if field != "q":
        value = (data.lower if field == LOWER else data.upper)[i] or Fraction(0)
    below, first = _end(position, positive, (field, i), value, -1)
    above, last = _end(position, positive, (field, i), value, 1)
    return Range(value, below, above, (first, last))


def _end(
    position: Position,
    positive: set[int],
    number: tuple[str, int],
    value: Fraction,
    sign: int,
) -> tuple[End | None, Fraction | None]:
    """Return the limit of a range below (sign -1) or above, and that of the range with
    the same basis.
    """
    system, column = position.system, position.column(*number, sign)
    limit, first = position.until(column)
    of_basis = None if limit is None else value + sign * limit
    moved = None if position.is_simple(positive) else position.moved(column)
    range_end = (
        position.ahead(column, limit) if moved is None else moved.farthest(positive)
    )
    if range_end is None:
        return None, of_basis
    t, forms = range_end
    z = _point(system, forms, *number, sign * t)
    change = None if moved else position.after(column, t, first)
    following, is_known = None, True
    if change is not None:
        if change != PATH_ENDS:
            following = (positive - change[0]) | change[1]
    else:
        moved = moved or position.moved(column)
        is_known = moved.can_follow()
        following = moved.beyond(positive) if is_known else None
    enters = leaves = None
    if following is not None:
        within, inside = position.inside(positive), position.inside(following)
        enters, leaves = sorted(inside - within), sorted(within - inside)
    of_q = (number[1], sign * t) if number[0] == "q" else None
    objective_there = meaning_of(system.data).objective(z, of_q)
    path_ends = is_known and following is None
    end = End(value + sign * t, z, objective_there, enters, leaves, path_ends)
    return end, of_basis


def _point(system: System, forms: Values, field: str, i: int, t: Fraction) -> Values:
    """Return z, from the forms of z, if a number has changed by t."""
    pairs = enumerate(zip(system.base, forms, strict=True))
    z = [base + system.side(j) * form for j, (base, form) in pairs]
    if field != "q" and (system.form_of_z(i) == i) == (field == LOWER):
        z[i] += t
    return z
