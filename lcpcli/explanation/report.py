"""Explanations as a sentence, as a report and as an object of plain values: with the
names that the author of a problem uses, and numbers as fractions, or rounded such that
the statements remain true.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice
from typing import Any, TypeAlias

from lcpcli.enumeration.search import INTERRUPTED, TIME_LIMIT, UNSOLVABLE
from lcpcli.errors import count, listed
from lcpcli.explanation.conditions import (
    COMPLEMENTARITY,
    LOWER,
    OPTIMALITY,
    RANGE,
    ROW,
    UPPER,
    Condition,
    Number,
    System,
    Values,
)
from lcpcli.explanation.conflicts import Conflict
from lcpcli.explanation.ranges import End, Range
from lcpcli.explanation.repair import Repair
from lcpcli.files.contents import NO_SOURCE, Source
from lcpcli.inspection.classes import definiteness
from lcpcli.inspection.verdict import YES
from lcpcli.linalg.matrices import symmetric_part
from lcpcli.model.words import in_stated_sense, reversed_names
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import approximate, brief, text
from lcpcli.report import wording
from lcpcli.report.document import Document, Section, Table
from lcpcli.report.result_formats import Report, keys_of, source_record
from lcpcli.report.result_formats import record as plain_record

SOLVED, UNDECIDED = "solved", "undecided"
# How a sentence names what tables call lower side, upper side and side.
OF_ROWS = {
    "lower side": "the lower bound of row",
    "upper side": "the upper bound of row",
    "side": "the right-hand side of row",
}
MAX_NAMED = 4  # conditions, or changes, that a sentence names
MAX_TERMS = 6  # of a row in a table
MAX_ROWS = 400  # of a table on a screen or a page

Cell: TypeAlias = Callable[[Fraction, int], str]


@dataclass(frozen=True, eq=False)
class Explanation:
    """The results for a problem, in fractions.

    data : the problem.
    status : "unsolvable" if it has no solution, "solved" if it has the solution z;
        otherwise "time_limit" or "interrupted" if the search was stopped, and
        "undecided" if no method decides it.
    complete : whether all questions are answered: the conflict is irreducible and the
        repair is the smallest one, or proved to be impossible; or all ranges are known.
    reason : the conflict with its proof; `conflict`, `irreducible` and `multipliers`
        are its parts.
    repair : the change of the data, None if none is known. is_impossible : whether it
        is proved that no change of the numbers that may change suffices.
    z : a solution. ranges : of the numbers in the data, under "q", "lower" and "upper",
        for each component of z; None if there is no such number, or its range is not
        known.
    near : conditions that are inconsistent only up to rounding, if none are known that
        are inconsistent in exact arithmetic.
    seconds : the time of the search.
    """

    data: ExactProblem
    status: str
    complete: bool
    reason: Conflict
    repair: Repair | None
    is_impossible: bool
    z: Values | None
    ranges: Mapping[str, Sequence[Range | None]]
    near: Sequence[Condition]
    seconds: float

    @property
    def conflict(self) -> Sequence[Condition]:
        """Return the conditions that cannot hold together."""
        return self.reason.members

    @property
    def irreducible(self) -> bool:
        """Return whether each condition of the conflict is proved to be necessary."""
        return self.reason.irreducible

    @property
    def multipliers(self) -> Mapping[Condition, int]:
        """Return the multipliers, integers, with which linear conditions add up to a
        contradiction; empty for another conflict.
        """
        return self.reason.multipliers

    @property
    def message(self) -> str:
        """Return the outcome in one sentence."""
        return message(self)

    def to_dict(self) -> dict[str, Any]:
        """Return the object that `lcp why --format json` writes."""
        return record(self)

    def __str__(self) -> str:
        return report(self).render()

    def __repr__(self) -> str:
        return f"<Explanation: {self.message}>"


def report(
    explanation: Explanation, source: Source = NO_SOURCE, exact: bool = True
) -> Report:
    """Return the report on an explanation. exact : whether numbers are written as
    fractions instead of with seven digits.
    """
    cell = brief if exact else approximate
    return Report(
        lambda form, _: _document(explanation, cell, form),
        lambda: [record(explanation, source)],
    )


def message(explanation: Explanation, cell: Cell = brief) -> str:
    """Return the outcome in one sentence."""
    is_decided = explanation.status in (UNSOLVABLE, SOLVED)
    ended = {TIME_LIMIT: "time limit: ", INTERRUPTED: "interrupted: "}
    if not is_decided:
        return (
            f"{ended.get(explanation.status, '')}"
            "neither a conflict nor a solution is known"
        )
    if explanation.status == SOLVED:
        known = "each range is" if explanation.complete else "not all ranges are"
        return f"the problem has a solution, and {known} known{_where(explanation)}"
    return "; ".join([*_blame(explanation), *_cure(explanation, cell)])


def _where(explanation: Explanation) -> str:
    """Return a clause on the solutions of which the ranges are; "" if of all.

    The solutions of a monotone problem form one polyhedron. Otherwise there may be
    several, and the optimal partition is that of the one around z.
    """
    problem = explanation.data.problem
    if not problem.n or explanation.z is None:
        return ""
    if definiteness(symmetric_part(problem.M)).semidefinite == YES:
        return ""
    shown = wording.vector(in_stated_sense(problem, explanation.z), brief)
    return f", for the solutions near z = {shown} alone, as M may not be monotone"


def _near(explanation: Explanation) -> str:
    named = wording.vector(
        [f"{each.name} ({each.what})" for each in explanation.near], str
    )
    return (
        f"up to rounding, {len(explanation.near)} conditions contradict: {named[1:-1]}"
    )


def _blame(explanation: Explanation) -> list[str]:
    """Return clauses about the conditions that cannot hold together."""
    members = explanation.conflict
    if not members:
        said = "what is never blamed cannot hold together"
        return [
            said
            if explanation.irreducible
            else "no solution exists, and no conflict is known"
        ]
    names = [f"{each.name} ({each.what})" for each in members]
    if len({each.name for each in members}) == len(members):
        names = [each.name for each in members]
    named = f": {listed(names)}" if len(names) <= MAX_NAMED else ""
    if len(members) == 1:
        said = f"this {_noun(explanation)} cannot hold{named}"
        return (
            [said, "without it the others can"] if explanation.irreducible else [said]
        )
    said = (
        f"these {count(len(members), _noun(explanation))} cannot hold together{named}"
    )
    if explanation.irreducible:
        return [said, "without any one of them the others can"]
    return [said, "it is not proved that all of them are necessary"]


def _noun(explanation: Explanation) -> str:
    """Return the noun for the conditions of a conflict."""
    components = System(explanation.data).components
    kinds = {components[each.at].kind for each in explanation.conflict}
    if any(each.stage == OPTIMALITY for each in explanation.conflict):
        return "optimality condition"
    if kinds <= {ROW, RANGE}:
        return "row"
    is_linear = all(each.kind in (LOWER, UPPER) for each in explanation.conflict)
    return "bound" if is_linear else "condition"


def _cure(explanation: Explanation, cell: Cell) -> list[str]:
    """Return a clause about the repair."""
    repair = explanation.repair
    if repair is None:
        said = "no change of the numbers that may change is enough"
        return [
            said if explanation.is_impossible else "no change that is enough is known"
        ]
    changes = [_change(each.number, each.change, cell) for each in repair.changes]
    side = 1 if repair.is_least else -1
    said = f"{count(len(changes), 'number')} by {cell(repair.total, side)} in total"
    named = listed(changes) if len(changes) <= MAX_NAMED else f"change {said}"
    if repair.is_least:
        return [f"the cheapest change: {named}"]
    if repair.z is not None:
        return [f"a change that is enough, perhaps not the cheapest: {named}"]
    return [f"the total of changes is at least {cell(repair.total, -1)}"]


def _change(number: Number, change: Fraction, cell: Cell) -> str:
    verb = "increase" if change > 0 else "decrease"
    what = number.what if number.what == "q" else f"the {number.what}"
    named = OF_ROWS.get(number.what, f"{what} of")
    return f"{verb} {named} {number.name} by {cell(abs(change), 0)}"


def _document(explanation: Explanation, cell: Cell, form: str) -> Document:
    problem = explanation.data.problem
    title = f"{wording.title(problem) or 'problem'}: {wording.size(problem)}"
    facts = list[str]()
    tables = list[Table]()
    remarks = list[str]()
    if explanation.conflict:
        tables.append(_conflict(explanation, cell))
    if explanation.reason.fewest:
        remarks.append(
            "no fewer complementarities exclude a solution together with all bounds "
            "and signs of w"
        )
    if (repair := explanation.repair) is not None and repair.changes:
        tables.append(_changes(explanation, repair, cell))
    if repair is not None and repair.z is not None:
        z = in_stated_sense(problem, repair.z)
        shown = wording.vector(z, lambda value: cell(value, 0))
        remarks.append(f"a solution after the change: z = {shown}")
    rows = [
        _row(explanation, *each, cell)
        for each in islice(_numbers(explanation), MAX_ROWS)
    ]
    if rows:
        tables.append(
            Table(
                ["number", "", "is", "from", "to", "below", "above"],
                [rows],
                words=(0, 1, 5, 6),
                texts=(5, 6),
                name="Ranges",
            )
        )
    total = sum(1 for _ in _numbers(explanation))
    if total > MAX_ROWS:
        remarks.append(f"the first {MAX_ROWS} of {total} ranges; JSON has all of them")
    took = wording.took(explanation.seconds, form)
    made_by = f"{wording.PROGRAM}, in exact arithmetic{took}"
    said = message(explanation, cell)
    if explanation.near:
        remarks.append(_near(explanation))
    section = Section(
        title, said, explanation.complete, facts, tables, remarks, made_by
    )
    return Document(title, [section])


def _conflict(explanation: Explanation, cell: Cell) -> Table:
    """Return the table of a conflict, with the multipliers that prove one of linear
    conditions.
    """
    system, multipliers = System(explanation.data), explanation.multipliers
    others = [each for each in multipliers if each not in explanation.conflict]
    header = ["condition", "", "requires"]
    if multipliers:
        header.append("times")

    def row(each: Condition) -> list[str]:
        cells = [each.name, each.what, condition(system, each, cell)]
        if multipliers:
            cells.append(brief(Fraction(multipliers[each])))
        return cells

    groups = [[row(each) for each in group] for group in (explanation.conflict, others)]
    notes = ["below the rule: what is never blamed"] if others else []
    return Table(
        header,
        [group for group in groups if group],
        words=(0, 1, 2),
        texts=(2,),
        notes=notes,
        name="Conflict",
    )


def _changes(explanation: Explanation, repair: Repair, cell: Cell) -> Table:
    system = System(explanation.data)
    rows = [
        [
            each.number.name,
            each.number.what,
            cell(value := system.value(each.number), 0),
            cell(value + each.change, 0),
            cell(each.change, 0),
        ]
        for each in repair.changes
    ]
    header = ["number", "", "is", "becomes", "change"]
    return Table(header, [rows], words=(0, 1), name="Changes")


def label(system: System, i: int) -> str:
    """Return the name of a component of z in sentences."""
    name, kind, _ = system.components[i]
    return {ROW: f"y {name}", RANGE: f"the value of {name}"}.get(kind, name)


def condition(system: System, of: Condition, cell: Cell = brief) -> str:
    """Return a condition as a formula."""
    data, name = system.data, label(system, of.at)
    if of.kind == COMPLEMENTARITY:
        values = [
            end for end in (data.lower[of.at], data.upper[of.at]) if end is not None
        ]
        bounds = [f"{name} = {cell(end, 0)}" for end in values]
        return listed([*bounds, f"w{of.at + 1} = 0"], "or")
    forms = system.forms(of)
    row, scale, constant = system.entries(forms[0])
    is_upper = of.kind == UPPER or forms[0] >= 4 * system.n
    side = -1 if is_upper else 1
    relation = "<=" if is_upper else ">="
    if len(forms) == 2:
        relation = "="
    # The multipliers of a program to be maximized have the opposite sign in z.
    turned = reversed_names(data.problem)
    terms = {
        j: Fraction(-side * a if j in turned else side * a, scale)
        for j, a in row.items()
    }
    return f"{_sum(system, terms, cell)} {relation} {cell(-side * constant, 0)}"


def _sum(system: System, terms: Mapping[int, Fraction], cell: Cell) -> str:
    parts = list[str]()
    for j, a in islice(terms.items(), MAX_TERMS):
        size = "" if abs(a) == 1 else f"{cell(abs(a), 0)} "
        sign = "-" if a < 0 else "+"
        lead = f" {sign} "
        if not parts:
            lead = "-" if a < 0 else ""
        parts.append(f"{lead}{size}{label(system, j)}")
    more = f" + {wording.ELLIPSIS}" if len(terms) > MAX_TERMS else ""
    return "".join(parts) + more if parts else "0"


def _numbers(explanation: Explanation) -> Iterator[tuple[Number, Range]]:
    """Yield the numbers whose ranges are known."""
    if explanation.ranges:
        for each in System(explanation.data).numbers:
            if (number_range := explanation.ranges[each.field][each.at]) is not None:
                yield each, number_range


def _row(
    explanation: Explanation, number: Number, number_range: Range, cell: Cell
) -> list[str]:
    # Limits are rounded inward, unless they are equal.
    below, above = number_range.below, number_range.above
    is_point = below is not None and above is not None and below.value == above.value
    inward = 0 if is_point else 1
    return [
        number.name,
        number.what,
        cell(number_range.value, 0),
        "" if below is None else cell(below.value, inward),
        "" if above is None else cell(above.value, -inward),
        _beyond(explanation, below),
        _beyond(explanation, above),
    ]


def _beyond(explanation: Explanation, end: End | None) -> str:
    """Return what changes beyond a limit of a range."""
    if end is None:
        return ""
    if end.enters is None or end.leaves is None:
        return "no solution nearby" if end.ends else "not known"
    system = System(explanation.data)
    parts = [
        f"{word} {listed([label(system, i) for i in indices])}"
        for word, indices in (("in:", end.enters), ("out:", end.leaves))
        if indices
    ]
    return ", ".join(parts) or "other w"


def record(explanation: Explanation, source: Source = NO_SOURCE) -> dict[str, Any]:
    """Return an explanation as an object of plain values, with fractions as texts."""
    system, repair = System(explanation.data), explanation.repair
    multipliers = explanation.multipliers
    overrides: dict[str, Any] = {
        **source_record(source, explanation.data.problem),
        "message": message(explanation),
        "conflict": [
            {
                "name": each.name,
                "what": each.what,
                "asks_for": condition(system, each, lambda value, _: text(value)),
                "multiplier": multipliers.get(each),
            }
            for each in explanation.conflict
        ],
        "fewest": explanation.reason.fewest,
        "near": [{"name": each.name, "what": each.what} for each in explanation.near],
        "repairable": _repairable(explanation),
        "repair": repair
        and {
            "changes": [
                {
                    "name": each.number.name,
                    "what": each.number.what,
                    "value": system.value(each.number),
                    "change": each.change,
                }
                for each in repair.changes
            ],
            "total": repair.total,
            "least": repair.is_least,
            "z": repair.z,
        },
        "ranges": _ranges(explanation, system),
    }
    return plain_record(keys_of("why"), explanation, overrides)


def _repairable(explanation: Explanation) -> bool | None:
    if explanation.is_impossible:
        return False
    return (
        True
        if explanation.repair is not None and explanation.repair.z is not None
        else None
    )


def _ranges(explanation: Explanation, system: System) -> dict[str, Any] | None:
    """Return the ranges of all numbers, in three lists; None for a problem without a
    known solution."""
    if not explanation.ranges:
        return None
    number_of = {(each.field, each.at): each for each in system.numbers}

    def names(indices: Sequence[int] | None) -> list[str] | None:
        return None if indices is None else [label(system, i) for i in indices]

    def one(number: Number, number_range: Range) -> dict[str, Any]:
        below, above = number_range.below, number_range.above
        return {
            "name": number.name,
            "what": number.what,
            "value": number_range.value,
            "lower": below and below.value,
            "upper": above and above.value,
            "enters_below": below and names(below.enters),
            "leaves_below": below and names(below.leaves),
            "enters_above": above and names(above.enters),
            "leaves_above": above and names(above.leaves),
            "ends_below": below and below.ends,
            "ends_above": above and above.ends,
            "objective_lower": below and below.objective,
            "objective_upper": above and above.objective,
            "basis_lower": number_range.basis[0],
            "basis_upper": number_range.basis[1],
        }

    return {
        field: [
            None if number_range is None else one(number_of[field, i], number_range)
            for i, number_range in enumerate(each)
        ]
        for field, each in explanation.ranges.items()
    }
