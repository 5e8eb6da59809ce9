"""lcp solve --all: the search for all solutions of a problem, until it ends or is ended."""

from __future__ import annotations

import signal
from functools import partial
from typing import TYPE_CHECKING

from lcpcli import clock
from lcpcli.cli.main import INTERRUPTED, NO_SOLUTION, NOT_SOLVED, SOLVED
from lcpcli.cli.output import STANDARD, Output, refuse, show
from lcpcli.cli.runs import Request
from lcpcli.enumeration import search as sets
from lcpcli.errors import ProblemError
from lcpcli.interrupts import handling
from lcpcli.options import MAX_ITERATIONS, TOL, flag
from lcpcli.report import formats, plotting, solutions

if TYPE_CHECKING:
    from lcpcli.cli.session import Outcome
    from lcpcli.files.contents import Source
    from lcpcli.files.inputs import Work
    from lcpcli.rational.problem import ExactProblem

OF_ONE = (TOL.name, MAX_ITERATIONS.name, "trace", "every", "bound", "jobs", "cluster", "resume")


def refuse_others(asked: Request) -> None:
    """Raise OptionError for options that are for one solution."""
    (variant,) = asked.variants
    fault, hint = f"has a method of its own, and {variant} finds one solution at most", "leave out --method, or --all"
    refuse(variant.method != "auto", "--all", fault, hint)
    for name, value in {**asked.own, **{name: getattr(asked, name) for name in OF_ONE}}.items():
        refuse(value not in (None, False), flag(name), "has no effect with --all")
    refuse(asked.plot == STANDARD, "--plot -", "has no effect with --all", "name a file for the picture")


def outcome(asked: Request, work: Work, output: Output) -> Outcome:
    """Search for every solution of a problem, with decimals as written; the search is solved if the list is complete or
    as long as was asked for."""
    (held,) = asked.inputs.held(work)
    asked.inputs.tell(held.remarks)
    data = held.exactly()
    if asked.plot is not None:
        solutions.require(data.problem)
    try:
        found = _found(asked, data)
    except ProblemError as fault:
        raise fault.inside(str(work.sources[0])) from None
    text = "" if output.silent else _text(found, work.sources[0], asked.exact, output)
    codes = {sets.TIME_LIMIT: NOT_SOLVED, sets.INTERRUPTED: INTERRUPTED, sets.UNSOLVABLE: NO_SOLUTION}
    return text, codes.get(found.status, SOLVED), partial(_draw, found, asked.plot)


def _found(asked: Request, data: ExactProblem) -> sets.SolutionSet:
    """What the search finds, until it ends or Ctrl-C ends it; a second one is handled as usual."""
    began, most = clock.seconds(), asked.max_solutions
    search = sets.solutions(data, time_limit=asked.time_limit, max_solutions=most)
    usual = signal.getsignal(signal.SIGINT)
    interrupts: list[int] = []

    def stop(number: int, _: object) -> None:
        interrupts.append(number)
        search.stop()
        signal.signal(number, usual)

    with handling(signal.SIGINT, stop):
        for _ in search:
            continue
    ended = sets.INTERRUPTED if interrupts else sets.ENOUGH if len(search.pieces) == most else sets.TIME_LIMIT
    return sets.SolutionSet(search, ended, clock.seconds() - began)


def _text(found: sets.SolutionSet, source: Source, exact: bool, output: Output) -> str:
    """What is shown of the solutions. exact : whether numbers are shown as fractions."""
    if output.form == "json":
        return solutions.in_json(found, source, exact)
    if output.form == "csv":
        return solutions.in_csv(found, exact)
    return formats.typeset([solutions.build(found, exact, output.form)], output.form, output.width, output.color)


def _draw(found: sets.SolutionSet, picture: str | None) -> None:
    """Write the picture of the complementary cones, if one is asked for."""
    if picture is not None:
        show(plotting.cones(solutions.cones(found), plotting.form_of(picture)), picture)
