"""Which conditions of a problem without solution are in conflict and which change of
its data would make it solvable, or how far the data of a solvable one may change:
`lcpcli.why`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any

from lcpcli import clock, options
from lcpcli.enumeration.search import TIME_LIMIT, UNSOLVABLE
from lcpcli.errors import ParameterError, quoted
from lcpcli.explanation.conditions import (
    COMPLEMENTARITY,
    Condition,
    Number,
    System,
    Values,
    matching,
)
from lcpcli.explanation.conflicts import Conflict, Finder
from lcpcli.explanation.ranges import Range
from lcpcli.explanation.ranges import ranges as ranges_of
from lcpcli.explanation.repair import Repairs, solution
from lcpcli.explanation.report import SOLVED, UNDECIDED, Explanation
from lcpcli.interrupts import TimeIsUp, deadline_after, remaining
from lcpcli.model.problem import Problem, as_problem
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem

NO_CONFLICT = Conflict(())
FIELDS = ("q", "lower", "upper")


def why(
    problem: Problem | ExactProblem,
    *,
    keep: str | Iterable[str] = (),
    change: str | Iterable[str] | None = None,
    weights: Mapping[str, Any] | None = None,
    time_limit: float | None = None,
) -> Explanation:
    """Explain a problem in exact arithmetic. If it has no solution: which of its
    conditions cannot hold together, each of them necessary, and the smallest change of
    its numbers that makes it solvable. If it has one: the range of each number, the
    others being fixed, in which the same z_i and w_i can be positive.

    Parameters
    ----------
    problem : a Problem, whose floats are taken as exact, or an ExactProblem.
    keep : conditions that are not reported in the conflict, by name, as "protein", or
        by name and what they are, as "z1 lower bound"; * matches any text. The
        repair may change their numbers, unless `change` names others.
    change : numbers that may change in a repair, named in the same way, as "x1 upper
        bound";
        by default the entries of q or, of a program, costs and row sides.
    weights : the cost of a change by 1, a positive number, by the names of numbers that
        may change; by default 1.
    time_limit : seconds after which to stop, with what is known by then; by default
        there is no limit.

    Returns
    -------
    Explanation : with `conflict`, `irreducible`, `repair` and `ranges`; as text, it has
        all of them, and `to_dict` returns the object of `lcp why --format json`.

    Raises
    ------
    ProblemError, OptionError : a parameter is of the wrong kind, names nothing, or is
        out of range.

    Examples
    --------
    >>> import lcpcli
    >>> explanation = lcpcli.why(lcpcli.Problem([[-1, 0], [1, 1]], [-2, 0]))
    >>> [f"{each.name} {each.what}" for each in explanation.conflict]
    ['z1 lower bound', 'z1 sign of w']
    >>> explanation.irreducible
    True
    >>> [(each.number.name, str(each.change)) for each in explanation.repair.changes]
    [('z1', '2')]
    """
    options.check((options.TIME_LIMIT,), {"time_limit": time_limit})
    if not isinstance(problem, ExactProblem):
        problem = ExactProblem.of_floats(as_problem(problem))
    system = System(problem)
    conditions = [*system.linear, *system.complementarities]
    never_blamed = matching(conditions, _texts("keep", keep), "keep")
    search = _Search(system, never_blamed, _weights(system, change, weights))
    began, status = clock.seconds(), ""
    try:
        with deadline_after(math.inf if time_limit is None else time_limit):
            search.run()
    except TimeIsUp:
        status = TIME_LIMIT
    return search.explanation(status, clock.seconds() - began)


def _texts(option: str, raw_value: str | Iterable[str]) -> list[str]:
    """Return one pattern, or several, as a list; raise ParameterError for other
    types."""
    texts = [raw_value] if isinstance(raw_value, str) else list(raw_value)
    if not all(isinstance(each, str) for each in texts):
        raise ParameterError(option, "is not a list of names", 'write ["z1", "z2"]')
    return texts


def _weights(
    system: System,
    change: str | Iterable[str] | None,
    weights: Mapping[str, Any] | None,
) -> dict[Number, Fraction]:
    """Return the numbers that may change with their weights."""
    chosen = [each for each in system.numbers if each.is_default]
    if change is not None:
        chosen = matching(system.numbers, _texts("change", change), "change")
    weight_of = dict.fromkeys(chosen, Fraction(1))
    for pattern, weight in (weights or {}).items():
        try:
            value = Fraction(weight)
        except (TypeError, ValueError, OverflowError, ZeroDivisionError):
            value = Fraction(0)
        if value <= 0:
            reason = f"is {weight} for {quoted(pattern)}"
            raise ParameterError("weights", reason, "give a positive number")
        weight_of |= dict.fromkeys(matching(chosen, [pattern], "weights"), value)
    return weight_of


class _Search:
    """The search for a conflict and a repair, or for a solution and its ranges."""

    def __init__(
        self,
        system: System,
        never_blamed: Sequence[Condition],
        weights: Mapping[Number, Fraction],
    ) -> None:
        self.system, self._weights = system, weights
        self._finder = Finder(system, never_blamed, Effort())
        self._repairs: Repairs | None = None
        self._z: Values | None = None
        self._ranges = dict[str, list[Range | None]]()
        self._has_ranges = self._is_late = False

    def run(self) -> None:
        """Search for linear conflicts, a solution, and conflicts of other conditions;
        then for a repair or the ranges. It may raise TimeIsUp."""
        finder = self._finder
        # Half of a limited time is reserved for the repair.
        try:
            with deadline_after(remaining() / 2):
                finder.contradict()
                if finder.conflict is None:
                    self._z = solution(self.system.data, max_search_unknowns=0)
                if finder.conflict is None and self._z is None:
                    finder.run()
                    self._z = finder.point
        except TimeIsUp:
            self._is_late = True
        if self._z is None:
            self._repair()
        if self._z is not None:
            self._find_ranges(self._z)

    def _repair(self) -> None:
        """Search for the smallest repair; one without changes is a solution."""
        conflict = self._finder.conflict
        is_linear = conflict is not None and all(
            each.kind != COMPLEMENTARITY for each in conflict.members
        )
        # The stage of a conflict of linear conditions alone is repaired first; with
        # None the larger problem is solved at once.
        stage = None
        if conflict is not None and is_linear:
            stage = max((each.stage for each in conflict.multipliers), default=0)
        self._repairs = Repairs(self.system, self._weights, stage)
        self._repairs.run()
        repair = self._repairs.repair
        # The time limit may have ended the search for a solution, which this is.
        if conflict is None and repair is not None and not repair.total:
            self._z = repair.z

    def _find_ranges(self, z: Values) -> None:
        """Compute the ranges of all numbers at a solution."""
        system = System(self.system.data, is_whole=True)
        senses = {(each.field, each.at): each.sense for each in system.numbers}
        self._ranges = {field: [None] * system.n for field in FIELDS}
        for (field, i), number_range in ranges_of(system, z, Effort()):
            if (field, i) in senses:
                has_sense_of_q = senses[field, i] == 1
                self._ranges[field][i] = (
                    number_range if has_sense_of_q else number_range.opposite()
                )
            self._has_ranges = True

    def explanation(self, ended: str, seconds: float) -> Explanation:
        """Return the known results. ended : the limit that ended the search, "" if none
        did.
        """
        conflict, repairs = self._finder.conflict, self._repairs
        repair = None if repairs is None else repairs.repair
        is_impossible = repairs is not None and repairs.is_impossible
        status, is_complete = ended or UNDECIDED, False
        if self._is_late:
            status = TIME_LIMIT
        is_least = is_impossible or (repair is not None and repair.is_least)
        if self._z is not None:
            status, repair = SOLVED, None
            is_complete = self._has_ranges or not self.system.n
        elif conflict is not None or is_least:
            status = UNSOLVABLE
            is_complete = conflict is not None and conflict.irreducible and is_least
        return Explanation(
            self.system.data,
            status,
            is_complete and not ended,
            conflict or NO_CONFLICT,
            repair,
            is_impossible,
            self._z,
            self._ranges,
            () if conflict is not None else self._finder.nearly_contradictory,
            seconds,
        )
