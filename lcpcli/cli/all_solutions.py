"""lcp solve --all: the search for all solutions of a problem, until it is complete or stopped.

lcp solve --minimize and --maximize: the best of all solutions by a linear objective.
"""

from __future__ import annotations

import re
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING

from lcpcli import clock, interrupts
from lcpcli.cli.main import INTERRUPTED, NO_SOLUTION, NOT_SOLVED, SOLVED
from lcpcli.cli.output import Output
from lcpcli.cli.request import Request
from lcpcli.enumeration import optimum as search
from lcpcli.enumeration import search as sets
from lcpcli.enumeration.search import refuse_large
from lcpcli.errors import ProblemError
from lcpcli.files.contents import content_of, within
from lcpcli.interrupts import TimeIsUp, stopping
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import approximate
from lcpcli.report import plotting, solutions, wording

if TYPE_CHECKING:
    from lcpcli.cli.problems import InputProblem
    from lcpcli.files.inputs import Work
    from lcpcli.files.nl_format import LinearObjective


def outcome(request: Request, work: Work, output: Output) -> int:
    """Search for every solution of a problem, with decimals as written; the exit code reports success if the list is
    complete or has reached --max-solutions."""
    (problem,) = request.inputs.problems(work)
    request.inputs.tell(problem.remarks)
    if request.plot is not None:
        plotting.require_plane([problem.problem])
    wording.require(problem.problem, request.names)
    solution_set = _search(request, problem, str(work.sources[0]))
    report = solutions.report(solution_set, work.sources[0], request.exact, request.names)
    codes = {sets.TIME_LIMIT: NOT_SOLVED, sets.INTERRUPTED: INTERRUPTED, sets.UNSOLVABLE: NO_SOLUTION}
    output.show(report.render, f"{work.sources[0]}: {solution_set.message}")
    output.add(request.plot, lambda path: plotting.cones(solution_set).content(plotting.form_of(path)))
    return codes.get(solution_set.status, SOLVED)


def _search(request: Request, problem: InputProblem, where: str) -> sets.SolutionSet:
    """Search until the list is complete, or until Ctrl-C or SIGTERM ends the search. The time in
    which the numbers are made exact counts."""
    began, most = clock.seconds(), request.max_solutions
    within(where, sets.refuse_large, problem.problem)
    try:
        with interrupts.within(request.limits.time_limit):
            data = problem.exactly()
        left = request.limits.time_limit - (clock.seconds() - began)
    except TimeIsUp:  # zeros, which are not searched, take the place of the numbers
        n, left = problem.problem.n, 0.0
        data = ExactProblem(problem.problem, [{}] * n, [Fraction(0)] * n)
    seconds = left if left > 0 else None
    search = within(where, partial(sets.solutions, data, time_limit=seconds, max_solutions=most))
    if left <= 0:
        search.stop()
    with stopping() as signals:
        for _ in search:
            continue
        is_interrupted = bool(signals)
    ended = sets.INTERRUPTED if is_interrupted else sets.ENOUGH if len(search.pieces) == most else sets.TIME_LIMIT
    return sets.SolutionSet(search, ended, clock.seconds() - began)


def objective_in(path: str) -> LinearObjective | None:
    """Return the objective of the linear model in an .nl file; None if it has none, or is nonlinear."""
    from lcpcli.files.nl_format import Model

    content = content_of(path, "")
    if not (content.startswith(b"b") or re.search(rb"^O\d", content, re.MULTILINE)):
        return None
    model = within(path, Model, content, path)
    return within(path, lambda: model.objective if model.model.is_linear else None)


def best_outcome(
    request: Request, work: Work, output: Output, objective: str | LinearObjective, sense: str = "min"
) -> int:
    """Search for the best solution of a problem, with decimals as written; the exit code reports success if it is
    proved to be the best."""
    codes = {search.OPTIMAL: SOLVED, search.TIME_LIMIT: NOT_SOLVED, search.INTERRUPTED: INTERRUPTED}
    (problem,) = request.inputs.problems(work)
    if isinstance(objective, str):
        request.inputs.tell(problem.remarks)
    else:
        from lcpcli.files.nl_format import LEFT_OUT

        others = (line.removesuffix(LEFT_OUT).removesuffix("; ") for line in problem.remarks)
        request.inputs.tell([line for line in others if not line.endswith(": ")])
    wording.require(problem.problem, request.names)
    where, began, limit = str(work.sources[0]), clock.seconds(), request.limits.time_limit
    within(where, refuse_large, problem.problem)
    data = problem.exactly()
    left = max(limit - (clock.seconds() - began), 1e-6)
    with stopping() as signals:
        if isinstance(objective, str):
            try:
                found = search.optimum(data, objective, sense=sense, time_limit=left)
            except ProblemError as error:
                if error.where != "objective":
                    raise error.inside(where) from None
                raise ProblemError(f"--{sense}imize", error.fault, error.hint) from None
        else:
            found = within(where, search.best, data, *objective, left)
        if signals and found.status == search.TIME_LIMIT:
            found = replace(found, status=search.INTERRUPTED)
    report = solutions.report(found, work.sources[0], request.exact, request.names)
    output.show(report.render, f"{where}: {found.message(approximate)}")
    return codes.get(found.status, NO_SOLUTION)
