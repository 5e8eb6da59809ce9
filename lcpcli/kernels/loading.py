"""How kernels are loaded: from numba's cache, or compiled, which takes seconds once on
a machine, and which a message says; or all are compiled ahead of their first use."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable, Sequence
from importlib import import_module

from numba import config
from numba.core import event
from numba.core.dispatcher import Dispatcher

from lcpcli.errors import OptionError
from lcpcli.interrupts import hides_interrupt
from lcpcli.kernels.cache import Cache

ANNOUNCEMENT = (
    "lcpcli: compiling the kernels of the extra fast, once on a machine, which "
    "takes about a minute"
)
DAMAGED = "lcpcli: compiled kernels were damaged, and are compiled again"
LEFT_OUT = "lcpcli: going on without compiled kernels"
WAITING = "lcpcli: waiting for another process, which compiles the kernels"
KERNELS = 15  # that `compiled` uses
# Modules that need none of each other, those that take longest first: processes that
# start together compile different ones.
MODULES = ("mixed_kernels", "pivoting_kernels", "kernels", "measure_kernels")
PATIENCE = 1.0  # seconds before a wait for another process is told of


class Announcement(event.Listener):
    """The message that kernels are compiled, when the first of them is.

    tell : a function to call instead, with the name of each kernel when its compilation
        begins. before : a function to call before each.
    """

    is_due = True
    tell: Callable[[str], None] | None = None
    before: Callable[[], None] | None = None
    _depth = 0  # of the compilation of a function that another one calls

    def on_start(self, event: event.Event) -> None:
        self._depth += 1
        if self.before is not None:
            self.before()
        if self.tell is not None and self._depth == 1:
            self.tell(event.data["dispatcher"].py_func.__name__)
        elif self.tell is None and self.is_due:
            self.say(ANNOUNCEMENT)

    def on_end(self, event: event.Event) -> None:  # noqa: ARG002
        self._depth -= 1

    def say(self, line: str) -> None:
        """Print a line instead of the message."""
        logging.getLogger("lcpcli").warning(line)
        self.is_due = False


ONCE = Announcement()  # in a process, for all modules of kernels


class _Wait:
    """The wait for another process, which is told of when it becomes long."""

    def __init__(self) -> None:
        self._end = time.monotonic() + PATIENCE

    def __call__(self) -> None:
        if ONCE.is_due and time.monotonic() > self._end:
            ONCE.say(WAITING)


def load(*modules: str) -> None:
    """Load modules of kernels. Those that another process compiles come last, and are
    taken from the cache when it has ended. Raises OptionError if the cache cannot be
    used, after a message, unless `tell` of ONCE replaces messages."""
    if config.DISABLE_JIT:
        return
    try:
        _load(Cache(), modules)
    except OptionError as error:
        if ONCE.tell is None:
            logging.getLogger("lcpcli").warning(f"{LEFT_OUT}: {error}")
        raise


def _load(cache: Cache, modules: Sequence[str]) -> None:
    folder = str(cache.folder)
    try:
        if cache.repair():
            ONCE.say(DAMAGED)
        left = list(modules)
        for module in filter(cache.has_loaded, modules):
            _import(cache, module)
            left.remove(module)
        for wait in (None, _Wait()):
            left = [module for module in left if not _compiled(cache, module, wait)]
    except TimeoutError:
        raise OptionError(folder, "is locked by a process that does not end") from None
    except OSError as error:
        fault = f"cannot keep compiled kernels ({error.strerror})"
        hint = "set NUMBA_CACHE_DIR to a folder with room"
        raise OptionError(folder, fault, hint) from None


def _compiled(cache: Cache, module: str, wait: Callable[[], None] | None) -> bool:
    """Load a module that may have to be compiled; return False if another process does
    that, unless `wait` is given, which is called while it does. A process that is
    killed leaves what it has compiled."""
    with cache.compiling(module, wait) as is_alone:
        if not is_alone:
            return False
        listening = event.install_listener("numba:compile", ONCE)
        ONCE.before = cache.note
        try:
            with listening:
                _import(cache, module)
        finally:
            ONCE.before = None
        cache.note(module)
    return True


def _import(cache: Cache, module: str) -> None:
    try:
        import_module(f"lcpcli.kernels.{module}")
    except (ImportError, OSError, MemoryError):
        raise
    except Exception as error:
        if hides_interrupt(error):
            raise KeyboardInterrupt from None
        # A file without a checksum was damaged, as by a power failure: the next run
        # compiles all of them again.
        cache.forget()
        fault = f"has kernels that cannot be loaded ({type(error).__name__})"
        raise OptionError(str(cache.folder), fault) from None


def compile_all(tell: Callable[[str], None]) -> tuple[int, int, str]:
    """Load all kernels, which compiles those that the cache lacks; `tell` is called
    with the name of each as that begins. Return how many were compiled, how many were
    there, and the folder with the cache, "" without any. Raises OptionError as `load`
    does."""
    ONCE.tell = tell
    load(*MODULES)
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
