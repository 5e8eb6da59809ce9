"""lcp path: how the solution moves from one problem to another one."""

from __future__ import annotations

import signal
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from lcpcli import options
from lcpcli.cli.command import EXITS, argument, command, option
from lcpcli.cli.declarations import (
    FILES,
    bounds_options,
    file_option,
    format_option,
    numeric,
    output_file,
    quiet_option,
    vector_option,
)
from lcpcli.cli.main import TERMINATED
from lcpcli.cli.output import form_of, refuse, refuse_format, show, terminal
from lcpcli.cli.problems import Inputs
from lcpcli.errors import OptionError, ProblemError
from lcpcli.files.contents import place
from lcpcli.interrupts import handling
from lcpcli.options import MAX_BREAKPOINTS, TIME_LIMIT, TOL
from lcpcli.report.result_formats import MEANINGS

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.parametric.path import Path
    from lcpcli.rational.exact_problem import ExactProblem
    from lcpcli.typing import Vector

FORMATS = {**MEANINGS, "json": "one object, for scripts", "csv": "a row for each breakpoint, with all digits"}
LIMITS = (TOL._replace(meaning="A point counts as a solution if its relative residual is at most this."), TIME_LIMIT)


@command(
    short_help="Follow the solution from one problem to another.",
    examples=(
        "lcp path paper-example-1 --direction 1,1,1,1 --to 2",
        "lcp make torsion -n 100 --set angle=1 -o slight.json",
        "lcp make torsion -n 100 --set angle=4 -o strong.json",
        "lcp path slight.json strong.json --at 0.5 --plot torsion.svg",
    ),
    epilog="lcp help paths has examples, also for programs. Components are counted from 1; indices in JSON, from 0.",
    exits={
        **EXITS,
        0: "the path is verified, and reaches its end, a ray or a turn",
        1: "it is not, or it stops at a limit",
        3: "the first problem is proved to have no solution",
        130: "interrupted; the part that was found is reported",
        TERMINATED: "the same after SIGTERM",
    },
)
@argument(
    "Problem",
    "files",
    {
        "FROM TO": "Two problems as for lcp solve, with the same M and other q or bounds, or two programs that differ "
        "in costs, in bounds or in sides of rows.",
        "FILE FROM TO": "M, and q of both.",
        "FROM [Q_FILE]": "With --direction, one problem.",
    },
    metavar="FROM [TO]",
    nargs=-1,
    shell_complete=FILES,
)
@vector_option("Problem", "direction", "NUMBERS", "In place of TO: q + t d, with this d.  [default: none]")
@bounds_options
@option("Path", "--from", "start", metavar="NUMBER", help="t at the first problem.  [default: 0]")
@option("Path", "--to", "stop", metavar="NUMBER", help="t at the last problem.  [default: 1]")
@option("Path", "--turns", is_flag=True, help="Go on where the path turns, with t decreasing.")
@option("Path", "--exact", is_flag=True, help="Prove the path in rational arithmetic, decimals taken as written.")
@numeric("Path", LIMITS[0])
@numeric("Stopping", LIMITS[1])
@numeric("Stopping", MAX_BREAKPOINTS)
@option("Output", "--at", metavar="T,...", help="Show the solutions at these t too.  [default: none]")
@format_option(FORMATS)
@file_option("Output", "--plot", "Draw z(t), and the objective of a program: .png, .svg, .pdf.")
@output_file()
@quiet_option()
def path(files: Sequence[str], direction: str | None, at: str | None, plot: str | None, **given: Any) -> int:
    """Follow the solution z(t) as q and the bounds of a problem move to those of another one."""
    form, output, quiet = given.pop("form"), given.pop("output"), given.pop("quiet")
    bounds = {name: given.pop(name) for name in ("lower", "upper", "infinity")}
    inputs = _inputs(files, direction, {**bounds, "quiet": quiet})
    refuse_format(output)
    form = form or form_of(output)
    Inputs(files, **bounds).prepare({"--output": output, "--plot": plot})
    options.check((*LIMITS, MAX_BREAKPOINTS), given)
    span = _span(given.pop("start"), given.pop("stop"), direction is not None)
    if plot is not None:
        from lcpcli.report import plotting

        plotting.require()
        plotting.form_of(plot)
    asked = _values(at, *span, given["exact"])
    ends = [_End.of(each, given["exact"]) for each in inputs]
    if direction is not None:
        d = _direction(direction, ends[0].problem.n)
        ends = [ends[0].along(d, t) for t in span]
    file = place(inputs[-1].files[-1])
    found, code = _followed(ends, file, span, **given)
    if not quiet or output is not None:
        width, color = (None, False) if output else terminal()
        show(_text(found, form, asked, [place(each.files[-1]) for each in inputs], width, color), output, color)
    if plot is not None:
        found.plot(plot)
    return code


def _inputs(files: Sequence[str], direction: str | None, how: dict[str, Any]) -> list[Inputs]:
    """Return the files of the first problem and, without a direction, of the last one."""
    if direction is not None:
        if not 1 <= len(files) <= 2:
            raise click.UsageError("with --direction, give one problem: a file, or a file with M and one with q")
        return [Inputs(files, **how)]
    if not 2 <= len(files) <= 3:
        raise click.UsageError("give two problems, or a file with M and two with q, or a problem and --direction")
    return [Inputs([*files[:-2], each], **how) for each in files[-2:]]


def _span(start: str | None, stop: str | None, is_direction: bool) -> tuple[Fraction, Fraction]:
    """Return t at both ends."""
    from lcpcli.files.contents import within
    from lcpcli.rational.numbers import ratio

    refuse(is_direction and stop is None, "--direction", "needs the last t", "add --to")
    first, last = within("--from", ratio, start or "0"), within("--to", ratio, stop or "1")
    fault = f"is {float(last):g}, and the path begins at t = {float(first):g}"
    refuse(first >= last, "--to", fault, "give a larger number")
    return first, last


def _values(text: str | None, start: Fraction, stop: Fraction, exact: bool) -> list[float | Fraction]:
    """Return the values of t in a text."""
    if text is None:
        return []
    from lcpcli.files.beside import typed_numbers
    from lcpcli.files.contents import within
    from lcpcli.rational.numbers import ratio

    typed = typed_numbers(text)
    if typed is None:
        raise OptionError("--at", f"{text!r} is not a list of numbers", "write 0,0.5,1")
    values = [within("--at", ratio, number) for number in typed]
    for value in values:
        fault = f"is {float(value):g}, and the path goes from {float(start):g} to {float(stop):g}"
        refuse(not start <= value <= stop, "--at", fault, "give values between these")
    return list(values) if exact else list(map(float, values))


def _direction(text: str, n: int) -> list[Fraction]:
    """Return the direction, given in numbers or in a file."""
    from lcpcli.files.beside import typed_numbers, typed_vector
    from lcpcli.files.contents import parsed
    from lcpcli.files.reading import LINE, exact_vector_in
    from lcpcli.rational.numbers import ratio

    typed = typed_numbers(text)
    if typed is not None:
        typed_vector("--direction", typed, n)
        return list(map(ratio, typed))
    return parsed(text, LINE, lambda content: exact_vector_in("--direction", text, content, n))


class _End(NamedTuple):
    """The problem at an end of the path, and, for a path in fractions, its numbers as written."""

    problem: Problem
    data: ExactProblem | None

    @classmethod
    def of(cls, inputs: Inputs, exact: bool) -> _End:
        read = inputs.read()
        return cls(read.problem, read.exactly() if exact else None)

    def along(self, d: Sequence[Fraction], t: Fraction) -> _End:
        """Return the problem with q + t d."""
        from lcpcli.rational.numbers import rounded

        problem, data = _with_q(self.problem, self.problem.q + float(t) * rounded(d)), self.data
        if data is not None:
            q = [Fraction(*each) + t * change for *each, change in zip(data.constants, data.scales, d, strict=True)]
            data = type(data)(problem, data.M, q, data.lower, data.upper)
        return _End(problem, data)


def _with_q(problem: Problem, q: Vector) -> Problem:
    """Return the problem with another q; if it is not one of a program or a game any more, with the names only."""
    changed: dict[str, Any] = {"q": q, "solutions": (), "verdict": ""}
    try:
        return replace(problem, **changed)
    except ProblemError:
        changed["names"] = problem.names if any(problem.names) else ()
        return replace(problem, **changed, origin=None)


def _followed(
    ends: Sequence[_End], file: str, span: tuple[Fraction, Fraction], exact: bool, **given: Any
) -> tuple[Path, int]:
    """Follow the path, until SIGTERM at most; return it with the exit code. file : of the last problem."""
    from lcpcli.parametric.family import Family
    from lcpcli.parametric.following import follow

    first, last = ends
    try:
        family = Family(first.problem, last.problem, *(span if exact else map(float, span)))
        if first.data and last.data and first.data.M != last.data.M:
            raise ProblemError("M", "differs between the two problems", "give two problems with one M")
    except ProblemError as fault:
        raise fault.inside(file) from None
    data = (first.data, last.data) if first.data and last.data else None
    signals: list[int] = []

    def stop(number: int, _: object) -> None:
        signals.append(number)
        signal.signal(number, signal.SIG_IGN)
        raise KeyboardInterrupt

    with handling(signal.SIGTERM, stop):
        found = follow(family, data=data, **given)
    return found, TERMINATED if signals else found.exit_code


def _text(
    found: Path, form: str, at: Sequence[float | Fraction], files: Sequence[str], width: int | None, color: bool
) -> str:
    from lcpcli.report import json_lines, path_formats

    if form == "json":
        return json_lines.line(path_formats.data(found, at, files))
    return path_formats.text(found, form, at, width, color)
