"""Results and problems as one line for the interpreter, and as small HTML tables for notebooks."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from typing import TYPE_CHECKING

from lcpcli.errors import count
from lcpcli.linalg.matrices import is_sparse
from lcpcli.report import numbers

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.solving.result import Result
    from lcpcli.solving.trace import Trace

WIDTH = 60  # of z
SMALL = 6  # largest number of unknowns of a problem whose numbers are shown


def result_text(result: Result) -> str:
    """One line: the status, the method, n, the residual, the error if known, the time and the first components of z."""
    return f"<Result: {', '.join(f'{name} {value}'.strip() for name, value in _facts(result))}>"


def result_html(result: Result) -> str:
    """The same as a table, with the message and what to try next."""
    (_, status), *facts = _facts(result)
    remarks = [("", result.message)] * (not result.solved) + [("", result.advice)] * bool(result.advice)
    return _table(status, [*facts, *remarks])


def _facts(result: Result) -> list[tuple[str, str]]:
    from lcpcli.report import summary
    from lcpcli.report.outcome import short_vector

    error = [] if result.error is None else [("error", summary.error(result.error, result.problem))]
    seconds = result.seconds
    return [
        ("", f"{result.status.word.replace('_', ' ')} by {', '.join(result.route)}"),
        ("n =", str(result.problem.n)),
        ("residual", summary.residual(result)),
        *error,
        ("in", numbers.duration(seconds)),
        ("z =", short_vector(result, WIDTH)),
    ]


def problem_text(problem: Problem) -> str:
    """One line: the name, n, how M is stored and what is known about the solution."""
    name = numbers.title(problem)
    return f"<Problem{' ' * bool(name)}{name}: {', '.join(_properties(problem))}>"


def problem_html(problem: Problem) -> str:
    """The same as a table; for a small problem with M and q."""
    rows = [("", text) for text in _properties(problem)]
    head = _table(numbers.title(problem) or "Problem", rows)
    if problem.n > SMALL or is_sparse(problem.M):
        return head
    cells = [[f"{v:.7g}" for v in (*row, last)] for row, last in zip(problem.M, problem.q, strict=True)]
    names = "".join(f"<th>M<sub>{j + 1}</sub></th>" for j in range(problem.n)) + "<th>q</th>"
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in cells)
    return f"{head}<table><tr>{names}</tr>{body}</table>"


def _properties(problem: Problem) -> list[str]:
    stored = f"sparse, {count(problem.M.nnz, 'stored entry')}" if is_sparse(problem.M) else "dense"
    known = [count(len(problem.solutions), f"{problem.reference} solution")] if problem.solutions else []
    return [f"n = {problem.n}", stored, *known, *([f"known verdict: {problem.verdict}"] if problem.verdict else [])]


def trace_text(trace: Trace) -> str:
    """One line: how many iterates are kept, and which."""
    rows = trace.rows
    span = f", k = {rows[0].k} to {rows[-1].k}" if rows else ""
    return f"<Trace: {count(len(rows), 'iterate')}{span}, every = {trace.every}>"


def _table(title: str, rows: Iterable[tuple[str, str]]) -> str:
    body = "".join(
        f'<tr><th style="text-align:left">{escape(name)}</th><td style="text-align:left">{escape(value)}</td></tr>'
        for name, value in rows
    )
    return f"<table><caption><b>{escape(title)}</b></caption>{body}</table>"
