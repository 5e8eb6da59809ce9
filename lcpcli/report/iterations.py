"""The table of iterates of one problem, in the layout of the paper: method, k, z1 ... zn, and the methods' own columns.

Built once as cells of text; the formats differ only in how they typeset it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from lcpcli.model.origins import Game
from lcpcli.model.problem import WITHOUT_SOLUTION, Problem
from lcpcli.report import advice, answers, numbers, outcome, provenance, strategies, summary
from lcpcli.report.numbers import ELLIPSIS
from lcpcli.report.result_table import ResultTable
from lcpcli.solving.result import Exact, Result
from lcpcli.solving.trace import TraceRow
from lcpcli.typing import Indices
from lcpcli.verify.certificate import Certificate

CELL = 11  # the usual width of a component with the gap after it
OTHER_COLUMNS = 34  # the usual width of all other columns
PIPE_COMPONENTS = 12
NONE = "-"  # in place of the strategies of an iterate that has none


def shown_components(n: int, width: int | None) -> Indices | None:
    """The components of z that fit into this width of text (None: a pipe): all, or the first ones and the last."""
    room = PIPE_COMPONENTS if width is None else max((width - OTHER_COLUMNS) // CELL, 1)
    if n <= room:
        return None
    return np.append(np.arange(room - 2 if room > 2 else room - 1), n - 1)


def room(form: str, width: int | None) -> int | None:
    """The width of text for the iterates in a format, on a screen of that width; None if there is none, as in files."""
    return width if form == "table" else None


def kept_components(problem: Problem, width: int | None) -> Indices | None:
    """The components of z that a trace keeps for a table of that width: of a game all, as probabilities take them."""
    return None if isinstance(problem.origin, Game) else shown_components(problem.n, width)


def build(
    results: Sequence[Result], width: int | None, compared: bool, whole: bool, form: str = "table"
) -> ResultTable:
    """The table of several methods' results on one problem, whose traces hold the same components of z.

    width : of the terminal; None if there is none.
    compared : whether the results are compared below the iterates, instead of a single result above them.
    whole : whether to show all components of z.
    form : the format that it is for; only on a screen is a name of `CELL` characters or more too long for a column.
    """
    problem, trace = results[0].problem, results[0].trace
    components = trace.components if trace else None
    of_game = problem.origin if isinstance(problem.origin, Game) else None
    if of_game is not None:
        own = room(form, width)
        components = shown_components(problem.n, None if own is None else own - 2 * CELL)
    columns = _columns(problem, components, longest(form))
    traces = [_rows(result) for result in results]
    length, unit = numbers.unit(max((row.seconds for rows in traces for row in rows), default=0.0))
    others = _other_columns(problem, any(row.step for rows in traces for row in rows))
    others[f"time/{unit}"] = lambda row: f"{row.seconds / length:.3f}"
    header = ["method", "k", *columns, *others]
    groups = []
    for result, rows in zip(results, traces, strict=True):
        labels = _labels(rows, result)
        largest = float(np.abs(result.z).max())
        tails = [[cell(row) for cell in others.values()] for row in rows]
        cells = [_cells(row, largest, components, of_game) for row in rows]
        groups.append([[a, str(row.k), *z, *tail] for a, row, z, tail in zip(labels, rows, cells, tails, strict=False)])
    lines = summary.build(results)
    head = "" if compared else outcome.verdict(results[0])
    facts = [] if compared else outcome.facts(results[0], width, whole)
    elided = components is not None if compared else ELLIPSIS in "".join(facts)
    disproof = _disproof(results)
    title = _title(replace(problem, verdict="") if disproof else problem)
    remarks = [*disproof, *_remarks(results, compared, elided)]
    made_by, leaders = provenance.line(results), summary.leaders(results)
    settled = not compared and results[0].solved
    return ResultTable(title, header, groups, head, facts, remarks, made_by, settled, *lines, leaders)


def longest(form: str) -> float:
    """The length from which on a name is too long for a column of a format."""
    return CELL if form == "table" else math.inf


def _columns(problem: Problem, components: Indices | None, most: float) -> list[str]:
    """The names of the components that are shorter than that, else their places; of a game the strategies and
    payoffs."""
    if isinstance(problem.origin, Game):
        rows, columns = strategies.names(problem.origin, most)
        return [*_chosen([*rows, *columns], components), *strategies.PAYOFFS]
    names = [name if 0 < len(name) < most else f"z{i}" for i, name in enumerate(problem.names, 1)]
    return _chosen(names, components)


def _chosen(cells: list[str], components: Indices | None) -> list[str]:
    """This selects the cells of some components, with a mark before the last one for those that are left out; all cells
    are taken if no components are given."""
    if components is None:
        return cells
    chosen = [cells[i] for i in components]
    return [*chosen[:-1], ELLIPSIS, chosen[-1]]


def _disproof(results: Sequence[Result]) -> list[str]:
    """The remark that the problem has a solution after all, where it is said to have none."""
    solved, verdict = [result for result in results if result.solved], results[0].problem.verdict
    if not solved or verdict not in WITHOUT_SOLUTION:
        return []
    return [f"the verdict of the problem, {verdict}, is wrong: z is a solution to the tolerance {solved[0].tol:g}"]


def _labels(rows: Sequence[TraceRow], result: Result) -> list[str]:
    """The name of each row's method, or of the run for its own method, where it differs from that of the row before."""
    start = " warm" * result.warm
    names = [summary.name(result) if row.method == result.method else row.method + start for row in rows]
    return [name if name != earlier else "" for name, earlier in zip(names, ["", *names], strict=False)]


def _cells(row: TraceRow, largest: float, components: Indices | None, game: Game | None) -> list[str]:
    """The components of z that a row has; of a game the probabilities and payoffs, dashes where there are none."""
    if game is None:
        cells = numbers.components(row.z.tolist(), largest)
        return cells if components is None else [*cells[:-1], ELLIPSIS, cells[-1]]
    *probabilities, by_row, by_column = strategies.of_iterate(game, row.z)
    cells = [NONE if value is None else numbers.components([value], 1.0)[0] for value in probabilities]
    payoffs = [NONE if value is None else f"{value:.7g}" for value in (by_row, by_column)]
    return [*_chosen(cells, components), *payoffs]


def _other_columns(problem: Problem, steps: bool) -> dict[str, Callable[[TraceRow], str]]:
    """The columns between z and the time: headings, with what makes a cell of a row."""
    columns: dict[str, Callable[[TraceRow], str]] = {"step": lambda row: row.step} if steps else {}
    if problem.solutions:
        return columns | {"error": lambda row: summary.error(row.error, problem)}
    return columns | {"residual": lambda row: numbers.short(row.residual, math.inf if row.rounding else 0.0)}


def _rows(result: Result) -> list[TraceRow]:
    """The iterates that a table shows: the starting point only if there is nothing else."""
    rows = result.trace.rows if result.trace else []
    return rows[1:] if len(rows) > 1 else rows


def _remarks(results: Sequence[Result], compared: bool, elided: bool) -> list[str]:
    remarks = [f"{summary.name(result)} {result.message}" for result in results if compared and not result.solved]
    for result in results:
        by = f"by {', '.join(result.route)}" if compared and result.route != (result.method,) else ""
        told = (advice.line(result), by, summary.doubt(result), summary.spread(result), summary.bound(result))
        remarks += [f"{summary.name(result)}: " * compared + text for text in told if text]
    remarks += [_vector(result.certificate) for result in results if result.certificate and not result.exact]
    remarks += [line for result in results if result.exact for line in _exact(result.exact, result.solved)]
    remarks += [line for result in results for line in answers.lines(result, compared)]
    if elided:
        remarks.append(f"all {results[0].problem.n} components of z: -o FILE, --format json or csv")
    return remarks


def _vector(certificate: Certificate) -> str:
    """The vector of a certificate, as far as it fits on a line."""
    if certificate.vector is None:
        return f"certificate: {certificate.kind}"
    return f"certificate: {certificate.kind} {numbers.vector(certificate.vector.tolist(), numbers.multiplier)}"


def _exact(exact: Exact, solved: bool) -> list[str]:
    """The exact vectors, as far as they fit on a line, and the proof, or that there is none, where no message is shown
    that states it."""
    from lcpcli.rational.numbers import brief

    named = [(name, values) for name, values in (("z", exact.z), ("w", exact.w), ("y", exact.y)) if values]
    lines = [f"exact {name} = {numbers.vector(values, brief)}" for name, values in named]
    if not solved:
        return lines
    return [*lines, f"proof: {exact.proof}"] if exact.z else [exact.proof]


def _title(problem: Problem) -> str:
    parts = [numbers.title(problem), numbers.size(problem)]
    if len(problem.solutions) == 1:
        z = problem.solutions[0]
        shown = [f"{v:.7g}" for v in (z if problem.n <= 6 else z[[0, 1, 2, -1]])]
        if problem.n > 6:
            shown.insert(3, ELLIPSIS)
        computed = "" if problem.reference == "known" else f"{problem.reference} "
        parts.append(f"{computed}solution ({', '.join(shown)})")
    elif problem.solutions:
        parts.append(f"{len(problem.solutions)} known solutions")
    if problem.verdict:
        parts.append(f"known to be {problem.verdict}" if problem.verdict != "ray" else "known to end in a ray")
    return ": ".join((parts[0], ", ".join(parts[1:])))
