"""The tree over the states of the unknowns, in which each branch that is cut has a proof."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction

from lcpcli.rational.choices import STATES, Node, Unknowns
from lcpcli.rational.problem import ExactProblem


def first_solution(data: ExactProblem, check: Callable[[], None]) -> list[Fraction] | None:
    """A solution of a problem; None if it is proved to have none. `check` is called before each step and may raise."""
    unknowns = Unknowns(data, check)
    start = unknowns.root()
    leaf = None if start is None else next(leaves(unknowns, start, []), None)
    return None if leaf is None else unknowns.point(leaf)


def leaves(unknowns: Unknowns, start: Node, found: Sequence[int]) -> Iterator[Node]:
    """The nodes below a node all of whose points are solutions, but for those that lie in pieces found before.

    found : pieces as bits, one for the state of each unknown; it may grow in the meantime. A node's states are chosen
        but for those that hold on all of it.
    """
    pending = [start]
    while pending:
        unknowns.check()
        node = pending.pop()
        bits = unknowns.satisfied(node)
        if _lies_in_one(unknowns, node, bits, found):
            continue
        k = _branching(unknowns, node, bits)
        if k is None:
            yield node
            continue
        pending += _children(unknowns, node, k)


def _children(unknowns: Unknowns, node: Node, k: int) -> list[Node]:
    """A node with each state of an unknown, but for those that are empty or lie in another one of them."""
    children: dict[int, Node] = {}
    for state in reversed(unknowns.choices[k]):
        child = node.copy()
        if unknowns.choose(child, k, state):
            children[state] = child
    for state, child in list(children.items()):
        if any(other != state and unknowns.holds(child, k, other) for other in children):
            del children[state]
    return list(children.values())


def _lies_in_one(unknowns: Unknowns, node: Node, bits: int, pieces: Sequence[int]) -> bool:
    """Whether the states of a piece hold on all of a node, those at its point being known; each is asked for once."""
    possible, certain = bits, 0
    for piece in pieces:
        open_ = piece & ~certain
        while not open_ & ~possible:
            if not open_:
                return True
            state = open_ & -open_
            open_ ^= state
            if unknowns.holds(node, *divmod(state.bit_length() - 1, len(STATES))):
                certain |= state
            else:
                possible ^= state
                break
    return False


def _branching(unknowns: Unknowns, node: Node, bits: int) -> int | None:
    """An unknown none of whose states holds on all of the node; None if there is none: then one of each is chosen."""
    open_ = [k for k, states in enumerate(unknowns.choices) if states and node.states[k] is None]
    violated = [k for k in open_ if not bits >> (len(STATES) * k) & ((1 << len(STATES)) - 1)]
    if violated:
        return max(violated, key=lambda k: unknowns.violation(node, k))
    for k in open_:
        state = next((state for state in unknowns.choices[k] if unknowns.holds(node, k, state)), None)
        if state is None:
            return k
        unknowns.choose(node, k, state)
    return None
