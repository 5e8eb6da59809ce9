"""Locks on files, which are released when the process that holds them exits, however it
exits."""

from __future__ import annotations

from typing import IO, Any


def lock(file: IO[Any]) -> bool:
    """Lock an open file until it is closed. Return False if another process has locked
    it. On systems and file systems without locks, return True.
    """
    try:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except (ImportError, OSError):
        return True
    return True
