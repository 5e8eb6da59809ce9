"""What runs now and how far it is, on standard error. No thread draws it, as that would disturb the times."""

from __future__ import annotations

import math
import os
import sys
from contextlib import suppress
from types import TracebackType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lcpcli.bench.suites import Case


SILENT = 1.0  # seconds in which a run shows nothing
ERASE = "\r\x1b[K"


def wanted(quiet: bool) -> bool:
    """Whether anything moving is to be shown: on a terminal that can take it back, unless silence was asked for."""
    return not quiet and sys.stderr is not None and sys.stderr.isatty() and os.environ.get("TERM") != "dumb"


class Line:
    """How a run goes: one line that is rewritten in place, from the second second on, and gone at the end."""

    def __init__(self) -> None:
        self._drawn = False

    def __enter__(self) -> Line:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._drawn:
            self._write(ERASE)

    def tell(self, method: str, k: int, level: float, seconds: float) -> None:
        """Show the method, its iteration, about how large the relative residual is, and for how long it has run."""
        if seconds < SILENT:
            return
        size = f"relative residual about {level:.1e}  " if level < math.inf else ""
        text = f"{method}  k = {k}  {size}{seconds:.1f} s"
        self._drawn = True
        self._write(ERASE + text[: _columns() - 1])

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
    """A bar that stands still between measurements, and is gone at the end; nothing at all unless `shown`."""

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
