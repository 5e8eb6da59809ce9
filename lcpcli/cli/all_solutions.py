"""lcp solve --all from parsed options to an exit code: search, show what was found."""

from __future__ import annotations

import signal
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from lcpcli import clock, options
from lcpcli.cli import exit_codes, problems, threads
from lcpcli.cli.options import STARTS
from lcpcli.cli.output import HERE, Output, emit, terminal
from lcpcli.cli.session import refuse_clashes
from lcpcli.errors import OptionError, ProblemError
from lcpcli.files.fields import OF_BOUNDS
from lcpcli.methods.registry import ADDITIONS, OPTIONS
from lcpcli.options import MAX_ITERATIONS, MAX_SOLUTIONS, TIME_LIMIT, TOL, flag

if TYPE_CHECKING:
    from lcpcli.enumeration.search import Solutions, SolutionSet
    from lcpcli.files.contents import Source
    from lcpcli.methods.variants import Variant
    from lcpcli.rational.problem import ExactProblem

OF_ONE = (
    *OPTIONS,
    *ADDITIONS,
    *STARTS,
    TOL.name,
    MAX_ITERATIONS.name,
    "trace",
    "every",
    "bound",
    "jobs",
    "cluster",
    "resume",
)


def run(files: Sequence[str], variant: Variant, given: dict[str, Any], exact: bool) -> int:
    """Find all solutions of the problem in the files; show them; return the exit code."""
    _refuse_without_effect(variant, given)
    threads.settle(files, given["threads"])
    options.check((TIME_LIMIT, MAX_SOLUTIONS), given)
    output = Output(given["form"], None, None, given["output"], given["quiet"], bound=False, compared=False)
    of_z = {name: given[name] for name in OF_BOUNDS}
    refuse_clashes(problems.inputs(files, of_z), {"--output": output.path, "--plot": given["plot"]})
    picture = given["plot"]
    if picture is not None:
        _require_picture(picture)
    data, source = _read(files, of_z, given)
    if picture is not None:
        from lcpcli.report import solutions as solution_cones

        solution_cones.require(data.problem)
    try:
        found = _found(data, given)
    except ProblemError as fault:
        raise fault.inside(str(source)) from None
    _show(found, source, output, exact)
    if picture is not None:
        _draw(found, picture)
    return exit_code(found)


def exit_code(found: SolutionSet) -> int:
    """0 if the list is complete or as long as was asked for, 1 if it may not be complete, 3 if there is no solution."""
    from lcpcli.enumeration import search as sets

    codes = {sets.TIME_LIMIT: exit_codes.NOT_SOLVED, sets.INTERRUPTED: exit_codes.INTERRUPTED}
    return {**codes, sets.UNSOLVABLE: exit_codes.NO_SOLUTION}.get(found.status, exit_codes.SOLVED)


def _refuse_without_effect(variant: Variant, given: Mapping[str, Any]) -> None:
    """Raise OptionError for an option that is for a single solution."""
    if variant.method != "auto":
        hint = "leave out --method, or --all"
        raise OptionError("--all", f"has a method of its own, and {variant} finds one solution at most", hint)
    for name in OF_ONE:
        if given[name] not in (None, False):
            raise OptionError(flag(name), "has no effect with --all", "leave it out")
    if given["plot"] == HERE:
        raise OptionError("--plot -", "has no effect with --all", "name a file for the picture")


def _read(files: Sequence[str], bounds: problems.Given, given: Mapping[str, Any]) -> tuple[ExactProblem, Source]:
    """The problem in the files, with decimals as written, and where it is."""
    from lcpcli.files.games import hint

    works, several = problems.works(files, given["game"])
    if several:
        raise OptionError("--all", "takes one problem", hint(files) or "give the others to another run")
    work = next(works)
    (held,) = problems.held(work, bounds)
    for remark in [] if given["quiet"] else held.remarks:
        problems.tell(remark)
    return held.exactly(), work.sources[0]


def _found(data: ExactProblem, given: Mapping[str, Any]) -> SolutionSet:
    """What the search finds, until it ends or is ended."""
    from lcpcli.enumeration import search as sets
    from lcpcli.enumeration.search import solutions

    began = clock.seconds()
    search = solutions(data, time_limit=given[TIME_LIMIT.name], max_solutions=given[MAX_SOLUTIONS.name])
    with _stopped_by_interrupts(search) as interrupts:
        for _ in search:
            continue
    enough = len(search.pieces) == given[MAX_SOLUTIONS.name]
    ended = sets.INTERRUPTED if interrupts else sets.ENOUGH if enough else sets.TIME_LIMIT
    return sets.SolutionSet(search, ended, clock.seconds() - began)


@contextmanager
def _stopped_by_interrupts(search: Solutions) -> Iterator[list[int]]:
    """A context in which Ctrl-C ends the search with what it has found, and a second one as usual; the signals."""
    received: list[int] = []
    usual = signal.getsignal(signal.SIGINT)

    def stop(number: int, _: object) -> None:
        received.append(number)
        search.stop()
        signal.signal(signal.SIGINT, usual)

    signal.signal(signal.SIGINT, stop)
    try:
        yield received
    finally:
        signal.signal(signal.SIGINT, usual)


def _show(found: SolutionSet, source: Source, output: Output, exact: bool) -> None:
    """Print what was found, or write it to the output file."""
    if output.silent:
        return
    from lcpcli.files import atomic_write

    width, color = (None, False) if output.path else terminal()
    text = _text(found, source, output.form, exact, width, color)
    if output.path is None:
        emit(text, color)
    else:
        atomic_write.write_whole(output.path, text)


def _require_picture(path: str) -> None:
    """Refuse a picture that could not be drawn or written."""
    from lcpcli.files.atomic_write import refuse_unwritable
    from lcpcli.report import plotting

    plotting.require()
    plotting.form_of(path)
    refuse_unwritable(path)


def _draw(found: SolutionSet, path: str) -> None:
    """Write the picture of the complementary cones."""
    from lcpcli.files import atomic_write
    from lcpcli.report import plotting
    from lcpcli.report.solutions import cones

    atomic_write.write_whole(path, plotting.cones(cones(found), plotting.form_of(path)))


def _text(found: SolutionSet, source: Source, form: str, exact: bool, width: int | None, color: bool) -> str:
    if form in ("json", "csv"):
        from lcpcli.report import solutions as solution_records

        return (
            solution_records.in_json(found, source, exact) if form == "json" else solution_records.in_csv(found, exact)
        )
    from lcpcli.report import formats
    from lcpcli.report import solutions as solution_table

    return formats.typeset([solution_table.build(found, exact, form)], form, width, color)
