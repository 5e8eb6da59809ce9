"""Explanations as a sentence, as a report and as an object of plain values: with the
names that the author of a problem uses, and numbers as fractions, or rounded such that
the statements remain true.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
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
)
from lcpcli.explanation.conflicts import Conflict
from lcpcli.explanation.ranges import Range
from lcpcli.explanation.repair import Repair, changed
from lcpcli.files.contents import NO_SOURCE, Source
from lcpcli.model.problem import Problem
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
MAX_MEMBERS = 20  # of a conflict; those of similar names are then shown in one line
MAX_SIMILAR = 8  # conditions of similar names that are still shown one by one
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
        repair is the smallest one, or proved to be impossible; or there is a solution.
    reason : the conflict with its proof; `conflict`, `irreducible` and `multipliers`
        are its parts.
    repair : the change of the data, None if none is known. is_impossible : whether it
        is proved that no change of the numbers that may change suffices.
    z : a solution: exact up to some hundred unknowns, else in floating-point
        arithmetic, as it is solved. ranges : of the costs and row sides of a program
        with a solution; None for other problems.
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
    z: Sequence[Any] | None
    ranges: Sequence[Range] | None
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
    def repaired(self) -> Problem | None:
        """Return the problem with the changes of the repair, in double precision, that
        is solvable with them; None if no such changes are known.
        """
        if self.repair is None or self.repair.z is None:
            return None
        numbers = ((each.number, each.change) for each in self.repair.changes)
        change_of = {
            (number.field, number.at): number.sense * change
            for number, change in numbers
        }
        return changed(self.data, change_of).problem

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
    explanation: Explanation,
    source: Source = NO_SOURCE,
    exact: bool = True,
    parts: slice = slice(None),
) -> Report:
    """Return the report on an explanation. exact : whether numbers are written as
    fractions instead of with seven digits. parts : the sections of a document, of which
    there are two for a problem without a solution: the repair, and the conflict.
    """
    cell = brief if exact else approximate

    def document(form: str, _: int | None) -> Document:
        whole = _document(explanation, cell, form)
        return whole._replace(sections=whole.sections[parts])

    return Report(
        document,
        lambda: [record(explanation, source)],
    )


def message(explanation: Explanation, cell: Cell = brief) -> str:
    """Return the outcome in one sentence."""
    if explanation.status == SOLVED:
        known = ", and each range is known" if explanation.ranges else ""
        return f"the problem has a solution{known}"
    ended = {TIME_LIMIT: "time limit: ", INTERRUPTED: "interrupted: "}
    if explanation.status != UNSOLVABLE and explanation.repair is None:
        why = ended.get(explanation.status, "")
        return f"{why}neither a conflict nor a solution is known"
    return "; ".join([*_cure(explanation, cell), *_blame(explanation)])


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
        if explanation.irreducible:
            return ["what is never blamed cannot hold together"]
        is_unsolvable = explanation.status == UNSOLVABLE
        return ["no solution exists"] * is_unsolvable + ["no conflict is known"]
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
    title = _headline(explanation)
    took = wording.took(explanation.seconds, form)
    made_by = f"{wording.PROGRAM}{took}"
    is_open = explanation.status != UNSOLVABLE and explanation.repair is None
    if explanation.status == SOLVED or is_open:
        section = Section(
            title,
            message(explanation, cell),
            explanation.complete,
            tables=[_ranges(explanation.ranges or [])],
            remarks=[_near(explanation)] if explanation.near else [],
            provenance=made_by,
        )
        return Document(title, [section])
    return Document(
        title,
        [
            _repaired(explanation, cell),
            _blamed(explanation, cell, f"{wording.PROGRAM}, in exact arithmetic{took}"),
        ],
    )


def _headline(explanation: Explanation) -> str:
    problem = explanation.data.problem
    return f"{wording.title(problem) or 'problem'}: {wording.size(problem)}"


def _repaired(explanation: Explanation, cell: Cell) -> Section:
    """Return the section on the repair."""
    repair, remarks = explanation.repair, list[str]()
    has_changes = repair is not None and bool(repair.changes)
    tables = [_changes(explanation, repair, cell)] if repair and has_changes else []
    if repair is not None and repair.z is not None:
        z = in_stated_sense(explanation.data.problem, repair.z)
        shown = wording.vector(z, lambda value: cell(value, 0))
        remarks.append(f"a solution after the change: z = {shown}")
    crossing = _crossing(explanation)
    if crossing:
        remarks.append(f"the change reverses the sign of {listed(crossing)}")
    verdict = "; ".join(_cure(explanation, cell))
    is_least = repair is not None and repair.is_least
    title = _headline(explanation)
    return Section(title, verdict, is_least, tables=tables, remarks=remarks)


def _crossing(explanation: Explanation) -> list[str]:
    """Return the names of numbers whose sign the repair reverses."""
    system = System(explanation.data)
    return [
        f"{each.number.name} ({each.number.what})"
        for each in (explanation.repair.changes if explanation.repair else ())
        if (value := system.value(each.number)) * (value + each.change) < 0
    ]


def _blamed(explanation: Explanation, cell: Cell, made_by: str) -> Section:
    """Return the section on the conflict."""
    tables = [_conflict(explanation, cell)] if explanation.conflict else []
    near = [_near(explanation)] if explanation.near else []
    return Section(
        "conflict",
        "; ".join(_blame(explanation)),
        explanation.irreducible,
        tables=tables,
        remarks=near,
        provenance=made_by,
    )


def _ranges(ranges: Sequence[Range]) -> Table:
    """Return the table of the ranges of a program, with rounded numbers."""

    def row(each: Range) -> list[str]:
        ends = each.below, each.above
        return [
            each.number.name,
            each.number.what,
            f"{each.value:.7g}",
            *("" if end is None else f"{end.value:.7g}" for end in ends),
            *("" if end is None else end.change for end in ends),
        ]

    header = ["number", "", "is", "from", "to", "below", "above"]
    rows = [row(each) for each in ranges[:MAX_ROWS]]
    more = f"the first {MAX_ROWS} of {len(ranges)} ranges; JSON has all of them"
    notes = [more] if len(ranges) > MAX_ROWS else []
    words, texts = (0, 1, 5, 6), (5, 6)
    return Table(header, [rows] if rows else [], words, texts, notes, "Ranges")


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

    def rows(of: Sequence[Condition]) -> list[list[str]]:
        if len(of) <= MAX_MEMBERS:
            return [row(each) for each in of]
        similar = dict[tuple[str, str], list[Condition]]()
        for each in of:
            pattern = re.sub(r"[\W_]*\d.*", "*", each.name)
            similar.setdefault((pattern, each.what), []).append(each)
        table = list[list[str]]()
        for (pattern, what), some in similar.items():
            if len(some) <= MAX_SIMILAR:
                table += [row(each) for each in some]
                continue
            first = condition(system, some[0], cell)
            cells = [pattern, what, f"{len(some)} of them, the first: {first}"]
            table.append([*cells, ""][: len(header)])
        return table

    groups = [rows(group) for group in (explanation.conflict, others)]
    notes = ["below the rule: what is never blamed"] if others else []
    if max(len(explanation.conflict), len(others)) > MAX_MEMBERS:
        notes.append("conditions of similar names in one line; JSON has each")
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
        "ranges": explanation.ranges
        and [
            {
                "name": each.number.name,
                "what": each.number.what,
                "value": each.value,
                "lower": each.below and each.below.value,
                "upper": each.above and each.above.value,
                "below": each.below and each.below.change,
                "above": each.above and each.above.change,
            }
            for each in explanation.ranges
        ],
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
