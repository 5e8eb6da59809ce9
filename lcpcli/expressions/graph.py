"""Expressions of the unknowns as a graph without repeated nodes, in which sums are flat and constants are combined.

Their operators are evaluated in double precision, and have partial derivatives in any arithmetic.

Interval arithmetic is on arrays of shape (2, m), lower bounds before upper ones, rounded outward. Sums, products,
quotients and square roots are rounded correctly by IEEE 754, so that the neighbouring doubles bound them; for other
functions errors of up to ERROR in their last places are allowed, as numpy states at most 4. nan stands for a function
that is not defined everywhere (R. E. Moore, R. B. Kearfott and M. J. Cloud, Introduction to Interval Analysis, 2009).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.typing import Indices, Mask, Vector

Functions: TypeAlias = Mapping[str, Callable[..., Any]]
BRANCHES = {"if", "min", "max", "abs"}  # with derivatives that are 0 whatever becomes of an argument


def _true(relation: Callable[..., Any]) -> Callable[..., Any]:
    return lambda a, b: relation(a, b).astype(float)


RELATIONS = {
    "<": _true(np.less),
    "<=": _true(np.less_equal),
    "=": _true(np.equal),
    ">=": _true(np.greater_equal),
    ">": _true(np.greater),
    "!=": _true(np.not_equal),
}
DOUBLES: Functions = {
    "number": float,
    **{
        name: getattr(np, name) for name in ("exp", "log", "log10", "sqrt", "sin", "cos", "tan", "sinh", "cosh", "tanh")
    },
    **{name: getattr(np, f"arc{name[1:]}") for name in ("asin", "acos", "atan", "asinh", "acosh", "atanh", "atan2")},
    **RELATIONS,
    "add": np.add,
    "product": np.multiply,
    "quotient": np.divide,
    "power": np.power,  # with an integer as exponent
    "^": np.power,
    "abs": np.abs,
    "min": np.minimum,
    "max": np.maximum,
    "if": lambda condition, a, b: np.where(condition != 0, a, b),
    "sign": np.sign,
    "chosen": lambda condition: (condition != 0).astype(float),
    "rejected": lambda condition: (condition == 0).astype(float),
}


class Arithmetic:
    """Numbers to compute with, in arrays whose last axis counts nodes: doubles, in arrays of shape (m,).

    functions : those of `DOUBLES` for these numbers.
    """

    functions = DOUBLES

    def constants(self, values: Sequence[Any]) -> Vector:
        """Return the constants of a graph as numbers."""
        return np.array([float(value) for value in values])

    def sums(self, terms: Vector, starts: Indices) -> Vector:
        """Return the sums of terms from each of the starts up to the next one."""
        return np.add.reduceat(terms, starts)


def has_derivative(operator: str, argument: int) -> bool:
    """Return whether the values of an operator depend on this argument otherwise than by jumps."""
    return operator not in RELATIONS and (operator, argument) != ("if", 0)


def partials(f: Functions, operator: str, exponent: int, a: Sequence[Vector], value: Vector) -> list[Any]:
    """Return the derivatives of the values of an operator by its arguments; None for those that it jumps with.

    f : the functions of an arithmetic, as `DOUBLES`. exponent : of the operator "power". a : the arguments.
    """
    if operator == "power":
        return [f["product"](float(exponent), f["power"](a[0], exponent - 1))]
    if operator in _PARTIALS:
        return _PARTIALS[operator](f, *a, value)
    return [None] * len(a)  # relations


def _minus(f: Functions, a: Any) -> Any:
    return f["product"](-1.0, a)


def _over_root(f: Functions, radicand: Any, sign: float = 1.0) -> list[Any]:
    return [f["quotient"](sign, f["sqrt"](radicand))]


def _of_angle(f: Functions, a: Any, b: Any, _: Any) -> list[Any]:
    square = f["add"](f["power"](a, 2), f["power"](b, 2))
    return [f["quotient"](b, square), _minus(f, f["quotient"](a, square))]


_PARTIALS: Mapping[str, Callable[..., list[Any]]] = {
    "product": lambda _, a, b, __: [b, a],
    "quotient": lambda f, _, b, v: [f["quotient"](1.0, b), _minus(f, f["quotient"](v, b))],
    "^": lambda f, a, b, v: [f["product"](b, f["^"](a, f["add"](b, -1.0))), f["product"](v, f["log"](a))],
    "exp": lambda _, __, v: [v],
    "log": lambda f, a, _: [f["quotient"](1.0, a)],
    "log10": lambda f, a, _: [f["quotient"](1.0, f["product"](a, f["log"](f["number"](10))))],
    "sqrt": lambda f, _, v: [f["quotient"](0.5, v)],
    "sin": lambda f, a, _: [f["cos"](a)],
    "cos": lambda f, a, _: [_minus(f, f["sin"](a))],
    "tan": lambda f, _, v: [f["add"](1.0, f["power"](v, 2))],
    "sinh": lambda f, a, _: [f["cosh"](a)],
    "cosh": lambda f, a, _: [f["sinh"](a)],
    "tanh": lambda f, _, v: [f["add"](1.0, _minus(f, f["power"](v, 2)))],
    "asin": lambda f, a, _: _over_root(f, f["add"](1.0, _minus(f, f["power"](a, 2)))),
    "acos": lambda f, a, _: _over_root(f, f["add"](1.0, _minus(f, f["power"](a, 2))), -1.0),
    "atan": lambda f, a, _: [f["quotient"](1.0, f["add"](1.0, f["power"](a, 2)))],
    "asinh": lambda f, a, _: _over_root(f, f["add"](1.0, f["power"](a, 2))),
    "acosh": lambda f, a, _: _over_root(f, f["add"](-1.0, f["power"](a, 2))),
    "atanh": lambda f, a, _: [f["quotient"](1.0, f["add"](1.0, _minus(f, f["power"](a, 2))))],
    "atan2": _of_angle,
    "abs": lambda f, a, _: [f["sign"](a)],
    "min": lambda f, a, b, _: [f["<="](a, b), f[">"](a, b)],
    "max": lambda f, a, b, _: [f[">="](a, b), f["<"](a, b)],
    "if": lambda f, c, _, __, ___: [None, f["chosen"](c), f["rejected"](c)],
}


Constant = Any  # a float, or a Fraction in a graph that keeps all digits
RESTRICTED = {"quotient", "^", "log", "log10", "sqrt", "asin", "acos", "acosh", "atanh"}  # not defined everywhere
LARGEST_POWER = 2**31  # of integer exponents


class Sum(NamedTuple):
    """A constant and multiples of nodes.

    terms : pairs of a node and its coefficient, which may be 0 only for nodes that are not defined everywhere, so that
    terms that cancel keep their domain.
    """

    terms: tuple[tuple[int, Constant], ...]
    constant: Constant


class Operation(NamedTuple):
    """An operator with its arguments, which are nodes. exponent : of the operator "power", else 0."""

    operator: str
    arguments: tuple[int, ...]
    exponent: int = 0


class Graph:
    """An expression graph over n unknowns, which are the nodes 0 to n - 1; arguments come before what they are used in.

    is_exact : whether constants are Fractions, which are combined without rounding, and not used by functions.
    """

    def __init__(self, n: int, is_exact: bool = False) -> None:
        self.n, self.is_exact = n, is_exact
        self._nodes: list[Sum | Operation] = []
        self._known: dict[Sum | Operation, int] = {}
        self._restricted: set[int] = set()  # nodes that are not defined everywhere
        self._shared: set[int] = set()  # sums that stay nodes of their own

    def node(self, number: int) -> Sum | Operation:
        """Return a node that is no unknown."""
        return self._nodes[number - self.n]

    def arguments(self, number: int) -> Sequence[int]:
        """Return the nodes that a node, no unknown, is made of."""
        node = self.node(number)
        return [part for part, _ in node.terms] if isinstance(node, Sum) else node.arguments

    def below(self, roots: Iterable[int]) -> set[int]:
        """Return the nodes that the roots depend on, with these."""
        found, waiting = set[int](), list(roots)
        while waiting:
            number = waiting.pop()
            if number not in found:
                found.add(number)
                waiting += self.arguments(number) if number >= self.n else ()
        return found

    def _add(self, node: Sum | Operation) -> int:
        number = self._known.get(node)
        if number is None:
            number = self._known[node] = self.n + len(self._nodes)
            self._nodes.append(node)
            is_restricted = isinstance(node, Operation) and (node.operator in RESTRICTED or node.exponent < 0)
            if is_restricted or not self._restricted.isdisjoint(self.arguments(number)):
                self._restricted.add(number)
        return number

    def share(self, number: int) -> int:
        """Return a node that is used often: one that is not linear is not copied into sums."""
        if number >= self.n and any(part >= self.n for part, _ in self.parts(number).terms):
            self._shared.add(number)
        return number

    def parts(self, number: int) -> Sum:
        """Return a node as a sum."""
        node = None if number < self.n else self.node(number)
        return node if isinstance(node, Sum) else Sum(((number, 1),), 0)

    def constant(self, value: Constant) -> int:
        return self._add(Sum((), value))

    def value(self, number: int) -> Constant | None:
        """Return the value of a constant; None for other nodes."""
        node = None if number < self.n else self.node(number)
        return node.constant if isinstance(node, Sum) and not node.terms else None

    def sum(self, parts: Sequence[tuple[int, Constant]], constant: Constant = 0) -> int:
        """Return the sum of a constant and of multiples of nodes, which are pairs of a node and its coefficient."""
        if len(parts) == 1 and parts[0][1] == 1 and not constant:
            return parts[0][0]
        terms: dict[int, Constant] = {}
        for number, factor in parts:
            flat = Sum(((number, 1),), 0) if number in self._shared else self.parts(number)
            constant = constant + factor * flat.constant if flat.constant else constant
            for part, own in flat.terms:
                terms[part] = terms[part] + factor * own if part in terms else factor * own
        kept = tuple((part, own) for part, own in terms.items() if own or part in self._restricted)
        if not constant and len(kept) == 1 and kept[0][1] == 1:
            return kept[0][0]
        return self._add(Sum(kept, constant))

    def apply(self, operator: str, *arguments: int) -> int:
        """Return the value of an operator of `DOUBLES` for these arguments."""
        values = [self.value(argument) for argument in arguments]
        if operator == "product":
            return self._product(arguments, values)
        if operator == "quotient" and values[1] is not None:
            return self._over(arguments[0], values[1])
        if operator == "^" and values[1] is not None and abs(values[1]) < LARGEST_POWER and int(values[1]) == values[1]:
            return self._power(arguments[0], int(values[1]))
        if None in values or self.is_exact:
            return self._add(Operation(operator, arguments))
        with np.errstate(all="ignore"):
            return self.constant(float(DOUBLES[operator](*map(np.float64, values))))

    def _product(self, arguments: tuple[int, ...], values: list[Constant | None]) -> int:
        for argument, factor in zip(arguments, reversed(values), strict=True):
            if factor is not None:
                return self.sum([(argument, factor)])
        return (
            self._power(arguments[0], 2) if arguments[0] == arguments[1] else self._add(Operation("product", arguments))
        )

    def _over(self, argument: int, divisor: Constant) -> int:
        if not divisor:
            raise ProblemError("", "divides by the constant 0", "correct the model")
        parts = self.parts(argument)
        return self.sum([(part, own / divisor) for part, own in parts.terms], parts.constant / divisor)

    def _power(self, base: int, exponent: int) -> int:
        value = self.value(base)
        if exponent == 1:
            return base
        if exponent == 0:
            return self.sum([(base, 0)], Fraction(1) if self.is_exact else 1.0)
        if value is not None and not (self.is_exact and exponent < 0 and not value):
            with np.errstate(all="ignore"):
                return self.constant(value**exponent if self.is_exact else float(np.float64(value) ** exponent))
        return self._add(Operation("power", (base,), exponent))


EPS = float(np.finfo(float).eps)
ERROR = 8 * EPS  # relative, of functions that are not rounded correctly
LARGEST_ANGLE = 1e8  # whose place between extrema of the sine is known to six digits
MARGIN = 1e-6  # of places between extrema


def number(value: float) -> Vector:
    return np.array([[value], [value]], dtype=float)


def hull(value: Any) -> Vector:
    return number(value) if np.ndim(value) == 0 else np.asarray(value)


def _outward(lower: Vector, upper: Vector) -> Vector:
    """Return bounds of numbers that are rounded to the nearest double."""
    return np.stack([np.nextafter(lower, -np.inf), np.nextafter(upper, np.inf)])


def _around(ends: Vector) -> Vector:
    """Return bounds of numbers with a relative error of at most ERROR."""
    signs = np.sign(ends) * ERROR
    return _outward(ends[0] * (1.0 - signs[0]), ends[1] * (1.0 + signs[1]))


def _unless(undefined: Any, found: Vector) -> Vector:
    return np.where(undefined, np.nan, found)


def add(a: Any, b: Any) -> Vector:
    a, b = hull(a), hull(b)
    return _outward(a[0] + b[0], a[1] + b[1])


def product(a: Any, b: Any) -> Vector:
    """Return a b, where 0 times infinity is 0."""
    a, b = hull(a), hull(b)
    ends = np.stack([a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]])
    zero = np.stack([(x == 0) | (y == 0) for x in a for y in b])
    ends = np.where(zero, 0.0, ends)
    undefined = np.isnan(a).any(axis=0) | np.isnan(b).any(axis=0)
    return _unless(undefined, _outward(ends.min(axis=0), ends.max(axis=0)))


def quotient(a: Any, b: Any) -> Vector:
    """Return a / b; the whole line where b may be 0."""
    a, b = hull(a), hull(b)
    ends = np.stack([a[0] / b[0], a[0] / b[1], a[1] / b[0], a[1] / b[1]])
    unbounded = ((b[0] <= 0) & (b[1] >= 0)) | np.isnan(ends).any(axis=0)
    lower, upper = _outward(ends.min(axis=0), ends.max(axis=0))
    undefined = np.isnan(a).any(axis=0) | np.isnan(b).any(axis=0)
    return _unless(undefined, np.stack([np.where(unbounded, -np.inf, lower), np.where(unbounded, np.inf, upper)]))


def absolute(a: Vector) -> Vector:
    crosses = (a[0] < 0) & (a[1] > 0)
    ends = np.abs(a)
    return np.stack([np.where(crosses, 0.0, ends.min(axis=0)), ends.max(axis=0)])


def power(a: Vector, exponent: int) -> Vector:
    if exponent < 0:
        return quotient(1.0, power(a, -exponent))
    base = absolute(a) if exponent % 2 == 0 else a
    lower, upper = _around(np.power(base, float(exponent)))
    return np.stack([np.maximum(lower, 0.0) if exponent % 2 == 0 else lower, upper])


def general_power(a: Vector, b: Any) -> Vector:
    """Return a to the power of b, for a >= 0."""
    found: Vector = monotone(np.exp, least=0.0)(product(b, monotone(np.log, 0.0)(hull(a))))
    return found


def monotone(
    function: Callable[..., Any],
    low: float = -np.inf,
    high: float = np.inf,
    least: float = -np.inf,
    greatest: float = np.inf,
    sign: int = 1,
) -> Callable[..., Any]:
    """Return a monotone function for intervals, with the sign of its derivative, that is defined from low to high and
    has values from least to greatest."""

    def enclosed(a: Vector) -> Vector:
        found = _around(function(np.clip(a, low, high))[::sign])
        return _unless((a[0] < low) | (a[1] > high), np.clip(found, least, greatest))

    return enclosed


def _passes(turns: Vector) -> Mask:
    """Return whether there may be an integer in an interval."""
    found: Mask = np.floor(turns[1] + MARGIN) > np.floor(turns[0] - MARGIN)
    return found


def _wave(a: Vector, greatest: float, function: Callable[..., Any]) -> Vector:
    """Return sine or cosine. greatest : an angle at which it is 1."""

    def reaches(angle: float) -> Mask:  # an interval that contains the angle, or one that differs by full turns
        return _passes((a - angle) / (2 * np.pi))

    lower, upper = np.clip(_around(np.sort(function(a), axis=0)), -1.0, 1.0)
    far = ~(np.abs(a).max(axis=0) < LARGEST_ANGLE)
    lower = np.where(far | reaches(greatest + np.pi), -1.0, lower)
    upper = np.where(far | reaches(greatest), 1.0, upper)
    return _unless(np.isnan(a).any(axis=0), np.stack([lower, upper]))


def tangent(a: Vector) -> Vector:
    """Return the tangent; the whole line where there may be a pole."""
    pole = ~(np.abs(a).max(axis=0) < LARGEST_ANGLE) | _passes((a + np.pi / 2) / np.pi)
    lower, upper = _around(np.tan(a))
    return np.stack([np.where(pole, -np.inf, lower), np.where(pole, np.inf, upper)])


def angle(y: Vector, x: Vector) -> Vector:
    """Return the angle of the point (x, y), in detail only where x > 0."""
    right = monotone(np.arctan)(quotient(y, x))
    circle = _around(np.broadcast_to([[-np.pi], [np.pi]], right.shape))
    return np.where(x[0] > 0, right, _unless(np.isnan(y).any(axis=0) | np.isnan(x).any(axis=0), circle))


def _relation(sure: Callable[..., Any], possible: Callable[..., Any]) -> Callable[..., Any]:
    """Return a relation: 1 where it holds, 0 where it does not, between them where it is open."""
    return lambda a, b: np.stack([sure(a, b), possible(a, b)]).astype(float)


def _equal(a: Vector, b: Vector) -> tuple[Mask, Mask]:
    return (a[0] == a[1]) & (b[0] == b[1]) & (a[0] == b[0]), (a[0] <= b[1]) & (b[0] <= a[1])


def _chosen(condition: Vector) -> Vector:
    """Return 1 or 0; where the condition is open the whole line, as the function may jump."""
    is_open = (condition[0] == 0) & (condition[1] != 0)
    return np.stack([np.where(is_open, -np.inf, condition[0]), np.where(is_open, np.inf, condition[1])])


def _if(condition: Vector, a: Vector, b: Vector) -> Vector:
    either = np.stack([np.minimum(a[0], b[0]), np.maximum(a[1], b[1])])
    return np.where(condition[0] > 0, a, np.where(condition[1] == 0, b, either))


FUNCTIONS: Functions = {
    "number": number,
    "add": add,
    "product": product,
    "quotient": quotient,
    "power": power,
    "^": general_power,
    "abs": absolute,
    "min": np.minimum,
    "max": np.maximum,
    "exp": monotone(np.exp, least=0.0),
    "log": monotone(np.log, 0.0),
    "log10": monotone(np.log10, 0.0),
    "sqrt": monotone(np.sqrt, 0.0),
    "sin": lambda a: _wave(a, np.pi / 2, np.sin),
    "cos": lambda a: _wave(a, 0.0, np.cos),
    "tan": tangent,
    "sinh": monotone(np.sinh),
    "cosh": lambda a: monotone(np.cosh, least=1.0)(absolute(a)),
    "tanh": monotone(np.tanh, least=-1.0, greatest=1.0),
    "asin": monotone(np.arcsin, -1.0, 1.0),
    "acos": monotone(np.arccos, -1.0, 1.0, sign=-1),
    "atan": monotone(np.arctan),
    "asinh": monotone(np.arcsinh),
    "acosh": monotone(np.arccosh, 1.0),
    "atanh": monotone(np.arctanh, -1.0, 1.0),
    "atan2": angle,
    "<": _relation(lambda a, b: a[1] < b[0], lambda a, b: a[0] < b[1]),
    "<=": _relation(lambda a, b: a[1] <= b[0], lambda a, b: a[0] <= b[1]),
    ">=": _relation(lambda a, b: a[0] >= b[1], lambda a, b: a[1] >= b[0]),
    ">": _relation(lambda a, b: a[0] > b[1], lambda a, b: a[1] > b[0]),
    "=": _relation(lambda a, b: _equal(a, b)[0], lambda a, b: _equal(a, b)[1]),
    "!=": _relation(lambda a, b: ~_equal(a, b)[1], lambda a, b: ~_equal(a, b)[0]),
    "sign": lambda a: np.stack([np.where(a[0] > 0, 1.0, -1.0), np.where(a[1] < 0, -1.0, 1.0)]),
    "if": _if,
    "chosen": _chosen,
    "rejected": lambda condition: _chosen(1.0 - condition[::-1]),
}


class Intervals(Arithmetic):
    """Intervals, which bound the constants of a graph, Fractions or doubles."""

    functions = FUNCTIONS

    def constants(self, values: Sequence[Any]) -> Vector:
        nearest = np.array([float(value) for value in values])
        is_exact = [
            not np.isfinite(double) or Fraction(double) == value for double, value in zip(nearest, values, strict=True)
        ]
        return np.where(is_exact, nearest, _outward(nearest, nearest))

    def sums(self, terms: Vector, starts: Indices) -> Vector:
        sizes = np.diff(np.append(starts, terms.shape[-1]))
        lower, upper = np.add.reduceat(terms, starts, axis=-1)
        error = sizes * EPS * np.add.reduceat(np.abs(terms), starts, axis=-1)
        return _outward(lower - error[0], upper + error[1])
