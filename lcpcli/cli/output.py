"""Where results go, and in which format: checked for consistency before any computation."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lcpcli import options
from lcpcli.cli.exit_codes import CLOSED_PIPE
from lcpcli.errors import OptionError
from lcpcli.options import EVERY
from lcpcli.report.formats import FORMATS, SUFFIXES, TABLES

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.solving.result import Result
    from lcpcli.solving.trace import Trace
    from lcpcli.typing import Indices

MOST_ROWS = 60  # of one method in a table, unless --every is given
FEWEST_ROWS, AROUND = 8, 12  # of a screen: rows shown even on a small one, and lines that are not rows
PRINTED_ROWS = 10  # of one method on a printed page, unless --every is given
MOST_POINTS = 400  # of one method in a figure
ITERATES = ""  # as the file of the iterates: add them to the output
HERE = "-"  # as the file of the figure: draw it on standard output


class Output:
    """What is shown, in which format and where; checked for consistency before any computation."""

    def __init__(
        self,
        form: str | None,
        trace: str | None,
        every: int | None,
        output: str | None,
        quiet: bool,
        bound: bool,
        compared: bool,
    ) -> None:
        options.check((EVERY,), {"every": every})
        output = None if output == "-" else output
        _refuse_format_as_file(output)
        self.form = form or form_of(output)
        self.path, self.silent = output, quiet and output is None
        self.trace_path = None if trace in (None, ITERATES) else trace
        self.with_iterates = not self.silent and trace == ITERATES
        if trace == ITERATES and self.silent:
            raise OptionError("--trace", "has no effect with --quiet", "name a file for the iterates, or leave it out")
        shown = self.with_iterates or (self.form in TABLES and not self.silent)
        if every is not None and not shown and self.trace_path is None:
            raise OptionError("--every", "has no effect where no iterates are shown", "add --trace or leave it out")
        if bound and self.silent:
            raise OptionError("--bound", "has no effect with --quiet", "leave it out")
        if bound and self.form == "csv":
            raise OptionError("--bound", "has no effect on the format csv, which holds no proofs", "leave it out")
        if output is not None:
            from lcpcli.files.atomic_write import refuse_unwritable

            refuse_unwritable(output)
        if self.trace_path is not None:
            _refuse_as_trace(self.trace_path)
        self._shown, self._every, self.compared = shown, every, compared

    def trace(self, problem: Problem, width: int | None) -> Trace | None:
        """An empty trace for a run whose iterates are shown in that width, or written; it keeps only what is needed."""
        if not self._shown and self.trace_path is None:
            return None
        from lcpcli.solving.trace import Trace

        if self.form not in TABLES or self.trace_path is not None:
            return Trace(self._every or 1)
        return Trace(*self._selection(problem, width), residuals=not problem.solutions)

    def shown(self, result: Result, width: int | None) -> Result:
        """The result with what is shown of its trace, where more was kept for a file."""
        if self.trace_path is None or result.trace is None:
            return result
        shown = result.trace if self.with_iterates else None
        if self.form in TABLES:
            shown = result.trace.selected(*self._selection(result.problem, width))
        return replace(result, trace=shown)

    def _selection(self, problem: Problem, width: int | None) -> tuple[int, int | None, Indices | None]:
        """Which iterates a table shows, every so many and at most so many, and which of their components."""
        from lcpcli.report.tables import kept_components, room

        components = kept_components(problem, room(self.form, width))
        every, most = (self._every, None) if self._every else (int(EVERY.value), self._most(width))
        return every, most, components

    def _most(self, width: int | None) -> int:
        """The largest number of rows shown: for a single result, what a screen holds below it."""
        if self.form == "latex":
            return PRINTED_ROWS
        if width is None or self.compared:
            return MOST_ROWS
        from shutil import get_terminal_size

        return min(MOST_ROWS, max(FEWEST_ROWS, get_terminal_size().lines - AROUND))


def _refuse_as_trace(path: str) -> None:
    """Refuse to write iterates to a file of another kind, or over one that holds something else: --trace may have
    taken a problem's file as its own."""
    from lcpcli.files.atomic_write import refuse_unwritable
    from lcpcli.report.result_csv import OPENING

    if Path(path).suffix.lower() != ".csv":
        raise OptionError("--trace", f"{path} does not end in .csv", "name a .csv file, or put --trace last")
    refuse_unwritable(path)
    if Path(path).is_file():
        with Path(path).open("rb") as file:
            if file.read(len(OPENING)) not in (b"", OPENING.encode()):
                raise OptionError("--trace", f"{path} exists and holds no iterates", "choose another file")


def _refuse_format_as_file(output: str | None) -> None:
    """Refuse -o json, which means a format and would write a table to a file of that name."""
    if output in FORMATS:
        raise OptionError("--output", f"{output} is a format", f"give --format {output}, or a name with a suffix")


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
        from lcpcli.report import plotting as figures

        figures.require("plotext" if path == HERE else "matplotlib")
        if path != HERE:
            figures.form_of(path)
            from lcpcli.files.atomic_write import refuse_unwritable

            refuse_unwritable(path)

    def require_room(self, problems: int) -> None:
        """Refuse more problems than a picture has room for, before any is solved."""
        if self.path not in (None, HERE):
            from lcpcli.report import plotting as figures

            figures.require_room(problems)

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
        from lcpcli.report import plotting

        panels = plotting.panels(runs)
        if self.path != HERE:
            atomic_write.write_whole(self.path, plotting.convergence(panels, plotting.form_of(self.path)))
            return
        from shutil import get_terminal_size

        _, color = terminal()
        size = get_terminal_size()
        emit(plotting.terminal(panels, size.columns, size.lines - 2, color), color)


def terminal() -> tuple[int | None, bool]:
    """Width and colour of standard output; no colour if that is disabled. The width of a pipe is COLUMNS, if set."""
    if not sys.stdout.isatty():
        columns = os.environ.get("COLUMNS", "")
        return int(columns) if columns.isdecimal() and int(columns) else None, False
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
