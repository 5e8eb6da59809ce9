"""The report on results: for each problem the verdict or a comparison, the iterates
laid out as in the paper, and of compared runs a summary: the options that distinguish
each, its costs, and how it ended."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from lcpcli.methods.quantities import X
from lcpcli.methods.registry import ALL
from lcpcli.model.formulation import Answer
from lcpcli.model.problem import WITHOUT_SOLUTION, Problem
from lcpcli.model.words import in_stated_sense
from lcpcli.options import AUTO
from lcpcli.report import columns, html_page, outcome, wording
from lcpcli.report.document import FORMATS, Document, Section, Table
from lcpcli.solving.result import Result
from lcpcli.typing import Indices

if TYPE_CHECKING:
    from lcpcli.model.nonlinear import NonlinearProblem
    from lcpcli.solving.trace import TraceRow

CELL = 11  # the usual width of a component with the gap after it
OTHER_COLUMNS = 34  # the usual width of all other columns
# Components of z in a pipe, where lines may be long: all those of the paper's examples
# and more.
PIPE_COMPONENTS = 12
# Runs whose failures are explained, a line or two each; more, as in a sweep, would be
# too many.
MAX_EXPLAINED = 5
NONE = "-"  # instead of the costs to a level that is not reached


def shown_components(n: int, width: int | None) -> Indices | None:
    """Return the components of z that fit into this width of text (None for a pipe):
    all, or the first and the last."""
    max_components = (
        PIPE_COMPONENTS if width is None else max((width - OTHER_COLUMNS) // CELL, 1)
    )
    if n <= max_components:
        return None
    return np.append(
        np.arange(max_components - 2 if max_components > 2 else max_components - 1),
        n - 1,
    )


def kept_components(
    problem: Problem | NonlinearProblem, width: int | None, names: Sequence[str]
) -> Indices | None:
    """Return the components of z that a trace keeps for a table of this width, or of
    unknowns of these names."""
    labels = wording.labels_of(problem) if names else ()
    return (
        np.array(wording.selected_components(labels, names), int)
        if names
        else shown_components(problem.n, width)
    )


def longest(format_name: str) -> float:
    """Return the smallest length at which a name is too long for a column of a format;
    only a screen limits it."""
    return CELL if FORMATS[format_name].fits_screen else math.inf


def build(
    results: Sequence[Result],
    selection: columns.Selection,
    width: int | None,
    format_name: str,
    files: Sequence[str] = (),
) -> Section:
    """Return the section on several methods' results on one problem, whose traces have
    the same components of z.

    width : of the terminal; None if there is none. files : the files of the problem, as
    for `wording.advice`.
    """
    compared, names = selection.compared, selection.names
    first, problem = results[0], results[0].problem
    components = first.trace.components if first.trace else None
    n = problem.n
    iterates = _iterates(results, selection.columns, names, longest(format_name))
    facts = list[str]()
    if not compared:
        facts = outcome.facts(first, width, selection.shows_all, names)
    elided = False
    if not names:
        is_cut = wording.ELLIPSIS in "".join(facts)
        elided = components is not None if compared else is_cut
    disproof, solved = list[str](), [result for result in results if result.solved]
    if solved and problem.verdict in WITHOUT_SOLUTION:
        wrong = f"the verdict of the problem, {problem.verdict}, is wrong"
        disproof = [f"{wrong}: z is a solution to the tolerance {solved[0].tol:g}"]
    has_times = not selection.columns or not {columns.TIME, ALL}.isdisjoint(
        selection.columns
    )
    shows_times = format_name != "latex" and has_times
    summary = list[Table]()
    table_width = width if format_name == "table" else None
    if compared and not selection.columns:
        summary = [summary_of_costs(results, table_width)]
    meanings, strategies = list[str](), list[Table]()
    is_proved_first = not compared and bool(outcome.proved_lines(first))
    if any(result.answer is not None for result in results) and not is_proved_first:
        meanings = list(chain(*(_lines(result, compared) for result in results)))
        if not compared and first.answer is not None:
            is_whole = selection.shows_all or format_name != "table"
            strategies = first.answer.tables(whole=is_whole)
    remarks = _remarks(results, compared, format_name, shows_times, files) + meanings
    if elided and not FORMATS[format_name].is_printed:
        remarks.append(f"see all {n} components of z with --format csv")
    return Section(
        title=_title(problem, "" if disproof else problem.verdict),
        verdict="" if compared else outcome.verdict(first),
        is_as_requested=not compared and first.solved,
        facts=facts,
        tables=[*strategies, iterates, *summary],
        remarks=[*disproof, *remarks],
        provenance=wording.made_by(results),
        figure=partial(outcome.figure, results)
        if any(result.trace or result.curve for result in results)
        else None,
    )


def result_html(result: Result) -> str:
    """Return a result as its page has it, for a notebook: with the advice to who calls
    a function, without iterates."""
    selection = columns.Selection(compared=False)
    section = build([result], selection, None, "html")
    shown = [table for table in section.tables if not table.name]
    advised = [*filter(None, [result.advice]), *section.remarks]
    title = section.title.removeprefix(": ")  # of a problem without a name
    return html_page.part(section._replace(title=title, tables=shown, remarks=advised))


def document(runs: Sequence[Sequence[Result]], sections: Sequence[Section]) -> Document:
    names = ", ".join(
        dict.fromkeys(section.title.split(":")[0] for section in sections)
    )
    methods = " and ".join(
        dict.fromkeys(result.method for results in runs for result in results)
    )
    return Document(": ".join(filter(None, (names, methods))), sections)


def with_gap(n: int, components: Indices | None) -> list[int | None]:
    """Return these components, with None before the last one for omitted components;
    all n of them if they are None."""
    return (
        list(range(n))
        if components is None
        else [*components[:-1].tolist(), None, int(components[-1])]
    )


def _iterates(
    results: Sequence[Result],
    column_names: Sequence[str],
    shown_names: Sequence[str],
    max_length: float,
) -> Table:
    """Return the table of the iterates; without x, which distinguishes it from the next
    ones, the start is omitted unless there is nothing else. max_length : the length
    from which a name is too long for a column."""
    problem = results[0].problem
    components = results[0].trace.components if results[0].trace else None
    traces = [result.trace.rows if result.trace else [] for result in results]
    has_x = not {X.name, ALL}.isdisjoint(column_names)
    shown = [rows[len(rows) > 1 and not has_x :] for rows in traces]
    rows = [row for table_columns in shown for row in table_columns]
    table_columns = columns.by_default(problem, rows)
    if column_names:
        table_columns = columns.selected_columns(
            column_names, [result.method for result in results]
        )
    if ALL in column_names:
        table_columns = [
            column for column in table_columns if columns.has_values(column, rows)
        ]
    components_shown = with_gap(problem.n, components)
    if shown_names:
        components_shown = [
            *wording.selected_components(wording.labels_of(problem), shown_names)
        ]
    signs = np.array(in_stated_sense(problem, np.ones(problem.n).tolist()))
    frame = columns.Frame(
        problem,
        wording.headings(problem, max_length),
        components_shown,
        signs if components is None else signs[components],
        0.0,
        wording.unit(min((row.seconds for row in rows if row.seconds), default=0.0)),
        has_x,
    )
    groups = [
        _group(result, rows, table_columns, frame)
        for result, rows in zip(results, shown, strict=True)
    ]
    return Table(
        [
            "method",
            *chain.from_iterable(column.heads(frame) for column in table_columns),
        ],
        list(filter(None, groups)),
        name="Iterates",
    )


def _group(
    result: Result,
    rows: Sequence[TraceRow],
    table_columns: Sequence[columns.Column],
    frame: columns.Frame,
) -> list[list[str]]:
    """Return the rows of a result: the method where it begins, and these columns. The
    digits of z depend on its largest component."""
    largest = float(np.abs(result.z).max(initial=0.0))
    frame, earlier = frame._replace(largest=largest), ""
    group = list[list[str]]()
    for row in rows:
        label = wording.name(result) if row.method == result.method else row.method
        cells = chain.from_iterable(
            column.shown(row, frame) for column in table_columns
        )
        group.append([label if label != earlier else "", *cells])
        earlier = label
    return group


def _lines(result: Result, compared: bool) -> list[str]:
    """Return lines on the answer. compared : whether they name the result."""
    answer: Answer | None = result.answer
    if answer is None:
        return []
    if not compared:
        return answer.lines()
    return [f"{wording.name(result)}: {text}" for text in answer.compared_lines()]


def _remarks(
    results: Sequence[Result],
    compared: bool,
    format_name: str,
    shows_times: bool,
    files: Sequence[str],
) -> list[str]:
    """Return lines below the verdict, or below the summary, without advice in formats
    for print, and without reasons why some of many runs failed. files : as for
    `build`."""
    failed = [result for result in results if compared and not result.solved]
    hints = not FORMATS[format_name].is_printed
    are_many = len(results) > MAX_EXPLAINED
    # The comparison has the run of auto.
    hints_at_auto = not (compared and any(result.label == AUTO for result in results))
    of_problem = outcome.PROBLEM_STATUSES
    remarks = []
    for run in failed:
        # Other messages continue the sentence that the name begins.
        colon = ":" if run.status.word in of_problem else ""
        remarks.append(f"{wording.name(run)}{colon} {run.message}")
    if are_many and failed:
        some = f"{len(failed)} of {len(results)} runs failed"
        remarks = [f"{some}: lcp solve with the options of one of them says why"]
    if compared:
        remarks += filter(None, [outcome.why_unsolved(results)])
    closing = dict[str, None]()
    for result in results:
        by = (
            f"by {', '.join(result.route)}"
            if compared and result.route != (result.method,)
            else ""
        )
        is_advised = hints and hints_at_auto and not are_many
        advice = [wording.advice(result, files)] if is_advised else []
        if result.status.has_no_solution:  # it follows the proof, once for all runs
            closing |= dict.fromkeys(filter(None, advice))
            advice = []
        texts = (*advice, by, outcome.doubt(result), outcome.bound(result))
        remarks += [
            f"{wording.name(result)}: " * compared + text for text in texts if text
        ]
    if shows_times:
        remarks += filter(None, [outcome.spread(results)])
    proofs = [line for result in results for line in outcome.proofs(result)]
    return [*remarks, *proofs, *closing]


def _title(problem: Problem, verdict: str) -> str:
    parts = [wording.size(problem)]
    if len(problem.solutions) == 1:
        computed = "" if problem.reference == "known" else f"{problem.reference} "
        parts.append(
            f"{computed}solution {wording.vector(problem.solutions[0].tolist())}"
        )
    elif problem.solutions:
        parts.append(f"{len(problem.solutions)} {problem.reference} solutions")
    if verdict:
        parts.append(
            "known to terminate on a ray"
            if verdict == "ray"
            else f"known to be {verdict}"
        )
    return f"{wording.title(problem)}: {', '.join(parts)}"


SHORT = {"iteration_limit": "k limit", "time_limit": "t limit"}  # for crowded rows
STAR = "*"  # before the shortest of several times
FALSE = "FALSE"  # instead of the status of a run whose claim does not hold


def summary_of_costs(results: Sequence[Result], width: int | None) -> Table:
    """Return a row for each run: the iterations and the time to each level of error, if
    these are recorded, else the evaluations and the residual; those to the verified
    result, all times in one unit; and a column for each option that a run does not
    share. A table wider than the terminal, if there is one, leaves out levels, the
    coarsest first."""
    are_noted = any(
        result.curve is not None and result.curve.levels for result in results
    )
    for i in range(len(wording.LEVELS) + 1):
        made = _summary(results, wording.LEVELS[i:] if are_noted else (), are_noted)
        if width is None or sum(made.widths()) + len(made.header) <= width:
            break
    return made


def _summary(
    results: Sequence[Result], levels: Sequence[float], are_noted: bool
) -> Table:
    texts = [
        text for result in results for text in result.label.partition(":")[2].split(",")
    ]
    options = list(
        filter(None, dict.fromkeys(text.partition("=")[0] for text in texts))
    )
    attained = [reached(result) for result in results]
    seconds = [result.seconds for result in results]
    for at in attained:
        seconds += [at[level][1] for level in levels if level in at]
    length, unit = wording.common_unit(seconds)
    has_error = any(result.error is not None for result in results)
    header = ["method", *options]
    for level in levels:
        header += [f"to {wording.level(level)}", unit]
    header += ["end" if are_noted else "iterations", unit]
    header += [] if are_noted else ["evaluations", "residual"]
    header += ["error"] if has_error else []
    header.append("status")
    rows = []
    for result, at in zip(results, attained, strict=True):
        values = wording.options_of(result, shows_all_digits=False)
        row = [result.method, *(values.get(option, "") for option in options)]
        for cost in (*map(at.get, levels), (result.iterations, result.seconds)):
            row += _cost(cost, length)
        if not are_noted:
            row += [str(result.evaluations), wording.residual(result)]
        if has_error:
            row.append(wording.error(result.error, result.problem))
        rows.append([*row, _status(result)])
    _mark_shortest(rows, results, attained, levels, first=len(options) + 2)
    notes = []
    if levels:
        notes.append("to: errors relative to the solution's largest component")
    if len(rows) > 1:
        notes.append(f"{STAR} the shortest time")
    return Table(header, [rows], words=(0, len(header) - 1), notes=["; ".join(notes)])


def _cost(cost: tuple[int, float] | None, length: float) -> tuple[str, str]:
    """Return iterations and time, divided by a length in seconds; dashes for an
    error that was not attained."""
    if cost is None:
        return NONE, NONE
    number, seconds = cost
    return str(number), wording.digits(seconds / length, 2)


def _status(result: Result) -> str:
    if result.verified is False:
        return FALSE
    return SHORT.get(result.word, result.word.replace("_", " "))


def _mark_shortest(
    rows: list[list[str]],
    results: Sequence[Result],
    attained: Sequence[Mapping[float, tuple[int, float]]],
    levels: Sequence[float],
    first: int,
) -> None:
    """Mark the shortest time to each level, and to a solution, in the rows of results.
    first : the column of the first times; each second one has times."""
    times = [
        [at[level][1] if level in at else None for at in attained] for level in levels
    ]
    times.append([result.seconds if result.solved else None for result in results])
    for level_index, column in enumerate(times):
        measured = [
            (seconds, i) for i, seconds in enumerate(column) if seconds is not None
        ]
        if measured and len(rows) > 1:
            row, at = rows[min(measured)[1]], first + 2 * level_index
            row[at] = STAR + row[at]


def reached(result: Result) -> dict[float, tuple[int, float]]:
    return {
        each.level: (each.k, each.seconds)
        for each in (result.curve.milestones if result.curve else ())
    }
