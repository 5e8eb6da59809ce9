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
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, CancelledError, Future, ThreadPoolExecutor
from contextlib import suppress
from multiprocessing import get_context, parent_process
from typing import Any

from lcpcli.cli.problems import tell
from lcpcli.errors import OptionError
from lcpcli.interrupts import REQUESTS

SECONDS_TO_CONNECT = 10  # to a scheduler, which answers within a second unless the address is wrong
SECONDS_BETWEEN_COUNTS = 4.0  # of a scheduler's workers, which come and go seldom; a count costs a message
SECONDS_ALONE = 9.0  # without workers until a warning: two counts, as workers that start connect late


class Pool:
    """A pool of processes.

    size : the number of processes. most : the largest number of inputs handed over to a process at once; their records
    come back together. kill_error : the error of a future whose process was killed. end_errors : errors that mean that
    no process is left. end : the error to report if none is left.
    """

    most: int
    size: int
    kill_error: type[BaseException]
    end_errors: tuple[type[Exception], ...]
    end: OptionError

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Have one of the processes call a function."""
        raise NotImplementedError

    def look(self) -> None:
        """Count the processes again."""

    def close(self) -> None:
        """End the processes, whatever they are doing."""


class Local(Pool):
    """Processes on this machine, each served by a thread that hands problems over to it."""

    most, kill_error, end_errors = sys.maxsize, BrokenExecutor, (OSError,)
    end = OptionError("--jobs", "no process could be started", "leave it out")

    def __init__(self, size: int) -> None:
        self.size, self._threads, self._is_over = size, ThreadPoolExecutor(size), False
        self._unused = _forked(size)
        self._processes: dict[int, _Process] = {}  # by thread

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        return self._threads.submit(self._call, function, *arguments)

    def close(self) -> None:
        self._is_over = True
        processes = [*self._unused, *self._processes.values()]
        for each in processes:
            each.process.terminate()
        self._threads.shutdown(cancel_futures=True)
        for each in processes:
            each.process.join()

    def _call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Call a function in the process of this thread; raise BrokenExecutor if the process is killed."""
        own = threading.get_ident()
        if own not in self._processes:
            try:
                self._processes[own] = self._unused.pop()
            except IndexError:
                self._processes[own] = _Process("spawn")
        try:
            if self._is_over:
                raise EOFError
            is_returned, outcome = self._processes[own].call(function, arguments)
        except (EOFError, OSError):
            self._processes.pop(own).end()
            raise BrokenExecutor from None
        if is_returned:
            return outcome
        raise outcome


class _Process:
    """A process that calls functions, with the connection to it. start : how it is started, "spawn" or "fork"."""

    def __init__(self, start: str) -> None:
        context: Any = get_context(start)
        self._connection, other_end = context.Pipe()
        serve = _serve if start == "spawn" else _serve_forked
        self.process = context.Process(target=serve, args=(other_end,), daemon=True)
        self.process.start()
        other_end.close()  # so that the end of the process ends the connection
        self._function: Callable[..., Any] | None = None

    def call(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> tuple[bool, Any]:
        """Return whether a call returned, with its value or its error; raise EOFError or OSError if the process ends.

        The process keeps the last function, as it may come with the options and the files of the whole run.
        """
        self._connection.send((None if function == self._function else function, arguments))
        self._function = function
        outcome: tuple[bool, Any] = self._connection.recv()
        return outcome

    def end(self) -> None:
        self.process.terminate()
        self.process.join()
        self._connection.close()


def _forked(size: int) -> list[_Process]:
    """Return processes that are copies of this one, which start at once, up to one for each processor.

    There are none where copies are unsafe: beside other threads, be it of linear algebra, or outside of Linux.
    """
    with suppress(OSError):
        if sys.platform != "linux" or len(os.listdir("/proc/self/task")) > 1:
            return []
    processes: list[_Process] = []
    usual = signal.pthread_sigmask(signal.SIG_BLOCK, REQUESTS)  # until the copy has its own handlers
    try:
        with suppress(OSError):
            for _ in range(min(size, os.cpu_count() or 1)):
                processes.append(_Process("fork"))
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, usual)
    return processes


def _serve_forked(connection: Any) -> None:
    """Serve without the files of the parent, whose locks and ends would otherwise last as long as this process."""
    parent = parent_process()
    assert parent is not None
    null = os.open(os.devnull, os.O_RDWR)
    for number in map(int, os.listdir("/proc/self/fd")):
        if number > 2 and number not in (null, connection.fileno(), parent.sentinel):
            with suppress(OSError):  # the list itself was open
                os.fstat(number)
                os.dup2(null, number)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, REQUESTS)
    _serve(connection)


def _serve(connection: Any) -> None:
    """Call the functions that arrive. Leave Ctrl-C to the parent, and end with the parent, however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    assert parent is not None

    def end_with_parent() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()
    function: Any = None
    with suppress(EOFError, OSError):  # the parent has closed it
        while True:
            other, arguments = connection.recv()
            function = other or function
            try:
                outcome = True, function(*arguments)
            except BaseException as error:
                outcome = False, error
            connection.send(outcome)


class Cluster(Pool):
    """The workers of a Dask scheduler, which itself repeats the work of a killed worker. Handing over one problem takes
    the scheduler milliseconds."""

    most, end_errors = 16, (OSError, CancelledError, RuntimeError)

    def __init__(self, address: str) -> None:
        logging.disable(logging.ERROR)  # distributed reports every worker that comes or goes
        warnings.simplefilter("ignore")  # and warns of versions, ports and blocked loops
        try:
            from distributed import Client
            from distributed.comm.addressing import get_address_host_port
            from distributed.scheduler import KilledWorker
        except ImportError:
            hint = "pip install 'linear-complementarity[cluster]'"
            raise OptionError("--cluster", "needs distributed", hint) from None
        _refuse_without_certificates(address)
        try:
            get_address_host_port(address)  # a client for an address of another form would take long to end
            self._client = Client(address, set_as_default=False, timeout=SECONDS_TO_CONNECT)
        except (OSError, ValueError):
            hint = "start dask scheduler, and give its address"
            raise OptionError("--cluster", f"{address} cannot be reached", hint) from None
        hint = "start the scheduler again; --resume continues a log that -o FILE.jsonl has begun"
        self.end = OptionError("--cluster", f"the scheduler at {address} no longer answers", hint)
        self.size, self._address = 1, address
        self._began, self._counted_at, self._has_warned = time.monotonic(), -math.inf, False
        self._executor, self.kill_error = self._client.get_executor(pure=False), KilledWorker

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        future: Future[Any] = self._executor.submit(function, *arguments)
        return future

    def look(self) -> None:
        """Count the workers, which may come and go, and warn once if there are none."""
        now = time.monotonic()
        if now < self._counted_at + SECONDS_BETWEEN_COUNTS:
            return
        size = int(sum(self._client.nthreads().values()))
        self.size, self._counted_at = max(1, size), now
        if size:
            self._began = now
        elif now > self._began + SECONDS_ALONE and not self._has_warned:
            tell(f"--cluster: the scheduler at {self._address} has no workers; start dask worker {self._address}")
            self._has_warned = True

    def close(self) -> None:
        with suppress(OSError, TimeoutError):
            self._executor.shutdown(wait=False)
            self._client.close()


def _refuse_without_certificates(address: str) -> None:
    """Raise OptionError for an address that needs certificates where Dask's configuration has none."""
    from distributed.security import Security

    if address.startswith("tls:") and Security().get_connection_args("client").get("ssl_context") is None:
        hint = "set distributed.comm.tls.ca-file, client.cert and client.key there; see Dask's documentation on TLS"
        raise OptionError("--cluster", f"{address} needs certificates, and Dask's configuration names none", hint)
