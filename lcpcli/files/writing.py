"""Problems written to files, in the format given by the suffix."""

from __future__ import annotations

import os
from pathlib import Path

from lcpcli.errors import ProblemError
from lcpcli.files.atomic_write import write_together
from lcpcli.files.formats import COMPLETE, FORMATS, READ_ONLY, WITH_BOUNDS, load
from lcpcli.model.problem import Problem


def write(problem: Problem, path: str | os.PathLike[str]) -> None:
    """Write a problem in the format given by the suffix of the file, completely or not at all.

    .json, .npz and .mat keep everything, .csv M, q and the bounds, the others only M and q; p.mtx or p.npy is M, with q
    beside it in p.q.mtx or p.q.npy.
    Raises ProblemError if the suffix is unknown or the file cannot be written.

    >>> from lcpcli import Problem, read, write
    >>> write(Problem([[2, 1], [1, 2]], [-5, -6]), "small.mtx")
    >>> read("small.mtx", "small.q.mtx").q.tolist()
    [-5.0, -6.0]
    """
    path = os.fspath(path)
    ending = ending_of(path)
    if problem.is_mixed and ending not in WITH_BOUNDS:
        raise ProblemError(path, "cannot hold the bounds of z", f"use {', '.join(COMPLETE)} or .csv")
    contents = load(FORMATS[ending]).render(problem)
    write_together({path.removesuffix(ending) + part + ending: content for part, content in contents.items()})


def ending_of(path: str) -> str:
    """The suffix of a file to be written, one of FORMATS, or a ProblemError."""
    ending = Path(path).suffix
    if ending in READ_ONLY:
        raise ProblemError(path, "is of a format that is only read", f"use {' or '.join(COMPLETE)}")
    if ending not in FORMATS:
        raise ProblemError(path, "has no known suffix", f"use {' or '.join(FORMATS)}")
    return ending
