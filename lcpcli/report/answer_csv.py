"""The answer as CSV with all digits: comments on how it was found, a header, then one line per component."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from io import StringIO
from typing import Any

from lcpcli.model.reductions.program import Program
from lcpcli.report import provenance, summary
from lcpcli.solving.answer import Minimum
from lcpcli.solving.result import Result

COLUMNS = ("component", "z", "w")  # components from 1
STATE = "state"
OF_PROGRAM = ("part", "value", "bound_multiplier")


def render(results: Sequence[Result], compared: bool) -> str:
    """Columns component, z, w and, if a problem has bounds, state; of results that are compared, problem and method
    before them. Behind them the names of components, if there are any, and of programs what each component is."""
    mixed = any(result.problem.is_mixed for result in results)
    named = any(any(result.problem.names) for result in results)
    of_program = any(isinstance(result.problem.origin, Program) for result in results)
    header = [*(["problem", "method"] if compared else []), *COLUMNS, *[STATE] * mixed, *["name"] * named]
    header += OF_PROGRAM if of_program else []
    lines = [
        rows(result, [result.problem.name, summary.name(result)] * compared, mixed, _ends(result, named, of_program))
        for result in results
    ]
    return comments(provenance.lines(results)) + text([header]) + "".join(lines)


def _ends(result: Result, named: bool, of_program: bool) -> list[list[str]]:
    """The last cells of each component: its name and, of a program, whether it is x, y or s, its value in the program's
    own sense, and the multiplier of its bounds."""
    problem = result.problem
    names = [[" ".join(name.split())] * named for name in problem.names]
    if not of_program:
        return names
    parts, answer, origin = [[""] * len(OF_PROGRAM)] * problem.n, result.answer, problem.origin
    if isinstance(origin, Program) and isinstance(answer, Minimum) and answer.x is not None:
        assert answer.y is not None
        assert answer.bound_multipliers is not None
        pairs = zip(answer.x.tolist(), answer.bound_multipliers.tolist(), strict=True)
        parts = [["x", repr(value), repr(multiplier)] for value, multiplier in pairs]
        parts += [["y", repr(value), ""] for value in answer.y.tolist()]
        parts += [["s", repr(value), ""] for value in result.z[len(parts) :].tolist()]
    return [name + part for name, part in zip(names, parts, strict=True)]


def rows(result: Result, start: Sequence[str], mixed: bool, ends: Sequence[list[str]] = ()) -> str:
    """A line for each component of a result, which starts with these cells and ends with its own of others; mixed is
    whether there is a state."""
    states = [[state] for state in result.basis] if mixed else [[]] * result.problem.n
    return text(
        [*start, i, repr(z), repr(w), *state, *end]
        for i, (z, w, state, end) in enumerate(
            zip(result.z.tolist(), result.w.tolist(), states, ends or [[]] * result.problem.n, strict=True), 1
        )
    )


def comments(lines: Sequence[str]) -> str:
    """Lines of text as comments."""
    return "".join(f"# {line}\n" for line in lines)


def text(cells: Iterable[Sequence[Any]]) -> str:
    """Rows of cells as CSV."""
    out = StringIO()
    csv.writer(out, lineterminator="\n").writerows(cells)
    return out.getvalue()
