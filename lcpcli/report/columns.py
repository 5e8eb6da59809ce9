"""The columns of the iterates: a row of the table for each, from which every format,
the option --columns, its errors and help derive them. Nothing heavy is imported, as
help names them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from lcpcli.errors import EMPTY_ENTRY, ParameterError, likely, quoted
from lcpcli.methods.quantities import Z0, Quantity, X
from lcpcli.methods.registry import (
    ALL,
    QUANTITIES,
    quantities_of,
    require_quantities,
)
from lcpcli.report import wording

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.solving.trace import Trace, TraceRow


class Frame(NamedTuple):
    """What the cells of a table of iterates depend on besides their rows.

    names : those of all unknowns, for headings. shown_components : the indices of the
        components that are shown, None for those that are omitted.
    signs : the signs by which the components of z in the rows are multiplied. largest :
        the size of the largest component of the last z of a run.
    unit : the unit of times, its length in seconds and its name. marks_selected :
        whether the second point of shi has the step "selected".
    """

    problem: Problem
    names: Sequence[str]
    shown_components: Sequence[int | None]
    signs: Any
    largest: float
    unit: tuple[float, str]
    marks_selected: bool


class Selection(NamedTuple):
    """What a report on results shows of them.

    compared : whether the iterates come first and then one line for each result;
        otherwise the result comes first. shows_all : whether such a result shows all
        components of z.
    swept : whether CSV has a row for each run. iterates : whether CSV consists of the
        iterates.
    columns : the columns of the iterates, as for `selected_columns`; with them a table
        has no summary. names : the names of the unknowns that are shown, as for
        `wording.selected_components`, whose components the traces have (those of a game
        have all); empty for as many as fit.
    """

    compared: bool = True
    shows_all: bool = False
    swept: bool = False
    iterates: bool = False
    columns: Sequence[str] = ()
    names: Sequence[str] = ()


Cells: TypeAlias = "Callable[[Any, TraceRow, Frame], list[str]]"


class Column(NamedTuple):
    """A column, or for a vector one for each component.

    name, meaning : as users see them. value : returns the value for a row; None where
        there is none. cells : the texts of a value in a table. key : the name in CSV
        and JSON, if that is another one.
    """

    name: str
    meaning: str
    value: Callable[[TraceRow], Any]
    cells: Cells
    is_vector: bool = False
    key: str = ""

    def heads(self, frame: Frame) -> list[str]:
        """Return the headings in a table."""
        if self.name == TIME:
            return [f"{TIME}/{frame.unit[1]}"]
        if not self.is_vector:
            return [self.name]
        n = len(frame.names)
        component_names = frame.names if self.name == "z" else self.keys(range(n))
        return [
            wording.ELLIPSIS if i is None else component_names[i]
            for i in frame.shown_components
        ]

    def shown(self, row: TraceRow, frame: Frame) -> list[str]:
        """Return the cells of a row of a table."""
        value = self.value(row)
        if value is None:
            return [""] * (len(frame.shown_components) if self.is_vector else 1)
        cells = self.cells(value, row, frame)
        if self.is_vector and None in frame.shown_components:
            cells[-1:-1] = [wording.ELLIPSIS]
        return cells

    def keys(self, shown_components: Iterable[int]) -> list[str]:
        """Return the names in CSV, of a vector for each of these components."""
        if self.is_vector:
            return [f"{self.name}{i + 1}" for i in shown_components]
        return [self.key or self.name]

    def values(self, row: TraceRow, shown_components: Sequence[int]) -> list[Any]:
        """Return the values in CSV, in which a shorter vector leaves cells empty."""
        value = self.value(row)
        if not self.is_vector:
            return [value]
        entries = [] if value is None else value.tolist()
        return [entries[i] if i < len(entries) else "" for i in shown_components]


TIME = "time"
# The method shi and the number of the step in the paper.
STEP_OF_SELECTED_POINTS = "shi", "1"


def _plain(value: Any, *_: Any) -> list[str]:
    return [wording.plain_number(value) if isinstance(value, float) else str(value)]


def _components_of_z(value: Any, _: TraceRow, frame: Frame) -> list[str]:
    return wording.components((frame.signs * value + 0.0).tolist(), frame.largest)


def _components_of_x(value: Any, _: TraceRow, frame: Frame) -> list[str]:
    return wording.halves(value.tolist(), frame.largest)


def _components(value: Any, *_: Any) -> list[str]:
    return [wording.plain_number(entry) for entry in value.tolist()]


def _step(value: str, row: TraceRow, frame: Frame) -> list[str]:
    is_selected = (row.method, value) == STEP_OF_SELECTED_POINTS
    return ["selected" if is_selected and frame.marks_selected else value]


def _residual(value: float, row: TraceRow, _: Frame) -> list[str]:
    return [wording.short(value, math.inf if row.rounding else 0.0)]


def _error(value: float, _: TraceRow, frame: Frame) -> list[str]:
    return [wording.error(value, frame.problem)]


def _seconds(value: float, _: TraceRow, frame: Frame) -> list[str]:
    return [wording.digits(value / frame.unit[0])]


def _of_step(row: TraceRow, name: str) -> Any:
    return row.quantities.get(name)


def _quantity(quantity: Quantity) -> Column:
    """Return the column of a quantity of a step."""
    if quantity is X:
        return Column(X.name, X.meaning, lambda row: row.x, _components_of_x, True)
    if quantity is Z0:
        return Column(Z0.name, Z0.meaning, lambda row: row.z0, _plain)
    cells = _components if quantity.is_vector else _plain
    value = partial(_of_step, name=quantity.name)
    return Column(quantity.name, quantity.meaning, value, cells, quantity.is_vector)


def table() -> dict[str, Column]:
    """Return all columns by name, in the order in which a table has them."""
    of_steps = {name: _quantity(quantity) for name, quantity in QUANTITIES.items()}
    made = [
        Column("k", "the number of the iterate; the start is 0", lambda r: r.k, _plain),
        Column("z", "the components of z", lambda r: r.z, _components_of_z, True),
        of_steps.pop(X.name),
        of_steps.pop(Z0.name),
        Column(
            "step",
            "the step of the published algorithm that has produced it",
            lambda row: row.step or None,
            _step,
        ),
        *of_steps.values(),
        Column(
            "residual",
            "the natural residual |min(z, Mz + q)|, the largest entry",
            lambda row: row.residual,
            _residual,
        ),
        Column(
            "error",
            "|z - z*|, the largest entry, if a solution z* is known",
            lambda row: row.error,
            _error,
        ),
        Column(
            TIME,
            "the time from the start of the run",
            lambda row: row.seconds,
            _seconds,
            key="seconds",
        ),
    ]
    return {column.name: column for column in made}


# The columns that CSV and JSON have for every method, in this order.
OF_EVERY_METHOD = ("k", "z", "residual", "error", TIME, "step")


def selected_columns(names: Sequence[str], methods: Sequence[str]) -> list[Column]:
    """Return the columns of these names for runs of some methods; "all" means those of
    every method and of these."""
    all_columns = table()
    if ALL not in names:
        return [all_columns[name] for name in dict.fromkeys(names)]
    of_methods = quantities_of(methods)
    return [
        column
        for name, column in all_columns.items()
        if name not in QUANTITIES or name in of_methods
    ]


def require(names: Sequence[str], methods: Sequence[str]) -> None:
    """Raise an error for a name that is no column, or one of none of the methods."""
    valid_names = [*table(), ALL]
    if "" in names:
        raise ParameterError("columns", *EMPTY_ENTRY)
    for name in names:
        if name not in valid_names:
            reason = f"{quoted(name)} is not a column"
            raise ParameterError("columns", reason, likely(name, valid_names))
    require_quantities(names, methods)


def of_traces(names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the columns that only a trace with them records."""
    return tuple(name for name in names if name in QUANTITIES or name == ALL)


def by_default(problem: Problem, rows: Sequence[TraceRow]) -> list[Column]:
    """Return the columns of a table of iterates, where none is chosen."""
    all_columns = table()
    names = ["k", "z", Z0.name, "step", "error" if problem.solutions else "residual"]
    shown = [all_columns[name] for name in [*names, TIME]]
    return [
        column
        for column in shown
        if column.name not in (Z0.name, "step") or has_values(column, rows)
    ]


def has_values(column: Column, rows: Sequence[TraceRow]) -> bool:
    return any(column.value(row) is not None for row in rows)


def records(trace: Trace) -> list[dict[str, Any]]:
    """Return the rows of a trace for JSON, with its columns."""
    all_columns, has_x = table(), not {X.name, ALL}.isdisjoint(trace.columns)
    always = [all_columns[name] for name in OF_EVERY_METHOD]
    return [
        {
            **{column.key or column.name: column.value(row) for column in always},
            **({} if row.z0 is None else {Z0.name: row.z0}),
            **({X.name: row.x} if has_x else {}),
            **row.quantities,
            "method": row.method,
        }
        for row in trace.rows
    ]


def meanings(method: str) -> list[tuple[str, str]]:
    """Return the names and meanings of the columns of a method for help, in the order
    of tables."""
    method_columns = selected_columns([ALL], [method])
    return [(column.name, column.meaning) for column in method_columns]
