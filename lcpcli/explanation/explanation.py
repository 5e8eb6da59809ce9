"""Which conditions of a problem without solution are in conflict and which change of
its data would make it solvable, or how far the data of a solvable one may change:
`lcpcli.why`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from fractions import Fraction
from typing import Any

import numpy as np

from lcpcli import clock, options
from lcpcli.enumeration.search import TIME_LIMIT, UNSOLVABLE
from lcpcli.errors import ParameterError, quoted
from lcpcli.explanation.conditions import Condition, Number, System, matching
from lcpcli.explanation.conflicts import Conflict, Finder
from lcpcli.explanation.ranges import Range
from lcpcli.explanation.ranges import ranges as ranges_of
from lcpcli.explanation.repair import Repairs
from lcpcli.explanation.report import SOLVED, UNDECIDED, Explanation
from lcpcli.interrupts import TimeIsUp, deadline_after, remaining
from lcpcli.model.problem import Problem, as_problem
from lcpcli.options import DEFAULTS, Limits
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import rounded
from lcpcli.rational.written import exact_data
from lcpcli.solving import driver
from lcpcli.solving.proof import MAX_EXACT_UNKNOWNS
from lcpcli.verify.exact_solution import from_point

NO_CONFLICT = Conflict(())
SHORT = 1e-6  # seconds for the solution if the time is up


def why(
    problem: Problem | ExactProblem,
    *,
    keep: str | Iterable[str] = (),
    change: str | Iterable[str] | None = None,
    weights: Mapping[str, Any] | None = None,
    time_limit: float | None = None,
    observe: Callable[[Explanation], None] | None = None,
) -> Explanation:
    """Solve a problem. If it has no solution: which smallest change of its numbers
    makes it solvable, and which of its conditions cannot hold together, each of them
    necessary, in exact arithmetic. If it is a program with a solution: the range of
    each cost and each row side, the others being fixed, in which the optimal basis
    stays the same.

    Parameters
    ----------
    problem : a Problem, whose numbers are taken as `solutions` takes them, or an
        ExactProblem.
    keep : conditions that are not reported in the conflict, by name, as "protein", or
        by name and what they are, as "z1 lower bound"; * matches any text. The
        repair may change their numbers, unless `change` names others.
    change : numbers that may change in a repair, named in the same way, as "x1 upper
        bound";
        by default the entries of q or, of a program, costs and row sides.
    weights : the cost of a change by 1, a positive number, by the names of numbers that
        may change; by default 1.
    time_limit : seconds after which to stop, with what is known by then; by default
        there is no limit. Half of it is for the solution, half of the rest for the
        repair, and what is left for the conflict.
    observe : a function that is called with the repair, before the conflict is known.

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
        problem = exact_data(as_problem(problem))
    system = System(problem)
    conditions = [*system.linear, *system.complementarities]
    never_blamed = matching(conditions, _texts("keep", keep), "keep")
    chosen = _weights(system, change, weights)
    search = _Search(system, never_blamed, chosen, observe or (lambda _: None))
    try:
        with deadline_after(math.inf if time_limit is None else time_limit):
            search.run()
    except TimeIsUp:
        return search.explanation(TIME_LIMIT)
    return search.explanation()


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
    """The search for a solution and its ranges, or for a repair and a conflict."""

    def __init__(
        self,
        system: System,
        never_blamed: Sequence[Condition],
        weights: Mapping[Number, Fraction],
        observe: Callable[[Explanation], None],
    ) -> None:
        self.system, self._observe = system, observe
        self._finder = Finder(system, never_blamed)
        self._repairs = Repairs(system, weights)
        self._began, self._status = clock.seconds(), UNDECIDED
        self._z: Sequence[Any] | None = None
        self._ranges: list[Range] | None = None
        self._is_late = False

    def run(self) -> None:
        """Search for a solution; then for its ranges, or for a repair, and then for a
        conflict. Each has half of the time that is left. It may raise TimeIsUp.
        """
        with self._share():
            self._solve()
        if self._z is None:
            with self._share():
                self._repairs.run()
            repair = self._repairs.repair
            if repair is not None and not repair.total:
                self._z, self._status = repair.z, SOLVED
        if self._z is None:
            self._observe(self.explanation())
            self._finder.run()
            if self._finder.point is not None:
                self._z, self._status = self._finder.point, SOLVED
        if self._z is not None and self.system.data.problem.block_form is not None:
            z = np.array(rounded([*map(Fraction, self._z)]))
            self._ranges = [*ranges_of(self.system, z)]
        self._is_late = self._is_late and self._z is None

    @contextmanager
    def _share(self) -> Iterator[None]:
        """Open a context with half of the time that is left, whose end is noted."""
        try:
            with deadline_after(remaining() / 2):
                yield
        except TimeIsUp:
            self._is_late = True

    def _solve(self) -> None:
        """Solve the problem as `lcpcli.solve` does; with few unknowns the solution has
        to be an exact one.
        """
        data = self.system.data
        limit = remaining()
        limits = DEFAULTS if limit == math.inf else Limits(time_limit=max(limit, SHORT))
        result = driver.run(data.problem, "auto", limits=limits)
        if result.interrupted:
            raise KeyboardInterrupt
        proof = result.certificate
        # A proof may hold for rounded data, or up to rounding, alone.
        is_proved = proof is None or not proof.is_rounded
        if result.status.has_no_solution and is_proved and data.are_floats():
            self._status = UNSOLVABLE
        elif result.solved and data.n <= MAX_EXACT_UNKNOWNS:
            self._z = from_point(data, result.z)
        elif result.solved:
            self._z = result.z.tolist()
        if self._z is not None:
            self._status = SOLVED

    def explanation(self, ended: str = "") -> Explanation:
        """Return the known results. ended : the limit that ended the search, "" if none
        did.
        """
        conflict, repair = self._finder.conflict, self._repairs.repair
        is_impossible = self._repairs.is_impossible
        is_least = is_impossible or (repair is not None and repair.is_least)
        ended = ended or (TIME_LIMIT if self._is_late else "")
        if self._z is not None:
            repair, is_complete = None, True
        elif conflict is not None or is_least:
            self._status = UNSOLVABLE
            is_complete = conflict is not None and conflict.irreducible and is_least
        else:
            is_complete = False
        return Explanation(
            self.system.data,
            self._status if self._status != UNDECIDED else ended or UNDECIDED,
            is_complete and not ended,
            conflict or NO_CONFLICT,
            repair,
            is_impossible,
            self._z,
            self._ranges,
            () if conflict is not None else self._finder.nearly_contradictory,
            clock.seconds() - self._began,
        )
