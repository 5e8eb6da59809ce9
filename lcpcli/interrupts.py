"""Keep compiled code from printing, and from holding up Ctrl-C and time limits."""

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

WAIT = 0.2  # seconds between looks at whether Ctrl-C has been pressed


class TimeIsUp(Exception):
    """The time limit has passed while compiled code was at work."""


abandoned: list[threading.Event] = []  # the ends of calls that nobody waits for any more
_deadline: ContextVar[float] = ContextVar("deadline", default=math.inf)  # by time.monotonic()
_watch: ContextVar[Callable[[], None] | None] = ContextVar("watch", default=None)


@contextmanager
def within(seconds: float, watch: Callable[[], None] | None = None) -> Iterator[None]:
    """Let what is called `interruptibly` meanwhile end with TimeIsUp once so many seconds have passed.

    watch : called every now and then during the wait.
    """
    deadline, watching = _deadline.set(time.monotonic() + seconds), _watch.set(watch)
    try:
        yield
    finally:
        _deadline.reset(deadline)
        _watch.reset(watching)


@contextmanager
def silence() -> Iterator[None]:
    """Send file descriptor 1 to the null device meanwhile, for the whole process.

    The mixed-integer solver of HiGHS has a debugging line left in that it prints in spite of its options; between
    results on standard output it would spoil them. C's own buffer is flushed on both sides where that can be done.
    """
    try:
        saved = os.dup(1)
    except OSError:  # there is no standard output
        yield
        return
    try:
        with open(os.devnull, "wb") as null:  # noqa: PTH123 (os.devnull is no path on Windows)
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
    """What the call returns or raises. Ctrl-C and a time limit end the wait for it, though compiled code heeds neither.

    The call runs on in a thread of its own then, one of `abandoned`, which ends with the process. Outside the main
    thread, which alone receives Ctrl-C, it is called as it is.
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
    """Whether Ctrl-C has led to an error: compiled code, and what imports it, wrap that in errors of their own."""
    while error and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def leave(code: int) -> NoReturn:
    """End the process with that exit code, at once if compiled code is still at work for nobody.

    The interpreter's own way out would meet the memory callbacks of SuperLU half-way, and lose what is still to be
    written.
    """
    if not all(done.is_set() for done in abandoned):
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()
        os._exit(code)
    sys.exit(code)
