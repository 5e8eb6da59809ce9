"""Conflicts: conditions that cannot hold together, each of them necessary for that.

Linear conditions are examined first. If they are feasible, branch and bound finds
complementarities that exclude a solution together with them. A smallest such set hits
all sets of complementarities that some point violates: a smallest hitting set of those
known is a conflict, or yields a point that violates another set (A. Ignatiev, A.
Previti, M. Liffiton and J. Marques-Silva, Smallest MUS extraction with minimal hitting
set dualization, Principles and Practice of Constraint Programming 2015, 173-182). For
more than a dozen complementarities, and for the linear conditions that are needed in
addition, a deletion filter removes what is not necessary (J. W. Chinneck and E. W.
Dravnieks, ORSA Journal on Computing 3 (1991) 157-168), many conditions at first and
then one by one, with the proof of each step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

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
    contradictions,
)
from lcpcli.explanation.search import Outcome, search
from lcpcli.rational.elimination import Effort
from lcpcli.rational.numbers import whole_multiple

MAX_FOR_FEWEST = 12  # complementarities up to which a smallest set is computed


@dataclass(frozen=True)
class Conflict:
    """Conditions that cannot hold together.

    members : the conditions. irreducible : whether each is proved to be necessary.
    fewest : whether it is proved that no fewer complementarities exclude a solution
        together with the linear conditions.
    multipliers : of linear conditions, integers with which they add up to a
        contradiction.
    """

    members: Sequence[Condition]
    irreducible: bool = False
    fewest: bool = False
    multipliers: dict[Condition, int] = field(default_factory=dict)


class Finder:
    """The search for a conflict.

    conflict : the smallest one that is known, or None. point : a solution, if one is
        computed. never_blamed : the conditions that are taken to be right.
        nearly_contradictory : the smallest set of linear conditions that are
        inconsistent only up to rounding.
    """

    def __init__(
        self, system: System, never_blamed: Sequence[Condition], effort: Effort
    ) -> None:
        self.system = system
        self.never_blamed = list(never_blamed)
        self._effort = effort
        self.conflict: Conflict | None = None
        self.point: Values | None = None
        self.nearly_contradictory: Sequence[Condition] = ()

    def contradict(self) -> None:
        """Search for a conflict of linear conditions by linear programs."""
        for stage in (CONSTRAINTS, OPTIMALITY):
            linear = [each for each in self.system.linear if each.stage == stage]
            pairs = (
                [*contradictions(self.system, linear, self.never_blamed)]
                if linear
                else []
            )
            proved = [each for _, each in pairs if each is not None]
            if proved:
                self._set_contradiction(min(proved, key=self._size))
                return
            self.nearly_contradictory = self.nearly_contradictory or min(
                (conditions for conditions, _ in pairs), key=len, default=()
            )

    def _size(self, of: Multipliers) -> tuple[int, int]:
        """Return the number of conditions that a contradiction blames, and the sum of
        its multipliers as integers.
        """
        blamed = sum(each not in self.never_blamed for each in of)
        return blamed, sum(map(abs, whole_multiple(list(of.values()))))

    def _set_contradiction(self, multipliers: Multipliers) -> None:
        """Store an irreducible contradiction of linear conditions; if conditions are
        never blamed, others may be superfluous and are removed.
        """
        integer_multipliers = dict(
            zip(multipliers, whole_multiple(list(multipliers.values())), strict=True)
        )
        members = [
            each
            for each in self.system.linear
            if each in multipliers.keys() - self.never_blamed
        ]
        self.conflict = Conflict(
            members, not self.never_blamed, multipliers=integer_multipliers
        )
        if self.never_blamed:
            points = self._reduce(members, self.never_blamed)
            self._finish(points)

    def run(self) -> None:
        """Search for complementarities and linear conditions that exclude a solution
        together, or for a solution.
        """
        system, linear = self.system, self.system.linear
        outcome = self._search([*linear, *system.complementarities])
        self.point = outcome.point
        if outcome.point is not None:
            return
        if not any(each in outcome.core for each in system.complementarities):
            multipliers = contradiction(system, outcome.core)
            assert multipliers is not None
            self._set_contradiction(multipliers)
            return
        free = [
            each
            for each in (*linear, *system.complementarities)
            if each not in self.never_blamed
        ]
        self.conflict = Conflict([each for each in free if each in outcome.core])
        members = [each for each in free if each in linear]
        others = [each for each in free if each not in linear]
        background = [
            *linear,
            *(each for each in self.never_blamed if each not in linear),
        ]
        is_fewest = len(others) <= MAX_FOR_FEWEST
        core = [each for each in others if each in outcome.core]
        if is_fewest:
            core = self._fewest(others, background)
        points = self._reduce(core, background, members)
        core = list(points)
        points |= self._reduce(members, [*self.never_blamed, *core], core)
        self._finish(points, is_fewest)

    def _search(self, conditions: Sequence[Condition]) -> Outcome:
        return search(self.system, conditions, self._effort)

    def _fewest(
        self, others: Sequence[Condition], background: Sequence[Condition]
    ) -> list[Condition]:
        """Return a smallest set of complementarities that excludes a solution together
        with the background.
        """
        violated: list[set[Condition]] = []
        while True:
            subsets = (
                chosen
                for size in range(len(others) + 1)
                for chosen in combinations(others, size)
            )
            chosen = next(
                each for each in subsets if all(other & {*each} for other in violated)
            )
            outcome = self._search([*background, *chosen])
            if outcome.point is None:
                return list(chosen)
            missing = self._violated(others, outcome.point)
            for each in list(missing):
                held = [
                    other for other in others if other not in missing or other == each
                ]
                more = self._search([*background, *held]).point
                if each in missing and more is not None:
                    missing = self._violated(others, more)
            violated.append(missing)

    def _violated(
        self, conditions: Sequence[Condition], point: Values
    ) -> set[Condition]:
        return {each for each in conditions if not self.system.holds(each, point)}

    def _reduce(
        self,
        members: Sequence[Condition],
        background: Sequence[Condition],
        conflict_part: Sequence[Condition] = (),
    ) -> dict[Condition, Values]:
        """Remove members of a conflict with a background until each is necessary, and
        return the points that prove this. conflict_part : conditions of the background
        that belong to the conflict.
        """
        points = dict[Condition, Values]()
        size = len(members)
        members = list(members)
        while size:
            i = 0
            while i < len(members):
                rest = members[:i] + members[i + size :]
                outcome = self._search([*background, *rest])
                if outcome.point is None:
                    i = sum(each in outcome.core for each in members[:i])
                    members = [each for each in rest if each in outcome.core]
                    self.conflict = Conflict([*conflict_part, *members])
                    continue
                if size == 1:
                    points[members[i]] = outcome.point
                i += size
            size = min(size // 2, len(members))
        return points

    def _finish(self, points: dict[Condition, Values], is_fewest: bool = False) -> None:
        """Store the conflict with the proof that it is irreducible: at each of the
        points all members but one hold, and all conditions that are never blamed.
        """
        assert self.conflict is not None
        members = self.conflict.members
        assert all(
            self._violated([*self.never_blamed, *members], points[each]) == {each}
            for each in members
        )
        self.conflict = replace(self.conflict, irreducible=True, fewest=is_fewest)
