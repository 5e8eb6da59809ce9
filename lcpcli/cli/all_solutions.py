"""lcp solve --all, --minimize and --maximize: all solutions of a problem, or the best
one by a linear objective."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from lcpcli import clock, interrupts
from lcpcli.cli.output import Output
from lcpcli.cli.problems import InputProblem, Request
from lcpcli.cli.terminal import Line, shows_progress
from lcpcli.enumeration import optimum as search
from lcpcli.enumeration import search as sets
from lcpcli.errors import Exit, File, ProblemError, count
from lcpcli.files.contents import within
from lcpcli.interrupts import TimeIsUp, stopping
from lcpcli.model.formulation import LEFT_OUT, Objective
from lcpcli.rational import exact_problem, numbers
from lcpcli.report import plotting, solutions, wording

if TYPE_CHECKING:
    from lcpcli.files.inputs import InputItem

CODES = {  # by how a search has ended, unless it is solved
    sets.TIME_LIMIT: Exit.NOT_SOLVED,
    sets.INTERRUPTED: Exit.INTERRUPTED,
    **dict.fromkeys((sets.UNSOLVABLE, search.UNBOUNDED), Exit.NO_SOLUTION),
}


def outcome(
    request: Request,
    input_item: InputItem,
    output: Output,
    objective: str | Objective | None = None,
    sense: str = "min",
) -> int:
    """Search for every solution of a problem, or for the best one by an objective, with
    decimals as written; success means that the list is complete or has reached
    --max-solutions, or that the solution is proved to be the best."""
    inputs = request.inputs._replace(as_written=True)
    (problem,) = inputs.problems(input_item)
    where, remarks = File(input_item.sources[0]), problem.remarks
    if not isinstance(objective, str | None):
        others = (line.removesuffix(LEFT_OUT).removesuffix("; ") for line in remarks)
        remarks = [line for line in others if not line.endswith(": ")]
    request.inputs.tell(remarks)
    if request.plot is not None:
        plotting.require_drawable("cones", [problem.problem])
    wording.require(problem.problem, request.names)
    within(where, sets.refuse_large, problem.problem)
    best = (
        None if objective is None else _best(request, problem, where, objective, sense)
    )
    search_result: Any = best or _search(request, problem, where)
    report = solutions.solutions_report(
        search_result, input_item.sources[0], request.exact, request.names
    )
    message = best.message(numbers.approximate) if best else search_result.message
    output.show(report.render, f"{where}: {message}")
    output.draw(request.plot, "cones", search_result)
    return CODES.get(search_result.status, Exit.SOLVED)


def _search(request: Request, problem: InputProblem, where: str) -> sets.SolutionSet:
    """Search until the list is complete, a signal comes or the time is up, in which the
    numbers are also made exact."""
    began, max_pieces = clock.seconds(), request.max_solutions
    try:
        with interrupts.deadline_after(request.limits.time_limit):
            data = problem.exactly()
        time_left = request.limits.time_limit - (clock.seconds() - began)
    except TimeIsUp:  # zeros, which are not searched, replace the numbers
        n, time_left = problem.problem.n, 0.0
        rows: list[dict[int, int]] = [{} for _ in range(n)]
        data = exact_problem.ExactProblem(problem.problem, rows, numbers.zeros(n))
    shown = shows_progress(request.quiet)
    with stopping() as signals, Line("searching", is_shown=shown) as line:
        search = within(
            where,
            partial(
                sets.solutions,
                data,
                time_limit=(time_left if time_left > 0 else None),
                max_solutions=max_pieces,
            ),
        )
        if time_left <= 0:
            search.stop()
        for _ in search:
            line.doing = f"searching: {count(len(search.pieces), 'piece')} found"
        is_interrupted = bool(signals)
    ended = sets.TIME_LIMIT
    if is_interrupted:
        ended = sets.INTERRUPTED
    elif len(search.pieces) == max_pieces:
        ended = sets.ENOUGH
    return sets.SolutionSet(search, ended, clock.seconds() - began)


def _best(
    request: Request,
    problem: InputProblem,
    where: str,
    objective: str | Objective,
    sense: str,
) -> search.Optimum:
    began, data = clock.seconds(), problem.exactly()
    time_left = max(request.limits.time_limit - (clock.seconds() - began), 1e-6)
    shown = shows_progress(request.quiet)
    with stopping() as signals, Line("searching", is_shown=shown):
        if isinstance(objective, str):
            try:
                best_solution = search.optimum(
                    data, objective, sense=sense, time_limit=time_left
                )
            except ProblemError as error:
                if error.where != "objective":
                    raise error.inside(where) from None
                raise ProblemError(f"--{sense}imize", error.fault, error.hint) from None
        else:
            best_solution = within(where, search.best, data, *objective, time_left)
        is_cut = bool(signals) and best_solution.status == sets.TIME_LIMIT
    return replace(best_solution, status=sets.INTERRUPTED) if is_cut else best_solution
