"""Keep compiled code from printing, and from holding up Ctrl-C."""

from __future__ import annotations

import ctypes
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any


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
    with suppress(OSError, TypeError, AttributeError):  # Windows has no library of that name
        ctypes.CDLL(None).fflush(None)


def interruptibly(call: Callable[[], Any]) -> Any:
    """What the call returns or raises. Ctrl-C ends the wait for it at once, though compiled code does not heed it.

    The call runs on in a thread of its own then, which ends with the process. Outside the main thread, which alone
    receives Ctrl-C, it is called as it is.
    """
    if threading.current_thread() is not threading.main_thread():
        return call()
    outcome: list[Any] = []
    failure: list[BaseException] = []

    def work() -> None:
        try:
            outcome.append(call())
        except BaseException as error:
            failure.append(error)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    while thread.is_alive():
        thread.join(0.2)
    if failure:
        raise failure[0]
    return outcome[0]
