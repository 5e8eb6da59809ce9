"""The columns of iterates after z: in tables, in CSV and in JSON. Nothing heavy is imported, as help names them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from lcpcli.report import wording

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.solving.trace import TraceRow

Shown: TypeAlias = "dict[str, Callable[[TraceRow], str]]"  # a heading, with the function that makes a cell of a row


class Column(NamedTuple):
    """A column.

    value : a function from a row to the column's value in it, for CSV and JSON.
    shown : what shows it in a table of rows, whose z may lack some components; empty if the column is left out.
    """

    value: Callable[[TraceRow], Any]
    shown: Callable[[Problem, Sequence[TraceRow]], Shown]


def _step(_: Problem, rows: Sequence[TraceRow]) -> Shown:
    return {"step": lambda row: row.step} if any(row.step for row in rows) else {}


def _residual(problem: Problem, _: Sequence[TraceRow]) -> Shown:
    if problem.solutions:
        return {}
    return {"residual": lambda row: wording.short(row.residual, math.inf if row.rounding else 0.0)}


def _error(problem: Problem, _: Sequence[TraceRow]) -> Shown:
    return {"error": lambda row: wording.error(row.error, problem)} if problem.solutions else {}


def _time(_: Problem, rows: Sequence[TraceRow]) -> Shown:
    length, unit = wording.unit(max((row.seconds for row in rows), default=0.0))
    return {f"time/{unit}": lambda row: f"{row.seconds / length:.3f}"}


COLUMNS = {  # by their names in CSV and JSON
    "residual": Column(lambda row: row.residual, _residual),
    "error": Column(lambda row: row.error, _error),
    "seconds": Column(lambda row: row.seconds, _time),
    "step": Column(lambda row: row.step or None, _step),
}
FIRST = "step"  # of a table


def called(name: str) -> str:
    """Return the name of a column on the command line."""
    return {"seconds": "time"}.get(name, name)


CHOICES = ("k", "z", *map(called, COLUMNS))  # the columns that a user may choose


def of_table(problem: Problem, rows: Sequence[TraceRow]) -> Shown:
    """Return the columns of a table of these rows."""
    names = sorted(COLUMNS, key=lambda name: name != FIRST)
    found = {heading: cell for name in names for heading, cell in COLUMNS[name].shown(problem, rows).items()}
    if any(row.z0 is not None for row in rows):
        found = {"z0": lambda row: "" if row.z0 is None else f"{row.z0:.7g}", **found}
    return found


def values(row: TraceRow) -> dict[str, Any]:
    """Return the values of a row that CSV and JSON show after z."""
    own = {name: column.value(row) for name, column in COLUMNS.items()}
    return own if row.z0 is None else {**own, "z0": row.z0}
