"""Progress on standard error. It is not drawn by a thread, which would disturb the timings."""

from __future__ import annotations

import math
import os
import sys
import time
from contextlib import suppress
from types import TracebackType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lcpcli.bench.suites import Case


SILENT = 1.0  # seconds before a run shows progress
INTERVAL = 0.2  # between two numbers of problems
ERASE = "\r\x1b[K"


def wanted(quiet: bool) -> bool:
    """Whether progress is shown: on a terminal that can erase it, unless output is to be quiet."""
    return not quiet and sys.stderr is not None and sys.stderr.isatty() and os.environ.get("TERM") != "dumb"


class Line:
    """Progress of a run: one line, rewritten in place, shown after the first second and erased at the end."""

    def __init__(self) -> None:
        self._drawn, self._next = False, time.monotonic() + SILENT

    def __enter__(self) -> Line:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._drawn:
            self._write(ERASE)

    def tell(self, method: str, k: int, bound: float, seconds: float) -> None:
        """Show the method, its iteration, the approximate relative residual, and the time so far."""
        if seconds < SILENT:
            return
        size = f"relative residual about {bound:.1e}  " if bound < math.inf else ""
        text = f"{method}  k = {k}  {size}{seconds:.1f} s"
        self._drawn = True
        self._write(ERASE + text[: _columns() - 1])

    def tell_number(self, solved: int) -> None:
        """Show how many problems are solved, at most a few times a second."""
        now = time.monotonic()
        if now > self._next:
            self._next, self._drawn = now + INTERVAL, True
            self._write(f"{ERASE}{solved} problems")

    def _write(self, text: str) -> None:
        with suppress(OSError):
            sys.stderr.write(text)
            sys.stderr.flush()


def _columns() -> int:
    try:
        return os.get_terminal_size(sys.stderr.fileno()).columns or 80
    except (OSError, ValueError):
        return 80


class Progress:
    """A progress bar, updated only between measurements and erased at the end; nothing unless `shown`."""

    def __init__(self, total: int, shown: bool) -> None:
        self._bar = None
        if not shown or not total:
            return
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn
        from rich.progress import Progress as Bar

        columns = (MofNCompleteColumn(), BarColumn(20), TextColumn("{task.description}", markup=False))
        self._bar = Bar(*columns, console=Console(stderr=True), auto_refresh=False, transient=True)
        self._task = self._bar.add_task("", total=total)

    def __enter__(self) -> Progress:
        if self._bar:
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar:
            self._bar.stop()

    def starting(self, case: Case, solver: str) -> None:
        if self._bar:
            self._bar.update(self._task, description=f"{case.name}: {solver}", refresh=True)

    def finished(self) -> None:
        if self._bar:
            self._bar.update(self._task, advance=1)
