"""The best solution by a linear objective as a report, as JSON and as CSV."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

from lcpcli.enumeration.optimum import OPTIMAL, Optimum
from lcpcli.errors import count
from lcpcli.files.contents import Source
from lcpcli.linalg.doubles import LARGEST_DOUBLE
from lcpcli.model.names import in_own_sense
from lcpcli.model.program import Program
from lcpcli.rational.numbers import approximate, brief, rounded
from lcpcli.report import json_lines, programs_and_games, selection, solutions, wording
from lcpcli.report.document import Document, Section, Table
from lcpcli.report.json_lines import numbers
from lcpcli.report.result_formats import Report
from lcpcli.report.tables import longest

KEYS = ("status", "message", "sense", "value", "bound", "gap", "z", "w", "x", "y", "equilibrium", "nodes", "seconds")
MOST_LINES = 500  # rows of a table; JSON and CSV have all


def report(found: Optimum, source: Source, exact: bool, names: Sequence[str] = ()) -> Report:
    """Return the report on the best solution of a problem at a place. exact, names : as for `build`."""
    return Report(
        lambda form, _: build(found, exact, form, names),
        lambda: [_record(found, source, exact)],
        lambda: _rows(found, exact, names),
    )


def build(found: Optimum, exact: bool, form: str, names: Sequence[str] = ()) -> Document:
    """Return the report on the best solution. exact : whether numbers are shown as fractions. names : of the unknowns
    that are shown, as for `selection.places`; empty for all."""
    cell: Callable[..., str] = brief if exact else approximate
    problem = found.data.problem
    numbers = (("objective", "value"), ("bound", "bound"), ("gap", "gap"))
    facts = [
        f"{word} {cell(value, found.outward[name])}"
        for word, name in numbers
        if (value := getattr(found, name)) is not None
    ]
    if each := found.equilibrium:
        facts += programs_and_games.strategies(problem.origin, [*each.row], [*each.column], each.payoffs, cell)
    tree = programs_and_games.behavior_of(problem.origin, found.z) if found.z else None
    facts += [programs_and_games.payoffs_of(tree)] if tree else []
    own = wording.headings(problem, longest(form))
    chosen = selection.places(selection.labels_of(problem)[: problem.n], names)
    kept = chosen[:MOST_LINES]
    if len(kept) < len(chosen):
        facts.append(
            f"the first {MOST_LINES} of {count(len(chosen), 'unknown')}; --format json and csv have all of them"
        )
    z, w = (in_own_sense(problem, values or []) for values in (found.z, found.w))
    rows = [[own[i], cell(z[i]), cell(w[i])] for i in kept] if z else []
    section = Section(
        f"{wording.title(problem) or 'problem'}: {wording.size(problem)}",
        found.message(cell),
        found.status == OPTIMAL,
        [*facts, f"{count(found.nodes, 'node')} of the tree over the states"],
        [*([programs_and_games.behavior(tree.information_sets)] if tree else []), Table(["", "z", "w"], [rows])],
        provenance=f"{wording.PROGRAM}, in exact arithmetic{wording.took(found.seconds, form)}",
    )
    return Document(section.title, [section])


def _record(found: Optimum, source: Source, exact: bool) -> dict[str, Any]:
    problem = found.data.problem
    values = {name: numbers(getattr(found, name), exact) for name in ("z", "w")}
    for name, toward in found.outward.items():
        number = getattr(found, name)
        values[name] = json_lines.plain(number if number is None or exact else _outward(number, toward))
    own = {**values, "message": found.message(brief if exact else approximate), "equilibrium": None}
    if each := found.equilibrium:
        own["equilibrium"] = solutions.equilibrium(each, exact)
    elif found.z:
        own["equilibrium"] = solutions.of_tree(problem.origin, found.z, exact)
    if isinstance(problem.origin, Program) and found.z:
        parts = zip("xy", problem.origin.own_parts(found.z), strict=False)
        own |= {key: numbers(part, exact) for key, part in parts}
    record = {name: own[name] if name in own else getattr(found, name, None) for name in KEYS}
    return {**json_lines.place(source, problem), **record}


def _rows(found: Optimum, exact: bool, names: Sequence[str]) -> tuple[list[Sequence[Any]], list[str]]:
    """Return z and w as `lcp check` reads them, with a comment."""
    problem, z, origin = found.data.problem, found.z or [], found.data.problem.origin
    header, own = ["component", "z", "w"], list[Sequence[Any]]([()] * len(z))
    if isinstance(origin, Program):
        header += solutions.PROGRAM_COLUMNS
        own = [*solutions.of_program(origin, z, exact)] if z else []
    columns = numbers(z, exact), numbers(found.w or [], exact), own, problem.names
    lines = [(i, a, b, *cells, name) for i, (a, b, cells, name) in enumerate(zip(*columns, strict=False), 1)]
    kept = selection.places(selection.labels_of(problem)[: problem.n], names)[: len(lines)]
    comment = ": ".join(filter(None, [problem.name, found.message(brief)]))
    return [(*header, "name"), *(lines[i] for i in kept)], [comment]


def _outward(value: Fraction, toward: int) -> float:
    """Return the nearest double that is not below a number if `toward` is 1, and not above it if it is -1; an infinity
    where there is none."""
    nearest = float(rounded([value])[0])
    if math.isinf(nearest):
        return nearest if toward * nearest > 0 else math.copysign(LARGEST_DOUBLE, nearest)
    return nearest if toward * (Fraction(nearest) - value) >= 0 else math.nextafter(nearest, toward * math.inf)
