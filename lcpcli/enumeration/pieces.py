"""The pieces of the solution set of a problem, each once, as they are found."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import lru_cache
from itertools import chain

from lcpcli import clock
from lcpcli.enumeration import theorems
from lcpcli.enumeration.piece import NAMES, Piece, States, common_states
from lcpcli.interrupts import TimeIsUp
from lcpcli.model.origins import Game
from lcpcli.rational.choices import Node, Unknowns
from lcpcli.rational.polyhedra import Direction, Point, generators
from lcpcli.rational.problem import ExactProblem
from lcpcli.rational.tree import Cover, leaves

KEPT = 10_000  # vertices whose states are remembered, as they may be of several pieces
BASES = 1000  # of a piece that takes more of them the vertices are listed after all other pieces
SMALL = 10  # unknowns up to which the tree is as fast in finding a first solution as a method
LARGE_GAME = 30  # the same for games, of which all solutions are sought; they are known to have one
METHODS = 5.0  # seconds that they have where Lemke's in fractions can follow; doubles may not represent a solution


def pieces(data: ExactProblem, check: Callable[[], None], deadline: float = math.inf) -> Iterator[Piece]:
    """Every maximal piece of the solution set once, in the order in which the tree meets them.

    `check` is called before each step and may raise. deadline : by `clock.seconds`, for the method that looks for
    a first solution where it is known that there is one, or that all are one piece.
    """
    shape = theorems.shape(data, check)
    large = SMALL if shape else LARGE_GAME if isinstance(data.problem.origin, Game) else math.inf
    z = _solution(data, check, deadline) if data.n > large else None
    if z is not None and shape == theorems.POINT:
        yield Piece.of(data, (tuple(z),))
        return
    unknowns = Unknowns(data, check)
    unknowns.allow([states[::-1] for states in unknowns.choices])  # takes fewer nodes where pieces are many
    root = unknowns.root()
    if root is None:
        return
    starts = [root.copy(), root.copy()]
    if z is not None:
        _choose_common(unknowns, starts[0], _bits(unknowns, common_states(data, [tuple(z)])))
    cover = Cover()
    late: list[Node] = []

    @lru_cache(KEPT)
    def states_at(values: Direction) -> tuple[Point, States]:
        vertex = unknowns.vertex(values)
        return vertex, common_states(data, [vertex])

    for leaf in chain.from_iterable(leaves(unknowns, start, cover) for start in starts[z is None :]):
        node, states = _largest(unknowns, root, leaf)
        cover.add(states)
        piece = _listed(unknowns, node, states_at, math.inf if shape else BASES)
        if piece is None:
            late.append(node)
            continue
        yield piece
        if shape:
            return
    for node in late:
        piece = _listed(unknowns, node, states_at)
        assert piece is not None
        yield piece


def _listed(
    unknowns: Unknowns,
    node: Node,
    states_at: Callable[[Direction], tuple[Point, States]],
    most: float = math.inf,
) -> Piece | None:
    """The piece of a node; None if it takes more than so many bases."""
    listed = generators(node.dictionary, range(unknowns.n), most)
    if listed is None:
        return None
    if listed.rays or listed.lines:
        rays, lines = (tuple(map(unknowns.direction, each)) for each in listed[1:])
        return Piece.of(unknowns.data, tuple(map(unknowns.vertex, listed.vertices)), rays, lines)
    states = []
    for values in listed.vertices:
        unknowns.check()
        states.append(states_at(values))
    return Piece.spanned(states)


def _largest(unknowns: Unknowns, root: Node, node: Node) -> tuple[Node, int]:
    """A maximal node that contains a node all of whose points are solutions, and the states that hold in it, as bits.

    All nodes with the states that hold in a piece contain it, so that any leaf among them that does not lie in it is
    larger.
    """
    while True:
        held = unknowns.held(node)
        larger = None
        if any((held & mask).bit_count() > 1 for mask in unknowns.masks):
            start = root.copy()
            _choose_common(unknowns, start, held)
            larger = next(leaves(unknowns.restricted(held), start, Cover(held)), None)
        if larger is None:
            return node, held
        node = larger


def _choose_common(unknowns: Unknowns, node: Node, bits: int) -> None:
    """Choose the states of unknowns that have only one among some, in solutions that lie in the node."""
    for k, mask in enumerate(unknowns.masks):
        if (bits & mask).bit_count() == 1 and node.states[k] is None:
            chosen = unknowns.choose(node, *unknowns.meaning[bits & mask])
            assert chosen


def _bits(unknowns: Unknowns, states: States) -> int:
    """The states of unknowns that are not fixed, as bits."""
    return sum(bit for bit, (k, state) in unknowns.meaning.items() if NAMES[state] in states[k])


def _solution(data: ExactProblem, check: Callable[[], None], deadline: float) -> list[Fraction] | None:
    """A solution from the methods of the program, made exact; None if they have none."""
    from lcpcli.options import Limits
    from lcpcli.rational import exact_lemke
    from lcpcli.solving import driver
    from lcpcli.solving.result import Status
    from lcpcli.verify.exact_solution import from_point

    began = clock.seconds()
    seconds = min(deadline - began, METHODS if data.n <= exact_lemke.MOST_UNKNOWNS else math.inf)
    if seconds <= 0:
        return None
    limits = Limits(time_limit=seconds)
    result = driver.run(data.problem, "auto", limits=limits, conclude=False, observe=lambda *_: check())
    if result.interrupted:
        raise KeyboardInterrupt
    if result.status is Status.TIME_LIMIT and clock.seconds() < began + seconds:
        raise TimeIsUp  # by `check`
    found = from_point(data, result.z, deadline) if result.solved else None
    return found or exact_lemke.solve(data, deadline)
