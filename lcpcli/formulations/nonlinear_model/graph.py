"""Expressions of the unknowns as a graph without repeated nodes, in which sums are flat
and constants are combined.

Its operators are evaluated in double precision or in interval arithmetic. Derivatives
are expressions too. They are computed in reverse mode (A. Griewank and A. Walther,
Evaluating Derivatives, 2008, chapter 3): each node on which a row depends has an
adjoint, the derivative of the row with respect to the node. It is the sum, over all
nodes of which the node is an argument, of their adjoints times their partial
derivatives.

An array of m intervals has the shape (2, m), with lower bounds in the first row, and is
rounded outward. IEEE 754 rounds sums, products, quotients and square roots correctly,
so that the adjacent floating-point numbers are bounds; for other functions the relative
error may be ERROR, which is twice the 4 ulps that numpy documents. nan means that the
function is not defined everywhere in the interval (R. E. Moore, R. B. Kearfott and M.
J. Cloud, Introduction to Interval Analysis, 2009).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.typing import Indices, Mask, Vector

Functions: TypeAlias = Mapping[str, Callable[..., Any]]
# Operators whose partial derivative is 0 for an argument that they do not select. The
# derivatives of such an argument may be infinite or undefined, and this 0 is not
# multiplied by them.
BRANCHES = {"if", "min", "max", "abs"}
EPS = float(np.finfo(float).eps)
ERROR = 8 * EPS  # relative, of functions that are not rounded correctly
# Up to here, the number of periods of the sine in an angle is computed with an error
# below MARGIN; larger angles are taken to include an extremum.
LARGEST_ANGLE = 1e8
MARGIN = 1e-6
Interval: TypeAlias = tuple[float, float]
LINE = (-np.inf, np.inf)
POSITIVE = (0.0, np.inf)
UNIT = (-1.0, 1.0)


def _outward(lower: Vector, upper: Vector) -> Vector:
    """Return intervals that contain the numbers whose bounds were rounded to
    nearest.
    """
    return np.stack([np.nextafter(lower, -np.inf), np.nextafter(upper, np.inf)])


def _around(interval: Vector) -> Vector:
    """Return intervals that contain the numbers whose bounds were computed with a
    relative error of at most ERROR.
    """
    signs = np.sign(interval) * ERROR
    return _outward(interval[0] * (1.0 - signs[0]), interval[1] * (1.0 + signs[1]))


def _defined(result: Vector, *arguments: Vector) -> Vector:
    """Return the values of a function, with nan wherever an argument is nan."""
    return np.where(
        np.logical_or.reduce([np.isnan(each).any(axis=0) for each in arguments]),
        np.nan,
        result,
    )


def _line_where(condition: Any, interval: Vector) -> Vector:
    """Return the intervals, with the whole real line wherever a condition is true."""
    return np.stack(
        [
            np.where(condition, -np.inf, interval[0]),
            np.where(condition, np.inf, interval[1]),
        ]
    )


def product(a: Vector, b: Vector) -> Vector:
    """Return a b, where 0 times infinity is 0."""
    products = np.stack(
        [np.where((x == 0) | (y == 0), 0.0, x * y) for x in a for y in b]
    )
    return _defined(_outward(products.min(axis=0), products.max(axis=0)), a, b)


def quotient(a: Vector, b: Vector) -> Vector:
    """Return a / b; the whole real line where b may be 0."""
    quotients = np.stack([x / y for x in a for y in b])
    unbounded = ((b[0] <= 0) & (b[1] >= 0)) | np.isnan(quotients).any(axis=0)
    return _defined(
        _line_where(unbounded, _outward(quotients.min(axis=0), quotients.max(axis=0))),
        a,
        b,
    )


def absolute(a: Vector) -> Vector:
    crosses = (a[0] < 0) & (a[1] > 0)
    sizes = np.abs(a)
    return np.stack([np.where(crosses, 0.0, sizes.min(axis=0)), sizes.max(axis=0)])


def power(a: Vector, exponent: int) -> Vector:
    if exponent < 0:
        return quotient(np.ones_like(a), power(a, -exponent))
    if exponent % 2:
        return _around(np.power(a, float(exponent)))
    lower, upper = _around(np.power(absolute(a), float(exponent)))
    return np.stack([np.maximum(lower, 0.0), upper])


def _reaches(a: Vector, angle: float, period: float) -> Mask:
    """Return for which intervals a multiple of the period may lie at a distance `angle`
    from one of their points; that is, which may contain angle + k period for an integer
    k.
    """
    periods, is_small = (a - angle) / period, np.abs(a).max(axis=0) < LARGEST_ANGLE
    return np.asarray(
        ~is_small | (np.floor(periods[1] + MARGIN) > np.floor(periods[0] - MARGIN))
    )


def _wave(a: Vector, greatest: float, function: Callable[..., Any]) -> Vector:
    """Return the range of the sine or cosine on intervals.

    greatest : an angle at which the function is 1.
    """
    lower, upper = np.clip(_around(np.sort(function(a), axis=0)), -1.0, 1.0)
    lower = np.where(_reaches(a, greatest + np.pi, 2 * np.pi), -1.0, lower)
    upper = np.where(_reaches(a, greatest, 2 * np.pi), 1.0, upper)
    return _defined(np.stack([lower, upper]), a)


def tangent(a: Vector) -> Vector:
    """Return the tangent; the whole real line where the interval may contain a pole."""
    return _line_where(_reaches(a, -np.pi / 2, np.pi), _around(np.tan(a)))


def angle(y: Vector, x: Vector) -> Vector:
    """Return the angle of the point (x, y): a tight interval only where x > 0,
    otherwise [-pi, pi].
    """
    right = INTERVALS["atan"](quotient(y, x))
    circle = _around(np.broadcast_to([[-np.pi], [np.pi]], right.shape))
    return np.where(x[0] > 0, right, _defined(circle, y, x))


def _equal(a: Vector, b: Vector) -> Vector:
    sure = (a[0] == a[1]) & (b[0] == b[1]) & (a[0] == b[0])
    return _defined(
        np.stack([sure, (a[0] <= b[1]) & (b[0] <= a[1])]).astype(float), a, b
    )


def _chosen(condition: Vector) -> Vector:
    """Return 1 or 0 for conditions that certainly hold or fail; the whole real line for
    others, as the function may jump.
    """
    holds, fails = _decided(condition)
    truth = _line_where(~holds & ~fails, np.stack([holds, holds]).astype(float))
    return _defined(truth, condition)


def _if(condition: Vector, a: Vector, b: Vector) -> Vector:
    either = np.stack([np.minimum(a[0], b[0]), np.maximum(a[1], b[1])])
    holds, fails = _decided(condition)
    return np.where(holds, a, np.where(fails, b, either))


def _decided(condition: Vector) -> tuple[Mask, Mask]:
    """Return where a condition, which is any number, is certainly not 0, and where it
    is certainly 0.
    """
    return (condition[0] > 0) | (condition[1] < 0), (condition[0] == 0) & (
        condition[1] == 0
    )


class Operator(NamedTuple):
    """An operator on floating-point numbers and on intervals.

    partials : a function that returns the partial derivatives as nodes of a graph, for
        the graph, the arguments and the value. A derivative is None if the value jumps
        with that argument. The function is None for relations, which jump, and for
        operators that occur only in derivatives.
    """

    doubles: Callable[..., Any]
    intervals: Callable[..., Any]
    partials: Callable[..., list[Any]] | None = None


def _monotone(
    function: Callable[..., Any],
    partials: Callable[..., list[Any]],
    domain: Interval = LINE,
    image: Interval = LINE,
    sign: int = 1,
) -> Operator:
    """Return a monotone function with this domain and image.

    sign : the sign of its derivative.
    """

    def enclosed(a: Vector) -> Vector:
        images = _around(function(np.clip(a, *domain))[::sign])
        return np.where(
            (a[0] < domain[0]) | (a[1] > domain[1]), np.nan, np.clip(images, *image)
        )

    return Operator(function, enclosed, partials)


def _relation(relation: Callable[..., Any], step: int) -> Operator:
    """Return a relation: 1 where it holds, 0 where it does not, [0, 1] where the
    intervals do not decide it.

    step : 1 if the relation remains true when the first argument decreases, -1 if it
        remains true when that increases.
    """

    def of_intervals(a: Vector, b: Vector) -> Vector:
        return _defined(
            np.stack([relation(a[1], b[0]), relation(a[0], b[1])])[::step].astype(
                float
            ),
            a,
            b,
        )

    return Operator(lambda a, b: relation(a, b).astype(float), of_intervals)


def _minus(g: Graph, a: int) -> int:
    return g.sum([(a, -1)])


def _quadratic(g: Graph, constant: int, sign: int, a: int) -> int:
    """Return the constant plus or minus the square of a."""
    return g.sum([(g.apply("^", a, g.number(2.0)), sign)], constant)


def _over(g: Graph, a: int, factor: float = 1.0) -> list[int]:
    return [g.apply("quotient", g.number(factor), a)]


def _over_root(
    constant: int, sign: int, factor: float = 1.0
) -> Callable[..., list[int]]:
    return lambda g, a, _: _over(
        g, g.apply("sqrt", _quadratic(g, constant, sign, a)), factor
    )


def _of_power(g: Graph, a: int, b: int, value: int) -> list[int]:
    by_base = g.apply("product", b, g.apply("^", a, g.sum([(b, 1)], -1)))
    return [by_base, g.apply("product", value, g.apply("log", a))]


def _of_angle(g: Graph, a: int, b: int, _: int) -> list[int]:
    square = g.sum(
        [(g.apply("^", a, g.number(2.0)), 1), (g.apply("^", b, g.number(2.0)), 1)]
    )
    return [g.apply("quotient", b, square), _minus(g, g.apply("quotient", a, square))]


OPERATORS = {
    "product": Operator(np.multiply, product, lambda _, a, b, __: [b, a]),
    # The product of an adjoint and a derivative that may be infinite or undefined: 0 if
    # the adjoint is 0.
    "times": Operator(
        lambda a, b: np.where(a == 0, 0.0, a * b),
        lambda a, b: np.where(np.all(a == 0, axis=0), 0.0, product(a, b)),
    ),
    "quotient": Operator(
        np.divide,
        quotient,
        lambda g, _, b, v: [*_over(g, b), _minus(g, g.apply("quotient", v, b))],
    ),
    "power": Operator(np.power, power),  # with an integer as exponent
    "^": Operator(
        np.power,
        lambda a, b: INTERVALS["exp"](product(b, INTERVALS["log"](a))),
        _of_power,
    ),  # for a >= 0
    "exp": _monotone(np.exp, lambda _, __, v: [v], image=POSITIVE),
    "log": _monotone(np.log, lambda g, a, _: _over(g, a), POSITIVE),
    "log10": _monotone(
        np.log10,
        lambda g, a, _: _over(g, g.apply("product", a, g.apply("log", g.number(10.0)))),
        POSITIVE,
    ),
    "sqrt": _monotone(np.sqrt, lambda g, _, v: _over(g, v, 0.5), POSITIVE),
    "sin": Operator(
        np.sin,
        lambda a: _wave(a, np.pi / 2, np.sin),
        lambda g, a, _: [g.apply("cos", a)],
    ),
    "cos": Operator(
        np.cos,
        lambda a: _wave(a, 0.0, np.cos),
        lambda g, a, _: [_minus(g, g.apply("sin", a))],
    ),
    "tan": Operator(np.tan, tangent, lambda g, _, v: [_quadratic(g, 1, 1, v)]),
    "sinh": _monotone(np.sinh, lambda g, a, _: [g.apply("cosh", a)]),
    "cosh": Operator(
        np.cosh,
        lambda a: np.maximum(_around(np.cosh(absolute(a))), 1.0),
        lambda g, a, _: [g.apply("sinh", a)],
    ),
    "tanh": _monotone(np.tanh, lambda g, _, v: [_quadratic(g, 1, -1, v)], image=UNIT),
    "asin": _monotone(np.arcsin, _over_root(1, -1), UNIT),
    "acos": _monotone(np.arccos, _over_root(1, -1, -1.0), UNIT, sign=-1),
    "atan": _monotone(np.arctan, lambda g, a, _: _over(g, _quadratic(g, 1, 1, a))),
    "asinh": _monotone(np.arcsinh, _over_root(1, 1)),
    "acosh": _monotone(np.arccosh, _over_root(-1, 1), (1.0, np.inf)),
    "atanh": _monotone(
        np.arctanh, lambda g, a, _: _over(g, _quadratic(g, 1, -1, a)), UNIT
    ),
    "atan2": Operator(np.arctan2, angle, _of_angle),
    "abs": Operator(np.abs, absolute, lambda g, a, _: [g.apply("sign", a)]),
    "min": Operator(
        np.minimum,
        np.minimum,
        lambda g, a, b, _: [g.apply("<=", a, b), g.apply(">", a, b)],
    ),
    "max": Operator(
        np.maximum,
        np.maximum,
        lambda g, a, b, _: [g.apply(">=", a, b), g.apply("<", a, b)],
    ),
    "if": Operator(
        lambda c, a, b: np.where(c != 0, a, b),
        _if,
        lambda g, c, _, __, ___: [None, g.apply("chosen", c), g.apply("rejected", c)],
    ),
    "<": _relation(np.less, 1),
    "<=": _relation(np.less_equal, 1),
    ">=": _relation(np.greater_equal, -1),
    ">": _relation(np.greater, -1),
    "=": Operator(lambda a, b: (a == b).astype(float), _equal),
    "!=": Operator(
        lambda a, b: (a != b).astype(float), lambda a, b: 1.0 - _equal(a, b)[::-1]
    ),
    "sign": Operator(
        np.sign,
        lambda a: np.stack(
            [np.where(a[0] > 0, 1.0, -1.0), np.where(a[1] < 0, -1.0, 1.0)]
        ),
    ),
    "chosen": Operator(lambda c: (c != 0).astype(float), _chosen),
    "rejected": Operator(
        lambda c: (c == 0).astype(float), lambda c: 1.0 - _chosen(c)[::-1]
    ),
}
DOUBLES: Functions = {name: operator.doubles for name, operator in OPERATORS.items()}
INTERVALS: Functions = {
    name: operator.intervals for name, operator in OPERATORS.items()
}


class Arithmetic:
    """Floating-point numbers as values of the nodes, in arrays of shape (m,) for m
    nodes.

    functions : the operators for these numbers.
    """

    functions = DOUBLES

    def constants(self, values: Sequence[Any]) -> Vector:
        """Return the constants of a graph as numbers."""
        return np.array([float(value) for value in values])

    def sums(self, terms: Vector, starts: Indices) -> Vector:
        """Return the sums of the terms from each of the starts up to the next one."""
        return np.add.reduceat(terms, starts)


class Intervals(Arithmetic):
    """Intervals as values of the nodes, in arrays of shape (2, m). They contain the
    constants of the graph, which may be Fractions.
    """

    functions = INTERVALS

    def constants(self, values: Sequence[Any]) -> Vector:
        nearest = np.array([float(value) for value in values])
        is_exact = [
            not np.isfinite(double) or Fraction(double) == value
            for double, value in zip(nearest, values, strict=True)
        ]
        return np.where(is_exact, nearest, _outward(nearest, nearest))

    def sums(self, terms: Vector, starts: Indices) -> Vector:
        sizes = np.diff(np.append(starts, terms.shape[-1]))
        lower, upper = np.add.reduceat(terms, starts, axis=-1)
        error = sizes * EPS * np.add.reduceat(np.abs(terms), starts, axis=-1)
        return _outward(lower - error[0], upper + error[1])


Constant = Any  # a float; or a Fraction in an exact graph
# Operators that are not defined for all arguments.
RESTRICTED = {"quotient", "^", "log", "log10", "sqrt", "asin", "acos", "acosh", "atanh"}
LARGEST_POWER = 2**31  # smaller integer exponents are those of the operator "power"


class Sum(NamedTuple):
    """A constant plus multiples of nodes.

    terms : pairs of a node and its coefficient. The coefficient may be 0 only for nodes
        that are not defined everywhere, so that terms that cancel keep restricting the
        domain.
    """

    terms: tuple[tuple[int, Constant], ...]
    constant: Constant


class Operation(NamedTuple):
    """An operator with its arguments, which are nodes.

    exponent : the exponent of the operator "power"; 0 for others.
    """

    operator: str
    arguments: tuple[int, ...]
    exponent: int = 0


class Graph:
    """An expression graph over n unknowns, which are the nodes 0 to n - 1. Arguments
    have smaller numbers than the nodes that use them.

    is_exact : whether constants are Fractions, which are combined without rounding;
        functions of constants are then not evaluated.
    """

    def __init__(self, n: int, is_exact: bool = False) -> None:
        self.n, self.is_exact = n, is_exact
        self._nodes: list[Sum | Operation] = []
        self._arguments: list[Sequence[int]] = []
        self._values: list[Constant | None] = []
        self._known: dict[Sum | Operation, int] = {}
        self._restricted: set[int] = set()  # nodes that are not defined everywhere
        self._shared: set[int] = set()  # sums that stay separate nodes
        self._gradients: dict[int, dict[int, int]] = {}
        self._has_branches = False

    def node(self, number: int) -> Sum | Operation:
        """Return the sum or operation with this number, which is not that of an
        unknown.
        """
        return self._nodes[number - self.n]

    def arguments(self, number: int) -> Sequence[int]:
        """Return the arguments of a node that is not an unknown."""
        return self._arguments[number - self.n]

    def below(self, roots: Iterable[int]) -> set[int]:
        """Return the nodes on which the roots depend, including the roots."""
        reached, pending = set[int](), list(roots)
        while pending:
            number = pending.pop()
            if number not in reached:
                reached.add(number)
                pending += self.arguments(number) if number >= self.n else ()
        return reached

    def _add(self, node: Sum | Operation) -> int:
        number = self._known.get(node)
        if number is None:
            number = self._known[node] = self.n + len(self._nodes)
            self._nodes.append(node)
            self._arguments.append(
                [part for part, _ in node.terms]
                if isinstance(node, Sum)
                else node.arguments
            )
            self._has_branches |= (
                isinstance(node, Operation) and node.operator in BRANCHES
            )
            self._values.append(
                node.constant if isinstance(node, Sum) and not node.terms else None
            )
            is_restricted = isinstance(node, Operation) and (
                node.operator in RESTRICTED or node.exponent < 0
            )
            if is_restricted or not self._restricted.isdisjoint(self.arguments(number)):
                self._restricted.add(number)
        return number

    def share(self, number: int) -> int:
        """Return the node itself, after marking it as used often: if it is not linear,
        it is not expanded in sums that contain it.
        """
        if number >= self.n and any(
            part >= self.n for part, _ in self.parts(number).terms
        ):
            self._shared.add(number)
        return number

    def parts(self, number: int) -> Sum:
        """Return a node as a sum, of one term if it is none."""
        node = None if number < self.n else self.node(number)
        return node if isinstance(node, Sum) else Sum(((number, 1),), 0)

    def constant(self, value: Constant) -> int:
        return self._add(Sum((), value))

    def value(self, number: int) -> Constant | None:
        """Return the value of a constant node; None for other nodes."""
        return None if number < self.n else self._values[number - self.n]

    def sum(self, parts: Sequence[tuple[int, Constant]], constant: Constant = 0) -> int:
        """Return the node of the sum of a constant and of multiples of nodes.

        parts : pairs of a node and its coefficient.
        """
        if len(parts) == 1 and parts[0][1] == 1 and not constant:
            return parts[0][0]
        terms: dict[int, Constant] = {}
        for number, factor in parts:
            flat = (
                Sum(((number, 1),), 0) if number in self._shared else self.parts(number)
            )
            constant = constant + factor * flat.constant if flat.constant else constant
            for part, coefficient in flat.terms:
                terms[part] = (
                    terms[part] + factor * coefficient
                    if part in terms
                    else factor * coefficient
                )
        nonzero = tuple(
            (part, coefficient)
            for part, coefficient in terms.items()
            if coefficient or part in self._restricted
        )
        if not constant and len(nonzero) == 1 and nonzero[0][1] == 1:
            return nonzero[0][0]
        return self._add(Sum(nonzero, constant))

    def apply(self, operator: str, *arguments: int) -> int:
        """Return the node of an operator with these arguments."""
        values = [self.value(argument) for argument in arguments]
        if operator in ("product", "times"):
            for argument, factor in zip(arguments, reversed(values), strict=True):
                if factor is not None:
                    return self.sum([(argument, factor)])
            if arguments[0] == arguments[1]:
                return self._power(arguments[0], 2)
        if operator == "quotient" and values[1] is not None:
            if not values[1]:
                raise ProblemError("", "divides by the constant 0", "correct the model")
            parts = self.parts(arguments[0])
            return self.sum(
                [(part, coefficient / values[1]) for part, coefficient in parts.terms],
                parts.constant / values[1],
            )
        if (
            operator == "^"
            and values[1] is not None
            and abs(values[1]) < LARGEST_POWER
            and int(values[1]) == values[1]
        ):
            return self._power(arguments[0], int(values[1]))
        if None in values or self.is_exact:
            return self._add(Operation(operator, arguments))
        with np.errstate(all="ignore"):
            return self.constant(float(DOUBLES[operator](*map(np.float64, values))))

    def number(self, value: float) -> int:
        return self.constant(Fraction(value) if self.is_exact else value)

    def _power(self, base: int, exponent: int) -> int:
        value = self.value(base)
        if exponent == 1:
            return base
        if exponent == 0:
            return self.sum([(base, 0)], Fraction(1) if self.is_exact else 1.0)
        if value is not None and not (self.is_exact and exponent < 0 and not value):
            with np.errstate(all="ignore"):
                return self.constant(
                    value**exponent
                    if self.is_exact
                    else float(np.float64(value) ** exponent)
                )
        return self._add(Operation("power", (base,), exponent))

    def gradient(self, row: int) -> dict[int, int]:
        """Return the derivatives of a node, as nodes, with respect to the unknowns on
        which it depends, except where it depends on them only by jumps.
        """
        if row in self._gradients:
            return self._gradients[row]
        if all(part < self.n for part, _ in self.parts(row).terms):
            return {x: self.constant(factor) for x, factor in self.parts(row).terms}
        terms = defaultdict[int, list[tuple[int, Constant]]](
            list, {row: [(self.constant(1), 1)]}
        )
        # In this order, a node follows all nodes of which it is an argument.
        for number in sorted(self.below([row]), reverse=True):
            if number < self.n or number not in terms:
                continue
            adjoint = self.share(self.sum(terms.pop(number)))
            if self._has_branches and self.value(adjoint) == 0:
                continue
            node = self.node(number)
            product = "times" if self._has_branches else "product"
            for part, partial in (
                node.terms if isinstance(node, Sum) else self._partials(node, number)
            ):
                if isinstance(node, Sum):
                    terms[part].append((adjoint, partial))
                elif partial is not None and self.value(part) is None:
                    terms[part].append((self.apply(product, adjoint, partial), 1))
        derivatives = self._gradients[row] = {
            x: self.sum(parts) for x, parts in terms.items()
        }
        return derivatives

    def _partials(
        self, node: Operation, value: int
    ) -> Sequence[tuple[int, int | None]]:
        """Return the arguments of an operator, each with the derivative of the value
        with respect to it, or None where the value jumps.
        """
        if all(self.value(argument) is not None for argument in node.arguments):
            return []  # a function of constants, which an exact graph does not evaluate
        if node.operator == "power":
            (a,) = node.arguments
            return [(a, self.sum([(self._power(a, node.exponent - 1), node.exponent)]))]
        partials = OPERATORS[node.operator].partials
        return (
            [*zip(node.arguments, partials(self, *node.arguments, value), strict=True)]
            if partials
            else []
        )
