"""Results as CSV with all digits: the answers or the iterates, both with comments on
the runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import chain, count, repeat
from typing import Any, TypeAlias

from lcpcli.model.formulation import CELLS, Answer
from lcpcli.report import columns, wording
from lcpcli.report.tables import reached
from lcpcli.solving.result import Result

ITERATES = "iterates, "

Cells: TypeAlias = Sequence[Any]
Rows: TypeAlias = tuple[list[Cells], list[str]]  # and lines of comments above them
# Names of columns, and cells of each row.
Part: TypeAlias = tuple[Sequence[str], Callable[[Result], Sequence[Cells]]]

STATES: Part = ("state",), lambda result: [[state] for state in result.basis]


def answers(
    results: Sequence[Result], compared: bool, shown: Sequence[str] = ()
) -> Rows:
    """Return the answers: component, z, w (fractions if proved), the basis status if a
    problem has bounds, and the names of components and their meaning; compared results
    have problem and method first. shown : the names of the unknowns that have a row, as
    for `wording.selected_components`."""
    parts = [
        *[STATES] * any(result.problem.bounds for result in results),
        *[(("name",), _names)] * any(chain(*map(_named, results))),
        *_of_answers(results),
    ]
    header = [
        *(["problem", "method"] if compared else []),
        "component",
        "z",
        "w",
        *(name for names, _ in parts for name in names),
    ]
    rows: list[Cells] = [header]
    for result in results:
        start = [result.problem.name, wording.name(result)] if compared else []
        rows_of_result = _rows(result, start, parts)
        rows += [
            rows_of_result[i]
            for i in wording.selected_components(
                wording.labels_of(result.problem), shown
            )
        ]
    return rows, wording.provenance(results)


def part(result: Result, source: str) -> Rows:
    """Return the rows of one of many problems, with basis status and name, and comments
    on the result."""
    names = [[name] for name in result.problem.names]
    comments = [*wording.provenance([result])[1:], *wording.headline(result)]
    return _rows(result, [source], [STATES, (("name",), lambda _: names)]), comments


def iterates(
    results: Sequence[Result],
    column_names: Sequence[str] = (),
    names: Sequence[str] = (),
) -> Rows:
    """Return the iterates: problem, method, the columns, and in the last row of a run
    its status. column_names : the names of the columns, as for
    `columns.selected_columns`; empty for those of every method. names : of the unknowns
    that have a column, by the first problem, as for `wording.selected_components`;
    empty for all."""
    n = max(result.problem.n for result in results)
    components = (
        wording.selected_components(wording.labels_of(results[0].problem), names)
        if names
        else range(n)
    )
    selected = columns.selected_columns(
        column_names or columns.OF_EVERY_METHOD, [result.method for result in results]
    )
    heads = chain.from_iterable(column.keys(components) for column in selected)
    lines: list[Cells] = [["problem", "method", *heads, "status"]]
    for result in results:
        start = [result.problem.name, wording.name(result)]
        rows = result.trace.rows if result.trace else []
        for row in rows:
            cells = chain.from_iterable(
                column.values(row, components) for column in selected
            )
            status = result.status.word if row is rows[-1] else ""
            lines.append([*start, *cells, status])
    return lines, [
        ITERATES + line if k == 0 else line
        for k, line in enumerate(wording.provenance(results))
    ]


def runs(results: Sequence[Result]) -> Rows:
    """Return a row for each run: problem, method (the run's name, as among the
    iterates), the options of all runs, status, costs, measures, and for each level of
    error the iterations and seconds to it; missing values are empty."""
    options_of_runs = [
        wording.options_of(result, shows_all_digits=True) for result in results
    ]
    options = list(dict.fromkeys(chain(*options_of_runs)))
    measures = (
        "iterations",
        "evaluations",
        "seconds",
        "spread",
        "residual",
        "relative_residual",
        "error",
    )
    levels = [
        f"{what}_to_{wording.level(level)}"
        for level in wording.LEVELS
        for what in ("iterations", "seconds")
    ]
    rows: list[Cells] = [["problem", "method", *options, "status", *measures, *levels]]
    for result, options_of_run in zip(results, options_of_runs, strict=True):
        costs = chain(
            *(reached(result).get(level, (None, None)) for level in wording.LEVELS)
        )
        start = [
            result.problem.name,
            wording.name(result),
            *map(options_of_run.get, options),
            result.status.word,
        ]
        rows.append([*start, *(getattr(result, name) for name in measures), *costs])
    return rows, wording.provenance(results)


def _rows(result: Result, start: Cells, parts: Sequence[Part]) -> list[Cells]:
    """Return a row for each component, with blanks where a part says nothing about
    it."""
    blanks = (chain(cells(result), repeat([""] * len(names))) for names, cells in parts)
    rows = zip(count(1), *_vectors(result), *blanks, strict=False)
    return [[*start, i, z, w, *chain(*more)] for i, z, w, *more in rows]


def _vectors(result: Result) -> tuple[Cells, Cells]:
    exact = result.exact
    if exact is not None and exact.z and exact.w:
        return _fractions(exact.z), _fractions(exact.w)
    return result.z.tolist(), result.w.tolist()


def _fractions(values: Cells) -> Cells:
    from lcpcli.rational.numbers import text

    return [
        value if value is None or isinstance(value, (float, str)) else text(value)
        for value in values
    ]


def _names(result: Result) -> list[Cells]:
    return [[name] for name in _named(result)]


def _named(result: Result) -> Sequence[str]:
    return result.problem.formulation.names(result.problem.n, CELLS)


def _of_answers(results: Sequence[Result]) -> list[Part]:
    """Return the columns of the answers of formulations, each once."""
    parts: dict[tuple[str, ...], Part] = {}
    for result in results:
        if isinstance(result.answer, Answer) and (cells := result.answer.cells()):
            names = tuple(cells)
            parts[names] = names, partial(_cells_of_answer, names)
    return list(parts.values())


def _cells_of_answer(names: Sequence[str], result: Result) -> list[Cells]:
    cells = result.answer.cells() if isinstance(result.answer, Answer) else {}
    if tuple(cells) != names:
        return []
    return list(zip(*map(_fractions, cells.values()), strict=True))
