"""From parsed options to an exit code: read, run, show."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lcpcli.cli.options import Output, for_methods, limits
from lcpcli.errors import OptionError

CLOSED_PIPE = 141  # as shells report SIGPIPE

if TYPE_CHECKING:
    from lcpcli.driver import Limits
    from lcpcli.problem import Problem
    from lcpcli.result import Result


def run(paths: Sequence[tuple[str, str | None]], methods: Sequence[str], given: dict[str, Any]) -> int:
    """Run the methods on each of the problems, given by their files; show the results; return the worst exit code."""
    output = Output(*(given[name] for name in ("form", "trace", "every", "output", "quiet")))
    from lcpcli import files

    if [name for pair in paths for name in pair].count(files.STANDARD_INPUT) > 1:
        raise OptionError("standard input", "can be read only once", "name a file")
    if output.path is not None and any(same_file(output.path, name) for pair in paths for name in pair if name):
        raise OptionError(output.path, "holds the problem", "choose another place for the output")
    bounds = limits(given)
    problems = [files.read(*path) for path in paths]
    chosen = [for_methods(given, methods, problem) for problem in problems]
    width, color = (None, False) if output.path else terminal()
    results = _results(problems, methods, chosen, bounds, output, width)
    if not output.silent:
        from lcpcli import report

        text = report.render(results, output.form, width, color)
        if output.path is None:
            show(text, color)
        else:
            files.write_whole(output.path, text)
    return max(result.status.exit_code for result in results)


def _results(
    problems: Sequence[Problem],
    methods: Sequence[str],
    chosen: Sequence[Sequence[dict[str, Any]]],
    bounds: Limits,
    output: Output,
    width: int | None,
) -> list[Result]:
    """One result a problem and method, problem by problem; an interrupted run is the last one."""
    from lcpcli import driver

    results: list[Result] = []
    for problem, own in zip(problems, chosen, strict=True):
        for method, values in zip(methods, own, strict=True):
            trace = output.trace(problem, width)
            results.append(driver.run(problem, method, limits=bounds, trace=trace, **values))
            if results[-1].interrupted:
                return results
    return results


def show(text: str, color: bool) -> None:
    """Print to standard output; a reader who has closed it wants no more, and is told nothing."""
    try:
        click.echo(text, nl=False, color=color)
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise click.exceptions.Exit(CLOSED_PIPE) from None


def same_file(one: str, other: str) -> bool:
    try:
        return Path(one).samefile(other)
    except OSError:
        return False


def terminal() -> tuple[int | None, bool]:
    """Width and colour of standard output; no width where it is no terminal, no colour where that is not wanted."""
    if not sys.stdout.isatty():
        return None, False
    color = not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
    from shutil import get_terminal_size

    return get_terminal_size().columns, color
