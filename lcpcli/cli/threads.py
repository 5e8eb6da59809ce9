"""The number of BLAS threads of a command, set in the environment: numpy reads it there when it is loaded, later."""

from __future__ import annotations

import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from lcpcli import options
from lcpcli.linalg.threads import GENERAL, MANY_ROWS, VARIABLES

LARGE_FILE = 8 * MANY_ROWS**2  # bytes: a dense matrix of that many rows as .npz; text takes 2 or 3 times as many


def settle(files: Iterable[str | None], threads: int | None = None) -> None:
    """Set the number of threads, by default one, unless a file is so large that more pay.

    files : those of the problem; they are not read. threads : as asked for; only this replaces what the environment
        says already.
    """
    options.check((options.THREADS,), {options.THREADS.name: threads})
    if threads is not None:
        os.environ.update(dict.fromkeys(VARIABLES, str(threads)))
    elif not os.environ.get(GENERAL) and not any(_size(file) >= LARGE_FILE for file in files):
        os.environ.update({name: os.environ.get(name) or "1" for name in VARIABLES})


def _size(file: str | None) -> int:
    """In bytes; 0 if it cannot be known, as for a pipe."""
    with suppress(OSError, ValueError):
        return Path(file).stat().st_size if file else 0
    return 0
