"""lcp solve --minimize and --maximize: the best of all solutions by a linear objective."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

from lcpcli import clock
from lcpcli.cli.main import INTERRUPTED, NO_SOLUTION, NOT_SOLVED, SOLVED
from lcpcli.cli.output import Output
from lcpcli.cli.request import Request
from lcpcli.enumeration import optimum as search
from lcpcli.enumeration.search import refuse_large
from lcpcli.errors import ProblemError
from lcpcli.files.contents import content_of, within
from lcpcli.interrupts import stopping
from lcpcli.report import document, optimum_text, selection

if TYPE_CHECKING:
    from lcpcli.cli.session import Outcome
    from lcpcli.files.inputs import Work
    from lcpcli.files.nl_format import LinearObjective

CODES = {search.OPTIMAL: SOLVED, search.TIME_LIMIT: NOT_SOLVED, search.INTERRUPTED: INTERRUPTED}


def objective_in(path: str) -> LinearObjective | None:
    """Return the objective of the linear model in an .nl file; None if it has none, or is nonlinear."""
    from lcpcli.files.nl_format import Model

    content = content_of(path, "")
    if not (content.startswith(b"b") or re.search(rb"^O\d", content, re.MULTILINE)):
        return None
    model = within(path, Model, content, path)
    return within(path, lambda: model.objective if model.model.is_linear else None)


def outcome(
    request: Request, work: Work, output: Output, objective: str | LinearObjective, sense: str = "min"
) -> Outcome:
    """Search for the best solution of a problem, with decimals as written; the exit code reports success if it is
    proved to be the best."""
    (problem,) = request.inputs.problems(work)
    if isinstance(objective, str):
        request.inputs.tell(problem.remarks)
    else:
        from lcpcli.files.nl_format import LEFT_OUT

        others = (line.removesuffix(LEFT_OUT).removesuffix("; ") for line in problem.remarks)
        request.inputs.tell([line for line in others if not line.endswith(": ")])
    selection.require(problem.problem, request.names)
    where, began, limit = str(work.sources[0]), clock.seconds(), request.limits.time_limit
    within(where, refuse_large, problem.problem)
    data = problem.exactly()
    left = max(limit - (clock.seconds() - began), 1e-6)
    with stopping() as signals:
        if isinstance(objective, str):
            try:
                found = search.optimum(data, objective, sense=sense, time_limit=left)
            except ProblemError as error:
                is_typed = error.where == "objective"
                raise type(error)(
                    f"--{sense}imize" if is_typed else f"{where}: {error.where}".removesuffix(": "),
                    error.fault,
                    error.hint,
                ) from None
        else:
            found = within(where, search.best, data, *objective, left)
        if signals and found.status == search.TIME_LIMIT:
            found = replace(found, status=search.INTERRUPTED)
    text = "" if output.silent else _text(request, work, output, found)
    return text, CODES.get(found.status, NO_SOLUTION), int


def _text(request: Request, work: Work, output: Output, found: search.Optimum) -> str:
    if output.form == "json":
        return optimum_text.in_json(found, work.sources[0], request.exact)
    if output.form == "csv":
        return optimum_text.in_csv(found, request.exact, request.names)
    report = optimum_text.build(found, request.exact, output.form, request.names)
    return document.typeset(report, output.form, output.destination.width, output.destination.color)
