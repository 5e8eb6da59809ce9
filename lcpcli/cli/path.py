"""lcp path: how the solution moves from one problem to another."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any, TypeAlias

from lcpcli.cli import declarations
from lcpcli.cli.command import command
from lcpcli.cli.declarations import (
    PROBLEM_FILES,
    ManyProblems,
    Reporting,
    argument,
    option,
    refuse,
    reporting,
)
from lcpcli.cli.main import of_end
from lcpcli.cli.output import Destination, require_plot
from lcpcli.cli.problems import InputProblem, Inputs
from lcpcli.cli.terminal import Line, shows_progress
from lcpcli.errors import EXITS, Exit, OptionError, ProblemError, quoted
from lcpcli.files import contents
from lcpcli.options import MAX_BREAKPOINTS, TIME_LIMIT, TOL
from lcpcli.report import document, wording

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.parametric.path import Path
    from lcpcli.rational.exact_problem import ExactProblem

Number: TypeAlias = "float | Fraction"
FORMATS = {
    **document.MEANINGS,
    "json": "one object, for scripts",
    "csv": "a row for each breakpoint, with all digits",
}
OF_POINTS = TOL._replace(
    meaning="A point is a solution if its relative residual is at most this."
)


@dataclass(eq=False, repr=False)
class PathRequest(ManyProblems, Reporting):
    """The request of lcp path; start, stop : by --from and --to."""

    direction: str | None = None
    start: str | None = None
    stop: str | None = None
    turns: bool = False
    exact: bool = False
    tol: float | None = None
    time_limit: float | None = None
    max_breakpoints: int | None = None
    at: str | None = None
    names: Sequence[str] = ()
    plot: str | None = None

    def inputs(self) -> tuple[Inputs, list[Inputs]]:
        """Return the inputs of all files, and those of each problem."""
        files, quiet = self.files, self.quiet
        is_one = self.direction is not None
        where, means = "FROM TO", "means"
        min_files = 2
        hint = (
            "give two problems, or a file with M and two with q, or a problem and "
            "--direction"
        )
        if is_one:
            where, means = "--direction", "takes"
            min_files = 1
            hint = "give one problem: a file, or a file with M and one with q"
        reason = f"{means} {min_files} or {min_files + 1} files, not {len(files)}"
        refuse(len(files) not in (min_files, min_files + 1), where, reason, hint)
        others = [] if self.direction is None else [self.direction]
        all_inputs = Inputs.of(self, files, quiet, others)
        all_inputs = all_inputs._replace(as_written=self.exact)
        if is_one:
            return all_inputs, [all_inputs]
        endpoints = ([*files[:-2], each] for each in files[-2:])
        return all_inputs, [
            all_inputs._replace(files=each, others=()) for each in endpoints
        ]


@command(
    request=PathRequest,
    short_help="Follow the solution from one problem to another.",
    examples=(
        "lcp path paper-example-1 --direction 1,1,1,1 --to 2",
        "lcp make torsion -n 100 --set angle=1 -o slight.json",
        "lcp make torsion -n 100 --set angle=4 -o strong.json",
        "lcp path slight.json strong.json --at 0.5 --plot torsion.svg",
    ),
    common=(
        "--direction",
        "--from",
        "--to",
        "--turns",
        "--exact",
        "--time-limit",
        "--at",
        "--show",
        "--format",
        "--plot",
        "--output",
        "--quiet",
    ),
    epilog=(
        "lcp help paths has examples, also for programs. Components are counted "
        "from 1; indices in JSON, from 0."
    ),
    exits={
        **EXITS,
        Exit.SOLVED: "the path is verified up to the last problem, a ray or a turn",
        Exit.NOT_SOLVED: "it is not, or it stops at a limit",
        Exit.NO_SOLUTION: "the first problem is proved to have no solution",
    },
)
@argument(
    "Problem",
    "files",
    {
        "FROM TO": "Two problems as for lcp solve, with the "
        "same M and other q or bounds, "
        "or two programs (.mps, .qps, "
        ".lp, .nl) that differ in costs, in bounds or in row sides.",
        "FILE FROM TO": "M, and the q of each problem.",
        "FROM [Q_FILE]": "With --direction, one problem.",
    },
    metavar="FROM [TO]",
    nargs=-1,
    shell_complete=PROBLEM_FILES,
)
@option(
    "Problem",
    "--direction NUMBERS|FILE  Instead of TO: q becomes q + t d, with this d.  "
    "[default: none]",
)
@declarations.bounds_options
@option(
    "Path",
    "--from start NUMBER  t at the first problem.  [default: 0]",
    "--to stop NUMBER  t at the last problem.  [default: 1; required with --direction]",
    "--turns  Continue with decreasing t at turning points.",
    "--exact  Prove the path in exact fractions; 0.1 means 1/10.",
    OF_POINTS,
)
@option("Stopping", TIME_LIMIT, MAX_BREAKPOINTS)
@option("Output", "--at T,...  Also show the solutions at these t.  [default: none]")
@declarations.show_option
@reporting(
    FORMATS,
    declarations.figure_options("path"),
)
def path(request: PathRequest) -> int:
    """Follow the solution z(t) as q and the bounds of one problem change to those of
    another."""
    from lcpcli.parametric.path import REACHED

    destination, names = Destination.of(request), request.names
    all_inputs, inputs = request.inputs()
    all_inputs.prepare({"--output": destination.path, "--plot": request.plot})
    span = _span(request)
    require_plot(request.plot)
    asked = _values(request.at, *span, request.exact)
    endpoints = _endpoint_problems(request, inputs, span)
    files_read = [contents.source_name(each.files[-1]) for each in inputs]
    file = files_read[-1]
    limits = {
        "tol": request.tol,
        "time_limit": request.time_limit,
        "max_breakpoints": request.max_breakpoints,
    }
    with Line("following the path", is_shown=shows_progress(request.quiet)):
        solution_path, code = _followed(
            endpoints, file, span, turns=request.turns, **limits
        )
    from lcpcli.report import path_formats

    # With a direction there is no second problem.
    if request.direction is not None and solution_path.end == REACHED:
        solution_path = replace(
            solution_path, message=f"the path reaches t = {request.stop}"
        )
    destination.show(
        path_formats.path_report(solution_path, asked, files_read, names).render,
        f"{file}: {solution_path.message}",
    )
    destination.draw(request.plot, "response", solution_path, None, names)
    return code


def _span(request: PathRequest) -> tuple[Number, Number]:
    """Return t at the first problem and at the last one."""
    has_no_end = request.direction is not None and request.stop is None
    refuse(has_no_end, "--direction", "has no last t", "add --to, the last t")
    start = _number("--from", request.start or "0", request.exact)
    stop = _number("--to", request.stop or "1", request.exact)
    reason = f"is {float(stop):g}, and the path begins at t = {float(start):g}"
    refuse(start >= stop, "--to", reason, "give a larger number")
    return start, stop


def _endpoint_problems(
    request: PathRequest, inputs: Sequence[Inputs], span: tuple[Number, Number]
) -> list[InputProblem]:
    """Return the problems between which the path leads; refuse a name that neither
    has."""
    endpoints = [each.read() for each in inputs]
    if request.direction is not None:
        d = _direction(request.direction, endpoints[0].problem)
        endpoints = [
            contents.within("--direction", _along, endpoints[0], d, t) for t in span
        ]
    if request.names:
        from lcpcli.report.path_formats import EndpointProblems

        names = EndpointProblems(*(each.problem for each in endpoints)).names()
        wording.selected_components(names, request.names)
    return endpoints


def _number(option: str, text: str, exact: bool) -> Number:
    from lcpcli.rational.numbers import ratio, rounded

    value = contents.within(option, ratio, text)
    double = float(rounded([value])[0])
    refuse(
        abs(double) == math.inf,
        option,
        "is too large",
        "give a number in double precision",
    )
    return value if exact else double


def _values(text: str | None, start: Number, stop: Number, exact: bool) -> list[Number]:
    if text is None:
        return []
    from lcpcli.files.beside import typed_numbers

    typed = typed_numbers("--at", text, may_be_file=False)
    if typed is None:
        reason = f"{quoted(text)} is not a list of numbers"
        raise OptionError("--at", reason, "write 0,0.5,1")
    values = [_number("--at", number, exact) for number in typed]
    for value in values:
        reason = (
            f"is {float(value):g}, and the path goes from {float(start):g} to "
            f"{float(stop):g}"
        )
        refuse(not start <= value <= stop, "--at", reason, "give values between these")
    return values


def _direction(text: str, problem: Problem) -> list[Fraction]:
    from lcpcli.files.beside import typed_numbers, typed_vector
    from lcpcli.files.input_file import InputFile
    from lcpcli.rational.numbers import ratio

    typed = typed_numbers("--direction", text)
    if typed is not None:
        typed_vector("--direction", typed, problem.n)
        return list(map(ratio, typed))
    file = InputFile.read(text)
    return file.exact_vector("--direction", problem.n, lambda: problem.names)


def _along(endpoint: InputProblem, d: Sequence[Fraction], t: Number) -> InputProblem:
    """Return the problem with q + t d."""
    import numpy as np

    from lcpcli.rational.numbers import rounded

    with np.errstate(over="ignore"):
        q = endpoint.problem.q + float(t) * rounded(d)
    changed: dict[str, Any] = {"q": q, "solutions": (), "verdict": ""}
    try:
        problem = replace(endpoint.problem, **changed)
    except ProblemError:  # it is no longer that of a program or a game
        names = endpoint.problem.names if any(endpoint.problem.names) else ()
        problem = replace(endpoint.problem, **changed, names=names, origin=None)

    def exactly() -> ExactProblem:

        exact: ExactProblem = endpoint.exactly()
        rows = zip(exact.constants, exact.scales, d, strict=True)
        moved_q = [
            Fraction(constant, scale) + Fraction(t) * change
            for constant, scale, change in rows
        ]
        return type(exact)(problem, exact.M, moved_q, exact.lower, exact.upper)

    return InputProblem(problem, exactly, [])


def _followed(
    endpoints: Sequence[InputProblem], file: str, span: tuple[Any, Any], **options: Any
) -> tuple[Path, int]:
    """Follow the path; return it with the exit code. file : that of the last
    problem."""
    from lcpcli.parametric.following import follow
    from lcpcli.parametric.path import INFEASIBLE, INTERRUPTED, OTHER_M, Family

    first, last = endpoints

    def data() -> tuple[ExactProblem, ExactProblem]:
        first_data, last_data = first.exactly(), last.exactly()
        if first_data.M != last_data.M:
            raise ProblemError("M", *OTHER_M)
        return first_data, last_data

    try:
        family = Family(first.problem, last.problem, *span)
        solution_path = follow(
            family, read=data if isinstance(span[0], Fraction) else None, **options
        )
    except ProblemError as error:
        raise error.inside(file) from None
    return solution_path, of_end(
        solution_path.complete,
        solution_path.end == INFEASIBLE,
        solution_path.end == INTERRUPTED,
    )
