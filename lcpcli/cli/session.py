"""From parsed options to an exit code: read, run, show."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from lcpcli.cli.options import Output, for_methods, limits

if TYPE_CHECKING:
    from lcpcli.result import Result


def run(paths: Sequence[tuple[str, str | None]], methods: Sequence[str], given: dict[str, Any]) -> int:
    """Run the methods on each of the problems, given by their files; show the results; return the worst exit code."""
    output = Output(*(given[name] for name in ("form", "trace", "every", "output", "quiet")))
    from lcpcli import driver, files

    bounds = limits(given)
    problems = [files.read(*path) for path in paths]
    chosen = [for_methods(given, methods, problem) for problem in problems]
    width, color = (None, False) if output.path else _terminal()
    shown = [output.components(problem, width) for problem in problems]
    results: list[Result] = []
    for problem, components, own in zip(problems, shown, chosen, strict=True):
        for method, values in zip(methods, own, strict=True):
            trace = output.trace(problem, components)
            results.append(driver.run(problem, method, limits=bounds, trace=trace, **values))
            if results[-1].interrupted:
                return _show(results, output, shown, width, color)
    return _show(results, output, shown, width, color)


def _show(results: Sequence[Result], output: Output, shown: Any, width: int | None, color: bool) -> int:
    if not output.silent:
        from lcpcli import report

        text = report.render(results, output.form, shown, width, color)
        if output.path is None:
            click.echo(text, nl=False, color=color)
        else:
            from lcpcli.files.whole import write_whole

            write_whole(output.path, text)
    return max(result.status.exit_code for result in results)


def _terminal() -> tuple[int | None, bool]:
    """Width and colour of standard output; no width where it is no terminal, no colour where that is not wanted."""
    if not sys.stdout.isatty():
        return None, False
    color = not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
    return shutil.get_terminal_size().columns, color
