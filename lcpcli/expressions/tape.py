"""Values of functions that are given as expressions: one tape, in several arithmetics.

The nodes of the graph are put in levels, each of which needs only lower ones, and the nodes of one operator in a level
are evaluated together.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import chain, groupby
from typing import NamedTuple

import numpy as np

from lcpcli.expressions.graph import Arithmetic, Graph, Sum
from lcpcli.typing import Indices, Vector

SUM = "sum"  # in place of an operator


class Group(NamedTuple):
    """The nodes of one operator, at the places from begin to end, with the same exponent if they are powers.

    nodes : their numbers in the graph. arguments : the places of the first arguments, of the second ones and so on. Of
    sums there are the places and the coefficients of all terms, and where each sum starts.
    """

    operator: str
    exponent: int
    begin: int
    nodes: Sequence[int]
    arguments: Sequence[Indices] = ()
    factors: Vector | None = None
    starts: Indices | None = None


class Tape:
    """The functions of the rows in an arithmetic.

    graph, rows : the expressions, m nodes of a graph with n unknowns. groups : the nodes in the order of evaluation.
    places : the place of each node among the values. total : the sums of the rows, as a group.
    """

    def __init__(self, graph: Graph, rows: Sequence[int], arithmetic: Arithmetic) -> None:
        self.graph, self.arithmetic = graph, arithmetic
        self.parts = [graph.parts(row) for row in rows]
        below = graph.below(part for own in self.parts for part, _ in own.terms)
        needed = sorted(number for number in below if number >= graph.n)
        fixed = [number for number in needed if graph.value(number) is not None]
        self._constants = arithmetic.constants([1, *map(graph.value, fixed)])  # the first one is for sums
        self.places = {number: place for place, number in enumerate(chain(range(graph.n), [-1], fixed))}
        self._values_known = len(self.places)
        self.groups: list[Group] = []
        for (_, operator, exponent), nodes in groupby(self._in_levels(needed), self._levels.__getitem__):
            self._append(operator, exponent, list(nodes))
        self.total = self._sums(self.parts, Group(SUM, 0, len(self.places), ()))

    def _in_levels(self, needed: Iterable[int]) -> list[int]:
        """Return the nodes that are no constants in the order of evaluation."""
        self._levels: dict[int, tuple[int, str, int]] = {}
        for number in needed:
            node = self.graph.node(number)
            if self.graph.value(number) is None:
                below = (self._levels[part][0] for part in self.graph.arguments(number) if part in self._levels)
                own = (SUM, 0) if isinstance(node, Sum) else (node.operator, node.exponent)
                self._levels[number] = 1 + max(below, default=0), *own
        return sorted(self._levels, key=self._levels.__getitem__)

    def _append(self, operator: str, exponent: int, numbers: list[int]) -> None:
        begin = len(self.places)
        group = Group(operator, exponent, begin, numbers)
        if operator == SUM:
            group = self._sums([self.graph.parts(number) for number in numbers], group)
        else:
            arguments = zip(*map(self.graph.arguments, numbers), strict=True)
            group = group._replace(arguments=[self.indices(each) for each in arguments])
        self.places |= {number: begin + i for i, number in enumerate(numbers)}
        self.groups.append(group)

    def indices(self, numbers: Iterable[int]) -> Indices:
        return np.array([self.places[number] for number in numbers], np.intp)

    def _sums(self, parts: Sequence[Sum], group: Group) -> Group:
        """Return the group with several sums; a constant is a multiple of one, also where there are no terms."""
        terms = [[*own.terms, *[(-1, own.constant)] * bool(own.constant or not own.terms)] for own in parts]
        numbers, factors = zip(*chain(*terms), strict=True) if terms else ((), ())
        starts = np.cumsum([0, *map(len, terms)])[:-1]
        found = self.arithmetic.constants(factors)
        return group._replace(arguments=[self.indices(numbers)], factors=found, starts=starts)

    def nodes(self, x: Vector) -> Vector:
        """Return the values of all nodes. x : the unknowns, numbers of the arithmetic."""
        values = np.empty((*x.shape[:-1], self.total.begin))
        values[..., : self.graph.n] = x
        values[..., self.graph.n : self._values_known] = self._constants
        for group in self.groups:
            values[..., group.begin : group.begin + len(group.nodes)] = self.of(group, values)
        return values

    def values(self, x: Vector) -> Vector:
        return self.of(self.total, self.nodes(x))

    def of(self, group: Group, values: Vector) -> Vector:
        """Return the values of a group from those of its arguments."""
        f, arguments = self.arithmetic.functions, [values[..., each] for each in group.arguments]
        found: Vector
        if group.starts is not None:
            found = self.arithmetic.sums(f["product"](*arguments, group.factors), group.starts)
        elif group.operator == "power":
            found = f["power"](*arguments, group.exponent)
        else:
            found = f[group.operator](*arguments)
        return found


class Jacobian:
    """The Jacobian of rows in an arithmetic. rows, columns : of its entries, in the order of rows, then columns."""

    def __init__(self, graph: Graph, rows: Sequence[int], arithmetic: Arithmetic) -> None:
        entries = {(i, x): node for i, row in enumerate(rows) for x, node in graph.gradient(row).items()}
        keys = sorted(entries)
        self.rows, self.columns = np.array(keys, np.intp).reshape(-1, 2).T
        values = [graph.value(entries[key]) for key in keys]
        self._fixed = arithmetic.constants([value or 0 for value in values])
        self._varying = np.flatnonzero([value is None for value in values])
        self._tape = Tape(graph, [entries[keys[i]] for i in self._varying], arithmetic)

    def entries(self, x: Vector) -> Vector:
        """Return the entries. x : the unknowns, numbers of the arithmetic."""
        found: Vector = self._fixed.copy()
        if self._varying.size:
            found[..., self._varying] = self._tape.values(x)
        return found
