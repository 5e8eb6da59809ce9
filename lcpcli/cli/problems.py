"""The problems of a command, read and written. Known solutions that are wrong get a line each, and are dropped."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import click

from lcpcli.cli.output import emit
from lcpcli.errors import OptionError
from lcpcli.files.formats import COMPLETE

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.rational.problem import ExactProblem


Given = Mapping[str, str | None]  # bounds by their names, lower and upper


def read(files: Sequence[str], given: Given, quiet: bool = False) -> Problem:
    """The problem in one file, or in one with M and one with q, with the bounds given as options."""
    from lcpcli.files import bounds, reading

    return _vetted(bounds.bounded(reading.read(*files), given), files[0], quiet)


def read_exact(files: Sequence[str], given: Given, quiet: bool = False) -> ExactProblem:
    """The same with the decimals as written."""
    from lcpcli.files import bounds, reading

    data = bounds.exactly_bounded(reading.read_exact(*files), given)
    data.problem = _vetted(data.problem, files[0], quiet)
    return data


def read_each(files: Sequence[str], given: Given, quiet: bool = False) -> list[Problem]:
    """The problems in several files; one that holds M alone takes the next as its q. Bounds are for a single one."""
    from lcpcli.files import bounds, reading

    problems, left = [], files
    while left:
        problem, used = reading.read_next(left)
        problems.append((problem, left[0]))
        left = left[len(used) :]
    for name, text in given.items():
        if text is not None and len(problems) != 1:
            raise OptionError(f"--{name}", f"is given for {len(problems)} problems", "name one, or put it in the files")
    return [_vetted(bounds.bounded(problem, given), file, quiet) for problem, file in problems]


def inputs(files: Sequence[str], given: Given) -> list[str]:
    """The files of a problem, and what is given for its bounds: numbers or files."""
    return [*files, *(text for text in given.values() if text is not None)]


def write(made: Callable[[], Problem], output: str | None) -> Problem:
    """Make a problem and write it in the format of the file's suffix, or as JSON to standard output; return it.

    Raises OptionError before it is made if the file cannot be written.
    """
    from lcpcli.files import atomic_write, json_format, writing

    if output is not None:
        writing.ending_of(output)
        atomic_write.refuse_unwritable(output)
    problem = made()
    if output is None:
        emit(json_format.render(problem)[""].decode(), color=False)
    else:
        writing.write(problem, output)
    return problem


def lost(problem: Problem, output: str) -> list[str]:
    """What a problem holds that the format of the file does not keep."""
    if output.endswith(COMPLETE):
        return []
    held = {name: getattr(problem, name) for name in ("name", "source", "note", "x0", "x1", "verdict", "origin")}
    known = [name for name, value in held.items() if (value is not None and not isinstance(value, str)) or value]
    return [*known, *(["solution"] if problem.solutions else [])]


def tell(line: str) -> None:
    """Print a line about an input on standard error."""
    click.echo(f"lcp: {line}", err=True)


def _vetted(problem: Problem, file: str, quiet: bool) -> Problem:
    from lcpcli.files.reading import place
    from lcpcli.verify.known import without_wrong_solutions

    vetted, faults = without_wrong_solutions(problem)
    for fault in [] if quiet else faults:
        tell(f"{place(file)}: {fault}")
    return vetted
