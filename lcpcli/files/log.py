"""A log of results in JSON lines: it grows by one record at a time, and a run that was cut off goes on from it."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from lcpcli.errors import OptionError
from lcpcli.files.atomic_write import telling_of

OPENING = b'{"version": '
UNFINISHED = "interrupted"  # the status of a record that is made again
EXPECTED = "name a file that lcp solve -o FILE.jsonl has begun"


@contextmanager
def appended(path: str, anew: bool) -> Iterator[Callable[[str], None]]:
    """A context with a function that adds a text to the end of a file, where it is as soon as the function returns.

    anew : whether the file is empty at first.
    """
    with telling_of(path):
        file = Path(path).open("ab")  # noqa: SIM115

    def add(text: str) -> None:
        with telling_of(path):
            file.write(text.encode("utf-8", errors="backslashreplace"))
            file.flush()

    try:
        _lock(path, file)
        if anew and Path(path).is_file():
            with telling_of(path):
                file.truncate(0)
        yield add
    finally:
        with telling_of(path):
            file.close()  # which tries again to write what could not be written


def records(path: str) -> Iterator[Mapping[str, Any]]:
    """The finished records of a log, in order; OptionError if it is none.

    Cut-off ends: a last line that is not complete, and a last record that is unfinished, are removed from the file.
    """
    finished = 0
    try:
        with Path(path).open("r+b") as file:
            _lock(path, file)
            for number, line in enumerate(file, 1):
                record = None if _is_torn(line) else _record(path, number, line)
                if record is None or record["status"] == UNFINISHED:
                    break
                finished += len(line)
                yield record
            file.truncate(finished)
    except FileNotFoundError:
        raise OptionError(path, "no such file", EXPECTED) from None
    except OSError as error:
        raise OptionError(path, f"cannot be read ({error.strerror})", "make it readable and writable") from None


def _lock(path: str, file: IO[bytes]) -> None:
    """Have a file for oneself as long as it is open, where the system can; OptionError if another run has it."""
    try:
        import fcntl
    except ImportError:
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise OptionError(path, "is being written by another run", "wait for its end, or name another file") from None
    except OSError:  # a system of files without locks
        return


def _is_torn(line: bytes) -> bool:
    """Whether it is the beginning of a record."""
    return not line.endswith(b"\n") and (line.startswith(OPENING) or OPENING.startswith(line))


def _record(path: str, number: int, line: bytes) -> Mapping[str, Any]:
    try:
        held: Mapping[str, Any] = json.loads(line)
        if {"file", "item", "status", "exact"} <= held.keys():
            return held
    except (ValueError, RecursionError, AttributeError):
        pass
    raise OptionError(path, f"is not a log of results (line {number})", EXPECTED)
