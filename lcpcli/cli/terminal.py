"""The terminal: its size and colours, printing on standard output, and the line that
shows the progress of a run."""

from __future__ import annotations

import math
import os
import sys
import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING

import click

from lcpcli.cli.main import say
from lcpcli.errors import Exit, visible

if TYPE_CHECKING:
    from lcpcli.report.progress import Display

STANDARD = "-"  # as a file: standard output, or standard input where it is read
# Only `sys.stdout` writes to these.
NAMES_OF_OUTPUT = (STANDARD, "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1")
DIGITS = 4  # of the width of a terminal that are read: more than any table needs
# Seconds before a run shows progress, as nobody wonders about a shorter wait.
PATIENCE = 1.0
# Seconds between two numbers of problems, which could not be read faster.
INTERVAL = 0.2


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
        click.echo(text, nl=False, color=True)  # which also flushes
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise click.exceptions.Exit(Exit.CLOSED_PIPE) from None


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
    """A context with the progress of a run: a line on standard error, shown after the
    first second and erased afterwards.

    doing : what is being done, which a thread shows with the time so far; "" for no
        such thread, as it takes a little of the time that a run measures.
    total : the total of what `show` and `tell_number` count, if it is known.
    is_shown : whether anything is shown at all, as `shows_progress` returns.
    """

    def __init__(
        self, doing: str = "", total: int | None = None, is_shown: bool = True
    ) -> None:
        self._began = time.monotonic()
        self._next, self._total = self._began + PATIENCE, total
        self._display: Display | None = None
        self.doing, self._is_shown = doing, is_shown
        self._ends, self._lock = threading.Event(), threading.Lock()
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Line:
        if self.doing and self._is_shown:
            self._thread = threading.Thread(target=self._move, daemon=True)
            with suppress(RuntimeError):  # there is no memory for a thread
                self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._ends.set()
        if self._thread is not None and self._thread.is_alive():
            self._thread.join()
        if self._display is not None:
            self._display.erase()

    def _move(self) -> None:
        wait = PATIENCE
        while not self._ends.wait(wait):
            self._draw(self.doing)
            wait = INTERVAL

    def tell(self, method: str, k: int, bound: float, seconds: float) -> None:
        """Show the method, its iteration, and the approximate relative residual."""
        size = f"  relative residual about {bound:.1e}" if bound < math.inf else ""
        if seconds >= PATIENCE:
            self._draw(f"{method}  k = {k}{size}")

    def tell_number(self, solved: int) -> None:
        """Show the number of solved problems, at most a few times a second."""
        now = time.monotonic()
        if now > self._next:
            self._next = now + INTERVAL
            self._draw("solved" if self._total else f"{solved} problems", solved)

    def note(self, line: str) -> None:
        """Print a line on standard error, above the progress if that is shown."""
        if self._display is None:
            say(line)
        else:
            self._display.note(visible(line))

    def show(self, text: str, done: float) -> None:
        """Show what is being done now, and how much of the total is done."""
        if time.monotonic() - self._began >= PATIENCE:
            self._draw(text, done)

    def _draw(self, text: str, done: float = 0) -> None:
        if self._is_shown:
            with self._lock:
                if self._display is None:
                    from lcpcli.report.progress import Display

                    self._display = Display(sys.stderr, self._began, self._total)
                self._display.show(text, done)
