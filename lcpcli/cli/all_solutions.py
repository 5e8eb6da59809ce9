"""lcp solve --all, --minimize and --maximize: all solutions of a problem, or the best
one by a linear objective."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
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
    from lcpcli.files.inputs import Work

CODES = {  # by how a search has ended, unless it is solved
    sets.TIME_LIMIT: Exit.NOT_SOLVED,
    sets.INTERRUPTED: Exit.INTERRUPTED,
    **dict.fromkeys((sets.UNSOLVABLE, search.UNBOUNDED), Exit.NO_SOLUTION),
}


def outcome(
    request: Request,
    work: Work,
    output: Output,
    objective: str | Objective | None = None,
    sense: str = "min",
) -> int:
    """Search for every solution of a problem, or for the best one by an objective, with
    decimals as written; success means that the list is complete or has reached
    --max-solutions, or that the solution is proved to be the best."""
    (problem,) = request.inputs.problems(work)
    where, remarks = File(work.sources[0]), problem.remarks
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
    found: Any = best or _search(request, problem, where)
    report = solutions.report(found, work.sources[0], request.exact, request.names)
    output.show(
        report.render,
        f"{where}: {best.message(numbers.approximate) if best else found.message}",
    )
    output.draw(request.plot, "cones", found)
    return CODES.get(found.status, Exit.SOLVED)


def _search(request: Request, problem: InputProblem, where: str) -> sets.SolutionSet:
    """Search until the list is complete, a signal comes or the time is up, in which the
    numbers are also made exact."""
    began, most = clock.seconds(), request.max_solutions
    try:
        with interrupts.within(request.limits.time_limit):
            data = problem.exactly()
        left = request.limits.time_limit - (clock.seconds() - began)
    except TimeIsUp:  # zeros, which are not searched, take the place of the numbers
        n, left = problem.problem.n, 0.0
        data = exact_problem.ExactProblem(problem.problem, [{}] * n, [Fraction(0)] * n)
    shown = shows_progress(request.quiet)
    with stopping() as signals, Line("searching", is_shown=shown) as line:
        search = within(
            where,
            partial(
                sets.solutions,
                data,
                time_limit=(left if left > 0 else None),
                max_solutions=most,
            ),
        )
        if left <= 0:
            search.stop()
        for _ in search:
            line.doing = f"searching: {count(len(search.pieces), 'piece')} found"
        is_interrupted = bool(signals)
    ended = (
        sets.INTERRUPTED
        if is_interrupted
        else sets.ENOUGH
        if len(search.pieces) == most
        else sets.TIME_LIMIT
    )
    return sets.SolutionSet(search, ended, clock.seconds() - began)


def _best(
    request: Request,
    problem: InputProblem,
    where: str,
    objective: str | Objective,
    sense: str,
) -> search.Optimum:
    began, data = clock.seconds(), problem.exactly()
    left = max(request.limits.time_limit - (clock.seconds() - began), 1e-6)
    shown = shows_progress(request.quiet)
    with stopping() as signals, Line("searching", is_shown=shown):
        if isinstance(objective, str):
            try:
                found = search.optimum(data, objective, sense=sense, time_limit=left)
            except ProblemError as error:
                if error.where != "objective":
                    raise error.inside(where) from None
                raise ProblemError(f"--{sense}imize", error.fault, error.hint) from None
        else:
            found = within(where, search.best, data, *objective, left)
        is_cut = bool(signals) and found.status == sets.TIME_LIMIT
    return replace(found, status=sets.INTERRUPTED) if is_cut else found
