"""The progress of a run on a terminal: a line of text with the time so far, and a bar
where the total is known; it is erased when the run stops."""

from __future__ import annotations

from contextlib import suppress
from typing import IO

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
)
from rich.table import Column

from lcpcli.errors import visible

BAR = 20  # columns


class Display:
    """A line of progress on a stream, drawn again by each call of `show`.

    began : by the clock `time.monotonic`, the beginning of the time that it shows.
    total : the total, of which a bar shows how much is done; None for no bar.
    """

    def __init__(self, stream: IO[str], began: float, total: float | None) -> None:
        text = TextColumn(
            "{task.description}",
            markup=False,
            table_column=Column(no_wrap=True, overflow="ellipsis"),
        )
        bar = [] if total is None else [BarColumn(BAR), MofNCompleteColumn()]
        self._progress = Progress(
            SpinnerColumn("line"),
            text,
            *bar,
            TimeElapsedColumn(),
            console=Console(file=stream, highlight=False, force_terminal=True),
            auto_refresh=False,
            transient=True,
            redirect_stdout=False,
            redirect_stderr=False,
        )
        self._task = self._progress.add_task("", total=total)
        self._progress.tasks[0].start_time = began

    def show(self, text: str, done: float) -> None:
        # Other output notices a terminal that has gone.
        with suppress(OSError, ValueError):
            self._progress.update(self._task, description=visible(text), completed=done)
            self._progress.start()
            self._progress.refresh()

    def note(self, line: str) -> None:
        """Print a line above."""
        with suppress(OSError, ValueError):
            self._progress.console.print(line, markup=False, soft_wrap=True)

    def erase(self) -> None:
        with suppress(OSError, ValueError):
            self._progress.stop()
