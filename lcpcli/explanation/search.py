"""Whether there is a point at which some conditions hold, in exact arithmetic: such a
point, or the conditions that were needed to exclude one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain
from typing import NamedTuple

from lcpcli.explanation.conditions import (
    COMPLEMENTARITY,
    SIGN,
    Alternative,
    Condition,
    System,
    Values,
)
from lcpcli.rational.dictionary import Dictionary
from lcpcli.rational.elimination import Effort
from lcpcli.rational.tree import explored


class Node(NamedTuple):
    """A polyhedron, and the indices for which an alternative has been chosen."""

    dictionary: Dictionary
    chosen: frozenset[int] = frozenset()


class Choices:
    """The nodes of a tree in which one of several alternatives is chosen for each of
    some indices.

    branched : the indices at which the tree has branched. used : the forms that its
        proofs use.
    """

    def __init__(
        self,
        alternatives: Mapping[int, Sequence[Alternative]],
        check: Callable[[], None],
    ) -> None:
        self.alternatives, self.check = alternatives, check
        self.branched, self.used = set[int](), set[int]()

    def point(self, dictionary: Dictionary) -> Dictionary | None:
        """Return a dictionary at whose point one of the alternatives of each index
        holds; None if there is none.
        """
        tree = explored(self, [Node(dictionary)])
        return next((node.dictionary for node, is_leaf in tree if is_leaf), None)

    def violations(self, node: Node) -> dict[int, int]:
        """Return, for each index none of whose alternatives holds at the point of a
        node, how far the point is from the closest one.
        """

        def distance(form: int, is_zero: bool) -> int:
            value = node.dictionary.value(form)
            return abs(value) if is_zero else max(-value, 0)

        far = {
            k: min(sum(distance(*form) for form in each) for each in alternatives)
            for k, alternatives in self.alternatives.items()
            if k not in node.chosen
        }
        return {k: violation for k, violation in far.items() if violation}

    def branching_index(self, _: Node) -> None:
        """Return None: a point that satisfies one alternative of each index
        suffices.
        """

    def children(self, node: Node, k: int) -> Iterator[Node]:
        """Yield the nonempty nodes with each alternative of an index."""
        self.branched.add(k)
        for alternative in reversed(self.alternatives[k]):
            dictionary = node.dictionary.copy()
            if all(self.restrict(dictionary, *each) for each in alternative):
                yield Node(dictionary, node.chosen | {k})

    def restrict(
        self, dictionary: Dictionary, form: int, is_zero: bool = False
    ) -> bool:
        """Restrict a polyhedron by a form; return False if that proves it to be empty,
        by a row whose forms are added to `used`.
        """
        if (dictionary.vanish if is_zero else dictionary.require)(form):
            return True
        entries = zip(dictionary.cobasic, dictionary.rows[form][1:], strict=True)
        self.used |= {form, *(each for each, value in entries if value)}
        return False


class Outcome(NamedTuple):
    """A point at which conditions hold, with an empty core; or None, and the conditions
    that exclude one.
    """

    point: Values | None
    core: Sequence[Condition]


def search(system: System, conditions: Sequence[Condition], effort: Effort) -> Outcome:
    """Return a point at which conditions hold, or the proof that there is none; raise
    TimeIsUp if that takes more than `effort`.
    """
    linear = [each for each in conditions if each.kind != COMPLEMENTARITY]
    required = {form: None for each in linear for form in system.forms(each)}
    alternatives = {
        each.at: system.alternatives(each.at, required)
        for each in conditions
        if each.kind == COMPLEMENTARITY
    }
    polyhedra = chain.from_iterable(alternatives.values())
    parts = chain.from_iterable(polyhedra)
    forms = required | dict.fromkeys(form for form, _ in parts)
    dictionary, columns = system.dictionary(forms, effort)
    nodes = Choices(alternatives, dictionary.check)
    is_open = all(nodes.restrict(dictionary, form) for form in required)
    if is_open and (solution_dictionary := nodes.point(dictionary)) is not None:
        return Outcome(system.point(solution_dictionary, columns), ())

    def is_used(each: Condition) -> bool:
        if each.kind != SIGN and each.at in nodes.branched:
            return True
        is_linear = each.kind != COMPLEMENTARITY
        return is_linear and not nodes.used.isdisjoint(system.forms(each))

    return Outcome(None, [*filter(is_used, conditions)])
