"""Evaluation of functions that are defined by expressions: one tape, for several
arithmetics.

The nodes of the graph are put into levels such that the arguments of a node have lower
levels; the nodes of a level that have the same operator are evaluated together.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import chain, groupby
from typing import Any, NamedTuple

import numpy as np

from lcpcli.formulations.nonlinear_model.graph import Arithmetic, Graph, Sum
from lcpcli.typing import Indices, Vector

SUM = "sum"  # replaces an operator in groups of sums


class Group(NamedTuple):
    """Nodes with the same operator, and with the same exponent if they are powers.
    Their values are stored consecutively.

    begin : the position of the first value.
    nodes : the numbers of the nodes in the graph.
    arguments : the positions of all first arguments, of all second arguments and so on;
        for sums, the positions of all terms.
    more : the exponent of powers, or the coefficients of terms.
    starts : where the terms of each sum begin; None for other operators.
    """

    operator: str
    begin: int
    nodes: Sequence[int]
    arguments: Sequence[Indices]
    more: tuple[Any, ...] = ()
    starts: Indices | None = None


class Tape:
    """The functions of the rows in an arithmetic.

    graph, rows : the expressions, m nodes of a graph with n unknowns.
    groups : the nodes in the order of evaluation; the last group are the sums of the
        rows.
    places : the position of the value of each node.
    """

    def __init__(
        self, graph: Graph, rows: Sequence[int], arithmetic: Arithmetic
    ) -> None:
        self.n, self.arithmetic = graph.n, arithmetic
        parts = [graph.parts(row) for row in rows]
        below = graph.below(part for sum_parts in parts for part, _ in sum_parts.terms)
        needed = sorted(number for number in below if number >= graph.n)
        fixed = [number for number in needed if graph.value(number) is not None]
        # The first constant, 1, is multiplied by the constants of sums.
        self._constants = arithmetic.constants([1, *map(graph.value, fixed)])
        self.places = {
            number: position
            for position, number in enumerate(chain(range(graph.n), [-1], fixed))
        }
        self._values_known = len(self.places)
        # For each other node its level, operator and exponent, which are equal in a
        # group.
        levels: dict[int, tuple[int, str, int]] = {}
        for number in needed:
            if graph.value(number) is None:
                level = 1 + max(
                    (
                        levels[part][0]
                        for part in graph.arguments(number)
                        if part in levels
                    ),
                    default=0,
                )
                node = graph.node(number)
                levels[number] = (
                    (level, SUM, 0)
                    if isinstance(node, Sum)
                    else (level, node.operator, node.exponent)
                )
        self.groups: list[Group] = []
        for (_, operator, exponent), group in groupby(
            sorted(levels, key=levels.__getitem__), levels.__getitem__
        ):
            nodes, begin = list(group), len(self.places)
            if operator == SUM:
                self._add_sums(nodes, [graph.parts(number) for number in nodes])
            else:
                arguments = [
                    self._indices(each)
                    for each in zip(*map(graph.arguments, nodes), strict=True)
                ]
                exponents = (exponent,) if operator == "power" else ()
                self.groups.append(Group(operator, begin, nodes, arguments, exponents))
            self.places |= {number: begin + i for i, number in enumerate(nodes)}
        self._add_sums(rows, parts)

    def _indices(self, numbers: Iterable[int]) -> Indices:
        return np.array([self.places[number] for number in numbers], np.intp)

    def _add_sums(self, nodes: Sequence[int], parts: Sequence[Sum]) -> None:
        """Add a group of sums. The constant of a sum is a multiple of the value 1; sums
        without terms get the constant 0 in this way.
        """
        terms = [
            [
                *sum_parts.terms,
                *[(-1, sum_parts.constant)]
                * bool(sum_parts.constant or not sum_parts.terms),
            ]
            for sum_parts in parts
        ]
        numbers, factors = zip(*chain(*terms), strict=True) if terms else ((), ())
        starts = np.cumsum([0, *map(len, terms)])[:-1]
        more = (self.arithmetic.constants(factors),)
        self.groups.append(
            Group(SUM, len(self.places), nodes, [self._indices(numbers)], more, starts)
        )

    def values(self, x: Vector) -> Vector:
        """Return the values of the rows.

        x : the unknowns, as numbers of the arithmetic.
        """
        last = self.groups[-1]
        functions = self.arithmetic.functions
        results = x
        values = np.empty((*x.shape[:-1], last.begin))
        values[..., : self.n] = x
        values[..., self.n : self._values_known] = self._constants
        for group in self.groups:
            arguments = [values[..., each] for each in group.arguments]
            if group.starts is None:
                results = functions[group.operator](*arguments, *group.more)
            else:
                results = self.arithmetic.sums(
                    functions["product"](*arguments, *group.more), group.starts
                )
            if group is not last:
                values[..., group.begin : group.begin + len(group.nodes)] = results
        return results


class Jacobian:
    """The Jacobian of rows in an arithmetic.

    rows, columns : the positions of its entries, in the order of rows, then columns.
    """

    def __init__(
        self, graph: Graph, rows: Sequence[int], arithmetic: Arithmetic
    ) -> None:
        entries = {
            (i, x): node
            for i, row in enumerate(rows)
            for x, node in graph.gradient(row).items()
        }
        keys = sorted(entries)
        self.rows, self.columns = np.array(keys, np.intp).reshape(-1, 2).T
        values = [graph.value(entries[key]) for key in keys]
        self._fixed = arithmetic.constants([value or 0 for value in values])
        self._varying = np.flatnonzero([value is None for value in values])
        self._tape = Tape(graph, [entries[keys[i]] for i in self._varying], arithmetic)

    def entries(self, x: Vector) -> Vector:
        """Return the entries of the Jacobian.

        x : the unknowns, as numbers of the arithmetic.
        """
        entries: Vector = self._fixed.copy()
        if self._varying.size:
            entries[..., self._varying] = self._tape.values(x)
        return entries
