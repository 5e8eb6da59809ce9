"""Loading of the kernels: from numba's cache, or by compilation, which takes up to a
minute once on a machine, and which a message announces; and compilation of all kernels
before their first use.
"""

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
LEFT_OUT = "lcpcli: continuing without compiled kernels"
WAITING = "lcpcli: waiting for another process, which compiles the kernels"
KERNELS = 18  # the number of kernels that `compiled` uses
# The modules are independent of each other, so that processes that start together
# compile different ones; those that take longest come first.
MODULES = (
    "mixed_kernels",
    "pivoting_kernels",
    "kernels",
    "contact_kernels",
    "measure_kernels",
)
PATIENCE = 1.0  # seconds after which a wait for another process is announced


class Announcement(event.Listener):
    """The message that kernels are compiled, printed when the first compilation starts.

    tell : a function to call instead, with the name of each kernel when its compilation
        begins. before : a function to call before each compilation.
    """

    is_due = True
    tell: Callable[[str], None] | None = None
    before: Callable[[], None] | None = None
    _depth = 0  # compilations under way: functions called by others are nested

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


ONCE = Announcement()  # one message in a process, for all modules of kernels


class _Wait:
    """The wait for another process, which is announced when it becomes long."""

    def __init__(self) -> None:
        self._end = time.monotonic() + PATIENCE

    def __call__(self) -> None:
        if ONCE.is_due and time.monotonic() > self._end:
            ONCE.say(WAITING)


def load(*modules: str) -> None:
    """Load modules of kernels. Those that another process is compiling come last, and
    are taken from the cache when it has ended. Raises OptionError if the cache cannot
    be used, after a message, unless `tell` of ONCE replaces messages.
    """
    if config.DISABLE_JIT:
        return
    try:
        _load(Cache(), modules)
    except OptionError as error:
        if ONCE.tell is None:
            logging.getLogger("lcpcli").warning(f"{LEFT_OUT}: {error}")
        raise


def _load(cache: Cache, modules: Sequence[str]) -> None:
    """Load modules of kernels; raise OptionError if the cache cannot be used."""
    folder = str(cache.folder)
    try:
        if cache.repair():
            ONCE.say(DAMAGED)
        modules_left = list(modules)
        for module in filter(cache.has_loaded, modules):
            _import(cache, module)
            modules_left.remove(module)
        for wait in (None, _Wait()):
            modules_left = [
                module for module in modules_left if not _compiled(cache, module, wait)
            ]
    except TimeoutError:
        raise OptionError(
            folder, "is locked by a process that does not finish"
        ) from None
    except OSError as error:
        reason = f"cannot keep compiled kernels ({error.strerror})"
        hint = "set NUMBA_CACHE_DIR to a folder with enough space"
        raise OptionError(folder, reason, hint) from None


def _compiled(cache: Cache, module: str, wait: Callable[[], None] | None) -> bool:
    """Load a module that may have to be compiled. If another process is compiling it,
    call `wait` until that is finished; return False if `wait` is None. A process that
    is killed leaves the kernels that it has compiled in the cache.
    """
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
        # A file without a checksum was damaged, for example by a power failure: the
        # next run compiles all kernels again.
        cache.forget()
        reason = f"has kernels that cannot be loaded ({type(error).__name__})"
        raise OptionError(str(cache.folder), reason) from None


def compile_all(tell: Callable[[str], None]) -> tuple[int, int, str]:
    """Load all kernels, which compiles those that the cache lacks; `tell` is called
    with the name of each when its compilation begins. Return the number of compiled
    kernels, the number of those loaded from the cache, and the folder of the cache, ""
    if there is none. Raises OptionError as `load` does.
    """
    ONCE.tell = tell
    load(*MODULES)
    names = ("compiled", "mixed_kernels", "contact_kernels")
    used, mixed, contact = (import_module(f"lcpcli.kernels.{name}") for name in names)
    of_contact = contact.compact_form, contact.contact_step
    values = (*vars(used).values(), *vars(mixed).values(), *of_contact)
    # A kernel may be in both modules.
    dispatchers = [each for each in values if isinstance(each, Dispatcher)]
    kernels = {id(kernel): kernel for kernel in dispatchers}.values()
    n_compiled = sum(bool(kernel.stats.cache_misses) for kernel in kernels)
    folder = (
        os.path.commonpath([str(kernel.stats.cache_path) for kernel in kernels])
        if kernels
        else ""
    )
    return n_compiled, len(kernels) - n_compiled, folder
