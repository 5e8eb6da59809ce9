"""How compiled code is kept from printing, and from blocking Ctrl-C and time limits."""

from __future__ import annotations

import atexit
import math
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from typing import Any, NoReturn, TypeVar

from lcpcli import clock

Item = TypeVar("Item")
WAIT = 0.2  # seconds between checks for Ctrl-C: a delay that is hardly noticed, and hardly any work


class TimeIsUp(Exception):
    """The time limit has passed while compiled code was running."""


abandoned: list[threading.Thread] = []  # threads of calls that are no longer waited for
reading: list[threading.Thread] = []  # threads that may wait for input for ever; the interpreter exits without them
_deadline: ContextVar[float] = ContextVar("deadline", default=math.inf)  # by `clock.seconds`
_watch: ContextVar[Callable[[], None] | None] = ContextVar("watch", default=None)


@contextmanager
def within(seconds: float, watch: Callable[[], None] | None = None) -> Iterator[None]:
    """Open a context in which calls through `interruptibly` raise TimeIsUp after this many seconds, or at the deadline
    of the enclosing context if that is earlier.

    watch : a function that is called periodically during the wait.
    """
    end, watching = _deadline.set(deadline(seconds)), _watch.set(watch)
    try:
        yield
    finally:
        _deadline.reset(end)
        _watch.reset(watching)


def deadline(seconds: float) -> float:
    """Return the moment, by `clock.seconds`, at which this many seconds, or those of the context `within`, are over.

    All limits are counted by that clock, as are the seconds of a result: it stands still while a module is loaded, and
    no limit is reached then. Code that waits by another clock reads this clock when it wakes.
    """
    return min(clock.seconds() + seconds, _deadline.get())


def remaining() -> float:
    """Return the seconds until calls through `interruptibly` raise TimeIsUp; infinite without a time limit."""
    return max(_deadline.get() - clock.seconds(), 0.0)


def check() -> None:
    """Raise TimeIsUp if the time of the context `within` is up."""
    end = _deadline.get()
    if end < math.inf and clock.seconds() > end:  # most runs have no limit, and some calls come with every number
        raise TimeIsUp


def in_time(items: Iterable[Item]) -> Iterator[Item]:
    """Yield the items one after another until the time is up, as work on many takes seconds."""
    for item in items:
        check()
        yield item


def alarm(end: float) -> Callable[[], None]:
    """Return a function that raises TimeIsUp when it is called after the moment `end`, by `clock.seconds`."""

    def check() -> None:
        if clock.seconds() > end:
            raise TimeIsUp

    return check


@contextmanager
def handling(number: int, handler: Callable[[int, object], None]) -> Iterator[None]:
    """Open a context in which `handler` handles a signal."""
    try:
        usual = signal.signal(number, handler)
    except ValueError:  # only the main thread may set handlers, and only it receives signals
        yield
        return
    try:
        yield
    finally:
        signal.signal(number, usual)


@contextmanager
def deferring_signals() -> Iterator[None]:
    """Open a context in which Ctrl-C and SIGTERM wait until it closes: nothing in it is left half done."""
    received: list[int] = []
    usual: dict[signal.Signals, Any] = {}
    with suppress(ValueError):  # only the main thread may set handlers, and only it receives signals
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) is not None:  # otherwise it was not set from Python, and could not be restored
                usual[number] = signal.signal(number, lambda number, _: received.append(number))
    try:
        yield
    finally:
        for number, handler in usual.items():
            signal.signal(number, handler)
        for late in received:
            signal.raise_signal(late)


@contextmanager
def silence() -> Iterator[None]:
    """Open a context in which file descriptor 1 is the null device, for the whole process.

    The mixed-integer solver of HiGHS prints a leftover debugging line regardless of its options, which would corrupt
    results on standard output. C's own buffer is flushed before and after where possible.
    """
    try:
        saved = os.dup(1)
    except OSError:  # there is no standard output
        yield
        return
    try:
        with open(os.devnull, "wb") as null:
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
    """Make a call that Ctrl-C and time limits can end, although compiled code ignores both; return its value.

    An ended call continues in a thread of its own, one of `abandoned`, for which the interpreter waits when it exits.
    The call must release the interpreter's lock. Outside the main thread, the only one to receive Ctrl-C, the call is
    made directly.
    """
    if threading.current_thread() is not threading.main_thread():
        return call()
    watch = _watch.get()
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
    thread = threading.Thread(target=work, daemon=True)
    try:
        try:
            thread.start()
        except RuntimeError:  # there is no memory for a thread
            return call()
        while not done.wait(min(WAIT, remaining())):
            if remaining() <= 0:
                raise TimeIsUp
            if watch is not None:
                watch()
    except BaseException:
        _abandon(thread)
        raise
    if failure:
        raise failure[0]
    return outcome[0]


def _abandon(thread: threading.Thread) -> None:
    """Leave this thread running; only the exit of the interpreter waits for it.

    Compiled code must not outlive the interpreter: HiGHS and SuperLU call back into it, and when it refuses, unwinding
    C++ aborts the process. A thread that is not a daemon would be waited for too, but Ctrl-C during that wait would
    then print a traceback and end in the same abort.
    """
    abandoned[:] = [*filter(threading.Thread.is_alive, abandoned), thread]
    atexit.unregister(_await_abandoned)
    atexit.register(_await_abandoned)


def _await_abandoned() -> None:
    """Wait for abandoned calls; Ctrl-C ends the process at once."""
    try:
        for thread in abandoned:
            while thread.is_alive():
                thread.join(WAIT)
    except KeyboardInterrupt:
        _end(128 + signal.SIGINT)


def hides_interrupt(error: BaseException | None) -> bool:
    """Return whether Ctrl-C caused an error: compiled code, and imports of it, wrap KeyboardInterrupt in other
    errors."""
    while error and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def leave(code: int) -> NoReturn:
    """End the process with this exit code: at once, as the interpreter's shutdown takes longer than many a solve once
    numpy is loaded, but after the functions that are registered for the exit. An exit that has to be orderly is left to
    the interpreter: where a thread is to be awaited, or a profiler or a debugger watches."""
    if any(map(threading.Thread.is_alive, [*abandoned, *reading])):
        _end(code)
    if threading.active_count() > 1 or sys.getprofile() or sys.gettrace():
        sys.exit(code)
    atexit._run_exitfuncs()  # as in children of multiprocessing, which end alike
    _end(code)


def _end(code: int) -> NoReturn:
    """End the process without the interpreter's shutdown, which would require all threads to have ended."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):  # AttributeError: closed by the caller
            stream.flush()
    os._exit(code)
