"""Conflicts: conditions that cannot hold together, each of them necessary for that.

Linear conditions are examined first. If they are feasible, branch and bound finds
complementarities that exclude a solution together with them, and a deletion filter (J.
W. Chinneck and E. W. Dravnieks, ORSA Journal on Computing 3 (1991) 157-168) removes
what is not necessary, many conditions at first and then one by one, with the proof of
each step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from lcpcli.enumeration.search import MAX_BLOCK_UNKNOWNS
from lcpcli.explanation.conditions import (
    CONSTRAINTS,
    OPTIMALITY,
    Condition,
    System,
    Values,
)
from lcpcli.explanation.contradictions import (
    Multipliers,
    contradiction,
    smallest,
)
from lcpcli.explanation.repair import MAX_SEARCHED, violation
from lcpcli.explanation.search import search
from lcpcli.rational.elimination import Effort
from lcpcli.rational.numbers import whole_multiple


@dataclass(frozen=True)
class Conflict:
    """Conditions that cannot hold together.

    members : the conditions. irreducible : whether each is proved to be necessary.
    multipliers : of linear conditions, integers with which they add up to a
        contradiction.
    """

    members: Sequence[Condition]
    irreducible: bool = False
    multipliers: dict[Condition, int] = field(default_factory=dict)


class Finder:
    """The search for a conflict.

    conflict : the smallest one that is known, or None. point : a solution, if one is
        computed. never_blamed : the conditions that are taken to be right.
        nearly_contradictory : linear conditions that are inconsistent only up to
        rounding.
    """

    def __init__(self, system: System, never_blamed: Sequence[Condition]) -> None:
        self.system = system
        self.never_blamed = list(never_blamed)
        self._effort = Effort()
        self.conflict: Conflict | None = None
        self.point: Values | None = None
        self.nearly_contradictory: Sequence[Condition] = ()

    def run(self) -> None:
        """Search for a conflict of linear conditions, by linear programs; then, unless
        there are too many unknowns, for one with complementarities, or a solution.
        """
        for stage in (CONSTRAINTS, OPTIMALITY):
            linear = [each for each in self.system.linear if each.stage == stage]
            found = smallest(self.system, linear, self.never_blamed)
            if found is not None and found.multipliers is not None:
                self._set_contradiction(found.multipliers)
                return
            if found is not None:
                self.nearly_contradictory = found.conditions
        # Pivoting on nearly dependent rows takes fractions of many digits.
        largest = MAX_SEARCHED if self.nearly_contradictory else MAX_BLOCK_UNKNOWNS
        if self.system.n <= largest:
            self._exclude()

    def _set_contradiction(self, multipliers: Multipliers) -> None:
        """Store an irreducible contradiction of linear conditions; if conditions are
        never blamed, a point has to prove that each of the others is necessary.
        """
        integers = whole_multiple(list(multipliers.values()))
        members = [
            each
            for each in self.system.linear
            if each in multipliers.keys() - self.never_blamed
        ]
        integer_multipliers = dict(zip(multipliers, integers, strict=True))
        self.conflict = Conflict(members, multipliers=integer_multipliers)
        stage = max((each.stage for each in multipliers), default=CONSTRAINTS)
        kept = [each for each in self.never_blamed if each in self.system.linear]
        if self.never_blamed:
            for each in members:
                others = [other for other in members if other != each]
                others += [other for other in kept if other.stage == stage]
                if violation(self.system, others, {}) is None:
                    return
        self.conflict = replace(self.conflict, irreducible=True)

    def _exclude(self) -> None:
        """Search for complementarities and linear conditions that exclude a solution
        together, or for a solution.
        """
        system, linear = self.system, self.system.linear
        conditions = [*linear, *system.complementarities]
        self.point, core = search(system, conditions, self._effort)
        if self.point is not None:
            return
        if not any(each in core for each in system.complementarities):
            multipliers = contradiction(system, core)
            assert multipliers is not None
            self._set_contradiction(multipliers)
            return
        free = [each for each in conditions if each not in self.never_blamed]
        self.conflict = Conflict([each for each in free if each in core])
        kept = [each for each in self.never_blamed if each not in linear]
        others = [each for each in free if each in core and each not in linear]
        # First with all linear conditions, so that few complementarities remain.
        points = self._reduce(others, [*linear, *kept], [*free])
        others = list(points)
        members = [each for each in free if each in linear]
        points |= self._reduce(members, [*self.never_blamed, *others], others)
        assert all(
            self._violated([*self.never_blamed, *self.conflict.members], point)
            == {each}
            for each, point in points.items()
        )
        self.conflict = replace(self.conflict, irreducible=True)

    def _violated(
        self, conditions: Sequence[Condition], point: Values
    ) -> set[Condition]:
        return {each for each in conditions if not self.system.holds(each, point)}

    def _reduce(
        self,
        members: Sequence[Condition],
        background: Sequence[Condition],
        others: Sequence[Condition],
    ) -> dict[Condition, Values]:
        """Remove members of a conflict with a background until each is necessary, and
        return the points that prove this. others : conditions of the background that
        belong to the conflict.
        """
        points = dict[Condition, Values]()
        size = len(members)
        members = list(members)
        while size:
            i = 0
            while i < len(members):
                rest = members[:i] + members[i + size :]
                conditions = [*background, *rest]
                point, core = search(self.system, conditions, self._effort)
                if point is None:
                    i = sum(each in core for each in members[:i])
                    members = [each for each in rest if each in core]
                    blamed = {*others, *members}
                    self.conflict = Conflict(
                        [each for each in conditions if each in blamed]
                    )
                    continue
                if size == 1:
                    points[members[i]] = point
                i += size
            size = min(size // 2, len(members))
        return points
