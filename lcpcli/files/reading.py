"""Reading problems from files of any format, with errors that name the file."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence

from lcpcli.files.input_file import LINE, WHOLE, InputFile
from lcpcli.files.inputs import problem_of
from lcpcli.model.problem import Problem


def read(
    path: str | os.PathLike[str],
    q_path: str | os.PathLike[str] | None = None,
    *,
    infinity: float = math.inf,
) -> Problem:
    """Read the problem in one file, or with M in one file and q in another, of any
    formats; "-" is standard input.

    The format is recognized by the suffix of the name (.mtx.gz is compressed .mtx) and
    by the content. Bounds, and sides of a program's rows, whose size is `infinity` or
    more are infinite; a usual value is 1e20. Raises ProblemError, which says where the
    error is (file, field or line), what is wrong, and how to fix it.

    >>> from lcpcli import Problem, read, write
    >>> write(Problem([[2, 1], [1, 2]], [-5, -6], name="small"), "small.json")
    >>> read("small.json")
    <Problem small: n = 2, dense>
    >>> read("missing.json")
    Traceback (most recent call last):
    lcpcli.errors.ProblemError: missing.json: ...
    """
    files = files_of([os.fspath(each) for each in (path, q_path) if each is not None])
    return problem_in(files, infinity)


def problem_in(files: Sequence[InputFile], infinity: float) -> Problem:
    """Return the problem in one file or two; infinity : as in `read`."""
    problem = problem_of(files)
    if infinity == math.inf:
        return problem
    from lcpcli.model.changes import with_infinity

    changed = files[0].within(with_infinity, problem, infinity)
    numbers = problem.written
    if changed is problem or numbers is None or not numbers.are_short():
        return changed
    from lcpcli.rational.exact_problem import ExactProblem

    in_decimals = numbers._replace(exactly=ExactProblem.of_decimals)
    return changed.having(written=in_decimals)


def files_of(paths: Sequence[str]) -> list[InputFile]:
    """Read the file of a problem, or those of M and of q."""
    return list(map(InputFile.read, paths, (WHOLE, LINE)))
