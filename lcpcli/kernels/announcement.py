"""What comes before kernels are loaded: those are forgotten that are out of date, and a
message says when kernels are compiled, which takes seconds once on a machine; or all
are compiled ahead of their first use."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from importlib import import_module
from pathlib import Path

from numba.core import event
from numba.core.dispatcher import Dispatcher

ANNOUNCEMENT = (
    "lcpcli: compiling the kernels of the extra fast, once on a machine, which "
    "takes about a minute"
)
PACKAGE = Path(__file__).parents[1]
KERNELS = 15  # that `compiled` uses
ROOMS = ("kernels", "basis", "verify")  # with files of functions that are compiled
# Files with functions that kernels of other files use, and with what counts as
# rounding, which compiled kernels keep: numba's cache knows of changes in the file of a
# kernel alone.
USED = (
    "basis/exchanges",
    "methods/direct",
    "linalg/units",
    "linalg/doubles",
    "verify/enclosure",
    "kernels/overloads",
)


class Announcement(event.Listener):
    """The message that kernels are compiled, when the first of them is.

    tell : a function to call instead, with the name of each kernel when its compilation
        begins.
    """

    is_due = True
    tell: Callable[[str], None] | None = None
    _depth = 0  # of the compilation of a function that another one calls

    def on_start(self, event: event.Event) -> None:
        self._depth += 1
        if self.tell is not None and self._depth == 1:
            self.tell(event.data["dispatcher"].py_func.__name__)
        elif self.tell is None and self.is_due:
            logging.getLogger("lcpcli").warning(ANNOUNCEMENT)
        self.is_due = False

    def on_end(self, event: event.Event) -> None:  # noqa: ARG002
        self._depth -= 1


ONCE = Announcement()  # in a process, for all modules of kernels


def announced() -> AbstractContextManager[None]:
    """Forget kernels that were compiled before one of the files that they use was
    changed, and open a context in which the first kernel that is compiled is
    announced."""
    with suppress(OSError):
        newest = max((PACKAGE / f"{name}.py").stat().st_mtime for name in USED)
        for index in (
            index
            for room in ROOMS
            for index in (PACKAGE / room / "__pycache__").glob("*.nbi")
        ):
            if index.stat().st_mtime < newest:
                index.unlink()
    manager: AbstractContextManager[None] = event.install_listener(
        "numba:compile", ONCE
    )
    return manager


def compile_all(tell: Callable[[str], None]) -> tuple[int, int, str]:
    """Load all kernels, which compiles those that the cache lacks; `tell` is called
    with the name of each as that begins. Return how many were compiled, how many were
    there, and the folder with the cache, "" without any."""
    ONCE.tell = tell
    ways = map(
        import_module, ("lcpcli.kernels.compiled", "lcpcli.kernels.mixed_kernels")
    )
    made = {
        id(each): each
        for way in ways
        for each in vars(way).values()
        if isinstance(each, Dispatcher)
    }.values()
    now = sum(bool(kernel.stats.cache_misses) for kernel in made)
    folder = (
        os.path.commonpath([str(kernel.stats.cache_path) for kernel in made])
        if made
        else ""
    )
    return now, len(made) - now, folder
