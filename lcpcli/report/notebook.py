"""Results and problems as one line in the interpreter, and as parts of a page in notebooks. Methods of Result,
Problem and Trace call these functions."""

from __future__ import annotations

from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from lcpcli.errors import ParameterError, count
from lcpcli.linalg.matrices import is_sparse
from lcpcli.report import wording
from lcpcli.report.document import Section, Table

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.solving.result import Result
    from lcpcli.solving.trace import Trace

VECTOR_WIDTH = 60  # characters of z, which leaves room for its heading in a notebook's column
LARGEST_SHOWN = 6  # unknowns of a problem whose M and q are shown, which then fit in a notebook's column


def result_text(result: Result) -> str:
    """Return a line with the status, the method, n, the residual, the error if known, the time and the first components
    of z, in fractions if these are known."""
    return f"<Result: {', '.join(f'{name} {value}'.strip() for name, value in _facts(result))}>"


def result_html(result: Result) -> str:
    """Return a result in HTML: the facts of `result_text`, the iterations, the message, the advice and the meaning.

    Iterates that were requested follow below, as a figure if matplotlib is installed.
    """
    from lcpcli.report import html_page, programs_and_games, tables

    (_, status), *facts = _facts(result)
    facts.insert(1, ("iterations", str(result.iterations)))
    texts = ["" if result.solved else result.message, result.advice, *programs_and_games.lines(result, compared=False)]
    texts += wording.objective(result)
    rows = [*facts, *(("", text) for text in texts if text)]
    table = Table(("", ""), [rows], words=(0, 1))
    figure = None if result.trace is None or find_spec("matplotlib") is None else partial(tables.figure, [result])
    return html_page.part(Section(status, tables=[table], figure=figure))


def _facts(result: Result) -> list[tuple[str, str]]:
    """Return headings and texts on a result, with z in fractions, or the proof that there is no solution, if known."""
    from lcpcli.rational.numbers import brief
    from lcpcli.report import outcome

    error, exact = result.error, result.exact
    vectors = [] if exact is None else [("exact z =", exact.z), ("exact y =", exact.y)]
    proved = [(name, wording.vector(values, brief)) for name, values in vectors if values is not None]
    return [
        ("", f"{result.status.word.replace('_', ' ')} by {', '.join(result.route)}"),
        ("n =", wording.size(result.problem).removeprefix("n = ")),
        ("residual", wording.residual(result)),
        *([] if error is None else [("error", wording.error(error, result.problem))]),
        ("in", wording.duration(result.seconds)),
        *(proved or [("z =", outcome.short_vector(result, VECTOR_WIDTH))]),
    ]


def problem_text(problem: Problem) -> str:
    """Return a line with the name, n, the storage of M, and what is known about the solution."""
    return f"<{f'Problem {wording.title(problem)}'.rstrip()}: {', '.join(_properties(problem))}>"


def problem_html(problem: Problem) -> str:
    """Return a problem in HTML: the facts of `problem_text`, and M and q of a small problem."""
    from lcpcli.report import html_page

    tables = []
    if problem.n <= LARGEST_SHOWN and not is_sparse(problem.M):
        vectors = {"q": problem.q} | {name[0]: bound for name, bound in problem.bounds.items()}
        cells = [[f"{v:.7g}" for v in row] for row in zip(*problem.M.T, *vectors.values(), strict=True)]
        tables = [Table([*(f"M{j + 1}" for j in range(problem.n)), *vectors], [cells], words=())]
    return html_page.part(Section(wording.title(problem) or "Problem", facts=_properties(problem), tables=tables))


def _properties(problem: Problem) -> list[str]:
    stored = f"sparse, {count(problem.M.nnz, 'stored entry')}" if is_sparse(problem.M) else "dense"
    known = [count(len(problem.solutions), f"{problem.reference} solution")] if problem.solutions else []
    return [wording.size(problem), stored, *known, *([f"known verdict: {problem.verdict}"] if problem.verdict else [])]


def frame(result: Result) -> Any:
    """Return z, w and the states of a result as a data frame of pandas with a row for each unknown, by its name."""
    try:
        import pandas
    except ModuleNotFoundError:
        raise ParameterError("to_frame", "needs pandas", "pip install pandas") from None
    labels = [name or f"z{i}" for i, name in enumerate(result.names, 1)]
    return pandas.DataFrame({"z": result.z, "w": result.w, "state": result.basis}, index=labels)


def trace_text(trace: Trace) -> str:
    """Return a line with the number of stored iterates, and their range."""
    rows = trace.rows
    span = f", k = {rows[0].k} to {rows[-1].k}" if rows else ""
    return f"<Trace: {count(len(rows), 'iterate')}{span}, every = {trace.every}>"
