"""The complementarity problem of an .nl file: its unknowns, and the function that is
complementary to each of them.

A condition x >= 0 complements F >= 0 of a variable with both bounds means l <= x <= u
complementary to F, unless another condition, such as that of the multiplier of the
upper bound, implies the bound that is not stated. An equation may tie a bounded
variable without a condition to the variable of a condition, or to its function; this
happens where a modeling language introduces a variable for an expression. The bounds of
this variable then belong to that condition.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from fractions import Fraction
from functools import cached_property, partial, reduce
from math import inf, isfinite
from typing import Any, NamedTuple

import numpy as np

from lcpcli.errors import KEEP_ONE, ProblemError, count
from lcpcli.files.contents import within
from lcpcli.files.formats import refuse
from lcpcli.formulations.nonlinear_model.graph import Arithmetic, Graph
from lcpcli.formulations.nonlinear_model.segments import (
    MEANINGS,
    Header,
    Linear,
    Segments,
    Side,
    Term,
)
from lcpcli.formulations.nonlinear_model.tape import SUM, Tape
from lcpcli.rational.numbers import rounded
from lcpcli.typing import Vector

_Parts = list[tuple[int, Any]]  # the nodes of a sum with their coefficients

COMPARING = {
    "min",
    "max",
    "<",
    "<=",
    "=",
    ">=",
    ">",
    "!=",
    "if",
    "and",
    "or",
    "not",
    "<==>",
}  # operators whose arguments may be infinite constants
# The names of operators in a graph, where they differ from those in AMPL.
NAMES = {"*": "product", "/": "quotient", "and": "min", "or": "max", "<==>": "="}
NAMES |= {"square": "^", "less": "max", "not": "="}
# Constants that are the last argument of the operator in a graph.
CONSTANTS = {"square": 2, "less": 0, "not": 0}
SQUARE = (
    "lcp solves square systems: rows with a complementing variable, and as many "
    "equations as other variables"
)
UNCOMPLEMENTED = (
    "lcp needs for each inequality the variable that complements it, as in 0 <= z "
    "complements F(z) >= 0"
)
LEADER = (
    "lcp finds the best of all solutions of a square model; for a leader's variables "
    "and rows write M and q and give --minimize, as in lcp help solutions bilevel"
)
MAX_NAMED = 3  # variables that a message names
LOST = (
    "a variable with two bounds but no row may have lost it, as by inequality() "
    "in Pyomo: "
    "write Var(bounds=(l, u)) and complements(x >= l, F >= 0)"
)


class NlModel:
    """A complementarity problem in n unknowns, made from the segments of a file. Raises
    ProblemError, which gives the reason, if the file has no such problem.

    is_exact : whether the numbers in the segments are Fractions.
    graph : the graph of all expressions.
    complements : for each unknown that a row complements the node of this row.
    equations : the nodes of the equations.
    lower, upper, start : bounds and first values of the unknowns.
    free : the unknowns without a row; there are as many as equations.
    unknowns : for each unknown the number of its variable in the file.
    fixed : the values of the variables that are no unknowns, by number.
    objective : "min" or "max" and the node of an expression; None if there is no
        objective, or a constant one.
    remark : which bounds hold though no condition contains them; "" if there are none.
    """

    def __init__(self, segments: Segments, is_exact: bool = False) -> None:
        self.header: Header = segments.header
        bounds = [_ends(f"v{i}", *side) for i, side in enumerate(segments.bounds)]
        fixed = {
            i: low
            for i, (low, high) in enumerate(bounds)
            if low == high and i not in segments.complements
        }
        self.fixed = {variable: float(value) for variable, value in fixed.items()}
        # The variables that a modeling language has introduced for expressions come
        # last.
        unknowns = (i for i in range(len(bounds)) if i not in fixed)
        self.unknowns = sorted(unknowns, key=segments.auxiliary.__contains__)
        self.graph = graph = Graph(len(self.unknowns), is_exact)
        position = {variable: i for i, variable in enumerate(self.unknowns)}
        self._nodes = {
            i: position[i] if i in position else graph.constant(fixed[i])
            for i in range(len(bounds))
        }
        for number, (linear, terms) in segments.common.items():
            self._nodes[len(bounds) + number] = graph.share(
                self._node(linear, terms, 0)
            )
        self.equations, self.complements = list[int](), dict[int, int]()
        row_of = {row: variable for variable, (row, _) in segments.complements.items()}
        for row, (low, high) in enumerate(segments.sides):
            parts = segments.linear.get(row, {}), segments.rows[row]
            if row in row_of:
                self.complements[position[row_of[row]]] = within(
                    f"C{row}", self._node, *parts, 0
                )
            elif low is not None or high is not None:
                refuse(
                    low != high,
                    f"C{row}",
                    "is an inequality that complements no variable",
                    LEADER if segments.has_objective else UNCOMPLEMENTED,
                )
                self.equations.append(within(f"C{row}", self._node, *parts, -low))
        stated = {
            position[variable]: kind
            for variable, (_, kind) in segments.complements.items()
        }
        conditions = Conditions(self, stated, [bounds[i] for i in self.unknowns])
        self.lower, self.upper = (
            [bound_pair[k] for bound_pair in conditions.bounds] for k in (0, 1)
        )
        self.free = [i for i in range(graph.n) if i not in self.complements]
        if segments.has_objective:
            auxiliary = segments.auxiliary
            declared = [i for i in self.free if self.unknowns[i] not in auxiliary]
            conditions.refuse_leaders(self.free, declared)
        conditions.refuse_others(self.free)
        self.start = np.array(
            [float(segments.start.get(variable, 0)) for variable in self.unknowns]
        )
        self.objective, self.remark = self._objective(segments), conditions.remark()

    @cached_property
    def rows(self) -> list[int]:
        return [
            *(self.complements[i] for i in sorted(self.complements)),
            *self.equations,
        ]

    @property
    def names(self) -> list[str]:
        return [f"v{number}" for number in self.unknowns]

    @cached_property
    def is_linear(self) -> bool:
        n = self.graph.n
        return all(
            part < n for row in self.rows for part, _ in self.graph.parts(row).terms
        )

    @property
    def operators(self) -> dict[str, int]:
        """Return the number of nodes of each operator except sums in the rows, the
        largest number first; equal expressions are one node, constants none.
        """
        counts = Counter[str]()
        for group in Tape(self.graph, self.rows, Arithmetic()).groups:
            counts[group.operator] += len(group.nodes) * (group.operator != SUM)
        return dict((+counts).most_common())

    def values(self, z: Vector) -> Vector:
        model_values = np.empty(len(self.unknowns) + len(self.fixed))
        model_values[[*self.unknowns, *self.fixed]] = np.append(
            z, list(self.fixed.values())
        )
        return model_values

    def multipliers(self, z: Vector) -> Vector:  # noqa: ARG002
        """Return an empty vector: rows of a complementarity problem have no
        multipliers.
        """
        return np.empty(0)

    def _objective(self, segments: Segments) -> tuple[str, int] | None:
        objectives = [
            (
                "max" if is_maximized else "min",
                self._node(segments.slopes.get(number, {}), terms, 0),
            )
            for number, (is_maximized, terms) in segments.objectives.items()
        ]
        objectives = [each for each in objectives if self.graph.value(each[1]) is None]
        refuse(len(objectives) > 1, "", f"has {len(objectives)} objectives", KEEP_ONE)
        return objectives[0] if objectives else None

    def _node(self, linear: Linear, terms: Sequence[Term], constant: Any) -> int:
        parts = [(self._nodes[variable], factor) for variable, factor in linear.items()]
        return self.graph.sum([*parts, (self._expression(terms), 1)], constant)

    def _expression(self, terms: Sequence[Term]) -> int:
        operands: list[_Parts] = []
        for letter, value, size in reversed(terms):
            if letter == "o":
                arguments = [operands.pop() for _ in range(size)]
                operands.append(self._apply(MEANINGS[value][0], arguments))
                continue
            if letter == "p":
                argument = self.graph.sum(operands.pop())
                node = self._piecewise_linear(value[::2], value[1::2], argument)
            elif letter == "v":
                node = self._nodes[value]
            else:
                node = self.graph.constant(value)
            operands.append([(node, 1)])
        return self.graph.sum(operands.pop())

    def _apply(self, name: str, arguments: Sequence[_Parts]) -> _Parts:
        """Return the value of an operator as a list of terms, so that a sum of sums
        becomes a single node.
        """
        graph = self.graph
        constants = map(
            graph.value,
            ()
            if name in COMPARING
            else (node for part in arguments for node, _ in part),
        )
        if lost := next(
            (value for value in constants if value and not isfinite(value)), None
        ):
            reason = (
                f"computes with the constant {float(lost):g}, so that it is finite "
                "nowhere"
            )
            raise ProblemError(
                "",
                reason,
                "correct it; the program that wrote the file may have divided by 0",
            )
        if name in ("+", "-", "sum", "negative"):
            first, *others = ([], *arguments) if name == "negative" else arguments
            for part in others:  # added to `first` itself, as sums may have many terms
                first += (
                    [(node, -factor) for node, factor in part]
                    if name in ("-", "negative")
                    else part
                )
            return first
        nodes = [graph.sum(part) for part in arguments]
        if name == "less":  # max(a - b, 0)
            nodes = [graph.sum([(nodes[0], 1), (nodes[1], -1)])]
        if name in CONSTANTS:
            nodes.append(graph.constant(CONSTANTS[name]))
        apply = partial(graph.apply, name := NAMES.get(name, name))
        return [(reduce(apply, nodes) if name in ("min", "max") else apply(*nodes), 1)]

    def _piecewise_linear(
        self, slopes: Sequence[Any], breakpoints: Sequence[Any], argument: int
    ) -> int:
        """Return the piecewise linear function with these slopes that is 0 at 0: a
        linear function plus a multiple of max(x - b, 0) for each breakpoint b.
        """
        graph, zero = self.graph, self.graph.constant(0)
        parts, constant = [(argument, slopes[0])], 0
        for breakpoint, slope_before, slope_after in zip(
            breakpoints, slopes, slopes[1:], strict=False
        ):
            kink = graph.apply("max", graph.sum([(argument, 1)], -breakpoint), zero)
            parts.append((kink, slope_after - slope_before))
            constant -= (slope_after - slope_before) * max(-breakpoint, 0)
        return graph.sum(parts, constant)


def _ends(where: str, low: Any, high: Any) -> Side:
    low, high = -inf if low is None else low, inf if high is None else high
    if not low <= high or low == inf or high == -inf:
        raise ProblemError(
            where, f"has the bounds {float(low):g} and {float(high):g}", "correct them"
        )
    return low, high


LOWER = 1
UPPER = 2
BOTH = 3
WORDS = {
    0: "no bounds",
    LOWER: "a lower bound",
    UPPER: "an upper bound",
    BOTH: "both bounds",
}
BoundPair = tuple[Any, Any]  # bounds: Fractions, or infinite
NONE: BoundPair = (-inf, inf)
LOST_BOUNDS = (
    "if it is inequality(l, e, u) of an expression in Pyomo, which loses the "
    "bounds, write a variable y with "
    "Var(bounds=(l, u)), the constraint y == e and complements(y >= l, F >= 0); "
    "else write an equation"
)
# The bounds of the function of a condition, by the only bound of its unknown: if that
# is a lower bound, the function is nonnegative.
SIGNS: dict[int, BoundPair] = {LOWER: (0, inf), UPPER: (-inf, 0)}


class Affine(NamedTuple):
    """The affine function slope z_i + constant of unknown i.

    range : returns the bounds of the function for bounds of z_i.
    domain : returns the bounds of z_i for bounds of the function.
    """

    i: int
    slope: Fraction
    constant: Fraction

    def of(self, slope: Fraction, constant: Fraction) -> Affine:
        return Affine(self.i, slope * self.slope, slope * self.constant + constant)

    def range(self, bounds: BoundPair) -> BoundPair:
        sign = 1 if self.slope > 0 else -1
        images = [
            self.slope * bound + self.constant if _is_finite(bound) else sign * bound
            for bound in bounds
        ]
        return min(images), max(images)

    def domain(self, bounds: BoundPair) -> BoundPair:
        return Affine(self.i, 1 / self.slope, -self.constant / self.slope).range(bounds)


def kinds_of(low: Any, high: Any) -> int:
    return LOWER * bool(low > -inf) + UPPER * bool(high < inf)


class Conditions:
    """The conditions of a model, and the bounds of its unknowns, which are brought into
    agreement.

    The bounds of unknowns without a condition are moved to the unknowns to which
    equations tie them; then it is decided which bounds each condition means. Raises
    ProblemError if a condition contains a bound that its variable does not have.

    stated : which bounds the condition of an unknown contains (LOWER, UPPER or BOTH).
    bounds : the bounds of the unknowns.
    read : the bounds of the variables that have bounds which their condition does not
        contain, and which are nevertheless enforced.
    """

    def __init__(
        self, model: NlModel, stated: dict[int, int], bounds: list[BoundPair]
    ) -> None:
        self.graph, self.equations = model.graph, model.equations
        self.names, self.complements = model.names, model.complements
        self.bounds, self.read = bounds, dict[int, BoundPair]()
        self._stated, self._owners = stated, dict[int, int]()
        bounded = [
            x
            for x, sides in enumerate(bounds)
            if x not in self.complements and kinds_of(*sides)
        ]
        for x in [x for x in bounded if not self._drop_implied(x)]:
            self._give_bounds(x)
        for x, kind in self._stated.items():
            low, high = self.bounds[x]
            actual_kind = kinds_of(low, high)
            if actual_kind == kind == 0:
                self._refuse_lost(x)
            if low < high and kind not in (actual_kind, BOTH):
                self._resolve_bounds(x, kind, actual_kind)

    def refuse_leaders(self, free: Sequence[int], declared: Sequence[int]) -> None:
        """Raise ProblemError if there are more unknowns without a row than equations,
        so that the objective has to choose some of them.

        declared : the unknowns without a row that were not introduced for expressions.
        """
        excess = len(free) - len(self.equations)
        if excess > 0:
            names = ", ".join(self.names[i] for i in declared[:MAX_NAMED])
            which = f": {names}" if len(declared) == excess <= MAX_NAMED else ""
            reason = (
                f"leaves {count(excess, 'variable')} without a row to its objective, "
                f"as those of a leader{which}"
            )
            raise ProblemError("", reason, LEADER)

    def refuse_others(self, free: Sequence[int]) -> None:
        """Raise ProblemError unless there are as many equations as unknowns without a
        row, and none of these has bounds.
        """
        kinds = {i: kind for i in free if (kind := kinds_of(*self.bounds[i]))}
        if len(free) != len(self.equations):
            reason = (
                f"has {count(len(self.equations), 'equation')} for "
                f"{count(len(free), 'variable')}"
            )
            is_lost = BOTH in kinds.values() and len(self.equations) < len(free)
            raise ProblemError(
                "",
                f"{reason} that no row complements",
                f"{SQUARE}; {LOST}" if is_lost else SQUARE,
            )
        hint = (
            "complement it with a row, or take its bounds out: equations do not "
            "keep them"
        )
        refuse(
            kinds,
            "".join(self.names[i] for i in [*kinds][:1]),
            "has bounds but no row that it complements",
            hint,
        )

    def remark(self) -> str:
        if not self.read:
            return ""
        (x, (low, high)), *others = self.read.items()
        lower = f"{_double(low):g} <= " if low > -inf else ""
        upper = f" <= {_double(high):g}" if high < inf else ""
        text = (
            f"{lower}{self.names[x]}{upper} is complementary to the expression of "
            "its condition, which has "
        )
        more = (
            f", and likewise for {count(len(others), 'other variable')}"
            if others
            else ""
        )
        return f"{text}fewer bounds than the variable has{more}"

    def _resolve_bounds(self, x: int, stated: int, actual: int) -> None:
        """Drop the bounds of x that are not stated if other conditions imply them;
        otherwise record that they are enforced.
        """
        if stated & ~actual or stated not in WORDS:
            said, has = (
                WORDS.get(each, f"the kind {each} of bounds")
                for each in (stated, actual)
            )
            hint = "write the bounds of the variable in its complementarity condition"
            raise ProblemError(
                self.names[x], f"is complemented with {said}, but has {has}", hint
            )
        if not self._drop_implied(x, stated):
            owner = self._owners.get(x, x)
            self.read[owner] = self._tied(x)[owner].range(self._ends(x))

    def _refuse_lost(self, x: int) -> None:
        """Raise ProblemError if an unknown x without bounds is complementary to a
        single other unknown, and each of the two occurs otherwise only in an equation
        that defines it. Pyomo writes this for an expression with bounds, whose bounds
        are then lost.
        """
        terms, constant = self.graph.parts(self.complements[x])
        u = terms[0][0] if len(terms) == 1 and not constant else x
        if (
            u == x
            or u >= self.graph.n
            or u in self.complements
            or kinds_of(*self.bounds[u])
        ):
            return
        equation = self._definition(x)
        other_equation = self._definition(u, self.complements[x])
        if (
            equation is not None
            and other_equation is not None
            and equation != other_equation
        ):
            raise ProblemError(
                self.names[x],
                f"is complementary to {self.names[u]}, and neither has bounds",
                LOST_BOUNDS,
            )

    def _definition(self, x: int, condition: int | None = None) -> int | None:
        """Return the equation that is x or -x plus other terms, if x occurs in no other
        row except this condition; otherwise None.
        """
        rows = [row for row in self._rows_with.get(x, ()) if row != condition]
        if len(rows) != 1 or rows[0] not in self.equations:
            return None
        terms = self.graph.parts(rows[0]).terms
        is_plain = any(part == x and abs(factor) == 1 for part, factor in terms)
        return (
            rows[0]
            if is_plain
            and x not in self.graph.below(part for part, _ in terms if part != x)
            else None
        )

    @cached_property
    def _rows_with(self) -> dict[int, list[int]]:
        """Return for each unknown the rows in which it occurs."""
        rows_by_unknown = dict[int, list[int]]()
        for row in (*self.equations, *self.complements.values()):
            for x in self.graph.below([row]):
                rows_by_unknown.setdefault(x, []).append(row)
        return rows_by_unknown

    def _drop_implied(self, x: int, stated: int = 0) -> bool:
        """Drop the bounds of x that are not stated and that other conditions imply, by
        the bounds of their unknowns or the signs of their functions. Return whether x
        has exactly the stated bounds afterwards.
        """
        (low, high), exact_bounds = self.bounds[x], self._ends(x)
        domains = [
            value.domain(sides) for y, value, sides, _ in self._sides(x) if y != x
        ]
        if not stated & LOWER and exact_bounds[0] <= max(
            (bound for bound, _ in domains), default=-inf
        ):
            low = -inf
        if (
            not stated & UPPER
            and min((bound for _, bound in domains), default=inf) <= exact_bounds[1]
        ):
            high = inf
        self.bounds[x] = low, high
        return kinds_of(low, high) == stated

    def _give_bounds(self, x: int) -> None:
        if (condition := self._condition_on(x)) is None:
            return
        (y, value), exact_bounds = condition, self._ends(x)
        if value == self._tied(x).get(y):
            (low, high), implied = self._ends(y), value.range(exact_bounds)
            self._set(y, (max(low, implied[0]), min(high, implied[1])))
            self.bounds[x], self._owners[y] = NONE, x
        else:
            self._exchange(x, y, value)

    def _condition_on(self, x: int) -> tuple[int, Affine] | None:
        """Return the unknown of the condition one of whose sides is x or -x plus a
        constant, and this side as an affine function; None if there is no such
        condition. Conditions whose side has a bound in common with x are preferred.
        """
        finite_bounds = {bound for bound in self._ends(x) if _is_finite(bound)}
        fit = [
            (finite_bounds.isdisjoint(value.domain(sides)), y, value)
            for y, value, sides, is_function in self._sides(x)
            if abs(value.slope) == 1
            and (
                not is_function or kinds_of(*self.bounds[y]) == self._stated[y] in SIGNS
            )
        ]
        return min(fit, key=lambda side: side[0])[1:] if fit else None

    def _sides(self, x: int) -> list[tuple[int, Affine, BoundPair, bool]]:
        """Return the sides of conditions that are affine functions of x, unknowns
        before functions. For each: the unknown of the condition, the affine function,
        the bounds that the condition implies for it, and whether it is the function of
        the condition.
        """
        tied = self._tied(x)
        sides = [
            (y, value, self._ends(y), False)
            for y, value in tied.items()
            if y in self.complements
        ]
        for u, value in tied.items():
            for y, slope, constant in self._single.get(u, ()):
                if y in self.complements:
                    function = value.of(slope, constant)
                    implied = SIGNS.get(kinds_of(*self.bounds[y]), NONE)
                    sides.append((y, function, implied, True))
        return sides

    def _exchange(self, x: int, y: int, function: Affine) -> None:
        low, high = self.bounds[y]
        sign = 1 if function.slope > 0 else -1
        self.complements[x] = self.graph.sum(
            [(y, sign)], -sign * (low if low > -inf else high)
        )
        implied, exact_bounds = function.domain(SIGNS[self._stated[y]]), self._ends(x)
        self._set(
            x, (max(implied[0], exact_bounds[0]), min(implied[1], exact_bounds[1]))
        )
        self.bounds[y] = NONE
        del self.complements[y], self._stated[y]
        self.read[x], self._stated[x] = self.bounds[x], BOTH

    @cached_property
    def _single(self) -> dict[int, list[tuple[int, Fraction, Fraction]]]:
        """Return for each unknown the conditions whose functions are a multiple of it
        plus a constant: the unknown of the condition, the multiple and the constant.
        """
        conditions_by_unknown = dict[int, list[tuple[int, Fraction, Fraction]]]()
        for y, node in self.complements.items():
            terms, constant = self.graph.parts(node)
            if (
                len(terms) == 1
                and terms[0][0] < self.graph.n
                and isfinite(terms[0][1])
                and isfinite(constant)
            ):
                conditions_by_unknown.setdefault(terms[0][0], []).append(
                    (y, _fraction(terms[0][1]), _fraction(constant))
                )
        return conditions_by_unknown

    def _tied(self, x: int) -> dict[int, Affine]:
        """Return the unknowns that are affine functions of x by equations in two
        unknowns each, with these functions; x itself is the first.
        """
        functions = {x: Affine(x, Fraction(1), Fraction(0))}
        for u in (reached := [x]):
            for v, slope, constant in self._relations.get(u, ()):
                if v not in functions:
                    functions[v] = functions[u].of(slope, constant)
                    reached.append(v)
        return functions

    @cached_property
    def _relations(self) -> dict[int, list[tuple[int, Fraction, Fraction]]]:
        """Return for each unknown u the others that an equation makes slope u +
        constant, with the slope and the constant.
        """
        relations = dict[int, list[tuple[int, Fraction, Fraction]]]()
        for node in self.equations:
            terms, constant = self.graph.parts(node)
            if len(terms) == 2 and all(
                u < self.graph.n and isfinite(factor)
                for u, factor in (*terms, (0, constant))
            ):
                for (u, a), (v, b) in (terms, terms[::-1]):
                    ratio = -_fraction(a) / _fraction(b)
                    relations.setdefault(u, []).append(
                        (v, ratio, -_fraction(constant) / _fraction(b))
                    )
        return relations

    def _ends(self, x: int) -> BoundPair:
        low, high = self.bounds[x]
        return _fraction(low), _fraction(high)

    def _set(self, x: int, bounds: BoundPair) -> None:
        reason = (
            f"has the bounds {_double(bounds[0]):g} and {_double(bounds[1]):g} by its "
            "complementarity condition"
        )
        refuse(bounds[0] > bounds[1], self.names[x], reason, "correct them")
        low, high = map(_double, bounds)
        exact = tuple(
            bound if isfinite(double) else double
            for bound, double in zip(bounds, (low, high), strict=True)
        )
        self.bounds[x] = (exact[0], exact[1]) if self.graph.is_exact else (low, high)


def _is_finite(value: Any) -> bool:
    return isinstance(value, Fraction) or isfinite(value)


def _double(value: Any) -> float:
    return float(rounded([value])[0]) if isinstance(value, Fraction) else float(value)


def _fraction(value: Any) -> Any:
    """Return the shortest decimal of a number as a Fraction; an infinite number as it
    is.
    """
    if not isfinite(value):
        return value
    return Fraction(repr(value) if isinstance(value, float) else value)
