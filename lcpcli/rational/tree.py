"""The tree over the states of the unknowns, in which each branch that is cut has a proof."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction

from lcpcli.rational.choices import Node, Unknowns
from lcpcli.rational.problem import ExactProblem


class Cover:
    """Pieces as bits, one for each state that holds on all of the piece."""

    def __init__(self, *pieces: int) -> None:
        self.pieces: list[int] = []
        self.having: dict[int, int] = {}  # for each bit, the numbers of the pieces that have it, as bits
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
        """The numbers of the pieces all of whose states are among some, as bits."""
        numbers = (1 << len(self.pieces)) - 1
        for bit, having in self.having.items():
            if not bits & bit:
                numbers &= ~having
        return numbers


def first_solution(data: ExactProblem, check: Callable[[], None]) -> list[Fraction] | None:
    """A solution of a problem; None if it is proved to have none. `check` is called before each step and may raise."""
    unknowns = Unknowns(data, check)
    start = unknowns.root()
    leaf = None if start is None else next(leaves(unknowns, start, Cover()), None)
    return None if leaf is None else unknowns.point(leaf)


def leaves(unknowns: Unknowns, start: Node, cover: Cover) -> Iterator[Node]:
    """The nodes below a node all of whose points are solutions, but for those that lie in pieces of the cover, which
    may grow in the meantime. A node's states are chosen but for those that hold on all of it."""
    pending = [start]
    while pending:
        unknowns.check()
        node = pending.pop()
        bits = unknowns.satisfied(node)
        if _lies_in_one(unknowns, node, bits, cover):
            continue
        open_ = [k for k, states in enumerate(unknowns.choices) if states and node.states[k] is None]
        violated = [k for k in open_ if not bits & unknowns.masks[k]]
        narrow = unknowns.narrow(node) if violated else None
        if narrow is not None:
            pending += [node] * narrow
            continue
        k = (
            max(violated, key=lambda k: unknowns.violation(node, k))
            if violated
            else next((k for k in _in_order(unknowns, open_, bits) if not _is_settled(unknowns, node, k)), None)
        )
        if k is None:
            yield node
        else:
            pending += _children(unknowns, node, k)


def _children(unknowns: Unknowns, node: Node, k: int) -> list[Node]:
    """A node with each state of an unknown, but for those that are empty or lie in another one of them."""
    children: dict[int, Node] = {}
    for state in reversed(unknowns.choices[k]):
        bit = unknowns.bit(k, state)
        if not node.absent & bit:
            child = node.copy()
            if unknowns.choose(child, k, state):
                children[bit] = child
    for bit, child in list(children.items()):
        if any(other != bit and unknowns.holds(child, other) for other in children):
            del children[bit]
    return list(children.values())


def _in_order(unknowns: Unknowns, open_: Sequence[int], bits: int) -> list[int]:
    """Unknowns in the order that takes the fewest nodes in games with many equilibria: first those that have one state
    at the point, of these the last ones."""
    return sorted(open_, key=lambda k: ((bits & unknowns.masks[k]).bit_count(), -k))


def _lies_in_one(unknowns: Unknowns, node: Node, bits: int, cover: Cover) -> bool:
    """Whether the states of a piece hold on all of a node, those at its point being known; each is asked for once."""
    numbers = cover.within(bits)
    while numbers:
        open_ = cover.pieces[numbers.bit_length() - 1] & ~node.certain
        if not open_:
            return True
        bit = open_ & -open_
        if not unknowns.holds(node, bit):
            numbers &= ~cover.having[bit]
    return False


def _is_settled(unknowns: Unknowns, node: Node, k: int) -> bool:
    """Whether a state of an unknown holds on all of a node; then it is chosen."""
    state = next((state for state in unknowns.choices[k] if unknowns.holds(node, unknowns.bit(k, state))), None)
    return state is not None and unknowns.choose(node, k, state)
