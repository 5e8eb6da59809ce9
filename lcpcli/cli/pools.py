"""Processes that solve problems: on this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import logging
import math
import os
import signal
import threading
import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, CancelledError, Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, suppress
from multiprocessing import get_context, parent_process
from typing import Any

from lcpcli.cli.main import TERMINATED
from lcpcli.cli.problems import tell
from lcpcli.errors import OptionError
from lcpcli.interrupts import handling

SECONDS_TO_CONNECT, SECONDS_KNOWN = 10, 4.0  # to a scheduler, and between two looks at its workers
SECONDS_ALONE = 9.0  # of a scheduler without workers until this is said


class Pool:
    """Processes.

    size : how many there are. most : the problems that are handed over to one at once; their records come together.
    lost : the error of a future whose process was killed. ends : the errors if there are no processes any more. gone :
    what is said then.
    """

    most: int
    size: int
    lost: type[BaseException]
    ends: tuple[type[Exception], ...]
    gone: OptionError

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Have one of them call a function."""
        raise NotImplementedError

    def look(self) -> None:
        """See how many there are."""

    def close(self) -> None:
        """End them, whatever they do."""


class Local(Pool):
    """Processes on this machine, each with a thread here that hands over to it."""

    most, lost, ends = 1, BrokenExecutor, (OSError,)
    gone = OptionError("--jobs", "no process could be started", "leave it out")

    def __init__(self, size: int) -> None:
        self.size, self._threads, self._is_over = size, ThreadPoolExecutor(size), False
        self._processes: dict[int, tuple[Any, Any]] = {}  # by thread, with the connections

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        return self._threads.submit(self._call, function, *arguments)

    def close(self) -> None:
        self._is_over = True
        processes = [process for process, _ in list(self._processes.values())]
        for process in processes:
            process.terminate()
        self._threads.shutdown(cancel_futures=True)
        for process in processes:
            process.join()

    def _call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """What a function returns in the process of this thread; BrokenExecutor if that is killed."""
        own = threading.get_ident()
        process, connection = self._processes[own] = self._processes.get(own) or _started()
        try:
            if self._is_over:
                raise EOFError
            connection.send((function, arguments))
            is_returned, outcome = connection.recv()
        except (EOFError, OSError):
            process.terminate()
            process.join()
            connection.close()
            del self._processes[own]
            raise BrokenExecutor from None
        if is_returned:
            return outcome
        raise outcome


def _started() -> tuple[Any, Any]:
    """A new process, and the connection to it."""
    context = get_context("spawn")
    connection, other_end = context.Pipe()
    process = context.Process(target=_serve, args=(other_end,), daemon=True)
    process.start()
    other_end.close()  # so that the end of the process ends the connection
    return process, connection


def _serve(connection: Any) -> None:
    """Call the functions that come; let Ctrl-C be the parent's business, and end with it, however that ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    assert parent is not None

    def end_with_parent() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()
    with suppress(EOFError, OSError):  # the parent has closed it
        while True:
            function, arguments = connection.recv()
            try:
                outcome = True, function(*arguments)
            except BaseException as error:
                outcome = False, error
            connection.send(outcome)


class Cluster(Pool):
    """The workers of a Dask scheduler, which itself tries again what a killed one has left. Handing over one problem
    takes it milliseconds."""

    most, ends = 16, (OSError, CancelledError, RuntimeError)

    def __init__(self, address: str) -> None:
        logging.disable(logging.ERROR)  # distributed tells of every worker that comes or goes
        try:
            from distributed import Client
            from distributed.comm.addressing import get_address_host_port
            from distributed.scheduler import KilledWorker
        except ImportError:
            hint = "pip install 'linear-complementarity[cluster]'"
            raise OptionError("--cluster", "needs distributed", hint) from None
        _refuse_without_certificates(address)
        try:
            get_address_host_port(address)  # a client for none of this form would take long to end
            self._client = Client(address, set_as_default=False, timeout=SECONDS_TO_CONNECT)
        except (OSError, ValueError):
            hint = "start dask scheduler, and give its address"
            raise OptionError("--cluster", f"{address} is not reached", hint) from None
        hint = "start it again; a log that -o FILE.jsonl has begun goes on with --resume"
        self.gone = OptionError("--cluster", f"the scheduler at {address} has gone", hint)
        self.size, self._address = 1, address
        self._began, self._asked, self._is_told = time.monotonic(), -math.inf, False
        self._executor, self.lost = self._client.get_executor(pure=False), KilledWorker

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        future: Future[Any] = self._executor.submit(function, *arguments)
        return future

    def look(self) -> None:
        """See how many workers there are, which may come and go, and say once that there are none."""
        now = time.monotonic()
        if now < self._asked + SECONDS_KNOWN:
            return
        size = int(sum(self._client.nthreads().values()))
        self.size, self._asked = max(1, size), now
        if size:
            self._began = now
        elif now > self._began + SECONDS_ALONE and not self._is_told:
            tell(f"--cluster: the scheduler at {self._address} has no workers; start dask worker {self._address}")
            self._is_told = True

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


class Terminated(KeyboardInterrupt):
    """SIGTERM, which ends a run as Ctrl-C does where processes have to be ended too."""

    exit_code = TERMINATED


def ending_on_request() -> AbstractContextManager[None]:
    """A context in which the first SIGTERM raises Terminated, and others do nothing."""

    def end(number: int, _: object) -> None:
        signal.signal(number, signal.SIG_IGN)
        raise Terminated

    return handling(signal.SIGTERM, end)
