"""Expressions of the unknowns as a graph without repeated nodes, in which sums are flat and constants are combined."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.model.operators import DOUBLES

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
        """Return the node of a constant."""
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
        if operator == "^" and values[1] is not None and self._is_whole(values[1]):
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

    def _is_whole(self, exponent: Constant) -> bool:
        return bool(abs(exponent) < LARGEST_POWER) and int(exponent) == exponent

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
