"""Keep compiled code from printing, and from blocking Ctrl-C and time limits."""

from __future__ import annotations

import math
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from typing import Any, NoReturn

WAIT = 0.2  # seconds between checks for Ctrl-C


class TimeIsUp(Exception):
    """The time limit has passed while compiled code was running."""


abandoned: list[threading.Event] = []  # set at the end of calls that are no longer waited for
_deadline: ContextVar[float] = ContextVar("deadline", default=math.inf)  # by time.monotonic()
_watch: ContextVar[Callable[[], None] | None] = ContextVar("watch", default=None)


@contextmanager
def within(seconds: float, watch: Callable[[], None] | None = None) -> Iterator[None]:
    """A context in which calls through `interruptibly` raise TimeIsUp after this many seconds.

    watch : called periodically during the wait.
    """
    deadline, watching = _deadline.set(time.monotonic() + seconds), _watch.set(watch)
    try:
        yield
    finally:
        _deadline.reset(deadline)
        _watch.reset(watching)


@contextmanager
def silence() -> Iterator[None]:
    """A context in which file descriptor 1 is the null device, for the whole process.

    The mixed-integer solver of HiGHS prints a leftover debugging line regardless of its options, which would corrupt
    results on standard output. C's own buffer is flushed before and after where possible.
    """
    try:
        saved = os.dup(1)
    except OSError:  # there is no standard output
        yield
        return
    try:
        with open(os.devnull, "wb") as null:  # noqa: PTH123 (os.devnull is not a path on Windows)
            _flush()
            os.dup2(null.fileno(), 1)
        yield
    finally:
        _flush()
        os.dup2(saved, 1)
        os.close(saved)


def _flush() -> None:
    import ctypes

    with suppress(OSError, TypeError, AttributeError):  # Windows has no library of that name
        ctypes.CDLL(None).fflush(None)


def interruptibly(call: Callable[[], Any]) -> Any:
    """What the call returns or raises. Ctrl-C and time limits end the wait for it, although compiled code ignores both.

    The call then continues in a thread of its own, one of `abandoned`, which ends with the process. Outside the main
    thread, the only one to receive Ctrl-C, it is called directly.
    """
    if threading.current_thread() is not threading.main_thread():
        return call()
    deadline, watch = _deadline.get(), _watch.get()
    outcome: list[Any] = []
    failure: list[BaseException] = []

    def work() -> None:
        try:
            outcome.append(call())
        except BaseException as error:
            failure.append(error)
        finally:
            done.set()

    done = threading.Event()
    try:
        threading.Thread(target=work, daemon=True).start()
    except RuntimeError:  # no memory for one
        return call()
    try:
        while not done.wait(min(WAIT, max(deadline - time.monotonic(), 0.0))):
            if time.monotonic() >= deadline:
                raise TimeIsUp
            if watch is not None:
                watch()
    except BaseException:
        abandoned.append(done)
        raise
    if failure:
        raise failure[0]
    return outcome[0]


def hides_interrupt(error: BaseException | None) -> bool:
    """Whether an error was caused by Ctrl-C: compiled code, and imports of it, wrap that in errors of their own."""
    while error and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def leave(code: int) -> NoReturn:
    """End the process with that exit code, at once if an abandoned call is still running.

    The interpreter's normal shutdown would break the memory callbacks of SuperLU while they are in use, and lose
    unwritten output.
    """
    if not all(done.is_set() for done in abandoned):
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()
        os._exit(code)
    sys.exit(code)
