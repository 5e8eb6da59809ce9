"""How Ctrl-C, SIGTERM and time limits stop a run, also while compiled code is
running."""

from __future__ import annotations

import _thread
import atexit
import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from importlib.machinery import ExtensionFileLoader
from types import FrameType
from typing import Any, TypeVar

from lcpcli import clock

Item = TypeVar("Item")
REQUESTS = (signal.SIGINT, signal.SIGTERM)  # signals that request the process to stop
# The deadline of a context `deadline_after` without a limit. It is finite, as an
# infinite one means that no such context is open.
NO_LIMIT = sys.float_info.max
SOON = 0.001  # seconds until a signal is repeated
# Seconds between checks for Ctrl-C: short enough that a user does not notice the delay,
# and long enough that the checks take no noticeable time.
WAIT = 0.2


class TimeIsUp(Exception):
    """The time limit has passed while compiled code was running."""


abandoned: list[threading.Thread] = []  # threads of calls that are no longer waited for
# The name of threads that keep a value until it is released, and these threads by the
# event that releases the value.
OWNER = "owner"
_owners: dict[threading.Event, threading.Thread] = {}
# Signals that have requested this run to stop, where a context below was open.
received: list[int] = []
_LOADING = {
    ExtensionFileLoader.create_module.__code__,
    ExtensionFileLoader.exec_module.__code__,
}
# The package whose calls hand objects of LLVM from one owner to another in two steps:
# an error between the two frees an object twice, which kills the process by a signal.
_OWNING = "llvmlite.binding"
_stops: list[int] = []  # signals to which work in a context `stopping` has to react
# The time by `clock.seconds` when the time of the innermost context is up.
_deadline: ContextVar[float] = ContextVar("deadline", default=math.inf)
_watch: ContextVar[Callable[[], None] | None] = ContextVar("watch", default=None)


@contextmanager
def deadline_after(
    seconds: float, watch: Callable[[], None] | None = None
) -> Iterator[None]:
    """Open a context in which `raise_if_timed_out`, and calls through `interruptibly`,
    raise TimeIsUp after this many seconds, or at the deadline of the enclosing context
    if that is earlier. A generator must not yield in it: it would stay open.

    All limits are counted by `clock.seconds`, as are the seconds of a result: the
    modules that are loaded meanwhile take no time. It is the clock of this thread. Code
    that waits by another clock reads this clock when it wakes.

    watch : a function that is called periodically during the wait, by default that of
        the enclosing context.
    """
    deadline_token = _deadline.set(
        min(clock.seconds() + seconds, _deadline.get(), NO_LIMIT)
    )
    watch_token = _watch.set(watch or _watch.get())
    try:
        yield
    finally:
        _deadline.reset(deadline_token)
        _watch.reset(watch_token)


def remaining() -> float:
    """Return the seconds until the time of the context `deadline_after` is up; infinite
    without a time limit."""
    deadline = _deadline.get()
    if _stops and deadline < math.inf:
        return 0.0
    return max(deadline - clock.seconds(), 0.0) if deadline < NO_LIMIT else math.inf


def raise_if_timed_out() -> None:
    """Raise TimeIsUp if the time of the context `deadline_after` is up, or if a signal
    in a context `stopping` stops it."""
    deadline = _deadline.get()
    # This is called for every number in some loops, so that it reads no clock if it
    # can.
    if deadline < math.inf and (
        _stops or (deadline < NO_LIMIT and clock.seconds() > deadline)
    ):
        raise TimeIsUp


def in_time(items: Iterable[Item]) -> Iterator[Item]:
    """Yield the items one after another, and raise TimeIsUp when the time is up."""
    for item in items:
        raise_if_timed_out()
        yield item


@contextmanager
def handling(
    number: int,
    handler: Callable[[int, Any], None] | signal.Handlers,
    usual: Any = None,
) -> Iterator[None]:
    """Open a context in which `handler` handles a signal. If `usual` is passed, it does
    so only if `usual` has handled the signal before.
    """
    before = signal.getsignal(number)
    is_set = (
        usual in (None, before)
        and threading.current_thread() is threading.main_thread()
    )  # signals are received by the main thread
    if is_set:
        signal.signal(number, handler)
    try:
        yield
    finally:
        if is_set:
            signal.signal(number, before)


@contextmanager
def terminable() -> Iterator[None]:
    """Open a context in which the first SIGTERM raises KeyboardInterrupt as Ctrl-C
    does, so that the run reports its results so far, and further ones do nothing; a
    signal that is handled or ignored already stays so. Both wait until no extension
    module is being loaded, as the set-up of many ignores every error, and the signal
    would be lost, and until no call of LLVM is under way, as it would be interrupted in
    the middle."""
    received.clear()
    with (
        handling(signal.SIGINT, raise_interrupt, signal.default_int_handler),
        handling(signal.SIGTERM, raise_interrupt, signal.SIG_DFL),
    ):
        yield


def raise_interrupt(number: int, frame: FrameType | None) -> None:
    """Handle a signal as in a context `terminable`."""
    while frame is not None:
        module = str(frame.f_globals.get("__name__"))
        if frame.f_code in _LOADING or module.startswith(_OWNING):
            repeat(number)
            return
        frame = frame.f_back
    received.append(number)
    if number == signal.SIGINT or received.count(number) == 1:
        raise KeyboardInterrupt


def repeat(number: int) -> None:
    """Send a signal to this process again after a moment. A handler calls this if it
    must not raise an exception where the signal has arrived.
    """

    def send() -> None:
        time.sleep(SOON)
        _thread.interrupt_main(signal.Signals(number))

    _thread.start_new_thread(send, ())


@contextmanager
def stopping() -> Iterator[list[int]]:
    """Open a context in which the first Ctrl-C or SIGTERM acts like a time limit: it
    stops work in a context `deadline_after` at its next `raise_if_timed_out`. A second
    one acts as usual. Yield the list of these signals.
    """
    with ExitStack() as handlers:

        def stop(number: int, _: object) -> None:
            received.append(number)
            _stops.append(number)
            handlers.close()

        for number in REQUESTS:
            if signal.getsignal(number) not in (None, signal.SIG_IGN):
                handlers.enter_context(handling(number, stop))
        try:
            yield _stops
        finally:
            _stops.clear()


@contextmanager
def deferring_signals() -> Iterator[None]:
    """Open a context in which Ctrl-C and SIGTERM wait until it closes, so that
    everything in it is done completely. Processes that start in it inherit the blocked
    signals until they unblock them.
    """
    late: list[int] = []
    usual = (
        ()
        if sys.platform == "win32"
        else signal.pthread_sigmask(signal.SIG_BLOCK, REQUESTS)
    )
    try:
        with ExitStack() as stack:
            for number in REQUESTS:
                # A handler that was not set from Python is None, and could not be
                # restored.
                if signal.getsignal(number) is not None:
                    stack.enter_context(
                        handling(number, lambda number, _: late.append(number))
                    )
            yield
    finally:
        if sys.platform != "win32":
            signal.pthread_sigmask(signal.SIG_SETMASK, usual)
        for each in late:
            signal.raise_signal(each)


def interruptibly(call: Callable[[], Any]) -> Any:
    """Make a call that Ctrl-C and time limits can stop, although compiled code ignores
    both; return its value.

    A stopped call continues in a separate thread, one of `abandoned`, for which the
    interpreter waits when it exits. It must release the interpreter's lock. Outside the
    main thread, which receives Ctrl-C, it is made directly.
    """
    return _called(call, None)[0]


class Owned:
    """A value that is deleted by the thread that has made it, when this object is
    deleted.
    """

    def __init__(self, outcome: list[Any], released: threading.Event) -> None:
        self._outcome, self._released = outcome, released

    @property
    def value(self) -> Any:
        return self._outcome[0]

    def __del__(self) -> None:
        self._released.set()


def owned(call: Callable[[], Any]) -> Owned:
    """Make a call as `interruptibly` does. The value must not be used after the object
    that is returned has been deleted.

    The thread of the call waits until it may delete the value: memory of SuperLU that
    another thread frees is lost (scipy's issue 15921; 30 MB for each factorization of a
    plate with 150 x 150 unknowns).
    """
    if not _owners:
        atexit.unregister(_release)
        atexit.register(_release)
    released = threading.Event()
    return Owned(_called(call, released), released)


def _release() -> None:
    """Make all owners delete their values, while the interpreter can still do that."""
    owners = list(_owners.items())
    for released, _ in owners:
        released.set()
    for _, thread in owners:
        thread.join(WAIT)


def _called(call: Callable[[], Any], released: threading.Event | None) -> list[Any]:
    """Return a list whose only entry is the value of a call, which is made in a thread.
    If `released` is passed, the thread waits for this event and then clears the list.
    """
    if threading.current_thread() is not threading.main_thread():
        return [call()]
    watch = _watch.get()
    outcome, failure = list[Any](), list[BaseException]()

    def run_call() -> None:
        if released is not None:
            _owners[released] = threading.current_thread()
        try:
            outcome.append(call())
        except BaseException as error:
            failure.append(error)
        finally:
            done.set()
        if released is not None:
            released.wait()
            outcome.clear()
            _owners.pop(released, None)

    name, done = None if released is None else OWNER, threading.Event()
    thread = threading.Thread(target=run_call, name=name, daemon=True)
    try:
        try:
            thread.start()
        except RuntimeError:  # there is no memory for a thread
            return [call()]
        while not done.wait(min(WAIT, remaining())):
            if remaining() <= 0:
                raise TimeIsUp
            if watch is not None:
                watch()
    except BaseException:
        if released is not None:
            released.set()
        # Compiled code must not outlive the interpreter: HiGHS and SuperLU call back
        # into it, and when it refuses, unwinding C++ aborts the process. A thread that
        # is not a daemon would be waited for too, but Ctrl-C during that wait would
        # then print a traceback and abort in the same way.
        abandoned[:] = [*filter(threading.Thread.is_alive, abandoned), thread]
        atexit.unregister(_await_abandoned)
        atexit.register(_await_abandoned)
        raise
    if failure:
        if released is not None:
            released.set()
        raise failure[0]
    return outcome


def flush_compiled() -> None:
    """Flush the output of compiled code, which C buffers separately. Only numpy and
    packages that use it print in this way.
    """
    if "numpy" in sys.modules:
        import ctypes

        # Windows has no library of that name.
        with suppress(OSError, TypeError, AttributeError):
            ctypes.CDLL(None).fflush(None)


@contextmanager
def silent() -> Iterator[int | None]:
    """Open a context in which compiled code cannot print to standard output, as HiGHS
    does whatever its options; yield a copy of its file descriptor, or None where other
    threads might print there, or there is no standard output."""
    try:
        copy = os.dup(1) if threading.active_count() == 1 else None
    except OSError:
        copy = None
    if copy is None:
        yield None
        return
    flush_compiled()
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.close(null)
    try:
        yield copy
    finally:
        flush_compiled()
        os.dup2(copy, 1)
        os.close(copy)


def _await_abandoned() -> None:
    """Wait for abandoned calls. Ctrl-C then terminates the process silently, unless the
    program has another handler."""
    for stream in (sys.stdout, sys.stderr):
        # AttributeError: closed by the caller.
        with suppress(OSError, ValueError, AttributeError):
            stream.flush()
    with handling(signal.SIGINT, signal.SIG_DFL, signal.default_int_handler):
        for thread in abandoned:
            while thread.is_alive():
                thread.join(WAIT)


def hides_interrupt(error: BaseException | None) -> bool:
    """Return whether Ctrl-C caused an error: compiled code, and imports of it, wrap
    KeyboardInterrupt in others."""
    while error and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None
