"""Problems written to files, in the format that the name asks for."""

from __future__ import annotations

import os
from pathlib import Path

from lcpcli.errors import ProblemError
from lcpcli.files.atomic_write import write_together
from lcpcli.files.formats import FORMATS, load
from lcpcli.model.problem import Problem


def write(problem: Problem, path: str | os.PathLike[str]) -> None:
    """Write a problem in the format that the file's name ends with, whole or not at all.

    JSON and NPZ keep everything. CSV and Matrix Market keep M and q alone; p.mtx is M, and q is p.q.mtx beside it.
    Raises ProblemError where the name has no known ending, or the place cannot be written.

    >>> from lcpcli import Problem, read, write
    >>> write(Problem([[2, 1], [1, 2]], [-5, -6]), "small.mtx")
    >>> read("small.mtx", "small.q.mtx").q.tolist()
    [-5.0, -6.0]
    """
    path = os.fspath(path)
    ending = ending_of(path)
    contents = load(FORMATS[ending]).render(problem)
    write_together({path.removesuffix(ending) + part + ending: content for part, content in contents.items()})


def ending_of(path: str) -> str:
    """The ending of a file to be written, one of FORMATS, or a ProblemError."""
    ending = Path(path).suffix
    if ending not in FORMATS:
        raise ProblemError(path, "has no format by its name", f"let it end with {' or '.join(FORMATS)}")
    return ending
