"""Where results go, and in which format: checked for consistency before any computation."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lcpcli import options
from lcpcli.cli.exit_codes import CLOSED_PIPE
from lcpcli.errors import OptionError
from lcpcli.options import EVERY
from lcpcli.report.formats import SUFFIXES, TABLES

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.solving.result import Result
    from lcpcli.solving.trace import Trace

MOST_ROWS = 60  # of one method in a table, unless --every is given
FEWEST_ROWS, AROUND = 8, 12  # of a screen: rows shown even on a small one, and lines that are not rows
MOST_POINTS = 400  # of one method in a figure
HERE = "-"  # as the file of the figure: draw it on standard output


class Output:
    """What is shown, in which format and where; checked for consistency before any computation."""

    def __init__(
        self,
        form: str | None,
        trace: bool,
        every: int | None,
        output: str | None,
        quiet: bool,
        bound: bool,
        exact: bool,
        compared: bool,
    ) -> None:
        output = None if output == "-" else output
        self.form = form or form_of(output)
        self.path, self.silent = output, quiet and output is None
        if trace and self.silent:
            raise OptionError("--trace", "has no effect with --quiet", "leave it out")
        if trace and self.form != "json":
            raise OptionError(
                "--trace", f"has no effect on the format {self.form}, which shows the iterates", "leave it out"
            )
        if every is not None and (self.silent or (self.form == "json" and not trace)):
            raise OptionError("--every", "has no effect where no iterates are shown", "add --trace or leave it out")
        if bound and self.silent:
            raise OptionError("--bound", "has no effect with --quiet", "leave it out")
        for flag, wanted in (("--bound", bound), ("--exact", exact)):
            if wanted and self.form == "csv":
                raise OptionError(flag, "has no effect on the format csv, which shows only iterates", "leave it out")
        options.check((EVERY,), {"every": every})
        if output is not None:
            from lcpcli.files.atomic_write import refuse_unwritable

            refuse_unwritable(output)
        self._iterates = not self.silent and (trace or self.form != "json")
        self._every, self._compared = every, compared

    def trace(self, problem: Problem, width: int | None) -> Trace | None:
        """An empty trace for a run whose iterates are shown in that width; it keeps only what is shown."""
        if not self._iterates:
            return None
        from lcpcli.solving.trace import Trace

        if self.form not in TABLES:
            return Trace(self._every or 1)
        from lcpcli.report.iterations import shown_components

        components = shown_components(problem.n, width if self.form == "table" else None)
        every, most = (self._every, None) if self._every else (int(EVERY.value), self._most(width))
        return Trace(every, most, components, residuals=not problem.solutions)

    def _most(self, width: int | None) -> int:
        """The largest number of rows shown: for a single result, what a screen holds below it."""
        if width is None or self._compared:
            return MOST_ROWS
        from shutil import get_terminal_size

        return min(MOST_ROWS, max(FEWEST_ROWS, get_terminal_size().lines - AROUND))


def form_of(output: str | None, suffixes: Mapping[str, str] = SUFFIXES, otherwise: str = " or give --format") -> str:
    """The format that belongs to an output file's suffix; without a suffix, the table.

    otherwise : what else the user may do if the suffix is not a known one.
    """
    ending = Path(output or "").suffix.lower()
    if ending not in suffixes:
        endings = ", ".join(known for known in suffixes if known)
        raise OptionError(str(output), f"the suffix {ending} is not a format", f"use {endings}{otherwise}")
    return suffixes[ending]


class Plot:
    """The requested figure of error against time and iteration, if any, and the levels of error to record.

    path : a file whose suffix gives the format, "-" for a character plot, None for no figure.
    levels : errors, relative to the solution, whose first attainment is recorded.
    """

    def __init__(self, path: str | None, levels: tuple[float, ...]) -> None:
        self.path, self.levels = path, levels
        if path is None:
            return
        from lcpcli.report.figures import drawing as figures

        figures.require("plotext" if path == HERE else "matplotlib")
        if path != HERE:
            figures.form_of(path)
            from lcpcli.files.atomic_write import refuse_unwritable

            refuse_unwritable(path)

    def curve(self, problem: Problem) -> Trace | None:
        """An empty trace for the curve of a run and for the levels."""
        levels = self.levels if problem.solutions else ()
        if self.path is None and not levels:
            return None
        import numpy as np

        from lcpcli.solving.trace import Trace

        none = np.empty(0, dtype=np.intp)
        if self.path is None:
            return Trace(sys.maxsize, components=none, residuals=False, levels=levels)
        return Trace(1, MOST_POINTS, none, residuals=not problem.solutions, levels=levels)

    def show(self, runs: Sequence[Sequence[Result]]) -> None:
        """Draw the runs, one panel per problem."""
        if self.path is None:
            return
        from lcpcli.files import atomic_write
        from lcpcli.report import curves
        from lcpcli.report.figures import drawing as figures

        panels = curves.panels(runs)
        if self.path != HERE:
            atomic_write.write_whole(self.path, figures.convergence(panels, figures.form_of(self.path)))
            return
        from shutil import get_terminal_size

        _, color = terminal()
        size = get_terminal_size()
        emit(figures.terminal(panels, size.columns, size.lines - 2, color), color)


def terminal() -> tuple[int | None, bool]:
    """Width and colour of standard output; no width if it is not a terminal, no colour if that is disabled."""
    if not sys.stdout.isatty():
        return None, False
    color = not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
    from shutil import get_terminal_size

    return get_terminal_size().columns, color


def emit(text: str, color: bool) -> None:
    """Print to standard output; if its reader has closed it, exit silently."""
    try:
        click.echo(text, nl=False, color=color)
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise click.exceptions.Exit(CLOSED_PIPE) from None
