"""What runs now and how much is left, on standard error. No thread draws it, as that would disturb the times."""

from __future__ import annotations

from types import TracebackType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lcpcli.bench.suites import Case


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
