"""The states that the unknowns may have, and the polyhedron that is left once some of them are chosen.

Each z_i is counted from a bound: y_i = z_i - l_i, or u_i - z_i where there is only an upper bound, with w_i of the
opposite sign; a free one is y_i. The forms of a dictionary are y_i, w_i and, of a box, the rest u_i - z_i.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from fractions import Fraction
from math import gcd

from lcpcli.rational.dictionary import Dictionary
from lcpcli.rational.polyhedra import Generators
from lcpcli.rational.problem import ExactProblem
from lcpcli.rational.sums import primitive

LOWER, BASIC, UPPER = STATES = range(3)  # z_i = l_i and w_i >= 0, w_i = 0, z_i = u_i and w_i <= 0


class Unknowns:
    """The unknowns of a problem.

    base, side : z = base + side y. boxes : those with two bounds. choices : the states that each may have; none if it
    is fixed. check : called before each node and pivot; it may raise.
    """

    def __init__(self, data: ExactProblem, check: Callable[[], None]) -> None:
        self.data, self.n, self.check = data, data.n, check
        bounds = list(zip(data.lower, data.upper, strict=True))
        self.base = [low if low is not None else high if high is not None else Fraction(0) for low, high in bounds]
        self.side = [-1 if low is None and high is not None else 1 for low, high in bounds]
        self.boxes = {k for k, (low, high) in enumerate(bounds) if low is not None and high is not None and low < high}
        self.choices = [_states(low, high) for low, high in bounds]

    def restricted(self, choices: Sequence[Sequence[int]]) -> Unknowns:
        """The same with fewer choices."""
        other = copy(self)
        other.choices = [tuple(states) for states in choices]
        return other

    def w(self, k: int) -> int:
        """The number of the form w_k; that of y_k is k."""
        return self.n + k

    def zero(self, k: int, state: int) -> int:
        """The number of the form that is 0 in a state."""
        return k if state == UPPER and k not in self.boxes else k + state * self.n

    def z(self, generators: Generators) -> Generators:
        """Vertices, rays and lines in terms of z, from those in terms of y."""
        vertices = [
            tuple(base + side * y for base, side, y in zip(self.base, self.side, vertex, strict=True))
            for vertex in generators.vertices
        ]
        rays, lines = (
            [tuple(side * y for side, y in zip(self.side, each, strict=True)) for each in given]
            for given in generators[1:]
        )
        return Generators(vertices, rays, lines)

    def point(self, node: Node) -> list[Fraction]:
        """z at the node's point."""
        here = node.dictionary
        return [
            base + Fraction(side * here.value(k), int(here.divisor))
            for k, (base, side) in enumerate(zip(self.base, self.side, strict=True))
        ]

    def root(self) -> Node | None:
        """The node where nothing has been chosen; None if the equations and signs that always hold have no solution."""
        kept = [k for k in range(self.n) if self.choices[k]]
        rows = dict[int, list[int]]()
        for k in kept:
            self.check()
            rows[self.w(k)] = self.row(k, kept)[0]
        rows |= {self.zero(k, UPPER): self.width(k, kept) for k in self.boxes}
        bounded = [k for k in kept if len(self.choices[k]) > 1]
        node = Node(Dictionary(rows, list(kept), bounded, self.check), [None] * self.n)
        node.dictionary.signed |= {self.zero(k, UPPER) for k in self.boxes}
        signed = (node.dictionary.require(self.w(k)) for k in bounded if k not in self.boxes)
        free = (self.choose(node, k, BASIC) for k in kept if self.choices[k] == (BASIC,))
        return node if all(free) and all(signed) else None

    def choose(self, node: Node, k: int, state: int) -> bool:
        """Choose a state in a node; False if that is proved to leave nothing of it."""
        here, w = node.dictionary, self.w(k)
        node.states[k] = state
        if state == BASIC or k not in self.boxes:
            return here.vanish(self.zero(k, state))
        if state == UPPER:
            here.negate(w)
        return here.vanish(self.zero(k, state)) and here.require(w)

    def satisfied(self, node: Node) -> int:
        """The states that hold at the node's point, as bits."""
        bits, here = 0, node.dictionary
        for k, states in enumerate(self.choices):
            for state in states:
                if not here.value(self.zero(k, state)) and self._has_sign(node, k, state):
                    bits |= 1 << (len(STATES) * k + state)
        return bits

    def violation(self, node: Node, k: int) -> int:
        """How far an unknown is from any state at the node's point, up to factors of its own."""
        w = node.dictionary.value(self.w(k))
        return abs(w) * node.dictionary.value(self.zero(k, UPPER if w < 0 else self.choices[k][0]))

    def holds(self, node: Node, k: int, state: int) -> bool:
        """Whether a state holds on all of the node."""
        if node.states[k] == state:
            return True
        here = node.dictionary
        if not here.is_zero(self.zero(k, state)):
            return False
        if state == BASIC or k not in self.boxes:
            return True
        return not here.can_have_sign(self.w(k), -1 if state == LOWER else 1)

    def _has_sign(self, node: Node, k: int, state: int) -> bool:
        if state == BASIC or k not in self.boxes or node.states[k] is not None:
            return True
        value = node.dictionary.value(self.w(k))
        return value >= 0 if state == LOWER else value <= 0

    def row(self, k: int, kept: Sequence[int]) -> tuple[list[int], Fraction]:
        """The form w_k in integers, in terms of the y_j that are kept, and the number by which w_k is multiplied."""
        row = self.data.rows[k]
        constant = sum((a * self.base[j] for j, a in row.items()), Fraction(self.data.constants[k]))
        d, side = constant.denominator, self.side[k]
        form = [side * constant.numerator, *(side * d * self.side[j] * row.get(j, 0) for j in kept)]
        return primitive(form), Fraction(side * d * self.data.scales[k], gcd(*form) or 1)

    def width(self, k: int, kept: Sequence[int]) -> list[int]:
        """The form u_k - z_k of a box, the same way."""
        width = (self.data.upper[k] or 0) - self.base[k]
        return [width.numerator, *(-width.denominator if j == k else 0 for j in kept)]


@dataclass
class Node:
    """The polyhedron for some chosen states, None where none is chosen yet."""

    dictionary: Dictionary
    states: list[int | None]

    def copy(self) -> Node:
        """A copy to go on with."""
        return Node(self.dictionary.copy(), list(self.states))


def _states(low: Fraction | None, high: Fraction | None) -> tuple[int, ...]:
    if low is None and high is None:
        return (BASIC,)
    if low is not None and high is not None:
        return (LOWER, BASIC, UPPER) if low < high else ()
    return (LOWER, BASIC) if high is None else (UPPER, BASIC)
