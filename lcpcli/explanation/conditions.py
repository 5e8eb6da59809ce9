"""The conditions of a problem and the numbers in its data, by the names that its author
knows; and the conditions as affine forms in integers.

Each component has up to four conditions, which hold or not at any point z, with w = M z
+ q. With only a lower bound they are z_i >= l_i; the sign w_i >= 0; and
complementarity, w_i = 0 if z_i > l_i. With only an upper bound they are the mirror
image. With two bounds the required sign of w_i depends on z_i, and belongs to
complementarity: w_i >= 0 if z_i <= l_i, w_i = 0 between the bounds, and w_i <= 0 if z_i
>= u_i. Without bounds there is only the equation w_i = 0; if the bounds are equal,
there are only the bounds. The conditions are independent: dropping one does not change
the others.

The conditions of a program are, first, those of its constraints, the bounds of rows and
the bounds of variables, which do not contain the multipliers; and second, those of
optimality, which are examined once the constraints are feasible.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import partial
from typing import NamedTuple, TypeVar

from lcpcli.errors import ParameterError, likely, quoted
from lcpcli.rational.dictionary import Dictionary
from lcpcli.rational.elimination import OF_BIT, OF_ENTRY, Effort
from lcpcli.rational.exact_problem import ExactProblem

LOWER = "lower"
UPPER = "upper"
SIGN = "sign"
COMPLEMENTARITY = "complementarity"
CONSTRAINTS, OPTIMALITY = 0, 1  # the stages at which conditions are examined
# The kinds of components: unknowns; in a program its variables, the multipliers of its
# rows, and the values of rows with two sides.
UNKNOWN = "unknown"
VARIABLE = "variable"
ROW = "row"
RANGE = "range"
# The names of a lower bound, an upper bound, the condition on w and a number in q.
WORDS = {
    UNKNOWN: ("lower bound", "upper bound", "sign of w", "q"),
    VARIABLE: ("lower bound", "upper bound", "reduced cost", "cost"),
    ROW: ("sign of the multiplier", "sign of the multiplier", "side", "side"),
    RANGE: ("lower side", "upper side", "", ""),
}
EQUATION = "equation"

Values = list[Fraction]
# Forms, each with whether it is 0; otherwise it is nonnegative.
Alternative = Sequence[tuple[int, bool]]
T = TypeVar("T", "Condition", "Number")


class Component(NamedTuple):
    """A component of z: its name, its kind, and the sense of its q: -1 if the number in
    the author's data is -q_i.
    """

    name: str
    kind: str
    sense: int = 1


class Condition(NamedTuple):
    """A condition on component `at`. name, what : the author's words for it."""

    kind: str
    at: int
    name: str
    what: str
    stage: int = CONSTRAINTS


class Number(NamedTuple):
    """A number in the data: entry `at` of q, lower or upper; the number in the author's
    data is `sense` times it. name, what : the author's words for it. is_default :
    whether a repair may change it unless others are named.
    """

    field: str
    at: int
    name: str
    what: str
    sense: int = 1
    is_default: bool = True


def components(data: ExactProblem) -> list[Component]:
    """Return the name, kind and sense of each component of z; only this function reads
    the formulation of a problem.
    """
    names = data.problem.names
    n = data.n
    form = data.problem.block_form
    if form is None:
        return [Component(name or f"z{i}", UNKNOWN) for i, name in enumerate(names, 1)]
    k = form.variables
    first_range = n - form.ranges
    sense = int(form.sign)
    before_ranges = [
        Component(names[i] or f"x{i + 1}", VARIABLE, sense)
        if i < k
        else Component(names[i] or f"r{i - k + 1}", ROW, -1)
        for i in range(first_range)
    ]
    return [
        *before_ranges,
        *(
            Component(before_ranges[row_of(data, i)].name, RANGE)
            for i in range(first_range, n)
        ),
    ]


def row_of(data: ExactProblem, i: int) -> int:
    """Return the index of the multiplier of the row whose value is component i: the w
    of the value is the multiplier.
    """
    return next(iter(data.rows[i]))


def matching(named: Sequence[T], patterns: Iterable[str], option: str) -> list[T]:
    """Return the conditions, or numbers, that patterns select, in which * matches any
    text: by name, or by name and what they are. Raises ParameterError for a pattern
    that selects none.
    """
    labels = [(each.name, f"{each.name} {each.what}") for each in named]
    chosen = set[int]()
    for pattern in patterns:
        shape = re.compile(".*".join(map(re.escape, pattern.split("*"))), re.DOTALL)
        matches = [
            i for i, both in enumerate(labels) if any(map(shape.fullmatch, both))
        ]
        if not matches:
            valid_names = dict.fromkeys(label for both in labels for label in both)
            advice = "leave it out: the problem has none"
            if labels:
                example = quoted(labels[0][1])
                advice = f"write a name, or a name and what it is, as in {example}"
            hint = likely(pattern, valid_names, advice)
            reason = f"{quoted(pattern)} names nothing in this problem"
            raise ParameterError(option, reason, hint)
        chosen.update(matches)
    return [named[i] for i in sorted(chosen)]


class System:
    """The conditions of a problem as forms: z_i - l_i is form i, w_i form n + i, u_i -
    z_i form 2 n + i; form 3 n is for a parameter; the negative of form k is form k + 4
    n. The values of rows are expressed by the variables.

    linear, complementarities : the conditions. numbers : the numbers in the data.
        rows_of : for the values of rows, the indices of the multipliers of these rows.
    """

    def __init__(self, data: ExactProblem) -> None:
        self.data = data
        self.n = data.n
        self.components = components(data)
        bound_pairs = zip(data.lower, data.upper, strict=True)
        self.base = [
            low if low is not None else high or Fraction(0) for low, high in bound_pairs
        ]
        self.linear, self.complementarities = list[Condition](), list[Condition]()
        self.numbers = list[Number]()
        kinds = enumerate(each.kind for each in self.components)
        self.rows_of = {i: row_of(data, i) for i, kind in kinds if kind == RANGE}
        for i, each in enumerate(self.components):
            # The condition of the multiplier of a two-sided row defines the value.
            if i not in self.rows_of.values():
                self._describe(i, each)

    def _describe(self, i: int, component: Component) -> None:
        """Add the conditions and the numbers of a component."""
        low, high = self.data.lower[i], self.data.upper[i]
        of_lower, of_upper, of_w, of_q = WORDS[component.kind]
        of_bounds = OPTIMALITY if component.kind == ROW else CONSTRAINTS
        for kind, bound, what in ((LOWER, low, of_lower), (UPPER, high, of_upper)):
            if bound is not None:
                self.linear.append(Condition(kind, i, component.name, what, of_bounds))
            if bound is not None and component.kind != ROW:
                number = Number(
                    kind, i, component.name, what, 1, component.kind == RANGE
                )
                self.numbers.append(number)
        if component.kind == ROW and (low is None) != (high is None):
            of_w = of_q = WORDS[RANGE][low is None]
        if None in (low, high):
            what = EQUATION if low is high and component.kind != VARIABLE else of_w
            stage = OPTIMALITY if component.kind == VARIABLE else CONSTRAINTS
            self.linear.append(Condition(SIGN, i, component.name, what, stage))
        if of_q and not (component.kind == ROW and low == high == 0):
            self.numbers.append(Number("q", i, component.name, of_q, component.sense))
        if low != high:
            whole = Condition(COMPLEMENTARITY, i, component.name, COMPLEMENTARITY)
            self.complementarities.append(whole)

    def value(self, number: Number) -> Fraction:
        """Return a number in the author's sense."""
        data, i = self.data, number.at
        if number.field == "q":
            return Fraction(number.sense * data.constants[i], data.scales[i])
        return (data.lower if number.field == LOWER else data.upper)[i] or Fraction(0)

    def entries(self, form: int) -> tuple[Mapping[int, int], int, Fraction]:
        """Return the coefficients of z in a form multiplied by a positive integer, that
        integer, and the constant of the form, which is not multiplied.
        """
        data = self.data
        i = form % self.n
        kind = form // self.n % 4
        sign = 1 if form < 4 * self.n else -1
        if kind == 1:
            row, scale = data.rows[i], data.scales[i]
            constant = Fraction(data.constants[i], scale)
        else:
            sign = -sign if kind == 2 else sign
            row, scale = {i: 1}, 1
            constant = -((data.lower if kind == 0 else data.upper)[i] or Fraction(0))
        if kind != 1 and i in self.rows_of:
            at = self.rows_of[i]
            row, scale = {**data.rows[at]}, data.scales[at]
            del row[i]
        return {j: sign * a for j, a in row.items()}, scale, sign * constant

    def forms(self, of: Condition) -> tuple[int, ...]:
        """Return the forms that are nonnegative if a linear condition holds."""
        n, i = self.n, of.at
        if of.kind != SIGN:
            return (i if of.kind == LOWER else 2 * n + i,)
        if self.data.lower[i] is self.data.upper[i]:
            return n + i, 5 * n + i
        return (n + i if self.data.upper[i] is None else 5 * n + i,)

    def is_bound(self, of: Condition) -> bool:
        """Return whether a condition is a bound of a variable, and not one of a row."""
        return of.kind != SIGN and of.at not in self.rows_of

    def alternatives(self, i: int, held: Collection[int] = ()) -> list[Alternative]:
        """Return the polyhedra whose union is the complementarity of component i. held
        : forms of bounds that are required as well: z_i is then at the bound, rather
        than at or beyond it.
        """
        n = self.n
        low = self.data.lower[i]
        high = self.data.upper[i]
        at_lower, at_upper = (
            (form, True) if form in held else (4 * n + form, False)
            for form in (i, 2 * n + i)
        )
        if high is None or low is None:
            return [[at_lower if high is None else at_upper], [(n + i, True)]]
        between = [(n + i, True), (i, False), (2 * n + i, False)]
        return [[at_lower, (n + i, False)], between, [at_upper, (5 * n + i, False)]]

    def holds(self, of: Condition, z: Values) -> bool:
        """Return whether a condition holds at a point."""
        polyhedra: Sequence[Alternative] = [[(form, False) for form in self.forms(of)]]
        if of.kind == COMPLEMENTARITY:
            polyhedra = self.alternatives(of.at)

        def is_in(form: int, is_zero: bool) -> bool:
            row, scale, constant = self.entries(form)
            value = scale * constant + sum(a * z[j] for j, a in row.items())
            return value == 0 or (value > 0 and not is_zero)

        return any(all(is_in(*each) for each in polyhedron) for polyhedron in polyhedra)

    def form_of_z(self, i: int) -> int:
        """Return the form of the bound from which z_i is measured."""
        has_upper_alone = self.data.lower[i] is None and self.data.upper[i] is not None
        return 2 * self.n + i if has_upper_alone else i

    def side(self, i: int) -> int:
        """Return 1 if the form of z_i increases with z_i, else -1."""
        return 1 if self.form_of_z(i) == i else -1

    def dictionary(
        self, forms: Collection[int], effort: Effort
    ) -> tuple[Dictionary, list[int]]:
        """Return a dictionary with these forms, none of which is required to be
        nonnegative, and the components that they depend on, whose forms are cobasic.
        """
        columns = sorted({j for form in forms for j in self.entries(form)[0]})
        z_forms = [self.form_of_z(j) for j in columns]
        rows = {form: self._row(form, columns) for form in forms if form not in z_forms}
        size, order = len(rows) * len(z_forms), min(len(rows), len(z_forms))
        seconds = size * (OF_ENTRY + OF_BIT * order * self.data.bits)
        return Dictionary(rows, z_forms, (), partial(effort.spend, seconds)), columns

    def _row(self, form: int, columns: Sequence[int]) -> list[int]:
        """Return a form in terms of the forms of z, multiplied by a positive
        integer.
        """
        row, scale, constant = self.entries(form)
        moved = scale * constant + sum(a * self.base[j] for j, a in row.items())
        d = Fraction(moved).denominator
        return [int(d * moved), *(d * self.side(j) * row.get(j, 0) for j in columns)]

    def point(self, dictionary: Dictionary, columns: Sequence[int]) -> Values:
        """Return z at the point of a dictionary; a component without a column is at its
        base.
        """
        z, d = list(self.base), int(dictionary.divisor)
        for j in columns:
            z[j] += Fraction(self.side(j) * dictionary.value(self.form_of_z(j)), d)
        return self.filled(z)

    def filled(self, z: Values) -> Values:
        """Return a point with the values of rows computed from its variables."""
        for i in self.rows_of:
            row, scale, _ = self.entries(i)
            z[i] = sum((a * z[j] for j, a in row.items()), Fraction(0)) / scale
        return z
