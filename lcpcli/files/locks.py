"""Files that one run has for itself as long as it writes them, where the system has locks."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from lcpcli.errors import OptionError


def opened_alone(path: str | Path, name: str) -> IO[bytes]:
    """A file, made where it is missing, that this run alone reads and writes until it is closed; a device or a pipe is
    only written.

    name : of the file in the OptionError if another run has it.
    """
    while True:
        if Path(path).exists() and not Path(path).is_file():
            return Path(path).open("ab")
        file = os.fdopen(os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o666), "r+b")
        try:
            _lock(file, name)
            if _is_at(path, file):
                return file
            file.close()
        except BaseException:
            file.close()
            raise


@contextmanager
def reserved(paths: Iterable[str]) -> Iterator[None]:
    """A context in which no other run has these files, each of which is replaced as a whole: locks are on files beside
    them.

    OptionError if another run has one.
    """
    targets = {Path(path).resolve(): path for path in paths}
    locks: list[tuple[Path, IO[bytes]]] = []
    try:
        for target, path in targets.items():
            if not target.exists() or target.is_file():
                beside = target.with_name(f".{target.name}.lock")
                with suppress(OSError):  # a folder that cannot be written, where nothing is going to be replaced
                    locks.append((beside, opened_alone(beside, path)))
        yield
    finally:
        for beside, file in locks:
            with suppress(OSError):
                beside.unlink()
            file.close()


def _lock(file: IO[bytes], name: str) -> None:
    try:
        import fcntl
    except ImportError:
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise OptionError(name, "is being written by another run", "wait for its end, or name another file") from None
    except OSError:  # a system of files without locks
        return


def _is_at(path: str | Path, file: IO[bytes]) -> bool:
    """Whether an open file still has that name: who had the lock before may have replaced it or removed it."""
    try:
        return os.path.samestat(os.fstat(file.fileno()), Path(path).stat())
    except FileNotFoundError:
        return False
