"""lcp why: which conditions of a problem conflict and what would help, or how far the
numbers of a solved program may move."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING

from lcpcli import clock, interrupts
from lcpcli.cli import declarations
from lcpcli.cli.command import command
from lcpcli.cli.declarations import OneProblem, Reporting, option, refuse, reporting
from lcpcli.cli.main import of_end
from lcpcli.cli.output import Destination
from lcpcli.cli.problems import Inputs, tell
from lcpcli.cli.terminal import Line, emit, shows_progress
from lcpcli.errors import Exit, quoted
from lcpcli.files import contents
from lcpcli.interrupts import TimeIsUp, stopping
from lcpcli.options import TIME_LIMIT
from lcpcli.report.document import RECORD_MEANINGS

if TYPE_CHECKING:
    from lcpcli.explanation.report import Explanation
    from lcpcli.model.problem import Problem

MIN_SECONDS = 1e-6  # of the search, if the time was up after reading


@dataclass(eq=False, repr=False)
class Why(OneProblem, Reporting):
    """The request of lcp why."""

    keep: Sequence[str] = ()
    change: Sequence[str] = ()
    weights: Sequence[str] = ()
    time_limit: float | None = None
    exact: bool = False
    repaired: str | None = None


@command(
    request=Why,
    short_help="Explain what would help and what conflicts, or how far data may move.",
    examples=(
        "lcp make infeasible -n 5 -o infeasible.json",
        "lcp why infeasible.json",
        "lcp why infeasible.json --keep 'z1 lower bound' --weights z1=2",
        "lcp why infeasible.json --repaired solvable.json",
        "lcp why transport --format json",
    ),
    common=(
        "--lower",
        "--upper",
        "--keep",
        "--change",
        "--weights",
        "--time-limit",
        "--exact",
        "--format",
        "--output",
        "--quiet",
    ),
    epilog="lcp help conflicts explains conflicts, repairs and ranges.",
    exits={
        Exit.SOLVED: (
            "answered: with the cheapest change and a conflict, or with a solution"
        ),
        Exit.NOT_SOLVED: "not answered within the limits; what is known is shown",
        Exit.INTERRUPTED: Exit.INTERRUPTED.meaning,
        Exit.TERMINATED: Exit.TERMINATED.meaning,
    },
)
@declarations.problem_file
@option(
    "Explanation",
    "--keep NAME  Never blame this condition for the conflict, though the cheapest "
    "change may be one of its numbers: a name, or a name and what it is, as in 'z1 "
    "lower bound'; * matches any text; repeatable.  [default: none]",
    "--change NAME  Only this number may change in a repair, named likewise; "
    "repeatable.  [default: q, or costs and row sides]",
    "--weights NAME=NUMBER  A change of this number by 1 costs so much; repeatable.  "
    "[default: 1]",
    multiple=True,
)
@option("Stopping", TIME_LIMIT)
@option("Output", "--exact  Show fractions; JSON always does.")
@option(
    "Output",
    "--repaired FILE  Write the problem with the cheapest change, in the format of the "
    "suffix, such as .mps or .json.  [default: none]",
)
@reporting(RECORD_MEANINGS)
def why(request: Why) -> int:
    """Solve a problem and explain the result in exact arithmetic: without a solution,
    the smallest change that makes it solvable, and which of its conditions cannot hold
    together; for a program with one, how far each cost and each row side may move alone
    while the optimal basis stays the same."""
    destination = Destination.of(request)
    inputs = Inputs.of(request, request.files, request.quiet)._replace(as_written=True)
    inputs.prepare({"--output": destination.path, "--repaired": request.repaired})
    _prepare_repaired(inputs, request.repaired)
    costs = dict(map(_weight, request.weights))
    began, limit = clock.seconds(), request.time_limit or TIME_LIMIT.value
    read = inputs.read(tells=False)
    from lcpcli.enumeration.search import INTERRUPTED
    from lcpcli.enumeration.search import TIME_LIMIT as TIME_LIMITED
    from lcpcli.explanation.explanation import why as explained
    from lcpcli.explanation.report import message, report
    from lcpcli.rational.exact_problem import ExactProblem
    from lcpcli.rational.numbers import approximate

    shown_parts = list[int]()
    shows_parts = destination.path is None and destination.form == "table"
    source = contents.Source(request.file)

    def show_repair(explanation: Explanation) -> None:
        if shows_parts and explanation.repair is not None:
            doing.close()
            first = report(explanation, source, request.exact, slice(1))
            destination.show(first.render)
            shown_parts.append(1)
            doing.enter_context(_waiting("looking for a small conflict", request))

    with stopping() as signals, ExitStack() as doing:
        doing.enter_context(_waiting("solving, and looking for a repair", request))
        try:
            with interrupts.deadline_after(limit):
                data = read.exactly()
        except TimeIsUp:
            data = ExactProblem.of_floats(read.problem)
        time_left = max(limit - (clock.seconds() - began), MIN_SECONDS)
        explanation = explained(
            data,
            keep=request.keep,
            change=request.change or None,
            weights=costs,
            time_limit=time_left,
            observe=show_repair,
        )
        is_cut = bool(signals)
    inputs.tell(read.remarks)
    if is_cut and explanation.status == TIME_LIMITED:
        explanation = replace(explanation, status=INTERRUPTED)
    where = contents.source_name(request.file)
    rest = slice(len(shown_parts), None) if explanation.z is None else slice(None)
    shown = report(explanation, source, request.exact, rest)
    if shown_parts:
        emit("\n", color=False)
    destination.show(shown.render, f"{where}: {message(explanation, approximate)}")
    if request.repaired is not None:
        _write_repaired(explanation.repaired, request.repaired, request.quiet)
    return of_end(explanation.complete, interrupted=is_cut)


def _prepare_repaired(inputs: Inputs, file: str | None) -> None:
    """Refuse a file whose suffix belongs to no format."""
    if file is not None:
        from lcpcli.files import writing

        inputs.refuse({"--repaired": writing.file_of_q(file)})


def _write_repaired(problem: Problem | None, file: str, quiet: bool) -> None:
    """Write the problem with the cheapest change, or say that none is known."""
    from lcpcli.cli import make

    if problem is None:
        tell(f"{file} is not written: no change is known", quiet)
    else:
        make.write(problem, file, quiet, as_program=True)


def _waiting(doing: str, request: Why) -> Line:
    return Line(doing, is_shown=shows_progress(request.quiet))


def _weight(text: str) -> tuple[str, Fraction]:
    """Return the name and the number of NAME=NUMBER."""
    from lcpcli.rational.numbers import ratio

    name, _, number = text.rpartition("=")
    refuse(not name, "--weights", f"{quoted(text)} is not NAME=NUMBER", "write z1=2")
    return name, contents.within("--weights", partial(ratio, number))
