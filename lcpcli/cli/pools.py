"""Processes that solve problems: on this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import logging
import math
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import (
    BrokenExecutor,
    CancelledError,
    Future,
    ProcessPoolExecutor,
    TimeoutError,
)
from contextlib import ExitStack, contextmanager, suppress
from multiprocessing import active_children, get_context, parent_process
from types import FrameType
from typing import Any, TypeAlias

from lcpcli.cli.problems import tell
from lcpcli.errors import OptionError, ResourceError, missing, shortened
from lcpcli.interrupts import (
    REQUESTS,
    deferring_signals,
    handling,
    raise_interrupt,
    received,
)

TASKS = "/proc/self/task"  # on Linux, the threads of this process
# Processes that are forked: all are made before the first one works, so that many
# would delay it.
MAX_COPIES = 32
# Seconds to wait for a scheduler, which answers within a second unless the address is
# wrong.
SECONDS_TO_CONNECT = 10
# Seconds between counts of the workers, which come and go seldom; a count costs a
# message.
SECONDS_BETWEEN_COUNTS = 4.0
# Seconds without workers until a warning: two counts, as workers that start connect
# late.
SECONDS_ALONE = 9.0


# Errors by which a process cannot be started, as there is no file, memory, semaphore or
# thread left, or by which a new one has ended.
NO_PROCESS = (OSError, NotImplementedError, RuntimeError, TimeoutError, BrokenExecutor)
SECONDS_TO_START = 60.0  # a process, on a machine that is very busy
# The signal that requests a process to stop what it solves; None on Windows.
STOP: signal.Signals | None = getattr(signal, "SIGUSR1", None)
SECONDS_TO_EXIT = 10.0  # until it exits by itself


class Local:
    """Processes on this machine. They are copies of this one, which start at once,
    where that is safe: on Linux, while there is no other thread, also of linear
    algebra, and unless they are very many.

    size : their number. max_items : inputs that are handed over to a process at once.
    kill_error : the error of a future whose process was killed. end_errors, end :
        errors of futures that mean that there is no process any more, and the error to
        report then.

    `submit` raises ResourceError if a process cannot be started, or not again after one
    has exited: the other ones then stop too, and nothing waits for them.
    """

    max_items: int = sys.maxsize
    kill_error: type[BaseException] = BrokenExecutor
    end_errors: tuple[type[Exception], ...] = ()
    end = ResourceError("--jobs", "no process is running")

    def __init__(self, size: int) -> None:
        are_safe = (
            os.path.isdir(TASKS) and len(os.listdir(TASKS)) == 1 and size <= MAX_COPIES
        )
        # Windows waits for no more than these.
        self.size = min(size, 61) if sys.platform == "win32" else size
        self._handlers = ExitStack()
        if STOP is not None:  # until a process handles it
            self._handlers.enter_context(handling(STOP, signal.SIG_IGN))
        with self._or_refused(), deferring_signals():
            self._executor = self._started("fork" if are_safe else "spawn")
            self._executor.submit(int)

    def _started(self, how: str) -> ProcessPoolExecutor:
        context = get_context(how)
        return ProcessPoolExecutor(self.size, context, _begin, (context.Semaphore(1),))

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        with self._or_refused(), deferring_signals():  # until new ones are ready
            return self._submitted(function, *arguments)

    @contextmanager
    def _or_refused(self) -> Iterator[None]:
        try:
            yield
        except NO_PROCESS as error:
            for each in active_children():
                each.kill()  # else the interpreter would wait for them
            reason = getattr(error, "strerror", None)
            raise ResourceError(
                "--jobs",
                f"a process cannot be started{f' ({reason})' if reason else ''}",
                "give fewer, or leave it out; --resume continues a log that -o "
                "FILE.jsonl has begun",
            ) from None

    def _submitted(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        arguments = function, *arguments
        try:
            return self._executor.submit(_stoppable, *arguments)
        except BrokenExecutor:
            # By now there are other threads, with which copying this process is unsafe.
            self._executor = self._started("spawn")
            # A process that exits at once would exit again with each problem.
            self._executor.submit(int).result(SECONDS_TO_START)
            return self._executor.submit(_stoppable, *arguments)

    def check_alive(self) -> None:
        """Terminate all processes if one was killed, as the executor does unless it
        waits for the rest of a result. Raises ResourceError if its thread has ended,
        without which no result arrives."""
        executor: Any = self._executor
        thread = executor._executor_manager_thread
        if thread is not None and not thread.is_alive() and not executor._broken:
            with self._or_refused():
                raise BrokenExecutor
        if not all(
            each.is_alive() for each in list(self._executor._processes.values())
        ):
            self._kill()

    def stop(self) -> bool:
        """Request the processes to stop what they solve, and to begin nothing more;
        return whether their results can be awaited."""
        if STOP is None:
            return False
        for each in active_children():
            with suppress(ProcessLookupError):
                os.kill(each.pid or 0, STOP)
        return True

    def close(self) -> None:
        self._kill()
        self._executor.shutdown(cancel_futures=True)
        # Its semaphore goes with it. It would outlive an exit that leaves out the
        # functions of `atexit`, and Python would warn of it.
        del self._executor
        self._handlers.close()

    def _kill(self) -> None:
        for each in active_children():
            each.kill()
        results: Any = self._executor._result_queue
        # Where a process has written the beginning of a result, the rest never comes.
        results._writer.close()


# In a process: whether it works on a problem, and whether it has been asked to stop.
_works: list[bool] = []
_stops: list[bool] = []


def _stoppable(function: Callable[..., Any], *arguments: Any) -> Any:
    """Return what a function returns; KeyboardInterrupt is raised in it, or before it,
    if this process is asked to stop."""
    if _stops:
        raise KeyboardInterrupt
    _works.append(True)
    try:
        return function(*arguments)
    finally:
        _works.clear()


def _stop(number: int, frame: FrameType | None) -> None:
    """Exit within a few seconds, in which the results so far are reported; ignore
    further requests."""
    if _stops:
        return
    _stops.append(True)
    timer = threading.Timer(SECONDS_TO_EXIT, os._exit, (1,))
    timer.daemon = True
    timer.start()
    if _works:
        raise_interrupt(number, frame)


def _begin(speaks: Any) -> None:
    """Leave Ctrl-C to the parent, and exit with it, however it exits. Messages that
    each process would repeat come from one of them, the one with the semaphore."""

    def is_first(_: logging.LogRecord) -> bool:
        if not speaking:
            speaking.append(speaks.acquire(block=False))
        return speaking[0]

    speaking = list[bool]()
    logging.getLogger("lcpcli").addFilter(is_first)
    received.clear()
    # The parent takes both signals, also of a whole group, and asks by STOP.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    if STOP is not None:
        signal.signal(STOP, _stop)
    if sys.platform != "win32":
        signal.pthread_sigmask(signal.SIG_UNBLOCK, REQUESTS)
    parent = parent_process()
    assert parent is not None

    def end_with_parent() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()


class Cluster:
    """The workers of a Dask scheduler, which repeats the work of a killed one, and
    hands over one in milliseconds."""

    max_items = 16
    end_errors: tuple[type[Exception], ...] = (OSError, CancelledError, RuntimeError)

    def __init__(self, address: str) -> None:
        # Distributed reports every worker that comes or goes.
        logging.disable(logging.ERROR)
        # It also warns of versions, ports and blocked loops.
        warnings.simplefilter("ignore")
        try:
            from distributed import Client
            from distributed.comm.addressing import get_address_host_port
            from distributed.scheduler import KilledWorker
            from distributed.security import Security
        except ImportError:
            raise OptionError("--cluster", *missing("distributed")) from None
        if (
            address.startswith("tls:")
            and Security().get_connection_args("client").get("ssl_context") is None
        ):
            hint = (
                "set distributed.comm.tls.ca-file, client.cert and client.key "
                "there; see Dask's documentation on TLS"
            )
            raise OptionError(
                "--cluster",
                f"{shortened(address)} needs certificates, and Dask's configuration "
                "names none",
                hint,
            )
        try:
            # A client for an address of another form would take long to fail.
            get_address_host_port(address)
            self._client = Client(
                address, set_as_default=False, timeout=SECONDS_TO_CONNECT
            )
        except (OSError, ValueError):
            hint = "start dask scheduler, and give its address"
            raise OptionError(
                "--cluster", f"{shortened(address)} cannot be reached", hint
            ) from None
        hint = (
            "start the scheduler again; --resume continues a log that -o FILE.jsonl "
            "has begun"
        )
        self.end = ResourceError(
            "--cluster", f"the scheduler at {address} no longer answers", hint
        )
        self.size, self._address = 1, address
        self._began = time.monotonic()
        self._counted_at = -math.inf
        self._has_warned = False
        self._executor = self._client.get_executor(pure=False)
        self.kill_error = KilledWorker

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        future: Future[Any] = self._executor.submit(function, *arguments)
        return future

    def check_alive(self) -> None:
        """Count the workers, which may come and go, and warn once if there are none."""
        now = time.monotonic()
        if now < self._counted_at + SECONDS_BETWEEN_COUNTS:
            return
        size = int(sum(self._client.nthreads().values()))
        self.size, self._counted_at = max(1, size), now
        if size:
            self._began = now
        elif now > self._began + SECONDS_ALONE and not self._has_warned:
            tell(
                f"--cluster: the scheduler at {self._address} has no workers; "
                f"start dask worker {self._address}, which needs this package: "
                "without it a worker ends at once"
            )
            self._has_warned = True

    def stop(self) -> bool:
        """Return that running work cannot be stopped."""
        return False

    def close(self) -> None:
        with suppress(OSError, TimeoutError):
            self._executor.shutdown(wait=False)
            self._client.close()


Pool: TypeAlias = Local | Cluster
