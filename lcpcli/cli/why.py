"""lcp why: which conditions of a problem conflict and what would help, or how far the
numbers of a solved problem may move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial

from lcpcli import clock, interrupts
from lcpcli.cli import declarations
from lcpcli.cli.command import command
from lcpcli.cli.declarations import OneProblem, Reporting, option, refuse, reporting
from lcpcli.cli.main import of_end
from lcpcli.cli.output import Destination
from lcpcli.cli.problems import Inputs
from lcpcli.errors import Exit, quoted
from lcpcli.files import contents
from lcpcli.interrupts import TimeIsUp, stopping
from lcpcli.options import TIME_LIMIT
from lcpcli.report.document import RECORD_MEANINGS

MIN_SECONDS = 1e-6  # of the search, if the time was up after reading


@dataclass(eq=False, repr=False)
class Why(OneProblem, Reporting):
    """The request of lcp why."""

    keep: Sequence[str] = ()
    change: Sequence[str] = ()
    weights: Sequence[str] = ()
    time_limit: float | None = None
    exact: bool = False


@command(
    request=Why,
    short_help="Explain what conflicts and what would help, or how far data may move.",
    examples=(
        "lcp make infeasible -n 5 -o infeasible.json",
        "lcp why infeasible.json",
        "lcp why infeasible.json --keep 'z1 lower bound' --weights z1=2",
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
            "answered: with a conflict and the cheapest change, or with all ranges"
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
@reporting(RECORD_MEANINGS)
def why(request: Why) -> int:
    """Explain a problem in exact arithmetic: if it has no solution, which of its
    conditions cannot hold together and the smallest change that makes it solvable; if
    it has one, how far each number may move alone until something else changes."""
    destination = Destination.of(request)
    inputs = Inputs.of(request, request.files, request.quiet)._replace(as_written=True)
    inputs.prepare({"--output": destination.path})
    costs = dict(map(_weight, request.weights))
    began, limit = clock.seconds(), request.time_limit or TIME_LIMIT.value
    read = inputs.read(tells=False)
    from lcpcli.enumeration.search import INTERRUPTED
    from lcpcli.enumeration.search import TIME_LIMIT as TIME_LIMITED
    from lcpcli.explanation.explanation import why as explained
    from lcpcli.explanation.report import message, report
    from lcpcli.rational.exact_problem import ExactProblem
    from lcpcli.rational.numbers import approximate

    with stopping() as signals:
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
        )
        is_cut = bool(signals)
    inputs.tell(read.remarks)
    if is_cut and explanation.status == TIME_LIMITED:
        explanation = replace(explanation, status=INTERRUPTED)
    where = contents.source_name(request.file)
    shown = report(explanation, contents.Source(request.file), request.exact)
    destination.show(shown.render, f"{where}: {message(explanation, approximate)}")
    return of_end(explanation.complete, interrupted=is_cut)


def _weight(text: str) -> tuple[str, Fraction]:
    """Return the name and the number of NAME=NUMBER."""
    from lcpcli.rational.numbers import ratio

    name, _, number = text.rpartition("=")
    refuse(not name, "--weights", f"{quoted(text)} is not NAME=NUMBER", "write z1=2")
    return name, contents.within("--weights", partial(ratio, number))
