"""Values of functions that are given as expressions: one tape, in several arithmetics.

The nodes of the graph are put in levels, each of which needs only lower ones, and the nodes of one operator in a level
are evaluated together.

The Jacobian is computed in reverse (A. Griewank and A. Walther, Evaluating Derivatives, 2008, chapter 3). Each pair of
a row and a node that the row depends on has an adjoint, the derivative of the row by the node: the sum, over all nodes
of which the node is an argument, of their adjoints times their partial derivatives. Adjoints are evaluated in levels,
each of which needs only higher ones. Those of the unknowns are the entries of the Jacobian.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from heapq import heappop, heappush
from itertools import chain, groupby
from typing import Any, NamedTuple

import numpy as np

from lcpcli.expressions.graph import BRANCHES, Arithmetic, Graph, Sum, has_derivative, partials
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


Edge = tuple[int, int]  # an argument of a node, and the slot of the partial derivative by it


class _Same(NamedTuple):
    """All nodes of an operator with the same exponent: their places and those of their arguments, and the first slot of
    their partial derivatives, first those by all first arguments, then those by the second ones and so on."""

    operator: str
    exponent: int
    places: Indices
    arguments: Sequence[Indices]
    slot: int


class _Level(NamedTuple):
    """The adjoints from begin to end: sums of terms, each an adjoint above times the partial derivative in a slot.
    starts : where the terms of each sum start; None if each has one."""

    begin: int
    end: int
    above: Indices
    slots: Indices
    starts: Indices | None


class Jacobian:
    """The Jacobian of the functions on a tape. rows, columns : of its entries, in the order of rows, then columns."""

    def __init__(self, tape: Tape) -> None:
        self._tape, self._guarded = tape, any(group.operator in BRANCHES for group in tape.groups)
        self._same: list[_Same] = []
        self._constants: list[Any] = []  # what the slots hold unless it depends on the unknowns
        pairs = _Pairs(tape.graph.n, self._edges())
        for row, own in enumerate(tape.parts):
            pairs.add(row, [(part, self._slot(factor)) for part, factor in own.terms if part >= tape.graph.n])
        self._levels, own_rows, own_columns = pairs.levels()
        self._fixed = tape.arithmetic.constants(self._constants)
        linear = [(row, *term) for row, own in enumerate(tape.parts) for term in own.terms if term[0] < tape.graph.n]
        rows, columns, factors = zip(*linear, strict=True) if linear else ((), (), ())
        keys = np.array(rows, np.intp) * tape.graph.n + np.array(columns, np.intp)
        own_keys = own_rows * tape.graph.n + own_columns
        all_keys = np.unique(np.concatenate([keys, own_keys]), return_index=True)[0]
        self.rows, self.columns = np.divmod(all_keys, max(tape.graph.n, 1))
        self._own = np.searchsorted(all_keys, own_keys)
        self._linear = tape.arithmetic.constants([0] * all_keys.size)
        self._linear[..., np.searchsorted(all_keys, keys)] = tape.arithmetic.constants(factors)

    def _slot(self, constant: Any = 0) -> int:
        self._constants.append(constant)
        return len(self._constants) - 1

    def _edges(self) -> dict[int, list[Edge]]:
        """Return the arguments of all nodes with the slots of the partial derivatives, as far as these may not be 0."""
        tape, edges, same = self._tape, dict[int, list[Edge]](), defaultdict[tuple[str, int], list[int]](list)
        for group in tape.groups:
            if group.operator != SUM:
                same[group.operator, group.exponent] += group.nodes
                continue
            for number in group.nodes:
                edges[number] = [(part, self._slot(factor)) for part, factor in tape.graph.parts(number).terms]
        for (operator, exponent), numbers in same.items():
            slot, arguments = len(self._constants), list(zip(*map(tape.graph.arguments, numbers), strict=True))
            self._constants += [0] * len(numbers) * len(arguments)
            places = [tape.indices(each) for each in arguments]
            self._same.append(_Same(operator, exponent, tape.indices(numbers), places, slot))
            for i, number in enumerate(numbers):
                edges[number] = [
                    (own[i], slot + k * len(numbers) + i)
                    for k, own in enumerate(arguments)
                    if has_derivative(operator, k) and tape.graph.value(own[i]) is None
                ]
        return edges

    def entries(self, x: Vector) -> Vector:
        """Return the entries. x : the unknowns, numbers of the tape's arithmetic."""
        f, values, slots = self._tape.arithmetic.functions, self._tape.nodes(x), self._fixed.copy()
        for own in self._same:
            arguments, size = [values[..., each] for each in own.arguments], len(own.places)
            derivatives = partials(f, own.operator, own.exponent, arguments, values[..., own.places])
            for begin, derivative in zip(range(own.slot, len(self._constants), size), derivatives, strict=False):
                if derivative is not None:
                    slots[..., begin : begin + size] = derivative
        adjoints = np.ones((*x.shape[:-1], self._levels[-1].end if self._levels else 1))
        for level in self._levels:
            above = adjoints[..., level.above]
            terms = f["product"](above, slots[..., level.slots])
            if self._guarded:  # where an argument does not count, its derivative may be undefined
                terms = np.where(np.all(above == 0, axis=tuple(range(above.ndim - 1))), 0.0, terms)
            sums = terms if level.starts is None else self._tape.arithmetic.sums(terms, level.starts)
            adjoints[..., level.begin : level.end] = sums
        found: Vector = self._linear.copy()
        own_adjoints = adjoints[..., adjoints.shape[-1] - self._own.size :]
        found[..., self._own] = f["add"](found[..., self._own], own_adjoints)
        return found


class _Pairs:
    """The pairs of a row and a node that it depends on; the first one is above the nodes of all rows.

    n : the number of unknowns. edges : the arguments of each node.
    """

    def __init__(self, n: int, edges: dict[int, list[Edge]]) -> None:
        self._n, self._edges = n, edges
        self._pairs, self._depths = [(-1, n)], [0]
        self._above: list[int] = []
        self._slots: list[int] = []
        self._below: list[int] = []

    def add(self, row: int, roots: Iterable[Edge]) -> None:
        """Add the pairs of a row, with their depths: the numbers of edges on the longest ways to them."""
        known, waiting = dict[int, int](), list[int]()
        above, edges = 0, roots
        while True:
            for number, slot in edges:
                if number not in known:
                    known[number] = len(self._pairs)
                    self._pairs.append((row, number))
                    self._depths.append(0)
                    if number >= self._n:
                        heappush(waiting, -number)
                own = known[number]
                self._depths[own] = max(self._depths[own], self._depths[above] + 1)
                self._above.append(above)
                self._slots.append(slot)
                self._below.append(own)
            if not waiting:
                return
            number = -heappop(waiting)  # all nodes with it as an argument have come before it
            above, edges = known[number], self._edges[number]

    def levels(self) -> tuple[list[_Level], Indices, Indices]:
        """Return the levels of adjoints, and the rows and the columns of those of the unknowns, which come last."""
        rows, nodes = np.array(self._pairs, np.intp).T
        depths = np.where(nodes < self._n, max(self._depths) + 1, self._depths)
        order = np.lexsort((nodes, rows, depths))
        place = np.empty_like(order)
        place[order] = np.arange(order.size)
        below = place[self._below]
        by_place = np.argsort(below, kind="stable")
        above, slots = place[self._above][by_place], np.array(self._slots, np.intp)[by_place]
        first = np.concatenate([[0], np.cumsum(np.bincount(below, minlength=order.size))])  # edges to pairs before each
        ends = np.flatnonzero(np.diff(depths[order])) + 1  # of the levels, the first of which is the pair above all
        levels = []
        for begin, end in zip(ends, [*ends[1:], order.size], strict=False):
            part = slice(first[begin], first[end])
            is_single = first[end] - first[begin] == end - begin
            starts = None if is_single else first[begin:end] - first[begin]
            levels.append(_Level(int(begin), int(end), above[part], slots[part], starts))
        unknowns = order[nodes[order] < self._n]
        return levels, rows[unknowns], nodes[unknowns]
