"""The terminal: its size and colours, printing on standard output, and the line that
shows the progress of a run."""

from __future__ import annotations

import math
import os
import sys
import time
from contextlib import suppress

import click

from lcpcli.cli.main import CLOSED_PIPE
from lcpcli.errors import visible

STANDARD = "-"  # as a file: standard output, or standard input where it is read
# As only `sys.stdout` writes there.
NAMES_OF_OUTPUT = (STANDARD, "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1")
ITERATES = ""  # as the file of --trace: add the iterates to the output
DIGITS = 4  # of the width of a terminal that are read: more than any table needs
# Seconds before a run shows progress, as nobody wonders about a shorter wait.
PATIENCE = 1.0
# Seconds between two numbers of problems, which could not be read faster.
INTERVAL = 0.2
ERASE = "\r\x1b[K"  # the control sequence that empties the line of a terminal


def terminal() -> tuple[int | None, bool]:
    """Return the width of standard output and whether it shows colours; the width of a
    pipe is COLUMNS, if set."""
    if not sys.stdout.isatty():
        columns = os.environ.get("COLUMNS", "")
        return (int(columns[:DIGITS]) or None) if columns.isdecimal() else None, False
    return min(size().columns, 10**DIGITS), (
        not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
    )


def size() -> os.terminal_size:
    from shutil import get_terminal_size

    return get_terminal_size()


def emit(text: str, color: bool) -> None:
    """Print to standard output; exit silently if its reader has closed it.

    color : whether the text has colours. Without them a terminal gets no control
        sequences; a pipe gets all as it is.
    """
    if not color and sys.stdout.isatty():
        text = "\n".join(map(visible, text.split("\n")))
    try:
        click.echo(text, nl=False, color=True)
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise click.exceptions.Exit(CLOSED_PIPE) from None


def shows_progress(quiet: bool) -> bool:
    """Return whether progress is shown: on a terminal that can erase it, unless output
    is to be quiet."""
    return (
        not quiet
        and sys.stderr is not None
        and sys.stderr.isatty()
        and os.environ.get("TERM") != "dumb"
    )


class Line:
    """The progress of a run: one line, rewritten in place and erased at the end. It
    shows iterations, or the number of problems, only after the first second."""

    def __init__(self) -> None:
        self._drawn, self._next = False, time.monotonic() + PATIENCE

    def __enter__(self) -> Line:
        return self

    def __exit__(self, *error: object) -> None:
        if self._drawn:
            self._write(ERASE)

    def tell(self, method: str, k: int, bound: float, seconds: float) -> None:
        """Show the method, its iteration, the approximate relative residual, and the
        time so far."""
        size = f"relative residual about {bound:.1e}  " if bound < math.inf else ""
        if seconds >= PATIENCE:
            self.show(f"{method}  k = {k}  {size}{seconds:.1f} s")

    def tell_number(self, solved: int) -> None:
        """Show the number of solved problems, at most a few times a second."""
        now = time.monotonic()
        if now > self._next:
            self._next = now + INTERVAL
            self.show(f"{solved} problems")

    def show(self, text: str) -> None:
        self._drawn = True
        self._write(ERASE + visible(text)[: size().columns - 1])

    def _write(self, text: str) -> None:
        with suppress(OSError):
            sys.stderr.write(text)
            sys.stderr.flush()
