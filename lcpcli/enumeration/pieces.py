"""The pieces of the solution set of a problem, each once, as they are found."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction

from lcpcli import clock
from lcpcli.enumeration import theorems
from lcpcli.enumeration.piece import NAMES, Piece, common_states
from lcpcli.interrupts import TimeIsUp
from lcpcli.rational.choices import STATES, Node, Unknowns
from lcpcli.rational.polyhedra import Generators, generators
from lcpcli.rational.problem import ExactProblem
from lcpcli.rational.tree import leaves

SMALL = 10  # unknowns up to which the tree is as fast in finding a first solution as a method
METHODS = 5.0  # seconds that they have where Lemke's in fractions can follow; doubles may not represent a solution

States = Sequence[Sequence[str]]  # of each unknown, those that hold


def pieces(data: ExactProblem, check: Callable[[], None], deadline: float = math.inf) -> Iterator[Piece]:
    """Every maximal piece of the solution set once, in the order in which the tree meets them.

    `check` is called before each step and may raise. deadline : by `clock.seconds`, for the method that looks for
    a solution where it is known that all are one piece.
    """
    shape = theorems.shape(data, check)
    z = _solution(data, check, deadline) if shape and data.n > SMALL else None
    if z is not None and shape == theorems.POINT:
        yield Piece.of(data, Generators([tuple(z)], [], []))
        return
    unknowns = Unknowns(data, check)
    start = unknowns.root()
    if start is None:
        return
    if z is not None:
        _choose_common(unknowns, start, common_states(data, [tuple(z)]))
    found: list[int] = []
    for leaf in leaves(unknowns, start, found):
        piece = Piece.of(data, unknowns.z(generators(leaf.dictionary, range(data.n))))
        found.append(_bits(piece.states))
        if _is_maximal(unknowns, piece.states):
            yield piece
            if shape:
                return


def _is_maximal(unknowns: Unknowns, states: States) -> bool:
    """Whether no other choice among the states that hold in a piece gives a larger one.

    All nodes with those states contain the piece, so that any leaf that does not lie in it is larger.
    """
    if all(len(held) == 1 for held in states):
        return True
    start = unknowns.root()
    assert start is not None
    _choose_common(unknowns, start, states)
    held = unknowns.restricted([[NAMES.index(name) for name in names if name in NAMES] for names in states])
    return next(leaves(held, start, [_bits(states)]), None) is None


def _choose_common(unknowns: Unknowns, node: Node, states: States) -> None:
    """Choose the states of unknowns that have only one, in solutions that lie in the node."""
    for k, held in enumerate(states):
        if len(held) == 1 and unknowns.choices[k] and node.states[k] is None:
            chosen = unknowns.choose(node, k, NAMES.index(held[0]))
            assert chosen


def _bits(states: States) -> int:
    """States as `leaves` has them."""
    return sum(
        1 << (len(STATES) * k + NAMES.index(name)) for k, held in enumerate(states) for name in held if name in NAMES
    )


def _solution(data: ExactProblem, check: Callable[[], None], deadline: float) -> list[Fraction] | None:
    """A solution from the methods of the program, made exact; None if they have none."""

    from lcpcli.rational import exact_lemke
    from lcpcli.solving import run
    from lcpcli.solving.limits import Limits
    from lcpcli.solving.result import Status
    from lcpcli.verify.exact_solution import from_point

    began = clock.seconds()
    seconds = min(deadline - began, METHODS if data.n <= exact_lemke.MOST_UNKNOWNS else math.inf)
    if seconds <= 0:
        return None
    limits = Limits(time_limit=seconds)
    result = run.run(data.problem, "auto", limits=limits, conclude=False, observe=lambda *_: check())
    if result.interrupted:
        raise KeyboardInterrupt
    if result.status is Status.TIME_LIMIT and clock.seconds() < began + seconds:
        raise TimeIsUp  # by `check`
    found = from_point(data, result.z, deadline) if result.solved else None
    return found or exact_lemke.solve(data, deadline)
