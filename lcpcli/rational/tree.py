"""Branch and bound over the basis status of the unknowns, in which every branch that is
cut off has a proof.

`explored` is the search for all solutions, the best solution, and complementary sets. A
class of nodes, such as `Unknowns` in exact arithmetic, says which nodes are cut off and
which are their children; the queue says which node is next.

Each z_i is measured from a bound: y_i = z_i - l_i, or u_i - z_i if there is only an
upper bound, with w_i of the opposite sign; a free z_i is y_i itself. The forms of a
dictionary are y_i, w_i and, for an unknown with two bounds, u_i - z_i.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from fractions import Fraction
from math import gcd, lcm
from typing import Any

from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.rational.dictionary import Dictionary, Direction, RationalPoint, Vertex
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import primitive

# The form of an objective has the number 3 n, after those of y, w and u - z.
OBJECTIVE = 3


class Unknowns:
    """The unknowns of a problem, z = base + side y; those with two bounds are `boxes`.

    choices : the basis statuses that each unknown may have; none if it is fixed. bits,
        masks, meaning : all choices as bits, the choices of each unknown, and the
        meaning of each bit. check : called before each node and pivot; it may raise.
    cover : nodes that lie in one of its pieces are cut off.
    """

    def __init__(self, data: ExactProblem, check: Callable[[], None]) -> None:
        self.data = data
        self.n = data.n
        self.check = check
        bounds = list(zip(data.lower, data.upper, strict=True))
        self.base = [
            (high or Fraction(0)) if low is None else low for low, high in bounds
        ]
        self.side = [
            -1 if low is None and high is not None else 1 for low, high in bounds
        ]
        self._is_moved = any(self.base) or -1 in self.side
        self.cover = Cover()
        self.boxes = {
            k
            for k, (low, high) in enumerate(bounds)
            if low is not None and high is not None and low < high
        }
        self.allow([_states(low, high) for low, high in bounds])

    def restricted(self, bits: int) -> Unknowns:
        """Return the same unknowns with these choices only, and a cover that consists
        of the piece of all of them.
        """
        other = copy(self)
        other.cover = Cover(bits)
        other.allow(
            [
                [state for state in statuses if bits & self.bit(k, state)]
                for k, statuses in enumerate(self.choices)
            ]
        )
        return other

    def allow(self, choices: Sequence[Sequence[int]]) -> None:
        """Replace the choices; for each unknown they are branched on in this order."""
        self.choices = choices
        self.meaning = {
            self.bit(k, state): (k, state)
            for k, statuses in enumerate(choices)
            for state in statuses
        }
        self.bits = sum(self.meaning)
        self.masks = [
            sum(self.bit(k, state) for state in statuses)
            for k, statuses in enumerate(choices)
        ]

    def w(self, k: int) -> int:
        """Return the number of the form w_k; the number of y_k is k."""
        return self.n + k

    def zero(self, k: int, state: int) -> int:
        """Return the number of the form that is 0 with this status."""
        return (
            k
            if state == UPPER and k not in self.boxes
            else k + (state - LOWER) * self.n
        )

    def bit(self, k: int, state: int) -> int:
        """Return the bit of a status in a bit mask of statuses: that of the form that
        is 0.
        """
        return 1 << self.zero(k, state)

    def vertex(self, values: Direction) -> RationalPoint:
        """Return a point z from a divisor and the values of y multiplied by it."""
        divisor, *y = values
        if self._is_moved:
            moved = zip(self.base, self.side, y, strict=True)
            return Vertex(
                base + side * Fraction(value, divisor) for base, side, value in moved
            )
        return Vertex(Fraction(value, divisor) for value in y)

    def point(self, node: Node) -> RationalPoint:
        """Return z at the point of a node."""
        dictionary = node.dictionary
        return self.vertex(
            (int(dictionary.divisor), *map(dictionary.value, range(self.n)))
        )

    def direction(self, y: Direction) -> RationalPoint:
        """Return a ray or a line in z from its direction in y."""
        return tuple(
            Fraction(side * value) for side, value in zip(self.side, y, strict=True)
        )

    def objective(self, costs: Sequence[Fraction]) -> tuple[dict[int, list[int]], int]:
        """Return the form costs'z in terms of y, under its number and multiplied by an
        integer, and that integer.
        """
        nonfixed = [k for k in range(self.n) if self.choices[k]]
        constant = sum(
            (cost * base for cost, base in zip(costs, self.base, strict=True)),
            Fraction(0),
        )
        scale = lcm(constant.denominator, *(costs[k].denominator for k in nonfixed))
        row = [
            int(constant * scale),
            *(int(self.side[k] * costs[k] * scale) for k in nonfixed),
        ]
        return {OBJECTIVE * self.n: row}, scale

    def root(self, others: dict[int, list[int]] | None = None) -> Node | None:
        """Return the node without choices, with additional forms; None if the
        conditions that hold in all nodes have no solution.
        """
        rows, _, nonfixed = self.forms()
        rows |= others or {}
        bounded = [k for k in nonfixed if len(self.choices[k]) > 1]
        widths = [self.zero(k, UPPER) for k in self.boxes]
        node = Node(
            Dictionary(rows, list(nonfixed), [*bounded, *widths], self.check),
            [None] * self.n,
        )
        signed = (
            node.dictionary.require(self.w(k)) for k in bounded if k not in self.boxes
        )
        free = (
            self.choose(node, k, BASIC) for k in nonfixed if self.choices[k] == (BASIC,)
        )
        return node if all(free) and all(signed) else None

    def choose(
        self, node: Node, k: int, state: int, *, minimized_form: int | None = None
    ) -> bool:
        """Choose a status in a node; return False if that proves the node to be empty.

        minimized_form : a form that is minimal at the node's point, and is to be
            minimal again; None if the point need not minimize one.
        """
        dictionary = node.dictionary
        zero = self.zero(k, state)
        w = self.w(k)
        node.statuses[k] = state
        node.certain |= self.bit(k, state)
        signed = [w] if k in self.boxes and state != BASIC else []
        if signed and state == UPPER:
            dictionary.negate(w)
        if minimized_form is not None:
            return dictionary.restrict(minimized_form, zero, signed)
        return dictionary.vanish(zero) and all(map(dictionary.require, signed))

    def states_at_point(self, node: Node) -> int:
        """Return the statuses that hold at the node's point, as bits."""
        dictionary = node.dictionary
        bits = self.bits & ~dictionary.nonzero()
        for k in self.boxes:
            if node.statuses[k] is None and (value := dictionary.value(self.w(k))):
                bits &= ~self.bit(k, UPPER if value > 0 else LOWER)
        return bits

    def common_states(self, node: Node) -> int:
        """Return the statuses that hold on the whole polyhedron of a node, as bits."""
        bits = self.states_at_point(node)
        if node.dictionary.cobasic:
            for bit in self.meaning:
                if bits & bit and not self.holds(node, bit):
                    bits ^= bit
        return bits

    def violations(self, node: Node) -> dict[int, int] | None:
        """Return how far the unknowns without a status at the node's point are from
        satisfying one; None if the node lies in the cover.
        """
        bits = self.states_at_point(node)
        return None if self._lies_in_one(node, bits) else self.violated(node, bits)

    def violated(self, node: Node, bits: int) -> dict[int, int]:
        """Return how far the unknowns with none of these statuses are from satisfying
        one, up to a factor for each.
        """
        violated, dictionary = {}, node.dictionary
        for k, mask in enumerate(self.masks):
            if mask and node.statuses[k] is None and not bits & mask:
                w = dictionary.value(self.w(k))
                violated[k] = abs(w) * dictionary.value(
                    self.zero(k, UPPER) if w < 0 else k
                )
        return violated

    def branching_index(self, node: Node) -> int | None:
        """Return an unknown for which no status holds on the whole node, although one
        holds at its point; None if there is none. For the unknowns before it, the
        statuses that hold are chosen.
        """
        bits = self.states_at_point(node)
        open_ = [
            k
            for k, statuses in enumerate(self.choices)
            if statuses and node.statuses[k] is None
        ]
        # Unknowns with the fewest statuses at the point come first, the last of them
        # foremost: games with many equilibria then take the fewest nodes.
        open_.sort(key=lambda k: ((bits & self.masks[k]).bit_count(), -k))
        for k in open_:
            state = next(
                (
                    state
                    for state in self.choices[k]
                    if self.holds(node, self.bit(k, state))
                ),
                None,
            )
            if state is None or not self.choose(node, k, state):
                return k
        return None

    def children(self, node: Node, k: int) -> Iterable[Node]:
        """Return a node for each status of an unknown, except nodes that are empty or
        lie in another child.
        """
        children: dict[int, Node] = {}
        for state in reversed(self.choices[k]):
            child = node.copy()
            if self.choose(child, k, state):
                children[self.bit(k, state)] = child
        for bit, child in list(children.items()):
            if any(other != bit and self.holds(child, other) for other in children):
                del children[bit]
        return children.values()

    def leaves(self, start: Node) -> Iterator[Node]:
        """Yield the nodes below a node that consist of solutions, except those that lie
        in pieces of the cover, which may grow in the meantime. The statuses of a leaf
        are chosen, except statuses that hold on all of it.
        """
        return (node for node, is_leaf in explored(self, [start]) if is_leaf)

    def _lies_in_one(self, node: Node, bits: int) -> bool:
        """Return whether a node, with these statuses at its point, lies in a piece of
        the cover: the statuses of the piece hold on the whole node.
        """
        numbers = self.cover.within(bits)
        while numbers:
            open_ = self.cover.pieces[numbers.bit_length() - 1] & ~node.certain
            if not open_:
                return True
            bit = open_ & -open_
            if not self.holds(node, bit):
                numbers &= ~self.cover.having[bit]
        return False

    def holds(self, node: Node, bit: int) -> bool:
        """Return whether a status holds on the whole polyhedron of a node."""
        if node.certain & bit:
            return True
        dictionary = node.dictionary
        if not dictionary.is_zero(bit.bit_length() - 1):
            return False
        k, state = self.meaning[bit]
        if (
            state != BASIC
            and k in self.boxes
            and dictionary.can_have_sign(self.w(k), -1 if state == LOWER else 1)
        ):
            return False
        node.certain |= bit
        return True

    def forms(self) -> tuple[dict[int, list[int]], dict[int, Fraction], list[int]]:
        """Return the forms w_k, and u_k - z_k of unknowns with two bounds, in integers,
        in terms of the y of nonfixed unknowns; the numbers by which the w_k are
        multiplied; and the nonfixed unknowns.
        """
        nonfixed = [k for k in range(self.n) if self.choices[k]]
        rows, factors = dict[int, list[int]](), dict[int, Fraction]()
        for k in nonfixed:
            self.check()
            row = self.data.rows[k]
            constant = sum(
                (a * self.base[j] for j, a in row.items()),
                Fraction(self.data.constants[k]),
            )
            d = self.side[k] * constant.denominator
            form = [
                self.side[k] * constant.numerator,
                *(d * self.side[j] * row.get(j, 0) for j in nonfixed),
            ]
            rows[self.w(k)] = primitive(form)
            factors[self.w(k)] = Fraction(d * self.data.scales[k], gcd(*form) or 1)
        for k in self.boxes:
            width = (self.data.upper[k] or 0) - self.base[k]
            rows[self.zero(k, UPPER)] = [
                width.numerator,
                *(-width.denominator if j == k else 0 for j in nonfixed),
            ]
        return rows, factors, nonfixed


@dataclass
class Node:
    """The polyhedron of the chosen statuses, None for unknowns without one, and the
    statuses that are known to hold on all of it, as bits.
    """

    dictionary: Dictionary
    statuses: list[int | None]
    certain: int = 0

    def copy(self) -> Node:
        """Return a copy that can be changed independently."""
        return Node(self.dictionary.copy(), list(self.statuses), self.certain)


def _states(low: Fraction | None, high: Fraction | None) -> tuple[int, ...]:
    """Return the possible statuses of an unknown with these bounds; none if it is
    fixed."""
    if low is not None and low == high:
        return ()
    if low is None and high is not None:
        return UPPER, BASIC
    if low is None:
        return (BASIC,)
    return (LOWER, BASIC) if high is None else (LOWER, BASIC, UPPER)


class Cover:
    """Pieces of the solution set, each represented by bits, one for each status that
    holds on the whole piece.
    """

    def __init__(self, *pieces: int) -> None:
        self.pieces: list[int] = []
        # For each status, the numbers of the pieces that have it, as bits.
        self.having: dict[int, int] = {}
        for piece in pieces:
            self.add(piece)

    def add(self, piece: int) -> None:
        """Add a piece."""
        number, rest = 1 << len(self.pieces), piece
        while rest:
            bit = rest & -rest
            self.having[bit] = self.having.get(bit, 0) | number
            rest ^= bit
        self.pieces.append(piece)

    def within(self, bits: int) -> int:
        """Return the numbers of the pieces whose statuses are all among these, as
        bits.
        """
        numbers = (1 << len(self.pieces)) - 1
        for bit, having in self.having.items():
            if not bits & bit:
                numbers &= ~having
        return numbers


def explored(nodes: Any, pending: Any) -> Iterator[tuple[Any, bool]]:
    """Yield each node after it has been examined, and whether it is a leaf, with
    nothing to branch on. The children fix the statuses of the unknown with the largest
    violation; if there is none, those of an unknown whose status is not decided.

    nodes : has `check`, which may raise, `violations`, which are None for a node that
        need not be searched, `branching_index` and `children`, as `Unknowns` does.
    pending : a list, which is searched depth first, or a queue with `pop` and `extend`.
    """
    while pending:
        nodes.check()
        node = pending.pop()
        violated = nodes.violations(node)
        k = None
        if violated is not None:
            k = (
                max(violated, key=violated.__getitem__)
                if violated
                else nodes.branching_index(node)
            )
        if k is not None:
            pending.extend(nodes.children(node, k))
        yield node, violated is not None and k is None


def first_solution(
    data: ExactProblem, check: Callable[[], None]
) -> list[Fraction] | None:
    """Return a solution, or None if it is proved that there is none. `check` is called
    before each step and may raise.
    """
    return next((z for z in solution_search(data, check) if z is not None), None)


def solution_search(
    data: ExactProblem, check: Callable[[], None]
) -> Iterator[list[Fraction] | None]:
    """Yield solutions as the search finds them, and None after each other node."""
    unknowns = Unknowns(data, check)
    start = unknowns.root()
    for node, is_leaf in () if start is None else explored(unknowns, [start]):
        yield list(unknowns.point(node)) if is_leaf else None
